"""`birdstrike simulate`: one simulation, its histories and its energy balance."""

from __future__ import annotations

import math
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.check import pieces
from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following, set_again
from birdstrike.cli.options import CaseName, Json, Settings, overrides
from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.data.progress import Progress, silent

if TYPE_CHECKING:
    from birdstrike.data.histories import Histories
    from birdstrike.solver.case.case import Case, CaseSource


def simulate(
    case: CaseSource,
    *,
    step_factor: float = 1.0,
    threads: int | None = None,
    progress: Progress = silent,
) -> Histories:
    """Simulate one shot of a case.

    Parameters
    ----------
    case : path, table or Case
        A case file, a shipped case's name, a table as TOML gives it, or a loaded case.
    step_factor : float
        On the stable time step, above 0; 0.5 is a safer retry.
    threads : int, optional
        Of this simulation; all cores by default. The bits do not depend on them.
    progress : callable, optional
        Takes the share of the simulated time that is done, 0..1.

    Returns
    -------
    Histories
        `time` (n,) [s] at every `time.output_interval`, `channels` {sensor: (n,) SI}, `units` {sensor: SI unit},
        `summary` (counts, balances, warnings), and `snapshots` at `time.snapshots`.

    Raises
    ------
    UserError
        For a case that is wrong or whose geometry cannot be built, and for arguments that cannot be.
    RunFailed
        For a simulation that is unstable, unbalanced or not finite, or an external solver that fails.
    """
    from birdstrike.doe.solvers import solver_for
    from birdstrike.solver.case.case import as_case

    if not isinstance(step_factor, Real) or not 0.0 < step_factor < math.inf:
        raise UserError(f"step_factor = {step_factor!r} is no number above 0: it scales the stable step; 1 is usual")
    if threads is not None:
        refuse_not_whole("threads", threads, "leave it out to use all cores", least=1)
    loaded = as_case(case)
    return solver_for(loaded).simulate(loaded, step_factor=step_factor, threads=threads, progress=progress)


@framed
def command(
    case: CaseName,
    out: Annotated[Path, typer.Option(help="Folder for histories.csv and summary.json.")],
    settings: Settings = [],  # noqa: B006 (typer copies it)
    fields: Annotated[bool, typer.Option("--fields", help="Write VTU files for ParaView at time.snapshots.")] = False,
    noise: Annotated[
        int | None, typer.Option(min=0, metavar="SEED", help="Also write record.csv, with the sensors' noise.")
    ] = None,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads; the results are the same for any number.")
    ] = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Simulate one shot: the histories of its sensors and its energy balance.

    Example: birdstrike simulate reference_strike --out strike --set impact.speed="80 m/s" --fields
    """
    from birdstrike.data.storage.out_folder import reserved
    from birdstrike.solver.case.case import load_case
    from birdstrike.solver.case.effects import stated
    from birdstrike.solver.sensors.instrument import refuse_noiseless

    loaded = load_case(case, overrides(settings))
    if fields and not loaded.time.snapshots:
        raise UserError('--fields needs instants: --set time.snapshots=\'["1 ms", "2 ms"]\'')
    if noise is not None:
        refuse_noiseless(loaded.sensors)
    for line in stated(loaded):
        say(line)
    with reserved(out, "simulate"):
        out.mkdir(parents=True, exist_ok=True)
        histories = _with_effects(_run(loaded, threads or loaded.solver.threads), loaded)
        write_simulation(out, histories, loaded if fields else None)
        if noise is not None:
            write_record(out / "record.csv", loaded, histories, noise)
    console.print(_table(loaded, histories))
    warn(_warnings(histories), f"{out / 'summary.json'}")
    more = (", record.csv" if noise is not None else "") + (", fields/" if fields else "")
    say(f"Written to {out}: histories.csv, summary.json{more}.")
    if noise is None and (out / "record.csv").exists():
        say(f"{out / 'record.csv'} is of an earlier call and stays as it was: --noise SEED writes it anew.")
    say(_next(case, loaded, settings, out / "record.csv" if noise is not None else None))
    return {"out": str(out), **histories.summary}


def _next(name: str, case: Case, settings: list[str], record: Path | None) -> str:
    """What can be done with this case now; a record is inverted as if the settings that made it were not known."""
    from birdstrike.solver.case.remarks import example_parameter

    if case.inversion.parameters:
        if record is not None:
            return following("close-the-loop", name, "--measured", record, "--out", "loop")
        return following("run-doe", name, *set_again(settings), "--out", "campaign")
    return f"To invert this case, give it parameters, e.g. {example_parameter(case)}"


def _run(case: Case, threads: int | None) -> Histories:
    import numba

    from birdstrike.doe.solvers import solver_for

    available = numba.get_num_threads()  # all there are; asking for more is an error in numba
    with progress_bar("simulation") as progress:
        return solver_for(case).simulate(case, threads=min(threads or available, available), progress=progress)


def _with_effects(histories: Histories, case: Case) -> Histories:
    """The histories whose summary holds the magnitudes [SI] of the case's effects, where it has any."""
    return replace(histories, summary={**histories.summary, "effects": case.effects}) if case.effects else histories


def write_simulation(out: Path, histories: Histories, pictured: Case | None = None) -> None:
    """`histories.csv` and `summary.json`, with the case to be pictured the VTU series, in place of an earlier run's."""
    from birdstrike.data.curves import write_histories
    from birdstrike.data.storage.files import write_json
    from birdstrike.data.vtu import write_fields
    from birdstrike.solver.build import rest_mesh

    write_histories(out / "histories.csv", histories)
    write_json(out / "summary.json", histories.summary)
    for series in ("bird", "plate"):
        for old in (*(out / "fields").glob(f"{series}_[0-9][0-9][0-9][0-9].vtu"), out / "fields" / f"{series}.pvd"):
            old.unlink(missing_ok=True)
    if pictured is not None:
        write_fields(out / "fields", histories.snapshots, rest_mesh(pictured).nodes)


def write_record(path: Path, case: Case, histories: Histories, seed: int) -> None:
    """The histories as a record: what the case's sensors would have seen, their noise included and stated."""
    import numpy as np

    from birdstrike.data.curves import Measured, write_measured
    from birdstrike.solver.case.effects import stated
    from birdstrike.solver.sensors.instrument import with_noise

    noisy = with_noise(histories, case.sensors, seed)
    sigma = {name: np.full(len(noisy.time), sensor.noise) for name, sensor in case.sensors.items() if sensor.noise}
    provenance = (
        f"SIMULATED by {_program(case)} from case {case.name}, NOT MEASURED.",
        f"White noise of the sensors' own sigma was added, seed {seed}.",
        *(f"Of the case: {line}." for line in stated(case)),
    )
    write_measured(path, Measured(noisy.time, noisy.channels, sigma, noisy.units, provenance))


def _program(case: Case) -> str:
    """Who computed the curves, and in which version: provenance must not call another program's curves ours."""
    from birdstrike.doe.solvers import simulated_by, solver_for

    program = simulated_by(case)
    external = case.solver.name == "external"
    return f"{program}, run by birdstrike," if external else f"{program} (solver {solver_for(case).version})"


def _table(case: Case, histories: Histories) -> Table:
    """Peaks of the sensors, size and balances of the run."""
    table = Table(title=case.name, show_header=False, title_justify="left")
    for name in histories.channels:
        table.add_row(f"largest {name}", _peak(histories, name))
    summary = histories.summary
    called = {"particles": pieces(case), "shells": "shells", "steps": "steps"}
    counts = [f"{summary[key]:,} {name}" for key, name in called.items() if isinstance(summary.get(key), int)]
    if counts:  # an external solver's output does not tell
        table.add_row("size", ", ".join(counts))
    for key, label in (("energy_error", "energy off by"), ("momentum_error", "momentum off by")):
        if isinstance(value := summary.get(key), float):
            table.add_row(
                label, f"{value:.2e} of the bird's {'normal kinetic energy' if key[0] == 'e' else 'momentum'}"
            )
    return table


def _peak(histories: Histories, name: str) -> str:
    """The largest reading and its time."""
    from birdstrike.data.formatting import reading

    time, value = histories.peak(name)
    return f"{reading(value, histories.units[name], 4)} at {1e3 * time:.3f} ms"


def _warnings(histories: Histories) -> list[str]:
    found = histories.summary.get("warnings", [])
    return [str(line) for line in found] if isinstance(found, list) else []
