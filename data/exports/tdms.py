"""TDMS, as LabVIEW and DIAdem write it: the channels of one group, by npTDMS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsChannel, TdmsFile  # pyright: ignore[reportMissingImports] (an optional extra)

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, chosen, table_of
from birdstrike.data.tables.loose_table import LooseTable


def read(path: Path, table: str) -> LooseTable:
    """Channels with their unit_string; the clocks of their waveforms, each once, where no channel is the time."""
    try:
        file = TdmsFile.read(path)
    except Exception as error:  # the library raises a dozen types for a file that is none
        raise MeasuredError(f"{path} cannot be read as TDMS: {error}") from error
    groups = {group.name: group for group in file.groups() if group.channels()}
    group = groups[chosen(path, list(groups), table, "group")]
    channels = [channel for channel in group.channels() if np.issubdtype(channel.dtype, np.number)]
    named = any(channel.name.lower().startswith(("time", "zeit")) for channel in channels)
    length = max((len(channel) for channel in channels), default=0)
    columns, clock = list[NamedColumn](), None
    for channel in channels:
        if not named and len(channel) and (own := _clock(channel)) not in (None, clock):
            clock = own
            columns.append(_times(channel, channels[0], length))
        values = np.full(length, np.nan)
        values[: len(channel)] = channel[:]
        columns.append(NamedColumn(channel.name, values, channel.properties.get("unit_string") or None))
    return table_of(path, columns, [f"TDMS, group {group.name}"])


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
        begin += float((of["wf_start_time"] - zero["wf_start_time"]) / np.timedelta64(1, "ns")) * 1e-9
    return NamedColumn("time", begin + float(of["wf_increment"]) * np.arange(count), "s")
