"""The impact with each bird model: the user's case with the three standard birds, and with the inverted bird.

The standard birds are the paper's (Tables 10 to 13), from the shipped cases: their material on the user's own plate,
shape, mass, speed and mesh. Each simulation runs once: it is kept in `models/runs/` of the folder.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.store import RunStore
from birdstrike.data.units import quantity_text
from birdstrike.inversion.forward import StoredSolver
from birdstrike.reports.comparison.clock import best_offset
from birdstrike.reports.results.results import Model, Results, titled
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.load import read_case

STANDARD = {
    "elastic": "reference_strike_elastic",
    "plastic_kinematic": "reference_strike_plastic_kinematic",
    "hydrodynamic": "reference_strike_hydrodynamic",
}
"""Model -> the shipped case that holds its constants."""

PICTURE_TIME = 1.5e-3  # s: near the plate's peak in the reference strike, where the models are usually compared
FRAMES = 40  # of the animation

Progress = Callable[[float], None]


def run_models(results: Results, progress: Progress | None = None) -> Results:
    """Results with every model's simulation, run where it is not in the store; a failure is kept with its reason."""
    cases: dict[str, Case | CaseError] = {name: _standard(results, shipped) for name, shipped in STANDARD.items()}
    cases[results.best] = _inverted(results)
    models: dict[str, Model] = {}
    for done, (key, case) in enumerate(cases.items()):
        report_share = _part(progress, done, len(cases))
        run, failure = _run(results, case, report_share)
        report_share(1.0)
        offset = results.offset if key == results.best or run is None else best_offset(results, run)
        kept = None if isinstance(case, CaseError) else case
        models[key] = Model(key, titled(key, results.case), kept, run, offset, failure)
    return replace(results, simulated_models=models)


def _part(progress: Progress | None, done: int, whole: int) -> Progress:
    """Progress of one simulation among several, as a share of all."""

    def report_share(share: float) -> None:
        if progress is not None:
            progress((done + share) / whole)

    return report_share


def _standard(results: Results, shipped: str) -> Case | CaseError:
    """The user's case with a shipped case's bird material, or why the two do not go together."""
    return _pictured(results, {"bird": {"material": read_case(shipped)["bird"]["material"]}})


def _inverted(results: Results) -> Case | CaseError:
    """The user's case at the point where the best method was verified."""
    pictured = _pictured(results, {})
    return pictured if isinstance(pictured, CaseError) else pictured.with_values(verified_point(results))


def verified_point(results: Results) -> dict[str, float]:
    """SI values by dotted key at which the best method's verification ran."""
    answer = results.answer
    if answer.combination is not None:
        return dict(answer.combination.point)
    return {name: e.value for name, e in answer.parameters.items() if e.value is not None}


def _pictured(results: Results, table: dict[str, object]) -> Case | CaseError:
    """The user's case under `table`, with a snapshot at every instant of the pictures and the animation."""
    instants = [quantity_text(float(t), "s") for t in picture_times(results.case)]
    try:
        return results.case.overlaid({**table, "time": {"snapshots": instants}})
    except CaseError as error:
        return error


def picture_times(case: Case) -> tuple[float, ...]:
    """Instants [s] of the snapshots: the animation's, the case's own, and the one at which stresses are compared."""
    end = case.time.end
    frames = np.linspace(0.0, end, FRAMES)
    wanted = {round(float(t), 9) for t in (*frames, *case.time.snapshots, min(PICTURE_TIME, end))}
    return tuple(sorted(t for t in wanted if t <= end))


def _run(results: Results, case: Case | CaseError, progress: Progress) -> tuple[Histories | None, str]:
    """The histories from the store or the solver, or None and why."""
    if isinstance(case, CaseError):
        return None, "; ".join(case.errors)
    try:
        return StoredSolver(case, RunStore(results.folder / "models" / "runs"), progress=progress)({}), ""
    except RunFailed as failure:
        return None, str(failure)
