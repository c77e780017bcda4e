"""Effects as a case states them, through the plate, bird and record that are then built, against their truths."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.reports.verification.problems.plate import RITZ
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.build import build_bird, build_plate
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.reference.plate_ritz import RitzPlate, ritz_frequencies
from birdstrike.solver.sensors.instrument import recorded
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.modes import natural_frequencies

CASE = load_case("virtual_strike", {"bird.particles": "3000"})
CLAMPED_HZ = 397.7  # of the case's plate, 525 x 430 x 10 mm of aluminium (Mindlin, Ritz)
MESH = 0.007  # relative error of the first frequency on the case's 25 x 20 shells


def size(name: str) -> float:
    """Plausible magnitude of an effect, SI."""
    return effects()[name].size(CASE)


def plate_with(**magnitudes: float) -> Target:
    """The plate that the solver builds for the case with effects."""
    plate = build_plate(CASE.with_effects(magnitudes))
    assert plate.strains
    return plate


def bird_with(**magnitudes: float) -> Bird:
    """Its SPH bird."""
    bird, _ = build_bird(CASE.with_effects(magnitudes))
    assert isinstance(bird, Bird)
    return bird


def first(plate: Target) -> float:
    return float(natural_frequencies(plate, 1)[0][0])


@cache
def bare() -> float:
    """First frequency [Hz] without an effect."""
    return first(plate_with())


@cache
def ritz(plate: RitzPlate) -> float:
    """First frequency [Hz] by Ritz."""
    return float(ritz_frequencies(plate, 1)[0])


@pytest.mark.parametrize("sizes", [0.25, 4.0])
def test_a_soft_clamp_has_the_first_frequency_of_a_plate_on_those_springs(sizes: float) -> None:
    compliance = sizes * size("clamp_rotation")
    found, truth = first(plate_with(clamp_rotation=compliance)), ritz(replace(RITZ, rotational=1.0 / compliance))
    assert found == pytest.approx(truth, rel=MESH)
    lowered = CLAMPED_HZ - truth
    assert lowered > 0.03 * CLAMPED_HZ
    assert bare() - found == pytest.approx(lowered, rel=0.02)


@pytest.mark.parametrize("places", [("cell_1", "cell_5"), ("cell_3", "cell_7")])
def test_sets_that_give_way_each_alone_add_up_to_all_of_them(places: tuple[str, str]) -> None:
    """To first order a spring changes the square of a frequency by its own work in the mode (Rayleigh).

    Sets that lie opposite each other work alike.
    """
    case, step = load_case("flat_plate_002", {"target.generator.element_size": "50 mm"}), 1e-8

    def square(magnitudes: dict[str, float]) -> float:
        return first(build_plate(case.with_effects(magnitudes))) ** 2

    rigid = square({})
    alone = {f"cell_{i}": rigid - square({f"clamp_rotation.cell_{i}": step}) for i in range(1, 9)}
    assert sum(alone.values()) == pytest.approx(rigid - square({"clamp_rotation": step}), rel=0.01)
    assert alone[places[0]] == pytest.approx(alone[places[1]], rel=1e-4)
    assert min(alone.values()) > 0.0


def test_a_frame_that_slips_leaves_small_vibrations_alone() -> None:
    """In-plane compliance acts by the membrane, at second order of the deflection (Timoshenko, sect. 96)."""
    slipping = plate_with(edge_slip=size("edge_slip"))
    assert slipping.supports.springs[:, 0].all()
    assert first(slipping) == pytest.approx(bare(), rel=1e-6)


def test_another_thickness_has_its_own_first_frequency() -> None:
    change = -4e-4
    found, truth = first(plate_with(plate_thickness=change)), ritz(replace(RITZ, thickness=RITZ.thickness + change))
    assert found == pytest.approx(truth, rel=MESH)
    assert found - bare() == pytest.approx(truth - CLAMPED_HZ, rel=0.02)


@pytest.mark.parametrize("change", [-0.1, 0.02])
def test_the_first_frequency_goes_as_the_root_of_modulus_over_density(change: float) -> None:
    """omega^2 = 1296 D / (b^4 rho h), D in proportion to E (Leissa 1969)."""
    metal = CASE.plate.material
    stiffer, denser = plate_with(plate_modulus=change * metal.young), plate_with(plate_density=change * metal.density)
    assert first(stiffer) / bare() == pytest.approx(math.sqrt(1.0 + change), rel=1e-6)
    assert first(denser) / bare() == pytest.approx(1.0 / math.sqrt(1.0 + change), rel=1e-6)
    assert float(denser.mass.sum()) == pytest.approx((1.0 + change) * float(plate_with().mass.sum()), rel=1e-12)


def test_preload_shifts_the_square_of_the_first_frequency_by_the_membrane_s_work() -> None:
    """omega^2 = omega_0^2 + c N with Rayleigh's c, a little concave because the shape follows (Ritz has both)."""
    for tension in (size("plate_preload"), -size("plate_preload")):
        shift = first(plate_with(plate_preload=tension)) ** 2 - bare() ** 2
        truth = ritz(replace(RITZ, tension=(tension, tension))) ** 2 - ritz(RITZ) ** 2
        assert shift == pytest.approx(truth, rel=0.01)


def test_damping_of_a_plausible_size_is_a_twentieth_of_critical() -> None:
    damping = plate_with(plate_damping=size("plate_damping")).nodes.damping
    assert damping / (2.0 * math.pi * CLAMPED_HZ) == pytest.approx(0.05, rel=0.3)


@pytest.mark.parametrize("change", [-0.036, 0.036])
def test_a_heavier_bird_is_denser_and_of_the_same_size(change: float) -> None:
    other, bird = bird_with(bird_mass=change), bird_with()
    assert other.n * other.mass == pytest.approx(bird.n * bird.mass + change, rel=1e-12)
    np.testing.assert_allclose(other.x[: other.n], bird.x[: bird.n], rtol=0, atol=1e-12)


def test_a_longer_bird_weighs_as_much_more_as_its_cylinder_grew() -> None:
    """Its mass is exact; its extent steps with the lattice, whose layers, 0.79 spacings apart, lie where they fall."""
    change, width = 0.020, CASE.bird.diameter
    other, bird = bird_with(bird_length=change), bird_with()
    more = CASE.bird.actual_density * 0.25 * math.pi * width**2 * change
    assert other.n * other.mass - bird.n * bird.mass == pytest.approx(more, rel=1e-9)
    layer = 0.5 * (4.0 * other.mass / CASE.bird.actual_density) ** (1.0 / 3.0)
    for found, length in ((bird, CASE.bird.length), (other, CASE.bird.length + change)):
        steps = along_solid(length + layer) - along_solid(length)
        assert along(found) == pytest.approx(along_solid(length), abs=steps)


def test_air_in_the_bird_leaves_its_mass_and_size() -> None:
    other, bird = bird_with(bird_porosity=0.05), bird_with()
    assert other.n * other.mass == pytest.approx(bird.n * bird.mass, rel=1e-12)
    np.testing.assert_array_equal(other.x[: other.n], bird.x[: bird.n])
    softness = 0.95 / bird.material.bulk_modulus + 0.05 / (1.4 * 101325.0)  # Wood
    assert other.material.bulk_modulus == pytest.approx(1.0 / softness, rel=0.01)


def axis() -> Array:
    """Direction of flight (3,), along which the bird lies."""
    return np.array([math.cos(CASE.impact.angle), 0.0, -math.sin(CASE.impact.angle)])


def along(bird: Bird) -> float:
    """Root of the second moment of the particles' places along the bird [m]."""
    return float((bird.x[: bird.n] @ axis()).std())


def along_solid(length: float) -> float:
    """The same of the solid, a cylinder with hemispherical ends of that overall length."""
    radius = 0.5 * CASE.bird.diameter
    s = np.linspace(-0.5 * length, 0.5 * length, 20_001)
    beyond = np.maximum(np.abs(s) - (0.5 * length - radius), 0.0)
    section = radius**2 - beyond**2
    return math.sqrt(float(section @ s**2 / section.sum()))


def test_speed_and_angle_are_those_of_every_particle() -> None:
    v = bird_with(impact_speed=2.0, impact_angle=math.radians(1.0)).v
    assert np.linalg.norm(v, axis=1) == pytest.approx(CASE.impact.speed + 2.0)
    assert np.arctan2(-v[:, 2], v[:, 0]) == pytest.approx(CASE.impact.angle + math.radians(1.0))


def test_the_bird_arrives_beside_the_point_of_aim() -> None:
    """On a flat plate the whole flight is carried along by the offset."""
    moved = bird_with(impact_offset=0.012).x - bird_with().x
    np.testing.assert_allclose(moved, np.tile([0.012, 0.0, 0.0], (len(moved), 1)), atol=1e-12)


def test_the_bird_arrives_beside_the_point_of_aim_across_its_flight() -> None:
    moved = bird_with(impact_offset=0.012, impact_offset_across=-0.008).x - bird_with().x
    np.testing.assert_allclose(moved, np.tile([0.012, -0.008, 0.0], (len(moved), 1)), atol=1e-12)


@pytest.mark.parametrize("yaw", [math.radians(3.0), math.radians(-40.0)])
def test_yaw_is_the_angle_between_axis_and_velocity_towards_the_width(yaw: float) -> None:
    """The bird turns as a rigid body: its mass, the velocity of every particle and all distances stay."""
    other, bird = bird_with(bird_yaw=yaw), bird_with()
    x, arm = other.x[: other.n], other.x[: other.n] - other.x[: other.n].mean(axis=0)
    longest = np.linalg.eigh(arm.T @ arm)[1][:, -1]
    nose = longest * np.sign(longest @ axis())
    np.testing.assert_allclose(nose, math.cos(yaw) * axis() + math.sin(yaw) * np.array([0.0, 1.0, 0.0]), atol=1e-9)
    assert (other.n, other.mass) == (bird.n, bird.mass)
    np.testing.assert_array_equal(other.v, bird.v)
    before = bird.x[: bird.n]
    distances = [np.linalg.norm(np.diff(points, axis=0), axis=1) for points in (x, before)]
    np.testing.assert_allclose(*distances, atol=1e-12)


def test_a_declared_yaw_and_that_of_the_effect_add_up() -> None:
    declared = CASE.overlaid({"impact": {"yaw": "2 deg"}}).with_effects({"bird_yaw": math.radians(3.0)})
    assert declared.impact.yaw == pytest.approx(math.radians(5.0))
    np.testing.assert_allclose(build_bird(declared)[0].x, bird_with(bird_yaw=math.radians(5.0)).x, atol=1e-12)


def test_a_bird_without_yaw_is_the_same_strike_to_the_bit() -> None:
    straight = CASE.overlaid({"impact": {"yaw": "0 deg", "offset": ["0 mm", "0 mm"]}})
    assert case_hash(straight) == case_hash(CASE)
    np.testing.assert_array_equal(build_bird(straight)[0].x, bird_with().x)


@pytest.mark.parametrize("name", ["impact_offset_across", "bird_yaw"])
def test_the_opposite_magnitude_bends_the_plate_in_mirror_image(name: str) -> None:
    """Mirrored at the plane of flight; the side that the bird turns or arrives at is the one that gives way more."""
    small = load_case(
        "virtual_strike",
        {"bird.particles": "300", "plate.elements": "[12, 10]", "time.end": "0.5 ms", "time.snapshots": "[]"},
    )
    sides = {side: {"kind": "displacement", "at": ["0 mm", f"{y} mm"]} for side, y in (("near", 60), ("far", -60))}
    case = small.with_sensors(sides)
    one, other = (simulate(case.with_effects({name: x * size(name)}), threads=1).channels for x in (2.0, -2.0))
    peak = one["near"].max()
    np.testing.assert_allclose(one["near"], other["far"], atol=1e-6 * peak)
    np.testing.assert_allclose(one["far"], other["near"], atol=1e-6 * peak)
    assert one["near"].max() > 1.01 * one["far"].max()


TIME = np.arange(0.0, 3e-3, 5e-6)
SINE = 0.005 * np.sin(2.0 * math.pi * 1000.0 * TIME)


@pytest.mark.parametrize(
    ("name", "x", "truth"),
    [
        ("time_offset", 4e-5, 0.005 * np.sin(2.0 * math.pi * 1000.0 * np.maximum(TIME - 4e-5, 0.0))),
        ("sensor_gain", -0.03, 0.97 * SINE),
        ("sensor_drift", 0.2, SINE + 0.2 * TIME),
    ],
)
def test_the_record_is_what_the_instrument_makes_of_the_signal(name: str, x: float, truth: Array) -> None:
    instruments = CASE.with_effects({name: x}).instrument
    np.testing.assert_allclose(recorded(instruments["displacement_centre"], TIME, SINE), truth, atol=1e-12)
    assert ("reaction_force" in instruments) == (name == "time_offset")  # one trigger for all, electronics for each
