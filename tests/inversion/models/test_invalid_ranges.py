"""Ranges whose values break a rule between keys: named before any simulation; a point that slips through is one run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import CaseError, RunFailed, UserError
from birdstrike.data.histories import Array
from birdstrike.data.storage.store import RunStore
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.campaigns import ModelRuns
from birdstrike.inversion.models.candidates import calibrated_case, candidate
from birdstrike.inversion.models.simulations import LatePool, PlacedSolver, simulate_all
from birdstrike.solver.case.case import Case
from tests.inversion.models import rig

YOUNG, TANGENT = "bird.material.young", "bird.material.tangent_modulus"


def steep(case: Case, highest: str) -> Case:
    """A plastic kinematic bird whose tangent modulus may be above its Young's modulus."""
    ranges = {YOUNG: {"range": ["20 MPa", "60 MPa"]}, TANGENT: {"range": ["0 MPa", highest]}}
    return case.overlaid({"inversion": {"models": {"plastic_kinematic": ranges}}})


@pytest.mark.parametrize("highest", ["28 MPa", "50 MPa"])
def test_ranges_whose_ends_do_not_go_together_are_named_before_the_first_simulation(
    tmp_path: Path, highest: str
) -> None:
    """The first model was calibrated, and then the whole call ended without models.json."""
    cases, records = rig.shots()
    with rig.formula_for_solver():
        rig.CALLS.clear()
        with pytest.raises(UserError) as no:
            calibrate_models(
                [steep(case, highest) for case in cases], records, tmp_path, ["null", "plastic_kinematic"], runs=14
            )
        assert not rig.CALLS
    (line,) = no.value.errors
    assert line.startswith("--models plastic_kinematic: bird.material.tangent_modulus = ")
    assert f"(young 20 MPa, tangent modulus {highest}, inside the ranges)" in line
    assert line.endswith("narrow inversion.models.plastic_kinematic so that all values in the ranges go together")


def test_a_run_of_a_design_that_the_case_refuses_is_named_before_the_first_simulation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What no end of a range tells: the design's own runs are tried too."""
    monkeypatch.setattr("birdstrike.inversion.models.candidates.MOST_ENDS", 1)
    cases, records = rig.shots()
    with rig.formula_for_solver():
        rig.CALLS.clear()
        with pytest.raises(CaseError, match=r"^--models plastic_kinematic: .* narrow inversion.models.plastic_kinem"):
            calibrate_models(
                [steep(case, "50 MPa") for case in cases], records, tmp_path, ["null", "plastic_kinematic"], runs=14
            )
        assert not rig.CALLS


def test_a_point_that_a_case_refuses_is_a_run_that_fails(tmp_path: Path) -> None:
    case = calibrated_case(candidate("plastic_kinematic"), steep(rig.shot(80.0), "28 MPa"))
    store = RunStore(tmp_path)
    good, bad = {YOUNG: 40e6, TANGENT: 20e6}, {YOUNG: 25e6, TANGENT: 28e6}
    with rig.formula_for_solver(), LatePool(1) as pool:
        rig.CALLS.clear()
        simulate_all([(case, bad), (case, good)], store, pool)
        simulate_all([(case, bad)], store, pool)
        assert len(rig.CALLS) == 1
        PlacedSolver(case, store)(good)
        assert len(rig.CALLS) == 1  # the one point that can be simulated was
        with pytest.raises(RunFailed, match=r"tangent_modulus = .* is not below young.*; narrow the ranges: inversion"):
            PlacedSolver(case, store)(bad)


def test_one_refused_point_near_the_answer_or_of_an_optimiser_leaves_the_other_models_theirs(tmp_path: Path) -> None:
    """Such a point ended the command after all campaigns."""

    def refused(found: Any, points: int, _: int) -> Array:
        theta = found.calibration.modes[0].theta
        found = np.array([theta * (1.0 + 1e-3 * i) for i in range(points)])
        if len(theta) == 2:
            found[1] = 22e6, 27e6
        return found

    cases, records = rig.shots("plastic_kinematic", {YOUNG: 45e6, TANGENT: 10e6})
    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.inversion.models.candidates.MOST_ENDS", 1)
        patch.setattr(ModelRuns, "refuse_invalid_runs", lambda _: None)
        patch.setattr("birdstrike.inversion.models.campaigns.near_answer", refused)
        patch.setattr("birdstrike.inversion.models.campaigns._good_enough", lambda *_: False)
        patch.setattr("birdstrike.inversion.models.joint_fit.optimised", refused_start)
        found = calibrate_models(
            [steep(case, "28 MPa") for case in cases],
            records,
            tmp_path,
            ["plastic_kinematic", "null"],
            runs=14,
            seed=VALID,
            workers=1,
            posterior=False,
            optimisers=["least_squares"],
        )
    assert set(found.ranking) == {"plastic_kinematic", "null"}
    own = found.models["plastic_kinematic"].warnings
    assert any(
        line.startswith("a run near the answer failed and is left out: bird.material.tangent_modulus = 27")
        for line in own
    )
    assert any("is not below young" in line and "--optimisers" in line for line in own)


VALID = 1  # seed of a design that holds no such point


def refused_start(name: str, problem: Any) -> Any:
    """An optimiser that begins where the case refuses the values."""
    if YOUNG in problem.names:
        return problem.residuals({YOUNG: 22e6, TANGENT: 27e6})
    raise RunFailed(f"{name}: not run here")
