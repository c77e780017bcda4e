"""Named zero-phase filters, applied alike to record and model: the channel frequency classes of crash testing.

SAE J211-1 / ISO 6487: a two-pole Butterworth filter run forwards and backwards, design frequency 2.0775 CFC [Hz]; -3
dB at CFC / 0.6. What the filter takes from the record it takes from the model, so that no parameter has to explain it.
The stated noise is kept: for what passes the filter the points are worth as much as before.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.inversion.forward import Forward, watched

CLASSES = {"CFC60": 60.0, "CFC180": 180.0, "CFC600": 600.0, "CFC1000": 1000.0}
DESIGN = 2.0775
UNIFORM = 1e-3  # of a step


def zero_phase(values: Array, step: float, name: str) -> Array:
    """Rows of values (..., n) at equal steps [s] through the named filter; raises UserError."""
    if name not in CLASSES:
        raise UserError(f'filter = "{name}" is unknown; use one of: {", ".join(CLASSES)}')
    frequency, rate = DESIGN * CLASSES[name], 1.0 / step
    if frequency >= 0.5 * rate:
        needed = f"{name} needs a record sampled faster than {2e-3 * frequency:.3g} kHz"
        raise UserError(f"{needed}; this one has {1e-3 * rate:.3g} kHz")
    sections = butter(2, frequency, fs=rate, output="sos")
    room = min(values.shape[-1] - 1, int(3.0 * rate / frequency) + 1)
    return np.asarray(sosfiltfilt(sections, values, axis=-1, padtype="odd", padlen=room))


def filtered_record(measured: Measured, name: str) -> Measured:
    """Every channel through the filter; raises UserError where its instants are not equally spaced or it has gaps."""
    steps = np.diff(measured.time)
    if np.ptp(steps) > UNIFORM * steps.mean():
        raise UserError(f"{measured.path}: a filter needs equally spaced instants; resample the record first")
    gaps = [channel for channel, values in measured.channels.items() if not np.isfinite(values).all()]
    if gaps:
        raise UserError(f"{measured.path}: a filter would smear the gaps of {', '.join(gaps)}; cut them out first")
    step = float(steps.mean())
    return replace(measured, channels={c: zero_phase(v, step, name) for c, v in measured.channels.items()})


def filtered_dataset(dataset: Dataset, name: str) -> Dataset:
    """Every run's curves through the filter."""
    step = float(dataset.time[1] - dataset.time[0])
    return replace(dataset, curves={c: zero_phase(v, step, name) for c, v in dataset.curves.items()})


@dataclass(frozen=True)
class FilteredForward:
    """A forward model whose histories pass the filter."""

    forward: Forward
    name: str

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Raises RunFailed."""
        run = self.forward(theta)
        step = float(run.time[1] - run.time[0])
        return replace(run, channels={c: zero_phase(v, step, self.name) for c, v in run.channels.items()})

    def watched(self, progress: Progress) -> FilteredForward:
        """With its progress reported."""
        return replace(self, forward=watched(self.forward, progress))
