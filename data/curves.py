"""Curves in CSV files: a user's measured data, read strictly, and simulated histories, written byte for byte alike."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import StringIO
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.arguments import as_names
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.exports.registry import EXPORTS
from birdstrike.data.formatting import reading
from birdstrike.data.histories import Array, Histories
from birdstrike.data.paths import resolve_measured
from birdstrike.data.storage.files import file_digest, write_atomically
from birdstrike.data.tables.csv_table import MOST_LINES, Column, CsvTable, first_of, read_table
from birdstrike.data.tables.import_line import import_line
from birdstrike.data.units import ACCEPTED, DISPLAY, in_unit

REPEATS = 0.2  # share of rows with the time of the row above, beyond which the clock has too few digits
CELL = "leave the cell empty"
FOREIGN = (CELL, "needs a name and a unit", "one column only", "as UTF-8", 'must be "time', "holds no table")
"""Words of the errors that a file in another format gives rise to; the first, a cell in a record's own format too."""
LONGEST = 60  # letters of a shot's or a case's name: both stand together in the name of a file
FORMAT = "%.9e"  # ten digits: more than any sensor has, the same text for the same double everywhere


@dataclass(frozen=True)
class ReadBefore:
    """What was read of a channel before it was filtered, and cannot be read of it again.

    correlation_time: of the noise in its sigma column [s], 0 where white; source: where that noise comes from; known:
    False where it is a tolerance that nobody measured; zeroed: whether the reading at rest has been looked for; drifts:
    whether it has a drift, which was subtracted; early: (e,) instants [s] of sound readings before those that are left;
    freedom: degrees of freedom behind the level of the noise; points: at rest, by which it is known to be correlated, 0
    where it is white.
    """

    correlation_time: float
    source: str
    known: bool = True
    zeroed: bool = False
    drifts: bool = False
    early: Array = field(default_factory=lambda: np.zeros(0))
    freedom: float = np.inf
    points: int = 0


@dataclass(frozen=True)
class Measured:
    """A measured record on one clock.

    time: (n,) [s], increasing, negative before the trigger; channels: sensor -> (n,) SI, NaN where the record has a
    gap; sigma: sensor -> (n,) SI standard deviations, only where given; units: sensor -> SI unit;
    provenance: the file's # lines, without the sign; digest: SHA-256 of the file's content, "" where there is no file;
    read_before: sensor -> what was read of it before a filter.
    """

    time: Array
    channels: Mapping[str, Array]
    sigma: Mapping[str, Array]
    units: Mapping[str, str]
    provenance: tuple[str, ...] = field(default=())
    path: str = ""
    digest: str = ""
    read_before: Mapping[str, ReadBefore] = field(default_factory=dict)

    @property
    def simulated(self) -> bool:
        """Whether the provenance says that no instrument took this record."""
        return any("SIMULATED" in line for line in self.provenance)

    def as_simulated(self) -> Measured:
        """The record with a provenance that says that no instrument took it."""
        return self if self.simulated else replace(self, provenance=("SIMULATED, NOT MEASURED.", *self.provenance))

    def scaled(self, factors: Mapping[str, float]) -> Measured:
        """The record with these channels and their noise multiplied by a number, said in its provenance."""
        factors = {name: factor for name, factor in factors.items() if factor != 1.0}
        channels = {name: values * factors.get(name, 1.0) for name, values in self.channels.items()}
        sigma = {name: values * abs(factors.get(name, 1.0)) for name, values in self.sigma.items()}
        notes = tuple(f"{name} was multiplied by {factor:g}." for name, factor in factors.items())
        return replace(self, channels=channels, sigma=sigma, provenance=(*self.provenance, *notes))

    def refuse_dead_sensors(self) -> None:
        """Raise MeasuredError for every channel that reads one value everywhere: there is nothing to invert."""
        found = {name: self.points(name)[1] for name in self.channels}
        dead = {name: values for name, values in found.items() if not len(values) or not np.ptp(values)}
        if dead:
            raise MeasuredError([f'{self.path}: "{name}" {self._dead(name, values)}' for name, values in dead.items()])

    def _dead(self, name: str, values: Array) -> str:
        """What a channel that never changes reads, and what to do."""
        if not values.any():
            return "is zero everywhere: a dead sensor? leave its column out, or the channel: --channels"
        reads = reading(float(values[0]), self.units[name], 4)
        return (
            f"reads {reads} everywhere: a dead or saturated sensor, or another column? leave its column out, or the "
            "channel: --channels"
        )

    def same_points(self, other: Measured) -> bool:
        """Whether two records hold the same points in the channels that both have, whatever their files are called."""
        common = self.channels.keys() & other.channels.keys()
        return (
            bool(common)
            and np.array_equal(self.time, other.time)
            and all(np.array_equal(self.channels[n], other.channels[n], equal_nan=True) for n in common)
        )

    def only(self, channels: Sequence[str]) -> Measured:
        """The record with these channels alone, all where none is named; raises MeasuredError for one it has not."""
        if not (channels := as_names("channels", channels)):
            return self
        unknown = [name for name in channels if name not in self.channels]
        if unknown:
            known = f"its channels: {', '.join(self.channels)}"
            raise MeasuredError([f'--channels: {self.path} has no channel "{name}"; {known}' for name in unknown])
        kept = {name: values for name, values in self.channels.items() if name in channels}
        sigma = {name: values for name, values in self.sigma.items() if name in channels}
        return replace(self, channels=kept, sigma=sigma, units={name: self.units[name] for name in kept})

    def points(self, channel: str) -> tuple[Array, Array]:
        """Times [s] and values of one channel, gaps left out."""
        given = np.isfinite(self.channels[channel])
        return self.time[given], self.channels[channel][given]


def on_one_clock(records: Sequence[Measured]) -> Measured:
    """Channels of several records together, each with gaps where its own has no sample.

    Raises MeasuredError for two channels of one name.
    """
    time = np.unique(np.concatenate([record.time for record in records]))
    channels, sigma, units = dict[str, Array](), dict[str, Array](), dict[str, str]()
    before = dict[str, ReadBefore]()
    for record in records:
        if twice := [name for name in record.channels if name in channels]:
            paths = " and ".join(one.path for one in records)
            raise MeasuredError([f'{paths} both have "{name}"; leave it out of one of them' for name in twice])
        at = np.searchsorted(time, record.time)
        for source, target in ((record.channels, channels), (record.sigma, sigma)):
            for name, values in source.items():
                target[name] = np.full(len(time), np.nan)
                target[name][at] = values
        units |= record.units
        before |= record.read_before
    notes = tuple(line for record in records for line in record.provenance)
    paths = ", ".join(record.path for record in records)
    return Measured(time, channels, sigma, units, notes, paths, read_before=before)


def only_channels(records: Sequence[Measured], channels: Sequence[str]) -> list[Measured]:
    """Several shots' records, each with those of these channels that it has, all where none is named.

    Raises MeasuredError for a channel that no record has, and for a record that has none of them.
    """
    channels = as_names("channels", channels)
    if len(records) == 1:
        return [records[0].only(channels)]
    held = dict.fromkeys(name for one in records for name in one.channels)
    unknown = [name for name in channels if name not in held]
    errors = [f'--channels: no record has a channel "{name}"; their channels: {", ".join(held)}' for name in unknown]
    errors += [
        f"--channels: {one.path} has none of {', '.join(channels)}; its channels: {', '.join(one.channels)}; "
        "name one of them too, or leave the record out"
        for one in records
        if channels and not unknown and not any(name in one.channels for name in channels)
    ]
    if errors:
        raise MeasuredError(errors)
    return [one.only([name for name in channels if name in one.channels]) for one in records]


def refuse_twice(given: Sequence[tuple[str, Measured]]) -> None:
    """Raise UserError where one record is given twice: it would halve its noise, or explain or test itself.

    given: (option by which it was given, record).
    """
    errors = [
        f"{option}: {one.path} and {f'{again}: ' if again != option else ''}{other.path} hold the same points; a "
        "record counts once, so leave one out"
        for (option, one), (again, other) in combinations(given, 2)
        if one.same_points(other)
    ]
    if errors:
        raise UserError(errors)


def shot_names(records: Sequence[Measured]) -> list[str]:
    """A name of its own for each record, from its file's, at most `LONGEST` letters long but for a number.

    Without the signs that part effect, shot and pair in an answer, and names in an option: they become "_".
    """
    return file_names([one.path for one in records])


def file_names(paths: Sequence[str]) -> list[str]:
    """The same of the records' paths."""
    plain = [re.sub("[@+,]", "_", Path(one).stem)[:LONGEST] or f"shot{i + 1}" for i, one in enumerate(paths)]
    found: list[str] = []
    for i, name in enumerate(plain):
        own = name if plain.count(name) == 1 else f"{name}_{i + 1}"
        while own != name and own in plain:
            own += "_"
        found.append(own)
    return found


def read_measured(path: str | Path) -> Measured:
    """A measured-data CSV; raises MeasuredError with every error and its line number, and how to import an export."""
    try:
        read = measured_from(read_table(Path(path)), path)
        return replace(read, digest=file_digest(Path(path)))
    except MeasuredError as error:
        foreign = [text for text in error.errors if _is_foreign(text)]
        hint = _import_hint(Path(path)) if foreign else ()
        cells_alone = all(CELL in text for text in foreign)
        raise MeasuredError([*error.errors, *hint] if cells_alone else [*hint, *error.errors], error.heading) from error


def as_measured(record: str | Path | Measured) -> Measured:
    """A record as it is, anything else as `read_measured` reads the file, or the shipped curve of that name."""
    return record if isinstance(record, Measured) else read_measured(resolve_measured(record))


def _is_foreign(error: str) -> bool:
    """Whether an error says that a file is in another format, not that a record has a fault."""
    return any(sign in error for sign in FOREIGN)


def _import_hint(path: Path) -> Iterable[str]:
    """How to make a record of a file that is none; nothing where it is no table at all."""
    line = import_line(path)
    if not line and path.exists() and path.suffix.lower() in EXPORTS:
        line = f"birdstrike import {shlex.quote(str(path))} --sensor displacement_centre --out record.csv"
    if line:
        yield f"{path} is no measured-data CSV; if it is an export, this makes a record of it: {line}"


def measured_from(table: CsvTable, path: str | Path) -> Measured:
    """A table as a record, time first, then the sensors; raises MeasuredError with every error and its line."""
    time, *others = table.columns
    sigma = {c.name.removesuffix("_sigma"): c.values for c in others if c.name.endswith("_sigma")}
    channels = {c.name: c for c in others if not c.name.endswith("_sigma")}
    errors = [*_clock_errors(time, others), *_channel_errors(channels, others), *_sigma_errors(channels, sigma, time)]
    if errors:
        raise MeasuredError([f"{path}, {error}" for error in errors])
    values = {name: column.values for name, column in channels.items()}
    units = {name: column.unit for name, column in channels.items()}
    return Measured(time.values, values, sigma, units, table.provenance, str(path))


def _clock_errors(time: Column, others: Sequence[Column]) -> Iterable[str]:
    if time.name != "time" or time.unit != "s":
        yield f'line {time.header_line}: the first column is "{time.header}" and must be "time [ms]"'
        return
    lost = [time.lines[i] for i in np.flatnonzero(np.isnan(time.values))]
    yield from first_of([f"line {n}: the time is missing; a gap is an empty cell of a sensor's column" for n in lost])
    yield from _order_errors(time, others)
    if len(time.values) < 2:
        yield f"line {time.header_line}: {len(time.values)} rows follow; a record needs at least 2"


def _order_errors(time: Column, others: Sequence[Column]) -> Iterable[str]:
    """Rows whose time does not increase: rows or a whole table that stand again, or a clock with too few digits."""
    steps = np.diff(time.values)
    back = np.flatnonzero(steps <= 0.0) + 1
    if not len(back):
        return
    first, falls, same = back[0], bool((steps < 0.0).any()), _same(others, back - 1, back)
    said = f"line {time.lines[first]}: the time {time.texts[first]}"
    if len(back) > MOST_LINES and (steps < 0.0).all():
        yield f"{said} does not increase, nor does that of any row: the file runs backwards; sort its rows by time"
    elif len(back) > MOST_LINES and same.all() and not falls:
        yield (
            f"{said} does not increase: the row stands in line {time.lines[first - 1]} too, as do {len(back)} "
            "rows with all their values; leave one of each out, so that there is one for each instant"
        )
    elif len(back) > max(MOST_LINES, REPEATS * len(steps)) and not falls:
        yield (
            f"{said} stands twice, as in {len(back)} of the rows: the clock has too few digits; export it with more, "
            'or import the file with --rate "200 kHz", its rate of samples'
        )
    elif len(back) == 1 and falls and time.values[first] == time.values[0]:
        rows = np.arange(min(first, len(time.values) - first))
        yield f"{said} does not increase: the clock begins again, {_again(_same([time, *others], rows, first + rows))}"
    else:
        yield from _rows_back(time, back, same)


def _again(same: NDArray[np.bool_]) -> str:
    """What stands behind the place where a clock begins again; same: rows with the values of the first ones."""
    if same.all():
        return "with the same values as at the file's beginning: the table stands twice; delete the rows from here on"
    return "with other values than at the file's beginning: a second record; put it into a file of its own"


def _rows_back(time: Column, back: NDArray[np.int64], same: NDArray[np.bool_]) -> Iterable[str]:
    """The first of the rows `back` whose time does not increase; same: with the values of the row above."""
    for i, again in list(zip(back, same, strict=True))[:MOST_LINES]:
        said = f"line {time.lines[i]}: the time {time.texts[i]} does not increase"
        if time.values[i] < time.values[i - 1]:
            yield f"{said}; sort the rows, one for each instant"
        else:
            values = "the same values; leave one out" if again else "other values; keep one for each instant"
            yield f"{said}: it stands in line {time.lines[i - 1]} too, with {values}"
    if len(back) > MOST_LINES:
        last = time.lines[back[-1]]
        yield f"line {last}: the last of {len(back)} rows whose time does not increase; two records in one file?"


def _same(columns: Sequence[Column], one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether rows (k,) have the same values in all columns, gaps at the same places."""
    pairs = [(c.values[one], c.values[other]) for c in columns]
    return np.all([(a == b) | (np.isnan(a) & np.isnan(b)) for a, b in pairs], axis=0)


def _channel_errors(channels: Mapping[str, Column], columns: Iterable[Column]) -> Iterable[str]:
    if not channels:
        yield 'line 1: no sensor\'s column; the header is "time [ms],displacement_centre [mm]"'
    for column in columns:
        sensor = column.name.removesuffix("_sigma")
        base = channels.get(sensor)
        if base is None:
            yield f'line {column.header_line}: "{column.header}" has no column "{sensor}" beside it'
        elif base.unit != column.unit:
            yield f'line {column.header_line}: "{column.header}" is not in a unit of "{base.header}"'
        elif np.isfinite(column.values).sum() < 2 <= len(column.values):
            yield f'line {column.header_line}: "{column.header}" has fewer than 2 values'


def _sigma_errors(channels: Mapping[str, Column], sigma: Mapping[str, Array], time: Column) -> Iterable[str]:
    for name, values in sigma.items():
        if name not in channels:
            continue
        low, lost = values <= 0.0, np.isnan(values) & np.isfinite(channels[name].values)
        yield from first_of([f"line {time.lines[i]}: {name}_sigma must be greater than 0" for i in np.flatnonzero(low)])
        yield from first_of(
            [f"line {time.lines[i]}: {name} has a value here and {name}_sigma has none" for i in np.flatnonzero(lost)]
        )


def write_measured(path: str | Path, measured: Measured) -> None:
    """Write a record in the format that `read_measured` reads, in engineers' units, losing no bit."""
    columns = [("time", "s", measured.time)]
    for name, values in measured.channels.items():
        columns.append((name, measured.units[name], values))
        if name in measured.sigma:
            columns.append((f"{name}_sigma", measured.units[name], measured.sigma[name]))
    header = ",".join(f"{name} [{DISPLAY.get(unit, unit) or '-'}]" for name, unit, _ in columns)
    texts = [[_cell(value, unit) for value in values] for _, unit, values in columns]
    notes = [f"# {line}" for line in measured.provenance]
    lines = [*notes, header, *(",".join(row) for row in zip(*texts, strict=True))]
    write_atomically(Path(path), "\n".join(lines) + "\n")


def _cell(value: float, unit: str) -> str:
    """Shortest decimal that reads back to the same double; empty for a gap."""
    if value == 0.0:
        return "0"
    return "" if np.isnan(value) else str(in_unit(value, DISPLAY.get(unit, unit)))


def write_histories(path: str | Path, histories: Histories) -> None:
    """`histories.csv`: time_s, then a column per sensor with its SI unit in the name; same curves, same bytes."""
    names = [f"{name}_{histories.units[name]}".rstrip("_") for name in histories.channels]
    rows = np.column_stack([histories.time, *histories.channels.values()])
    lines = [",".join(["time_s", *names]), *(",".join(FORMAT % (value + 0.0) for value in row) for row in rows)]
    write_atomically(Path(path), "\n".join(lines) + "\n")


def read_histories(path: str | Path) -> Histories:
    """Time, channels and units of a `histories.csv`; its energies stand in `summary.json`.

    Raises ValueError for a file without rows, or whose rows are no numbers.
    """
    first, _, rows = Path(path).read_text(encoding="utf-8").partition("\n")
    if not rows.strip():
        raise ValueError("the file has no rows")
    header = first.split(",")
    values = np.loadtxt(StringIO(rows), delimiter=",", ndmin=2, dtype=np.float64)
    named = [split_unit(column) for column in header[1:]]
    channels = {name: values[:, i + 1] for i, (name, _) in enumerate(named)}
    return Histories(values[:, 0], channels, dict(named))


def split_unit(column: str) -> tuple[str, str]:
    """Sensor and SI unit of a column's name: "contact_force_N" -> ("contact_force", "N"); no unit: dimensionless."""
    name, _, unit = column.rpartition("_")
    return (name, unit) if name and unit in ACCEPTED else (column, "")
