"""`curves.csv`: the histories of all finished runs of a campaign, one row an instant of a run, SI."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from data.curves import split_unit
from data.errors import RunFailed
from data.files import whole_file
from data.histories import Array, Histories

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
