"""`birdstrike export`: the bird's material as cards of another solver."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from birdstrike.cli.frame import Json, console, framed, say
from birdstrike.data.unit_systems import SYSTEMS, unit_system


class Target(StrEnum):
    """The solver whose cards are written."""

    lsdyna = "lsdyna"


class AnswerOf(StrEnum):
    """Whose answer is exported."""

    best = "best"
    network = "network"
    emulator = "emulator"


DEFAULT_UNITS = next(iter(SYSTEMS))


def export(
    source: str | Path,
    out: str | Path,
    *,
    to: str = "lsdyna",
    units: str = DEFAULT_UNITS,
    case: str | Path | None = None,
    method: str = "best",
) -> Path:
    """Write the cards of a case's bird or of an inverted one; the file's path.

    source: a case, or the folder of train-and-invert or close-the-loop; units: a name of data.unit_systems. Raises
    UserError, also where ansys-dyna-core (the extra `lsdyna`) is not installed.
    """
    from birdstrike.data.errors import UserError
    from birdstrike.reports.export.exported import read_export
    from birdstrike.reports.export.lsdyna import write_lsdyna

    if to not in list(Target):
        raise UserError(f'--to "{to}" is not on offer; available: {", ".join(Target)}')
    write_lsdyna(Path(out), read_export(source, case, method), unit_system(units))
    return Path(out)


@framed
def command(
    source: Annotated[
        str, typer.Argument(metavar="DIR|CASE", help="Folder of train-and-invert or close-the-loop, or a case.")
    ],
    to: Annotated[Target, typer.Option(help="The solver whose cards are written.")] = Target.lsdyna,
    out: Annotated[
        Path | None, typer.Option(help="The file; by default bird.k in DIR, or CASE.k here.", dir_okay=False)
    ] = None,
    units: Annotated[
        str, typer.Option(help=f"Unit system: {', '.join(SYSTEMS)}.", autocompletion=lambda: list(SYSTEMS))
    ] = DEFAULT_UNITS,
    method: Annotated[AnswerOf, typer.Option(help="Whose answer: best is the one verified best.")] = AnswerOf.best,
    case: Annotated[str | None, typer.Option(help="The inversion's case, where DIR does not hold it.")] = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write the bird's material as cards of another solver: the inverted bird and the three it is compared with.

    Example: birdstrike export loop --to lsdyna --units mm-ms-kg-GPa
    """
    folder = Path(source)
    path = out or (folder / "bird.k" if folder.is_dir() else Path(f"{folder.stem}.k"))
    with console.status("writing cards"):
        export(source, path, to=to.value, units=units, case=case, method=method.value)
    say(f"Written to {path}, units {units}. Next: *INCLUDE it in your model, and read the comments above each card.")
    return {"out": str(path), "units": units}
