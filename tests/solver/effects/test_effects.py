"""Effects against analytic truths, their place in a case, and effects of one's own."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.data.units import to_si
from birdstrike.solver.build import stiffness_of
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.effects import shown, stated
from birdstrike.solver.case.write import case_toml
from birdstrike.solver.effects.bird import porous_points
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.plate import PLATE, bending_stiffness
from birdstrike.solver.effects.registry import effects, effects_of, register, unregister
from birdstrike.solver.sensors.instrument import recorded

CASE = load_case("virtual_strike")
NAMES = [
    "clamp_rotation",
    "edge_slip",
    "plate_thickness",
    "plate_modulus",
    "plate_density",
    "plate_yield",
    "plate_hardening",
    "plate_rate_hardening",
    "plate_damping",
    "plate_preload",
    "impact_speed",
    "impact_angle",
    "impact_offset",
    "impact_offset_across",
    "bird_yaw",
    "bird_mass",
    "bird_length",
    "bird_porosity",
    "bird_friction",
    "time_offset",
    "sensor_gain",
    "sensor_bandwidth",
    "sensor_drift",
]


def test_the_library_is_the_twenty_three_of_the_format_and_rivet_strength() -> None:
    """Which no plate has, see `tests/solver/target/test_links.py`."""
    assert list(effects()) == [*NAMES[:10], "rivet_strength", *NAMES[10:]]


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_changes_the_strike_and_zero_changes_nothing(name: str) -> None:
    effect = effects()[name]
    changed = CASE.with_effects({name: effect.size(CASE)})
    assert changed.canonical() != CASE.canonical()
    assert changed.resolved().canonical() == changed.canonical()
    assert CASE.with_effects({name: 0.0}).canonical() == CASE.canonical()
    assert effect.meaning
    assert effect.source
    assert effect.size(CASE) > 0.0


def test_a_magnitude_is_relative_to_what_the_case_declares() -> None:
    thinner = CASE.with_values({"plate.thickness": 0.008}).with_effects({"plate_thickness": 2e-4})
    assert thinner.plate.thickness == pytest.approx(0.0082)
    later = CASE.with_effects({"plate_thickness": 2e-4}).with_values({"plate.thickness": 0.008})
    assert later.plate.thickness == pytest.approx(0.0082)


def test_springs_stand_in_series_with_the_declared_edges() -> None:
    table = {"plate.edges": '{ rotational = "100 kN*m/rad/m" }'}
    case = load_case("virtual_strike", table).with_effects({"clamp_rotation": 1e-5})
    assert not isinstance(case.plate.edges, str)
    assert case.plate.edges.rotational == pytest.approx(1.0 / (1e-5 + 1e-5))


def test_one_set_of_nodes_can_give_way_alone() -> None:
    case = load_case("flat_plate_002", {"effects.clamp_rotation.cell_3": "5 mrad/kN"})
    assert case.target is not None
    held = {name: springs.rotational for name, springs in case.target.supports.items() if not isinstance(springs, str)}
    assert held.pop("cell_3") == pytest.approx(1e5)  # 200 kN m/rad per m in series with as much
    assert set(held.values()) == {2e5}
    assert case.effects == {"clamp_rotation.cell_3": pytest.approx(5e-6)}
    assert stated(case)[0].startswith("effects.clamp_rotation.cell_3 = +5 mrad/kN")
    assert load_case(tomllib.loads(case_toml(case))).canonical() == case.canonical()


def test_sets_are_those_that_hold_the_target_and_a_single_one_is_the_whole_support() -> None:
    cells = effects_of(load_case("flat_plate_002"))
    assert [name for name in cells if name.startswith("edge_slip.")] == [f"edge_slip.cell_{i}" for i in range(1, 9)]
    pinned = effects_of(load_case("flat_plate_002", {"target.supports.cell_2": "pinned"}))
    assert set(cells) - set(pinned) == {"clamp_rotation.cell_2"}
    assert list(effects_of(load_case("openradioss_panel"))) == list(effects())
    assert list(effects_of(CASE)) == list(effects())


@pytest.mark.parametrize(
    ("case", "key", "message"),
    [
        ("flat_plate_002", "clamp_rotation.cell_9", r'no.*set of nodes "cell_9"; its supports are cell_1, cell_2'),
        ("virtual_strike", "clamp_rotation.left", r'set of nodes "left"; it has no supports by name'),
        ("flat_plate_002", "bird_friction.cell_1", "must be one magnitude"),
    ],
)
def test_a_place_that_an_effect_does_not_have_is_named(case: str, key: str, message: str) -> None:
    with pytest.raises(CaseError, match=message):
        load_case(case, {f"effects.{key}": "5 mrad/kN"})


def test_a_name_without_its_set_is_an_error() -> None:
    table = {"extends": "flat_plate_002", "effects": {"clamp_rotation.": "5 mrad/kN"}}
    with pytest.raises(CaseError, match="names no set of nodes"):
        load_case(table)


BESIDE = {"clamp_rotation": pytest.approx(5e-6), "clamp_rotation.cell_3": pytest.approx(2e-6)}


@pytest.mark.parametrize("declared", ["5 mrad/kN", {"cell_3": "1 mrad/kN"}])
def test_all_sets_and_one_alone_are_overridden_beside_each_other(declared: Any) -> None:
    base = {"extends": "flat_plate_002", "effects": {"clamp_rotation": declared}}
    whole, alone = {"effects.clamp_rotation": "5 mrad/kN"}, {"effects.clamp_rotation.cell_3": "2 mrad/kN"}
    assert load_case(base, whole | alone).effects == BESIDE
    one = alone if isinstance(declared, str) else whole
    assert set(load_case(base, one).effects) == set(BESIDE)
    none = {"effects.clamp_rotation": "0 mrad/kN", "effects.clamp_rotation.cell_3": "0 mrad/kN"}
    assert load_case(base, none).effects == {}


def test_one_set_that_is_named_in_two_ways_is_an_error() -> None:
    twice = {"clamp_rotation": {"cell_3": "5 mrad/kN"}, "clamp_rotation.cell_3": "2 mrad/kN"}
    with pytest.raises(CaseError, match="also named behind a dot"):
        load_case({"extends": "flat_plate_002", "effects": twice})


def test_the_line_of_one_set_says_which() -> None:
    case = load_case("flat_plate_002", {"effects.edge_slip.cell_3": "1 mm^2/kN"})
    assert stated(case)[0].endswith("slip inwards, at cell_3 alone")


def test_mass_and_length_keep_what_they_promise() -> None:
    heavy = CASE.with_effects({"bird_mass": 0.05}).bird
    assert heavy.actual_mass == pytest.approx(CASE.bird.actual_mass + 0.05)
    assert (heavy.length, heavy.diameter) == (CASE.bird.length, CASE.bird.diameter)
    long = CASE.with_effects({"bird_length": 0.01}).bird
    assert long.actual_density == pytest.approx(CASE.bird.actual_density)
    assert long.actual_mass > CASE.bird.actual_mass


def test_porosity_gives_woods_compressibility_at_rest() -> None:
    """1/K = (1 - z)/K_law + z / (1.4 p_atm) (Wood 1930)."""
    z = 0.02
    mu, p = porous_points(CASE, z)
    slope = np.gradient(p, mu)[np.searchsorted(mu, 0.0)]
    law = CASE.bird.material.eos.build(CASE.bird.actual_density)
    softness = (1.0 - z) / law.bulk_modulus + z / (1.4 * 101325.0)
    assert slope == pytest.approx(1.0 / softness, rel=1e-3)
    assert CASE.with_effects({"bird_porosity": z}).bird.actual_mass == pytest.approx(CASE.bird.actual_mass)


def test_rate_hardening_is_the_stated_gain_at_100_per_second() -> None:
    metal = CASE.with_effects({"plate_rate_hardening": 0.3}).plate.material
    assert (100.0 / metal.rate_c) ** (1.0 / metal.rate_p) == pytest.approx(0.3)


def test_a_slow_transducer_has_the_phase_of_a_first_order_low_pass() -> None:
    """A sine comes out smaller by 1/sqrt(1 + (w tau)^2) and late by atan(w tau)."""
    tau, omega, t = 5e-5, 2.0 * math.pi * 2000.0, np.arange(0.0, 0.02, 5e-6)
    slow = CASE.with_effects({"sensor_bandwidth": tau}).instrument["displacement_centre"]
    late = recorded(slow, t, np.sin(omega * t))[t > 0.01]
    basis = np.stack([np.sin(omega * t), np.cos(omega * t)], axis=1)[t > 0.01]
    sine, cosine = np.linalg.lstsq(basis, late)[0]
    assert math.hypot(sine, cosine) == pytest.approx(1.0 / math.hypot(1.0, omega * tau), rel=1e-3)
    assert math.atan2(-cosine, sine) == pytest.approx(math.atan(omega * tau), rel=1e-3)


def test_bandwidth_may_be_stated_in_hertz() -> None:
    case = load_case("virtual_strike", {"effects.sensor_bandwidth": "5 kHz"})
    assert case.instrument["displacement_centre"].bandwidth == pytest.approx(5000.0)
    assert "reaction_force" not in case.instrument  # of the displacement transducers alone


def test_sizes_follow_the_case() -> None:
    thick = CASE.with_values({"plate.thickness": 0.02})
    clamp = PLATE[0]
    assert bending_stiffness(thick) == pytest.approx(8.0 * bending_stiffness(CASE))
    assert clamp.size(thick) == pytest.approx(clamp.size(CASE) / 8.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"effects.bird_porosity": "-0.1"}, "effects.bird_porosity = -0.1 is below 0,"),
        ({"effects.plate_thickness": "0.2"}, "has no unit"),
        ({"effects.plate_thickness": "-9.99 mm"}, r"plate_thickness = -9.99 mm is beyond -9.8\d+ mm, the largest"),
        (
            {"effects.impact_angle": "65 deg"},
            r"\+65 deg is beyond \+59.9\d* deg, .*\(impact.angle =",
        ),
        (
            {"effects.clamp_rotation": "1e-8 mrad/kN"},
            r"clamp_rotation = \+1e-08 mrad/kN is nearer to 0 than \+0.001 mrad/kN, the smallest that fits this case; "
            r"write \+0.001 mrad/kN, or leave the effect out \(plate.edges.rotational = ",
        ),
        ({"effects.bird_porosity": "0.999"}, r"beyond \+0.9\d, the largest .*mu.77 = 21.03\d* is .*, and 25 more\)"),
        ({"effects.sensor_gain": "'3 %'"}, "write a bare number"),
        ({"effects.clamp_rotation": "1 mrad/kN", "plate.edges": "pinned"}, "do not hold it at all"),
        ({"effects.plate_modulus": "1 GPa", "plate.rigid": "true"}, r"plate_modulus: a rigid plate neither bends"),
        ({"effects.plate_density": "60 kg/m^3", "plate.rigid": "true"}, r"plate_density: a rigid plate neither bends"),
        (
            {"effects.plate_modulus": "-72 GPa"},
            r"= -72000 MPa is below -71000 MPa, the least that means anything",
        ),
        (
            {"effects.plate_density": "3 t/m^3", "plate.material.density": "24 g/cm^3"},
            r"beyond \+1000 kg/m³, the larg",
        ),
        (
            {"effects.bird_yaw": "3 deg", "bird.shape": "sphere", "bird.length": "106 mm"},
            "effects.bird_yaw: a sphere has no axis that could be turned",
        ),
        ({"effects.bird_yaw": "-50 deg"}, r"= -50 deg is beyond -45 deg, the largest that fits .*\(impact.yaw = "),
        ({"effects.impact_offset_across": "3 m"}, r"is beyond \+2500 mm, the largest .*\(impact.offset.1 = "),
    ],
)
def test_wrong_magnitudes_are_named(given: dict[str, str], words: str) -> None:
    with pytest.raises(CaseError) as caught:
        load_case("virtual_strike", given)
    assert any(re.search(words, line) for line in caught.value.errors)
    assert caught.value.heading == "case virtual_strike: 1 error"


def test_a_case_states_its_effects_in_the_engineers_units() -> None:
    assert stated(CASE) == []
    (line,) = stated(CASE.with_effects({"plate_thickness": 2e-4}))
    assert line.startswith("effects.plate_thickness = +0.2 mm: ")
    assert shown(-0.0, "m") == "0 mm"


@pytest.fixture
def own() -> Iterator[Effect]:
    """An effect of a user's own."""

    def change(case: Case, x: float) -> dict[str, object]:
        return {"plate": {"length": f"{case.plate.length + x} m"}}

    yield register(Effect("plate_span", "a longer plate", "m", change, lambda _: 0.02))
    unregister("plate_span")


def test_the_limit_that_an_error_names_is_one_that_fits() -> None:
    """Whatever effect goes too far: the magnitude that its error offers is accepted, and a little more is not."""
    far = {"plate_yield": 1e11, "plate_preload": -4e8, "impact_speed": -91.05, "edge_slip": 1e-18, "sensor_gain": 200.0}
    for name, value in far.items():
        with pytest.raises(CaseError) as caught:
            CASE.with_effects({name: value})
        found = re.search(r"; write (\S+)( \S+)?, or leave", caught.value.errors[0])
        assert found, caught.value.errors
        text = f"{found[1]}{found[2] or ''}"
        limit = to_si(text, effects()[name].unit) if found[2] else float(text)
        CASE.with_effects({name: limit})
        with pytest.raises(CaseError):
            CASE.with_effects({name: limit * (0.95 if abs(value) < abs(limit) else 1.05)})


def test_an_effect_of_ones_own_that_fails_is_told_by_its_name() -> None:
    def change(case: Case, _: float) -> dict[str, object]:
        return {"plate": {"thickness": case.plate.rivets}}  # type: ignore[attr-defined]

    register(Effect("rivets", "loose rivets", "", change, lambda _: 1.0))
    try:
        with pytest.raises(CaseError, match=r"effects\.rivets = \+1 .*`change` failed: AttributeError.*rivets"):
            CASE.with_effects({"rivets": 1.0})
    finally:
        unregister("rivets")


def test_an_effect_of_ones_own_is_stated_like_any_other(own: Effect, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('extends = "virtual_strike"\n[effects]\nplate_span = "40 mm"\n')
    case = load_case(tmp_path / "own.toml")
    assert case.plate.length == pytest.approx(0.565)
    with pytest.raises(ValueError, match="exists already"):
        register(own)


RIGS = {
    "flat": ("demo", {}),
    "curved": ("demo", {"plate.radius": "2000 mm"}),
    "pinned": ("demo", {"plate.edges": "pinned"}),
    "sprung": ("demo", {"plate.edges": '{rotational = "1e5 N m/rad/m"}'}),
    "short bird": ("demo", {"bird.shape": "cylinder", "bird.diameter": "106 mm", "bird.length": "80 mm"}),
    "rates": ("demo", {"plate.material.rate_c": "100 1/s", "plate.material.rate_p": "20"}),
    "load cells": ("flat_plate_002", {}),
    "panel": ("openradioss_panel", {}),
    "sidewall": ("sidewall_004", {}),
}


@pytest.mark.parametrize("rig", RIGS)
def test_every_effect_that_a_case_does_not_refuse_fits_it_at_its_plausible_size(rig: str) -> None:
    """A curved panel holds no tension, and a flat-ended bird may be shorter than wide: a diagnosis failed at either."""
    case = load_case(*RIGS[rig])
    carried = {name: effect for name, effect in effects().items() if not effect.refuses(case)}
    assert len(carried) > 10
    for name, effect in carried.items():
        for size in (effect.size(case), -effect.size(case)):
            if size >= effect.least(case):
                assert case.with_effects({name: size}).resolved().canonical() != case.canonical(), name


@pytest.mark.parametrize("gain", [0.01, 0.001])
def test_a_small_rate_hardening_has_the_stated_size(gain: float) -> None:
    """It was held at 0.0178 by a limit of C."""
    metal = CASE.with_effects({"plate_rate_hardening": gain}).plate.material
    assert (100.0 / metal.rate_c) ** (1.0 / metal.rate_p) == pytest.approx(gain)


def test_declared_rate_hardening_can_be_weakened_to_its_least() -> None:
    case = load_case("demo", {"plate.material.rate_c": "100 1/s", "plate.material.rate_p": "20"})
    least = effects()["plate_rate_hardening"].least(case)
    assert -1.0 < least < -0.95
    assert case.with_effects({"plate_rate_hardening": least}).resolved().plate.material.rate_c > 1e28


def test_damping_of_a_target_adds_to_what_it_declares() -> None:
    case = load_case("openradioss_panel", {"target.damping": "30 1/s"})
    target = case.with_effects({"plate_damping": 20.0}).resolved().target
    assert target is not None
    assert target.damping == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"radius": "2 m"}, "plate.radius of an effect has no place in a target"),
        ({"material": {"tangent_modulus": "500 MPa"}}, "which has no tangent_modulus"),
    ],
)
def test_what_a_target_has_no_place_for_is_refused(change: dict[str, Any], said: str) -> None:
    """It was dropped, or written into the yield stress."""
    register(Effect("own_change", "another plate", "", lambda *_: {"plate": change}, lambda _: 1.0))
    try:
        with pytest.raises(CaseError, match=said):
            load_case("openradioss_panel").with_effects({"own_change": 1.0}).resolved()
    finally:
        unregister("own_change")


@pytest.mark.parametrize("beyond", [0.0, 2e-16])
@pytest.mark.parametrize(
    ("springs", "effect", "key"),
    [
        ({"rotational": "75e3 N m/rad/m"}, "clamp_rotation", "rotational"),
        ({"rotational": "60e3 N m/rad/m", "in_plane": "3e9 Pa"}, "clamp_rotation", "rotational"),
        ({"in_plane": "3e9 Pa"}, "edge_slip", "in_plane"),
    ],
)
def test_springs_whose_whole_compliance_an_effect_takes_away_are_rigid(
    springs: dict[str, str], effect: str, key: str, beyond: float
) -> None:
    """At exactly the declared compliance the springs had stayed, next to it they were stiffer than a case may state."""
    case = load_case({**CASE.table, "plate": {**CASE.table["plate"], "edges": springs}})
    compliance = -effects()[effect].least(case)
    rigid = case.with_effects({effect: -compliance * (1.0 - beyond)})
    assert getattr(stiffness_of(rigid.plate.edges), key) == np.inf
    other = {name: value for name, value in springs.items() if name != key}
    kept = load_case({**CASE.table, "plate": {**CASE.table["plate"], "edges": other or "clamped"}})
    assert stiffness_of(rigid.plate.edges) == stiffness_of(kept.plate.edges)


def test_a_set_of_nodes_whose_springs_are_taken_away_is_clamped() -> None:
    case = load_case("flat_plate_002")
    least = effects_of(case)["clamp_rotation.cell_3"].least(case)
    rigid = case.with_effects({"clamp_rotation.cell_3": least}).target
    assert rigid is not None
    assert stiffness_of(rigid.supports["cell_3"]).rotational == np.inf
    assert stiffness_of(rigid.supports["cell_2"]).rotational == pytest.approx(2e5)
