"""Stress through the shell's thickness: plane-stress layers, elastic transverse shear, and their resultants."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from birdstrike.solver.kernels.metal import FLOW, POISSON, YOUNG
from birdstrike.solver.kernels.plasticity import return_to_yield, within_yield
from birdstrike.solver.kernels.shell import SHEAR_FACTOR


@njit(cache=True)
def moduli(law):
    """Of every layer (l,) from the rows of their laws: plane-stress E/(1 - nu^2) and shear modulus [Pa]."""
    plane, shear = np.empty(law.shape[0]), np.empty(law.shape[0])
    for layer in range(law.shape[0]):
        young, nu = law[layer, YOUNG], law[layer, POISSON]
        plane[layer] = young / (1.0 - nu * nu)
        shear[layer] = young / (2.0 * (1.0 + nu))
    return plane, shear


@njit(cache=True, parallel=True)
def update_shell_stress(strain, area, alive, sections, size, dt, layers, resultant, work):
    """Stress of every layer after the strain increments, the resultants, and the work of the step.

    strain: (e, 8) increments; area: (e,) [m^2]; sections: of each element (e,), first layer of each (s + 1,), heights
    and weights of the layers (l, 2) [m], rows of their laws (l, ROW); size: (e,) [m]; dt [s]; layers: stress, back
    (e, k, 3) [Pa], memory (e, k, MEMORY), gone (e, k), in and out; resultant (e, 8); out: work (e,) [J].
    A layer that fails carries nothing from then on, and takes its share of the transverse shear with it.
    """
    section, first, height, law = sections
    stress, back, memory, gone = layers
    plane, shear = moduli(law)
    for e in prange(strain.shape[0]):
        work[e] = 0.0
        if not alive[e]:
            continue
        before = 0.0
        for i in range(8):
            before += resultant[e, i] * strain[e, i]
        d0, d1, d2, d3, d4, d5 = strain[e, 0], strain[e, 1], strain[e, 2], strain[e, 3], strain[e, 4], strain[e, 5]
        n1 = n2 = n3 = m1 = m2 = m3 = 0.0
        whole = lost = stiff = 0.0
        begin = first[section[e]]
        for k in range(np.uint64(first[section[e] + 1] - begin)):
            if gone[e, k]:
                continue
            layer = begin + k
            z, weight, nu = height[layer, 0], height[layer, 1], law[layer, POISSON]
            stiff = SHEAR_FACTOR * shear[layer]
            whole += weight
            dx, dy, dxy = d0 + z * d3, d1 + z * d4, d2 + z * d5
            xx = stress[e, k, 0] + plane[layer] * (dx + nu * dy)
            yy = stress[e, k, 1] + plane[layer] * (dy + nu * dx)
            xy = stress[e, k, 2] + shear[layer] * dxy
            stress[e, k, 0], stress[e, k, 1], stress[e, k, 2] = xx, yy, xy
            xi_x, xi_y, xi_xy = xx - back[e, k, 0], yy - back[e, k, 1], xy - back[e, k, 2]
            if not within_yield(xi_x, xi_y, xi_xy, memory[e, k, FLOW]):  # a call costs more than an elastic layer
                if return_to_yield(stress[e, k], back[e, k], memory[e, k], law[layer], size[e], dt):
                    gone[e, k] = True
                    stress[e, k, 0] = stress[e, k, 1] = stress[e, k, 2] = 0.0
                    lost += weight
                xx, yy, xy = stress[e, k, 0], stress[e, k, 1], stress[e, k, 2]
            n1 += weight * xx
            n2 += weight * yy
            n3 += weight * xy
            m1 += weight * z * xx
            m2 += weight * z * yy
            m3 += weight * z * xy
        r = resultant[e]
        r[0], r[1], r[2], r[3], r[4], r[5] = n1, n2, n3, m1, m2, m3
        sound = whole - lost
        remaining = sound / whole if whole > 0.0 else 0.0
        r[6] = remaining * (r[6] + stiff * whole * strain[e, 6])
        r[7] = remaining * (r[7] + stiff * whole * strain[e, 7])
        after = 0.0
        for i in range(8):
            after += r[i] * strain[e, i]
        work[e] = 0.5 * area[e] * (before + after)
