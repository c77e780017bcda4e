"""Plane-stress return mapping against closed forms; and a stressed plate that turns rigidly."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.draw import Curve, Panel, draw, slope_line
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import below, matches, near
from birdstrike.reports.verification.shell_problems import spinning_shell
from birdstrike.solver.kernels.plasticity import return_to_yield
from birdstrike.solver.plate.shell import ShellMaterial

CLOSED = "closed form, linear hardening"
TIGHT = 1e-8  # %, that is 1e-10
RATELESS = (0.0, 1.0)
YOUNG, NU, YIELD, TANGENT = 200e9, 0.3, 250e6, 2e9
MODULUS = YOUNG * TANGENT / (YOUNG - TANGENT)  # Ep


def steel(beta: float) -> ShellMaterial:
    return ShellMaterial(YOUNG, NU, 7800.0, YIELD, TANGENT, beta)


def drive(material: ShellMaterial, direction: Array, steps: int, increment: float) -> tuple[Array, float]:
    """Stress (3,) [Pa] and plastic strain after `steps` equal elastic trial increments of strain along `direction`."""
    stress, back, eps_p = np.zeros(3), np.zeros(3), 0.0
    plane = YOUNG / (1.0 - NU**2)
    stiffness = plane * np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]])
    for _ in range(steps):
        stress += stiffness @ (increment * direction)
        eps_p = return_to_yield(stress, back, eps_p, material.elastic, material.hardening, RATELESS)
    return stress, eps_p


def shear_stress(gamma: float) -> float:
    """sqrt3 tau = Y + Ep (gamma - tau/G)/sqrt3 in pure shear beyond yield [Pa]."""
    shear = YOUNG / (2.0 * (1.0 + NU))
    return (YIELD + MODULUS * gamma / np.sqrt(3.0)) / (np.sqrt(3.0) + MODULUS / (np.sqrt(3.0) * shear))


def biaxial_stress(strain: float) -> float:
    """sigma = Y + 2 Ep (strain - (1 - nu) sigma/E) in equal biaxial tension beyond yield [Pa]."""
    return (YIELD + 2.0 * MODULUS * strain) / (1.0 + 2.0 * MODULUS * (1.0 - NU) / YOUNG)


def uniaxial(material: ShellMaterial, strain: float, steps: int) -> float:
    """Axial stress [Pa] with the lateral stress held at zero by bisection of the lateral strain."""
    stress, back, eps_p = np.zeros(3), np.zeros(3), 0.0
    plane, increment = YOUNG / (1.0 - NU**2), strain / steps
    for _step in range(steps):
        low, high = -2.0 * increment, 2.0 * increment
        for _bisection in range(80):
            lateral = 0.5 * (low + high)
            trial, moved = stress.copy(), back.copy()
            trial[0] += plane * (increment + NU * lateral)
            trial[1] += plane * (lateral + NU * increment)
            after = return_to_yield(trial, moved, eps_p, material.elastic, material.hardening, RATELESS)
            low, high = (lateral, high) if trial[1] < 0.0 else (low, lateral)
        stress, back, eps_p = trial, moved, after
    return float(stress[0])


def solve_return(_: Strikes) -> Outcome:
    """Shear, equal biaxial and uniaxial tension, isotropic and kinematic hardening."""
    rows = []
    tension = YIELD + TANGENT * (0.02 - YIELD / YOUNG)
    for beta, kind in ((1.0, "isotropic"), (0.0, "kinematic")):
        shear, _eps_p = drive(steel(beta), np.array([0.0, 0.0, 1.0]), 50, 0.02 / 50)
        biaxial, _eps_p = drive(steel(beta), np.array([1.0, 1.0, 0.0]), 50, 0.01 / 50)
        for name, ours, truth in (
            ("pure shear", float(shear[2]), shear_stress(0.02)),
            ("equal biaxial tension", float(biaxial[0]), biaxial_stress(0.01)),
            ("uniaxial tension", uniaxial(steel(beta), 0.02, 100), tension),
        ):
            rows.append(matches(f"{name}, {kind}", 1e-6 * ours, 1e-6 * truth, "MPa", TIGHT, CLOSED))
    return Outcome(tuple(rows))


STEPS = (2000, 4000, 8000)


def solve_spin(_: Strikes) -> Outcome:
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
    return Outcome(rows, (Picture(figure, draw(panel), caption),))


ABOUT = "Linear hardening gives closed forms on proportional paths, in one step or many."
PROBLEMS = (
    Problem("return_mapping", "Plasticity and objectivity", ABOUT, solve_return),
    Problem("rigid_spin", "Plasticity and objectivity", "", solve_spin),
)
