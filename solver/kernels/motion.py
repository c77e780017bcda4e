"""Kick and drift of particles."""

from __future__ import annotations

from numba import njit, prange


@njit(cache=True, parallel=True)
def add_contact(n, mass, on_bird, acceleration):
    """Contact forces (n, 3) [N] on masses (n,) [kg] join the accelerations [m/s^2]."""
    for a in prange(n):
        for c in range(3):
            acceleration[a, c] += on_bird[a, c] / mass[a]


@njit(cache=True, parallel=True)
def kick_and_drift_particles(n, kick, drift, acceleration, v, x):
    """v += kick a, then x += drift v."""
    for a in prange(n):
        for c in range(3):
            v[a, c] += kick * acceleration[a, c]
            x[a, c] += drift * v[a, c]
