"""Motion of shell nodes: kick, mass damping, held freedoms, drift; and what the frame feels of the held ones.

held (m,): a bit for each held freedom, displacements 1, 2, 4 along the node's own axes, rotations 8, 16, 32 about
them; axes (m, 3, 3): those axes as rows.
"""

from __future__ import annotations

from numba import njit, prange


@njit(cache=True, inline="always")
def stop_held(bits, axes, v):
    """Take the components along held axes off a vector (3,), in place; bits: 1, 2, 4."""
    for axis in range(3):
        if (bits >> axis) & 1:
            along = axes[axis, 0] * v[0] + axes[axis, 1] * v[1] + axes[axis, 2] * v[2]
            for c in range(3):
                v[c] -= along * axes[axis, c]


@njit(cache=True, parallel=True)
def kick_and_drift_nodes(kick, drift, damping, nodal, applied, mass, inertia, held, axes, v, omega, x):
    """Nodes under internal (m, 6) and applied (m, 3) forces, then new positions; held freedoms stay where they are.

    damping [1/s]: rate of decay of a free vibration's amplitude: the force -2 damping m v, with v the mean of the half
    steps before and after, so that no rate is unstable. A node without mass follows others (`kernels.target.links`).
    """
    keep, gain = 1.0 - damping * kick, 1.0 / (1.0 + damping * kick)
    for p in prange(v.shape[0]):
        if held[p] == 63 or mass[p] == 0.0:
            continue
        for c in range(3):
            v[p, c] = gain * (keep * v[p, c] + kick * (nodal[p, c] + applied[p, c]) / mass[p])
            omega[p, c] = gain * (keep * omega[p, c] + kick * nodal[p, 3 + c] / inertia[p])
        if held[p]:
            stop_held(held[p], axes[p], v[p])
            stop_held(held[p] >> 3, axes[p], omega[p])
        for c in range(3):
            x[p, c] += drift * v[p, c]


@njit(cache=True)
def damped_energy(kick, damping, mass, inertia, v_before, v, omega_before, omega, impulse):
    """Energy [J] that mass damping takes over a kick; its impulse on the surroundings is added to (3,) [N s]."""
    energy = 0.0
    for p in range(v.shape[0]):
        for c in range(3):
            mean, turn = 0.5 * (v_before[p, c] + v[p, c]), 0.5 * (omega_before[p, c] + omega[p, c])
            impulse[c] += 2.0 * damping * kick * mass[p] * mean
            energy += 2.0 * damping * kick * (mass[p] * mean * mean + inertia[p] * turn * turn)
    return energy


@njit(cache=True)
def force_on_frame(nodal, applied, held, axes, x, result):
    """What the held freedoms pass on to the frame, in node order: force [N] and moment about the origin [N m], (6,)."""
    result[:] = 0.0
    for p in range(held.shape[0]):
        if held[p] == 0:
            continue
        for axis in range(3):
            if (held[p] >> axis) & 1:
                a = axes[p, axis]
                along = 0.0
                for c in range(3):
                    along += (nodal[p, c] + applied[p, c]) * a[c]
                for c in range(3):
                    d, e = (c + 1) % 3, (c + 2) % 3
                    result[c] += along * a[c]
                    result[3 + c] += along * (x[p, d] * a[e] - x[p, e] * a[d])
            if (held[p] >> (3 + axis)) & 1:
                a = axes[p, axis]
                about = nodal[p, 3] * a[0] + nodal[p, 4] * a[1] + nodal[p, 5] * a[2]
                for c in range(3):
                    result[3 + c] += about * a[c]
