"""`birdstrike report`: one self-contained page about a finished folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from birdstrike.cli.frame import Json, framed, progress_bar, say


@framed
def command(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder that close-the-loop made, with doe/ and inversion/.")
    ],
    out: Annotated[Path | None, typer.Option(help="The page; by default DIR/report.html.")] = None,
    models: Annotated[
        bool,
        typer.Option(help="Also simulate the three standard birds; each run is paid once."),
    ] = True,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write one HTML page with figures, tables, an animation and findings; it needs no network and opens from disk.

    The runs of the bird models are made when they are not in DIR/models yet; after Ctrl-C the finished ones stay.

    Example: birdstrike report loop --out shot_7.html
    """
    from birdstrike.reports.page.page import write_page
    from birdstrike.reports.results.findings import findings
    from birdstrike.reports.results.reading import read_results

    results = read_results(folder)
    with progress_bar("report") as progress:
        path = write_page(results, out or folder / "report.html", progress, models=models)
    found = findings(results)
    for number, line in enumerate(found, 1):
        say(f"{number}. {line}")
    say(f"Written to {path}. Next: open it in a browser.")
    return {"report": str(path), "findings": list(found)}
