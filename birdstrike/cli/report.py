"""`birdstrike report`: one self-contained page about the folders that exist."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import framed, progress_bar, say
from birdstrike.cli.next_steps import following, record_here
from birdstrike.cli.options import Json

if TYPE_CHECKING:
    from birdstrike.reports.results.parts import Parts


@framed
def command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="Folder of close-the-loop, run-doe, train-and-invert or diagnose."),
    ],
    doe: Annotated[Path | None, typer.Option(help="Folder of the campaign, where it lies elsewhere.")] = None,
    diagnosis: Annotated[Path | None, typer.Option(help="Folder of the diagnosis, where it lies elsewhere.")] = None,
    out: Annotated[Path | None, typer.Option(help="The page; by default DIR/report.html.")] = None,
    models: Annotated[
        bool,
        typer.Option(help="Also simulate the three standard birds, unless they are stored."),
    ] = True,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write one HTML page with figures, tables, an animation and findings; it needs no network and opens from disk.

    The page shows the parts that exist and names those that do not. An inversion's campaign is found beside it, or
    named with --doe. The runs of the bird models are made when they are not in DIR/models yet; after Ctrl-C the
    finished ones stay.

    Example: birdstrike report loop --out shot_7.html

    Of its parts: birdstrike report inversion --doe campaign

    With a diagnosis of the same case: birdstrike report inversion --doe campaign --diagnosis diagnosis
    """
    from birdstrike.reports.page.page import is_whole, write_page, write_part_page
    from birdstrike.reports.results.findings import findings
    from birdstrike.reports.results.parts import find_parts
    from birdstrike.reports.results.reading import read_results

    parts = find_parts(folder, doe, diagnosis)
    path, found = out or folder / "report.html", tuple[str, ...]()
    with progress_bar("report") as progress:
        if is_whole(parts):
            results = read_results(parts)
            write_page(results, path, progress, models=models)
            found = findings(results)
        else:
            _, found = write_part_page(parts, path, progress)
    for line in parts.missing:
        say(f"not in the report: {line}")
    for number, line in enumerate(found, 1):
        say(f"{number}. {line}")
    say(f"Written to {path}. Next: open it in a browser{_also(parts)}.")
    return {"report": str(path), "findings": list(found), "missing": list(parts.missing)}


def _also(parts: Parts) -> str:
    """What can be done besides looking at the page."""
    if parts.inversion is not None:
        source = parts.folder if parts.folder in (parts.inversion, parts.inversion.parent) else parts.inversion
        return f"; the cards: {following('export', source).removeprefix('Next: ')}"
    if parts.doe is not None:
        from birdstrike.data.errors import UserError
        from birdstrike.doe.campaign.folder import stored_case

        try:
            sensors = stored_case(parts.doe).sensors
        except UserError:
            return ""
        line = following("train-and-invert", parts.doe, "--measured", record_here(sensors), "--out", "inversion")
        return f"; then: {line.removeprefix('Next: ')}"
    return ""
