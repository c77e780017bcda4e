"""A campaign's record: `summary.json` while it runs and when it is done, and the Dataset read back from the folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from data.dataset import Dataset
from data.errors import UserError
from data.files import write_json
from data.histories import Array
from doe.activity import inactive_runs
from doe.curves_file import read_curves
from doe.designs import Design
from doe.folder import CampaignFolder, design_text, rows_digest, space_json
from doe.strike import Failed, Finished
from solver.case import Case, case_hash

SMOOTH_LIMIT = 0.05
"""Largest eroded share of the bird's mass for which a run still belongs to the smooth regime."""


def running(folder: CampaignFolder, case: Case, design: Design, version: str) -> dict[str, Any]:
    """Write the summary of a campaign that has not finished, and return it."""
    summary: dict[str, Any] = {
        "state": "running",
        "case_name": case.name,
        "case_hash": case_hash(case),
        "solver_version": version,
        "design": {
            "kind": design.kind,
            "seed": design.seed,
            "source": design.source,
            "runs": len(design.numbers),
            "digest": rows_digest(design_text(design).splitlines()),
            **design.quality().as_json(),
        },
        "space": space_json(design.space),
        "inactive_runs": inactive_runs(design),
        "runs": [{"run": int(number), "status": "pending"} for number in design.numbers],
        "failed": [],
    }
    write_json(folder.summary, summary)
    return summary


def settled(folder: CampaignFolder, summary: Mapping[str, Any], outcomes: Mapping[int, Finished | Failed]) -> None:
    """Write the summary of a campaign whose strikes have all ended, one way or the other."""
    failed = [{"run": n, "reason": outcome.reason} for n, outcome in outcomes.items() if isinstance(outcome, Failed)]
    runs = [{"run": number, **_fate(outcome)} for number, outcome in outcomes.items()]
    write_json(folder.summary, {**summary, "state": "finished", "runs": runs, "failed": failed})


def _fate(outcome: Finished | Failed) -> dict[str, Any]:
    if isinstance(outcome, Failed):
        return {"status": "failed", "reason": outcome.reason}
    return {
        "status": "finished",
        "key": outcome.key,
        "step_factor": outcome.step_factor,
        "smooth": is_smooth(outcome.books),
        **outcome.books,
    }


def is_smooth(books: Mapping[str, Any]) -> bool:
    """Whether the bird kept its mass but for SMOOTH_LIMIT; a solver that reports no erosion has none."""
    lost = books.get("eroded_mass_fraction")
    return not (isinstance(lost, int | float) and lost > SMOOTH_LIMIT)


def load_dataset(out: str | Path) -> Dataset:
    """The Dataset of a finished campaign's folder; raises UserError where there is none."""
    folder = CampaignFolder(Path(out))
    summary = folder.read_summary()
    if summary.get("state") != "finished" or not folder.curves.exists():
        raise UserError(f"{out} holds no finished campaign; {_remedy(summary)}")
    numbers, time, curves, units = read_curves(folder.curves)
    smooth = {entry["run"]: entry.get("smooth", True) for entry in summary["runs"]}
    space = summary["space"]
    return Dataset(
        names=tuple(space["names"]),
        units=tuple(space["units"]),
        lows=np.array(space["lows"], dtype=float),
        highs=np.array(space["highs"], dtype=float),
        runs=numbers,
        parameters=_parameters(folder, numbers),
        time=time,
        curves=curves,
        channel_units=units,
        smooth=np.array([smooth[int(number)] for number in numbers], dtype=bool),
        case_hash=summary["case_hash"],
    )


def _parameters(folder: CampaignFolder, numbers: np.ndarray) -> Array:
    """SI values (n, k) of the given runs from `design.csv`."""
    table = np.loadtxt(folder.design, delimiter=",", skiprows=1, ndmin=2, dtype=np.float64)
    row_of = {int(number): row for row, number in enumerate(table[:, 0])}
    return table[[row_of[int(number)] for number in numbers], 1:]


def _remedy(summary: Mapping[str, Any]) -> str:
    if not summary:
        return "make one with: birdstrike run-doe CASE --out DIR"
    if summary.get("state") == "finished":
        return "none of its strikes finished: see its summary.json"
    return "it was stopped midway: run the same birdstrike run-doe again to resume"
