"""`birdstrike new`: a commented case to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from birdstrike.cli.frame import framed, say
from birdstrike.cli.next_steps import following
from birdstrike.cli.options import Json
from birdstrike.data.arguments import as_path
from birdstrike.data.errors import UserError
from birdstrike.data.paths import TEMPLATES


def new(name: str | Path) -> Path:
    """Write a commented case called `name` (.toml is added) and return its path; raises UserError over an old file."""
    from birdstrike.data.storage.files import write_atomically

    path = as_path("name", name)
    if not path.name.strip("."):
        raise UserError(f'"{name}" is no name for a case; write one such as my_shot')
    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    if path.exists():
        raise UserError(f"{path} exists and is left as it is; choose another name, or move it away")
    text = (TEMPLATES / "case.toml").read_text(encoding="utf-8")
    write_atomically(path, text.replace("NAME", path.stem))
    return path


@framed
def command(
    name: Annotated[str, typer.Argument(help="Name of the case; NAME.toml is written here.")],
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write a case to start from: every key that one usually changes, with its unit and what it means.

    Example: birdstrike new my_shot
    """
    path = new(name)
    say(f"Written to {path}; put your shot's values in. {following('check', path)}")
    return {"out": str(path)}
