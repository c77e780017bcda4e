"""`birdstrike check`: every error of a case at once, or what follows from it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.frame import HEARD, console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following, set_again
from birdstrike.cli.options import Json, Settings, overrides, refuse_other_picture
from birdstrike.data.errors import CaseError, UserError

if TYPE_CHECKING:
    from birdstrike.solver.case.case import Case, CaseSource

SHOWN = 5
CHECKED = "birdstrike check --json"
"""What holds all of this command's warnings."""


STATES = {"running": "not finished: running, or stopped midway"}
"""What the state in a campaign's summary means to a reader."""


def check_campaign(path: Path) -> dict[str, Any]:
    """List what the folder holds, changing nothing; raises UserError where there is no campaign."""
    from birdstrike.data.formatting import listing, many
    from birdstrike.doe.campaign.inventory import inventory

    with progress_bar("reading the runs") as progress:
        found = inventory(path, progress)
    planned = len(found.finished) + len(found.failed) + len(found.due)
    counts = f"{len(found.finished)} finished, {len(found.failed)} failed, {len(found.due)} to be run"
    state = STATES.get(found.state, found.state)
    say(f"{path}: a campaign of {many(planned, 'run')} ({state}); with solver version {found.version}: {counts}.")
    for number, reason in found.failed.items():
        say(f"run {number} failed: {reason}")
    kept, again = "kept and not used", "not used, the runs to be repeated"
    groups = [(f"{kept}: results of solver version {own}", names) for own, names in found.other_versions.items()]
    groups += [(f"{kept}: results of another case or design", found.elsewhere), (f"{again}: damaged", found.damaged)]
    for what, names in groups:
        if names:
            say(f"{what} ({many(len(names), 'file')}): {listing(names, SHOWN)}")
    warn(found.altered, CHECKED)
    return {
        "warnings": found.altered,
        "state": found.state,
        "solver_version": found.version,
        "finished": found.finished,
        "failed": {str(number): reason for number, reason in found.failed.items()},
        "due": found.due,
        "other_versions": found.other_versions,
        "elsewhere": found.elsewhere,
        "damaged": found.damaged,
    }


FACTS = {
    "mass": ("bird's mass", "kg"),
    "density": ("bird's density", "kg/m^3"),
    "normal_speed": ("speed normal to the plate", "m/s"),
    "first_contact": ("first contact at", "s"),
    "first_period": ("plate's first period", "s"),
    "stable_step": ("time step", "s"),
    "steps": ("steps", ""),
    "particles": ("particles", ""),
    "shells": ("shells", ""),
    "estimated_wall_s": ("estimated computing time", "wall"),
}
"""Derived fact -> its label and SI unit, in the order in which they are printed."""


def check(case: CaseSource) -> dict[str, Any]:
    """Derived facts of a case, SI; raises CaseError with all its errors, UserError for sensors off the target.

    mass, density, normal_speed, first_contact, first_period, stable_step, steps, particles, shells, estimated_wall_s,
    inactive (erosion limits that erode nothing at their values), case_hash, and warnings (sentences about what spoils
    the answer: a coarse mesh, a bird beside the plate, an instrument later than the run). Of a target from a file with
    doubtful shells also mesh: severity, text and number of shells of each finding.

    Of a case that an external solver simulates, whose steps and cost are not known: mass, density, normal_speed,
    solver_version, case_hash, program (path of the command, None where it cannot be run here), step_factors, effects
    (that the deck has a place for), not_carried (effect -> why not) and warnings. CaseError: its template does not fit.
    """
    from birdstrike.solver.build import rest_mesh
    from birdstrike.solver.case.case import as_case, case_hash
    from birdstrike.solver.checks import check_sensors
    from birdstrike.solver.estimate import estimate
    from birdstrike.solver.setup_warnings import setup_warnings

    loaded = as_case(case)
    if loaded.solver.name == "external":
        return _external_facts(loaded)
    check_sensors(loaded, rest_mesh(loaded))
    named = {"inactive": list(loaded.bird.material.inactive), "case_hash": case_hash(loaded)}
    found = [] if loaded.target is None else loaded.target.findings()
    mesh = [{"severity": one.severity, "text": one.text, "shells": len(one.shells)} for one in found]
    facts = {"density": loaded.bird.actual_density, **estimate(loaded), **named, "warnings": setup_warnings(loaded)}
    return {**facts, "mesh": mesh} if mesh else facts


@framed
def command(
    case: Annotated[str, typer.Argument(help="A case file, a shipped case's name, or a campaign's folder.")],
    settings: Settings = [],  # noqa: B006 (typer copies it)
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw target, supports, sensors, bird and velocity: a .png, .svg or .pdf."),
    ] = None,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """List all errors of a case at once, or print what follows from it; of a campaign's folder, what it holds.

    Example: birdstrike check reference_strike --set bird.material.viscosity="400 Pa s"

    Of a campaign, its runs, damaged files and results of other solver versions: birdstrike check campaign
    """
    refuse_other_picture(picture)
    if Path(case).is_dir():
        return check_campaign(Path(case))
    from birdstrike.solver.case.case import load_case
    from birdstrike.solver.case.effects import stated

    try:
        loaded = load_case(case, overrides(settings))
    except CaseError:
        if picture is not None:
            _draw_refused(case, settings, picture)
        raise
    for line in stated(loaded):
        say(line)
    if loaded.solver.name == "external":
        return _check_external(case, loaded, settings)
    with console.status("working out the time step"):
        facts = check(loaded)
    console.print(_table(loaded, facts))
    for line in _remarks(loaded, facts):
        say(line)
    if picture is not None:
        from birdstrike.reports.figures.target import write_picture  # late: matplotlib

        write_picture(loaded, picture)
        say(f"Picture of the set-up: {picture}")
    warn(facts["warnings"], CHECKED)
    say(f"No errors. {_simulation(case, settings)}")
    return facts


def _draw_refused(case: str, settings: list[str], picture: Path) -> None:
    """The mesh of a case that is refused, the shells marked that something is said about, where its file has any."""
    import numpy as np

    from birdstrike.reports.figures.target import write_mesh_picture  # late: matplotlib
    from birdstrike.solver.case.case import raw_case
    from birdstrike.solver.target.files.mesh_file import METRES, inspect_mesh

    target = raw_case(case, overrides(settings)).get("target")
    if not isinstance(target, dict) or not isinstance(target.get("mesh"), str):
        return
    unit = target.get("mesh_unit")
    try:
        mesh, findings = inspect_mesh(target["mesh"], unit if unit in METRES else "m", (0.0, 0.0, 0.0))
    except UserError:
        return  # said with the case's other errors
    shells = [one.shells for one in findings]
    write_mesh_picture(mesh, np.unique(np.concatenate([np.empty(0, np.int64), *shells])), picture)
    say(f"Picture of the mesh: {picture}")


def _simulation(case: str, settings: list[str]) -> str:
    """The line that names the case's simulation, under the same settings."""
    return following("simulate", case, *set_again(settings), "--out", "strike")


def _external_facts(case: Case) -> dict[str, Any]:
    """What follows from a case that another program simulates, see `check`; raises CaseError."""
    from birdstrike.doe.external.deck import unsupported_by_deck
    from birdstrike.doe.external.external import program_of, unusable_scratch
    from birdstrike.doe.solvers import solver_for
    from birdstrike.solver.case.case import case_hash
    from birdstrike.solver.effects.registry import effects_of

    solver = solver_for(case)
    unsupported = {name: one.refuses(case) or unsupported_by_deck(case, name) for name, one in effects_of(case).items()}
    assert case.external is not None
    program, missing = program_of(case.external), list[str]()
    if program is None:
        named = f'external.command: no program "{case.external.command[0]}" can be run on this machine'
        missing = [f"{named}: simulate and run-doe fail here; correct the name, give its whole path, or install it"]
    if unusable_scratch(case.external):
        named = f'external.scratch: "{case.external.scratch}" is no folder that can be written on this machine'
        missing.append(f"{named}: simulate and run-doe fail here; make it, or leave the key out")
    return {
        "mass": case.bird.actual_mass,
        "density": case.bird.actual_density,
        "normal_speed": case.normal_speed,
        "solver_version": solver.version,
        "case_hash": case_hash(case),
        "program": program,
        "step_factors": list(solver.step_factors),
        "effects": [name for name, reason in unsupported.items() if not reason],
        "not_carried": {name: reason for name, reason in unsupported.items() if reason},
        "warnings": missing,
    }


def _check_external(given: str, case: Case, settings: list[str]) -> dict[str, Any]:
    """Say what follows from a case that another program simulates; raises CaseError."""
    facts = check(case)
    names = ", ".join(parameter.name for parameter in case.parameters())
    say(f"No errors. The deck's template holds every sought parameter: {names or 'none is sought'}.")
    say(f"Effects that the deck carries: {', '.join(facts['effects'])}.")
    for name, reason in facts["not_carried"].items():
        say(f"Not {name}: {reason}.")
    if len(facts["step_factors"]) == 1:
        say("It holds no {{ step_factor }}: a run that fails gets no second attempt with half the time step.")
    if not facts["warnings"]:
        say(_simulation(given, settings))
    warn(facts["warnings"], HEARD)
    return facts


def _table(case: Case, facts: dict[str, Any]) -> Table:
    table = Table(title=case.name, show_header=False, title_justify="left")
    for key, (label, unit) in FACTS.items():
        if facts.get(key) is not None:
            table.add_row(pieces(case) if key == "particles" else label, shown(facts[key], unit))
    return table


def pieces(case: Case) -> str:
    """What the bird is made of."""
    return "elements" if case.bird.method == "hexahedra" else "particles"


def shown(value: float, unit: str) -> str:
    """A fact as engineers read it: shown(1e-3, "s") is "1 ms"."""
    from birdstrike.data.units import display

    if unit == "wall":
        return f"about {value:.1f} s on one core, once compiled"
    number, text = (1e6 * value, "us") if unit == "s" and value < 1e-4 else display(value, unit)
    return f"{number:.4g} {text}" if text else f"{number:,.0f}"


def _remarks(case: Case, facts: dict[str, Any]) -> list[str]:
    """What the user should know of a valid case."""
    remarks = [
        f"bird.material.{name} = {getattr(case.bird.material, name)} is inactive: no particle erodes by this limit"
        for name in facts["inactive"]
    ]
    remarks += [one["text"] for one in facts.get("mesh", ()) if one["severity"] == "remark"]
    if case.first_contact >= case.time.end:
        remarks.append(
            "The bird does not reach the plate before time.end: shorten impact.standoff or lengthen time.end."
        )
    return remarks
