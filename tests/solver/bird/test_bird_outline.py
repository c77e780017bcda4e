"""The lattice against the ideal bird: second moments, density, and when the surface touches."""

from __future__ import annotations

import math

import numpy as np
import pytest

from birdstrike.solver.bird.shape import ALONG, SHAPES, inside, outline, second_moments, volume
from birdstrike.solver.build import bird_lattice, build_particles
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.kernels.bird.smoothing import slope, slope_constant
from birdstrike.solver.simulate import simulate

DIAMETER, LENGTH = 0.106, 0.262


def a_bird(shape: str, **changes: str) -> Case:
    own = {"bird.length": "106 mm"} if shape == "sphere" else {}
    return load_case(
        "virtual_strike", {"bird.shape": shape, **own, **{k.replace("__", "."): v for k, v in changes.items()}}
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_second_moments_are_the_integrals(shape):
    """A million points evenly in the bird's box: their means over the shape."""
    size = np.array([DIAMETER if shape == "sphere" else LENGTH, DIAMETER, DIAMETER])
    points = (np.random.default_rng(0).random((1_000_000, 3)) - 0.5) * size
    kept = inside(points, shape, DIAMETER, LENGTH)
    length = size[0]
    assert kept.mean() * size.prod() == pytest.approx(volume(shape, DIAMETER, length), rel=3e-3)
    means = np.mean(points[kept] ** 2, axis=0)
    assert second_moments(shape, DIAMETER, length) == pytest.approx((means[0], means[1:].mean()), rel=5e-3)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_outline_lies_on_the_surface(shape):
    length = DIAMETER if shape == "sphere" else LENGTH
    points = outline(shape, DIAMETER, length)
    assert np.ptp(points, axis=0) == pytest.approx([length, DIAMETER, DIAMETER], rel=1e-9)
    assert inside((1.0 - 1e-9) * points, shape, DIAMETER, length).all()
    assert not inside((1.0 + 1e-6) * points, shape, DIAMETER, length).any()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("lattice", ["fcc", "cubic"])
@pytest.mark.parametrize("particles", ["500", "2200"])
def test_the_particles_have_the_shape_s_second_moments(shape, lattice, particles):
    bird = a_bird(shape, bird__particles=particles, bird__lattice=lattice).bird
    points, _ = bird_lattice(bird)
    cube = (bird.volume / len(points)) ** (2.0 / 3.0) / 12.0
    means = np.mean(points**2, axis=0) + cube
    wanted = second_moments(shape, bird.diameter, bird.length)
    assert (means[0], means[1:].mean()) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("lattice", ["fcc", "cubic"])
def test_a_stretched_lattice_sees_compression_exactly(lattice):
    """Within the bird, the sum of V x grad W is -1 on average over the directions, as on the undistorted lattice."""
    bird, _ = build_particles(a_bird("hemispherical_cylinder", bird__lattice=lattice))
    x, h = bird.x[: bird.n], bird.h
    middle = np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1))
    apart = np.linalg.norm(x - x[middle], axis=1)
    near = (apart > 0.0) & (apart < 2.0 * h)
    pull = np.array([slope(float(r) / h, slope_constant(h)) for r in apart[near]])
    share = bird.mass / bird.material.rho0
    assert bird.gain * share * float((pull * apart[near] ** 2).sum()) == pytest.approx(-3.0, rel=2e-3)


@pytest.mark.parametrize(
    ("shape", "angle", "yaw"),
    [
        ("hemispherical_cylinder", 30, 0),
        ("ellipsoid", 60, 0),
        ("cylinder", 90, 0),
        ("hemispherical_cylinder", 30, 20),
        ("ellipsoid", 60, -35),
        ("ellipsoid", 90, 35),
        ("cylinder", 90, 10),
        ("cylinder", 40, -25),
    ],
)
def test_the_ideal_surface_touches_after_the_stand_off(shape, angle, yaw):
    """The lowest point of the ideal bird's surface lies as high as it falls until then, and skin/4 more."""
    case = a_bird(shape, impact__angle=f"{angle} deg", impact__aim="axis", impact__yaw=f"{yaw} deg")
    run = Coupling(case)
    alpha, radius, half = math.radians(angle), 0.5 * DIAMETER, 0.5 * LENGTH
    down = math.sin(alpha) * math.cos(math.radians(yaw))  # component of the axis towards the plate
    below = {
        "hemispherical_cylinder": radius + (half - radius) * down,
        "ellipsoid": math.hypot(half * down, radius * math.sqrt(1.0 - down**2)),
        "cylinder": half * down + radius * math.sqrt(1.0 - down**2),
    }[shape]
    bird = run.bird
    height = bird.x[: bird.n, 2].mean() - below - 0.5 * case.plate.thickness
    assert height == pytest.approx(case.impact.standoff * math.sin(alpha) + 0.25 * bird.skin, abs=2e-5)


@pytest.mark.parametrize(("angle", "yaw"), [(60, 25), (90, -15)])
def test_a_yawed_bird_aimed_by_its_first_touch_touches_the_centre(angle, yaw):
    """Its lowest point, radius below the centre of the front hemisphere, flies along the velocity to the plate.

    Within half of the distance between two rings of the outline.
    """
    case = a_bird(
        "hemispherical_cylinder", impact__angle=f"{angle} deg", impact__aim="first_touch", impact__yaw=f"{yaw} deg"
    )
    bird, alpha, turn = build_particles(case)[0], math.radians(angle), math.radians(yaw)
    velocity = np.array([math.cos(alpha), 0.0, -math.sin(alpha)])
    nose = math.cos(turn) * velocity + math.sin(turn) * np.array([0.0, 1.0, 0.0])
    lowest = bird.x[: bird.n].mean(axis=0) + 0.5 * (LENGTH - DIAMETER) * nose - [0.0, 0.0, 0.5 * DIAMETER]
    touch = lowest + (lowest[2] - 0.5 * case.plate.thickness) / math.sin(alpha) * velocity
    np.testing.assert_allclose(touch[:2], 0.0, atol=0.5 * 0.5 * DIAMETER * 0.5 * math.pi / (ALONG - 1))


def test_a_yawed_bird_meets_the_plate_when_the_case_says():
    """Within a particle's skin, like one without yaw."""
    small = {"bird__particles": "500", "plate__elements": "[12, 10]", "impact__standoff": "2 mm"}
    case = a_bird("hemispherical_cylinder", impact__yaw="30 deg", **small)
    run = Coupling(case)
    while run.push <= 0.0 and run.time < 2.0 * case.first_contact:
        touch = run.time
        run.advance()
        run.move()
    assert run.push > 0.0
    assert touch == pytest.approx(case.first_contact, abs=run.bird.skin / case.normal_speed)


def test_a_bird_without_stand_off_begins_outside_the_plate():
    run = Coupling(a_bird("hemispherical_cylinder", impact__standoff="0 mm"))
    assert run.bird.x[: run.bird.n, 2].min() == pytest.approx(run.contact.gap, abs=1e-9)


@pytest.mark.parametrize("particles", ["300", "1500"])
@pytest.mark.parametrize("lattice", ["fcc", "cubic"])
def test_the_clock_counts_to_the_ideal_surface_however_small_the_stand_off(particles, lattice):
    """A bird whose outermost points touch earlier begins before time 0, where it flies as from any other stand-off."""
    flown = []
    for standoff in (0.0, 0.1):
        changes = {"bird__particles": particles, "bird__lattice": lattice, "impact__standoff": f"{standoff} m"}
        case = a_bird("hemispherical_cylinder", **changes)
        bird, begin = build_particles(case)
        assert begin < 0.0 if standoff == 0.0 else begin == 0.0
        flown.append(bird.x[: bird.n] + bird.v[: bird.n] * (standoff / case.impact.speed - begin))
    np.testing.assert_allclose(*flown, atol=1e-12)


def test_the_stand_off_shifts_the_clock_and_nothing_else():
    """By the time of flight, for one so small that the bird begins before time 0; the rest is the other time step's."""
    near, far = (
        a_bird("hemispherical_cylinder", impact__standoff=standoff, time__end=end, bird__particles="1000")
        for standoff, end in (("0 mm", "0.8 ms"), ("20 mm", "1.2 ms"))
    )
    run, later = (simulate(case, threads=1) for case in (near, far))
    assert Coupling(near).begin < -1e-5
    expected = later.at("displacement_centre", run.time + 20e-3 / near.impact.speed)
    assert np.abs(run.channels["displacement_centre"] - expected).max() < 0.01 * expected.max()


def test_lattices_agree():
    """Displacement under birds of the same shape on other lattices and numbers: within 1 % of the peak."""
    lattices = (("fcc", "950"), ("cubic", "950"), ("fcc", "1000"), ("fcc", "1050"))
    birds = [
        a_bird("hemispherical_cylinder", bird__particles=n, bird__lattice=k, time__end="1.2 ms") for k, n in lattices
    ]
    curves = np.stack([simulate(case, threads=1).channels["displacement_centre"] for case in birds])
    rms = np.sqrt(np.mean((curves - curves.mean(axis=0)) ** 2))
    assert rms < 0.01 * curves.max()
