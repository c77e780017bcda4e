"""Springs between a shell's edge and its frame."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def edge_spring_forces(nodes, normal, stiffness, pull, v, omega, dt, displacement, force, nodal):
    """Spring forces on the rim after a step of dt [s], added to `nodal` (m, 6) [N, N m]; returns the energy taken [J].

    nodes (r,); normal (r, 3): of the shell at rest; stiffness (r, 3): in-plane [N/m], transverse [N/m], rotational
    [N m/rad] of each node; pull (r, 3): force at rest [N]; in and out: displacement (r, 6) [m, rad], force (r, 6).
    Force = pull - k_t n (n . u) - k_p (u - n (n . u)), moment = -k_r theta; the energy is trapezoidal in the force.
    """
    taken = 0.0
    for r in range(nodes.shape[0]):
        p = nodes[r]
        for c in range(3):
            displacement[r, c] += dt * v[p, c]
            displacement[r, 3 + c] += dt * omega[p, c]
        along = 0.0
        for c in range(3):
            along += normal[r, c] * displacement[r, c]
        for c in range(3):
            across = along * normal[r, c]
            new = pull[r, c] - stiffness[r, 1] * across - stiffness[r, 0] * (displacement[r, c] - across)
            moment = -stiffness[r, 2] * displacement[r, 3 + c]
            taken -= 0.5 * dt * ((force[r, c] + new) * v[p, c] + (force[r, 3 + c] + moment) * omega[p, c])
            force[r, c], force[r, 3 + c] = new, moment
            nodal[p, c] += new
            nodal[p, 3 + c] += moment
    return taken
