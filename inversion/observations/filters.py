"""Named zero-phase filters of simulated curves: the channel frequency classes of crash testing.

SAE J211-1 / ISO 6487: a two-pole Butterworth filter run forwards and backwards, design frequency 2.0775 CFC [Hz]; -3
dB at CFC / 0.6. A simulated curve is filtered as its record is: at the record's instants, with the plate at rest in
front, up to the last instant that both have. What the filter takes from the record it then takes from the model, so
that no parameter has to explain it. Records are filtered in `filtered_records`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.inversion.forward import Forward, watched

CLASSES = {"CFC60": 60.0, "CFC180": 180.0, "CFC600": 600.0, "CFC1000": 1000.0}
DESIGN = 2.0775  # design frequency of one pass, times the class [Hz]
CORNER = 1.0 / 0.6  # frequency at -3 dB, times the class [Hz]
PADDING = 3.0  # periods of the design frequency that are reflected at both ends
REACH = 0.5  # periods of the corner frequency, beyond which a reading hardly matters
LEAD = 4.0  # reaches at rest in front of a curve
LARGEST_REACH = 0.25  # of the simulated time


def reach(name: str) -> float:
    """Time [s] beyond which the filter hardly mixes readings: half a period of its corner frequency.

    What lies beyond a record's end changes what is farther inside by about a twentieth of what it changes at the end.
    """
    return REACH / (CORNER * CLASSES[name])


def refuse_class(option: str, name: str) -> None:
    """Raises UserError for a name that is no class."""
    if name not in CLASSES:
        raise UserError(f'{option} = "{name}" is unknown; use one of: {", ".join(CLASSES)}')


def refuse_long_reach(option: str, name: str, simulated: float) -> None:
    """Raises UserError for a class that reaches over more than a quarter of the simulated time [s]."""
    longest = LARGEST_REACH * simulated
    if reach(name) <= longest:
        return
    short = [other for other in CLASSES if reach(other) <= longest]
    classes = f"use {' or '.join(short)}, or " if short else ""
    raise UserError(
        f"{option} = {name} mixes readings {1e3 * reach(name):.3g} ms apart (half a period of its corner frequency, "
        f"{CORNER * CLASSES[name]:.0f} Hz); allowed is a quarter of the simulated {1e3 * simulated:.3g} ms, "
        f"{1e3 * longest:.3g} ms: {classes}simulate {1e3 * reach(name) / LARGEST_REACH:.3g} ms (time.end)"
    )


def zero_phase(values: Array, step: float, name: str) -> Array:
    """Rows of values (..., n) at equal steps [s] through the named filter, odd about their ends; raises UserError."""
    refuse_class("filter", name)
    frequency, rate = DESIGN * CLASSES[name], 1.0 / step
    if frequency >= 0.5 * rate:
        needed = f"{name} needs a record sampled faster than {2e-3 * frequency:.3g} kHz"
        raise UserError(f"{needed}; this one has {1e-3 * rate:.3g} kHz")
    sections = butter(2, frequency, fs=rate, output="sos")
    room = min(values.shape[-1] - 1, int(PADDING * rate / frequency) + 1)
    return np.asarray(sosfiltfilt(sections, values, axis=-1, padtype="odd", padlen=room))


@dataclass(frozen=True)
class ModelFilter:
    """A named filter for the curves that are compared with one record.

    end: last instant [s] that the filter of the record has seen; step: [s] of its readings.
    """

    name: str
    end: float
    step: float

    def clock(self, start: float) -> Array:
        """(n,) instants [s] at which curves pass: from four reaches before their `start` [s] to the end."""
        count = int((self.end - start + LEAD * reach(self.name)) / self.step) + 1
        return self.end - self.step * np.arange(count)[::-1]

    def curves(self, time: Array, values: Array) -> Array:
        """Curves (..., m) at `time` (m,) [s] filtered; before the first instant at rest, after the end as they are."""
        clock, inside = self.clock(float(time[0])), time <= self.end
        rows = values.reshape(-1, len(time))
        passed = zero_phase(np.stack([np.interp(clock, time, row) for row in rows]), self.step, self.name)
        found = np.array(rows, dtype=np.float64)
        found[:, inside] = [np.interp(time[inside], clock, row) for row in passed]
        return found.reshape(values.shape)

    def histories(self, run: Histories) -> Histories:
        """A run's curves filtered."""
        return replace(run, channels={c: self.curves(run.time, v) for c, v in run.channels.items()})

    def dataset(self, dataset: Dataset) -> Dataset:
        """Every run's curves filtered."""
        return replace(dataset, curves={c: self.curves(dataset.time, v) for c, v in dataset.curves.items()})


@dataclass(frozen=True)
class FilteredForward:
    """A forward model whose histories pass the filter."""

    forward: Forward
    filter: ModelFilter

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Raises RunFailed."""
        return self.filter.histories(self.forward(theta))

    def watched(self, progress: Progress) -> FilteredForward:
        """With its progress reported."""
        return replace(self, forward=watched(self.forward, progress))
