"""Intervals and evidence of fits that a bound holds, and of models whose errors differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.inversion.audit.coverage import covered
from birdstrike.inversion.audit.draws import Draws
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.evidence import log_evidence, magnitude, parameter_intervals
from birdstrike.inversion.diagnosis.judge import Judge
from birdstrike.inversion.diagnosis.refit import Fit, fit_effect
from birdstrike.inversion.diagnosis.verdict import NONE
from tests.inversion.diagnosis.toy_study import HIGHS, LOWS, NAMES, TIME, curves, groundwork, judge

NOISE = 1e-4


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> tuple[Judge, Fit]:
    """A record whose first parameter lies below its range, and the fit, which the bound holds."""
    ground = groundwork(tmp_path_factory.mktemp("refit"))
    one = judge(ground, [curves(np.array([[-0.2, 0.5]]))[0][0]], NOISE)
    return one, one.start()[0]


def test_a_parameter_at_its_bound_keeps_the_width_that_the_data_leave(held: tuple[Judge, Fit]) -> None:
    one, fit = held
    assert fit.at_bound[0]
    _, (low, high) = parameter_intervals(fit)[NAMES[0]]
    span = HIGHS[0] - LOWS[0]
    assert low == pytest.approx(fit.theta[0])
    assert 0.005 < (high - low) / span < 0.2
    truth = {NAMES[0]: float(fit.theta[0]) + 0.1 * (high - low), NAMES[1]: float(fit.theta[1])}
    draws = Draws((), (), {NONE: np.tile(fit.x, (3, 1))})
    assert covered(one, one.judged(NONE, fit), draws, truth, 0.0)[NAMES[0]].tolist() == [1.0, 1.0, 1.0]


def test_evidence_does_not_rise_by_the_mere_unit_of_the_errors(held: tuple[Judge, Fit]) -> None:
    _, fit = held
    whitener = fit.problem.whitener
    louder = Whitener(whitener.used, whitener.inverse / 100.0)
    n = len(TIME)
    assert louder.log_determinant - whitener.log_determinant == pytest.approx(2.0 * n * np.log(100.0))
    quiet = replace(fit, cost=float(n))
    loud = replace(fit, cost=float(n) / 1e4, problem=replace(fit.problem, whitener=louder))
    assert log_evidence(loud) < log_evidence(quiet)


def test_a_one_sided_effect_held_at_zero_never_stands_above_none(held: tuple[Judge, Fit]) -> None:
    _, base = held
    index = base.problem.index("sensor_bandwidth")
    silent = replace(fit_effect(base.problem, (index,), [base]), x=np.append(base.x, 0.0), cost=base.cost)
    assert base.problem.model.known[index].one_sided
    assert log_evidence(silent) < log_evidence(base)
    assert len(silent.whole_design.T) == len(base.x) + 1


def test_an_effect_at_the_end_of_the_search_has_no_interval(held: tuple[Judge, Fit]) -> None:
    one, base = held
    index = base.problem.index("sensor_gain")
    most = base.problem.model.known[index].most
    fit = replace(fit_effect(base.problem, (index,), [base]), x=np.append(base.x, most))
    assert fit.at_limit
    value, interval = magnitude(one.judged("sensor_gain", fit))
    assert interval is None
    assert value == pytest.approx(base.problem.model.known[index].magnitude(most))
