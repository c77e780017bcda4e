"""LS-DYNA cards of a bird: which keyword each model and law is, and which of its fields holds which constant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from birdstrike.data.errors import UserError
from birdstrike.solver.bird.eos.interface import Law
from birdstrike.solver.bird.eos.linear_polynomial import polynomial_coefficients
from birdstrike.solver.bird.materials.interface import NEVER, BirdMaterial
from birdstrike.solver.case.sections import quantity_at

Fields = Mapping[str, str]
"""Field of a card -> key of the case's `bird.material`, or of its `eos`."""

MATERIALS: Mapping[str, tuple[str, Fields]] = {
    "null": (
        "MatNull",
        {"pc": "pressure_cutoff", "mu": "viscosity", "terod": "tension_erosion", "cerod": "compression_erosion"},
    ),
    "elastic": ("MatElastic", {"e": "young", "pr": "poisson"}),
    "plastic_kinematic": (
        "MatPlasticKinematic",
        {
            "e": "young",
            "pr": "poisson",
            "sigy": "yield_stress",
            "etan": "tangent_modulus",
            "beta": "beta",
            "src": "rate_c",
            "srp": "rate_p",
            "fs": "failure_strain",
        },
    ),
    "hydrodynamic": (
        "MatElasticPlasticHydro",
        {
            "g": "shear_modulus",
            "sigy": "yield_stress",
            "eh": "hardening_modulus",
            "pc": "pressure_cutoff",
            "fs": "failure_strain",
        },
    ),
}
LAWS: Mapping[str, tuple[str, Fields]] = {
    "grueneisen": (
        "EosGruneisen",
        {"c": "C", "s1": "S1", "s2": "S2", "s3": "S3", "gamao": "g0", "a": "a", "e0": "E0"},
    ),
    "murnaghan": ("EosMurnaghan", {"gamma": "g", "k0": "B"}),
}
"""Laws with a card of their own, where every constant that it has no field for is 0."""
ZERO_IS_NO_CUTOFF = ("MatElasticPlasticHydro",)
"""Cards in which a cutoff of 0 means none."""
POLYNOMIAL = ("c0", "c1", "c2", "c3", "c4", "c5", "c6")
OF_ENERGY = ("c4", "c5", "c6")
"""Coefficients of a polynomial that multiply the energy, and so are numbers."""
NO_TENSION = -1.0
"""[Pa] small against any stress of an impact."""
UNSTRAINED = {"v0": (1.0, "")}
"""An equation of state starts at the reference volume."""


@dataclass(frozen=True)
class Card:
    """One keyword; keyword: its class in ansys-dyna-core; fields: name -> (SI value, SI unit)."""

    keyword: str
    fields: Mapping[str, tuple[float, str]]


def cards_of(material: BirdMaterial, density: float) -> tuple[Card, ...]:
    """The material's card and, where it has one, its equation of state's; density [kg/m^3].

    Constants that the card would understand otherwise are written as `reworded` says. Raises UserError for a material
    or a law that LS-DYNA has not.
    """
    keyword, names = _card_of(material)
    fields = {"ro": (density, "kg/m^3")} | _constants(material, names, "bird.material")
    fields |= {name: (value, fields[name][1]) for name, (value, _) in reworded(material).items()}
    never = {name for name, key in names.items() if key == "failure_strain" and fields[name][0] >= NEVER}
    whole = {name: entry for name, entry in fields.items() if name not in never}
    return (Card(keyword, whole), *([] if material.law is None else [_law_card(material.law, density)]))


def reworded(material: BirdMaterial) -> dict[str, tuple[float, str]]:
    """Field -> the SI value that means to LS-DYNA what the case's means here, and why.

    By the letter of *MAT_NULL an erosion limit on the wrong side of 1 deletes every undeformed element; a cutoff of 0
    is no tension there, but no cutoff in *MAT_ELASTIC_PLASTIC_HYDRO.
    """
    (keyword, names), found = _card_of(material), {}
    for name, key in names.items():
        if key in material.inactive:
            why = f"{key} = {getattr(material, key):.4g} erodes nothing in birdstrike and is written as 0, off"
            found[name] = (0.0, why)
    if keyword in ZERO_IS_NO_CUTOFF and getattr(material, "pressure_cutoff", None) == 0.0:
        found["pc"] = (NO_TENSION, "pressure_cutoff = 0, no tension, is written as -1 Pa: 0 would mean no cutoff")
    return found


def erodes(material: BirdMaterial, density: float) -> bool:
    """Whether any limit of a material can erode it; density [kg/m^3]."""
    built = material.build(density)
    return built.volume_limits != (math.inf, 0.0) or built.failure_strain < NEVER


def _card_of(material: BirdMaterial) -> tuple[str, Fields]:
    if material.model not in MATERIALS:
        known = ", ".join(MATERIALS)
        raise UserError(f'bird.material.model = "{material.model}" has no card in LS-DYNA; export a case with {known}')
    return MATERIALS[material.model]


def _constants(source: BirdMaterial | Law, names: Fields, prefix: str) -> dict[str, tuple[float, str]]:
    """Each field's SI value and SI unit, the unit being that of the case's key."""
    found = {}
    for name, key in names.items():
        mark = quantity_at(f"{prefix}.{key}")
        assert mark is not None, f"{prefix}.{key} is no quantity of a case"
        found[name] = (float(getattr(source, key)), mark.unit)
    return found


def _law_card(law: Law, density: float) -> Card:
    keyword, names = LAWS.get(law.kind, ("", {}))
    constants = law.model_dump(exclude={"kind"})
    without_field = [key for key, value in constants.items() if key not in names.values() and value]
    if keyword and not without_field:
        return Card(keyword, _constants(law, names, "bird.material.eos") | UNSTRAINED)
    unless = f" while {' and '.join(without_field)} is not 0" if keyword else ""
    built = law.build(density)
    coefficients = polynomial_coefficients(built)
    if coefficients is None:
        raise UserError(
            f'bird.material.eos.kind = "{law.kind}" has no card of its own in LS-DYNA{unless}; export a case with '
            "grueneisen, linear_polynomial, polynomial_k or murnaghan (p0 = 0)"
        )
    units = {name: "" if name in OF_ENERGY else "Pa" for name in POLYNOMIAL}
    fields = {name: (float(c), units[name]) for name, c in zip(POLYNOMIAL, coefficients, strict=True)}
    return Card("EosLinearPolynomial", fields | {"e0": (built.initial_energy, "Pa")} | UNSTRAINED)
