"""`birdstrike converge`: the discretisation error of a case, by three meshes and the grid convergence index."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE
from rich.markup import escape
from rich.table import Table

from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following, set_again
from birdstrike.cli.options import CaseName, Json, RetryFailed, Settings, Workers, overrides
from birdstrike.data.arguments import as_path
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.out_folder import fills_out

if TYPE_CHECKING:
    from birdstrike.doe.attempt import Simulate
    from birdstrike.inversion.mesh_convergence.convergence import MeshConvergence
    from birdstrike.inversion.mesh_convergence.meshes import Mesh
    from birdstrike.solver.case.case import Case, CaseSource

RATIO, MESHES = 1.3, 3


@fills_out("converge")
def converge(
    case: CaseSource,
    out: str | Path,
    *,
    ratio: float = RATIO,
    meshes: int = MESHES,
    place: str = "auto",
    workers: int | None = None,
    progress: Progress = silent,
    announce: Callable[[list[Mesh]], None] = lambda _: None,
    simulate: Simulate | None = None,
    retry_failed: bool = False,
) -> MeshConvergence:
    """Simulate on systematically refined meshes; write `convergence.json`, `.csv` and `.png` into `out`.

    ratio: of the spacings of neighbouring meshes; place: of the user's mesh among them, "middle", "finest", "coarsest"
    or "auto" (see inversion.mesh_convergence.meshes); announce: takes the meshes before the first run; retry_failed:
    runs with a failure on record are tried again. Runs are kept in `out/runs`: after an error or Ctrl-C the same call
    resumes. Raises UserError, RunFailed. The workers are started afresh: a script that calls this needs
    `if __name__ == "__main__":`.
    """
    from birdstrike.data.storage.store import RunStore
    from birdstrike.doe.campaign.run import retry_before
    from birdstrike.doe.campaign.worker import worker_count
    from birdstrike.inversion.mesh_convergence.convergence import judge_meshes, run_meshes
    from birdstrike.inversion.mesh_convergence.meshes import choose_meshes
    from birdstrike.solver.case.case import as_case

    at_a_time = worker_count(workers)
    loaded = as_case(case)
    chosen = choose_meshes(loaded, ratio, meshes, place)
    announce(chosen)
    as_path("out", out).mkdir(parents=True, exist_ok=True)
    store, retry = RunStore(Path(out) / "runs"), retry_before(retry_failed)
    runs = run_meshes(chosen, store, at_a_time, progress=progress, simulate=simulate, retry=retry)
    found = judge_meshes(chosen, runs)
    _write(Path(out), loaded, ratio, found)
    return found


def _write(out: Path, case: Case, ratio: float, found: MeshConvergence) -> None:
    from birdstrike.data.curves import write_histories
    from birdstrike.data.storage.files import whole_file, withdraw, write_json
    from birdstrike.doe.solvers import solver_for
    from birdstrike.inversion.mesh_convergence.files import as_json, curves_of
    from birdstrike.reports.figures.convergence import convergence_figure
    from birdstrike.reports.figures.style import png
    from birdstrike.solver.case.case import case_hash

    origin = {
        "case": case.name,
        "case_hash": case_hash(case),
        "solver_version": solver_for(case).version,
        "ratio": ratio,
    }
    withdraw(out, "convergence.json")
    write_histories(out / "convergence.csv", curves_of(found))
    with whole_file(out / "convergence.png") as temporary:
        temporary.write_bytes(png(convergence_figure(found)))
    write_json(out / "convergence.json", origin | as_json(found))


@framed
def command(
    case: CaseName,
    out: Annotated[Path, typer.Option(help="Folder of the study; run again to resume.")],
    settings: Settings = [],  # noqa: B006 (typer copies it)
    ratio: Annotated[float, typer.Option(help="Ratio of the spacings of neighbouring meshes, 1.1 .. 2.")] = RATIO,
    meshes: Annotated[int, typer.Option(help="Number of meshes, 3 .. 6; the index takes yours and two more.")] = MESHES,
    place: Annotated[
        str,
        typer.Option(
            metavar="PLACE",
            help="Of your own mesh: middle, finest, coarsest; auto is middle where that costs at most 10 core minutes, "
            "else finest.",
        ),
    ] = "auto",
    workers: Workers = None,
    retry_failed: RetryFailed = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Estimate a case's discretisation error: observed order, extrapolated value, grid convergence index.

    Example: birdstrike converge reference_strike --out meshes --ratio 1.3
    """
    from birdstrike.doe.campaign.worker import worker_count
    from birdstrike.solver.case.case import load_case

    at_a_time = worker_count(workers)
    loaded = load_case(case, overrides(settings))
    with progress_bar("meshes") as progress:
        found = converge(
            loaded,
            out,
            ratio=ratio,
            meshes=meshes,
            place=place,
            workers=workers,
            progress=progress,
            retry_failed=retry_failed,
            announce=lambda chosen: _announce(chosen, at_a_time),
        )
    answer = _conclude(loaded.name, out, found)
    if loaded.inversion.parameters:
        say(following("run-doe", case, *set_again(settings), "--out", "campaign"))
    return answer


def _announce(meshes: list[Mesh], workers: int) -> None:
    """The meshes and what they cost, before the first run."""
    external = meshes[0].case.solver.name == "external"
    for mesh in meshes:
        yours = "  (your mesh)" if mesh.level == 0 else ""
        shells = f"{mesh.elements[0]} x {mesh.elements[1]} shells of {1e3 * mesh.plate_spacing:.2f} mm"
        cost = "" if external else f": about {mesh.cost:.1f} s"
        say(f"{mesh.particles} particles at {1e3 * mesh.bird_spacing:.2f} mm, {shells}{cost}{yours}")
    if external:
        say("How long another program takes is not known; runs already there are not repeated.")
        return
    total = sum(mesh.cost for mesh in meshes)
    longest = max(max(mesh.cost for mesh in meshes), total / min(workers, len(meshes)))
    say(
        f"Estimated time: {longest:.0f} s with {workers} at a time, once compiled; runs already there are not repeated."
    )


def _conclude(name: str, out: Path, found: MeshConvergence) -> dict[str, Any]:
    from birdstrike.data.formatting import reading
    from birdstrike.inversion.mesh_convergence.files import as_json, warnings_of

    console.print(_table(name, found))
    say("† your mesh; h the bird's particle spacing; GCI of the finest mesh and of yours")
    if any(entry.order is None for _, entry, _ in found.scalars.values()):
        say("* no monotonic convergence: the spread of the meshes stands for the index")
    warn(warnings_of(found), f"{out / 'convergence.json'}")
    for channel, curve in found.curves.items():
        band = curve.bands[found.own]
        largest = reading(float(band.max()), found.histories[found.user].units[channel])
        peak = float(abs(found.histories[found.user].channels[channel]).max())
        share = f", {float(band.max()) / peak:.1%} of its largest value" if peak else ""
        say(f"{channel}: over the whole curve within {largest}{share}")
    say(f"Written to {out}: convergence.json, convergence.csv, convergence.png (runs/ holds the simulations).")
    return {"out": str(out), **as_json(found)}


def _table(name: str, found: MeshConvergence) -> Table:
    """Scalar by scalar: on each mesh, order, extrapolated value, uncertainty of the user's mesh."""
    from birdstrike.data.units import display, of_reading, rounded

    table = Table(
        title=f"{name}: mesh convergence, finest mesh first",
        title_justify="left",
        box=SIMPLE,
        pad_edge=False,
        padding=(0, 0, 0, 1),
    )
    table.add_column("quantity", min_width=12, overflow="fold")
    for mesh in found.meshes:
        table.add_column(f"{mesh.particles}{'†' if mesh.level == 0 else ''}", justify="right", no_wrap=True)
    for heading in ("order", "to h = 0", "GCI", "GCI†"):
        table.add_column(heading, justify="right", no_wrap=True)
    for scalar, entry, values in found.scalars.values():
        factor, unit = display(1.0, of_reading(scalar.unit))
        label = f"{scalar.name.replace('_', ' ')} [{unit}]"
        numbers = [rounded(factor * value, 4) for value in values]
        exact = "-" if entry.extrapolated is None else rounded(factor * entry.extrapolated, 4)
        order = "none" if entry.order is None else f"{entry.order:.2f}"
        indices = [_percent(entry.index(mesh), entry.order is None) for mesh in (0, found.own)]
        table.add_row(escape(label), *numbers, order, exact, *indices)
    return table


def _percent(index: float | None, spread: bool) -> str:
    return "-" if index is None else f"{index:.2%}{'*' if spread and index else ''}"
