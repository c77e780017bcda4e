"""Options that several commands have, and what their texts mean."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from birdstrike.data.errors import UserError

Json = Annotated[bool, typer.Option("--json", help="End with one machine-readable JSON line.")]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Run again what is on record as failed; each failed run once.")
]
Channels = Annotated[
    str,
    typer.Option(
        "--channels", metavar="NAME,...", help="Channels that are used, of each record those it has; all by default."
    ),
]
ShotRecords = Annotated[
    list[str],
    typer.Option("--measured", help="Measured-data CSV, or the name of a shipped curve; again for each further shot."),
]
ShotCases = Annotated[
    list[str], typer.Option("--case", help="Case of each further --measured, in order; none: all are of CASE.")
]
Workers = Annotated[int | None, typer.Option(help="Simulations at a time; all cores by default.")]
Settings = Annotated[
    list[str], typer.Option("--set", metavar="KEY=VALUE", help='Override the case: --set plate.thickness="8 mm".')
]
CaseName = Annotated[str, typer.Argument(help="A case file, or the name of a shipped case.")]
Baselines = Annotated[
    list[str], typer.Option(help="Record of the same rig in which nothing is suspected; may be given again.")
]
BaselineCases = Annotated[list[str], typer.Option(help="Case of each --baseline, in order; none: all are of CASE.")]


class Bird(StrEnum):
    """What is known of a baseline's bird beside the shot's."""

    auto = "auto"
    same = "same"
    recipe = "recipe"
    other = "other"


BaselineBird = Annotated[
    Bird | None,
    typer.Option(
        help="Birds of shots and baselines. same: of one batch, cast and shot alike; recipe: cast by one recipe; "
        "other: unlike; auto (default): not known, the records decide."
    ),
]


def names_of(text: str, option: str = "--channels", example: str = "displacement_centre") -> tuple[str, ...]:
    """The names in a list with commas; raises UserError for a list without any, with the option and an example."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if text and not names:
        raise UserError(f'{option} "{text}" names nothing; give names with commas between, such as {example}')
    return names


def overrides(settings: Iterable[str]) -> dict[str, str]:
    """Dotted keys and texts of `--set key=value` options; raises UserError."""
    pairs = [setting.partition("=") for setting in settings]
    if unread := [missing_sign(key) for key, sign, _ in pairs if not sign]:
        raise UserError(unread)
    return {key.strip(): value.strip() for key, _, value in pairs}


def missing_sign(setting: str) -> str:
    """What is wrong with a --set that has no sign."""
    return f'--set {setting}: write --set key=value, such as --set plate.thickness="8 mm"'


PICTURES = (".png", ".svg", ".pdf")
"""Endings of `--picture`."""


def refuse_other_picture(path: str | Path | None) -> None:
    """Raise UserError for a picture whose ending names no format that can be written."""
    if path is not None and Path(path).suffix.lower() not in PICTURES:
        raise UserError(f"--picture {path}: a picture ends in {', '.join(PICTURES)}, which tells its format")


def refinement_runs(text: str) -> int | str:
    """Runs that may be added; "auto" as it is. Raises UserError."""
    from birdstrike.inversion.estimation.refinement import refuse_budget

    runs = int(text) if text.isdecimal() else text
    refuse_budget(runs)
    return runs
