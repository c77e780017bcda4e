"""Materials and equations of state as LS-DYNA reads them, in columns of ten, of the bird and of the target."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.reports.export.cards import Card
from birdstrike.reports.export.fixed_columns import card, columns
from birdstrike.reports.export.radioss_materials import RIGID, refuse_damage, refuse_fracture
from birdstrike.solver.case.plate import PlateMaterial
from birdstrike.solver.target.laws.bilinear import Bilinear
from birdstrike.solver.target.laws.interface import Metal, RatedMetal, TargetMaterial
from birdstrike.solver.target.laws.johnson_cook import JohnsonCook
from birdstrike.solver.target.laws.power import Power
from birdstrike.solver.target.laws.tabulated import Tabulated

Layout = tuple[str, tuple[tuple[str, ...], ...]]
LAYOUTS: Mapping[str, Layout] = {
    "MatNull": ("*MAT_NULL", (("mid", "ro", "pc", "mu", "terod", "cerod", "ym", "pr"),)),
    "MatElastic": ("*MAT_ELASTIC", (("mid", "ro", "e", "pr", "da", "db"),)),
    "MatPlasticKinematic": (
        "*MAT_PLASTIC_KINEMATIC",
        (("mid", "ro", "e", "pr", "sigy", "etan", "beta"), ("src", "srp", "fs", "vp")),
    ),
    "MatElasticPlasticHydro": (
        "*MAT_ELASTIC_PLASTIC_HYDRO",
        (("mid", "ro", "g", "sigy", "eh", "pc", "fs", "charl"), (), (), (), ()),
    ),
    "EosGruneisen": ("*EOS_GRUNEISEN", (("eosid", "c", "s1", "s2", "s3", "gamao", "a", "e0"), ("v0",))),
    "EosLinearPolynomial": (
        "*EOS_LINEAR_POLYNOMIAL",
        (("eosid", "c0", "c1", "c2", "c3", "c4", "c5", "c6"), ("e0", "v0")),
    ),
    "EosMurnaghan": ("*EOS_MURNAGHAN", (("eosid", "gamma", "k0", "v0"),)),
}
"""Keyword and the fields of its lines, by the name of the class in ansys-dyna-core."""
POINTS = 40
"""Of a power law that is written as a curve."""
LARGEST_STRAIN = 2.0
"""Plastic strain up to which such a curve goes."""
INTERVALS = 5000
"""Of equal length, by which LS-DYNA replaces a curve (LCINT); its own 100 make a power law's first 2 % straight."""
LEVEL_SHARE = 0.1
"""Of a table's last plastic strain, by which a level piece is added: LS-DYNA goes on with the last slope beyond it."""


def keyword_lines(found: Card, number: int, system: UnitSystem) -> list[str]:
    """A card in fixed columns, with as many digits as they hold."""
    keyword, lines = LAYOUTS[found.keyword]
    values = {name: system.value(value, si) for name, (value, si) in found.fields.items()}
    text = [keyword]
    for fields in lines:
        cells = [number if name in ("mid", "eosid") else values.get(name) for name in fields]
        text += [f"$#{''.join(f'{name:>10}' for name in fields)[2:]}"] if fields else []
        text.append(card(*cells) if fields else card(0.0))
    return text


def metal_lines(
    title: str, material: PlateMaterial | TargetMaterial | None, number: int, system: UnitSystem
) -> list[str]:
    """The *MAT of shells, and its curve; None: of shells that are held. Raises UserError for what is not written."""
    if isinstance(material, PlateMaterial | Bilinear):
        refuse_fracture(title, material)
        return _kinematic(material, number, system)
    if not isinstance(material, Metal):
        density, young, poisson = RIGID
        elastic = {"ro": (density, "kg/m^3"), "e": (young, "Pa"), "pr": (poisson, "")}
        return keyword_lines(Card("MatElastic", elastic), number, system)
    refuse_fracture(title, material)
    if isinstance(material, Power) and not material.rate_c:
        return _johnson(material, (material.a, material.b, material.n), (0.0, 1.0), number, system)
    if isinstance(material, Power):
        strain = np.concatenate([[0.0], np.geomspace(1e-5, LARGEST_STRAIN, POINTS)])
        return _piecewise(material, strain, material.a + material.b * strain**material.n, number, system)
    if isinstance(material, Tabulated):
        return _piecewise(material, *_levelled(material), number, system)
    if isinstance(material, JohnsonCook):
        refuse_damage(title, material)
        if material.melt is not None:
            raise UserError(
                f"target: part {title} softens by its heat, which *MAT_SIMPLIFIED_JOHNSON_COOK does not; export "
                "without melt and specific_heat, or --to radioss"
            )
        hardening = (material.a, material.b, material.n)
        return _johnson(material, hardening, (material.c, material.rate0), number, system)
    raise UserError(
        f'target: part {title} is of law = "{material.law}", which the deck does not write; bilinear, power, '
        "tabulated and johnson_cook are"
    )


def _kinematic(material: PlateMaterial | Bilinear, number: int, system: UnitSystem) -> list[str]:
    fields = {
        "ro": (material.density, "kg/m^3"),
        "e": (material.young, "Pa"),
        "pr": (material.poisson, ""),
        "sigy": (material.yield_stress, "Pa"),
        "etan": (material.tangent_modulus, "Pa"),
        "beta": (material.beta, ""),
        "src": (material.rate_c, "1/s"),
        "srp": (material.rate_p if material.rate_c else 0.0, ""),
        "vp": (1.0 if material.rate_c else 0.0, ""),
    }
    if material.failure_strain is not None:
        fields["fs"] = (material.failure_strain, "")
    return keyword_lines(Card("MatPlasticKinematic", fields), number, system)


def _johnson(
    material: Metal,
    hardening: tuple[float, float, float],
    rate: tuple[float, float],
    number: int,
    system: UnitSystem,
) -> list[str]:
    (a, b, n), (c, rate0) = hardening, rate
    failure = 1e17 if material.failure_strain is None else material.failure_strain
    flow = (system.value(a, "Pa"), system.value(b, "Pa"), n, c, failure, 1e28, 1e28, system.value(rate0, "1/s"))
    return [
        "*MAT_SIMPLIFIED_JOHNSON_COOK",
        "$#     mid        ro         e        pr        vp",
        card(number, *_elasticity(material, system), 1.0 if c else 0.0),
        "$#       a         b         n         c    psfail    sigmax    sigsat      epso",
        card(*flow),
    ]


def _piecewise(
    material: RatedMetal, strain: np.ndarray, stress: np.ndarray, number: int, system: UnitSystem
) -> list[str]:
    failure = 1e21 if material.failure_strain is None else material.failure_strain
    rate = (system.value(material.rate_c, "1/s"), material.rate_p if material.rate_c else 0.0)
    # with rates by VP = 1 a SIGY above 0 would be scaled in place of the curve, and added to it
    first = 0.0 if material.rate_c else system.value(float(stress[0]), "Pa")
    curve = [columns((float(x), 20), (system.value(float(y), "Pa"), 20)) for x, y in zip(strain, stress, strict=True)]
    return [
        "*MAT_PIECEWISE_LINEAR_PLASTICITY",
        "$#     mid        ro         e        pr      sigy      etan      fail      tdel",
        card(number, *_elasticity(material, system), first, 0.0, failure, 0.0),
        "$#       c         p      lcss      lcsr        vp",
        card(*rate, number, 0, 1.0 if material.rate_c else 0.0),
        card(*[0.0] * 8),
        card(*[0.0] * 8),
        "*DEFINE_CURVE",
        "$#    lcid      sidr       sfa       sfo      offa      offo    dattyp     lcint",
        card(number, 0, 1.0, 1.0, 0.0, 0.0, 0, INTERVALS),
        *curve,
    ]


def _levelled(material: Tabulated) -> tuple[np.ndarray, np.ndarray]:
    """Plastic strains and flow stresses [Pa] of a table, with a level piece at its end."""
    strain, stress = np.array(material.plastic_strain), np.array(material.flow_stress)
    return np.append(strain, (1.0 + LEVEL_SHARE) * strain[-1]), np.append(stress, stress[-1])


def _elasticity(material: Metal, system: UnitSystem) -> tuple[float, float, float]:
    return system.value(material.density, "kg/m^3"), system.value(material.young, "Pa"), material.poisson
