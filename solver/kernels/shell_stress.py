"""Stress through the shell's thickness: plane-stress layers, elastic transverse shear, and their resultants."""

from __future__ import annotations

from numba import njit, prange

from birdstrike.solver.kernels.plasticity import return_to_yield
from birdstrike.solver.kernels.shell import SHEAR_FACTOR


@njit(cache=True, parallel=True)
def update_shell_stress(strain, area, alive, section, metal, stress, back, eps_p, resultant, work):
    """Stress of every layer after the strain increments, the resultants, and the work of the step.

    strain: (e, 8) increments; area: (e,) [m^2]; section: (layers + 1, 2), heights z [m] and weights [m] of the layers,
    last row thickness; metal: (E [Pa], nu), (yield stress, isotropic and kinematic modulus [Pa]), (C times the step,
    1/P), failure strain; in and out: stress, back (e, layers, 3) [Pa], eps_p (e, layers), resultant (e, 8);
    out: work (e,) [J]. A layer that reaches the failure strain carries nothing from then on, and takes its share of
    the transverse shear with it.
    """
    elastic, hardening, rate, failure_strain = metal
    young, nu = elastic
    plane = young / (1.0 - nu * nu)
    shear = young / (2.0 * (1.0 + nu))
    layers = section.shape[0] - 1
    transverse = SHEAR_FACTOR * shear
    for e in prange(strain.shape[0]):
        work[e] = 0.0
        if not alive[e]:
            continue
        d, r = strain[e], resultant[e]
        before = 0.0
        for i in range(8):
            before += r[i] * d[i]
        n1 = n2 = n3 = m1 = m2 = m3 = 0.0
        whole = lost = 0.0
        for k in range(layers):
            z, weight = section[k, 0], section[k, 1]
            if eps_p[e, k] >= failure_strain:
                continue
            whole += weight
            dx, dy, dxy = d[0] + z * d[3], d[1] + z * d[4], d[2] + z * d[5]
            s = stress[e, k]
            s[0] += plane * (dx + nu * dy)
            s[1] += plane * (dy + nu * dx)
            s[2] += shear * dxy
            eps_p[e, k] = return_to_yield(s, back[e, k], eps_p[e, k], elastic, hardening, rate)
            if eps_p[e, k] >= failure_strain:
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
        r[6] = remaining * (r[6] + transverse * whole * d[6])
        r[7] = remaining * (r[7] + transverse * whole * d[7])
        after = 0.0
        for i in range(8):
            after += r[i] * d[i]
        work[e] = 0.5 * area[e] * (before + after)
