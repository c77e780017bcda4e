"""Kick and drift of particles."""

from __future__ import annotations

from numba import njit, prange


@njit(cache=True, parallel=True)
def kick_particles(n, dt, acceleration, v, lag):
    """v += dt a for n particles, at the start of a step: its mean velocity is v, lag (n, 3) [m/s] is none."""
    for a in prange(n):
        for c in range(3):
            v[a, c] += dt * acceleration[a, c]
            lag[a, c] = 0.0


@njit(cache=True, parallel=True)
def push_particles(n, dt, past, mass, force, v, lag):
    """Kick by outer forces (n, 3) [N] on masses (n,) [kg] when the share `past` of the particles' step is over.

    That share of the step ran without the kick, so v exceeds the step's mean by as much: lag (n, 3) [m/s].
    """
    for a in prange(n):
        for c in range(3):
            if force[a, c] != 0.0:
                kick = dt * force[a, c] / mass[a]
                v[a, c] += kick
                lag[a, c] += past * kick


@njit(cache=True, parallel=True)
def predict_push(n, half, mass, force, push):
    """What forces (n, 3) [N] on masses (n,) [kg] add to velocities in half [s], into push (n, 3) [m/s]."""
    for a in prange(n):
        for c in range(3):
            push[a, c] = half * force[a, c] / mass[a]


@njit(cache=True, parallel=True)
def drift_particles(n, dt, v, x):
    """x += dt v for n particles."""
    for a in prange(n):
        for c in range(3):
            x[a, c] += dt * v[a, c]
