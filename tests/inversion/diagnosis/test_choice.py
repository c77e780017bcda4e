"""The verdict from judged models: what may be named, and what is as good as no effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.choice import Choice, level, why_unnamed
from birdstrike.inversion.diagnosis.diagnosis import EffectFigures, State
from birdstrike.inversion.diagnosis.groundwork import Groundwork
from birdstrike.inversion.diagnosis.judge import Judged
from birdstrike.inversion.diagnosis.responses import Response, library
from birdstrike.inversion.diagnosis.tolerances import TOLERANCES, tolerance_figures
from birdstrike.inversion.diagnosis.verdict import (
    AMBIGUOUS,
    AT_LIMIT,
    ATTRIBUTED,
    NO_RESIDUAL,
    NONE,
    UNEXPLAINED,
    UNSEEN,
)
from birdstrike.inversion.diagnosis.words import sentence
from tests.inversion.diagnosis.toy_study import TIME, curves, groundwork, judge

NOISE = 2e-5
(VALUES,) = curves(np.full((1, 2), 0.5))
DRIFT = 0.1  # m/s: one plausible size


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Groundwork:
    """The toy with drift and gain as effects, and one of the plate that changes nothing."""
    plain = groundwork(tmp_path_factory.mktemp("choice"))
    silent = next(one for one in library(plain.case)[0] if one.name == "plate_yield")
    known = (*(one for one in plain.known if one.name != "sensor_bandwidth"), silent)
    none = np.zeros(len(TIME))
    still = Response(none, none, np.zeros((0, len(TIME))), none, 2.0)
    return replace(plain, known=known, responses={"plate_yield": still})


def drifting(ground: Groundwork, sizes: float, most: float) -> dict[str, Judged]:
    """Models of a record that drifts, where the drift is looked for up to `most` sizes."""
    limited = tuple(replace(k, least=-most, most=most) if k.name == "sensor_drift" else k for k in ground.known)
    noise = NOISE * np.random.default_rng(2).standard_normal(len(TIME))
    record = VALUES[0] + sizes * DRIFT * TIME + noise
    return judge(replace(ground, known=limited), [record], NOISE).models()


def test_an_effect_is_named_inside_the_limits_of_the_search_and_not_at_them(ground: Groundwork) -> None:
    free = Choice.of(drifting(ground, 3.0, most=20.0), 0.05)
    assert (free.verdict, free.allowed, free.unnamed) == (ATTRIBUTED, ("sensor_drift",), None)
    held = Choice.of(drifting(ground, 3.0, most=2.5), 0.05)
    assert (held.verdict, held.allowed, held.unnamed) == (AMBIGUOUS, ("sensor_drift",), AT_LIMIT)
    assert held.chosen is not None
    assert held.chosen.name == "sensor_drift"


def test_the_sentence_says_that_the_limit_was_reached() -> None:
    one = EffectFigures("sensor_drift", 0.3, "m/s", None, 0.4, 9.0, {}, True, None, {}, 0.1, "drift", True)
    before, after = (State(name, {}, size, size, {}, {}) for name, size in ((NONE, 3.0), ("sensor_drift", 1.1)))
    said = sentence(AMBIGUOUS, ("sensor_drift",), {NONE: one, "sensor_drift": one}, before, after, 0.05, AT_LIMIT)
    assert "only at the largest magnitude looked at: it is not named" in said
    assert "3.00 before, 1.10 after" in said


def with_p(one: Judged, p: float) -> Judged:
    return replace(one, consistency=replace(one.consistency, p=p))


def test_an_effect_that_changes_nothing_is_as_consistent_as_none(ground: Groundwork) -> None:
    models = drifting(ground, 3.0, most=20.0)
    told = {name: with_p(one, 0.3 if name == "plate_yield" else 0.01) for name, one in models.items()}
    assert level(told)["plate_yield"].p == 0.01
    assert level(told)["sensor_drift"].p == 0.01
    assert Choice.of(told, 0.05).verdict == UNEXPLAINED
    found = Choice.of(told | {NONE: with_p(told[NONE], 0.2)}, 0.05)
    assert (found.verdict, set(found.allowed)) == (NO_RESIDUAL, {NONE, "plate_yield"})


def test_an_effect_without_a_signature_is_never_named_alone(ground: Groundwork) -> None:
    models = drifting(ground, 3.0, most=20.0)
    assert why_unnamed(models["sensor_drift"]) is None
    assert why_unnamed(models["plate_yield"]) == UNSEEN


def test_each_tolerance_tells_verdict_errors_and_magnitudes(ground: Groundwork) -> None:
    sizes = 8.0
    record = VALUES[0] + sizes * DRIFT * TIME
    told = {}
    for tolerance in (min(TOLERANCES), max(TOLERANCES)):
        one = judge(ground, [record], 0.0, tolerance)
        told[tolerance] = tolerance_figures(tolerance, one, one.models(), 0.05)
    narrow, wide = told.values()
    assert (narrow["verdict"], narrow["chosen"]) == (ATTRIBUTED, "sensor_drift")
    assert narrow["after"]["rmse"]["middle"] < 0.3 * narrow["before"]["rmse"]["middle"]
    assert narrow["after"]["weighted"] < 0.5 * narrow["before"]["weighted"]
    (drift,) = narrow["effects"]
    assert drift["interval_95"][0] < sizes * DRIFT < drift["interval_95"][1]
    assert (wide["verdict"], wide["chosen"], wide["after"]) == (NO_RESIDUAL, None, None)
    evidence = [one["log_evidence"] for one in wide["effects"]]
    assert len(evidence) > 1
    assert evidence == sorted(evidence, reverse=True)
