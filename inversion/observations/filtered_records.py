"""Records that are filtered for an inversion, or that the laboratory has filtered; each with the filter of its model.

A record is read before it is filtered (`reader`): afterwards clipped, held and frozen stretches, single outliers,
noise and the reading at rest no longer show. Its noise stays that before the filter, its correlation included: for what
passes the filter the points are worth as much as before. The last stretch within the filter's reach is left out: there
the filter has little but the last readings, whose noise is then that of all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from birdstrike.data.curves import Measured, ReadBefore
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.formatting import listing
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.baseline import Baseline
from birdstrike.inversion.observations.clock import grid_step, off_grid, rounding_tolerance
from birdstrike.inversion.observations.expected import ROUNDING, Expected, first_motion
from birdstrike.inversion.observations.filters import CLASSES, CORNER, ModelFilter, reach, refuse_long_reach, zero_phase
from birdstrike.inversion.observations.noise import DIGITISER
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.observations.reader import (
    BESIDE,
    CLIPPED,
    DROPOUT,
    FROZEN,
    HELD,
    OUTLIER,
    SATURATED,
    ChannelRecord,
    read_record,
)

UNIFORM = 1e-3  # of a step, by which instants may lie off equally spaced ones that no clock has rounded
REST = 25.0  # reaches of rest, from which on filtered noise shows its level and its correlation
CARRIED = 3.0  # reaches before the first motion, at which nothing of the response is seen
STRETCHES = (HELD, CLIPPED, SATURATED, BESIDE, FROZEN)
SINGLE = (OUTLIER, DROPOUT)


@dataclass(frozen=True)
class FilteredRecord:
    """A filtered record.

    measured: its points; filter: of the curves that are compared with it; warnings: what the user should know;
    baselines: the readings at rest that have been subtracted, by channel.
    """

    measured: Measured
    filter: ModelFilter
    warnings: tuple[str, ...]
    baselines: Mapping[str, Baseline]

    def rest_columns(self, observations: Observations) -> Array:
        """(n, s) SI: what is uncertain in the readings at rest, a column for one standard deviation of each."""
        blocks = [
            self.baselines[c.name].columns(c.times) if c.name in self.baselines else np.zeros((len(c.times), 0))
            for c in observations.channels
        ]
        return np.asarray(block_diag(*blocks), dtype=np.float64)


def filtered_record(
    measured: Measured, name: str, dataset: Dataset, noise: Mapping[str, float], time_offset: float = 0.0
) -> FilteredRecord:
    """A record through the named filter, up to the end of the runs that are to be compared with it.

    Parameters
    ----------
    measured : Measured
        The record as it was taken, SI.
    name : str
        The filter's class.
    dataset : Dataset
        The campaign's runs, not filtered.
    noise : mapping
        Sensor -> standard deviation that the case states, SI.
    time_offset : float
        Standard deviation of the time origin [s].

    Returns
    -------
    FilteredRecord
        The points inside the simulated record; single outliers are replaced by interpolation before the filter and
        left out behind it.

    Raises
    ------
    UserError
        For a class that reaches too far, instants that are not equally spaced, gaps, clipped, held or frozen stretches
        in the simulated record, and a record that begins when the plate already moves.
    """
    start, end = float(dataset.time[0]), float(dataset.time[-1])
    refuse_long_reach("filter", name, end - start)
    record = _rows(measured, measured.time <= end * (1.0 + ROUNDING))
    step = _step(record, name)
    _refuse_late(record, name, first_motion(dataset))
    channels = _read(record, dataset, noise, time_offset)
    _refuse_stretches(record, name, channels, start)
    passed = ModelFilter(name, min(float(record.time[-1]), end), step)
    rests = {c: float(np.median(curves[:, 0])) for c, curves in dataset.curves.items()}
    found = replace(
        record,
        channels={c.name: _passed(record, c, passed, start, rests[c.name]) for c in channels},
        sigma={c.name: np.interp(record.time, c.times, c.noise.sigma) for c in channels},
        read_before={c.name: _read_before(c, start) for c in channels},
    )
    last = passed.end - reach(name)
    single = np.isin(record.time, np.concatenate([_singles(c) for c in channels]))
    return FilteredRecord(
        measured=_rows(found, (record.time >= start) & (record.time <= last * (1.0 + ROUNDING)) & ~single),
        filter=passed,
        warnings=tuple(text for c in channels for text in _warnings(c)) + _left_out(measured, "filter", name, last),
        baselines={c.name: c.baseline for c in channels if c.zeroed and c.baseline is not None},
    )


def filtered_by_laboratory(
    measured: Measured, name: str, dataset: Dataset, noise: Mapping[str, float]
) -> FilteredRecord:
    """A record that the laboratory has passed through the named filter, before it was cut.

    Near the runs' end its filter has seen what no run holds: the last stretch within the filter's reach is left out,
    and before the simulated record the one into which the filter has carried the response. A noise that is stated
    (sigma column; `noise`: sensor -> standard deviation by the case, SI) is that before the filter, which the filtered
    record can neither confirm nor contradict; where none is, level and correlation are those of the filtered record
    before contact.

    Raises
    ------
    UserError
        For a class that reaches too far.
    """
    time = dataset.time
    refuse_long_reach("filtered", name, float(time[-1] - time[0]))
    last = float(time[-1]) - reach(name)
    at_rest = measured.time <= first_motion(dataset) - CARRIED * reach(name)
    inside = (measured.time >= time[0]) & (measured.time <= last * (1.0 + ROUNDING))
    by_case = {c: np.full(len(measured.time), noise[c]) for c in measured.channels if noise.get(c)}
    by_case.update(measured.sigma)
    sources = {c: "sigma column" if c in measured.sigma else "case" for c in by_case}
    stated = replace(measured, sigma=by_case, read_before={c: ReadBefore(0.0, source) for c, source in sources.items()})
    return FilteredRecord(
        measured=_rows(stated, at_rest | inside),
        filter=ModelFilter(name, float(time[-1]), float(time[1] - time[0])),
        warnings=(
            *_left_out(measured, "filtered", name, last),
            *_unknown_noise(measured, name, [c for c in measured.channels if c not in by_case], measured.time[at_rest]),
        ),
        baselines={},
    )


def _rows(measured: Measured, kept: NDArray[np.bool_]) -> Measured:
    """The record's rows that are kept."""
    return replace(
        measured,
        time=measured.time[kept],
        channels={c: values[kept] for c, values in measured.channels.items()},
        sigma={c: values[kept] for c, values in measured.sigma.items()},
    )


def _step(measured: Measured, name: str) -> float:
    """Step of the record [s]; raises UserError where its instants are not equally spaced or it has gaps."""
    steps = np.diff(measured.time)
    if not len(steps) or off_grid(measured.time) > rounding_tolerance(measured.time, UNIFORM):
        raise UserError(
            f"filter = {name}: {measured.path} has steps of {1e3 * steps.min(initial=np.inf):.4g} .. "
            f"{1e3 * steps.max(initial=0.0):.4g} ms; a filter needs equally spaced instants: resample the record first"
        )
    gaps = [channel for channel, values in measured.channels.items() if not np.isfinite(values).all()]
    if gaps:
        raise UserError(
            f"filter = {name}: {measured.path}: a filter would smear the gaps of {', '.join(gaps)}; leave the filter "
            "or the channel (--channels) out, or cut the gaps out first"
        )
    return grid_step(measured.time)


def _refuse_late(measured: Measured, name: str, motion: float) -> None:
    """Raises UserError for a record that begins after the runs have begun to move [s]."""
    if measured.time[0] > motion:
        raise UserError(
            f"filter = {name}: {measured.path} begins at {1e3 * measured.time[0]:.4g} ms, when the plate already moves "
            f"(from {1e3 * motion:.4g} ms on): a filter needs the record from before contact; leave the filter out, or "
            "import the record from before contact on"
        )


def _read(
    measured: Measured, dataset: Dataset, noise: Mapping[str, float], time_offset: float
) -> tuple[ChannelRecord, ...]:
    """The channels as the reader takes them, from the record's first instant to the runs' end."""
    expected = Expected.of_campaign(dataset, noise, time_offset)
    whole = replace(expected, start=float(measured.time[0]), end=float(dataset.time[-1]), spared=0.0)
    return read_record(measured, whole, test_stated=False, zero=True)


def _refuse_stretches(measured: Measured, name: str, channels: tuple[ChannelRecord, ...], start: float) -> None:
    """Raises MeasuredError for stretches in the simulated record that a filter would smear over their neighbours."""
    errors = [
        f"filter = {name}: {c.name} in {measured.path} has {len(times)} points at {1e3 * times[0]:.4g} .. "
        f"{1e3 * times[-1]:.4g} ms that are {cut.reason.rstrip(',')}: a filter would mix them with the sound ones "
        "beside them; leave the filter or the channel (--channels) out"
        for c in channels
        for cut in c.cuts
        if cut.reason in STRETCHES and len(times := cut.times[cut.times >= start])
    ]
    if errors:
        raise MeasuredError(errors)


def _singles(channel: ChannelRecord) -> Array:
    """Instants [s] of single readings that are no response."""
    return np.concatenate([np.zeros(0), *(cut.times for cut in channel.cuts if cut.reason in SINGLE)])


def _passed(measured: Measured, channel: ChannelRecord, passed: ModelFilter, start: float, rest: float) -> Array:
    """(n,) SI: a channel less its reading at rest, through the filter, with the rest of the runs in front."""
    time, values = measured.time, measured.channels[channel.name]
    sound = ~np.isin(time, _singles(channel))
    values = np.interp(time, time[sound], values[sound])
    if channel.zeroed and channel.baseline is not None:
        values = values - channel.baseline.at(time)
    lead = max(len(passed.clock(start)) - len(time), 0)
    return zero_phase(np.concatenate([np.full(lead, rest), values]), passed.step, passed.name)[lead:]


def _read_before(channel: ChannelRecord, start: float) -> ReadBefore:
    """What the channel showed before the filter; start: of the simulated record [s]."""
    noise = channel.noise
    correlation_time = 0.0 if noise.source == DIGITISER else noise.correlation_time
    return ReadBefore(
        correlation_time=correlation_time,
        source=noise.source,
        known=noise.known,
        zeroed=True,
        drifts=channel.drift_subtracted,
        early=channel.times[channel.times < start],
        freedom=noise.freedom,
        points=noise.before[1] if correlation_time and noise.before is not None else 0,
    )


def _warnings(channel: ChannelRecord) -> tuple[str, ...]:
    """What was found in the channel before it was filtered."""
    single = [cut.sentence(channel.name) for cut in channel.cuts if cut.reason in SINGLE]
    return (*(f"{text} (before the filter they were replaced by interpolation)" for text in single), *channel.remarks)


def _unknown_noise(measured: Measured, name: str, unstated: Sequence[str], rest: Array) -> tuple[str, ...]:
    """That the noise before the filter is not known, where the rest (n,) [s] is too short to show that behind it."""
    needed = REST * reach(name)
    if not unstated or (len(rest) and np.ptp(rest) >= needed):
        return ()
    text = (
        f"filtered = {name}: {measured.path} shows the noise of {listing(list(unstated))} behind the filter alone, and "
        f"for that its rest before contact is too short ({1e3 * needed:.3g} ms would do): the intervals may be too "
        "narrow; state the noise of the unfiltered record (sensors.<name>.noise of the case, or import --sigma)"
    )
    return (text,)


def _left_out(measured: Measured, option: str, name: str, last: float) -> tuple[str, ...]:
    """How many readings after the last instant [s] that is used the fit does not see."""
    count = int((measured.time > last * (1.0 + ROUNDING)).sum())
    if not count:
        return ()
    text = (
        f"{option} = {name}: {count} readings after {1e3 * last:.4g} ms are left out of the fit: "
        f"the filter ({CORNER * CLASSES[name]:.0f} Hz) mixes them with what no simulation holds; simulate longer "
        "(time.end) to use them"
    )
    return (text,)
