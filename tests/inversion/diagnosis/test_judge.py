"""Models judged on a toy that needs no strike."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.inversion.diagnosis.diagnose import Study, Wishes
from birdstrike.inversion.diagnosis.following import followed
from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.model_error import emulator_error
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.verdict import NO_RESIDUAL, NONE, UNEXPLAINED, verdict
from birdstrike.solver.case.case import Case
from tests.inversion.diagnosis.toy_study import HIGHS, LOWS, SCATTER, SIZE, TIME, curves, groundwork, judge

MIDDLE = np.full((1, 2), 0.5)


def test_the_emulators_error_holds_the_whole_scatter_of_a_new_run(tmp_path: Path) -> None:
    ground = groundwork(tmp_path)
    (values,) = curves(MIDDLE)
    model = ground.model(judge(ground, [values[0]], 1e-5).record)
    theta = 0.5 * (LOWS + HIGHS)
    said = np.diag(emulator_error(model, theta, np.zeros(len(model.known))))
    assert said == pytest.approx(np.diag(ground.emulator.covariance(theta, "middle", TIME)))
    # never less than the scatter; more by what the mean curve errs and Student's t for so few runs
    assert 0.9 < np.sqrt(said.mean()) / SCATTER < 1.35


class Answers(Strikes):
    """Strikes that fail for some models and answer the others with the emulated curve, off by a shift."""

    def __init__(self, ground: Groundwork, shift: float = 0.0, failing: tuple[str, ...] = ()) -> None:
        super().__init__("unused")
        self.ground, self.shift, self.failing, self.asked = ground, shift, failing, 0

    def run(self, cases: Mapping[str, Case]) -> dict[str, Histories]:
        self.asked += 1
        self.failures |= dict.fromkeys((name for name in cases if name.split()[0] in self.failing), "it blew up")
        off = [self.shift * self.asked**2 * np.sin(np.pi * TIME / TIME[-1])] * len(self.ground.clock.channels)
        found: dict[str, Histories] = {}
        for name, case in cases.items():
            if name.split()[0] not in self.failing:
                clean = curves(self._unit(case)[None], len(off))
                channels = {c: y[0] + o for c, y, o in zip(self.ground.clock.channels, clean, off, strict=True)}
                found[name] = Histories(TIME, channels, {})
        return found

    def _unit(self, case: Case) -> np.ndarray:
        values = [case.bird.material.viscosity, case.bird.material.eos.c0]
        return (np.array(values) - LOWS) / (HIGHS - LOWS)


def test_a_model_is_confirmed_only_where_the_solver_answered_and_the_fit_settled(tmp_path: Path) -> None:
    ground = groundwork(tmp_path, 3)
    one = judge(ground, [y[0] for y in curves(MIDDLE, 3)], 1e-5)
    models = {NONE: one.judged(NONE, one.start()[0])}
    settled = one.confirm([models[NONE]], Answers(ground))[NONE]
    assert settled.confirmed
    assert not settled.doubt
    failed = one.confirm([models[NONE]], Answers(ground, failing=(NONE,)))[NONE]
    assert not failed.confirmed
    assert "it blew up" in failed.doubt
    moving = one.confirm([models[NONE]], Answers(ground, shift=3e-4))[NONE]
    assert not moving.confirmed
    assert "still moved" in moving.doubt


def test_figures_of_three_channels_come_out_when_a_strike_has_failed(tmp_path: Path) -> None:
    ground = groundwork(tmp_path, 3)
    one = judge(ground, [y[0] for y in curves(MIDDLE, 3)], 1e-5)
    strikes = Answers(ground, failing=(NONE,))
    models = one.confirm([one.judged(NONE, one.start()[0])], strikes)
    study = Study(ground, strikes, Wishes())
    assert study._strikes(one, models)["emulator_error"] == {}
    (warning,) = [w for w in study._warnings(one, models, None, NO_RESIDUAL, {}) if "not confirmed" in w]
    assert "none" in warning


def test_a_stated_tolerance_is_judged_as_a_known_noise(tmp_path: Path) -> None:
    ground = groundwork(tmp_path)
    values = curves(MIDDLE)[0][0] + 0.02 * SIZE * np.sin(40.0 * TIME / TIME[-1])
    p = {}
    for tolerance in (0.002, 0.05):
        one = judge(ground, [values], 0.0, tolerance=tolerance)
        assert not one.record.noise_known
        p[tolerance] = one.judged(NONE, one.start()[0]).p
    assert p[0.002] < 0.01
    assert p[0.05] > 0.5


def test_nothing_is_unexplained_by_a_noise_level_that_the_fit_tells() -> None:
    assert verdict(()) == UNEXPLAINED
    assert verdict((), inferred=True) != UNEXPLAINED


def test_a_strike_is_followed_by_what_is_not_its_roughness_and_whole_where_it_refutes_the_emulator() -> None:
    known, rough = np.full(50, 3.0), np.full(50, 1.0)
    assert followed(known, rough, np.full(50, 1.5), 1) == pytest.approx(0.75)
    assert followed(0.0 * known, rough, np.full(50, 1.5), 1) == pytest.approx(0.0)
    assert followed(0.0 * known, rough, np.full(50, 10.0), 1) == pytest.approx(0.99)
    both = followed(np.repeat([3.0, 0.0], 50), np.ones(100), np.ones(100), 2)
    assert both == pytest.approx(np.repeat([0.75, 0.0], 50))
