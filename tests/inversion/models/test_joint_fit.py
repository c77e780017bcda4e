"""The joint fit: one clock of all its figures, the size of its discrepancy, the objective of optimisers beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.inversion.models import joint_fit
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.candidates import calibrated_case, candidate
from birdstrike.inversion.models.joint_fit import ModelFit
from birdstrike.inversion.models.results import Optimised
from birdstrike.solver.case.case import Case
from tests.inversion.models import rig

LATE = (40e-6, 70e-6)


def later(record: Measured, t0: float) -> Measured:
    """The record of a clock that was started too early by t0."""
    return replace(record, time=record.time + t0)


def test_all_errors_of_a_model_are_by_the_clocks_of_its_joint_fit(tmp_path: Path) -> None:
    """The fit moves both records together, here by 30 us from their own fits.

    The second shot's verification, and the first shot's errors by optimisers and published constants, were by the
    clocks of the shots' own fits.
    """
    cases, records = rig.shots()
    cases = [case.overlaid({"inversion": {"nuisance": {"time_offset": "50 us"}}}) for case in cases]
    records = [later(record, t0) for record, t0 in zip(records, LATE, strict=True)]
    own = {id_of(record): (t0 - 30e-6, True) for record, t0 in zip(records, LATE, strict=True)}
    at_truth: list[float] = []

    def at_the_truth(_: str, problem: Any) -> Optimised:
        at_truth.append(float(np.linalg.norm(problem.residuals(rig.TRUTH))))
        return Optimised(rig.TRUTH, at_truth[0], 1, "")

    with rig.formula_for_solver() as patch:
        patch.setattr(joint_fit, "own_origin", lambda shot: own[id_of(shot.measured)])
        patch.setattr(joint_fit, "optimised", at_the_truth)
        found = calibrate_models(
            cases,
            records,
            tmp_path,
            ["murnaghan"],
            runs=12,
            workers=1,
            posterior=False,
            optimisers=["least_squares"],
        )
    verified = found.models["murnaghan"].verified
    assert {shot: round(error.weighted) for shot, error in verified.items()} == {"shot_0": 1, "shot_1": 1}
    assert at_truth[0] == pytest.approx(1.0, abs=0.2)
    for what in ("calibrated", "published"):
        first, second = (start_of(tmp_path / "murnaghan" / f"{what}_shot_{i}.csv") for i in (0, 1))
        assert first == pytest.approx(LATE[0], abs=3e-6)
        assert second - first == pytest.approx(LATE[1] - LATE[0], abs=1e-9)


def id_of(record: Measured) -> str:
    """A record by its file."""
    return record.path


def start_of(path: Path) -> float:
    """First instant [s] of a file of curves."""
    rows = [row for row in path.read_text(encoding="utf-8").splitlines() if row and not row.startswith("#")]
    assert rows[0].startswith("time_s,")
    return float(rows[1].split(",")[0])


def test_an_optimiser_s_objective_counts_every_channel_and_shot_once(tmp_path: Path) -> None:
    """Root of the mean over shots, channels and points of the squared residual over noise, by hand."""
    cases, records = rig.shots()
    side = records[1].channels["displacement_side"].copy()
    side[10:] = np.nan  # a channel of fewer points counts as much
    records[1] = replace(records[1], channels={**records[1].channels, "displacement_side": side})
    with rig.formula_for_solver():
        found = calibrate_models(
            cases,
            records,
            tmp_path,
            ["murnaghan"],
            runs=10,
            workers=1,
            posterior=False,
            optimisers=["least_squares"],
            budget=3,
        )
    reached = found.models["murnaghan"].optimised["least_squares"]
    squares = [mean_squares(case, record, reached.parameters) for case, record in zip(cases, records, strict=True)]
    assert reached.weighted == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)


def mean_squares(case: Case, record: Measured, values: Mapping[str, float]) -> list[float]:
    """Of each channel of a record, over the noise."""
    run = rig.strike(calibrated_case(candidate("murnaghan"), case).with_values(values))
    return [
        float(np.nanmean(((np.interp(record.time, run.time, run.channels[name]) - seen) / rig.NOISE) ** 2))
        for name, seen in record.channels.items()
    ]


@pytest.mark.parametrize(("costs", "share"), [((5.0, 3.0, 4.0, 9.0), 0.002), ((5.0, 3.0, 2.0, 1.0), 0.0)])
def test_a_model_that_asks_for_the_largest_discrepancy_is_fitted_without(
    costs: tuple[float, ...], share: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the discrepancy would take what the constants should fit."""
    shares = joint_fit.AMPLITUDES
    assert shares == (0.0, 0.002, 0.01, 0.03)
    cost_of = dict(zip(shares, costs, strict=True))

    def located(*given: Any) -> Any:
        return SimpleNamespace(calibration=SimpleNamespace(modes=[SimpleNamespace(cost=cost_of[given[-1]])]))

    monkeypatch.setattr(joint_fit, "with_discrepancy", lambda _columns, _discrepancy, one: one)
    monkeypatch.setattr(joint_fit, "locate", located)
    anything: Any = SimpleNamespace(measured=None, options=None, columns=None)
    found, fit = ModelFit(anything)._best_share(anything, anything, anything, anything)
    assert found == share
    assert fit.calibration.modes[0].cost == cost_of[share]
