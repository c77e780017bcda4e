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
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array

KEPT = 0.999  # of the variance, carried by common directions; the rest counts instant by instant


def left_out(curves: Array, predicted: int) -> Array:
    """(n, m) what each of the curves (n, m), left out, has beyond the others' mean and first `predicted` components.

    A run's scatter has as many directions as the curve has instants, its components only as many as there are other
    runs, and these were chosen to hold those runs: what is left is larger than the runs' own components show.
    """
    left = np.zeros_like(curves)
    with threadpool_limits(limits=1, user_api="blas"):
        for i in range(len(curves)):
            others = np.delete(curves, i, axis=0)
            mean = others.mean(axis=0)
            components = _components(others - mean)[:predicted]
            left[i] = curves[i] - mean - (components @ (curves[i] - mean)) @ components
    return left


def _components(rows: Array) -> Array:
    """Right singular vectors (c, m) of rows (n, m), the largest first, by the Gram matrix."""
    squares, vectors = np.linalg.eigh(rows @ rows.T)
    kept = np.flatnonzero(squares > 1e-12 * max(squares[-1], 1e-300))[::-1]
    return vectors[:, kept].T @ rows / np.sqrt(squares[kept])[:, None]


def shrunk_correlation(rows: Array, target: Array | None = None) -> Array:
    """(p, p) correlation of draws rows (n, p) about zero, shrunk towards the correlation `target`.

    The target is the identity by default. A column without any variance stays uncorrelated.
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


def common_factors(curves: Sequence[Array]) -> list[Array]:
    """Of every channel's leave-one-out curves (n, m), rows (r, m), r the same for all: their sum of squares over r is
    the variance, and what channels and instants have in common stands in the same row."""
    widths = [part.shape[1] for part in curves]
    rows = np.hstack(curves)
    target = np.asarray(block_diag(*(_stationary(part) for part in curves)))
    size = np.sqrt((rows**2).mean(axis=0))
    values, vectors = np.linalg.eigh(shrunk_correlation(rows, target))
    order = np.argsort(values)[::-1]
    kept = order[: int(np.searchsorted(np.cumsum(values[order]), KEPT * values.sum())) + 1]
    factors = (vectors[:, kept] * np.sqrt(np.maximum(values[kept], 0.0))).T * size
    return np.split(factors, np.cumsum(widths)[:-1], axis=1)


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
