"""Hourglass control of the one-point hexahedra: dampers or springs on the four modes that a uniform gradient misses.

D. P. Flanagan & T. Belytschko, Int. J. Numer. Meth. Eng. 17 (1981) 679, sections 4 and 5. hourglass Q and its rate:
(e, 3, 4), direction by mode; the vectors gamma of the modes have length 1.
"""

from __future__ import annotations

from numba import njit, prange

from birdstrike.solver.kernels.bird.hexahedra_stress import squared_size


@njit(cache=True, parallel=True)
def viscous_hourglass(alive, going, dt, coefficient, hourglass_rate, mass, volume, c, hourglass, work):
    """Dampers Q = 2 coefficient rho V^(2/3) c rate [N], the form of LS-DYNA's types 1 to 3; work [J]."""
    for e in prange(alive.shape[0]):
        work[e] = 0.0
        if not (alive[e] or going[e]):
            continue
        damping = 0.0
        if alive[e]:
            damping = 2.0 * coefficient * mass[e] / volume[e] ** (1.0 / 3.0) * c[e]
        for i in range(3):
            for a in range(4):
                before = hourglass[e, i, a]
                hourglass[e, i, a] = damping * hourglass_rate[e, i, a]
                work[e] += 0.5 * dt * (before + hourglass[e, i, a]) * hourglass_rate[e, i, a]


@njit(cache=True, parallel=True)
def elastic_hourglass(alive, going, dt, coefficient, modulus, rate, hourglass_rate, volume, gradient, hourglass, work):
    """Springs whose force turns with the element: dQ/dt = w x Q + k rate, k = coefficient modulus |B|^2/V [N/m].

    modulus [Pa]: M |B|^2/V is the element's own largest stiffness for M = rho c^2. Work [J].
    """
    for e in prange(alive.shape[0]):
        work[e] = 0.0
        if not (alive[e] or going[e]):
            continue
        q = hourglass[e]
        spring = coefficient * modulus * squared_size(gradient[e]) / volume[e]
        for a in range(4):
            power = 0.0
            for i in range(3):
                power += q[i, a] * hourglass_rate[e, i, a]
            if alive[e]:
                turn(
                    q,
                    a,
                    0.5 * dt * (rate[e, 7] - rate[e, 5]),
                    0.5 * dt * (rate[e, 2] - rate[e, 6]),
                    0.5 * dt * (rate[e, 3] - rate[e, 1]),
                )
            for i in range(3):
                q[i, a] = q[i, a] + dt * spring * hourglass_rate[e, i, a] if alive[e] else 0.0
                power += q[i, a] * hourglass_rate[e, i, a]
            work[e] += 0.5 * dt * power


@njit(cache=True)
def turn(q, a, x, y, z):
    """Rotate column a of q by the rotation vector (x, y, z), through the exact rotation of Hughes & Winget."""
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    f = 2.0 / (1.0 + x * x + y * y + z * z)
    q0, q1, q2 = q[0, a], q[1, a], q[2, a]
    c0, c1, c2 = y * q2 - z * q1, z * q0 - x * q2, x * q1 - y * q0
    q[0, a] = q0 + f * (c0 + y * c2 - z * c1)
    q[1, a] = q1 + f * (c1 + z * c0 - x * c2)
    q[2, a] = q2 + f * (c2 + x * c1 - y * c0)
