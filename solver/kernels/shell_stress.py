"""Stress through the shell's thickness: plane-stress layers, elastic transverse shear, and their resultants."""

from __future__ import annotations

from numba import njit, prange

from birdstrike.solver.kernels.metal import POISSON, YOUNG
from birdstrike.solver.kernels.plasticity import return_to_yield
from birdstrike.solver.kernels.shell import SHEAR_FACTOR


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
    for e in prange(strain.shape[0]):
        work[e] = 0.0
        if not alive[e]:
            continue
        d, r = strain[e], resultant[e]
        before = 0.0
        for i in range(8):
            before += r[i] * d[i]
        n1 = n2 = n3 = m1 = m2 = m3 = 0.0
        whole = lost = stiff = 0.0
        begin = first[section[e]]
        for k in range(first[section[e] + 1] - begin):
            if gone[e, k]:
                continue
            z, weight, row = height[begin + k, 0], height[begin + k, 1], law[begin + k]
            young, nu = row[YOUNG], row[POISSON]
            plane = young / (1.0 - nu * nu)
            shear = young / (2.0 * (1.0 + nu))
            stiff = SHEAR_FACTOR * shear
            whole += weight
            dx, dy, dxy = d[0] + z * d[3], d[1] + z * d[4], d[2] + z * d[5]
            s = stress[e, k]
            s[0] += plane * (dx + nu * dy)
            s[1] += plane * (dy + nu * dx)
            s[2] += shear * dxy
            if return_to_yield(s, back[e, k], memory[e, k], row, size[e], dt):
                gone[e, k] = True
                s[0] = s[1] = s[2] = 0.0
                lost += weight
            n1 += weight * s[0]
            n2 += weight * s[1]
            n3 += weight * s[2]
            m1 += weight * z * s[0]
            m2 += weight * z * s[1]
            m3 += weight * z * s[2]
        r[0], r[1], r[2], r[3], r[4], r[5] = n1, n2, n3, m1, m2, m3
        sound = whole - lost
        remaining = sound / whole if whole > 0.0 else 0.0
        r[6] = remaining * (r[6] + stiff * whole * d[6])
        r[7] = remaining * (r[7] + stiff * whole * d[7])
        after = 0.0
        for i in range(8):
            after += r[i] * d[i]
        work[e] = 0.5 * area[e] * (before + after)
