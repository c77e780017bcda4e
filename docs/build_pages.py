"""What a page gets before Sphinx reads it: files' names above their blocks, and tables that the code itself holds."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click
import typer
from sphinx.application import Sphinx

from birdstrike.cli.app import app
from birdstrike.data.unit_systems import SYSTEMS

EXAMPLE = re.compile(r"^(.+): (birdstrike .+)$", re.MULTILINE)
"""A line of a command's help: what the command line is good for, and the command line."""
TITLED = re.compile(r'^```([a-z]+) title="([^"]+)"\n', re.MULTILINE)


def fill(application: object, page: str, source: list[str]) -> None:  # noqa: ARG001 (Sphinx calls it so)
    """Names of files, and the tables at their places: commands, unit systems."""
    source[0] = TITLED.sub(r"```{code-block} \1\n:caption: \2\n\n", source[0])
    for place, lines in PLACES.items():
        if place in source[0]:
            source[0] = source[0].replace(place, "\n".join(lines()))


def commands() -> Iterator[str]:
    """A section a command: what it does, its examples, its arguments and options."""
    group = typer.main.get_command(app)
    for name, command in group.commands.items():  # pyright: ignore[reportAttributeAccessIssue] (a click group)
        text = command.help or ""
        what, examples = EXAMPLE.sub("", text), [found.groups() for found in EXAMPLE.finditer(text)]
        yield f"## birdstrike {name}\n\n{' '.join(what.split())}\n"
        lines = (line if label == "Example" else f"\n# {label}\n{line}" for label, line in examples)
        yield "```bash\n" + "\n".join(lines) + "\n```\n"
        yield "| | |\n|---|---|"
        yield from map(_row, command.params)
        yield ""


def _row(parameter: click.Parameter) -> str:
    """Names, what it takes, and what it means."""
    option = parameter.param_type_name == "option"
    spoken = parameter.opts if option else [getattr(parameter, "metavar", None) or str(parameter.name).upper()]
    names = ", ".join(f"`{name}`" for name in spoken).replace("|", "\\|")
    meaning = (getattr(parameter, "help", None) or "").replace("*", "\\*").replace("|", "\\|")
    default = parameter.default
    given = default not in (None, "", [], (), False) and not callable(default)
    shown = f" Default: `{getattr(default, 'value', default)}`." if given else ""
    return f"| {names} | {meaning}{shown} |"


def unit_systems() -> Iterator[str]:
    """The unit systems of cards."""
    yield "| name | units |\n|---|---|"
    for name, system in SYSTEMS.items():
        yield f"| `{name}` | {system.sentence} |".replace("*", "\\*")


PLACES = {"<!-- commands -->": commands, "<!-- units -->": unit_systems}
"""Marks in a page -> what stands there."""


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
