"""What the model leaves of a sensor, in the new shot: a Gaussian process given the residuals of the learnt shots.

In units of the peaks, d = a s(t) w with w of unit variance, Matern 5/2 in time and 0 at contact, s >= 1 the growth in
time, a the amplitude (Kennedy & O'Hagan, J. R. Statist. Soc. B 63 (2001) 425). The part that shots of one rig share has
correlation R_ij between two of them and rho_i with the new one (`distance`); each shot has a part of its own besides
(b). Given the residuals r of all learnt shots with noise sigma, C_ij = R_ij a^2 K_ij + delta_ij (b^2 K_ij + sigma^2),

    mean = G r,   covariance = g^2 [(a^2 + b^2) K' - G k^T],   G = k C^-1,   k_i = rho_i a^2 K'_i,

g the growth outside what was learnt; a is at least what the residuals show beyond the noise. Each draw of an
explanation has its own residual: parameters and model error are one posterior, and a draw whose curve lies high has an
error that lies low. Near the data the new shot errs as the old ones did; far away by as much as nothing is known.

What a still finer mesh would add, x e with x ~ N(0, 1), is shared by all shots of a rig, and in the records already:
with e_0 of the learnt shots and e of the new one, x has the variance v = 1/(1 + e_0^T C^-1 e_0) and the mean
v e_0^T C^-1 r, and moves the prediction by e - G e_0, because the process takes up less of the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.discrepancy import UNSEEN, repeatability, started
from birdstrike.inversion.prediction.distance import Distance
from birdstrike.inversion.prediction.learnt import Explanation, SensorError

INSTANTS = 100  # of the new record: linear between
LEARNT_INSTANTS = 160  # of all learnt records together
UNKNOWN_SHARE = 0.02  # of the peak: amplitude of a kind of sensor that no record shows
UNRELATED = 1e-3  # correlation below which a record gives no information
LEVELS = 5  # of an amplitude that is drawn from a continuous distribution


def realisations(
    one: Explanation,
    rows: NDArray[np.int64],
    errors: Sequence[SensorError | None],
    kind: str,
    times: Array,
    finer: Array,
    where: Distance,
    rng: np.random.Generator,
) -> tuple[Array, Array, Array]:
    """(n, m) shares of the new peak: the model error that the records let expect, deviations of it, those of the mesh.

    rows: (n,) of the explanation's stored draws; errors: of the sensor in every learnt shot, None where it was not
    learnt; times: (m,) [s] since first contact; finer: (m,) one standard deviation of what a still finer mesh would
    add, as a share of the peak.
    """
    shared = one.amplitude.get(kind, np.full(len(one.parameters), UNKNOWN_SHARE))[rows]
    own = one.own.get(kind, np.full(len(one.parameters), repeatability(kind)))[rows]
    known = [(i, error) for i, error in enumerate(errors) if error is not None and one.label in error.residual]
    if known:
        excess = float(np.mean([error.excess(one.label) for _, error in known]))
        shared = np.maximum(shared, np.sqrt(np.maximum(excess - own**2, 0.0)))
    shape = next((error for error in errors if error is not None), None)
    records, kept = Records.of(known), _thinned(len(times), INSTANTS)
    found = np.zeros((3, len(rows), len(times)))
    for a, b, of in _levels(shared, own):
        gain, covariance, mesh = _conditioned(a, b, records, shape, times[kept], finer[kept], where)
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        mean = records.left(one.label, rows[of]) @ gain.T
        drawn = rng.standard_normal((len(of), len(kept))) @ root.T
        for j, part in enumerate((mean, drawn, rng.standard_normal((len(of), 1)) * mesh)):
            found[j, of] = np.array([np.interp(times, times[kept], row) for row in part])
    return found[0], found[1], found[2]


def _thinned(count: int, most: int) -> NDArray[np.int64]:
    """At most so many indices of `count`, evenly."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).round().astype(np.int64))


def _levels(shared: Array, own: Array) -> list[tuple[float, float, NDArray[np.int64]]]:
    """Amplitudes and the draws that have them; many different ones are gathered in a few."""
    pairs = np.stack([shared, own], axis=1)
    values, of = np.unique(pairs, axis=0, return_inverse=True)
    if len(values) > 3 * LEVELS:
        order = np.argsort(shared + own)
        parts = np.array_split(order, LEVELS)
        return [(float(shared[p].mean()), float(own[p].mean()), p) for p in parts if len(p)]
    return [(float(a), float(b), np.flatnonzero(of.ravel() == i)) for i, (a, b) in enumerate(values)]


@dataclass(frozen=True)
class Records:
    """Residuals of one sensor in the learnt shots, one shot after the other, thinned.

    shot: (n,) number of each instant's; times: (n,) [s] since first contact; sigma: (n,) of the noise, finer: (n,) what
    a still finer mesh would add, as shares of the peak; grown: (n,) growth in time; parts: of each shot, its error and
    the instants that are kept.
    """

    shot: NDArray[np.int64]
    times: Array
    sigma: Array
    finer: Array
    grown: Array
    parts: tuple[tuple[SensorError, NDArray[np.int64]], ...]

    @classmethod
    def of(cls, known: Sequence[tuple[int, SensorError]]) -> Records:
        """Of numbered shots."""
        most = LEARNT_INSTANTS // max(len(known), 1)
        parts = tuple((error, _thinned(len(error.times), most)) for _, error in known)
        shot = np.repeat([i for i, _ in known], [len(kept) for _, kept in parts]).astype(np.int64)
        empty = np.zeros(0)
        times = np.concatenate([empty, *(error.times[kept] for error, kept in parts)])
        sigma = np.concatenate([empty, *(error.sigma[kept] / error.peak for error, kept in parts)])
        finer = np.concatenate([empty, *(error.finer_at(kept) / error.peak for error, kept in parts)])
        grown = np.concatenate([empty, *(error.grown(error.times[kept]) for error, kept in parts)])
        return cls(shot, times, sigma, finer, grown, parts)

    def left(self, label: str, rows: NDArray[np.int64]) -> Array:
        """(rows, n) as shares of the peaks."""
        own = [error.left(label, rows)[:, kept] / error.peak for error, kept in self.parts]
        return np.hstack([np.zeros((len(rows), 0)), *own])


def _conditioned(
    a: float, b: float, records: Records, shape: SensorError | None, times: Array, finer: Array, where: Distance
) -> tuple[Array, Array, Array]:
    """Gain (m, n) on the records' residuals, covariance (m, m), and (m,) one standard deviation of the mesh's error."""
    length = UNSEEN * float(times[-1] - times[0]) if shape is None else shape.length
    size = np.ones(len(times)) if shape is None else shape.grown(times)
    wide = (a * a + b * b) * started(times, times, 0.0, length) * size[:, None] * size
    t, grown, shot = records.times, records.grown, records.shot
    rho = where.correlations[shot]
    if not len(t) or rho.max() < UNRELATED:
        return np.zeros((len(times), len(t))), where.growth**2 * wide, finer
    there = started(t, t, 0.0, length) * grown[:, None] * grown
    share = a * a * where.between[np.ix_(shot, shot)] + b * b * (shot[:, None] == shot)
    across = a * a * started(times, t, 0.0, length) * size[:, None] * grown * rho
    C = share * there + np.diag(records.sigma**2 + 1e-10)
    gain, pull = np.linalg.solve(C, across.T).T, np.linalg.solve(C, records.finer)
    moved, v = finer - gain @ records.finer, 1.0 / (1.0 + records.finer @ pull)
    return gain + np.outer(moved, v * pull), where.growth**2 * (wide - gain @ across.T), np.sqrt(v) * moved
