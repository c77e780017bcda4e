"""`birdstrike evidence`: everything that backs an answer and repeats it, in one archive."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import console, framed, say, warn
from birdstrike.cli.options import Json

if TYPE_CHECKING:
    from birdstrike.reports.evidence.archive import Evidence


def evidence(
    folder: str | Path,
    out: str | Path = "evidence.zip",
    *,
    measured: Sequence[str | Path] = (),
    doe: str | Path | None = None,
    verification: str | Path | None = None,
    runs: bool = False,
) -> Evidence:
    """Write a zip with the inputs, results, versions, checks and the command that repeats an answer.

    folder: of train-and-invert or close-the-loop; measured: the records' files, where they have moved; doe: the
    campaign's folder, where it lies elsewhere; verification: the page of birdstrike verify; runs: whether the
    campaign's simulations go into it, and not only their curves. Raises UserError.
    """
    from birdstrike.reports.evidence.archive import write_evidence

    return write_evidence(
        Path(folder),
        Path(out),
        measured=measured,
        doe=None if doe is None else Path(doe),
        verification=None if verification is None else Path(verification),
        runs=runs,
    )


@framed
def command(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of train-and-invert or close-the-loop.")],
    out: Annotated[Path, typer.Option(help="The archive.", dir_okay=False)] = Path("evidence.zip"),
    measured: Annotated[
        list[str], typer.Option(metavar="CSV", help="The record, where it has moved; repeatable, in their order.")
    ] = [],  # noqa: B006 (typer copies it)
    doe: Annotated[Path | None, typer.Option(help="Folder of the campaign, where it lies elsewhere.")] = None,
    verification: Annotated[Path | None, typer.Option(help="Page of birdstrike verify; by default here.")] = None,
    runs: Annotated[
        bool, typer.Option("--runs", help="The campaign's simulations too, not only their curves.")
    ] = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Write everything that backs an answer: inputs with digests, seeds, versions, checks, and what repeats it.

    Example: birdstrike evidence loop --out evidence.zip
    """
    with console.status("collecting"):
        found = evidence(folder, out, measured=measured, doe=doe, verification=verification, runs=runs)
    warn([*found.open_points, *(f"not verified: {line}" for line in found.missing)], "SUMMARY.md")
    say(
        f"Written to {found.path}: {found.files} files, SUMMARY.md first. To repeat the calibration, unpacked anywhere:"
    )
    say(f"    {found.repeat}")
    return {
        "out": str(found.path),
        "files": found.files,
        "missing": list(found.missing),
        "open_points": list(found.open_points),
        "repeat": found.repeat,
    }
