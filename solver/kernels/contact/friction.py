"""Coulomb friction of particles on the shell's surface, with the couple that it turns the shell by.

The friction acts on the particle, at the height D above its foot on the mid-surface. For the angular momentum the
shell gets, beside -F at the foot, the moment -D n x F. It is given as forces along n on the facet's corners,

    f_i = D (S^-1 F) . r_i,   S = sum r_i r_i^T,

r_i the corners from their mean, in the tangent plane: they sum to nothing and turn as they should. The slip is what
these forces work against, v - v_foot + D grad(v . n): the particle against the surface carried along at its height.
Hence the friction's power is -F . slip, never negative.
"""

from __future__ import annotations

import math

from numba import njit

from birdstrike.solver.kernels.contact.contact import bilinear

EDGE_ON = 1e-6  # of (trace of S)^2: a facet seen so nearly on edge carries no friction


@njit(cache=True, inline="always")
def tangents(foot, base):
    """Two unit vectors across the foot's normal n, base: (2, 3)."""
    nx, ny, nz = foot[3], foot[4], foot[5]
    if abs(nx) > 0.8:
        inverse = 1.0 / math.sqrt(nz * nz + nx * nx)
        base[0, 0], base[0, 1], base[0, 2] = nz * inverse, 0.0, -nx * inverse
    else:
        inverse = 1.0 / math.sqrt(ny * ny + nz * nz)
        base[0, 0], base[0, 1], base[0, 2] = 0.0, nz * inverse, -ny * inverse
    base[1, 0] = ny * base[0, 2] - nz * base[0, 1]
    base[1, 1] = nz * base[0, 0] - nx * base[0, 2]
    base[1, 2] = nx * base[0, 1] - ny * base[0, 0]


@njit(cache=True)
def slip_on_facet(v, nodes, node_v, quad, foot, base, corner, slip):
    """Slip (2,) [m/s] in the tangents `base`, and the corners' r_i in them, corner: (4, 2) [m]; returns S^-1.

    S^-1 is given by its three components [1/m^2], all 0 where the facet is seen on edge.
    """
    shape = bilinear(foot[0], foot[1])
    s11 = s12 = s22 = g1 = g2 = 0.0
    for i in range(4):
        for t in range(2):
            corner[i, t] = 0.0
            for c in range(3):
                mean = 0.25 * (nodes[quad[0], c] + nodes[quad[1], c] + nodes[quad[2], c] + nodes[quad[3], c])
                corner[i, t] += (nodes[quad[i], c] - mean) * base[t, c]
        rising = 0.0
        for c in range(3):
            rising += node_v[quad[i], c] * foot[3 + c]
        s11 += corner[i, 0] * corner[i, 0]
        s12 += corner[i, 0] * corner[i, 1]
        s22 += corner[i, 1] * corner[i, 1]
        g1 += corner[i, 0] * rising
        g2 += corner[i, 1] * rising
    det = s11 * s22 - s12 * s12
    if det <= EDGE_ON * (s11 + s22) ** 2:
        return 0.0, 0.0, 0.0
    i11, i12, i22 = s22 / det, -s12 / det, s11 / det
    slip[0] = foot[2] * (i11 * g1 + i12 * g2)
    slip[1] = foot[2] * (i12 * g1 + i22 * g2)
    for t in range(2):
        for c in range(3):
            carried = 0.0
            for i in range(4):
                carried += shape[i] * node_v[quad[i], c]
            slip[t] += (v[c] - carried) * base[t, c]
    return i11, i12, i22


@njit(cache=True)
def friction_forces(n, law, v, nodes, node_v, quads, watched, active, facet, touch, foot, room, rub_bird, rub_plate):
    """Add friction [N] to that on particles (n, 3) and on nodes (m, 3), summed in particle order.

    law: coefficient mu, contact stiffness [N/m], sticking resistance c [N s/m]: |F| = min(mu N, c |slip|), N the
    normal force; touch (n,): where contact begins [m]. v (N, 3), node_v (m, 3) [m/s]: half a step behind; room:
    (7, 2 or 3) scratch, tangents, corners, slip.
    """
    mu, stiffness, resistance = law
    base, corner, slip = room[0:2], room[2:6, :2], room[6, :2]
    for a in range(n):
        if not (watched[a] and active[a]) or foot[a, 2] >= touch[a]:
            continue
        quad = quads[facet[a]]
        tangents(foot[a], base)
        i11, i12, i22 = slip_on_facet(v[a], nodes, node_v, quad, foot[a], base, corner, slip)
        speed = math.sqrt(slip[0] ** 2 + slip[1] ** 2)
        if i11 == 0.0 or speed == 0.0:
            continue
        size = min(mu * stiffness * (touch[a] - foot[a, 2]) / speed, resistance)
        f1, f2 = -size * slip[0], -size * slip[1]
        g1, g2 = foot[a, 2] * (i11 * f1 + i12 * f2), foot[a, 2] * (i12 * f1 + i22 * f2)
        shape = bilinear(foot[a, 0], foot[a, 1])
        for c in range(3):
            force = f1 * base[0, c] + f2 * base[1, c]
            rub_bird[a, c] += force
            for i in range(4):
                turn = (g1 * corner[i, 0] + g2 * corner[i, 1]) * foot[a, 3 + c]
                rub_plate[quad[i], c] += turn - force * shape[i]
