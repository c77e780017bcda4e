"""TDMS, as LabVIEW and DIAdem write it: the channels of one group, by npTDMS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from nptdms import TdmsFile  # pyright: ignore[reportMissingImports] (an optional extra)

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, chosen, table_of
from birdstrike.data.tables.loose_table import LooseTable


def read(path: Path, table: str) -> LooseTable:
    """Channels with their unit_string; their waveform's clock where no channel is the time."""
    try:
        file = TdmsFile.read(path)
    except Exception as error:  # the library raises a dozen types for a file that is none
        raise MeasuredError(f"{path} cannot be read as TDMS: {error}") from error
    groups = {group.name: group for group in file.groups() if group.channels()}
    group = groups[chosen(path, list(groups), table, "group")]
    columns: list[NamedColumn] = []
    for channel in group.channels():
        values = np.asarray(channel[:])
        if np.issubdtype(values.dtype, np.number):
            columns.append(
                NamedColumn(channel.name, values.astype(float), channel.properties.get("unit_string") or None)
            )
    first = group.channels()[0]
    named = any(column.name.lower().startswith(("time", "zeit")) for column in columns)
    if "wf_increment" in first.properties and not named:
        columns.insert(0, NamedColumn("time", np.asarray(first.time_track(), dtype=float), "s"))
    return table_of(path, columns, [f"TDMS, group {group.name}"])
