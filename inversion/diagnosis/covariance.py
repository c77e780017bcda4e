"""Whitening by the whole covariance of the miss: measurement noise, numerical error, the emulator's own error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Whitener:
    """W with W Sigma W^T = I on the points that `used` (n,) selects, in their order."""

    used: np.ndarray
    inverse: Array

    @classmethod
    def of(cls, covariance: Array, used: np.ndarray | None = None) -> Whitener:
        """From Sigma (n, n); raises numpy's LinAlgError when it is not positive definite."""
        kept = np.ones(len(covariance), dtype=bool) if used is None else used
        part = covariance[np.ix_(kept, kept)]
        lower = cholesky(part, lower=True)
        return cls(kept, solve_triangular(lower, np.eye(len(part)), lower=True))

    def apply(self, rows: Array) -> Array:
        """W x for every row x of rows (..., n): (..., used)."""
        return rows[..., self.used] @ self.inverse.T

    @property
    def log_determinant(self) -> float:
        """log |Sigma| of the points used."""
        return float(-2.0 * np.log(np.diag(self.inverse)).sum())
