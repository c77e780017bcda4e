"""The one reader of a measured record: what calibration and diagnosis alike take from a file, and what they leave out.

A channel is cut to the simulated record, its gaps, clipped readings and single outliers go, and every point gets its
noise: by the file's sigma column, the case, the record before contact, or a tolerance. Times stay on the record's own
clock: how far that is off the model's is for the fit to find, within the time origin's standard deviation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError
from birdstrike.data.histories import Array
from birdstrike.inversion.formatting import plain, quantity
from birdstrike.inversion.observations.noise import BeforeContact, Noise, Stated, channel_noise
from birdstrike.inversion.observations.outliers import clipped, outliers
from birdstrike.solver.case.case import Case

ROUNDING = 1e-9  # of the record's end: an instant no later than that still lies in it
FARTHEST_ORIGIN = 4.0  # standard deviations by which the time origin may be off
OUTSIDE = "outside the simulated record"
CLIPPED = "clipped (the same reading in a row)"
OUTLIER = "far off their neighbours"
MEANING = {
    CLIPPED: "the fit does not know the curve there, and a peak is larger than the record says; give the sensor a "
    "larger range in the next shot",
    OUTLIER: "single readings would pull the fit; look at the record there, for what is real in it is lost to the fit",
}


@dataclass(frozen=True)
class Expected:
    """What is known of a record before it is read.

    units: sensor -> SI unit; start, end: of the simulated record [s], on the record's clock; quiet: until when the
    plate is surely at rest [s]; noise: sensor -> standard deviation that the case states, SI; of: what has the sensors,
    in messages.
    """

    units: Mapping[str, str]
    start: float
    end: float
    quiet: float
    noise: Mapping[str, float] = field(default_factory=dict)
    of: str = "the case"

    @classmethod
    def of_case(cls, case: Case, end: float, spare: float = 0.0) -> Expected:
        """By a case simulated until `end` [s]; spare: by how much the clock may be late beyond its nuisance [s].

        The plate is at rest until contact less four standard deviations of the time origin.
        """
        uncertain = spare + FARTHEST_ORIGIN * case.inversion.nuisance.get("time_offset", 0.0)
        units = {name: sensor.unit for name, sensor in case.sensors.items()}
        noise = {name: sensor.noise for name, sensor in case.sensors.items() if sensor.noise}
        return cls(units, 0.0, end - spare, case.first_contact - uncertain, noise)

    @classmethod
    def of_campaign(cls, dataset: Dataset, noise: Mapping[str, float]) -> Expected:
        """By a campaign's runs; what the record reads before t = 0 is taken for rest."""
        start, end = float(dataset.time[0]), float(dataset.time[-1])
        return cls(dataset.channel_units, start, end, 0.0, noise, "the campaign's case")


@dataclass(frozen=True)
class Cut:
    """Points that were left out: why (OUTSIDE, CLIPPED or OUTLIER), and their instants [s]."""

    reason: str
    times: Array

    def sentence(self, name: str) -> str:
        """What was left out of channel `name`, what that means for the fit, and what to do."""
        count, first, last = len(self.times), self.times[0] * 1e3, self.times[-1] * 1e3
        if count == 1:
            what = f"{name}: 1 point at {first:.4g} ms is {self.reason.replace('their', 'its')} and is left out"
        else:
            what = f"{name}: {count} points at {first:.4g} .. {last:.4g} ms are {self.reason} and are left out"
        return f"{what}: {MEANING[self.reason]}" if self.reason in MEANING else what


@dataclass(frozen=True)
class ChannelRecord:
    """One channel of a record.

    times: (n,) [s] on the record's clock; values: (n,) SI; noise: of these points; offset: mean reading before contact,
    SI, 0 where the record does not begin early enough; cuts: what was left out and why; remarks: sentences on noise and
    zero that the user should know.
    """

    name: str
    unit: str
    times: Array
    values: Array
    noise: Noise
    offset: float
    cuts: tuple[Cut, ...]
    remarks: tuple[str, ...]

    @property
    def peak(self) -> float:
        """Largest measured magnitude, SI."""
        return float(np.abs(self.values).max())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Readings that were left out although they lie in the simulated record, then the remarks."""
        return (*(cut.sentence(self.name) for cut in self.cuts if cut.reason != OUTSIDE), *self.remarks)


def read_record(
    measured: Measured,
    expected: Expected,
    tolerance: float | None = None,
    fewest: int = 1,
    test_stated: bool = True,
) -> tuple[ChannelRecord, ...]:
    """Read a measured record: the points that a fit may use, each with its noise, and what was left out.

    Parameters
    ----------
    measured : Measured
        The file's channels, SI, NaN where there is a gap.
    expected : Expected
        Sensors with their units, the simulated record, and the noise that the case states:
        `Expected.of_case` or `Expected.of_campaign`.
    tolerance : float, optional
        Standard deviation as a share of the channel's peak where no noise is known. Without it 1 % is taken and the
        noise is marked as inferred.
    fewest : int
        Points that a channel must have inside the simulated record.
    test_stated : bool
        Whether the record before contact may overrule a stated noise. A calibration keeps what is stated, because it
        tests the residual of its fit afterwards; a diagnosis rests its test on the noise level itself.

    Returns
    -------
    tuple of ChannelRecord
        One a channel, in the file's order.

    Raises
    ------
    MeasuredError
        For every channel that is zero everywhere, that is no sensor of the case or has another unit, and for the first
        with fewer than `fewest` points in the simulated record.

    Notes
    -----
    In this order: gaps; instants outside the simulated record; clipped readings (four or more in a row equal to the
    extreme one); noise; single points far off the cubic through their neighbours. See `outliers` and `noise` for the
    limits. Values are never changed.
    """
    measured.refuse_dead_sensors()
    errors = [error for name in measured.channels for error in _mismatch(measured, expected, name)]
    if errors:
        raise MeasuredError(errors)
    return tuple(_channel(measured, expected, name, tolerance, fewest, test_stated) for name in measured.channels)


def _mismatch(measured: Measured, expected: Expected, name: str) -> list[str]:
    """Why a channel cannot be compared with the model."""
    channel = f'measured channel "{name}" in {measured.path}'
    if name not in expected.units:
        return [f"{channel} is no sensor of {expected.of}; sensors: {', '.join(expected.units)}"]
    if measured.units[name] != expected.units[name]:
        have, want = measured.units[name] or "no unit", expected.units[name] or "no unit"
        return [f"{channel} has unit {have}, the sensor {want}"]
    return []


def _channel(
    measured: Measured, expected: Expected, name: str, tolerance: float | None, fewest: int, test_stated: bool
) -> ChannelRecord:
    """One channel; indices run over the points that are no gaps."""
    times, values = measured.points(name)
    unit, column = measured.units[name], measured.sigma.get(name)
    sigma = None if column is None else column[np.isfinite(measured.channels[name])]
    kept = np.flatnonzero((times >= expected.start) & (times <= expected.end * (1.0 + ROUNDING)))
    outside = np.setdiff1d(np.arange(len(times)), kept)
    flat = clipped(values[kept])
    kept, cut = kept[~flat], kept[flat]
    if len(kept) < fewest:
        span = f"{expected.start * 1e3:g} .. {expected.end * 1e3:g} ms"
        where = f'"{name}" in {measured.path} has {len(kept)} points in the simulated record {span}'
        lost = f", and {len(cut)} more that are clipped," if len(cut) else ""
        raise MeasuredError(f"{where}{lost} and needs {fewest}; another clock or unit?")
    early = times < expected.quiet
    peak = float(np.abs(values[kept]).max())
    before = BeforeContact.of(times[early], values[early], peak)
    stated = Stated(expected.noise.get(name), sigma, kept, early, test_stated)
    noise, remarks = channel_noise(name, unit, peak, before, stated, tolerance)
    odd = outliers(times[kept], values[kept], noise.sigma)
    cuts = ((OUTSIDE, outside), (CLIPPED, cut), (OUTLIER, kept[odd]))
    return ChannelRecord(
        name,
        unit,
        times[kept[~odd]],
        values[kept[~odd]],
        noise.at(~odd),
        before.offset,
        tuple(Cut(reason, times[which]) for reason, which in cuts if len(which)),
        (*remarks, *_zero(name, unit, before)),
    )


def _zero(name: str, unit: str, before: BeforeContact) -> tuple[str, ...]:
    """A sensor that does not read zero before contact."""
    if not before.tests or abs(before.offset) <= (before.level or 0.0):
        return ()
    text = (
        f"{plain(name)} reads {quantity(before.offset, unit, 2)} before contact, beyond its noise: the fit takes this "
        "offset for part of the response; subtract it from the record"
    )
    return (text,)
