"""Materials and equations of state as Radioss reads them (format of 2018 and later), of the bird and of the target."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from birdstrike.data.errors import UserError
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.reports.export.cards import NO_TENSION, erodes
from birdstrike.reports.export.fixed_columns import card, columns
from birdstrike.solver.bird.eos.grueneisen import Grueneisen
from birdstrike.solver.bird.eos.interface import Law
from birdstrike.solver.bird.eos.linear_polynomial import polynomial_coefficients
from birdstrike.solver.bird.eos.murnaghan import Murnaghan
from birdstrike.solver.bird.materials.elastic import ElasticMaterial
from birdstrike.solver.bird.materials.hydrodynamic import HydrodynamicMaterial
from birdstrike.solver.bird.materials.interface import NEVER, BirdMaterial
from birdstrike.solver.bird.materials.null import NullMaterial
from birdstrike.solver.bird.materials.plastic_kinematic import PlasticKinematicMaterial
from birdstrike.solver.case.plate import PlateMaterial
from birdstrike.solver.hardening import hardening_moduli
from birdstrike.solver.target.laws.bilinear import Bilinear
from birdstrike.solver.target.laws.interface import Metal, TargetMaterial
from birdstrike.solver.target.laws.johnson_cook import JohnsonCook
from birdstrike.solver.target.laws.power import Power

RIGID = (7850.0, 200e9, 0.3)
"""Density [kg/m^3], Young's modulus [Pa] and Poisson's ratio of shells whose nodes are all held."""
WIDE = 20


def bird_lines(material: BirdMaterial, density: float, number: int, system: UnitSystem, sph: bool) -> list[str]:
    """The bird's /MAT and, where it has one, its /EOS; density [kg/m^3]. Raises UserError for what Radioss has not.

    sph: whether particles carry it; not every law is open to them.
    """
    if isinstance(material, NullMaterial):
        return [*_null(material, density, number, system), *_eos(material.eos, density, number, system)]
    if isinstance(material, ElasticMaterial):
        return _head("ELAST", "bird", (density, material.young, material.poisson), number, system)
    if isinstance(material, HydrodynamicMaterial):
        return [*_hydrodynamic(material, density, number, system), *_eos(material.eos, density, number, system)]
    if isinstance(material, PlasticKinematicMaterial):
        return _plastic_bird(material, density, number, system, sph)
    raise UserError(
        f'bird.material.model = "{material.model}" has no card in Radioss; export a case with null, elastic, '
        "plastic_kinematic or hydrodynamic"
    )


def remarks_on(material: BirdMaterial, sph: bool) -> Iterator[str]:
    """What of a bird's material Radioss does otherwise than birdstrike; sph: whether particles carry it."""
    if sph and isinstance(material, PlasticKinematicMaterial) and _limit(material.failure_strain):
        yield (
            "LAW2 takes its deviator from a particle that reaches the failure strain and leaves it its pressure, in "
            "tension too; in birdstrike it erodes and pushes nothing: compare with failure_strain = 100, none"
        )
    if isinstance(material, NullMaterial) and erodes(material, 1000.0):
        yield (
            "LAW6 has no erosion limits: what erodes in birdstrike stays in this deck; compare with "
            "tension_erosion = compression_erosion = 0"
        )
    if getattr(material, "pressure_cutoff", None) == 0.0:
        yield "pressure_cutoff = 0, no tension, is written as -1 Pa: a Pmin of 0 would mean no cutoff"


def _cutoff(value: float, system: UnitSystem) -> float:
    return system.value(value or NO_TENSION, "Pa")


def _null(material: NullMaterial, density: float, number: int, system: UnitSystem) -> Iterator[str]:
    yield from (f"/MAT/HYD_VISC/{number}", "bird")
    yield from ("#              RHO_I", card(system.value(density, "kg/m^3"), width=WIDE))
    yield "#                 Nu                Pmin"
    kinematic = system.value(material.viscosity / density, "m^2/s")
    yield card(kinematic, _cutoff(material.pressure_cutoff, system), width=WIDE)


def _hydrodynamic(material: HydrodynamicMaterial, density: float, number: int, system: UnitSystem) -> Iterator[str]:
    solid = material.build(density)
    bulk, shear = solid.bulk_modulus, solid.shear_modulus
    poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
    yield from _head("HYDPLA", "bird", (density, solid.young, poisson), number, system)
    yield "#                  a                   b                   n             eps_max           sigma_max"
    hardening = [system.value(value, "Pa") for value in (material.yield_stress, material.hardening_modulus)]
    yield card(*hardening, 1.0, _limit(material.failure_strain), 0.0, width=WIDE)
    yield from ("#               Pmin", card(_cutoff(material.pressure_cutoff, system), width=WIDE))


def _limit(failure_strain: float | None) -> float:
    """A failure strain as Radioss has it: 0 for none."""
    return 0.0 if failure_strain is None or failure_strain >= NEVER else failure_strain


def _plastic_bird(
    material: PlasticKinematicMaterial, density: float, number: int, system: UnitSystem, sph: bool
) -> list[str]:
    slope, _ = hardening_moduli(material.young, material.tangent_modulus)
    numbers = (density, material.young, material.poisson, material.yield_stress, slope, 1.0)
    if not sph:
        rate = (material.rate_c, material.rate_p)
        return _cowper("bird", numbers, 1.0 - material.beta, rate, material.failure_strain, number, system)
    if material.rate_c or (slope and material.beta < 1.0):
        raise UserError(
            "bird.material: no law of Radioss that particles carry has kinematic hardening or Cowper and Symonds' "
            'rate factor; export with bird.method = "hexahedra", or with beta = 1 and rate_c = 0'
        )
    return _johnson("bird", numbers, (0.0, 0.0), material.failure_strain, None, number, system)


def _eos(law: Law, density: float, number: int, system: UnitSystem) -> list[str]:
    if isinstance(law, Grueneisen):
        return [
            f"/EOS/GRUNEISEN/{number}",
            "bird",
            "#                  C                  S1                  S2                  S3",
            card(system.value(law.C, "m/s"), law.S1, law.S2, law.S3, width=WIDE),
            "#                 Y0                   a                  E0               RHO_0",
            card(law.g0, law.a, system.value(law.E0, "Pa"), system.value(density, "kg/m^3"), width=WIDE),
        ]
    if isinstance(law, Murnaghan):
        return [
            f"/EOS/MURNAGHAN/{number}",
            "bird",
            "#                K_0                 K_1                  P0                 PSH               RHO_0",
            card(
                system.value(law.B * law.g, "Pa"),
                law.g,
                system.value(law.p0, "Pa"),
                0.0,
                system.value(density, "kg/m^3"),
                width=WIDE,
            ),
        ]
    built = law.build(density)
    found = polynomial_coefficients(built)
    if found is None or found[6]:
        raise UserError(
            f'bird.material.eos.kind = "{law.kind}"{" with C6" if found is not None else ""} has no card in Radioss; '
            "export a case with grueneisen, linear_polynomial (C6 = 0), polynomial_k or murnaghan"
        )
    cold = [system.value(float(value), "Pa") for value in found[:4]]
    initial, reference = system.value(built.initial_energy, "Pa"), system.value(density, "kg/m^3")
    return [
        f"/EOS/POLYNOMIAL/{number}",
        "bird",
        "#                 C0                  C1                  C2                  C3",
        card(*cold, width=WIDE),
        "#                 C4                  C5                  E0                 Psh               RHO_0",
        card(float(found[4]), float(found[5]), initial, 0.0, reference, width=WIDE),
    ]


def metal_lines(
    title: str, material: PlateMaterial | TargetMaterial | None, number: int, system: UnitSystem
) -> list[str]:
    """The /MAT of shells; None: of shells that are held. Raises UserError for what Radioss' shells have not."""
    if isinstance(material, PlateMaterial | Bilinear):
        slope, _ = hardening_moduli(material.young, material.tangent_modulus)
        numbers = (material.density, material.young, material.poisson, material.yield_stress, slope, 1.0)
        refuse_fracture(title, material)
        rate = (material.rate_c, material.rate_p)
        return _cowper(title, numbers, 1.0 - material.beta, rate, material.failure_strain, number, system)
    if not isinstance(material, Metal):
        return _head("ELAST", title, RIGID, number, system)
    refuse_fracture(title, material)
    if isinstance(material, Power) and material.n <= 1.0:
        numbers = (material.density, material.young, material.poisson, material.a, material.b, material.n)
        if material.rate_c:
            rate = (material.rate_c, material.rate_p)
            return _cowper(title, numbers, 0.0, rate, material.failure_strain, number, system)
        return _johnson(title, numbers, (0.0, 0.0), material.failure_strain, None, number, system)
    if isinstance(material, JohnsonCook) and material.n <= 1.0:
        numbers = (material.density, material.young, material.poisson, material.a, material.b, material.n)
        refuse_damage(title, material)
        return _johnson(
            title, numbers, (material.c, material.rate0), material.failure_strain, _heat(material), number, system
        )
    raise UserError(
        f'target: part {title} is of law = "{material.law}", which the deck for Radioss does not write; bilinear, '
        "power and johnson_cook (n up to 1) are, and --to lsdyna has tabulated"
    )


def shell_lines(
    title: str, material: PlateMaterial | TargetMaterial | None, thickness: float, number: int, system: UnitSystem
) -> list[str]:
    """The /PROP of QEPH shells of a thickness [m]: five points, which neither thin nor thicken.

    Iplas: 1 returns by iteration to the closest point, 2 radially, which is Radioss' default.
    """
    iplas = 2 if isinstance(material, Metal) and material.return_mapping == "radial" else 1
    across = system.value(thickness, "m")
    return [
        f"/PROP/SHELL/{number}",
        title,
        "#   Ishell    Ismstr     Ish3n    Idrill    Ipinch                  P_Thick_Fail",
        columns((24, 10), (2, 10), (2, 10), (0, 10), (0, 10), (None, 10), (0.0, WIDE)),
        "#                 Hm                  Hf                  Hr                  Dm                  Dn",
        card(0.0, 0.0, 0.0, 0.0, 0.0, width=WIDE),
        "#        N   Istrain               Thick              Ashear              Ithick     Iplas",
        columns((5, 10), (1, 10), (across, WIDE), (0.0, WIDE), (None, 10), (2, 10), (iplas, 10)),
    ]


def refuse_fracture(title: str, material: object) -> None:
    """Raises UserError for softening by an energy per area, which has no common card."""
    if getattr(material, "fracture_energy", 0.0):
        raise UserError(
            f"target: part {title} has a fracture_energy, which has no card of its own; export with "
            "fracture_energy = 0 and set the other code's own softening"
        )


def refuse_damage(title: str, material: JohnsonCook) -> None:
    """Raises UserError for Johnson and Cook's damage, which is no field of the material's card."""
    if material.D is not None:
        raise UserError(
            f"target: part {title} has Johnson-Cook damage D, which this deck does not write; export with "
            "failure_strain in its place, or add the other code's failure card"
        )


def _heat(material: JohnsonCook) -> tuple[float, float, float, float] | None:
    """m, melting temperature, heat per volume and kelvin of plastic work, reference temperature; None of none."""
    if material.melt is None or material.specific_heat is None:
        return None
    if material.start != material.reference:
        raise UserError(
            f"target.materials: start = {material.start:g} K is not reference = {material.reference:g} K, and the "
            "card has one temperature for both; export with equal ones"
        )
    if material.heat_share == 0.0:
        raise UserError("target.materials: heat_share = 0 has no card, which divides by it; export with one above 0")
    per_volume = material.density * material.specific_heat / material.heat_share
    return material.m, material.melt, per_volume, material.reference


Numbers = tuple[float, float, float, float, float, float]
"""Density, Young's modulus, Poisson's ratio; a, b [Pa] and n of the flow stress a + b eps_p^n."""


def _head(
    kind: str, title: str, numbers: Sequence[float], number: int, system: UnitSystem, more: int | None = None
) -> list[str]:
    """What all laws begin with: density, Young's modulus and Poisson's ratio, the first three of the numbers, SI."""
    density, young, poisson = numbers[:3]
    flag = [] if more is None else [(more, 10)]
    return [
        f"/MAT/{kind}/{number}",
        title,
        "#              RHO_I",
        card(system.value(density, "kg/m^3"), width=WIDE),
        f"#                  E                  nu{'     Iflag' if flag else ''}",
        columns((system.value(young, "Pa"), WIDE), (poisson, WIDE), *flag),
    ]


def _cowper(
    title: str,
    numbers: Numbers,
    kinematic: float,
    rate: tuple[float, float],
    failure_strain: float | None,
    number: int,
    system: UnitSystem,
) -> list[str]:
    a, b, n = numbers[3:]
    c, p = rate
    hardening = (system.value(a, "Pa"), system.value(b, "Pa"), n, kinematic, 0.0)
    return [
        *_head("COWPER", title, numbers, number, system),
        "#                  a                   b                   n              C_hard             sig_max",
        card(*hardening, width=WIDE),
        "#                  c                   p       ICC   Fsmooth               F_cut                  VP",
        columns(
            (system.value(c, "1/s"), WIDE), (p if c else 0.0, WIDE), (0, 10), (0, 10), (0.0, WIDE), (None, 10), (1, 10)
        ),
        "#          EPS_p_max              EPS_t1              EPS_t2",
        card(_limit(failure_strain), 0.0, 0.0, width=WIDE),
    ]


def _johnson(
    title: str,
    numbers: Numbers,
    rate: tuple[float, float],
    failure_strain: float | None,
    heat: tuple[float, float, float, float] | None,
    number: int,
    system: UnitSystem,
) -> list[str]:
    a, b, n = numbers[3:]
    c, rate0 = rate
    m, melt, per_volume, reference = heat or (0.0, 0.0, 0.0, 0.0)
    hardening = (system.value(a, "Pa"), system.value(b, "Pa"), n, _limit(failure_strain), 0.0)
    return [
        *_head("PLAS_JOHNS", title, numbers, number, system, 0),
        "#                  a                   b                   n           EPS_p_max            SIG_max0",
        card(*hardening, width=WIDE),
        "#                  c           EPS_DOT_0       ICC   Fsmooth               F_cut               Chard",
        columns(
            (c, WIDE), (system.value(rate0, "1/s") if c else 0.0, WIDE), (0, 10), (0, 10), (0.0, WIDE), (0.0, WIDE)
        ),
        "#                  m              T_melt              rhoC_p                 T_r",
        card(m, melt, system.value(per_volume, "Pa"), reference, width=WIDE),
    ]
