"""Moments of the smoothing kernel, in the continuum and on the lattices that birds are made of."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from birdstrike.solver.bird.shape import lattice
from birdstrike.solver.kernels.bird.smoothing import slope, slope_constant, wendland


def test_kernel_integrates_to_one():
    volume, _ = quad(lambda q: 4.0 * np.pi * q**2 * wendland(q, 1.0), 0.0, 2.0)
    assert volume == pytest.approx(1.0, rel=1e-10)


def test_slope_is_the_derivative_of_the_kernel():
    h, r, step = 0.7, 0.9, 1e-6
    numeric = (wendland((r + step) / h, h) - wendland((r - step) / h, h)) / (2.0 * step) / r
    assert slope(r / h, slope_constant(h)) == pytest.approx(numeric, rel=1e-8)


def test_kernel_and_slope_end_at_two_smoothing_lengths():
    assert wendland(2.0, 1.0) == 0.0
    assert slope(2.5, slope_constant(1.0)) == 0.0


@pytest.mark.parametrize("kind", ["cubic", "fcc"])
def test_lattice_sums_reproduce_the_moments(kind):
    """Sum of W V is 1 and of -r grad W V the identity: within 2.5 % at h = 1.2 spacings; the odd moments vanish."""
    h = 1.2
    points = lattice(1.0, kind, np.full(3, 4.0))
    r = np.linalg.norm(points, axis=1)
    weights = np.array([wendland(d / h, h) for d in r])
    slopes = np.array([slope(d / h, slope_constant(h)) for d in r])
    assert weights.sum() == pytest.approx(1.0, abs=0.025)
    assert np.abs(weights @ points).max() < 1e-12
    second = -np.einsum("a,ai,aj->ij", slopes, points, points)
    assert np.allclose(second, np.eye(3), atol=0.025)
