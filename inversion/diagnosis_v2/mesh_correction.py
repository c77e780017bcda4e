"""Mesh correction: what a fine mesh adds to the coarse campaign's curves, learnt at points of the campaign.

Autoregressive co-kriging of two fidelities with factor 1 (Kennedy & O'Hagan, Biometrika 87 (2000) 1): fine = coarse +
m(theta). m is linear in the parameters where that predicts left-out points better than its mean does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data.histories import Array

EXTRAPOLATED = 1.0 / 3.0
"""Of the mean correction from spacing h to h/2: what is left to spacing 0 for a scheme of second order (Richardson,
Phil. Trans. A 210 (1911) 307); of first order it is 1. One standard deviation of one direction."""


@dataclass(frozen=True)
class MeshCorrection:
    """m(z) = coefficients^T (1, z - 1/2), on the stacked grid.

    coefficients: (1 + k, grid) SI; errors: (n, grid) leave-one-out errors of the points, which are draws of the error.
    """

    coefficients: Array
    errors: Array

    @classmethod
    def none(cls, parameters: int, grid: int) -> MeshCorrection:
        """No correction."""
        return cls(np.zeros((1 + parameters, grid)), np.zeros((0, grid)))

    @classmethod
    def fit(cls, z: Array, differences: Array) -> MeshCorrection:
        """From differences (n, grid), fine less coarse, at fractions z (n, k) of the ranges."""
        linear, constant = _basis(z), np.ones((len(z), 1))
        errors = [_left_out(basis, differences) for basis in (linear, constant)]
        coefficients = np.zeros((linear.shape[1], differences.shape[1]))
        if (errors[0] ** 2).sum() < (errors[1] ** 2).sum():
            coefficients[:] = np.linalg.lstsq(linear, differences, rcond=None)[0]
            return cls(coefficients, errors[0])
        coefficients[0] = differences.mean(axis=0)
        return cls(coefficients, errors[1])

    def at(self, z: Array) -> Array:
        """(q, grid) at z (q, k)."""
        return _basis(z) @ self.coefficients

    @property
    def extrapolation(self) -> Array:
        """(grid,) one standard deviation of what a still finer mesh would add."""
        return EXTRAPOLATED * self.coefficients[0]


def _basis(z: Array) -> Array:
    return np.column_stack([np.ones(len(z)), z - 0.5])


def _left_out(basis: Array, values: Array) -> Array:
    """(n, grid) leave-one-out errors of a least-squares fit: residual / (1 - leverage)."""
    q, _ = np.linalg.qr(basis)
    leverage = (q**2).sum(axis=1)
    residuals = values - q @ (q.T @ values)
    return residuals / np.maximum(1.0 - leverage, 0.1)[:, None]
