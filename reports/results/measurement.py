"""The measured record beside the simulations: its name, its place in the prior predictive, and the residuals."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured, shot_names
from birdstrike.data.formatting import listing
from birdstrike.data.histories import Array, farthest, side_of
from birdstrike.doe.solvers import simulated_by
from birdstrike.inversion.observations.prior_predictive import ENVELOPE_SIGMAS
from birdstrike.inversion.observations.reader import CLIPPED, SATURATED
from birdstrike.inversion.results.ingredients import MeasuredFigures
from birdstrike.reports.figures.quantities import quantity, reading, words
from birdstrike.reports.results.results import InversionResults, Results
from birdstrike.solver.case.case import load_case

_MADE_BY = re.compile(r"SIMULATED\s*(?:\(\s*(?:by\s+)?|(?:by|with)\s+)([^(),;:]+)")


def origin(record: Measured) -> str:
    """`measured`, or `simulated by LS-DYNA` where the provenance says so: never `measured` for a simulated record."""
    if not record.simulated:
        return "measured"
    made_by = next((found[1].strip() for line in record.provenance if (found := _MADE_BY.search(line))), "")
    return f"simulated by {made_by}" if made_by else "simulated, see its provenance"


def origins(records: Sequence[Measured]) -> str:
    """`origin` of the records of all shots: once where they have the same, else that of each by its name."""
    every = [origin(one) for one in records]
    if len(set(every)) == 1:
        return every[0]
    return ", ".join(f"{name} {own}" for name, own in zip(shot_names(records), every, strict=True))


def simulated_curves(records: Sequence[Measured]) -> str:
    """Which curves of a page are simulated: `every curve but the record is simulated`."""
    measured = [one for one in records if not one.simulated]
    if not measured:
        return "every curve is simulated, the record too" if len(records) == 1 else "every curve is simulated"
    if len(measured) < len(records):
        return "every curve but the measured records is simulated"
    return f"every curve but the record{'s' if len(records) > 1 else ''} is simulated"


def program_in(folder: Path) -> str:
    """The program that simulated what a folder of results holds: that of its case; birdstrike where it holds none."""
    case = folder / "case.toml"
    return simulated_by(load_case(case)) if case.is_file() else "birdstrike"


def short_name(record: Measured) -> str:
    """The record's file without folder and suffix."""
    return Path(record.path).stem


def named(record: Measured) -> str:
    """`the record shot7`, and of a file that is called record.csv `the record` alone."""
    name = short_name(record)
    return "the record" if name.lower() == "record" else f"the record {name}"


@dataclass(frozen=True)
class RecordPosition:
    """One channel at the record's `time` (r,) s: its `values`, the simulations' `low` and `high`, all (r,) SI.

    NaN: `values` in a gap, `low` and `high` where the simulations do not reach.
    margin: SI, what noise may add; a point counts as outside only beyond it. Simulations that lost more of the
    bird than its material's `smooth_loss` are another regime, which widens the range without filling it: they don't
    count.
    """

    time: Array
    values: Array
    low: Array
    high: Array
    margin: float

    @property
    def outside(self) -> NDArray[np.bool_]:
        """(r,) True: the record lies beyond all simulations by more than the margin; False where one is missing."""
        return np.abs(self.excess) > self.margin

    @property
    def points(self) -> int:
        """How many points of the record the simulations reach."""
        return int(np.isfinite(self.excess).sum())

    @property
    def excess(self) -> Array:
        """(r,) SI: how far the record lies above (+) or below (-) the range; 0 inside, NaN where one is missing."""
        return np.maximum(self.values - self.high, 0.0) - np.maximum(self.low - self.values, 0.0)


def record_position(results: Results, channel: str) -> RecordPosition:
    """The campaign's smooth simulations at the record's times, on the estimated time origin."""
    time, values = results.record.time, results.used.channels[channel]
    on_their_clock = np.maximum(time - results.offset, results.dataset.time[0])  # at rest before the trigger
    curves = results.dataset.sampled(channel, on_their_clock)[results.dataset.smooth]
    margin = ENVELOPE_SIGMAS * results.inversion.measured.noise[channel]
    return RecordPosition(time, values, curves.min(axis=0), curves.max(axis=0), margin)


@dataclass(frozen=True)
class Residual:
    """Simulated minus record, (r,) SI, at those of the record's times (r,) s where both exist."""

    time: Array
    values: Array

    @property
    def worst(self) -> tuple[float, float]:
        """Time [s] and value of the largest residual."""
        return peak(self.time, self.values)


def residual(results: InversionResults, channel: str, method: str) -> Residual:
    """What a method's verification leaves unexplained in one channel, at the points that the fit used."""
    difference = results.simulated[method][channel] - results.used.channels[channel]
    both = np.isfinite(difference)
    return Residual(results.record.time[both], difference[both])


def peak(time: Array, values: Array, side: float = 0.0) -> tuple[float, float]:
    """Time [s] and value of the largest reading, the one farthest from 0 with its sign, SI; side: 1 or -1, where it is
    sought on that side of 0 alone, as beside another curve's peak."""
    top = int(np.nanargmax(side * values)) if side else int(farthest(values))
    return float(time[top]), float(values[top])


@dataclass(frozen=True)
class RecordPeak:
    """A channel's largest reading: its time [s] and value, SI `unit`.

    clipped: the sensor stood at its end there; the true peak is larger, and when it was is not known.
    """

    time: float
    value: float
    unit: str
    clipped: bool = False

    @property
    def side(self) -> float:
        """1 or -1: on which side of 0 it lies."""
        return -1.0 if self.value < 0.0 else 1.0

    @property
    def size(self) -> str:
        """`6.35 mm`, and `≥ 6.35 mm` of a clipped one."""
        side = "" if not self.clipped else "≥ " if self.value > 0.0 else "≤ "
        return side + reading(self.value, self.unit)

    @property
    def text(self) -> str:
        """`6.35 mm at 1.52 ms`, and `≥ 6.35 mm, clipped from 1.22 ms on` of a clipped one."""
        at = quantity(self.time, "s")
        return f"{self.size}, clipped from {at} on" if self.clipped else f"{self.size} at {at}"


def record_peak(results: InversionResults, channel: str) -> RecordPeak:
    """Of the points that the fit used, or the end at which the sensor stood where that hides the peak."""
    return peak_of(results.record, channel, results.inversion.measured)


def peak_of(record: Measured, channel: str, figures: MeasuredFigures) -> RecordPeak:
    """The same of any record above rest, whose points that a fit used `figures` tell."""
    unit = record.units[channel]
    at, top = peak(*figures.fitted(record).points(channel))
    times, values = record.points(channel)
    flat = np.isin(times, figures.cut(channel, CLIPPED, SATURATED))
    if not flat.any():
        return RecordPeak(at, top, unit)
    side = side_of(values[flat])
    limit = side * float((side * values[flat]).max())
    if top * side < 0.0 and abs(limit) < abs(top):
        return RecordPeak(at, top, unit)  # clipped on the other side, where less was reached
    first = float(times[flat & (side * values > 0.0)][0])
    return RecordPeak(first, side * max(abs(limit), side * top), unit, clipped=True)


def hidden_peaks(results: InversionResults) -> str:
    """`; – where the record's peak is clipped (displacement centre ≥ 4.00 mm)`; nothing where none is."""
    tops = {channel: record_peak(results, channel) for channel in results.channels}
    hidden = [f"{words(channel)} {top.size}" for channel, top in tops.items() if top.clipped]
    return f"; – where the record's peak is clipped ({listing(hidden)})" if hidden else ""
