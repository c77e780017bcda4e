"""The one reader of a measured record: what calibration and diagnosis alike take from a file, and what they leave out.

A channel is cut to the simulated record, its gaps, clipped and frozen readings, those beside a clipped stretch and
single outliers go, and every point gets its noise: by the file's sigma column, the case, the record before contact, the
scatter of neighbouring points, or 1 % of the peak. Times stay on the record's own clock: how far that is off the
model's is for the fit to find, within the time origin's standard deviation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured, ReadBefore
from birdstrike.data.errors import MeasuredError
from birdstrike.data.formatting import fewest_decimals, many, plain, quantity, reading, span
from birdstrike.data.histories import Array
from birdstrike.data.nearest import did_you_mean
from birdstrike.inversion.observations.baseline import Baseline
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.expected import OWN_SHARE, ROUNDING, Expected
from birdstrike.inversion.observations.high_frequency import digitiser_step, white_scatter
from birdstrike.inversion.observations.noise import Noise, Stated, channel_noise, with_digitiser
from birdstrike.inversion.observations.outliers import (
    beside_clipped,
    clipped,
    dropouts,
    frozen,
    held,
    jumps,
    lost_at_the_extreme,
    outliers,
    saturated,
)

SHORT = 50.0  # times shorter than the simulated record: a channel with its clock in another unit, or cut at once
OUTSIDE = "outside the simulated record"
CLIPPED = "clipped (the same reading in a row)"
OUTLIER = "far off their neighbours"
SATURATED = "flat, but for their noise, at the record's extreme"
DROPOUT = "dropouts (one reading again and again, far off those around)"
BESIDE = "beside a clipped stretch, within reach of their noise,"
HELD = "held (a slower channel's reading repeated)"
FROZEN = "frozen (one reading repeated)"
ZERO_WORTH = 0.25  # of the noise: a smaller reading at rest changes nothing
MEANING = {
    CLIPPED: "the fit does not know the curve there, and a peak is larger than the record says; give the sensor a "
    "larger range in the next shot, or look for why the logger stopped there",
    SATURATED: "the sensor or its amplifier stood at its end, and the fit does not know the curve; give it a larger "
    "range in the next shot",
    DROPOUT: "samples that the logger has lost would pull the fit; look at the cable and the logger",
    BESIDE: "only readings that their noise made low are left there, which would pull the fit",
    FROZEN: "the logger or the sensor had stopped; what it says from there on is not the plate's motion; look at the "
    "record there, and at the cable",
    HELD: "the first of each is kept, for a repeated one is late; export the channel at its own rate",
    OUTLIER: "single readings would pull the fit; look at the record there, for what is real in it is lost to the fit",
}


@dataclass(frozen=True)
class Cut:
    """Points that were left out: why (OUTSIDE, HELD, CLIPPED, BESIDE, FROZEN or OUTLIER), and their instants [s]."""

    reason: str
    times: Array

    def sentence(self, name: str) -> str:
        """What was left out of channel `name`, what that means for the fit, and what to do."""
        count, first, last = len(self.times), float(self.times[0]), float(self.times[-1])
        if count == 1:
            reason = self.reason.replace("their", "its")
            what = f"{plain(name)}: 1 point at {quantity(first, 's', 4)} is {reason} and is left out"
        else:
            what = f"{plain(name)}: {count} points at {span(first, last, 's', 4)} are {self.reason} and are left out"
        return f"{what}: {MEANING[self.reason]}" if self.reason in MEANING else what


@dataclass(frozen=True)
class ChannelRecord:
    """One channel of a record.

    times: (n,) [s] on the record's clock; values: (n,) SI; noise: of these points; offset: mean reading before contact,
    SI, 0 where the record does not begin early enough; cuts: what was left out and why; remarks: sentences on noise and
    zero that the user should know; baseline: what the sensor reads at rest, where that is not zero; zeroed: whether it
    has been subtracted from the values; read_before: what was read of it before a filter, None where none has passed.
    """

    name: str
    unit: str
    times: Array
    values: Array
    noise: Noise
    offset: float
    cuts: tuple[Cut, ...]
    remarks: tuple[str, ...]
    baseline: Baseline | None = None
    zeroed: bool = False
    read_before: ReadBefore | None = None

    @property
    def early(self) -> Array:
        """(e,) instants [s] of the readings before the first point used."""
        outside = [cut.times for cut in self.cuts if cut.reason == OUTSIDE]
        outside += [self.read_before.early] if self.read_before is not None else []
        times = np.concatenate([np.zeros(0), *outside])
        return times[times < self.times[0]]

    @property
    def drift_subtracted(self) -> bool:
        """Whether the readings at rest have shown a drift, which was subtracted, here or before a filter."""
        found = self.zeroed and self.baseline is not None and self.baseline.drifts
        return found or (self.read_before is not None and self.read_before.drifts)

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
    fewest: int = 1,
    test_stated: bool = True,
    zero: bool = False,
    keep_drift: bool = False,
) -> tuple[ChannelRecord, ...]:
    """Read a measured record: the points that a fit may use, each with its noise, and what was left out.

    Parameters
    ----------
    measured : Measured
        The file's channels, SI, NaN where there is a gap.
    expected : Expected
        Sensors with their units, the simulated record, and the noise that the case states:
        `Expected.of_case` or `Expected.of_campaign`.
    fewest : int
        Points that a channel must have inside the simulated record.
    test_stated : bool
        Whether a record before contact that is quieter than the stated noise may overrule it. A diagnosis rests its
        test on the noise level itself; a calibration keeps what is stated. A record that is noisier always does.
    zero : bool
        Whether the reading at rest (offset, drift, hum, by the record before contact) is subtracted from the values;
        what is uncertain in it is `baseline.columns` of the channel. Else the values are those of the file.
    keep_drift : bool
        Whether a displacement keeps its drift, less what it reads at the record's zero: a diagnosis looks for drifts.

    Returns
    -------
    tuple of ChannelRecord
        One a channel, in the file's order.

    Raises
    ------
    MeasuredError
        For every channel that is zero everywhere, that is no sensor of the case or has another unit, and for the first
        with fewer than `fewest` points in the simulated record, none after contact, or a fiftieth of it.

    Notes
    -----
    In this order: gaps; instants outside the simulated record; clipped readings (four or more in a row equal to the
    extreme one) and frozen ones; noise; readings beside a clipped stretch; single points far off the cubic through
    their neighbours. See `outliers` and `noise` for the limits. Values are never changed, but for `zero`.
    """
    measured.refuse_dead_sensors()
    errors = [error for name in measured.channels for error in _mismatch(measured, expected, name)]
    if errors:
        raise MeasuredError(errors)
    how = _Reading(fewest, test_stated, zero, keep_drift)
    return tuple(_channel(measured, expected, name, how) for name in measured.channels)


@dataclass(frozen=True)
class _Reading:
    """How channels are read, see `read_record`."""

    fewest: int
    test_stated: bool
    zero: bool
    keep_drift: bool

    def baseline(self, before: BeforeContact, unit: str) -> Baseline | None:
        """What a sensor reads at rest."""
        found = before.baseline
        return found.without_drift() if found is not None and self.keep_drift and unit == "m" else found


def _mismatch(measured: Measured, expected: Expected, name: str) -> list[str]:
    """Why a channel cannot be compared with the model."""
    channel = f'measured channel "{name}" in {measured.path}'
    if name not in expected.units:
        close = did_you_mean(name, expected.units, quote='"')
        hint = f"; {close} Import the record again with that name" if close else ""
        return [f"{channel} is no sensor of {expected.of}; sensors: {', '.join(expected.units)}{hint}"]
    if measured.units[name] != expected.units[name]:
        have = f"unit {measured.units[name]}" if measured.units[name] else "no unit"
        want = expected.units[name] or "none"
        return [f"{channel} has {have}, the sensor {want}; import the record again with --unit or --scale"]
    return []


@dataclass(frozen=True)
class _Points:
    """A channel's points that are no gaps, and which of them are used.

    times: (raw,) [s]; values: (raw,) SI; kept: indices of those that are used; cuts: reason -> indices of those that
    are left out for it.
    """

    times: Array
    values: Array
    kept: NDArray[np.intp]
    cuts: Mapping[str, NDArray[np.intp]]

    @property
    def used(self) -> tuple[Array, Array]:
        """Times and values of the points that are kept."""
        return self.times[self.kept], self.values[self.kept]

    def without(self, faults: Mapping[str, NDArray[np.bool_]]) -> _Points:
        """The same less the kept points at which a fault's mask is True; a point with several is cut for the first."""
        sound, cuts = np.ones(len(self.kept), dtype=bool), dict(self.cuts)
        for reason, faulty in faults.items():
            cuts[reason] = self.kept[sound & faulty]
            sound &= ~faulty
        return replace(self, kept=self.kept[sound], cuts=cuts)


def _channel(measured: Measured, expected: Expected, name: str, how: _Reading) -> ChannelRecord:
    """One channel: what shows without its noise is cut, then its noise, what shows by that is cut, then its zero."""
    measured, repeated = _without_held(measured, name)
    unit = measured.units[name]
    points = _inside_and_moving(measured, expected, name)
    _refuse_few(measured, expected, name, how.fewest, points)
    _refuse_rest(measured, expected, name, points)
    known = measured.read_before.get(name)
    tested = known is not None and known.zeroed  # before the filter, behind which a plateau that rang is a flat top
    before = _before_contact(points, -np.inf if tested else expected.rest_until, expected.drifts.get(name, 0.0))
    noise, noise_remarks = (
        _noise(measured, expected, name, points, before, how.test_stated)
        if known is None
        else (_noise_before(measured, name, points, known), ())
    )
    sound = points if tested else _without_noisy_faults(measured, name, points, noise)
    _refuse_few(measured, expected, name, how.fewest, sound)
    times, values = sound.used
    baseline = _worthwhile(how.baseline(before, unit), points.used[0], noise)
    subtracted = baseline if how.zero else None
    cuts = {HELD: repeated} | {reason: sound.times[which] for reason, which in sound.cuts.items()}
    return ChannelRecord(
        name=name,
        unit=unit,
        times=times,
        values=values if subtracted is None else values - subtracted.at(times),
        noise=noise.at(np.isin(points.kept, sound.kept)),
        offset=before.offset,
        cuts=tuple(Cut(reason, instants) for reason, instants in cuts.items() if len(instants)),
        remarks=(
            *noise_remarks,
            *_zero(name, unit, before, baseline, how.zero),
            *_moving(name, before),
            *_jumping(name, unit, times, values),
        ),
        baseline=baseline,
        zeroed=subtracted is not None,
        read_before=known,
    )


def _inside_and_moving(measured: Measured, expected: Expected, name: str) -> _Points:
    """The points in the simulated record, less those that stand on one reading: clipped, frozen, lost."""
    times, values = measured.points(name)
    inside = np.flatnonzero((times >= expected.start) & (times <= expected.end * (1.0 + ROUNDING)))
    outside = np.setdiff1d(np.arange(len(times)), inside)
    readings = values[inside]
    return _Points(times, values, inside, {OUTSIDE: outside}).without(
        {CLIPPED: clipped(readings), FROZEN: frozen(readings), DROPOUT: dropouts(readings)}
    )


def _without_noisy_faults(measured: Measured, name: str, points: _Points, noise: Noise) -> _Points:
    """The points less those whose fault shows by the noise: saturated, beside a clipped stretch, outliers."""
    times, values = points.used
    at_the_end = saturated(values, noise.level)
    flat = np.union1d(points.cuts[CLIPPED], points.kept[at_the_end])
    beside = np.isin(points.kept, _beside(measured, name, flat, noise.level))
    return points.without({SATURATED: at_the_end, BESIDE: beside, OUTLIER: outliers(times, values, noise.sigma)})


def _without_held(measured: Measured, name: str) -> tuple[Measured, Array]:
    """The record with gaps where a channel only repeats a slower one's reading, and the instants of these."""
    times, values = measured.points(name)
    repeated = held(values)
    if not repeated.any():
        return measured, times[:0]
    channel = np.where(np.isin(measured.time, times[repeated]), np.nan, measured.channels[name])
    return replace(measured, channels={**measured.channels, name: channel}), times[repeated]


def _refuse_few(measured: Measured, expected: Expected, name: str, fewest: int, points: _Points) -> None:
    """Raises MeasuredError where fewer than `fewest` points are left."""
    count, cuts = len(points.kept), points.cuts
    if count >= fewest:
        return
    span = f"{expected.start * 1e3:g} .. {expected.end * 1e3:g} ms"
    where = f'"{name}" in {measured.path} has {many(count, "point")} in the simulated record {span}'
    others = (
        (CLIPPED, "clipped"),
        (SATURATED, "saturated"),
        (FROZEN, "frozen"),
        (DROPOUT, "dropouts"),
        (BESIDE, "beside clipped ones"),
        (OUTLIER, "outliers"),
    )
    lost = "".join(f", and {len(cuts[why])} more that are {word}," for why, word in others if len(cuts.get(why, ())))
    raise MeasuredError(f"{where}{lost} and needs {fewest}; {_remedy(measured, name, cuts)}")


def _refuse_rest(measured: Measured, expected: Expected, name: str, points: _Points) -> None:
    """Raises MeasuredError where a channel ends before anything can have moved, or as good as at once."""
    last = points.used[0][-1]
    if last < expected.rest_until:
        raise MeasuredError(
            f'"{name}" in {measured.path} shows no impact: until {1e3 * expected.rest_until:.4g} ms nothing moves in '
            f"{expected.of}, and {_clock(measured, name)}, or was it cut too early (leave it out: --channels)?"
        )
    if last - expected.start < (expected.end - expected.start) / SHORT:
        raise MeasuredError(
            f'"{name}" in {measured.path} has points in the first '
            f"{1e3 * (last - expected.start):.4g} ms alone of a simulated record of {1e3 * expected.end:.4g} ms: "
            f"{_clock(measured, name)}, or was it cut too early (leave it out: --channels)?"
        )


def _remedy(measured: Measured, name: str, cuts: Mapping[str, NDArray[np.intp]]) -> str:
    """What to do where hardly a point of a channel is left."""
    times, _ = measured.points(name)
    if len(cuts[OUTSIDE]) < len(times) // 2:
        return "look at the record, or leave the channel out: --channels"
    return f"{_clock(measured, name)}?"


def _clock(measured: Measured, name: str) -> str:
    """From when to when a channel was read, and what may be wrong with that."""
    times, _ = measured.points(name)
    first, last = (f"{t:.10g} s" if abs(t) > 1.0 else f"{1e3 * t:.4g} ms" for t in (times[0], times[-1]))
    shift = f' (--shift "{fewest_decimals(-times[0])} s" makes its first row 0)' if times[0] else " (--shift)"
    length = f", {1e3 * (times[-1] - times[0]):.4g} ms" if first == last else ""
    return (
        f"its clock runs from {first} to {last}{length}: is it in another unit (import it again with the right "
        f"--time-unit), or does it count from another instant{shift}"
    )


def _before_contact(points: _Points, rest_until: float, drift: float) -> BeforeContact:
    """The record while the plate is surely at rest [s], before the simulated record included.

    Less a drift that the model has as well [SI/s]: to subtract it from the record alone would take it off twice.
    """
    early = points.times < rest_until
    times, values = points.used
    return BeforeContact.of(
        times=points.times[early],
        values=points.values[early] - drift * points.times[early],
        peak=float(np.abs(values).max()),
        length=float(np.ptp(times)),
        step=digitiser_step(values),
    )


def _noise(
    measured: Measured, expected: Expected, name: str, points: _Points, before: BeforeContact, test_stated: bool
) -> tuple[Noise, tuple[str, ...]]:
    """Noise of the points that are kept, the digitiser's step included, and what the user should know of it."""
    times, values = points.used
    unit, column = measured.units[name], measured.sigma.get(name)
    stated = Stated(
        case=expected.noise.get(name),
        column=None if column is None else column[np.isfinite(measured.channels[name])],
        used=points.kept,
        early=points.times < expected.rest_until,
        tested=test_stated,
    )
    white = _white(expected, name, times, values)
    noise, remarks = channel_noise(name, unit, float(np.abs(values).max()), before, stated, white)
    noise, rounded = with_digitiser(name, unit, noise, times, values)
    return noise, (*remarks, *rounded)


def _noise_before(measured: Measured, name: str, points: _Points, known: ReadBefore) -> Noise:
    """Noise of the points that are kept as it was before the channel was filtered."""
    column = measured.sigma[name][np.isfinite(measured.channels[name])]
    return Noise(column[points.kept], known.correlation_time, known.source, known.freedom, known.known)


def _white(expected: Expected, name: str, times: Array, values: Array) -> tuple[float, float] | None:
    """White noise of the record between neighbouring points, what the runs scatter themselves taken out.

    None without a model for anything but a displacement: a force or a strain moves between two samples by itself.
    """
    estimate = white_scatter(times, values)
    if estimate is None or not (expected.modelled or expected.units[name] == "m"):
        return None
    scatter, freedom = estimate
    simulated = expected.own_scatter(name, times)
    if simulated**2 > OWN_SHARE * scatter**2:
        return None
    return float(np.sqrt(scatter**2 - simulated**2)), freedom


def _beside(measured: Measured, name: str, flat: np.ndarray, sigma: float) -> np.ndarray:
    """Places, among the points that are no gaps, of readings beside clipped ones or beside an overload's gap."""
    values = measured.channels[name]
    given = np.flatnonzero(np.isfinite(values))
    lost = lost_at_the_extreme(measured.time, values)
    lost[given[flat]] = True
    return np.flatnonzero(beside_clipped(values, lost, sigma)[given])


def _worthwhile(baseline: Baseline | None, times: Array, noise: Noise) -> Baseline | None:
    """The baseline, unless it is so small that it changes nothing."""
    if baseline is None or np.abs(baseline.at(times)).max() < ZERO_WORTH * noise.level:
        return None
    return baseline


def _zero(name: str, unit: str, before: BeforeContact, baseline: Baseline | None, zero: bool) -> tuple[str, ...]:
    """A sensor that does not read zero before contact; baseline: what is subtracted, where `zero` asks for it."""
    if baseline is not None and zero:
        return (baseline.sentence(name, unit),)
    nothing_left = zero and before.baseline is not None  # in the response: of a drift that is kept, say
    if not before.beyond_noise or before.bent or nothing_left:
        return ()
    how = "at every point before contact" if before.constant else "before contact, beyond its noise"
    remedy = "the fit takes this offset for part of the response; subtract it from the record: birdstrike import --zero"
    if baseline is not None:  # of a record that is looked at by itself
        remedy = (
            "a calibration takes the sensor's zero from the readings before the case's first contact, as far as the "
            "record holds them; birdstrike import --zero subtracts it from the record itself"
        )
    return (f"{plain(name)} reads {reading(before.offset, unit, 2)} {how}: {remedy}",)


def _jumping(name: str, unit: str, times: Array, values: Array) -> tuple[str, ...]:
    """A displacement that is elsewhere a sample later; a force or a strain may be."""
    places = jumps(times, values) if unit == "m" else np.zeros(0, dtype=np.intp)
    if not len(places):
        return ()
    step, count = reading(float(values[places[0] + 1] - values[places[0]]), unit, 2), len(places)
    where = f"at {1e3 * times[places[0]]:.4g} ms" + (
        "" if count == 1 else " (and once more)" if count == 2 else f" (and {count - 1} times more)"
    )
    text = (
        f"{plain(name)} jumps by {step} between neighbouring readings {where}, which a plate does not: an overflow of "
        "the converter, a loose cable, or two records in one? The fit takes it for the plate's motion; look at the "
        "record there, and import only what is sound"
    )
    return (text,)


def _moving(name: str, before: BeforeContact) -> tuple[str, ...]:
    """A record that is not at rest while the case says that it is, or that may not be."""
    if before.bent:
        text = (
            f"{plain(name)} bends before contact as a mains hum of {before.bent:g} Hz does, of which too little is "
            "recorded to carry it on: neither its zero nor this hum is taken out of the response; record at least "
            f"{1e3 / before.bent:.3g} ms before contact, and look at the grounding of the measuring chain"
        )
        return (text,)
    if before.moves_until is None:
        return ()
    until = f"{before.moves_until * 1e3:.3g} ms"
    lost = (
        "neither its zero nor its noise can be taken from there"
        if before.level is None
        else "its zero cannot be taken from there, and its noise, which is correlated, from the first half of it alone"
    )
    text = (
        f"{plain(name)} moves before contact (until {until} by the case's clock), so {lost}: if its clock is ahead of "
        "the case's, import it with --shift, or raise inversion.nuisance.time_offset"
    )
    return (text,)
