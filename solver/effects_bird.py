"""Effects of the bird and of the impact: speed, angle, aim, mass, length, porosity, friction."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from data.histories import Array
from data.units import quantity_text
from solver.effects import Effect, Table
from solver.eos import AIR_EXPONENT, ATMOSPHERE

if TYPE_CHECKING:
    from solver.case import Case

GROUP = "bird and impact"
YAW_LIMIT = math.radians(45.0)


def _size(case: Case, density: float, length: float) -> Table:
    """The bird by its own size and density, whatever keys the case gave them by."""
    diameter = quantity_text(case.bird.diameter, "m")
    return {
        "bird": {
            "diameter": diameter,
            "length": quantity_text(length, "m"),
            "density": quantity_text(density, "kg/m^3"),
        }
    }


def _mass(case: Case, change: float) -> Table:
    """Density at fixed size; the law of the equation of state is kept about the new density."""
    return _size(case, (case.bird.actual_mass + change) / case.bird.volume, case.bird.length)


def _length(case: Case, change: float) -> Table:
    """Overall length at fixed diameter and density; the mass follows."""
    return _size(case, case.bird.actual_density, case.bird.length + change)


def _porosity(case: Case, change: float) -> Table:
    """The bird's law with a share of air in series, at the bird's mass and size."""
    eos = case.bird.material.eos
    if eos.kind == "porous":
        density = quantity_text(case.bird.actual_density, "kg/m^3")
        return {"bird": {"density": density, "material": {"eos": {"z": eos.z + change}}}}
    mu, p = porous_points(case, change)
    points = {"kind": "table", "mu": [float(x) for x in mu], "p": [quantity_text(x, "Pa") for x in p]}
    return {"bird": {"material": {"eos": points}}}


def porous_points(case: Case, porosity: float) -> tuple[Array, Array]:
    """Compression mu and pressure [Pa], (n,) each, of the case's law with a share `porosity` of air at rest.

    V/V0 = (1 - z) / (1 + mu_law(p)) + z (1 + p/p_atm)^(-1/1.4): one pressure in both (Wood, A Textbook of Sound, 1930).
    Cold curve: what energy adds to the pressure is left out.
    """
    law = case.bird.material.eos.build(case.bird.actual_density)
    mu = np.concatenate([-np.geomspace(2e-2, 1e-7, 30), [0.0], np.geomspace(1e-7, 0.4, 90)])
    p = np.array([law.pressure(float(x), law.initial_energy) - law.pressure_at_rest for x in mu])
    kept = (p > -0.9 * ATMOSPHERE) & (p < 2e9)
    mu, p = mu[kept], p[kept]
    volume = (1.0 - porosity) / (1.0 + mu) + porosity * (1.0 + p / ATMOSPHERE) ** (-1.0 / AIR_EXPONENT)
    volume[p == 0.0] = 1.0  # exactly, so that the table holds the state at rest
    return 1.0 / volume - 1.0, p + law.pressure_at_rest


def _impact(case: Case, key: str, unit: str, change: float) -> Table:
    value = getattr(case.impact, key) + change
    return {"impact": {key: quantity_text(value, unit) if unit else value}}


def _offset(case: Case, along: float, across: float) -> Table:
    declared = case.impact.offset
    return {"impact": {"offset": [quantity_text(declared[0] + along, "m"), quantity_text(declared[1] + across, "m")]}}


def _yaw(case: Case, change: float) -> Table:
    return {"impact": {"yaw": quantity_text(case.impact.yaw + change, "rad")}}


def _no_law(case: Case) -> str:
    return "" if hasattr(case.bird.material, "eos") else "the bird's material has no equation of state of its own"


def _sphere(case: Case) -> str:
    return "a sphere has no length of its own" if case.bird.shape == "sphere" else ""


BIRD = (
    Effect(
        "impact_speed",
        "a bird faster or slower than measured",
        "m/s",
        lambda case, x: _impact(case, "speed", "m/s", x),
        lambda case: 0.02 * case.impact.speed,
        lambda case: -case.impact.speed,
        group=GROUP,
        source="light gates and high-speed video: 1 to 2 % of the speed",
    ),
    Effect(
        "impact_angle",
        "an impact at another angle",
        "rad",
        lambda case, x: _impact(case, "angle", "rad", x),
        lambda _: math.radians(1.0),
        lambda case: -case.impact.angle,
        group=GROUP,
        source="pitch of the bird and of the target's frame: about a degree",
    ),
    Effect(
        "impact_offset",
        "a bird that arrives beside the point of aim, along the plate's length",
        "m",
        lambda case, x: _offset(case, x, 0.0),
        lambda case: 0.05 * case.bird.diameter,
        group=GROUP,
        source="dispersion of a gas gun: some millimetres",
    ),
    Effect(
        "impact_offset_across",
        "a bird that arrives beside the point of aim, along the plate's width",
        "m",
        lambda case, x: _offset(case, 0.0, x),
        lambda case: 0.05 * case.bird.diameter,
        group=GROUP,
        source="dispersion of a gas gun: some millimetres",
    ),
    Effect(
        "bird_yaw",
        "a bird whose axis is turned sideways out of its velocity",
        "rad",
        _yaw,
        lambda _: math.radians(3.0),
        lambda case: -YAW_LIMIT - case.impact.yaw,
        _sphere,
        GROUP,
        "free flight after the sabot: a few degrees; gas-gun procedures accept up to about 5",
    ),
    Effect(
        "bird_mass",
        "a bird heavier or lighter than weighed, at the same size",
        "kg",
        _mass,
        lambda case: 0.02 * case.bird.actual_mass,
        lambda case: -case.bird.actual_mass,
        group=GROUP,
        source="loss of gelatine in the sabot: 1 to 3 % of the mass",
    ),
    Effect(
        "bird_length",
        "a bird longer or shorter than stated, at the same diameter and density",
        "m",
        _length,
        lambda case: 0.03 * case.bird.length,
        lambda case: case.bird.diameter - case.bird.length,
        _sphere,
        GROUP,
        "a cast bird's overall length: a few per cent; the mass follows",
    ),
    Effect(
        "bird_porosity",
        "air in the bird",
        "",
        _porosity,
        lambda _: 0.02,
        lambda case: (
            -case.bird.material.eos.z
            if getattr(case.bird.material, "eos", None) is not None and case.bird.material.eos.kind == "porous"
            else 0.0
        ),
        _no_law,
        GROUP,
        "air at one pressure with the bird's substance (Wood 1930); 10 % is usual in gelatine birds (Wilbeck 1978)",
    ),
    Effect(
        "bird_friction",
        "friction between bird and plate",
        "",
        lambda case, x: _impact(case, "friction", "", x),
        lambda _: 0.1,
        lambda case: -case.impact.friction,
        group=GROUP,
        source="Coulomb friction coefficient",
    ),
)
