"""What of a run's curves no component predicts, as a covariance over time and channels, from leave-one-out curves.

A few dozen curves of a few hundred instants cannot give a covariance by themselves: theirs is shrunk towards one whose
correlation depends on the lag alone, none between channels, each instant keeping its own variance. Intensity of the
shrinkage: Schaefer and Strimmer, Stat. Appl. Genet. Mol. Biol. 4 (2005) 32; structured target: Ledoit and Wolf,
J. Empirical Finance 10 (2003) 603.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, toeplitz

from birdstrike.data.histories import Array

KEPT = 0.999  # of the variance, carried by common directions; the rest counts instant by instant


def shrunk_correlation(rows: Array, target: Array | None = None) -> Array:
    """(p, p) correlation of draws rows (n, p) about zero, shrunk towards the correlation `target`.

    The target is the identity by default. A column without any variance has no correlation but the target's.
    """
    n, p = rows.shape
    size = np.sqrt((rows**2).mean(axis=0))
    z = np.divide(rows, size, out=np.zeros_like(rows), where=size > 0.0)
    sample = z.T @ z / n
    wanted = np.eye(p) if target is None else target
    others = ~np.eye(p, dtype=bool)
    variance = ((z**2).T @ z**2 / n - sample**2) / (n - 1)
    away = float(((sample - wanted)[others] ** 2).sum())
    shrinkage = min(1.0, float(variance[others].sum()) / away) if away > 0.0 else 1.0
    mixed = shrinkage * wanted + (1.0 - shrinkage) * sample
    np.fill_diagonal(mixed, 1.0)
    return mixed


def common_factors(curves: Sequence[Array], share: float = KEPT) -> list[Array]:
    """Of every channel's leave-one-out curves (n, m), rows (r, m), r the same for all: their sum of squares over r is
    the variance, of which they carry `share`; what channels and instants have in common stands in the same row."""
    widths = [part.shape[1] for part in curves]
    rows = np.hstack(curves)
    target = np.asarray(block_diag(*(_stationary(part) for part in curves)))
    size = np.sqrt((rows**2).mean(axis=0))
    values, vectors = np.linalg.eigh(shrunk_correlation(rows, target))
    order = np.argsort(values)[::-1]
    kept = order[: int(np.searchsorted(np.cumsum(values[order]), share * values.sum())) + 1]
    factors = (vectors[:, kept] * np.sqrt(np.maximum(values[kept], 0.0))).T * size
    return np.split(factors, np.cumsum(widths)[:-1], axis=1)


def factors_between(times: Sequence[Array], curves: Sequence[Array], instants: int) -> list[Array]:
    """`common_factors` of curves (n, m) on their `times` (m,), found at so many instants of each, linear between."""
    places = [np.unique(np.linspace(0, len(t) - 1, instants).round().astype(int)) for t in times]
    factors = common_factors([part[:, i] for part, i in zip(curves, places, strict=True)])
    return [
        np.stack([np.interp(t, t[i], row) for row in factor])
        for t, i, factor in zip(times, places, factors, strict=True)
    ]


def _stationary(rows: Array) -> Array:
    """(m, m) correlation that depends on the lag alone: mean of the draws' products at each lag, tapered (Bartlett) and
    without negative eigenvalues."""
    m = rows.shape[1]
    size = np.sqrt((rows**2).mean(axis=0))
    z = np.divide(rows, size, out=np.zeros_like(rows), where=size > 0.0)
    sample = z.T @ z / len(z)
    lags = np.array([np.diagonal(sample, lag).mean() for lag in range(m)]) * (1.0 - np.arange(m) / m)
    if not lags[0] > 0.0:
        return np.eye(m)
    values, vectors = np.linalg.eigh(toeplitz(lags / lags[0]))
    matrix = (vectors * np.maximum(values, 0.0)) @ vectors.T
    scale = np.sqrt(np.diag(matrix))
    return matrix / scale[:, None] / scale
