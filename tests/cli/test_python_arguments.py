"""The Python functions' arguments: what does not fit is refused by name before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import birdstrike
from birdstrike.data.errors import UserError

COARSE = {"bird.particles": 120, "plate.elements": [10, 8]}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"step_factor": 0}, "step_factor = 0 is no number above 0"),
        ({"step_factor": -1.0}, "step_factor = -1.0 is no number above 0"),
        ({"step_factor": float("nan")}, "step_factor = nan is no number above 0"),
        ({"step_factor": "half"}, "step_factor = 'half' is no number above 0"),
        ({"threads": -2}, "threads = -2 is no whole number of at least 1"),
        ({"threads": 0}, "threads = 0 is no whole number of at least 1"),
        ({"threads": 2.5}, "threads = 2.5 is no whole number of at least 1"),
    ],
)
def test_a_simulation_refuses_a_step_or_threads_that_it_cannot_have(given: Mapping[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        birdstrike.simulate(birdstrike.load_case("demo", COARSE), **given)


@pytest.mark.parametrize("given", [{"runs": 9.5}, {"runs": "9"}, {"seed": 1.5}, {"seed": "a"}, {"workers": 1.5}])
def test_a_campaign_counts_in_whole_numbers(given: Mapping[str, Any], tmp_path: Path) -> None:
    ((name, value),) = given.items()
    with pytest.raises(UserError, match=f"--{name} = {value!r} is no whole number"):
        birdstrike.run_doe(birdstrike.load_case("demo", COARSE), tmp_path / "campaign", **given)
    assert not list(tmp_path.rglob("*.h5"))


@pytest.mark.parametrize("given", [{"runs": 8.5}, {"runs": "x"}, {"budget": 1.5}, {"budget": "x"}, {"seed": 0.5}])
def test_a_calibration_of_models_counts_in_whole_numbers(
    given: Mapping[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(_: object) -> None:
        raise AssertionError("a calibration was begun")

    monkeypatch.setattr("birdstrike.inversion.models.calibrate_models._answer", computed)
    ((name, value),) = given.items()
    with pytest.raises(UserError, match=f"--{name} = {value!r} is no whole number"):
        birdstrike.calibrate_models("demo", "table7_group5", tmp_path / "models", **given)


def test_a_mesh_study_counts_in_whole_numbers(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"--meshes = 3.5 is no whole number"):
        birdstrike.converge("demo", tmp_path / "study", meshes=3.5)  # pyright: ignore[reportArgumentType]
