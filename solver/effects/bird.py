"""Effects of the bird: mass, length, porosity."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.data.units import quantity_text
from birdstrike.solver.bird.eos.porous import AIR_EXPONENT, ATMOSPHERE
from birdstrike.solver.effects.effect import Declared, Effect, Table

FAMILY = "bird"
RESOLVED = 3000
"""Particles: air in a bird of 1000 moves the plate by 0.62 of what it does in one of 3200, in one of 3000 by 0.89
(docs/limits.md)."""


def _size(case: Declared, density: float, length: float) -> Table:
    """The bird by its own size and density, whatever keys the case gave them by."""
    diameter = quantity_text(case.bird.diameter, "m")
    return {
        "bird": {
            "diameter": diameter,
            "length": quantity_text(length, "m"),
            "density": quantity_text(density, "kg/m^3"),
        }
    }


def _mass(case: Declared, change: float) -> Table:
    """Density at fixed size; the law of the equation of state is kept about the new density."""
    return _size(case, (case.bird.actual_mass + change) / case.bird.volume, case.bird.length)


def _length(case: Declared, change: float) -> Table:
    """Overall length at fixed diameter and density; the mass follows."""
    return _size(case, case.bird.actual_density, case.bird.length + change)


def _shortest(case: Declared) -> float:
    """The change down to nothing; a cylinder with round ends is at least as long as these."""
    ends = case.bird.diameter if case.bird.shape == "hemispherical_cylinder" else 0.0
    return ends - case.bird.length


def _porosity(case: Declared, change: float) -> Table:
    """The bird's law with a share of air in series, at the bird's mass and size."""
    eos = case.bird.material.eos
    if eos.air_key:
        density = quantity_text(case.bird.actual_density, "kg/m^3")
        return {"bird": {"density": density, "material": {"eos": {eos.air_key: _air(case) + change}}}}
    mu, p = porous_points(case, change)
    points = {"kind": "table", "mu": [float(x) for x in mu], "p": [quantity_text(x, "Pa") for x in p]}
    return {"bird": {"material": {"eos": points}}}


def _air(case: Declared) -> float:
    """Share of air that the case's law states; 0 for one that states none."""
    law = case.bird.material.law
    return getattr(law, law.air_key) if law is not None and law.air_key else 0.0


def porous_points(case: Declared, porosity: float) -> tuple[Array, Array]:
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


def _no_law(case: Declared) -> str:
    return "" if hasattr(case.bird.material, "eos") else "the bird's material has no equation of state of its own"


def _sphere(case: Declared) -> str:
    return "a sphere has no length of its own" if case.bird.shape == "sphere" else ""


BIRD = (
    Effect(
        "bird_mass",
        "a bird heavier or lighter than weighed, at the same size",
        "kg",
        _mass,
        lambda case: 0.02 * case.bird.actual_mass,
        lambda case: -case.bird.actual_mass,
        family=FAMILY,
        source="loss of gelatine in the sabot: 1 to 3 % of the mass",
        scope="shot",
    ),
    Effect(
        "bird_length",
        "a bird longer or shorter than stated, at the same diameter and density",
        "m",
        _length,
        lambda case: 0.03 * case.bird.length,
        _shortest,
        _sphere,
        FAMILY,
        "a cast bird's overall length: a few per cent; the mass follows",
        scope="shot",
    ),
    Effect(
        "bird_porosity",
        "air in the bird",
        "",
        _porosity,
        lambda _: 0.02,
        lambda case: 0.0 - _air(case),
        _no_law,
        FAMILY,
        "air at one pressure with the bird's substance (Wood 1930); 10 % is usual in gelatine birds (Wilbeck 1978)",
        scope="bird",
        particles=RESOLVED,
    ),
)
