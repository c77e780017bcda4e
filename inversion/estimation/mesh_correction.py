"""Mesh correction: what a fine mesh adds to the coarse campaign's curves, learnt at points of the campaign.

Autoregressive co-kriging of two fidelities with factor 1 (Kennedy & O'Hagan, Biometrika 87 (2000) 1): fine = coarse +
m(theta), m by a Gaussian process for each principal component of all channels together that can be predicted. (Linear
in the parameters, its leave-one-out error was twice as large: a coarse mesh errs most where the bird's viscosity is
small.) One implementation with two readers: a calibration corrects its campaign, a diagnosis its setup.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from birdstrike.data.histories import Array
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.gaussian_process import GaussianProcess

FINER_PARTICLES, FINER_SHELLS = 8, 2  # half the spacing in bird and plate, so that Richardson's argument applies
FINE_RUNS = 10  # fine simulations: two parameters' linear trend and seven degrees of freedom

EXTRAPOLATED = 1.0 / 3.0
"""Of the correction from spacing h to h/2: what is left to spacing 0 for a scheme of second order (Richardson,
Phil. Trans. A 210 (1911) 307); of first order it is 1. One standard deviation of one direction."""
PREDICTABLE = 0.3  # leave-one-out Q2 of a component: with less a process has fitted the particles' scatter
COMPONENTS = 4  # of ten points: more would hold single points


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
        scale = np.repeat([np.sqrt((p**2).mean()) or 1.0 for p in parts], differences.shape[1] // channels)
        u, s, v = np.linalg.svd((differences - mean) / scale, full_matrices=False)
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

    def extrapolation(self, z: Array) -> Array:
        """(grid,) one standard deviation of what a still finer mesh would add at z (k,)."""
        return EXTRAPOLATED * self.at(z[None])[0]


def fine_mesh(coarse: Case, declared: Case) -> Case:
    """The declared case on the fine mesh of a campaign on `coarse`, never coarser than declared."""
    particles = max(FINER_PARTICLES * coarse.bird.particles, declared.bird.particles)
    pairs = zip(coarse.plate.elements, declared.plate.elements, strict=True)
    along, across = (max(FINER_SHELLS * n, least) for n, least in pairs)
    return declared.with_mesh(particles, (along, across))


def spread(unit: Array) -> tuple[int, ...]:
    """Indices of points (n, k): the one nearest the middle, then always the one farthest from those chosen."""
    chosen = [int(((unit - 0.5) ** 2).sum(axis=1).argmin())]
    distances = cdist(unit, unit)
    while len(chosen) < len(unit):
        nearest = distances[:, chosen].min(axis=1)
        chosen.append(int(nearest.argmax()))
    return tuple(chosen)
