"""Mesh correction: what a fine mesh adds to the coarse campaign's curves, learnt at points of the campaign.

Autoregressive co-kriging of two fidelities with factor 1 (Kennedy & O'Hagan, Biometrika 87 (2000) 1): fine = coarse +
m(theta), m by a Gaussian process for each principal component of all channels together that can be predicted. (Linear
in the parameters, its leave-one-out error was twice as large: a coarse mesh errs most where the bird's viscosity is
small.) One implementation with two readers: a calibration corrects its campaign, a diagnosis its setup.

Ten curves give a covariance of ten directions, and a fit looks for the parameters where that covariance says that
little errs: its estimates then err by two to three times what it states. So a calibration fits every fine run to what
the other nine say, and enlarges the standard deviations until these estimates err as stated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.utils.extmath import svd_flip

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.whitening import principal
from birdstrike.inversion.forward import Forward, watched
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.results.ingredients import MeshCorrectionFigures
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.gaussian_process import GaussianProcess, student_inflation
from birdstrike.surrogate.run_scatter import factors_between

FINER_PARTICLES, FINER_SHELLS = 8, 2  # half the spacing in bird and plate, so that Richardson's argument applies
FINE_RUNS = 10  # fine simulations: two parameters' linear trend and seven degrees of freedom
FEWEST = 5  # fine simulations that must finish: mean, and a component's process with its leave-one-out error

EXTRAPOLATED = 1.0 / 3.0
"""Of the correction from spacing h to h/2: what is left to spacing 0 for a scheme of second order (Richardson,
Phil. Trans. A 210 (1911) 307); of first order it is 1. One standard deviation of one direction."""
PREDICTABLE = 0.3  # leave-one-out Q2 of a component: with less a process has fitted the particles' scatter
COMPONENTS = 4  # of ten points: more would hold single points
INSTANTS = 250  # of a channel, at which the covariance of the scatter stands: a strain's has no smoother shape
FACTORS = np.geomspace(1.0, 10.0, 48)  # on the scatter, that are tried
PRIOR = 12.0**-0.5  # of a range: standard deviation of a parameter that may lie anywhere in it
STEP = 1e-3  # of a range, for derivatives


@dataclass(frozen=True)
class MeshCorrection:
    """m(z) = mean + sum of scores(z) directions, on the stacked grid.

    mean: (grid,) SI; directions: (c, grid) SI; processes: of the scores; errors: (n, grid) leave-one-out errors of the
    points; rest: (n, grid) of them what no process predicts.
    """

    mean: Array
    directions: Array
    processes: tuple[GaussianProcess, ...]
    errors: Array
    rest: Array

    @classmethod
    def none(cls, grid: int) -> MeshCorrection:
        """No correction."""
        return cls(np.zeros(grid), np.zeros((0, grid)), (), np.zeros((0, grid)), np.zeros((0, grid)))

    @classmethod
    def fit(cls, z: Array, differences: Array, channels: int, seed: int = 0) -> MeshCorrection:
        """From differences (n, grid), fine less coarse, at fractions z (n, k) of the ranges."""
        n, mean = len(z), differences.mean(axis=0)
        parts = np.split(differences, channels, axis=1)
        scale = np.repeat([rms(p) or 1.0 for p in parts], differences.shape[1] // channels)
        u, s, v = np.linalg.svd((differences - mean) / scale, full_matrices=False)
        u, v = svd_flip(u, v, u_based_decision=False)  # of one sign in every case: shots share the components' errors
        scores, rows, processes = u * s, v * scale, []
        errors = (differences - mean) * n / (n - 1.0)
        kept: list[int] = []
        for c in range(min(COMPONENTS, n - 2)):
            process = GaussianProcess.fit(z, scores[:, c], seed)
            if process.q2 > PREDICTABLE:
                kept.append(c)
                processes.append(process)
                errors = errors - np.outer(scores[:, c] * n / (n - 1.0) - (scores[:, c] - process.loo), rows[c])
        rest = ((differences - mean) - scores[:, kept] @ rows[kept]) * n / (n - 1.0)
        return cls(mean, rows[kept], tuple(processes), errors, rest)

    def at(self, z: Array) -> Array:
        """(q, grid) at z (q, k)."""
        if not self.processes:
            return np.tile(self.mean, (len(z), 1))
        return self.mean + np.stack([one.mean(z) for one in self.processes], axis=1) @ self.directions

    @property
    def lengths(self) -> Array | None:
        """(k,) ranges over which its largest component changes with each parameter; None where none was predicted.

        What a finer mesh changes is the one discrepancy that can be seen at many parameters.
        """
        if not self.processes:
            return None
        kernel = self.processes[0].kernel
        return np.atleast_1d(np.asarray(kernel.k1.k2.length_scale))  # pyright: ignore[reportAttributeAccessIssue]

    def factor(self, z: Array) -> Array:
        """(q, grid) directions, one standard deviation each, of the correction's error at z (k,).

        The processes' own variance without a run's scatter; of what no process predicts the share that may be structure
        all the same, for a component below that share is not predicted.
        """
        sizes = [np.sqrt(max(float(one.predict(z[None])[1][0]) - one.nugget, 0.0)) for one in self.processes]
        rest = np.sqrt(PREDICTABLE / max(len(self.rest), 1)) * self.rest
        return np.vstack([np.array(sizes).reshape(-1, 1) * self.directions, rest])

    def scatter(self, channels: int) -> Array:
        """(r, grid) directions, one standard deviation each, by which a new fine run leaves the correction.

        Covariance of the leave-one-out errors over time and channels, shrunk, and enlarged for so few of them.
        """
        parts = np.split(self.errors * np.sqrt(student_inflation(len(self.errors) - 1)), channels, axis=1)
        samples = np.arange(parts[0].shape[1], dtype=float)
        return np.hstack(factors_between([samples] * channels, parts, INSTANTS))

    def extrapolation(self, z: Array) -> Array:
        """(grid,) one standard deviation of what a still finer mesh would add at z (k,)."""
        return EXTRAPOLATED * self.at(z[None])[0]


@dataclass(frozen=True)
class LeftOut:
    """A fine run as the others see it.

    z: (k,) where; missed: (grid,) SI, what it has beyond the coarse emulator and the correction of the others;
    correction: of the others.
    """

    z: Array
    missed: Array
    correction: MeshCorrection

    @classmethod
    def each(cls, z: Array, differences: Array, channels: int, seed: int) -> tuple[LeftOut, ...]:
        """Of fine runs at z (n, k) with their differences (n, grid) from the coarse emulator."""
        found = list[LeftOut]()
        for i in range(len(z)):
            others = MeshCorrection.fit(np.delete(z, i, 0), np.delete(differences, i, 0), channels, seed)
            found.append(cls(z[i], differences[i] - others.at(z[i][None])[0], others))
        return tuple(found)


@dataclass(frozen=True)
class CorrectedCampaign:
    """A campaign with what the fine mesh adds: what a calibration takes in the campaign's place.

    dataset: the runs, their measured channels corrected; emulator: of the runs as they were; channels: the measured
    ones, stacked in this order; correction: of the stack; left_out: its fine runs; figures: what it came to and cost.
    """

    dataset: Dataset
    emulator: Emulator
    channels: tuple[str, ...]
    correction: MeshCorrection
    left_out: tuple[LeftOut, ...]
    figures: MeshCorrectionFigures

    def forward(self, coarse: Forward) -> Forward:
        """A forward model on the campaign's mesh, corrected."""
        return CorrectedForward(coarse, self)

    def added(self, theta: Array) -> dict[str, Array]:
        """channel -> (m,) correction at parameters theta (k,) SI, on the data set's clock."""
        stacked = self.correction.at(self._place(theta)[None])[0]
        return dict(zip(self.channels, np.split(stacked, len(self.channels)), strict=True))

    def columns(self, observations: Observations, mode: Mode, widening: float | None = None) -> Array:
        """(n, s) the correction's error at a fit, one standard deviation each; `widening` where it is known."""
        factor = self.widening(observations, mode.t0) if widening is None else widening
        scatter = factor * self.correction.scatter(len(self.channels))
        rows = np.vstack([scatter, self.correction.extrapolation(self._place(mode.theta))])
        return self._measured(rows, observations, mode.t0)

    def widening(self, observations: Observations, t0: float) -> float:
        """The least factor on the scatter at which estimates of the left-out fine runs err as stated.

        Where they err by more at every factor, that at which they err least.
        """
        rehearsals = [self._rehearsal(one, observations, t0) for one in self.left_out]
        errors = np.array([np.mean([error(factor) for error in rehearsals]) for factor in FACTORS])
        return float(FACTORS[np.argmax(errors <= 1.0) if errors.min() <= 1.0 else errors.argmin()])

    def _rehearsal(self, one: LeftOut, observations: Observations, t0: float) -> Callable[[float], float]:
        """Mean square error of what a fine run's curves say of the parameters, in the variances stated, by the factor
        on the scatter.

        Linear about the run, over the directions of the parameters; each counts as far as the curves say more of it
        than the ranges do.
        """
        model = CurveModel(self.emulator, observations)
        emulated = model.error_factor(self._theta(one.z[None])[0], t0)
        extrapolated = self._measured(one.correction.extrapolation(one.z)[None], observations, t0)
        whitening = model.whitening(t0, np.hstack([emulated, extrapolated]))
        scatter, slopes, missed = (
            whitening.apply(self._measured(rows, observations, t0).T).T
            for rows in (one.correction.scatter(len(self.channels)), PRIOR * self._slopes(one.z), one.missed[None])
        )
        directions, variances = principal(scatter)
        rows = np.hstack([slopes, missed])
        along = directions.T @ rows

        def error(factor: float) -> float:
            shrink = 1.0 - 1.0 / np.sqrt(1.0 + factor**2 * variances)
            own = rows - directions @ (shrink[:, None] * along)
            sensed, sizes, _ = np.linalg.svd(own[:, :-1], full_matrices=False)
            weights = sizes**2 / (1.0 + sizes**2)
            return float(weights @ (sensed.T @ own[:, -1]) ** 2 / max(weights.sum(), 1e-300))

        return error

    def _slopes(self, z: Array) -> Array:
        """(k, grid) derivatives of the corrected curves at z (k,), for a whole range of each parameter."""
        up, down = np.minimum(z + STEP * np.eye(len(z)), 1.0), np.maximum(z - STEP * np.eye(len(z)), 0.0)
        curves = [
            stacked_curves(self.emulator, self._theta(place), self.channels) + self.correction.at(place)
            for place in (up, down)
        ]
        return (curves[0] - curves[1]) / np.diag(up - down)[:, None]

    def _measured(self, rows: Array, observations: Observations, t0: float) -> Array:
        """(n, s) rows (s, grid) at the measured instants."""
        parts = dict(zip(self.channels, np.split(rows, len(self.channels), axis=1), strict=True))
        return np.concatenate([self._at(parts[c.name], c.times - t0) for c in observations.channels])

    def _at(self, rows: Array, times: Array) -> Array:
        """(n, s) of rows (s, m) at `times` [s]."""
        return np.stack([np.interp(times, self.dataset.time, row) for row in rows], axis=1)

    def _place(self, theta: Array) -> Array:
        """Fractions (k,) of the ranges, each in its scale."""
        return self.dataset.to_unit(theta)

    def _theta(self, z: Array) -> Array:
        """Parameters (q, k) SI at fractions z (q, k) of the ranges, each in its scale."""
        return self.dataset.to_physical(z)


@dataclass(frozen=True)
class CorrectedForward:
    """A forward model with what the fine mesh adds to the measured channels."""

    coarse: Forward
    campaign: CorrectedCampaign

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Raises RunFailed."""
        run, data = self.coarse(theta), self.campaign.dataset
        added = self.campaign.added(np.array([theta[name] for name in data.names]))
        own = {name: run.channels[name] + np.interp(run.time, data.time, values) for name, values in added.items()}
        return replace(run, channels={**run.channels, **own})

    def watched(self, progress: Progress) -> CorrectedForward:
        """With its progress reported."""
        return replace(self, coarse=watched(self.coarse, progress))


def correct_campaign(
    dataset: Dataset, fine: Forward, case: Case, channels: Sequence[str], progress: Progress, seed: int = 0
) -> CorrectedCampaign:
    """Simulate up to ten points of a campaign on the fine mesh and add to all runs what these tell.

    Parameters
    ----------
    dataset : Dataset
        The campaign.
    fine : callable
        The forward model on the fine mesh.
    case : Case
        That of `fine`, whose mesh is named.
    channels : sequence of str
        The measured ones; the others stay as they are.
    progress : callable
        Takes the share of the work that is done, 0..1.
    seed : int
        Of the fits.

    Raises
    ------
    UserError
        When fewer than five of the fine simulations finish.
    """
    begun, emulator = perf_counter(), fit_emulator(dataset, channels, seed)
    rows = np.flatnonzero(np.isin(dataset.runs, emulator.runs))
    places = dataset.to_unit(dataset.parameters)
    chosen = rows[list(spread(places[rows])[:FINE_RUNS])]
    finished, curves = _fine_runs(dataset, fine, chosen, channels, progress)
    z = places[finished]
    differences = curves - stacked_curves(emulator, dataset.parameters[finished], channels)
    correction = MeshCorrection.fit(z, differences, len(channels), seed)
    parts = np.split(correction.at(places), len(channels), axis=1)
    own = {name: dataset.curves[name] + part for name, part in zip(channels, parts, strict=True)}
    mesh_file = unrefined_file(case)
    figures = MeshCorrectionFigures(
        particles=case.bird.particles,
        elements=case.plate.elements if mesh_file is None else None,
        runs=len(finished),
        seconds=perf_counter() - begun,
        added=_shares(differences, dataset, channels),
        error=_shares(correction.errors, dataset, channels),
        mesh_file=mesh_file,
    )
    corrected = replace(dataset, curves={**dataset.curves, **own})
    left_out = LeftOut.each(z, differences, len(channels), seed)
    return CorrectedCampaign(corrected, emulator, tuple(channels), correction, left_out, figures)


def _fine_runs(
    dataset: Dataset, fine: Forward, chosen: NDArray[np.intp], channels: Sequence[str], progress: Progress
) -> tuple[list[int], Array]:
    """Rows of a campaign whose simulation on the fine mesh finished, and its stacked curves (rows, instants), SI.

    chosen: rows that are simulated. Raises UserError when fewer than `FEWEST` finish.
    """
    finished, curves, failure = list[int](), list[Array](), ""
    for i, row in enumerate(chosen):
        part = watched(fine, lambda f, i=i: progress((i + f) / len(chosen)))
        try:
            found = part(dataset.named(dataset.parameters[row]))
        except RunFailed as reason:
            failure = str(reason)
            continue
        finished.append(int(row))
        curves.append(stack(found, dataset.time, channels))
    if len(finished) < FEWEST:
        raise UserError(
            f"--mesh-correction: {len(finished)} of {len(chosen)} simulations on the fine mesh finished, {FEWEST} are "
            f"needed ({failure or 'the campaign has no more runs'}); calibrate without it, or extend the campaign"
        )
    return finished, np.array(curves)


def stack(run: Histories, time: Array, channels: Sequence[str]) -> Array:
    """(channels * m,) a run's channels one after the other."""
    return np.concatenate([np.interp(time, run.time, run.channels[name]) for name in channels])


def stacked_curves(emulator: Emulator, theta: Array, channels: Sequence[str]) -> Array:
    """(q, channels * m) the emulator at parameters theta (q, k) SI: a run itself has its own scatter besides."""
    u, own = emulator.inputs(theta), [emulator.channels[name] for name in channels]
    return np.concatenate([one.mean + one.scores(u) @ one.basis[: len(one.processes)] for one in own], axis=1)


def _shares(rows: Array, dataset: Dataset, channels: Sequence[str]) -> dict[str, float]:
    """channel -> root mean square of rows (n, channels * m), share of the runs' peak."""
    parts = zip(channels, np.split(rows, len(channels), axis=1), strict=True)
    return {n: rms(p) / float(max(np.abs(dataset.curves[n]).max(), 1e-300)) for n, p in parts}


def fine_mesh(coarse: Case, declared: Case) -> Case:
    """The declared case on the fine mesh of a campaign on `coarse`, never coarser than declared.

    Shells from a file stay (see `shells_of_a_file`).
    """
    particles = max(FINER_PARTICLES * coarse.bird.particles, declared.bird.particles)
    pairs = zip(coarse.plate.elements, declared.plate.elements, strict=True)
    along, across = (max(FINER_SHELLS * n, least) for n, least in pairs)
    return declared.with_mesh(particles, (along, across))


def unrefined_file(case: Case) -> str | None:
    """Name of the file whose shells a case keeps on the fine mesh; None where there is none."""
    return None if case.mesh_file is None or case.solver.name == "external" else case.mesh_file.name


def shells_of_a_file(mesh_files: Iterable[str | None]) -> list[str]:
    """A warning where shells from files are not refined; None stands for a target whose shells are."""
    named = ", ".join(dict.fromkeys(name for name in mesh_files if name))
    if not named:
        return []
    return [
        f"target.mesh = {named}: shells from a file are not refined, only the bird is, so that the error of their mesh "
        "is not in the intervals; repeat with a file of shells half as large and compare"
    ]


def spread(unit: Array) -> tuple[int, ...]:
    """Indices of points (n, k): the one nearest the middle, then always the one farthest from those chosen."""
    chosen = [int(((unit - 0.5) ** 2).sum(axis=1).argmin())]
    distances = cdist(unit, unit)
    while len(chosen) < len(unit):
        nearest = distances[:, chosen].min(axis=1)
        chosen.append(int(nearest.argmax()))
    return tuple(chosen)
