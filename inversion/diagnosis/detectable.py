"""How small an effect the data could still have shown: its minimum detectable magnitude at a stated power."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.linear import Linear
from birdstrike.inversion.diagnosis.statistics import Reference, squared

POWER = 0.8
DRAWS = 4000
FARTHEST = 40.0  # standard errors
ABSORBED = 0.9


def minimum_detectable(reference: Reference, alpha: float, seed: int = 1) -> Array:
    """(m,) magnitudes b at which the model without effects is rejected with 80 % power; NaN where none is."""
    linear = reference.linear
    draws = _draws(linear, seed)
    found = np.full(len(linear.names), np.nan)
    for j in map(int, np.flatnonzero(linear.seen)):
        found[j] = _distance(reference, draws, j, alpha) / linear.sizes[j]
    return found


def power(reference: Reference, j: int, distance: float, alpha: float, seed: int = 1) -> float:
    """Probability that the model is rejected when effect j acts with |P g_j b| = distance."""
    return _power(reference, _draws(reference.linear, seed), j, distance, alpha)


def absorbed(linear: Linear) -> Array:
    """(m,) share of each effect's signature that the free unknowns imitate, 1 - |P g| / |g|."""
    whole = np.linalg.norm(linear.effects, axis=0)
    return 1.0 - linear.sizes / np.where(whole > 0.0, whole, np.inf)


def _distance(reference: Reference, draws: tuple[Array, Array], j: int, alpha: float) -> float:
    def surplus(distance: float) -> float:
        return _power(reference, draws, j, distance, alpha) - POWER

    if surplus(FARTHEST) <= 0.0:
        return np.nan
    return float(brentq(surplus, 0.0, FARTHEST, xtol=0.02))  # pyright: ignore[reportArgumentType]


def _draws(linear: Linear, seed: int) -> tuple[Array, Array]:
    """Coordinates (draws, m-span) in the span of the signatures, and the squared length outside it."""
    rng = np.random.default_rng(seed)
    rank = np.linalg.matrix_rank(linear.signatures) if linear.seen.any() else 0
    outside = rng.chisquare(max(linear.freedom - rank, 1), DRAWS)
    return rng.standard_normal((DRAWS, int(rank))), outside


def _power(reference: Reference, draws: tuple[Array, Array], j: int, distance: float, alpha: float) -> float:
    linear, (inside, outside) = reference.linear, draws
    _, s, right = np.linalg.svd(linear.signatures, full_matrices=False)
    frame = (s[:, None] * right)[: inside.shape[1]]
    shifted = inside + distance * frame[:, j]
    omnibus = (shifted**2).sum(axis=1) + outside
    directed = squared(shifted @ frame, linear).max(axis=1)
    if reference.relative:
        directed = directed * linear.freedom / omnibus
    return float(np.mean(reference.p_of(directed, omnibus) < alpha))
