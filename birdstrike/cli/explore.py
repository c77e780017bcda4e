"""`birdstrike explore`: one page with sliders, made of a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from birdstrike.cli.frame import framed, say
from birdstrike.cli.options import Json


@framed
def command(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder that run-doe, train-and-invert, diagnose, calibrate-models or close-the-loop has made.",
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="The page; by default DIR/explore.html.")] = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write one HTML page with sliders for the parameters and for the effects that a diagnosis looked at.

    The curves, their misfit, a map and a profile of it follow the sliders; another record can be dropped on the page.
    It needs no network, opens from disk and can be mailed: the emulator is computed in it.

    Example: birdstrike explore loop --out what_if.html
    """
    from birdstrike.reports.explore.explore import explore

    path = explore(folder, out)
    size = path.stat().st_size
    say(f"Written to {path} ({size / 1e6:.2f} MB). Next: open it in a browser.")
    return {"page": str(path), "bytes": size}
