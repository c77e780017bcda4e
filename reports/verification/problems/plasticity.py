"""Plasticity of the plate: return mapping and rotation in closed form, rate dependence, plates under an impulse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.draw import Curve, Panel, draw, slope_line
from birdstrike.reports.verification.problem import (
    Computed,
    Picture,
    Problem,
    Row,
    Solution,
    below,
    matches,
    near,
    shown,
)
from birdstrike.reports.verification.problems.plate import Compared, centre_of
from birdstrike.reports.verification.problems.shell import spinning_shell
from birdstrike.solver.reference.plasticity import (
    biaxial_stress,
    cowper_symonds_shear_stress,
    jones_deflection,
    nurick_deflection,
    shear_stress,
)
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.point import Layer
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial

CLOSED = "closed form, linear hardening"
TIGHT = 1e-8  # %, that is 1e-10
YOUNG, NU, YIELD, TANGENT = 200e9, 0.3, 250e6, 2e9
MODULUS = YOUNG * TANGENT / (YOUNG - TANGENT)  # Ep
STEEL = (YOUNG, NU, YIELD, MODULUS)


def steel(beta: float) -> ShellMaterial:
    return ShellMaterial(YOUNG, NU, 7800.0, YIELD, TANGENT, beta)


def drive(material: ShellMaterial, direction: Array, steps: int, increment: float) -> tuple[Array, float]:
    """Stress (3,) [Pa] and plastic strain after `steps` equal elastic trial increments of strain along `direction`."""
    layer = Layer(material.row())
    for _ in range(steps):
        layer.strain(increment * direction)
    return layer.stress, layer.eps_p


def uniaxial(material: ShellMaterial, strain: float, steps: int) -> float:
    """Axial stress [Pa] with the lateral stress held at zero."""
    layer = Layer(material.row())
    for _ in range(steps):
        layer.pull(strain / steps)
    return float(layer.stress[0])


def solve_return(_: Computed) -> Solution:
    """Shear, equal biaxial and uniaxial tension, isotropic and kinematic hardening."""
    rows = []
    tension = YIELD + TANGENT * (0.02 - YIELD / YOUNG)
    for beta, kind in ((1.0, "isotropic"), (0.0, "kinematic")):
        shear, _eps_p = drive(steel(beta), np.array([0.0, 0.0, 1.0]), 50, 0.02 / 50)
        biaxial, _eps_p = drive(steel(beta), np.array([1.0, 1.0, 0.0]), 50, 0.01 / 50)
        for name, ours, truth in (
            ("pure shear", float(shear[2]), shear_stress(*STEEL, 0.02)),
            ("equal biaxial tension", float(biaxial[0]), biaxial_stress(*STEEL, 0.01)),
            ("uniaxial tension", uniaxial(steel(beta), 0.02, 100), tension),
        ):
            rows.append(matches(f"{name}, {kind}", 1e-6 * ours, 1e-6 * truth, "MPa", TIGHT, CLOSED))
    return Solution(tuple(rows))


STEPS = (2000, 4000, 8000)


def solve_spin(_: Computed) -> Solution:
    """The co-rotational stress of a rigidly turning plate must stay; its drift, and the order of that."""
    drifts = [100.0 * spinning_shell(0.25, steps)[0] for steps in STEPS]
    figure = "rigid_spin"
    order = float(np.log2(drifts[-2] / drifts[-1]))
    note = f"in {STEPS[-1]} steps; order {order:.2f} in the step"
    source = "objectivity; of the largest resultant"
    rows = (
        below("stress of a shell turned rigidly by 90°, change", drifts[-1], 1.0, "%", source, note, figure),
        near("order of that change in the step", order, 2.0, "", 0.3, "strains of the middle of the step", "", figure),
    )
    panel = Panel(
        "steps for 90°",
        "largest change of a resultant [%]",
        (slope_line(STEPS, drifts[0], -2.0), Curve("birdstrike", STEPS, drifts)),
        log=True,
    )
    caption = f"A warped shell under 80, -30, 20 MPa turned rigidly: resultants change by {drifts[-1]:.3g} % {note}."
    return Solution(rows, (Picture(figure, draw(panel), caption),))


ABOUT_RETURN = "Linear hardening gives closed forms on proportional paths, in one step or many."
RETURN_PROBLEMS = (
    Problem("return_mapping", "Plasticity and objectivity", ABOUT_RETURN, solve_return),
    Problem("rigid_spin", "Plasticity and objectivity", "", solve_spin),
)


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
    plate = plate_of(plate_mesh(SIDE, SIDE, (elements, elements)), THICKNESS, material)
    speed = 2.0 * number * THICKNESS / SIDE * np.sqrt(material.yield_stress / material.density)
    plate.v[~plate.fixed, 2] = -speed
    centre, still = centre_of(plate), np.zeros_like(plate.x)
    dt, at_first, peak = 0.9 * plate.stable_step(), plate.kinetic_energy(), 0.0
    left, step = int(4e-4 / dt), 0
    while left:
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, still)
        peak = max(peak, -float(plate.x[centre, 2]))
        if plate.nodes.damping > 0.0:
            left -= 1
        elif plate.kinetic_energy() < 0.01 * at_first:
            plate.nodes.damping = 2e4
        step += 1
    return Dent(-float(plate.x[centre, 2]) / THICKNESS, peak / THICKNESS)


def nurick_plate(number: float = 14.0, elements: int = 16) -> Compared:
    """Permanent deflection over thickness of a mild steel plate against the correlation of its experiments.

    Static yield stress, and mild steel's Cowper-Symonds constants 40.4 1/s and 5.
    """
    return Compared(np.array([dented(MILD_STEEL, number, elements).permanent]), np.array([nurick_deflection(number)]))


def shear_stress_at_rate(material: ShellMaterial, rate: float, dt: float, steps: int = 2000) -> Compared:
    """Stress [Pa] after a steady engineering shear rate [1/s] against Cowper and Symonds' closed form."""
    layer = Layer(material.row())
    for _ in range(steps):
        layer.strain(np.array([0.0, 0.0, rate * dt]), dt)
    expected = cowper_symonds_shear_stress(material.yield_stress, material.rate_c, material.rate_p, rate)
    return Compared(layer.stress[2:], np.array([expected]))


CONSTANTS = {"mild steel, 40.4 1/s and 5": (40.4, 5.0), "aluminium, 6500 1/s and 4": (6500.0, 4.0)}
RATES = (1.0, 1e3)  # 1/s, engineering shear
COWPER = "Y (1 + (plastic rate/C)^(1/P))/sqrt3, closed form of G. R. Cowper & P. S. Symonds (1957)"
NUMBERS = (5.0, 8.0, 14.0, 20.0)  # phi
NURICK = "0.471 phi + 0.001: G. N. Nurick & J. B. Martin, Int. J. Impact Engng 8 (1989) 171"
CORRELATION = (
    "a correlation of experiments that scatter by one thickness, quoted from memory and not checked against the paper "
    "here"
)
JONES = "rigid-plastic bracket: N. Jones, Structural Impact (1989), chapter 7; quoted from memory"


def solve_rate(_: Computed) -> Solution:
    """Steady shear of a perfectly plastic metal at two rates."""
    rows = []
    for name, constants in CONSTANTS.items():
        metal = ShellMaterial(200e9, 0.3, 7800.0, 250e6, 0.0, 1.0, *constants)
        for rate in RATES:
            factor = 1.0 + (rate / 3.0**0.5 / constants[0]) ** (1.0 / constants[1])
            at_yield = factor * metal.yield_stress / (metal.young / 2.6)
            pair = shear_stress_at_rate(metal, rate, 60.0 * at_yield / rate / 2000)
            ours, truth = 1e-6 * float(pair.computed[0]), 1e-6 * float(pair.reference[0])
            rows.append(matches(f"shear stress at {rate:g} 1/s, {name}", ours, truth, "MPa", 1e-8, COWPER))
    return Solution(tuple(rows))


def solve_impulse(_: Computed) -> Solution:
    """Permanent deflection against phi: with rate hardening against experiments, without it against Jones's bracket."""
    figure = "impulsive_plate"
    rows: list[Row] = []
    hardened, correlated, rateless = [], [], []
    for number in NUMBERS:
        pair = nurick_plate(number)
        hardened.append(float(pair.computed[0]))
        correlated.append(float(pair.reference[0]))
        gate = 10.0 if number == 14.0 else None
        name = f"impulsive plate, phi {number:g}: deflection over thickness"
        rows.append(matches(name, hardened[-1], correlated[-1], "", gate, NURICK, CORRELATION, figure))
    for number in NUMBERS:
        rateless.append(dented(RATELESS_STEEL, number).permanent)
        low, high = jones_deflection(number), jones_deflection(number, 0.618)
        note = f"bracket {low:.2f} to {high:.2f}"
        name = f"impulsive plate without rate hardening, phi {number:g}: deflection over thickness"
        rows.append(shown(name, rateless[-1], "", JONES, note, figure))
    curves = (
        Curve("Nurick & Martin, experiments", NUMBERS, correlated, truth=True),
        Curve("birdstrike, mild steel", NUMBERS, hardened),
        Curve("birdstrike, no rate hardening", NUMBERS, rateless),
        Curve("Jones, circumscribed", NUMBERS, [jones_deflection(number) for number in NUMBERS]),
        Curve("Jones, inscribed", NUMBERS, [jones_deflection(number, 0.618) for number in NUMBERS]),
    )
    panel = Panel("dimensionless impulse phi", "permanent deflection / thickness", curves)
    off = ", ".join(f"{100.0 * (a / b - 1.0):+.1f} %" for a, b in zip(hardened, correlated, strict=True))
    caption = (
        f"A clamped square plate, 89 x 89 x 1.6 mm, given a uniform velocity: {off} off the correlation at "
        f"phi {', '.join(f'{number:g}' for number in NUMBERS)}."
    )
    return Solution(tuple(rows), (Picture(figure, draw(panel), caption),))


ABOUT_IMPULSE = (
    "Mild steel, 296 MPa static yield stress, perfectly plastic, on 16 x 16 shells; Cowper-Symonds 40.4 1/s and 5."
)
PROBLEMS = (
    *RETURN_PROBLEMS,
    Problem("rate_hardening", "Ductile plate", "", solve_rate),
    Problem("impulsive_plate", "Ductile plate", ABOUT_IMPULSE, solve_impulse),
)
