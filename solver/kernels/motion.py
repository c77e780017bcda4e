"""Kick and drift of particles and nodes."""

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


@njit(cache=True, parallel=True)
def kick_and_drift_nodes(kick, drift, nodal, applied, mass, inertia, fixed, fixed_rotation, v, omega, x):
    """Nodes under internal (m, 6) and applied (m, 3) forces; held freedoms stay where they are."""
    for p in prange(v.shape[0]):
        for c in range(3):
            if not fixed[p]:
                v[p, c] += kick * (nodal[p, c] + applied[p, c]) / mass[p]
                x[p, c] += drift * v[p, c]
            if not fixed_rotation[p]:
                omega[p, c] += kick * nodal[p, 3 + c] / inertia[p]


@njit(cache=True)
def force_on_frame(nodal, applied, fixed, result):
    """What the held nodes pass on to the frame, (3,) [N], summed in node order."""
    result[:] = 0.0
    for p in range(fixed.shape[0]):
        if fixed[p]:
            for c in range(3):
                result[c] += nodal[p, c] + applied[p, c]
