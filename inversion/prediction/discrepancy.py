"""What the model leaves of a sensor, in the new shot: a Gaussian process given the residual of the nearest learnt shot.

In units of the peaks, d = a s(t) w with w of unit variance, Matern 5/2 in time and 0 at contact, s >= 1 the growth in
time, a the amplitude (Kennedy & O'Hagan, J. R. Statist. Soc. B 63 (2001) 425). The part that shots of one rig share has
correlation rho between the learnt shot and the new one (`distance`); each shot has a part of its own besides (b). Given
the residual r with noise sigma,

    mean = rho K (K + K_own + sigma^2)^-1 r,   covariance = g^2 [K' + K'_own - rho^2 K (K + K_own + sigma^2)^-1 K^T],

g the growth outside what was learnt; a is at least what the residual shows beyond the noise. Near the data the new
shot errs as the old one did; far away it errs by as much as
nothing is known.
"""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.discrepancy import UNSEEN, remainder, started
from birdstrike.inversion.diagnosis.pipeline import UNKNOWN_SHARE
from birdstrike.inversion.prediction.distance import Distance
from birdstrike.inversion.prediction.learnt import Explanation, SensorError

INSTANTS = 100  # of the new record, and of the old one: linear between
LEVELS = 5  # of an amplitude that is drawn from a continuous distribution


def realisations(
    one: Explanation,
    rows: np.ndarray,
    error: SensorError | None,
    kind: str,
    times: Array,
    where: Distance,
    rng: np.random.Generator,
) -> Array:
    """(n, m) draws of the model's error as shares of the new peak, for stored rows (n,) of an explanation.

    error: of the sensor in the nearest learnt shot, None for a sensor that was not learnt; times: (m,) [s] since first
    contact.
    """
    shared = one.amplitude.get(kind, np.full(len(one.parameters), UNKNOWN_SHARE))[rows]
    own = one.own.get(kind, np.full(len(one.parameters), remainder(kind)))[rows]
    if error is not None and one.label in error.residual:
        shared = np.maximum(shared, np.sqrt(np.maximum(error.excess(one.label) - own**2, 0.0)))
    thin = times[np.unique(np.linspace(0, len(times) - 1, min(INSTANTS, len(times))).round().astype(int))]
    found = np.zeros((len(rows), len(times)))
    for a, b, of in _levels(shared, own):
        mean, covariance = _conditioned(a, b, one.label, error, thin, times, where)
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = mean + rng.standard_normal((len(of), len(thin))) @ root.T
        found[of] = np.array([np.interp(times, thin, row) for row in draws])
    return found


def _levels(shared: Array, own: Array) -> list[tuple[float, float, np.ndarray]]:
    """Amplitudes and the draws that have them; many different ones are gathered in a few."""
    pairs = np.stack([shared, own], axis=1)
    values, of = np.unique(pairs, axis=0, return_inverse=True)
    if len(values) > 3 * LEVELS:
        order = np.argsort(shared + own)
        parts = np.array_split(order, LEVELS)
        return [(float(shared[p].mean()), float(own[p].mean()), p) for p in parts if len(p)]
    return [(float(a), float(b), np.flatnonzero(of.ravel() == i)) for i, (a, b) in enumerate(values)]


def _conditioned(
    a: float, b: float, label: str, error: SensorError | None, thin: Array, times: Array, where: Distance
) -> tuple[Array, Array]:
    """Mean and covariance at the thinned instants, shares of the new peak."""
    length = UNSEEN * float(times[-1] - times[0]) if error is None else error.length
    size = np.ones(len(thin)) if error is None else error.grown(thin)
    prior = started(thin, thin, 0.0, length) * size[:, None] * size
    wide = (a * a + b * b) * prior
    if error is None or where.correlation < 1e-3 or label not in error.residual:
        return np.zeros(len(thin)), where.growth**2 * wide
    kept = np.unique(np.linspace(0, len(error.times) - 1, min(INSTANTS, len(error.times))).round().astype(int))
    t, r, sigma = error.times[kept], error.residual[label][kept] / error.peak, error.sigma[kept] / error.peak
    grown = error.grown(t)
    there = started(t, t, 0.0, length) * grown[:, None] * grown
    across = where.correlation * a * a * started(thin, t, 0.0, length) * size[:, None] * grown
    whole = (a * a + b * b) * there + np.diag(sigma**2 + 1e-10)
    gain = np.linalg.solve(whole, across.T).T
    return gain @ r, where.growth**2 * (wide - gain @ across.T)
