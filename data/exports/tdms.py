"""TDMS, as LabVIEW and DIAdem write it: the channels of one group, by npTDMS."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsChannel, TdmsFile  # pyright: ignore[reportMissingImports] (an optional extra)

from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.exports.columns import NamedColumn, chosen, table_of
from birdstrike.data.histories import Array
from birdstrike.data.tables.loose_table import LooseTable


def read(path: Path, table: str) -> LooseTable:
    """Channels with their unit_string; the clocks of their waveforms, each once, where no channel is the time.

    A channel of dates, one for each reading, counts in seconds from its first one.
    """
    try:
        return _read(path, table)
    except UserError:
        raise
    except Exception as error:  # the library raises a dozen types for a file that is none, or damaged
        raise MeasuredError(f"{path} cannot be read as TDMS: {error!r}") from error


def _read(path: Path, table: str) -> LooseTable:
    file = TdmsFile.read(path, raw_timestamps=True)  # else they are cut to microseconds
    groups = {group.name: group for group in file.groups() if group.channels()}
    group = groups[chosen(path, list(groups), table, "group")]
    length = max((len(c) for c in group.channels() if np.issubdtype(c.dtype, np.number)), default=0)
    dated = [c for c in group.channels() if len(c) == length > 0 and np.issubdtype(c.dtype, np.datetime64)]
    channels = [c for c in group.channels() if c in dated or np.issubdtype(c.dtype, np.number)]
    named = bool(dated) or any(channel.name.lower().startswith(("time", "zeit")) for channel in channels)
    columns, clock = list[NamedColumn](), None
    for channel in channels:
        if not named and len(channel) and (own := _clock(channel)) not in (None, clock):
            clock = own
            columns.append(_times(channel, channels[0], length))
        values = np.full(length, np.nan)
        values[: len(channel)] = _since(channel[0], channel[:]) if channel in dated else channel[:]
        unit = "s" if channel in dated else channel.properties.get("unit_string") or None
        columns.append(NamedColumn(channel.name, values, unit))
    read = table_of(path, columns, [f"TDMS, group {group.name}"])
    firsts = {channel.name: channel[0] for channel in dated}
    remarks = (
        f"column {name}: times of day were read, and count from the first row, {at}" for name, at in firsts.items()
    )
    return replace(read, remarks=(*read.remarks, *remarks))


def _since(first: Any, dates: Any) -> Array:
    """Seconds from one instant to others (n,), or to another, which stand as seconds and parts of 2^-64 s."""
    parts = np.asarray(dates.second_fractions, dtype=float) - float(first.second_fractions)
    return np.asarray(dates.seconds, dtype=float) - float(first.seconds) + parts * 2.0**-64


def _clock(channel: TdmsChannel) -> tuple[Any, ...] | None:
    """What the times of a waveform's channel are made of; None where it has no clock."""
    properties = channel.properties
    if "wf_increment" not in properties:
        return None
    return properties.get("wf_start_time"), properties.get("wf_start_offset", 0.0), properties["wf_increment"]


def _times(channel: TdmsChannel, first: TdmsChannel, count: int) -> NamedColumn:
    """Times of a channel's waveform [s], from the instant from which those of the group's first channel count."""
    of, zero = channel.properties, first.properties
    begin = float(of.get("wf_start_offset", 0.0))
    if "wf_start_time" in of and "wf_start_time" in zero:
        begin += float(_since(zero["wf_start_time"], of["wf_start_time"]))
    return NamedColumn("time", begin + float(of["wf_increment"]) * np.arange(count), "s")
