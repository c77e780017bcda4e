"""What can be said of a case before it is run: mass, step, cost, and the plate's first period."""

from __future__ import annotations

import math

from birdstrike.solver.case.case import Case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.modes import natural_frequencies

# Measured on one core with everything compiled: 4500 particles, 2000 shells; per step of each. [s]
PER_PARTICLE_STEP, PER_SHELL_STEP = 0.95e-6, 0.35e-6
# G and H = J of Warburton's first mode, by edges.
FIRST_MODE = {"clamped": (1.506, 1.248), "pinned": (1.0, 1.0)}


def first_period(case: Case) -> float | None:
    """First natural period [s] of a case's thin flat plate without preload; None for what the formula does not know.

    G. B. Warburton, Proc. I. Mech. E. 168 (1954) 371: within 1 % of Ritz for clamped edges.
    """
    plate = case.plate
    if case.target is not None:
        return None
    if plate.rigid or not isinstance(plate.edges, str) or plate.edges not in FIRST_MODE or plate.radius is not None:
        return None
    if any(plate.preload):
        return None
    g, h = FIRST_MODE[plate.edges]
    ratio = (plate.length / plate.width) ** 2
    m = plate.material
    rigidity = m.young * plate.thickness**3 / (12.0 * (1.0 - m.poisson**2))
    factor = g**4 * (1.0 + ratio**2) + 2.0 * ratio * h**2
    omega = math.pi**2 / plate.length**2 * math.sqrt(rigidity / (m.density * plate.thickness) * factor)
    return 2.0 * math.pi / omega


def period_of_shells(plate: Target) -> float | None:
    """First natural period [s] of the meshed plate, motions as a whole left out; None where nothing holds it, or
    nothing strains."""
    if not plate.strains or plate.supports.free:
        return None
    found = natural_frequencies(plate, 8)[0]
    return 1.0 / float(found[found > 1e-3 * found[-1]][0])


def estimate(case: Case) -> dict[str, float | None]:
    """Facts derived from a case without running it, SI: what `birdstrike check` prints."""
    coupling = Coupling(case)
    particles, shells = int(coupling.bird.facts()["particles"]), len(coupling.plate.quads)
    step_s = PER_PARTICLE_STEP * particles / coupling.stride + PER_SHELL_STEP * shells
    return {
        "mass": case.bird.actual_mass,
        "normal_speed": case.normal_speed,
        "first_contact": None if coupling.first_touch_off_plate else case.first_contact,
        "first_period": first_period(case) or period_of_shells(coupling.plate),
        "stable_step": coupling.dt,
        "steps": coupling.steps,
        "particles": particles,
        "shells": shells,
        "estimated_wall_s": coupling.steps * step_s,
    }
