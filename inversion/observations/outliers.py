"""What an experimentalist takes out of a record before fitting: clipped and frozen stretches, dropouts, outliers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from birdstrike.data.histories import Array
from birdstrike.inversion.observations.high_frequency import digitiser_step

FEWEST = 20  # points below which a table is taken as it is
CLIPPED_RUN = 4  # equal readings in a row
CLIPPED_SHARE = 0.5  # of the peak: a record at rest repeats itself without being clipped
OUTLIER = 8.0  # robust standard deviations
UNEVEN = 0.5  # of a step
STEPS_BESIDE = 4  # part of the length of equal readings over which those on both sides must go on smoothly
FEW_EQUAL = 24  # readings of a smooth curve that noise of less than a step has made equal
ROUNDING = 0.1  # of a step
GUARD = 4.0  # standard deviations of the noise: one reading in 30 000 is farther off
BESIDE_MEAN = 5  # readings
MISSING = 1.5  # of a step between two readings: more is a gap
LOST_SHARE = 0.8  # of the extreme
FROZEN_RUN = 8  # equal readings in a row
REPEATS = 0.05  # share of equal neighbours elsewhere, beyond which repeating is the digitiser's way
HELD_RUNS = 8  # runs of equal readings from which a held channel is seen
HELD_SHARE = 0.8  # of these runs that are equally long
HELD_STEPS = 3.0  # steps of the digitiser by which a held channel usually moves, at least
BAND = 7.0  # standard deviations of the noise from a record's extreme: readings of a flat top keep within it
FLAT_POINTS = 30
FLAT_SHARE = 0.95  # of the readings between the first and the last in that band
CORE = 0.8  # of a flat top, without its ends
SAG = 1.2  # standard deviations that a flat top bends in its core; a smooth peak bends by about 3
LEAVES = 10.0  # standard deviations by which the record leaves a flat top on both sides
RIPPLE = 4.0  # variance of means of five readings in a flat top, of that of white noise: a filter's noise reaches 3
DROPOUTS = 3  # readings of one value
DROPOUT_RUN = 3  # such readings in a row, at most
DROPOUT_SHARE = 0.05  # of the peak, by which such readings lie off those around
DROPOUT_TOO = 0.2  # of that distance, from which the same reading elsewhere is lost too
DROPOUT_STEPS = 20.0  # times the usual change between neighbours
AROUND = 5  # readings on either side
JUMP_SHARE = 0.3  # of the peak, between two readings
JUMP_STEPS = 20.0  # times the usual change between neighbours
JUMP_GAP = 2.5  # of a step: an outlier beside the jump has been left out
MAD_TO_SIGMA = 1.4826
NEIGHBOURS_SIGMA = 1.39  # of a point minus the cubic through four neighbours, for white noise of 1


def held(values: Array) -> NDArray[np.bool_]:
    """(n,) True at readings that only repeat the one before, as many in a row each time: of a slower channel.

    A logger that writes all channels at the fastest one's rate does so; a longer stretch of equal readings, as at rest,
    has several of the slower channel. A slow motion in steps of a coarse digitiser repeats readings too, but goes on by
    one step.
    """
    begins = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]])) if len(values) else np.zeros(0, int)
    lengths = np.diff(begins)[1:]
    marked = np.zeros(len(values), dtype=bool)
    if len(lengths) < HELD_RUNS:
        return marked
    usual, moves = float(np.median(lengths)), float(np.median(np.abs(np.diff(values[begins]))))
    if usual < 2.0 or (lengths == usual).mean() < HELD_SHARE or moves < HELD_STEPS * digitiser_step(values):
        return marked
    places = np.arange(len(values))
    since = places - begins[np.searchsorted(begins, places, side="right") - 1]
    return np.asarray(since % round(usual) != 0)


def clipped(values: Array) -> NDArray[np.bool_]:
    """(n,) True where the amplifier stood at its end: four or more readings in a row equal to the extreme one.

    Single readings at an end that was reached so are clipped too. A smooth peak that a coarse digitiser has made flat
    is none: the readings beside it are one step lower.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    peak = np.abs(values).max()
    for end in (values.max(), values.min()):
        if abs(end) < CLIPPED_SHARE * peak:
            continue
        begins, ends = _stretches(values == end)
        longest = int(np.argmax(ends - begins))
        if ends[longest] - begins[longest] >= CLIPPED_RUN and not _rounded(values, begins[longest], ends[longest]):
            marked |= values == end
    return marked


def _rounded(values: Array, begin: int, end: int) -> bool:
    """Whether equal readings are a smooth curve in steps of a digitiser: the readings on both sides go on from them.

    A parabola that stays within one step over a length 2 h lies, at a distance d beyond its end, at most (1 + d / h)^2
    steps off (Chebyshev). One step more is granted to noise: where the readings beside go up and down, and where so few
    are equal that noise may have made them so.
    """
    step, length = digitiser_step(values), end - begin
    room = max(2, length // STEPS_BESIDE)
    around = [np.diff(values[max(begin - length, 0) : begin]), np.diff(values[end : end + length])]
    noisy = length < FEW_EQUAL or any((part > 0.0).any() and (part < 0.0).any() for part in around)
    far = (1.0 + 2.0 * room / (length - 1)) ** 2 + noisy + ROUNDING
    beside = [values[max(begin - room, 0) : begin], values[end : end + room]]
    return step > 0.0 and all(len(part) == room and np.abs(part - values[begin]).max() < far * step for part in beside)


def beside_clipped(values: Array, flat: NDArray[np.bool_], sigma: float) -> NDArray[np.bool_]:
    """(n,) True at readings beside a clipped stretch that only their own noise has kept below its end.

    values: with NaN at gaps; flat: clipped, or lost in a gap at the record's extreme; sigma: of the noise. The readings
    are low on average: a fit that took them would be biased. The band ends where the mean of the next five readings
    lies four standard deviations of the noise off the extreme.
    """
    marked = np.zeros(len(values), dtype=bool)
    begins, ends = _stretches(flat)
    for begin, end in zip(begins, ends, strict=True):
        before, after = np.arange(begin)[::-1], np.arange(end, len(values))
        inside = values[begin:end][np.isfinite(values[begin:end])]
        for outward in (before, after):
            outward = outward[np.isfinite(values[outward])]
            if not len(outward):
                continue
            level = _extreme(values, float(inside[0] if len(inside) else values[outward[0]]))
            means = np.convolve(np.abs(level - values[outward]), np.full(BESIDE_MEAN, 1.0 / BESIDE_MEAN), "valid")
            clear = np.flatnonzero(means > GUARD * sigma)
            marked[outward[: clear[0] if len(clear) else len(outward)]] = True
    return marked & ~flat


def _extreme(values: Array, near: float) -> float:
    """The end of the readings on whose side a reading is."""
    return float(np.nanmax(values) if near > 0.0 else np.nanmin(values))


def saturated(values: Array, sigma: float) -> NDArray[np.bool_]:
    """(n,) True on a flat top that noise has been added to: the sensor stood at its end, the digitiser did not.

    The top of a smooth peak bends by as much as its ends lie below it; a flat one does not, and is left on both sides.
    A plate that yields can stay at its peak and ring there, by more than the noise: that is no flat top.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST or not sigma > 0.0:
        return marked
    peak = np.abs(values).max()
    for sign in (1.0, -1.0):
        heights = sign * values
        top = heights.max()
        inside = np.flatnonzero(heights >= top - BAND * sigma)
        first, last = int(inside[0]), int(inside[-1])
        length = last - first + 1
        if top < CLIPPED_SHARE * peak or length < FLAT_POINTS or len(inside) < FLAT_SHARE * length:
            continue
        ends, room = round(0.5 * (1.0 - CORE) * length), length // 2
        core = heights[first + ends : last + 1 - ends]
        sag = -float(np.polyfit(np.linspace(-1.0, 1.0, len(core)), core, 2)[0])
        beside = [heights[max(first - room, 0) : first], heights[last + 1 : last + 1 + room]]
        left = all(len(part) and top - part.min() > (BAND + LEAVES) * sigma for part in beside)
        marked[first : last + 1] |= left and sag < SAG * sigma and not _ripples(core, sigma)
    return marked


def _ripples(core: Array, sigma: float) -> bool:
    """Whether the readings of a flat top move together by more than noise of this standard deviation does."""
    means = core[: len(core) // BESIDE_MEAN * BESIDE_MEAN].reshape(-1, BESIDE_MEAN).mean(axis=1)
    return float(means.var(ddof=1)) > RIPPLE * sigma**2 / BESIDE_MEAN


def dropouts(values: Array) -> NDArray[np.bool_]:
    """(n,) True at readings of one value that stand again and again among others far from it: lost samples."""
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    usual = max(
        DROPOUT_SHARE * float(np.abs(values).max()),
        DROPOUT_STEPS * float(np.median(np.abs(np.diff(values)))),
        DROPOUT_RUN * digitiser_step(values),
    )
    levels, counts = np.unique(values[_far_from_any_around(values, usual)], return_counts=True)
    for level in levels[counts >= DROPOUTS]:
        lost = values == level
        begins, ends = _stretches(lost)
        short = {
            (int(begin), int(end)): _off_those_around(values, lost, int(begin), int(end))
            for begin, end in zip(begins, ends, strict=True)
            if end - begin <= DROPOUT_RUN
        }
        inner = {place: off for place, off in short.items() if place[0] > 0 and place[1] < len(values)}
        if sum(end - begin for (begin, end), off in inner.items() if off > usual) >= DROPOUTS:
            for (begin, end), off in short.items():
                marked[begin:end] = off > DROPOUT_TOO * usual
    return marked


def _far_from_any_around(values: Array, usual: float) -> NDArray[np.bool_]:
    """(n,) True at readings that lie farther than `usual` off any that `_off_those_around` may compare them with.

    Only these can be lost samples. A converter of 16 bits has some 10000 levels; one by one, a million readings of it
    would take minutes.
    """
    width = 2 * (AROUND + DROPOUT_RUN) + 1
    above = maximum_filter1d(values, width, mode="nearest") - values
    below = values - minimum_filter1d(values, width, mode="nearest")
    return np.maximum(above, below) > usual


def _off_those_around(values: Array, lost: NDArray[np.bool_], begin: int, end: int) -> float:
    """How far the lost readings begin .. end lie off the readings on both sides, by the nearer side that there is."""
    sides = (slice(max(begin - AROUND, 0), begin), slice(end, end + AROUND))
    others = [values[side][~lost[side]] for side in sides]
    return min((abs(float(values[begin] - np.median(part))) for part in others if len(part)), default=0.0)


def jumps(times: Array, values: Array) -> NDArray[np.intp]:
    """Places of readings that are followed, a sample or two later, by one more than three tenths of the peak away."""
    if len(values) < FEWEST:
        return np.zeros(0, dtype=np.intp)
    apart, steps = np.abs(np.diff(values)), np.diff(times)
    far = max(JUMP_SHARE * float(np.abs(values).max()), JUMP_STEPS * float(np.median(apart)))
    return np.flatnonzero((apart > far) & (steps < JUMP_GAP * np.median(steps)))


def lost_at_the_extreme(times: Array, values: Array) -> NDArray[np.bool_]:
    """(n,) True in gaps of values (n,) whose neighbours on both sides are near the record's extreme: an overload.

    Only where readings are missing by the channel's own steps: a channel that shares its file's clock with others has
    empty cells between its readings. And only gaps longer than those elsewhere: a logger that loses cells now and then
    loses some at the extreme too.
    """
    marked = np.zeros(len(values), dtype=bool)
    given = np.isfinite(values)
    if given.sum() < FEWEST:
        return marked
    step = float(np.median(np.diff(times[given])))
    gaps: list[tuple[int, int, float, bool]] = []
    for begin, end in zip(*_stretches(np.isnan(values)), strict=True):
        if begin > 0 and end < len(values) and times[end] - times[begin - 1] > MISSING * step:
            level = _extreme(values, float(values[begin - 1]))
            high = bool((values[[begin - 1, end]] / level > LOST_SHARE).all())
            gaps.append((int(begin), int(end), float(times[end] - times[begin - 1]), high))
    usual = max((length for *_, length, high in gaps if not high), default=0.0)
    for begin, end, length, high in gaps:
        marked[begin:end] = high and length > usual + 0.5 * step
    return marked


def frozen(values: Array) -> NDArray[np.bool_]:
    """(n,) True where a logger or a broken sensor has repeated one reading eight times or more.

    Not as long as a sensor has read the same to a step since the record's beginning, where it is at rest, nor on a
    smooth curve in steps, nor in records that a coarse digitiser makes repeat themselves anyway.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    begins, ends = _stretches(np.append(np.diff(values) == 0.0, False))
    long, step = ends - begins >= FROZEN_RUN - 1, digitiser_step(values)
    for begin, end in zip(begins[long], ends[long], strict=True):
        rests = bool((np.abs(values[:begin] - values[begin]) < 1.5 * step).all())
        marked[begin : end + 1] = not rests and not _rounded(values, begin, end + 1)
    rest = np.diff(values[~marked])
    coarse = len(rest) == 0 or np.mean(rest[np.flatnonzero(rest)[0] if rest.any() else 0 :] == 0.0) > REPEATS
    return np.zeros(len(values), dtype=bool) if coarse else marked


def _stretches(marked: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First indices of stretches of True, and those behind their last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return edges[::2], edges[1::2]


def outliers(times: Array, values: Array, noise: Array) -> NDArray[np.bool_]:
    """(n,) True at single points far off the cubic through their four neighbours.

    Far: more than 8 of the record's own robust scatter about such cubics, and of the noise (n,). Only among five
    instants (n,) that are equally spaced: across a gap the cubic says nothing.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    y = values
    middle = (-y[:-4] + 4.0 * y[1:-3] + 4.0 * y[3:-1] - y[4:]) / 6.0
    apart = np.abs(y[2:-2] - middle)
    own = MAD_TO_SIGMA * float(np.median(apart))
    far = apart > OUTLIER * np.maximum(own, NEIGHBOURS_SIGMA * noise[2:-2])
    around = np.lib.stride_tricks.sliding_window_view(np.pad(apart, 2), 5).max(axis=1)
    steps = np.lib.stride_tricks.sliding_window_view(np.diff(times), 4)
    even = np.ptp(steps, axis=1) <= UNEVEN * np.median(steps, axis=1)
    marked[2:-2] = far & even & (apart == around)
    return marked
