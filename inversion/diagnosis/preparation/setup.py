"""A case made ready for its records: emulator of the campaign, mesh correction, responses to effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.campaign.results import is_smooth
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.preparation.plan import Plan
from birdstrike.inversion.diagnosis.preparation.responses import Change, Response, learn_responses, scatter, up_to_date
from birdstrike.inversion.estimation.mesh_correction import MeshCorrection, stack, stacked_curves
from birdstrike.solver.case.case import case_hash
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.run_scatter import common_factors

SCATTER_BLOCKS = 100  # of the time: finer than a record's blocks
SCATTER_KEPT = 0.9
"""Of the variance by which single runs differ, in common directions, over which the rest is spread: half as many, and a
covariance within a tenth of the whole one, as near as some dozens of pairs tell it."""
STEP = 1e-3  # of the ranges: central differences of the emulator
PARTS = 25
"""Of the time, over which curves are averaged before lattices are compared: what changes faster is nearly white, and
the model error of each shot by itself has room for it."""
NOISY, NOISIER = 0.03, 4.0
"""Share of the peak, as much as repeated shots are taken to scatter in a force; times the scatter of the quietest
sensor: one that scatters by more could add a sixteenth to what that one tells of the bird, and its errors, which change
with the bird in ways that no emulator of such runs shows, cost much more."""


@dataclass(frozen=True)
class Setup:
    """What the simulations of a plan tell.

    time: (m,) [s]; channels: the sensors, stacked in this order on a grid of (channels * m,) values; runs: histories by
    label; lows, highs: (k,) fractions of the ranges between which the emulator stands on runs; learnt: responses from
    the two-level design; measured: all channels of the records; unpredictable: sensors, candidates too, that lattices
    move too much -> by how much, which `channels` are without; changes: simulations of single effects since.
    """

    plan: Plan
    time: Array
    channels: tuple[str, ...]
    emulator: Emulator
    mesh: MeshCorrection
    learnt: Mapping[str, Response]
    refused: Mapping[str, str]
    lows: Array
    highs: Array
    runs: Mapping[str, Histories]
    measured: tuple[str, ...]
    unpredictable: Mapping[str, float]
    changes: tuple[Change, ...] = ()

    @property
    def left_out(self) -> dict[str, float]:
        """Measured channel that no simulation can predict -> RMS by which lattices move it, as a share of its peak."""
        return {name: share for name, share in self.unpredictable.items() if name in self.measured}

    @cached_property
    def scatter(self) -> Array:
        """(r, channels * m) rows whose products sum to the covariance by which single runs differ; none before the
        changes.

        Of mean square 1 over each channel, 0 over one that no simulation has moved. Pairs by the dozen show a tenth of
        the directions of a record, so that their covariance, of means over `SCATTER_BLOCKS` parts of the time, is
        shrunk (`surrogate.run_scatter`).
        """
        channels = len(self.channels)
        if not self.changes:
            return np.zeros((0, len(self.time) * channels))
        draws = np.split(scatter(self.changes, channels), channels, axis=1)
        means, middle = [in_parts(one, SCATTER_BLOCKS) for one in draws], in_parts(self.time, SCATTER_BLOCKS)
        rows = [
            np.array([np.interp(self.time, middle, row) for row in own]) for own in common_factors(means, SCATTER_KEPT)
        ]
        sizes = [np.sqrt((own**2).sum(axis=0).mean()) for own in rows]
        return np.hstack([own / size if size > 0.0 else own for own, size in zip(rows, sizes, strict=True)])

    @cached_property
    def responses(self) -> dict[str, Response]:
        """What was learnt, brought up to date by the changes."""
        return {
            name: up_to_date(one, [change for change in self.changes if change.name == name])
            for name, one in self.learnt.items()
        }

    def grid(self, z: Array) -> Array:
        """(q, channels * m) curves with the mesh correction at fractions z (q, k) of the ranges."""
        return self.coarse(z) + self.mesh.at(z)

    def coarse(self, z: Array) -> Array:
        """(q, channels * m) of the emulator alone."""
        return stacked_curves(self.emulator, self.plan.space.to_physical(z), self.channels)

    def split(self, grid: Array) -> dict[str, Array]:
        """channel -> (..., m) of stacked curves (..., channels * m)."""
        return dict(zip(self.channels, np.split(grid, len(self.channels), axis=-1), strict=True))

    def jacobian(self, z: Array) -> Array:
        """(channels * m, k) derivative of the curves with respect to the fractions z (k,)."""
        k = len(z)
        steps = np.vstack([z + STEP * np.eye(k), z - STEP * np.eye(k)])
        curves = self.grid(steps)
        return (curves[:k] - curves[k:]).T / (2.0 * STEP)

    @property
    def mesh_draws(self) -> Array:
        """(n, channels * m) what the fine mesh differs from the coarse one by, at points of the campaign."""
        fine = [i for i in self.plan.fine_points() if f"fine {i}" in self.runs]
        return self.mesh.at(self.plan.unit[fine]) + self.mesh.errors if len(self.mesh.errors) else self.mesh.errors

    @cached_property
    def lattice_moves(self) -> Array:
        """(n, channels * m) SI, what the other lattice moves at each of the points that were simulated on both."""
        moved = [
            stack(other, self.time, self.channels) - stack(own, self.time, self.channels)
            for own, other in lattice_pairs(self.plan, self.runs)
        ]
        return np.reshape(moved, (len(moved), len(self.channels) * len(self.time)))

    def emulator_factors(self, z: Array) -> dict[str, Array]:
        """Channel -> (c, channels * m) directions, one standard deviation each, of the emulator's smooth error at z
        (k,).
        """
        u = self.emulator.inputs(self.plan.space.to_physical(z[None]))
        found: dict[str, Array] = {}
        m = len(self.time)
        for i, channel in enumerate(self.channels):
            one = self.emulator.channels[channel]
            found[channel] = np.zeros((min(len(one.processes), len(one.basis)), len(self.channels) * m))
            for row, process, direction in zip(found[channel], one.processes, one.basis, strict=False):
                row[i * m : (i + 1) * m] = direction * np.sqrt(smooth_variance(process, u))
        return found


def smooth_variance(process: object, u: Array) -> float:
    """Variance of a Gaussian process's mean at u (1, d): without the nugget, which is a single run's own."""
    variance = float(process.predict(u)[1][0])  # pyright: ignore[reportAttributeAccessIssue]
    return max(variance - float(process.nugget), 0.0)  # pyright: ignore[reportAttributeAccessIssue]


def simulate_plan(plan: Plan, simulations: Simulations) -> dict[str, Histories]:
    """All histories of a plan that finished; raises RunFailed when too few of the campaign or of the fine mesh did."""
    runs = simulations.run({**plan.meshes(), **plan.lattices(), **plan.campaign(), **plan.responses()})
    for kind, needed in (("coarse", len(plan.space.names) + 3), ("fine", len(plan.space.names) + 3)):
        count = sum(label.startswith(kind) for label in runs)
        if count < needed:
            reasons = next(iter(simulations.failures.values()), "")
            raise RunFailed(f"{count} {kind} simulations finished, {needed} are needed: {reasons}", "check the case")
    return runs


def make_setup(
    plan: Plan,
    channels: Sequence[str],
    runs: Mapping[str, Histories],
    moved: Mapping[str, float],
    progress: Progress = silent,
) -> Setup:
    """Fit emulator, mesh correction and responses to those of the channels that simulations can predict.

    moved: the others, see `unpredictable`.
    """
    measured, channels = tuple(channels), tuple(name for name in channels if name not in moved)
    data = dataset(plan, channels, runs)
    emulator = fit_emulator(data, channels, progress=progress)
    box = max(emulator.regions, key=lambda r: float(np.prod(r.highs - r.lows)))
    lows, highs = np.clip(plan.space.to_unit(np.stack([box.lows, box.highs])), 0.0, 1.0)
    none = MeshCorrection.none(len(data.time) * len(channels))
    bare = Setup(
        plan=plan,
        time=data.time,
        channels=channels,
        emulator=emulator,
        mesh=none,
        learnt={},
        refused={},
        lows=lows,
        highs=highs,
        runs=runs,
        measured=measured,
        unpredictable=moved,
    )
    fine = [i for i in plan.fine_points() if f"fine {i}" in runs]
    stacks = {label: stack(histories, data.time, channels) for label, histories in runs.items()}
    z = plan.unit[fine]
    mesh = MeshCorrection.fit(z, np.array([stacks[f"fine {i}"] for i in fine]) - bare.coarse(z), len(channels))
    responses, lost = learn_responses(plan, stacks, len(channels))
    return replace(bare, mesh=mesh, learnt=responses, refused={**plan.refused, **lost})


def unpredictable(
    simulated: Sequence[tuple[Plan, Mapping[str, Histories]]], channels: Sequence[str]
) -> dict[str, float]:
    """Sensor, or candidate for one -> RMS, as a share of its peak, by which it differs from lattice to lattice.

    In that of the cases where it differs most. Of sensors that differ by more than `NOISY` and by `NOISIER` times as
    much as the quietest of the channels. A fault of the model in them would be taken for the bird's parameters or for
    an effect.
    """
    scatter: dict[str, float] = {}
    for plan, runs in simulated:
        for name, share in between_lattices(plan, runs).items():
            scatter[name] = max(share, scatter.get(name, 0.0))
    quietest = min((scatter[name] for name in channels if name in scatter), default=np.inf)
    return {name: share for name, share in scatter.items() if share > max(NOISIER * quietest, NOISY)}


def between_lattices(plan: Plan, runs: Mapping[str, Histories]) -> dict[str, float]:
    """Sensor -> RMS difference of the fine simulations on two lattices, as a share of its peak; empty without them.

    Of curves averaged over `PARTS` parts of the time; a sensor that shows nothing in one of them has no share.
    """
    pairs = lattice_pairs(plan, runs)
    known = [name for name in plan.coarse.sensors if pairs and name in pairs[0][0].channels]
    found: dict[str, float] = {}
    for name in known:
        shares = []
        for own, other in pairs:
            moved = in_parts(other.channels[name] - own.channels[name], PARTS)
            peak = float(np.abs(in_parts(own.channels[name], PARTS)).max())
            shares.append((moved**2).mean() / peak**2 if peak else np.nan)
        if np.isfinite(shares).all():
            found[name] = float(np.sqrt(np.mean(shares)))
    return found


def lattice_pairs(plan: Plan, runs: Mapping[str, Histories]) -> list[tuple[Histories, Histories]]:
    """The fine simulations that finished on both lattices, the plan's own lattice first."""
    labels = [(f"fine {i}", f"lattice {i}") for i in plan.fine_points()]
    return [(runs[own], runs[other]) for own, other in labels if own in runs and other in runs]


def in_parts(curves: Array, count: int) -> Array:
    """(..., count) means of curves (..., m) over as many parts of the time, at most m."""
    m = curves.shape[-1]
    return np.stack([curves[..., part].mean(axis=-1) for part in np.array_split(np.arange(m), min(count, m))], axis=-1)


def dataset(plan: Plan, channels: Sequence[str], runs: Mapping[str, Histories]) -> Dataset:
    """The campaign's finished runs."""
    done = plan.finished(runs)
    histories = [runs[f"coarse {i}"] for i in done]
    space, loss = plan.space, plan.case.bird.material.smooth_loss
    return Dataset(
        names=space.names,
        units=space.units,
        lows=space.lows,
        highs=space.highs,
        runs=np.array(done, dtype=np.int64) + 1,
        parameters=space.to_physical(plan.unit[done]),
        time=histories[0].time,
        curves={name: np.array([one.channels[name] for one in histories]) for name in channels},
        channel_units={name: histories[0].units[name] for name in channels},
        smooth=np.array([is_smooth(one.summary, loss) for one in histories]),
        case_hash=case_hash(plan.coarse),
        smooth_loss=loss,
        scales=space.scales,
    )
