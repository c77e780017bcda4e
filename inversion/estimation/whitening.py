"""Residuals in units of their own uncertainty: noise of each point plus an emulator error common to many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Whitening:
    """W with W Sigma W^T = I for Sigma = diag(noise^2) + F F^T.

    noise: (n,) standard deviations; directions: (n, c) orthonormal, shrink: (c,), from the singular values s of
    diag(1/noise) F: W = (I - Q diag(1 - 1/sqrt(1 + s^2)) Q^T) diag(1/noise). No n x n matrix is ever formed.
    """

    noise: Array
    directions: Array
    shrink: Array
    log_determinant: float

    @classmethod
    def of(cls, noise: Array, factor: Array) -> Whitening:
        """From noise (n,) and factor F (n, c)."""
        directions, s, _ = np.linalg.svd(factor / noise[:, None], full_matrices=False)
        log_determinant = float(np.log1p(s * s).sum() + 2.0 * np.log(noise).sum())
        return cls(noise, directions, 1.0 - 1.0 / np.sqrt(1.0 + s * s), log_determinant)

    def apply(self, rows: Array) -> Array:
        """W x for every row x of rows (..., n)."""
        scaled = rows / self.noise
        return scaled - ((scaled @ self.directions) * self.shrink) @ self.directions.T
