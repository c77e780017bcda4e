"""What was held out, before and after."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from birdstrike.inversion.diagnosis.conclusions.before_and_after import Held, predicts_better


def test_a_part_that_holds_all_that_an_effect_acts_on_does_not_judge_it() -> None:
    """A fault of one sensor cannot be told from the others, nor an effect of one shot from the other shots."""
    parts = ("time_block", "channel a", "channel b", "shot one")
    before = [Held.of(name, np.ones(9), np.ones(9), "one") for name in parts]
    after = [
        Held.of(name, np.full(9, off), np.ones(9), "one") for name, off in zip(parts, (0.9, 9, 0.9, 9), strict=True)
    ]
    fault: Any = SimpleNamespace(shots=("one",), fault=SimpleNamespace(sensors=("a",)))
    of_all: Any = SimpleNamespace(shots=("one", "two"), fault=None)
    of_one_sensor: Any = SimpleNamespace(shots=("one", "two"), fault=SimpleNamespace(sensors=("a",)))
    assert predicts_better(fault, before, after)
    assert not predicts_better(of_all, before, after)
    assert not predicts_better(of_one_sensor, before, after)  # shot one's own record could tell
    assert predicts_better(of_all, before[:1], after[:1])
    assert predicts_better(of_all, [], [])  # nothing was held out


def test_a_model_that_overstates_its_errors_is_not_the_better_for_it() -> None:
    """Residuals of 0.3 beside stated errors of 2 are likelier under stated errors of 0.3."""
    residual = 0.3 * np.random.default_rng(0).standard_normal(500)
    before, after = (Held.of("time_block", residual, np.full(500, sd), "one") for sd in (2.0, 0.3))
    assert before.error < 0.2 < 0.9 < after.error
    of_all: Any = SimpleNamespace(shots=("one", "two"), fault=None)
    assert predicts_better(of_all, [before], [after])
    assert not predicts_better(of_all, [after], [before])
