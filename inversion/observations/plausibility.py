"""A record beside a campaign's runs before any fit: turned round, in another unit, on another clock, or dead?

Each is recognised by what one number would mend: the sign, a factor, a shift of the clock. What is found is said with
its remedy; nothing is changed.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.data.units import rounded
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.observations.expected import FARTHEST_ORIGIN
from birdstrike.inversion.observations.observations import Channel, Observations

ALIKE = 0.8  # correlation of two curves that have the same shape
UNLIKE = 0.5
FAR = 3.0  # times the largest peak of a run, or part of the smallest
SHIFTS = 81  # shifts of the clock that are tried, over half a record either way
OVERLAP = 0.5  # of the points, at least, that a shifted run must cover
MENDED = 0.5  # of the residual that a shift must leave at most
NOISE = 3.0  # times the noise: a smaller residual needs no mending
SILENT_SHARE = 20.0  # part of the smallest peak of a run that is no response
SILENT = 5.0  # times the noise: a sensor that never reads more has not responded
LONG = 50.0  # times longer than the runs: a record whose clock may be in another unit
SLIPS = {
    1e3: "a thousand: mm for m, or kN for N?",
    25.4: "25.4: inches for mm?",
    10.0: "ten: mm for cm?",
    100.0: "a hundred: per cent for a ratio?",
    1e6: "a million: microstrain for strain?",
    4.448: "4.45: pounds for newtons?",
    6.895: "6.9: ksi for MPa?",
}
SLIP = 1.6  # ratio to such a factor that still points to it


def implausible(dataset: Dataset, observations: Observations, time_offset: float) -> tuple[str, ...]:
    """A sentence for each channel whose sign, size or clock no run has; time_offset: of the origin, 1 sigma [s]."""
    found = [_finding(_Beside.of(dataset, channel, time_offset)) for channel in observations.channels]
    pairs = combinations(observations.channels, 2)
    return tuple(text for text in (*found, *(_exchanged(dataset, *pair) for pair in pairs)) if text)


def of_another_size(dataset: Dataset, observations: Observations, time_offset: float) -> bool:
    """Whether a channel's size is one that no run comes near, so that no fit to the runs means anything."""
    return any(_other_unit(_Beside.of(dataset, channel, time_offset)) for channel in observations.channels)


def _exchanged(dataset: Dataset, one: Channel, other: Channel) -> str:
    """That two channels lie beside the runs of each other; empty where they do not."""
    if one.unit != other.unit:
        return ""
    own = [_nearest(dataset, channel, channel.name) for channel in (one, other)]
    exchanged = [_nearest(dataset, one, other.name), _nearest(dataset, other, one.name)]
    noise = [rms(channel.noise) for channel in (one, other)]
    if any(residual < NOISE * sigma for residual, sigma in zip(own, noise, strict=True)):
        return ""
    if any(after > MENDED * before for before, after in zip(own, exchanged, strict=True)):
        return ""
    names = plain(one.name), plain(other.name)
    shown = ", ".join(
        f"{name} at {reading(after, one.unit)} instead of {reading(before, one.unit)}"
        for name, before, after in zip(names, own, exchanged, strict=True)
    )
    return (
        f"{names[0]} and {names[1]} lie beside the runs better when they change places (nearest run of {shown}): were "
        f"their columns or cables exchanged? Import the record again with each --sensor NAME=COLUMN the other way round"
    )


def _nearest(dataset: Dataset, channel: Channel, name: str) -> float:
    """Root mean square distance of a channel from the nearest run's curve `name`, SI."""
    runs = np.stack([np.interp(channel.times, dataset.time, curve) for curve in dataset.curves[name]])
    return float(np.sqrt(((runs - channel.values) ** 2).mean(axis=1)).min())


@dataclass(frozen=True)
class _Beside:
    """A channel beside the runs, at every shift (s,) [s] of its clock.

    end: of the runs [s]; peaks: (runs,) of the runs, SI; seen: (runs,) of the runs at the instants of the record that
    are left, because a clipped or broken record has lost its own peak; correlation: (s, runs); residual: (s,) root mean
    square distance of the nearest run; allowed: (s,) True at the shifts that a fit may choose.
    """

    channel: Channel
    end: float
    peaks: Array
    seen: Array
    shifts: Array
    correlation: Array
    residual: Array
    allowed: np.ndarray

    @classmethod
    def of(cls, dataset: Dataset, channel: Channel, time_offset: float) -> _Beside:
        """From the runs of a campaign."""
        curves, clock = dataset.curves[channel.name], dataset.time
        half = 0.5 * float(clock[-1] - clock[0])
        limit = FARTHEST_ORIGIN * time_offset
        shifts = np.unique([*np.linspace(-half, half, SHIFTS), *np.linspace(-limit, limit, 9), 0.0])
        correlation, residual = np.zeros((len(shifts), len(curves))), np.full(len(shifts), np.inf)
        for k, shift in enumerate(shifts):
            at = channel.times - shift
            inside = at <= clock[-1] * (1.0 + 1e-9)
            if inside.mean() < OVERLAP:
                continue
            y = channel.values[inside]
            runs = np.stack([np.interp(at[inside], clock, curve) for curve in curves])
            scale = np.linalg.norm(runs, axis=1) * np.linalg.norm(channel.values)
            correlation[k] = runs @ y / np.maximum(scale, 1e-300)
            residual[k] = float(np.sqrt(((runs - y) ** 2).mean(axis=1)).min())
        peaks = np.abs(curves).max(axis=1)
        seen = np.array([np.abs(np.interp(channel.times, clock, curve)).max() for curve in curves])
        allowed = np.abs(shifts) <= limit + 1e-12
        return cls(
            channel=channel,
            end=float(clock[-1]),
            peaks=peaks,
            seen=seen,
            shifts=shifts,
            correlation=correlation,
            residual=residual,
            allowed=allowed,
        )


def _finding(beside: _Beside) -> str:
    """The first fault whose remedy is one number or option; empty where there is none."""
    checks = (_other_time_unit, _other_sign, _other_unit, _no_response, _other_trigger)
    return next(filter(None, (check(beside) for check in checks)), "")


def _other_time_unit(beside: _Beside) -> str:
    """That the record is much longer than the runs and shows hardly any response."""
    channel, end, last = beside.channel, beside.end, _last(beside.channel)
    if last <= LONG * end or channel.peak >= float(beside.peaks.min()) / FAR:
        return ""
    return (
        f"{plain(channel.name)} reads at most {reading(channel.peak, channel.unit)} where the runs peak at "
        f"{_range(beside.peaks, channel.unit)}, and ends at {1e3 * last:.4g} ms, the runs at {1e3 * end:.3g} ms: is "
        "its clock in another unit, such as milliseconds that are called seconds, or the sensor dead? Import it "
        "again with the right --time-unit, or leave it out: --channels"
    )


def _other_sign(beside: _Beside) -> str:
    """That the record runs against every run."""
    allowed = beside.correlation[beside.allowed]
    if allowed.max() >= UNLIKE or -allowed.min() <= ALIKE:
        return ""
    return (
        f"{plain(beside.channel.name)} has the opposite sign of every run of the campaign (correlation "
        f"{allowed.min():.2f}): displacement counts positive in the direction of the push, strain in tension; import "
        f"it again with --scale {beside.channel.name}=-1"
    )


def _other_unit(beside: _Beside) -> str:
    """That the record has a peak that no run comes near; a small one, only where it has the shape of a run."""
    channel, alike = beside.channel, np.abs(beside.correlation[beside.allowed]).max()
    low, high = float(beside.seen.min()), float(beside.seen.max())
    if low / FAR <= channel.peak <= FAR * high or (alike <= ALIKE and channel.peak < low):
        return ""
    middle = float(np.median(beside.seen))
    apart = _slip(channel.peak / middle) if middle > 0.0 else "and most of them not at all"
    what = " has the shape of the runs and another size" if alike > ALIKE else " has a size that no run comes near"
    return (
        f"{plain(channel.name)}{what}: it peaks at {reading(channel.peak, channel.unit)} where they do at "
        f"{_range(beside.seen, channel.unit)}, {apart}; import it again with the right --unit, or a --scale; if the "
        "record is right, correct the case: its plate, bird or speed"
    )


def _no_response(beside: _Beside) -> str:
    """That the record stays in its noise, or far below the smallest run."""
    channel, low = beside.channel, float(beside.seen.min())
    if channel.peak >= max(SILENT * rms(channel.noise), low / SILENT_SHARE) or channel.peak >= low / FAR:
        return ""
    return (
        f"{plain(channel.name)} shows no response: it reads at most {reading(channel.peak, channel.unit)} where the "
        f"runs peak at {_range(beside.seen, channel.unit)}; a dead sensor, a wrong column or a wrong unit? Look at it, "
        "or leave it out: --channels"
    )


def _other_trigger(beside: _Beside) -> str:
    """That a shift which the case does not allow brings the record to a run."""
    channel, best = beside.channel, int(np.argmin(beside.residual))
    held = float(beside.residual[beside.allowed].min())
    if beside.allowed[best] or held < NOISE * rms(channel.noise) or beside.residual[best] > MENDED * held:
        return ""
    late = -1e3 * float(beside.shifts[best])  # ms
    nearest = reading(float(beside.residual[best]), channel.unit)
    return (
        f"{plain(channel.name)} lies beside the runs best when its clock is moved by {late:+.2f} ms (nearest run at "
        f"{nearest} instead of {reading(held, channel.unit)}), which the case does not allow: a late or early trigger?"
        f' Import it again with --shift "{late:.2f} ms", or state how well the trigger is known: '
        f'inversion.nuisance.time_offset = "{abs(late) / 2.0:.1g} ms"'
    )


def _range(values: Array, unit: str) -> str:
    """Smallest and largest of SI values."""
    return f"{reading(float(values.min()), unit)} .. {reading(float(values.max()), unit)}"


def _last(channel: Channel) -> float:
    """The record's last instant, with what lies outside the runs [s]."""
    cuts = () if channel.record is None else channel.record.cuts
    return max(float(channel.times[-1]), *(float(cut.times.max()) for cut in cuts), 0.0)


def _slip(factor: float) -> str:
    """A factor in words, with the confusion of units that makes it."""
    size = max(factor, 1.0 / factor)
    near = min(SLIPS, key=lambda known: abs(np.log(size / known)))
    which = "larger" if factor > 1.0 else "smaller"
    hint = f" (near {SLIPS[near]})" if abs(np.log(size / near)) < np.log(SLIP) else ""
    return f"{rounded(size, 2)} times {which} than their middle{hint}"
