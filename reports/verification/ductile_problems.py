"""Ductile plates: a steady rate against its closed form, impulsively loaded plates against published deflections."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reports.verification.plate_problems import Compared, centre_of
from solver.kernels.plasticity import return_to_yield
from solver.plate import Plate
from solver.shell_material import ShellMaterial
from solver.shell_mesh import plate_mesh

MILD_STEEL = ShellMaterial(197e9, 0.3, 7830.0, 296e6, 0.0, 1.0, 40.4, 5.0)
RATELESS_STEEL = ShellMaterial(197e9, 0.3, 7830.0, 296e6)
SIDE, THICKNESS = 0.089, 0.0016  # m


@dataclass(frozen=True)
class Dent:
    """Permanent and largest deflection of the centre over the thickness."""

    permanent: float
    peak: float


def dented(material: ShellMaterial, number: float, elements: int = 16) -> Dent:
    """Clamped square plate, 89 x 89 x 1.6 mm, that gets a uniform velocity V at once.

    number: phi = V (side/2) sqrt(rho/sigma_0)/thickness, Nurick & Martin's. When the kinetic energy has fallen to 1 %,
    what is left is elastic vibration: mass damping (2e4 1/s, above the first mode's critical one) brings it to rest,
    and the deflection at rest is the permanent one.
    """
    plate = Plate(plate_mesh(SIDE, SIDE, (elements, elements)), THICKNESS, material)
    speed = 2.0 * number * THICKNESS / SIDE * np.sqrt(material.yield_stress / material.density)
    plate.v[~plate.fixed, 2] = -speed
    centre, still = centre_of(plate), np.zeros_like(plate.x)
    dt, at_first, peak = 0.9 * plate.stable_step(), plate.kinetic_energy(), 0.0
    left, step = int(4e-4 / dt), 0
    while left:
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, still)
        peak = max(peak, -float(plate.x[centre, 2]))
        if plate.damping > 0.0:
            left -= 1
        elif plate.kinetic_energy() < 0.01 * at_first:
            plate.damping = 2e4
        step += 1
    return Dent(-float(plate.x[centre, 2]) / THICKNESS, peak / THICKNESS)


def nurick_plate(number: float = 14.0, elements: int = 16) -> Compared:
    """Permanent deflection over thickness of a mild steel plate against the correlation of its experiments.

    0.471 phi + 0.001: G. N. Nurick & J. B. Martin, Int. J. Impact Engng 8 (1989) 171, quadrangular plates. Static
    yield stress, and mild steel's Cowper-Symonds constants 40.4 1/s and 5. Experiments scatter by one thickness.
    """
    return Compared(np.array([dented(MILD_STEEL, number, elements).permanent]), np.array([0.471 * number + 0.001]))


def jones_deflection(number: float, factor: float = 1.0) -> float:
    """Rigid-plastic deflection over thickness of a clamped square plate; N. Jones, Structural Impact (1989), chapter 7.

    w/H = sqrt(1 + lambda/6) - 1 with lambda = 4 phi^2: yield surface of N and M circumscribed as a square (factor 1) or
    inscribed (factor 0.618 on the yield stress). The two bracket the exact yield surface's answer.
    """
    return float(np.sqrt(1.0 + 4.0 * number**2 / (6.0 * factor)) - 1.0)


def jones_plate(number: float = 8.0, elements: int = 16) -> tuple[float, float, float]:
    """Permanent deflection over thickness without rate hardening, and Jones's lower and upper bracket."""
    found = dented(RATELESS_STEEL, number, elements).permanent
    return found, jones_deflection(number), jones_deflection(number, 0.618)


def shear_stress_at_rate(material: ShellMaterial, rate: float, dt: float, steps: int = 2000) -> Compared:
    """Stress [Pa] after a steady engineering shear rate [1/s] against (yield + K eps_p) factor/sqrt(3).

    In shear the whole rate is plastic once the stress stands (perfect plasticity), so that the plastic rate is
    rate/sqrt(3) and the factor 1 + (rate/(sqrt(3) C))^(1/P).
    """
    stress, back, eps_p = np.zeros(3), np.zeros(3), 0.0
    modulus = material.young / (2.0 * (1.0 + material.poisson))
    for _ in range(steps):
        stress[2] += modulus * rate * dt
        eps_p = return_to_yield(stress, back, eps_p, material.elastic, material.hardening, material.rate(dt))
    factor = 1.0
    if material.rate_c > 0.0:
        factor += (rate / (np.sqrt(3.0) * material.rate_c)) ** (1.0 / material.rate_p)
    return Compared(stress[2:], np.array([factor * material.yield_stress / np.sqrt(3.0)]))
