"""Results of a campaign: `curves.csv`, `summary.json` while it runs and when it is done, and the Dataset read back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from birdstrike.data.curves import split_unit
from birdstrike.data.dataset import SMOOTH_LOSS, Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.formatting import reading
from birdstrike.data.histories import Array, Histories
from birdstrike.data.run_warnings import merged
from birdstrike.data.storage.files import file_digest, whole_file, write_json
from birdstrike.data.storage.out_folder import maker_of
from birdstrike.doe.campaign.folder import (
    CampaignFolder,
    campaign_within,
    design_text,
    rows_digest,
    space_json,
)
from birdstrike.doe.campaign.run import Failed, Finished, PlannedRun
from birdstrike.doe.designs.design import Design
from birdstrike.solver.case.case import Case, case_hash

Numbered = tuple[int, Histories]

AT_A_TIME = 200
"""Runs that are held in memory while the file is written."""


def write_curves(path: Path, histories: Iterable[Numbered]) -> None:
    """`run`, `time_s`, each channel with its unit; every bit of the doubles, same curves same bytes (-0.0 is 0.0).

    histories: run number and histories, at least one, all on one clock; raises RunFailed when they are not.
    """
    runs = iter(histories)
    first = next(runs)
    with whole_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        for i, some in enumerate(_chunks(chain([first], runs))):
            _table(some, first[1]).to_csv(file, index=False, header=i == 0, lineterminator="\n")


def _chunks(runs: Iterator[Numbered]) -> Iterator[list[Numbered]]:
    while some := list(islice(runs, AT_A_TIME)):
        yield some


def _table(runs: list[Numbered], first: Histories) -> pd.DataFrame:
    for number, run in runs:
        _check_clock(number, run, first)
    columns: dict[str, Array | NDArray[np.int64]] = {
        "run": np.repeat(np.array([number for number, _ in runs]), len(first.time)),
        "time_s": np.concatenate([run.time for _, run in runs]),
    }
    for name, unit in first.units.items():
        columns[f"{name}_{unit}".rstrip("_")] = np.concatenate([run.channels[name] + 0.0 for _, run in runs])
    return pd.DataFrame(columns)


def _check_clock(number: int, run: Histories, first: Histories) -> None:
    same = run.time.shape == first.time.shape and np.allclose(run.time, first.time, rtol=1e-9, atol=0.0)
    if not same or run.units != first.units:
        raise RunFailed(
            f"run {number} does not share the other runs' clock or channels: their curves cannot be compared",
            "keep time.* and sensors.* out of inversion.parameters",
        )


def read_curves(path: Path) -> tuple[NDArray[np.int64], Array, dict[str, Array], dict[str, str]]:
    """Run numbers (n,), time (m,), channels {sensor: (n, m)} and their SI units."""
    with path.open(encoding="utf-8") as lines:
        named = dict(split_unit(column) for column in lines.readline().strip().split(",")[2:])
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2, dtype=np.float64)
    first = np.flatnonzero(np.diff(table[:, 0], prepend=np.nan))
    numbers = table[first, 0].astype(np.int64)
    by_run = table.reshape(len(numbers), -1, table.shape[1])
    curves: dict[str, Array] = {name: by_run[:, :, column].copy() for column, name in enumerate(named, start=2)}
    return numbers, by_run[0, :, 1].copy(), curves, named


def inactive_runs(design: Design, runs: Iterable[PlannedRun]) -> dict[str, int]:
    """Number of runs in which a varied erosion limit erodes nothing, by its dotted key, where there are any."""
    counts = Counter(name for run in runs for name in run.inactive)
    return {name: counts[name] for name in design.names if counts[name]}


OTHER_SCALE = 100.0
"""Factor between the largest reading of a run and that of the median run, beyond which units are in doubt."""


def other_scale(dataset: Dataset) -> dict[int, str]:
    """Run -> what makes one doubt its units: a largest reading far from the median run's; {} for none.

    Readings that are 0 throughout are left alone: a bird may pass beside a sensor.
    """
    found: dict[int, str] = {}
    for name, curves in dataset.curves.items():
        peaks = np.max(np.abs(curves), axis=1)
        middle, unit = float(np.median(peaks)), dataset.channel_units[name]
        for number, peak in zip(dataset.runs, peaks, strict=True):
            if peak > 0.0 and middle > 0.0 and not 1.0 / OTHER_SCALE < peak / middle < OTHER_SCALE:
                found[int(number)] = (
                    f"its largest {name} is {reading(peak, unit)}, the median run's {reading(middle, unit)}"
                )
    return found


def inactivity_sentences(design: Design, runs: Sequence[PlannedRun]) -> list[str]:
    """One line for every varied erosion limit that is inactive in part of the design."""
    return [
        f"{name} is inactive in {count} of {len(runs)} runs (no particle can erode by it at its value there): these "
        "runs do not depend on it"
        for name, count in inactive_runs(design, runs).items()
    ]


def running(
    folder: CampaignFolder, case: Case, design: Design, runs: Sequence[PlannedRun], version: str
) -> dict[str, Any]:
    """Write the summary of a campaign that has not finished, and return it.

    design.calls: runs that were asked for, one after the other: an extended design is not one of so many runs.
    """
    held, asked = folder.read_summary().get("design", {}), len(design.numbers)
    before = [runs for runs in held.get("calls", [held["runs"]] if held else []) if runs < asked]
    summary: dict[str, Any] = {
        "state": "running",
        "case_name": case.name,
        "case_hash": case_hash(case),
        "solver_version": version,
        "design": {
            "kind": design.kind,
            "seed": design.seed,
            "source": design.source,
            "runs": asked,
            "calls": [*before, asked],
            "digest": rows_digest(design_text(design).splitlines()),
            **design.quality().as_json(),
        },
        "space": space_json(design.space),
        "inactive_runs": inactive_runs(design, runs),
        "smooth_loss": case.bird.material.smooth_loss,
        "runs": [{"run": int(number), "status": "pending"} for number in design.numbers],
        "failed": [],
    }
    write_json(folder.summary, summary)
    return summary


def settled(folder: CampaignFolder, summary: Mapping[str, Any], outcomes: Mapping[int, Finished | Failed]) -> None:
    """Write the summary of a campaign whose runs have all ended, one way or the other."""
    failed = [{"run": n, "reason": outcome.reason} for n, outcome in outcomes.items() if isinstance(outcome, Failed)]
    limit = summary.get("smooth_loss", SMOOTH_LOSS)
    runs = [{"run": number, **_fate(outcome, limit)} for number, outcome in outcomes.items()]
    stores = [(one.store, one.key) for one in outcomes.values() if isinstance(one, Finished)]
    told = merged([(store.summary(key) or {}).get("warnings", []) for store, key in stores])
    curves = {"curves": {"digest": file_digest(folder.curves)}} if folder.curves.exists() else {}
    write_json(
        folder.summary, {**summary, "state": "finished", **curves, "runs": runs, "failed": failed, "warnings": told}
    )


def _fate(outcome: Finished | Failed, smooth_loss: float) -> dict[str, Any]:
    if isinstance(outcome, Failed):
        return {"status": "pending" if outcome.due else "failed", "reason": outcome.reason}
    return {
        "status": "finished",
        "key": outcome.key,
        "step_factor": outcome.step_factor,
        "smooth": is_smooth(outcome.figures, smooth_loss),
        **outcome.figures,
    }


def is_smooth(figures: Mapping[str, Any], smooth_loss: float) -> bool:
    """Whether the bird kept its mass but for the share `smooth_loss`; a solver that reports no erosion has none."""
    lost = figures.get("eroded_mass_fraction")
    return not (isinstance(lost, int | float) and lost > smooth_loss)


def load_dataset(out: str | Path) -> Dataset:
    """The Dataset of a finished campaign's folder; raises UserError where there is none, or where it was edited."""
    folder = CampaignFolder(Path(out))
    summary = folder.read_summary()
    if summary.get("state") != "finished" or not folder.curves.exists() or not folder.design.exists():
        instead = campaign_within(folder.path) or f"; {_remedy(folder.path, summary)}"
        raise UserError(f"{out} holds no finished campaign{instead}")
    if altered := folder.altered():
        raise UserError(altered)
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
        smooth_loss=summary.get("smooth_loss", SMOOTH_LOSS),
        scales=tuple(space.get("scales", ())),
    )


def _parameters(folder: CampaignFolder, numbers: np.ndarray) -> Array:
    """SI values (n, k) of the given runs from `design.csv`."""
    table = np.loadtxt(folder.design, delimiter=",", skiprows=1, ndmin=2, dtype=np.float64)
    row_of = {int(number): row for row, number in enumerate(table[:, 0])}
    return table[[row_of[int(number)] for number in numbers], 1:]


def _remedy(path: Path, summary: Mapping[str, Any]) -> str:
    maker = maker_of(path)
    if maker not in (None, "run-doe"):
        return f"birdstrike {maker} made this folder; give one of: birdstrike run-doe CASE --out DIR"
    if not summary:
        return "make one with: birdstrike run-doe CASE --out DIR"
    if summary.get("state") == "finished":
        return "none of its runs finished: see its summary.json"
    return "it was stopped midway: run the same birdstrike run-doe again to resume"
