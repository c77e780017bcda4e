"""A file of LS-DYNA cards, written through ansys-dyna-core: material and equation of state of each bird."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import write_atomically
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.reports.export.cards import Card, cards_of, erodes, reworded
from birdstrike.reports.export.exported import Export, ExportedBird

EXTRA = "lsdyna"
WIDTH = 78
DIGITS = 5
"""Significant digits of a number: with more it would fill its column of ten and touch its neighbour."""


def lsdyna_deck(export: Export, system: UnitSystem, effects: Sequence[str] = ()) -> str:
    """The text of the file: a head that says units and source, then the birds' cards, numbered from 1.

    effects: lines of cards that follow them.

    Raises UserError without ansys-dyna-core, or for a law that LS-DYNA has not.
    """
    core = _dyna()
    deck = core.Deck()
    deck.comment_header = "\n".join(_wrapped(_head(export, system)))
    for number, bird in enumerate(export.birds, start=1):
        for keyword in _keywords(core, bird, number, system):
            deck.append(keyword)
    text = deck.write().rstrip()
    if effects:
        text = "\n".join([text.removesuffix("*END").rstrip(), *effects, "*END"])
    return text + "\n"


def write_lsdyna(path: Path, export: Export, system: UnitSystem, effects: Sequence[str] = ()) -> None:
    """The file, whole or not at all."""
    write_atomically(path, lsdyna_deck(export, system, effects))


def _dyna() -> Any:
    """ansys.dyna.core, read late: it costs seconds, and only this export has a use for it."""
    try:
        return import_module("ansys.dyna.core")
    except ImportError as error:
        raise UserError(
            "LS-DYNA cards are written by ansys-dyna-core, which is not installed; "
            f'install the extra: python -m pip install "birdstrike[{EXTRA}]" (from a clone: -e ".[{EXTRA}]")'
        ) from error


def _head(export: Export, system: UnitSystem) -> Iterable[str]:
    yield "Bird materials for LS-DYNA, written by birdstrike through ansys-dyna-core " + version("ansys-dyna-core")
    yield f"Units {system.name}: {system.sentence}."
    yield from export.source
    yield f"Numbers have {DIGITS} significant digits, or 4 where the column has no room for more."
    yield "Parts, sections, meshes and contact are yours; refer to these numbers from *PART."
    for number, bird in enumerate(export.birds, start=1):
        yield f"Material {number}: {bird.name.replace('_', ' ')}"


def _wrapped(lines: Iterable[str]) -> list[str]:
    """Comment lines that fit into 80 columns, continued lines indented; an empty one is not written."""
    return [part for line in lines for part in textwrap.wrap(f" {line}", WIDTH, subsequent_indent="   ")]


def _keywords(core: Any, bird: ExportedBird, number: int, system: UnitSystem) -> Iterable[Any]:
    """The material's keyword, with the remarks above its card, and its equation of state's."""
    material, *law = cards_of(bird.material, bird.density)
    otherwise = [why for _, why in reworded(bird.material).values()]
    if bird.sph and erodes(bird.material, bird.density):
        otherwise.append("a particle that erodes leaves by IEROD = 2 and ICONT = 1 of *CONTROL_SPH; by 0 it stays")
    remarks = [f"Material {number}, {bird.name.replace('_', ' ')}", *bird.remarks, *otherwise]
    yield _keyword(core, material, {"mid": number}, system, remarks)
    for card in law:
        yield _keyword(core, card, {"eosid": number}, system, [f"Equation of state of material {number}"])


def _keyword(core: Any, card: Card, number: dict[str, int], system: UnitSystem, remarks: Iterable[str]) -> Any:
    values = {name: float(f"{system.value(value, si):.{DIGITS}g}") for name, (value, si) in card.fields.items()}
    keyword = getattr(core.keywords, card.keyword)(**number, **values)
    keyword.user_comment = "\n".join(_wrapped(remarks))
    return keyword
