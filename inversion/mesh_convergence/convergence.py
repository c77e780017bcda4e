"""Mesh convergence of a user's own case: simulations on several meshes, and the numerical uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.attempt import Simulate
from birdstrike.doe.campaign.run import Failed, Finished, PlannedRun
from birdstrike.doe.campaign.runner import RunCounts, Runner
from birdstrike.doe.campaign.worker import process_pool
from birdstrike.doe.solvers import solver_for
from birdstrike.inversion.mesh_convergence.grid_convergence import (
    CurveConvergence,
    GridConvergence,
    curve_convergence,
    grid_convergence,
)
from birdstrike.inversion.mesh_convergence.meshes import Mesh
from birdstrike.inversion.mesh_convergence.scalars import Scalar, scalars


@dataclass(frozen=True)
class MeshConvergence:
    """Meshes with their histories, finest first; user: number of the user's own; scalars by name, curves by sensor.

    Orders and bands are those of three meshes, `used`: the user's own and its neighbours.
    """

    meshes: tuple[Mesh, ...]
    runs: tuple[Finished, ...]
    user: int
    used: tuple[int, ...]
    scalars: dict[str, tuple[Scalar, GridConvergence, tuple[float, ...]]]
    curves: dict[str, CurveConvergence]

    @property
    def histories(self) -> tuple[Histories, ...]:
        """Of the meshes, finest first."""
        return tuple(run.histories for run in self.runs)

    @property
    def own(self) -> int:
        """The user's mesh among those used."""
        return self.used.index(self.user)


def run_meshes(
    meshes: Sequence[Mesh],
    store: RunStore,
    workers: int,
    *,
    progress: Progress = silent,
    simulate: Simulate | None = None,
    executor: Executor | None = None,
    retry: float = 0.0,
) -> tuple[Finished, ...]:
    """Simulate on each mesh, or take the run that the store holds; dearest first, one thread each.

    progress: takes the share of the estimated cost that is done. Raises RunFailed naming the meshes that failed, when
    all others are kept. retry: runs whose failure was stored before this time [s, Unix] are tried again.
    """
    solver = solver_for(meshes[0].case, simulate)
    order = sorted(range(len(meshes)), key=lambda i: -meshes[i].cost)
    runs = [PlannedRun.alone(i, meshes[i].case, solver) for i in order]
    total = sum(mesh.cost for mesh in meshes)

    def show(_: RunCounts) -> None:
        progress(sum(meshes[i].cost for i in runner.outcomes) / total)

    runner = Runner(store, runs, lambda _: None, retry)
    runner.progress = show
    show(RunCounts(len(meshes), 0, 0, 0, 0))
    if runner.due:
        with nullcontext(executor) if executor is not None else process_pool(min(workers, len(runner.due))) as pool:
            runner.run(pool, solver.simulate, meshes[0].case, workers)
    return _all_finished(meshes, [runner.outcomes[i] for i in range(len(meshes))], len(solver.step_factors))


def _all_finished(meshes: Sequence[Mesh], outcomes: Sequence[Finished | Failed], attempts: int) -> tuple[Finished, ...]:
    at_half = ", at half the step too" if attempts > 1 else ""
    failed = [
        f"{mesh.particles} particles, {mesh.elements[0]} x {mesh.elements[1]} shells: {outcome.reason}"
        for mesh, outcome in zip(meshes, outcomes, strict=True)
        if isinstance(outcome, Failed)
    ]
    if failed:
        raise RunFailed(
            f"{len(failed)} of {len(meshes)} meshes failed{at_half}: {'; '.join(failed)}",
            "the other runs are kept; choose other meshes with --place, --ratio or a finer mesh of your own",
        )
    return tuple(outcome for outcome in outcomes if isinstance(outcome, Finished))


def judge_meshes(meshes: Sequence[Mesh], runs: Sequence[Finished]) -> MeshConvergence:
    """Order, extrapolated value and uncertainty of every scalar and curve, from the user's mesh and its neighbours."""
    user = next(i for i, mesh in enumerate(meshes) if mesh.level == 0)
    first = min(max(user - 1, 0), len(meshes) - 3)
    used = (first, first + 1, first + 2)
    spacings = [meshes[i].bird_spacing for i in used]
    histories = [run.histories for run in runs]
    sought = scalars(meshes[user].case)
    values = {s.name: tuple(s.at(h, histories[user]) for h in histories) for s in sought}
    return MeshConvergence(
        tuple(meshes),
        tuple(runs),
        user,
        used,
        {s.name: (s, grid_convergence(spacings, [values[s.name][i] for i in used]), values[s.name]) for s in sought},
        {name: curve_convergence(spacings, _stacked(histories, name, used)) for name in histories[user].channels},
    )


def _stacked(histories: Sequence[Histories], channel: str, used: Sequence[int]) -> Array:
    return np.array([histories[i].channels[channel] for i in used])
