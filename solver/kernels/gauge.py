"""What a pressure gauge feels: the normal contact force on its disc."""

from __future__ import annotations

import math

from numba import njit

from birdstrike.solver.kernels.contact.contact import bilinear


@njit(cache=True)
def force_on_disc(n, stiffness, nodes, quads, watched, active, facet, touch, foot, centre, radius, width):
    """Normal force [N] on a disc of the undeformed shell's surface, summed in particle order.

    touch (n,): where contact begins [m]; nodes: (m, 3) undeformed; centre: (3,) [m]; a particle's force is
    spread over its width [m]: from radius - width/2 to radius + width/2 its share falls from 1 to 0.
    """
    force = 0.0
    for a in range(n):
        if not (watched[a] and active[a]) or foot[a, 2] >= touch[a]:
            continue
        shape = bilinear(foot[a, 0], foot[a, 1])
        squared = 0.0
        for c in range(3):
            offset = -centre[c]
            for corner in range(4):
                offset += shape[corner] * nodes[quads[facet[a], corner], c]
            squared += offset * offset
        share = min(max((radius - math.sqrt(squared)) / width + 0.5, 0.0), 1.0)
        force += share * stiffness * (touch[a] - foot[a, 2])
    return force
