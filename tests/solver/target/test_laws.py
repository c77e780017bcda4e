"""Laws of the target's materials against their closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.optimize import bisect

from birdstrike.solver.kernels.target.metal import FLOW, WEAR, hardened
from birdstrike.solver.target.laws.interface import Metal
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.point import Layer

ALUMINIUM = {"young": "73 GPa", "poisson": 0.3, "density": "2780 kg/m^3"}
POWER = ALUMINIUM | {"law": "power", "a": "350 MPa", "b": "426 MPa", "n": 0.34}
TABLE = ALUMINIUM | {
    "law": "tabulated",
    "plastic_strain": [0.0, 0.02, 0.1],
    "flow_stress": ["300 MPa", "380 MPa", "450 MPa"],
}
BILINEAR = ALUMINIUM | {"law": "bilinear", "yield_stress": "345 MPa", "tangent_modulus": "700 MPa"}
TITANIUM = {
    "law": "johnson_cook",
    "young": "112.2 GPa",
    "poisson": 0.339,
    "density": "4428 kg/m^3",
    "a": "1098 MPa",
    "b": "1092 MPa",
    "n": 0.93,
    "c": 0.014,
}
HEAT = {"m": 1.1, "melt": "1878.15 K", "specific_heat": "560 J/kg/K"}
DAMAGE = {"D": [-0.09, 0.25, -0.50, 0.014, 3.87]}


def layer_of(table: dict, size: float = 1e-3) -> Layer:
    return Layer(TARGET_LAWS.validate(table).row(), size)


def flow(table: dict, eps_p: float) -> float:
    """The hardening curve as its definition has it [Pa]."""
    if table["law"] == "power":
        return 350e6 + 426e6 * eps_p**0.34
    if table["law"] == "tabulated":
        return float(np.interp(eps_p, [0.0, 0.02, 0.1], [300e6, 380e6, 450e6]))
    modulus = 73e9 * 700e6 / (73e9 - 700e6)
    return 345e6 + modulus * eps_p


def closed(table: dict, strain: float, elastic: float, stress: float, plastic: float) -> float:
    """Plastic strain of a proportional path.

    strain = elastic sigma + plastic eps_p, sigma = stress flow(eps_p): no more is to be solved.
    """

    def off(eps: float) -> float:
        return elastic * stress * flow(table, eps) + plastic * eps - strain

    return float(bisect(off, 1e-12, 1.0, xtol=1e-15))  # pyright: ignore[reportArgumentType]


def test_a_radial_return_keeps_the_direction_of_the_trial_stress():
    """Shear is the same; a strip that cannot contract flows at 1/sqrt(1 - nu + nu^2) of the flow stress, not 2/sqrt3.

    In biaxial tension the plastic strain is what the equivalent trial stress has lost, over 3 G.
    """
    closest, radial = (layer_of(POWER | {"return_mapping": name}) for name in ("closest_point", "radial"))
    for one in (closest, radial):
        one.strain(np.array([0.0, 0.0, 0.08]))
    assert radial.stress[2] == pytest.approx(closest.stress[2], rel=1e-12)
    flat = BILINEAR | {"tangent_modulus": "0 MPa"}
    for name, expected in (("closest_point", 2.0 / math.sqrt(3.0)), ("radial", 1.0 / math.sqrt(0.79))):
        strip = layer_of(flat | {"return_mapping": name})
        for _ in range(400):
            strip.strain(np.array([0.1 / 400, 0.0, 0.0]))
        assert strip.stress[0] == pytest.approx(expected * 345e6, rel=1e-3)
    biaxial = layer_of(BILINEAR | {"return_mapping": "radial"})
    biaxial.strain(np.array([0.03, 0.03, 0.0]))
    trial, shear_modulus = 0.03 * 73e9 / 0.7, 73e9 / 2.6
    assert biaxial.stress[0] == pytest.approx(flow(BILINEAR, biaxial.eps_p), rel=1e-9)
    assert biaxial.eps_p == pytest.approx((trial - biaxial.stress[0]) / (3.0 * shear_modulus), rel=1e-9)


@pytest.mark.parametrize("table", [POWER, TABLE, BILINEAR], ids=lambda table: table["law"])
@pytest.mark.parametrize("steps", [1, 40])
def test_hardening_in_shear_and_in_biaxial_tension(table, steps):
    """Proportional paths: exact in one step and in many."""
    shear = layer_of(table)
    for _ in range(steps):
        shear.strain(np.array([0.0, 0.0, 0.08 / steps]))
    eps = closed(table, 0.08, 1.0 / (73e9 / 2.6), 1.0 / math.sqrt(3.0), math.sqrt(3.0))
    assert shear.eps_p == pytest.approx(eps, rel=1e-6)
    assert shear.stress[2] == pytest.approx(flow(table, eps) / math.sqrt(3.0), rel=1e-6)
    biaxial = layer_of(table)
    for _ in range(steps):
        biaxial.strain(np.array([0.03 / steps, 0.03 / steps, 0.0]))
    eps = closed(table, 0.03, 0.7 / 73e9, 1.0, 0.5)
    assert biaxial.stress[:2] == pytest.approx(flow(table, eps), rel=1e-6)


def test_a_table_is_straight_between_its_points_and_level_beyond_the_last():
    row = TARGET_LAWS.validate(TABLE).row()
    expected = {0.0: (300e6, 4e9), 0.01: (340e6, 4e9), 0.02: (380e6, 875e6), 0.1: (450e6, 0.0), 0.5: (450e6, 0.0)}
    for strain, values in expected.items():
        assert hardened(row, strain) == pytest.approx(values)


@pytest.mark.parametrize("table", [POWER, TABLE], ids=lambda table: table["law"])
def test_hardening_in_uniaxial_tension(table):
    layer = layer_of(table)
    for _ in range(20):
        layer.pull(0.05 / 20)
    eps = closed(table, 0.05, 1.0 / 73e9, 1.0, 1.0)
    assert layer.stress[0] == pytest.approx(flow(table, eps), rel=1e-6)
    assert layer.stress[1] == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("rate", [1.0, 1e3])
def test_johnson_cook_stress_at_rate(rate):
    """Steady shear: the flow stress times 1 + c ln of the plastic rate of the very step; without heat."""
    layer, dt = layer_of(TITANIUM), 0.1 / rate / 200
    for _ in range(200):
        before = layer.eps_p
        layer.strain(np.array([0.0, 0.0, rate * dt]), dt)
    plastic_rate = (layer.eps_p - before) / dt
    static = 1098e6 + 1092e6 * layer.eps_p**0.93
    factor = 1.0 + 0.014 * max(math.log(plastic_rate), 0.0)
    assert layer.stress[2] * math.sqrt(3.0) == pytest.approx(factor * static, rel=1e-6)
    assert factor > 1.08 if rate > 1.0 else factor == 1.0


def test_johnson_cook_heats_as_its_differential_equation():
    """Adiabatic shear at rate0: the temperature of dT = share sigma deps/(rho c), about 47 K at a strain of 0.1."""
    layer, steps = layer_of(TITANIUM | HEAT | {"c": 0.0}), 20000
    for _ in range(steps):
        layer.strain(np.array([0.0, 0.0, 0.2 / steps]))

    def heating(eps: float, warm: np.ndarray) -> np.ndarray:
        softened = 1.0 - (warm / 1580.0) ** 1.1
        return 0.9 / (4428.0 * 560.0) * (1098e6 + 1092e6 * eps**0.93) * softened

    truth = solve_ivp(heating, (0.0, layer.eps_p), [0.0], rtol=1e-11, atol=1e-9).y[0, -1]
    assert layer.heat == pytest.approx(truth, rel=2e-5)
    coarse = layer_of(TITANIUM | HEAT | {"c": 0.0})
    for _ in range(steps // 2):
        coarse.strain(np.array([0.0, 0.0, 0.4 / steps]))
    assert 2.0 * layer.heat - coarse.heat == pytest.approx(truth, rel=1e-6), "first order in the step"
    at_tenth = solve_ivp(heating, (0.0, 0.1), [0.0], rtol=1e-10).y[0, -1]
    assert at_tenth == pytest.approx(42.0, abs=6.0)


@pytest.mark.parametrize(
    ("path", "strain"),
    [([0.0, 0.0, 1.0], 0.160), ([1.0, 1.0, 0.0], 0.25 * math.exp(-1.0 / 3.0) - 0.09)],
    ids=["shear", "biaxial"],
)
def test_johnson_cook_damage_at_constant_triaxiality(path, strain):
    """The sum grows as plastic strain over the strain at fracture: 0.160 in shear, 0.0891 in equal biaxial tension."""
    layer = layer_of(TITANIUM | DAMAGE | {"c": 0.0})
    while layer.memory[WEAR] < 0.9:
        layer.strain(2e-4 * np.array(path))
    assert layer.eps_p / layer.memory[WEAR] == pytest.approx(strain, rel=1e-6)
    while not layer.failed:
        layer.strain(2e-4 * np.array(path))
    assert layer.eps_p == pytest.approx(strain, abs=4e-4)


def test_johnson_cook_damage_in_uniaxial_tension_and_at_rate():
    layer = layer_of(TITANIUM | DAMAGE | {"c": 0.0})
    for _ in range(60):
        layer.pull(1e-3)
    assert layer.eps_p / layer.memory[WEAR] == pytest.approx(0.25 * math.exp(-0.5 / 3.0) - 0.09, rel=1e-6)
    fast, rate = layer_of(TITANIUM | DAMAGE | {"c": 0.0}), 1e3 * math.sqrt(3.0)
    expected = 0.0
    for _ in range(100):
        before = fast.eps_p
        fast.strain(np.array([0.0, 0.0, 1e-3]), 1e-3 / rate)
        growth = fast.eps_p - before
        if growth > 0.0:
            expected += growth / (0.160 * (1.0 + 0.014 * math.log(growth / (1e-3 / rate))))
    assert fast.memory[WEAR] == pytest.approx(expected, rel=1e-6)
    assert fast.eps_p / fast.memory[WEAR] == pytest.approx(0.160 * 1.0967, rel=2e-3)


def test_damage_by_rate_counts_from_rate0():
    """At 1000/s and a rate0 of 10/s the strain at fracture is 1 + D4 ln(100) times that at rest."""
    slow = TITANIUM | DAMAGE | {"c": 0.0, "rate0": "10 1/s"}
    layer, dt, expected = layer_of(slow), 1e-3 / (1e3 * math.sqrt(3.0)), 0.0
    for _ in range(60):
        before = layer.eps_p
        layer.strain(np.array([0.0, 0.0, 1e-3]), dt)
        growth = layer.eps_p - before
        expected += growth / (0.160 * (1.0 + 0.014 * math.log(max(growth / dt / 10.0, 1.0))))
    assert layer.memory[WEAR] == pytest.approx(expected, rel=1e-9)
    assert layer.eps_p / layer.memory[WEAR] == pytest.approx(0.160 * (1.0 + 0.014 * math.log(100.0)), rel=2e-3)


@pytest.mark.parametrize(("start", "factor"), [("130 K", 1.0), ("599.075 K", 3.0)])
def test_damage_by_heat_is_as_the_flow_stress_is(start, factor):
    """D1 = 0.1, D5 = 4; T* is 0 below the reference of 298 K, and a half midway to the melting point of 900 K."""
    heat = {"melt": "900 K", "specific_heat": "560 J/kg/K", "heat_share": 0.0, "start": start}
    layer = layer_of(TITANIUM | {"c": 0.0, "D": [0.1, 0.0, 0.0, 0.0, 4.0]} | heat)
    while layer.eps_p < 0.03:
        layer.strain(np.array([0.0, 0.0, 1e-3]))
    assert layer.eps_p / layer.memory[WEAR] == pytest.approx(0.1 * factor, rel=1e-9)


def test_a_hot_metal_yields_first_at_its_softened_stress_whatever_share_of_work_heats_it():
    """At 500 K the first yield is a (1 - T*^m); without heating by work the start's heat acts all the same."""
    softened = 1098e6 * (1.0 - ((500.0 - 298.15) / 1580.0) ** 1.1)
    for share in (0.0, 0.9):
        layer = layer_of(TITANIUM | HEAT | {"c": 0.0, "start": "500 K", "heat_share": share})
        shear_modulus = 112.2e9 / (2.0 * 1.339)
        layer.strain(np.array([0.0, 0.0, 0.999 * softened / math.sqrt(3.0) / shear_modulus]))
        assert layer.eps_p == 0.0
        layer.strain(np.array([0.0, 0.0, 0.002 * softened / math.sqrt(3.0) / shear_modulus]))
        assert layer.eps_p > 0.0
        assert layer.stress[2] * math.sqrt(3.0) == pytest.approx(softened, rel=1e-3)


def test_a_start_temperature_without_what_softens_by_it_is_refused():
    lines = list(TARGET_LAWS["johnson_cook"].broken_rules(TITANIUM | {"start": "500 K"}, "target.materials.skin"))
    assert "target.materials.skin.start" in lines[0]
    assert "melt and specific_heat" in lines[0]


FLAT = BILINEAR | {"tangent_modulus": "0 MPa"}


@pytest.mark.parametrize("size", [4e-3, 2e-3, 1e-3])
@pytest.mark.parametrize(
    "table",
    [
        FLAT,
        FLAT | {"rate_c": "100 1/s", "rate_p": 1.0},
        BILINEAR | {"tangent_modulus": "5 GPa", "beta": 1.0},
        BILINEAR | {"tangent_modulus": "5 GPa", "beta": 0.0},
        POWER,
        TABLE,
        TITANIUM | HEAT,
    ],
    ids=["flat", "rate", "isotropic", "kinematic", "power", "table", "johnson_cook"],
)
def test_fracture_energy_is_spent_on_every_mesh_by_every_law(table, size):
    """Beyond the failure strain an element softens: its plastic work per area of crack is the fracture energy, G_f.

    Whatever it hardens meanwhile, by its strain or because it strains faster as it unloads; the strain grows by 100/s.
    Its stress, that of its back included, has gone by then.
    """
    layer = layer_of(table | {"failure_strain": 0.01, "fracture_energy": "60 kN/m"}, size)
    energy, most, before, step, steps = 0.0, 0.0, 0.0, 2e-4 * 1e-3 / size, 0
    while not layer.failed:
        before, eps_p = layer.stress[2], layer.eps_p
        most = max(most, before)
        layer.strain(np.array([0.0, 0.0, step]), step / 100.0)
        growth = (layer.eps_p - eps_p) * (layer.eps_p > 0.01)
        energy += math.sqrt(3.0) * 0.5 * (before + layer.stress[2]) * growth * size
        steps += 1
        assert steps < 200000
    assert energy == pytest.approx(60e3, rel=0.02)
    assert before < 0.01 * most


def test_a_layer_without_failure_never_fails():
    law = TARGET_LAWS.validate(POWER)
    assert isinstance(law, Metal)
    layer = Layer(law.row())
    for _ in range(100):
        layer.strain(np.array([0.0, 0.0, 0.1]))
    assert not layer.failed
    assert layer.memory[FLOW] == pytest.approx(350e6 + 426e6 * layer.eps_p**0.34, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"plastic_strain": [0.0, 0.02]}, "3 of flow_stress"),
        ({"plastic_strain": [0.01, 0.02, 0.1]}, "begins at 0.01; its first point is the yield stress, at a plastic"),
        ({"plastic_strain": [0.0, 0.1, 0.1]}, "does not rise at point 3 of 3: 0.1 after 0.1; leave one of the two out"),
        ({"plastic_strain": [0.0, 0.2, 0.1]}, "does not rise at point 3 of 3: 0.1 after 0.2; sort the points"),
        ({"flow_stress": ["300 MPa", "290 MPa", "450 MPa"]}, "falls"),
    ],
)
def test_a_wrong_table_is_refused(change, said):
    table = TABLE | change
    found = list(TARGET_LAWS["tabulated"].broken_rules(table, "target.materials.skin"))
    try:
        TARGET_LAWS.validate(table)
    except ValidationError as error:
        found += [one["msg"] for one in error.errors()]
    assert any(said in line for line in found)


@pytest.mark.parametrize("law", ["bilinear", "power", "tabulated", "johnson_cook"])
def test_a_fracture_energy_that_nothing_spends_is_refused(law):
    found = list(TARGET_LAWS[law].broken_rules({"fracture_energy": "60 kN/m"}, "target.materials.skin"))
    assert found[0].startswith("target.materials.skin.fracture_energy = 60 kN/m does nothing alone; give target.mat")
    ended = {"fracture_energy": "60 kN/m", "failure_strain": 0.1}
    assert not list(TARGET_LAWS[law].broken_rules(ended, "target.materials.skin"))


@pytest.mark.parametrize(
    ("law", "given", "said"),
    [
        (
            "johnson_cook",
            {"D": [0.0] * 5},
            "D = [0.0, 0.0, 0.0, 0.0, 0.0] gives a strain at fracture of 0 in pure shear",
        ),
        ("johnson_cook", {"D": [-50.0, 1.0, 0.0, 0.0, 0.0]}, "gives a strain at fracture of -49 in uniaxial tension"),
        (
            "johnson_cook",
            {"D": [-0.1, 0.11, -1.0, 0.0, 0.0]},
            "strain at fracture of -0.0212 in uniaxial tension, where",
        ),
        (
            "johnson_cook",
            DAMAGE,
            "D: its fifth constant, 3.87, does nothing alone; give target.materials.skin.melt and",
        ),
        (
            "johnson_cook",
            {"rate0": "10 1/s"},
            "rate0 = 10 1/s does nothing alone; give target.materials.skin.c or D too",
        ),
        (
            "bilinear",
            {"rate_p": 4.0},
            "rate_p = 4.0 does nothing alone; give target.materials.skin.rate_c too, or leave",
        ),
        ("power", {"rate_p": 4.0}, "rate_p = 4.0 does nothing alone"),
        ("tabulated", {"rate_p": 4.0}, "rate_p = 4.0 does nothing alone"),
    ],
)
def test_constants_without_an_effect_or_a_strain_at_fracture_are_refused(law, given, said):
    found = list(TARGET_LAWS[law].broken_rules(given, "target.materials.skin"))
    assert any(said in line for line in found), found


@pytest.mark.parametrize("given", [DAMAGE | HEAT, DAMAGE | HEAT | {"rate0": "10 1/s"}, {"c": 0.01, "rate0": "1 1/s"}])
def test_constants_of_the_literature_are_taken(given):
    assert list(TARGET_LAWS["johnson_cook"].broken_rules(given, "target.materials.skin")) == []
