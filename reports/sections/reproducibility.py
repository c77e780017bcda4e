"""Everything needed to do it again: case, hashes, versions, seeds, machine."""

from __future__ import annotations

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from birdstrike.doe.solvers import simulated_by
from birdstrike.reports.blocks import Paragraph, Section, Table
from birdstrike.reports.results.commands import commands
from birdstrike.reports.results.results import Results
from birdstrike.solver.case.case import case_hash

LIBRARIES = ("numpy", "scipy", "numba", "torch", "scikit-learn", "h5py", "matplotlib")


def section(results: Results) -> Section:
    """Hashes and versions, then the whole case in SI."""
    facts = Table(("what", "value"), (*_made_from(results), *_made_with()), "What made these numbers.")
    external = results.case.solver.name == "external"
    needs = f"{simulated_by(results.case)}, which is not part of it" if external else "the solver's version"
    words = (
        f"The case below is complete and in SI; with it, the seeds and {needs}, the same machine gives "
        "the same curves bit for bit. The point at which each verification ran is in inversion.json. The commands name "
        "records as they were named when they were read: run them in the same folder."
    )
    return Section("reproducibility", "To do it again", (facts, Paragraph(words), _case(results)))


def _made_from(results: Results) -> tuple[tuple[str, str], ...]:
    inversion = results.inversion
    stored = {str(entry["solver_version"]) for entry in results.summaries.values() if "solver_version" in entry}
    solvers = sorted({str(results.campaign["solver_version"]), *stored})
    runs = {m: inversion.methods[m].run for m in results.finished}
    models = [f"{m.title}: {m.run.summary['run_key']}" for m in results.simulated_models.values() if m.run is not None]
    return (
        ("case", f"{results.case_name}, hash {case_hash(results.case)}"),
        ("campaign's case hash", inversion.case_hash),
        (f"solver version ({_versioned(results)})", ", ".join(solvers)),
        ("seed of the inversion", str(inversion.seed)),
        ("verification runs in the run store", ", ".join(f"{method}: {run}" for method, run in runs.items() if run)),
        *([("bird models' runs in models/runs", ", ".join(models))] if models else []),
        ("seed of the design", str(results.campaign["design"]["seed"])),
        ("record" if not results.later else "records", ", ".join(_named(results, one.path) for one in results.records)),
        ("folder", str(results.folder)),
        *((f"command of the {one.made}", one.line) for one in commands(results)),
    )


def _versioned(results: Results) -> str:
    """What a solver's version says: only that of our own is made from its sources."""
    return "as the case states it" if results.case.solver.name == "external" else "digest of its sources"


def _named(results: Results, path: str) -> str:
    """A record's path within the folder, else its bare name: the page may travel."""
    inside = Path(path).is_relative_to(results.folder)
    return str(Path(path).relative_to(results.folder)) if inside else Path(path).name


def _made_with() -> tuple[tuple[str, str], ...]:
    return (
        ("birdstrike", installed("birdstrike")),
        (
            "Python and libraries",
            f"Python {platform.python_version()}, " + ", ".join(f"{n} {installed(n)}" for n in LIBRARIES),
        ),
        ("machine that wrote this report", f"{platform.platform()}, {platform.machine()}, {os.cpu_count()} processors"),
    )


def installed(name: str) -> str:
    """Version of an installed distribution, or `not installed` (a source tree on the path has none)."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _case(results: Results) -> Table:
    """The canonical case, one row a key."""
    rows = tuple(_flat(results.case.canonical()))
    return Table(("case key", "value in SI"), rows, "The case: all that changes a history.")


def _flat(tree: dict[str, object], before: str = "") -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for key, value in tree.items():
        if isinstance(value, dict):
            rows += _flat(value, f"{before}{key}.")
        else:
            rows.append((before + key, json.dumps(value)))
    return rows
