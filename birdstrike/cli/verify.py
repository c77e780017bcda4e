"""`birdstrike verify`: the verification table, as a page with figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.frame import console, errors, framed, progress_bar, say
from birdstrike.cli.options import Json
from birdstrike.data.errors import RunFailed

if TYPE_CHECKING:
    from birdstrike.reports.verification.verify import Verification


@framed
def command(
    only: Annotated[
        list[str], typer.Option(metavar="PATTERN", help="Problems by name or family, such as plate_*; repeatable.")
    ] = [],  # noqa: B006 (typer copies it)
    listed: Annotated[bool, typer.Option("--list", help="Name the problems and stop.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The page: VERIFICATION.md; with --only none unless named, and then its rows alone are renewed.",
            dir_okay=False,
        ),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes, of one thread each.")] = 2,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Check the solver against theory and other codes; run again to resume. Exits with 2 when a check fails.

    Example: birdstrike verify --only "plate_*"
    """
    from birdstrike.reports.verification.registry import chosen
    from birdstrike.reports.verification.verify import verify

    if listed:
        for problem in chosen(only):
            say(f"{problem.name}: {problem.family}")
        return {"problems": [problem.name for problem in chosen(only)]}
    page = out or (None if only else Path("VERIFICATION.md"))

    def tell(line: str) -> None:
        errors.print(line, markup=False, highlight=False)

    with progress_bar("verify") as progress:
        verification = verify(page, only=only, workers=workers, progress=progress, told=tell)
    console.print(_table(verification))
    if verification.spent:
        console.print(_costs(verification.spent))
    if page is not None:
        say(f"Written to {page}, figures beside it in docs/verification.")
    _judge(verification)
    return verification.as_json()


def _table(verification: Verification) -> Table:
    """Rows with their verdicts."""
    from birdstrike.reports.verification.page import error, quantity, tolerance

    table = Table("row", "ours", "error", "tolerance", "")
    for row in verification.rows:
        table.add_row(row.name, quantity(row.ours, row.unit), error(row), tolerance(row), row.verdict)
    return table


def _costs(spent: dict[str, float]) -> Table:
    """CPU time of what was run, the dearest first."""
    table = Table("problem", "CPU s", title=f"{sum(spent.values()) / 60.0:.1f} CPU minutes")
    for name, seconds in sorted(spent.items(), key=lambda pair: -pair[1]):
        table.add_row(name, f"{seconds:.1f}")
    return table


def _judge(verification: Verification) -> None:
    """Raise RunFailed where the verification does not stand."""
    if verification.stands:
        return
    names = "; ".join(row.name for row in verification.unexplained) or "too many with a reason"
    raise RunFailed(
        f"{len(verification.beyond)} of {len(verification.rows)} rows are beyond their tolerance: {names}",
        "read the page's section on them; a row stands only with the experiment that shows its reason, at most three",
    )
