"""Shots of one call share the forward models that they can."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from birdstrike.data.histories import Histories
from birdstrike.inversion.campaign_shots import ShotReader
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.observations.filters import ModelFilter
from birdstrike.solver.case.case import load_case


def test_shots_share_a_forward_model_that_is_given(tmp_path: Path) -> None:
    """Joined shots run one that they share once."""

    def given(_: Any) -> Histories:
        raise AssertionError

    case = load_case("demo")
    other, shorter = case.overlaid({"impact": {"speed": "80 m/s"}}), ModelFilter("CFC1000", 1.9e-3, 5e-6)
    call = ShotReader([], tmp_path, InversionOptions(), Extras(), given, 0.0)
    own = ShotReader([], tmp_path, InversionOptions(), Extras(), None, 0.0)
    for passed in (None, ModelFilter("CFC1000", 2.0e-3, 5e-6)):
        assert call.solver(case, passed) is call.solver(other, passed)
        assert own.solver(case, passed) is own.solver(load_case("demo"), passed)
        assert own.solver(case, passed) is not own.solver(other, passed)
        assert own.solver(case, passed) is not own.solver(case, shorter)
