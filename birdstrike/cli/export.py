"""`birdstrike export`: a bird, the effects that a model lacks, or a whole case, as cards of another solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import console, framed, say
from birdstrike.cli.next_steps import following, set_again
from birdstrike.cli.options import Json, Settings, overrides
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.data.unit_systems import SYSTEMS, unit_system

if TYPE_CHECKING:
    from birdstrike.reports.export.deck import WrittenDeck
    from birdstrike.solver.case.case import CaseSource


class Target(StrEnum):
    """The solver whose cards are written."""

    lsdyna = "lsdyna"
    radioss = "radioss"


class AnswerOf(StrEnum):
    """Whose answer is exported."""

    best = "best"
    network = "network"
    emulator = "emulator"


DEFAULT_UNITS = next(iter(SYSTEMS))
DECKS = (".k", ".key", ".rad", ".inc")
"""Endings of decks, which alone are written over."""
ENDING = {Target.lsdyna: ".k", Target.radioss: ".rad"}
DECK_ENDING = {Target.lsdyna: ".k", Target.radioss: "_0000.rad"}


def export(
    source: CaseSource,
    out: str | Path,
    *,
    to: str = "lsdyna",
    units: str = DEFAULT_UNITS,
    case: str | Path | None = None,
    method: str = "best",
    deck: bool = False,
    settings: Mapping[str, Any] | None = None,
    model: str = "",
) -> Path:
    """Write the cards of a case's bird or of an inverted one, or a case's whole deck; the file's path.

    source: a case, or the folder of train-and-invert, diagnose, calibrate-models or close-the-loop; to: lsdyna or
    radioss; units: a name of data.unit_systems; deck: everything that runs, from a case; settings: dotted keys laid
    over a case; model: which one of calibrate-models, the first of its ranking where none is named. Raises UserError,
    also where ansys-dyna-core (the extra `lsdyna`) is not installed and the cards of a bird for LS-DYNA want it.
    """
    _known(to)
    asked = _Asked(source, Path(out), to, units, case=case, method=method, settings=settings, model=model)
    if deck:
        return _write_deck(asked).files[0]
    _write_cards(asked)
    return asked.out


@dataclass(frozen=True)
class _Asked:
    """What is exported, and how: see `export`."""

    source: CaseSource
    out: Path
    to: str
    units: str
    case: str | Path | None
    method: str
    settings: Mapping[str, Any] | None
    model: str

    @property
    def folder(self) -> Path | None:
        """The folder of results that is exported; None for a case."""
        return Path(self.source) if isinstance(self.source, str | Path) and Path(self.source).is_dir() else None


def _known(to: str) -> None:
    if to not in list(Target):
        raise UserError(f'--to "{to}" is not on offer; available: {", ".join(Target)}')


def _refuse_results(out: Path) -> None:
    """Raise UserError where cards would replace a file of results or a record."""
    if out.is_file() and out.suffix.lower() not in DECKS:
        raise UserError(
            f"--out {out} exists, and its name is not that of a deck; cards do not go into it: give a name that ends "
            f"in {', '.join(DECKS)}"
        )


def _write_deck(asked: _Asked) -> WrittenDeck:
    from birdstrike.reports.export.deck import write_deck
    from birdstrike.reports.export.exported import refuse_choices
    from birdstrike.solver.case.case import as_case

    _refuse_results(asked.out)
    system = unit_system(asked.units)
    if asked.folder is not None:
        raise UserError(
            f"--deck writes the deck of a case, and {asked.source} is a folder; give a case file, such as the one that "
            "a diagnosis leaves with its effect (case_after in diagnosis.json), or the inversion's case.toml"
        )
    refuse_choices(asked.case, asked.method, asked.model)
    return write_deck(as_case(asked.source, asked.settings), asked.out, asked.to, system)


def _write_cards(asked: _Asked) -> int:
    """Writes the birds' cards and those of the effects in a folder; how many effects."""
    from birdstrike.data.storage.files import write_atomically
    from birdstrike.reports.export.effects import effect_lines, read_effects
    from birdstrike.reports.export.exported import read_export
    from birdstrike.reports.export.lsdyna import write_lsdyna
    from birdstrike.reports.export.radioss import bird_file

    _refuse_results(asked.out)
    system, folder = unit_system(asked.units), asked.folder
    if folder is not None and asked.settings:
        raise UserError(f"--set changes a case, and {asked.source} is a folder; leave it out, or give a case")
    birds = read_export(asked.source, asked.case, asked.method, asked.settings, asked.model)
    effects = None if folder is None else read_effects(folder, asked.case)
    lines = [] if effects is None else effect_lines(effects, system, asked.to)
    if asked.to == Target.lsdyna:
        write_lsdyna(asked.out, birds, system, lines)
    else:
        write_atomically(asked.out, bird_file(birds, system, lines))
    return 0 if effects is None else len(effects.effects)


def _default_path(folder: Path, model: str, ending: str) -> Path:
    """Where the cards go: into a folder of results, or beside the user for a case."""
    from birdstrike.reports.export.exported import chosen_model

    if (chosen := chosen_model(folder, model)) is not None:
        return chosen[0] / f"bird_{chosen[1]}{ending}"
    return folder / f"bird{ending}" if folder.is_dir() else Path(f"{folder.stem}{ending}")


@framed
def command(
    source: Annotated[
        str,
        typer.Argument(
            metavar="DIR|CASE",
            help="Folder of train-and-invert, diagnose, calibrate-models or close-the-loop; or a case.",
        ),
    ],
    to: Annotated[Target, typer.Option(help="The solver whose cards are written.")] = Target.lsdyna,
    deck: Annotated[bool, typer.Option("--deck", help="The whole case, as a deck that runs.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The file; by default bird.k or .rad in DIR (bird_NAME.k of a model), CASE.k or CASE_0000.rad here.",
            dir_okay=False,
        ),
    ] = None,
    units: Annotated[
        str, typer.Option(help=f"Unit system: {', '.join(SYSTEMS)}.", autocompletion=lambda: list(SYSTEMS))
    ] = DEFAULT_UNITS,
    method: Annotated[AnswerOf, typer.Option(help="Whose answer: best is the one verified best.")] = AnswerOf.best,
    model: Annotated[
        str, typer.Option(metavar="NAME", help="Of calibrate-models: which bird model; by default the best.")
    ] = "",
    case: Annotated[str | None, typer.Option(help="The inversion's case, where DIR does not hold it.")] = None,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write cards of another solver: the inverted bird and the effects that its model lacks, or a whole case (--deck).

    Example: birdstrike export loop --to lsdyna --units mm-ms-kg-GPa

    Of calibrate-models: birdstrike export models --model murnaghan --to radioss

    A whole case: birdstrike export reference_strike --deck --to radioss --out strike_0000.rad
    """
    folder = Path(source)
    if out is None:
        out = Path(f"{folder.stem}{DECK_ENDING[to]}") if deck else _default_path(folder, model, ENDING[to])
    asked = _Asked(
        source, out, to.value, units, case=case, method=method.value, settings=overrides(settings), model=model
    )
    return _deck(asked, [source, *set_again(settings)]) if deck else _cards(asked)


def _deck(asked: _Asked, case: Sequence[str]) -> dict[str, Any]:
    """Write a case's deck and say what is in it; case: the words by which a command names it."""
    with console.status("writing the deck"):
        written = _write_deck(asked)
    for line in written.missing:
        say(line)
    files = [str(file) for file in written.files]
    say(f"Written, units {asked.units}: {', '.join(files)}; which of its outputs are the sensors: {written.sensors}.")
    say(f"{written.nodes} nodes, {written.elements} elements, bird included. Run it; then:")
    say(following("compare", *case, "--histories", "RESULT", "--deck", written.sensors))
    counts = {"nodes": written.nodes, "elements": written.elements}
    return {"out": files[0], "files": files, "units": asked.units, "sensors": str(written.sensors), **counts}


def _cards(asked: _Asked) -> dict[str, Any]:
    """Write the cards and say what to do with them."""
    with console.status("writing cards"):
        effects = _write_cards(asked)
    include = "*INCLUDE" if asked.to == Target.lsdyna else "#include"
    more = f", with the cards of {many(effects, 'effect')}" if effects else ""
    head = f"Written to {asked.out}, units {asked.units}{more}."
    say(f"{head} Next: {include} it in your model, and read the comments above each card.")
    return {"out": str(asked.out), "units": asked.units, "effects": effects}
