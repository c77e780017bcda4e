"""What follows where the birds are not of one recipe."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from birdstrike.inversion.diagnosis.conclusions.answer import verdict_of
from birdstrike.inversion.diagnosis.conclusions.baseline import Birds
from birdstrike.inversion.results.diagnosis import NONE


@pytest.mark.parametrize(("stated", "expected"), [("same", True), ("other", False), ("auto", False)])
def test_records_contradict_a_stated_bird_that_they_make_unlikely(stated: str, expected: bool) -> None:
    ranking: Any = SimpleNamespace(birds={"same": 0.001, "recipe": 0.049, "other": 0.95}, same_bird=1.0)
    birds = Birds(ranking, stated, several=True)
    assert birds.contradicted is expected
    assert birds.same == (0.0 if expected else 1.0)  # 0: nothing is attributed


@pytest.mark.parametrize(("same_bird", "verdict"), [(None, "attributed"), (0.9, "attributed"), (0.1, "ambiguous")])
def test_beside_a_baseline_of_another_bird_nothing_is_attributed(same_bird: float | None, verdict: str) -> None:
    presence = {NONE: 0.01, "e0": 0.97, "e1": 0.02}
    assert verdict_of(presence, 0.001, 0.05, ("e0",), same_bird) == verdict
