"""`birdstrike import`: other people's curve files into measured-data CSV."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import Json, framed, say
from birdstrike.data.errors import UserError

if TYPE_CHECKING:
    from birdstrike.data.curves import Measured


def import_curve(
    path: str | Path,
    out: str | Path,
    sensors: Mapping[str, str],
    *,
    time: str = "",
    units: Mapping[str, str] | None = None,
    scales: Mapping[str, float] | None = None,
    shift: str = "",
    node: int | None = None,
    simulated: bool = False,
) -> Measured:
    """Write a nodout, a two-column text or a CSV with other headers as a measured-data CSV, and return the record.

    sensors: name in the case -> column ("" to find it); the others as in data.import_curve. Raises UserError.
    """
    from birdstrike.data.curves import write_measured
    from birdstrike.data.import_curve import ImportOptions, import_record

    if Path(out).exists() and Path(path).exists() and Path(out).samefile(path):
        raise UserError(f"--out {out} is the file that is imported, and would be lost; choose another name")
    options = ImportOptions(sensors, time, units or {}, scales or {}, shift, node, simulated)
    record = import_record(path, options)
    write_measured(out, record)
    return record


@framed
def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="nodout, two columns of text, or CSV.")],
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
        list[str], typer.Option(metavar="[NAME=]FACTOR", help="-1 for a curve that points the other way; repeatable.")
    ] = [],  # noqa: B006
    shift: Annotated[str, typer.Option(metavar="TIME", help='Added to the clock, such as "-0.2 ms".')] = "",
    simulated: Annotated[bool, typer.Option("--simulated", help="No instrument took this curve.")] = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Convert a curve file of another program into measured-data CSV, with its provenance; errors name their line.

    Example: birdstrike import shot.txt --sensor displacement_centre --unit mm --time-unit ms --out shot.csv
    """
    columns = dict(_pair(text) for text in sensor)
    units = _of_sensors("--unit", unit, columns) | ({"time": time_unit} if time_unit else {})
    scales = {name: _factor(text) for name, text in _of_sensors("--scale", scale, columns).items()}
    record = import_curve(
        file, out, columns, time=time, units=units, scales=scales, shift=shift, node=node, simulated=simulated
    )
    for name in record.channels:
        say(_seen(record, name))
    if not record.simulated:
        say("Taken as measured; a simulated curve wants --simulated.")
    say(f"Written to {out}. Next: birdstrike close-the-loop CASE --measured {out} --out loop")
    return {"out": str(out), "points": len(record.time), "channels": list(record.channels)}


def _pair(text: str) -> tuple[str, str]:
    name, _, column = text.partition("=")
    return name.strip(), column.strip()


def _of_sensors(option: str, texts: Iterable[str], sensors: Mapping[str, str]) -> dict[str, str]:
    """Sensor -> value of [NAME=]VALUE options; without a name it is every sensor's."""
    found: dict[str, str] = {}
    for text in texts:
        name, sign, value = text.rpartition("=")
        if sign and name.strip() not in sensors:
            raise UserError(f"{option} {text}: {name.strip()} is no --sensor; named: {', '.join(sensors)}")
        found |= {name.strip(): value.strip()} if sign else dict.fromkeys(sensors, value.strip())
    return found


def _factor(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError(f"--scale {text} is not a number; write --scale -1 to turn a curve round") from None


def _seen(record: Measured, name: str) -> str:
    """A curve in one line, so that a wrong unit or sign is seen at once."""
    from birdstrike.data.units import display

    time, values = record.points(name)
    i = int(abs(values).argmax())
    peak, unit = display(float(values[i]), record.units[name])
    shown = " .. ".join(f"{display(float(t), 's')[0]:.4g}" for t in (time[0], time[-1]))
    return f"{name}: {len(time)} points, {shown} ms, largest {peak:.4g} {unit} at {1e3 * time[i]:.4g} ms"
