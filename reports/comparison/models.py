"""The impact with each bird model: the user's case with the three standard birds, and with the inverted bird.

The standard birds are the paper's (Tables 10 to 13), from the shipped cases: their material on the user's own plate,
shape, mass, speed and mesh. They run side by side, each once: it is kept in `models/runs/` of the folder. Their curves
pass the filter of the inversion, where it had one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from birdstrike.data.errors import CaseError, MachineFailure
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.store import RunStore
from birdstrike.data.units import quantity_text
from birdstrike.doe.campaign.run import Failed, Finished, PlannedRun
from birdstrike.doe.campaign.runner import Runner
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.doe.external.deck import refuse_missing_in_deck
from birdstrike.doe.solvers import solver_for
from birdstrike.inversion import forward
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


def run_models(results: Results, progress: Progress = silent) -> Results:
    """Results with every model's simulation, run where it is not in the store; a failure is kept with its reason."""
    cases: dict[str, Case | CaseError] = {name: _standard(results, shipped) for name, shipped in STANDARD.items()}
    cases[results.best] = _inverted(results)
    runnable = {key: case for key, case in cases.items() if not isinstance(case, CaseError)}
    outcomes = _outcomes(runnable, RunStore(results.folder / "models" / "runs"), progress)
    models: dict[str, Model] = {}
    for key, case in cases.items():
        kept = runnable.get(key)
        run, failure = (None, "; ".join(case.errors)) if isinstance(case, CaseError) else _found(outcomes[key])
        run = None if run is None else results.compared(run)
        offset = results.offset if key == results.best or run is None else best_offset(results, run)
        models[key] = Model(key, titled(key, results.case), kept, run, offset, failure)
    return replace(results, simulated_models=models)


def _outcomes(cases: Mapping[str, Case], store: RunStore, progress: Progress) -> dict[str, Finished | Failed]:
    """What became of each model's simulation; those that are due run in processes of their own."""
    # The longest first: the standard birds, whose kernels may have to be compiled.
    solvers = [solver_for(case, forward.simulate) for case in cases.values()]
    planned = [PlannedRun.alone(i, case, solvers[i]) for i, case in enumerate(cases.values())]
    runner = Runner(store, planned, lambda counts: progress(counts.done))
    if runner.due:
        workers, case = min(worker_count(None), len(runner.due)), next(iter(cases.values()))
        with process_pool(workers) as pool:
            runner.run(pool, solvers[0].simulate, case, workers)
    return {key: runner.outcomes[i] for i, key in enumerate(cases)}


def _found(outcome: Finished | Failed) -> tuple[Histories | None, str]:
    """The histories, or None and why; raises MachineFailure where the model is not at fault."""
    if isinstance(outcome, Finished):
        found = outcome.histories
        return replace(found, summary={**found.summary, "run_key": outcome.key}), ""
    if outcome.due:
        raise MachineFailure(outcome.reason)
    return None, outcome.reason


def _standard(results: Results, shipped: str) -> Case | CaseError:
    """The user's case with a shipped case's bird material, or why the two do not go together.

    An external solver simulates it only where its deck has a place for all that the material changes: else the curve
    would be that of the case's own bird under another name.
    """
    try:
        case = results.case.overlaid({"bird": {"material": read_case(shipped)["bird"]["material"]}})
        refuse_missing_in_deck(results.case, case)
        solver_for(case, forward.simulate)
    except CaseError as error:
        return error
    return _pictured(case)


def _inverted(results: Results) -> Case | CaseError:
    """The user's case at the point where the best method was verified."""
    pictured = _pictured(results.case)
    return pictured if isinstance(pictured, CaseError) else pictured.with_values(verified_point(results))


def verified_point(results: Results) -> dict[str, float]:
    """SI values by dotted key at which the best method's verification ran."""
    answer = results.answer
    if answer.combination is not None:
        return dict(answer.combination.point)
    return {name: e.value for name, e in answer.parameters.items() if e.value is not None}


def _pictured(case: Case) -> Case | CaseError:
    """The case with a snapshot at every instant of the pictures and the animation."""
    instants = [quantity_text(float(t), "s") for t in picture_times(case)]
    try:
        return case.overlaid({"time": {"snapshots": instants}})
    except CaseError as error:
        return error


def picture_times(case: Case) -> tuple[float, ...]:
    """Instants [s] of the snapshots: the animation's, the case's own, and the one at which stresses are compared."""
    end = case.time.end
    frames = np.linspace(0.0, end, FRAMES)
    wanted = {round(float(t), 9) for t in (*frames, *case.time.snapshots, min(PICTURE_TIME, end))}
    return tuple(sorted(t for t in wanted if t <= end))
