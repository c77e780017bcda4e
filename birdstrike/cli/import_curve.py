"""`birdstrike import`: other people's curve files into measured-data CSV."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import framed, say
from birdstrike.cli.next_steps import case_here, following
from birdstrike.cli.options import Json, refuse_other_picture
from birdstrike.data.arguments import as_path
from birdstrike.data.errors import MeasuredError, UnitError, UserError

if TYPE_CHECKING:
    from birdstrike.data.curves import Measured

READ_SO = (
    "read as gaps",
    "times of day",
    "behind the table",
    "repeat the head",
    "columns of text",
    "complex numbers",
    "rows are the channels",
    "The clock was made",
    "is not UTF-8",
)
"""Signs of the provenance's lines on what was read in a way of its own."""


FAR_S, FAR = 1.0, 10.0
"""[s], and lengths of a record: farther off 0, its clock does not count from the trigger."""


def import_curve(
    path: str | Path,
    out: str | Path,
    sensors: Mapping[str, str],
    *,
    time: str = "",
    units: Mapping[str, str] | None = None,
    scales: Mapping[str, float | str] | None = None,
    shift: str = "",
    node: int | None = None,
    simulated: bool = False,
    per: Mapping[str, str] | None = None,
    decimal: str = "",
    table: str = "",
    zero: bool = False,
    sigma: Mapping[str, str] | None = None,
    picture: str | Path | None = None,
    rate: str = "",
    encoding: str = "",
    beside: str | Path | Measured | None = None,
) -> Measured:
    """Write a file of another program as a measured-data CSV, and return the record.

    sensors: name in the case -> column ("" to find it); scales: sensor -> factor, or text as --scale takes it, such as
    "2.5 mm/V"; zero: the mean before the response is subtracted; sigma: sensor
    -> its noise with a unit, or "record" for the record's own; picture: a PNG, PDF or SVG of the record and how it is
    read; rate: of the samples, where the file has no clock, such as "200 kHz"; encoding: of a text that is not
    UTF-8, "" to find it; beside: a record of the same shot, whose channels are taken along; the others as in
    data.import_curve. Raises UserError.
    """
    from birdstrike.data.curves import as_measured, on_one_clock, write_measured
    from birdstrike.data.import_curve import ImportOptions, import_record
    from birdstrike.inversion.observations.raw import with_sigma, zeroed

    if as_path("out", out).exists() and as_path("path", path).exists() and Path(out).samefile(path):
        raise UserError(f"--out {out} is the file that is imported, and would be lost; choose another name")
    refuse_other_picture(picture)
    factors, given, taken = factors_of(scales or {})
    options = ImportOptions(
        sensors=sensors,
        time=time,
        units=given | _units_beside(units or {}, given, taken),
        scales=factors,
        shift=shift,
        node=node,
        simulated=simulated,
        decimal=decimal,
        table=table,
        per=taken | dict(per or {}),
        rate=rate,
        stated=tuple(sigma or ()),
        encoding=encoding,
    )
    record = import_record(path, options)
    if zero:
        record, _ = zeroed(record)
    if sigma:
        record = with_sigma(record, {name: _stated(name, text, record.units[name]) for name, text in sigma.items()})
    if beside is not None:
        others = as_measured(beside)
        record = replace(on_one_clock([others, record]), path=others.path)
    write_measured(out, record)
    if picture is not None:
        from birdstrike.inversion.observations.raw import read_raw
        from birdstrike.reports.figures.record import draw_record

        draw_record(record, read_raw(record), Path(picture))
    return record


def _stated(name: str, text: str, unit: str) -> float | None:
    """Noise of a sensor as stated, SI; None for the record's own. Raises UnitError."""
    from birdstrike.data.units import to_si

    try:
        return None if text == "record" else to_si(text, unit)
    except UnitError as error:
        raise UnitError(f"--sigma {name}={text}: {error}") from error


@framed
def command(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Text, CSV, TDMS, .mat, .xlsx, UFF58; nodout, rcforc, binout, T01.")
    ],
    sensor: Annotated[
        list[str], typer.Option(metavar="NAME[=COLUMN]", help="Sensor of the case, and its column; repeatable.")
    ],
    out: Annotated[Path, typer.Option(help="The measured-data CSV.", dir_okay=False)],
    unit: Annotated[
        list[str], typer.Option(metavar="[NAME=]UNIT", help="Unit of a column whose head gives none; repeatable.")
    ] = [],  # noqa: B006 (typer copies it)
    time: Annotated[str, typer.Option(metavar="COLUMN", help="The clock's column; by default the first.")] = "",
    time_unit: Annotated[str, typer.Option(metavar="UNIT", help="Its unit, where its head gives none.")] = "",
    node: Annotated[int | None, typer.Option(help="The node, of a nodout with several.")] = None,
    scale: Annotated[
        list[str],
        typer.Option(
            metavar="[NAME=]FACTOR",
            help='-1 for a curve that points the other way, "2.5 mm/V" for a voltage; repeatable.',
        ),
    ] = [],  # noqa: B006
    rate: Annotated[
        str, typer.Option(metavar="RATE", help='Of a file without a clock: "200 kHz", or the time between two samples.')
    ] = "",
    shift: Annotated[str, typer.Option(metavar="TIME", help='Added to the clock, such as "-0.2 ms".')] = "",
    simulated: Annotated[bool, typer.Option("--simulated", help="No instrument took this curve.")] = False,
    zero: Annotated[bool, typer.Option("--zero", help="Subtract what a sensor reads before the response.")] = False,
    sigma: Annotated[
        list[str],
        typer.Option(metavar="[NAME=]NOISE", help='1 sigma, such as "0.05 mm", or record for its own; repeatable.'),
    ] = [],  # noqa: B006
    decimal: Annotated[
        str, typer.Option(metavar=", or .", help="Mark of decimals, where the file leaves it open.")
    ] = "",
    encoding: Annotated[
        str, typer.Option(metavar="NAME", help="Of a text that is not UTF-8, such as gb18030 or shift_jis.")
    ] = "",
    table: Annotated[
        str, typer.Option(metavar="NAME", help="Group, sheet, struct or branch of a file with several.")
    ] = "",
    beside: Annotated[
        str | None,
        typer.Option(metavar="CSV", help="Imported record of the same shot: its channels are taken along."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="PNG, PDF or SVG: the record, what is cut, its zero and noise.")
    ] = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Convert a curve file of another program into measured-data CSV, with its provenance; errors name their line.

    Example: birdstrike import shot.txt --sensor displacement_centre --unit mm --time-unit ms --out shot.csv
    """
    columns = _columns(sensor)
    units = _of_sensors("--unit", unit, columns) | ({"time": time_unit} if time_unit else {})
    record = import_curve(
        file,
        out,
        columns,
        time=time,
        units=units,
        scales=_of_sensors("--scale", scale, columns),
        shift=shift,
        node=node,
        simulated=simulated,
        decimal=decimal,
        table=table,
        zero=zero,
        sigma=_of_sensors("--sigma", sigma, columns),
        picture=picture,
        rate=rate,
        encoding=encoding,
        beside=beside,
    )
    for name in record.channels:
        say(_seen(record, name))
    for line in _remarks(record):
        say(line)
    if not record.simulated:
        say("Taken as measured; a simulated curve wants --simulated.")
    case = case_here(record.channels) or "CASE"
    say(f"Written to {out}. {following('close-the-loop', case, '--measured', out, '--out', 'loop')}")
    return {"out": str(out), "points": len(record.time), "channels": list(record.channels)}


def _remarks(record: Measured) -> Iterator[str]:
    """What was read in a way of its own, and what is odd in the record, before any simulation is paid for."""
    from birdstrike.data.formatting import reading
    from birdstrike.inversion.observations.raw import read_raw

    yield from (line for line in record.provenance if any(sign in line for sign in READ_SO))
    yield from (line for line in record.provenance if line.endswith("was subtracted."))
    yield from _strains_beyond(record)
    yield from _far_clock(record)
    try:
        channels = read_raw(record)
    except MeasuredError as error:
        yield from (f"look at the record: {text}" for text in error.errors)
        return
    for channel in channels:
        if channel.noise.known:
            yield f"{channel.name}: noise {reading(channel.noise.level, channel.unit, 2)} ({channel.noise.source})"
        yield from (f"look at {text}" for text in channel.warnings)


def _far_clock(record: Measured) -> Iterator[str]:
    """Of a clock that counts from long before the record, as one of the date or of a logger that runs all day."""
    from birdstrike.data.formatting import fewest_decimals

    first, last = float(record.time[0]), float(record.time[-1])
    if abs(first) > FAR_S + FAR * (last - first):
        yield (
            f"look at the clock: it begins at {fewest_decimals(first)} s, {1e3 * (last - first):.3g} ms before the "
            f'record ends; count it from the trigger, or from its first row: --shift "{fewest_decimals(-first)} s"'
        )


def _strains_beyond(record: Measured) -> Iterator[str]:
    """Of strains those that no gauge survives: microstrain under a head that gives no unit, or another one."""
    from birdstrike.data.histories import largest
    from birdstrike.data.import_curve import strain_beyond

    for name, values in record.channels.items():
        if not record.units[name] and (beyond := strain_beyond(abs(float(largest(values))))):
            yield (
                f"look at {name}: {beyond}; correct the unit in its head, or, where that gives none, import "
                f"microstrain with --scale {name}=1e-6, per cent with --scale {name}=0.01"
            )


def _columns(texts: Iterable[str]) -> dict[str, str]:
    """Sensor -> column of the --sensor options, "" where it is to be found; raises UserError."""
    found: dict[str, str] = {}
    for text in texts:
        name, sign, column = (part.strip() for part in text.partition("="))
        if not name or (sign and not column):
            raise UserError(f'--sensor {text} lacks a name or a column; write --sensor NAME, or --sensor NAME="COLUMN"')
        if name in found:
            raise UserError(f"--sensor {name} is given twice; every column needs a sensor's name of its own")
        found[name] = column
    return found


def _of_sensors(option: str, texts: Iterable[str], sensors: Mapping[str, str]) -> dict[str, str]:
    """Sensor -> value of [NAME=]VALUE options; without a name it is every sensor's."""
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.rpartition("=")
        if sign and name.strip() not in sensors:
            raise UserError(f"{option} {text}: {name.strip()} is no --sensor; named: {', '.join(sensors)}")
        found |= {name.strip(): value.strip()} if sign else dict.fromkeys(sensors, value.strip())
    return found


def _units_beside(stated: Mapping[str, str], given: Mapping[str, str], taken: Mapping[str, str]) -> dict[str, str]:
    """Of the units of columns those whose factor has none; raises UserError for another unit than the factor takes."""
    for name in stated.keys() & taken.keys():
        if stated[name] != taken[name]:
            raise UserError(
                f"--unit {name}={stated[name]}: its --scale takes a column in {taken[name]} and gives "
                f"{given[name]}; leave --unit out, or write the factor without a unit"
            )
    return {name: unit for name, unit in stated.items() if name not in taken}


def factors_of(given: Mapping[str, float | str]) -> tuple[dict[str, float], dict[str, str], dict[str, str]]:
    """Sensor -> its factor, the unit that this gives, and the one that it takes, where it has units."""
    found = {name: factor_of(str(one)) for name, one in given.items()}
    units = {name: given for name, (_, given, _) in found.items() if given}
    per = {name: taken for name, (_, _, taken) in found.items() if taken}
    return {name: number for name, (number, _, _) in found.items()}, units, per


def factor_of(text: str) -> tuple[float, str, str]:
    """A factor, and where it has a unit such as mm/V the unit it gives and the one it takes; raises UserError."""
    from birdstrike.data.units import decimal_comma

    match = re.fullmatch(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*(?:(\S.*?)\s*/\s*(?:\(([^()]+)\)|([^/]+?)))?\s*", text)
    try:
        number = float(match[1]) if match else float("nan")
    except ValueError:
        number = float("nan")
    if comma := decimal_comma(text):
        raise UserError(f"--scale {text} {comma}")
    if match is None or not math.isfinite(number):
        raise UserError(f'--scale {text} is not a number; write -1 to turn a curve round, or "2.5 mm/V"')
    if number == 0.0:
        raise UserError(f"--scale {text} leaves nothing of the curve; give the factor by which it is multiplied")
    return number, match[2] or "", match[3] or match[4] or ""


def _seen(record: Measured, name: str) -> str:
    """A curve in one line, so that a wrong unit or sign is seen at once."""
    from birdstrike.data.formatting import instant, reading, span
    from birdstrike.data.histories import farthest

    time, values = record.points(name)
    i = int(farthest(values))
    peak = reading(float(values[i]), record.units[name], 4)
    shown = span(float(time[0]), float(time[-1]), "s", 4)
    when = instant(float(time[i]), float(time[-1] - time[0]))
    return f"{name}: {len(time)} points, {shown}, largest {peak} at {when}"
