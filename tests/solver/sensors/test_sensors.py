"""Sensors: interpolated displacement, surface strain, pressure, and sampling that lets no alias through."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from birdstrike.reports.verification.columns import SEED
from birdstrike.reports.verification.problems.target import gauge_under_a_layer
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.case.struck import UP
from birdstrike.solver.contact import Contact
from birdstrike.solver.sensors.places import blend, place_on, point_at
from birdstrike.solver.sensors.recording import readings
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.sensors.sensor import Sensor
from birdstrike.solver.sensors.strain import of_rosette
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import ShellMesh, plate_mesh, shell_mesh
from birdstrike.solver.target.rectangle import plate_of, rigid_plate_of
from birdstrike.solver.target.section import ShellMaterial

ALUMINIUM = ShellMaterial(71e9, 0.3, 2780.0)
THICKNESS = 0.01


def distorted(radius: float = math.inf) -> ShellMesh:
    """A 200 x 160 mm mesh of skewed quadrilaterals, flat or on the panel z = x^2/(2 R)."""
    mesh = plate_mesh(0.2, 0.16, (10, 8))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.rim)
    mesh.nodes[inner, :2] += np.random.default_rng(0).uniform(-0.005, 0.005, (len(inner), 2))
    mesh.nodes[:, 2] = mesh.nodes[:, 0] ** 2 / (2.0 * radius)
    return shell_mesh(mesh.nodes, mesh.quads)


def strike_on(plate: Target) -> SimpleNamespace:
    """As much of a strike as gauges read."""
    return SimpleNamespace(
        plate=plate, contact=SimpleNamespace(spacing=5e-3), push=0.0, reaction=np.zeros(3), normal=UP
    )


def read(plate: Target, move, sensors: dict[str, Sensor]) -> dict[str, float]:
    """Readings after `move(plate)` has set velocities and one step of 1 s was taken."""
    strike = strike_on(plate)
    found = readings(sensors, strike)  # pyright: ignore[reportArgumentType]
    move(plate)
    plate.update_forces(1.0)
    return {name: reading(strike) for name, reading in found.items()}  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("degrees", [0.0, 25.0, 45.0, 110.0])
def test_a_rosette_finds_the_principal_strains_however_it_is_laid(degrees):
    """Mohr's circle; a tension that narrows the surface by half of itself has itself as its effective strain."""
    one, two = 4e-3, -2e-3
    angles = np.radians(degrees + np.array([0.0, 45.0, 90.0]))
    first, between, second = one * np.cos(angles) ** 2 + two * np.sin(angles) ** 2
    assert of_rosette(first, between, second, principal=True) == pytest.approx(one, rel=1e-12)
    assert of_rosette(first, between, second, principal=False) == pytest.approx(one, rel=1e-12)


@pytest.mark.parametrize("radius", [math.inf, 0.3])
@pytest.mark.parametrize("at", [(0.0, 0.0), (0.013, -0.037), (0.1, 0.08), (-0.0999, 0.02)])
def test_a_place_on_any_quadrilaterals_is_found(radius, at):
    mesh = distorted(radius)
    assert point_at(mesh, *place_on(mesh, at))[:2] == pytest.approx(at, abs=1e-9)


def test_displacement_of_a_linear_field_is_exact_anywhere():
    plate = plate_of(distorted(0.3), THICKNESS, ALUMINIUM, "free")
    sensors = {"a": SENSORS.validate({"kind": "displacement", "at": ["13 mm", "-37 mm"]})}
    found = readings(sensors, strike_on(plate))  # pyright: ignore[reportArgumentType]
    plate.x[:, 2] -= 0.002 + 0.03 * plate.x[:, 0] - 0.05 * plate.x[:, 1]
    expected = 0.002 + 0.03 * 0.013 + 0.05 * 0.037
    assert found["a"](strike_on(plate)) == pytest.approx(expected, abs=1e-12)  # pyright: ignore[reportArgumentType]


def gauge(at=("13 mm", "-37 mm"), **fields) -> Sensor:
    return SENSORS.validate({"kind": "strain", "at": at, **fields})


def test_directions_on_a_slope_are_those_of_the_shell():
    """eyy = 2e-4 alone on z = x^2/(2 R), 32 degrees steep: 45 degrees read half of it, and a rosette its invariants."""
    plate = plate_of(distorted(0.15), THICKNESS, ALUMINIUM, "free")
    at = ("80 mm", "-10 mm")
    sensors = {
        "slanted": gauge(at, direction="45 deg"),
        "largest": gauge(at, measure="principal"),
        "effective": gauge(at, measure="effective"),
    }

    def stretch(plate: Target) -> None:
        plate.v[:, 1] = 2e-4 * plate.x[:, 1]

    found = read(plate, stretch, sensors)
    assert found["slanted"] == pytest.approx(1e-4, rel=5e-3)
    assert found["largest"] == pytest.approx(2e-4, rel=2e-3)
    assert found["effective"] == pytest.approx(2e-4 * 2.0 / math.sqrt(3.0), rel=2e-3)


def test_a_rosette_and_a_gauge_along_a_direction_are_averaged_along_themselves():
    """eyy = k y^2, 60 mm at y = 10 mm: k (y^2 + L^2/12) across, whether by its direction, its axis or a rosette."""
    plate = plate_of(plate_mesh(0.2, 0.16, (20, 16)), THICKNESS, ALUMINIUM, "free")
    at, k = ("3 mm", "10 mm"), 0.1
    sensors = {
        "direction": gauge(at, length="60 mm", direction="90 deg"),
        "along": gauge(at, length="60 mm", along=[0.0, 1.0, 0.0]),
        "rosette": gauge(at, length="60 mm", direction="90 deg", measure="principal"),
    }

    def stretch(plate: Target) -> None:
        plate.v[:, 1] = k / 3.0 * plate.x[:, 1] ** 3

    truth = k * (0.01**2 + 0.06**2 / 12.0)
    for value in read(plate, stretch, sensors).values():
        assert value == pytest.approx(truth, rel=0.06)  # of a rosette each arm is averaged along a line of its own


@pytest.mark.parametrize("at", [("0 mm", "0 mm"), ("10 mm", "0 mm"), ("0 mm", "-10 mm")])
def test_a_gauge_on_a_node_or_a_side_does_not_hang_on_the_elements_numbers(at):
    """A rough field on a regular mesh, whose facets meet at the centre and at the middles of the sides there."""
    mesh, rng = plate_mesh(0.2, 0.16, (10, 8)), np.random.default_rng(3)
    push, found = rng.normal(size=mesh.nodes.shape) * 1e-6, []

    def shake(plate: Target) -> None:
        plate.v[:] = push

    for order in (np.arange(len(mesh.quads)), rng.permutation(len(mesh.quads))):
        plate = plate_of(shell_mesh(mesh.nodes, mesh.quads[order], mesh.surface), THICKNESS, ALUMINIUM, "free")
        found.append(read(plate, shake, {"a": gauge(at), "b": gauge(at, measure="principal")}))
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_gauges_read_a_known_membrane_strain_in_their_direction():
    """exx 2e-4, eyy -1e-4, gxy 3e-4: e(a) = exx c^2 + eyy s^2 + gxy c s, on both sides, at the rim, over a length."""

    def stretch(plate: Target) -> None:
        x, y = plate.x[:, 0], plate.x[:, 1]
        plate.v[:, 0], plate.v[:, 1] = 2e-4 * x + 3e-4 * y, -1e-4 * y

    plate = plate_of(distorted(), THICKNESS, ALUMINIUM, "free")
    turned = {f"at_{a}": gauge(direction=f"{a} deg", side="impact") for a in (0, 30, 90, 135)}
    others = {"rim": gauge(("99 mm", "79 mm")), "long": gauge(length="20 mm", direction="30 deg"), "back": gauge()}
    found = read(plate, stretch, turned | others)

    def expected(degrees: float) -> float:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        return 2e-4 * c * c - 1e-4 * s * s + 3e-4 * c * s

    for a in (0, 30, 90, 135):
        assert found[f"at_{a}"] == pytest.approx(expected(a), rel=3e-4)
    assert found["long"] == pytest.approx(expected(30), rel=3e-4)
    assert [found["rim"], found["back"]] == pytest.approx([expected(0)] * 2, rel=3e-4)


def test_gauges_read_a_known_bending_on_their_side():
    """Cylindrical bending of radius r, impact side out: +t/(2r) there, -t/(2r) on the back, nothing across."""

    def bend(plate: Target) -> None:
        plate.omega[:, 1] = plate.x[:, 0] / 50.0

    sensors = {"top": gauge(side="impact"), "back": gauge(side="back"), "across": gauge(direction="90 deg")}
    plate = plate_of(distorted(), THICKNESS, ALUMINIUM, "free")
    found = read(plate, bend, sensors)
    assert found["top"] == pytest.approx(THICKNESS / 2.0 / 50.0, rel=2e-4)
    assert found["back"] == pytest.approx(-THICKNESS / 2.0 / 50.0, rel=2e-4)
    assert found["across"] == pytest.approx(0.0, abs=1e-12)
    mesh = distorted()
    wound = shell_mesh(mesh.nodes, mesh.quads[:, [0, 3, 2, 1]], mesh.surface)
    other = read(plate_of(wound, THICKNESS, ALUMINIUM, "free"), bend, sensors)
    assert [other["top"], other["back"]] == pytest.approx([found["top"], found["back"]], rel=1e-6)


def test_a_gauge_along_a_curved_panel_follows_its_surface():
    """A cylinder of radius R that grows by a share e: hoop strain e, axial strain none."""
    mesh = plate_mesh(0.2, 0.16, (20, 8))
    angle = mesh.nodes[:, 0] / 0.3
    mesh.nodes[:, 0], mesh.nodes[:, 2] = 0.3 * np.sin(angle), 0.3 * (1.0 - np.cos(angle))
    plate = plate_of(shell_mesh(mesh.nodes, mesh.quads), 1e-6, ALUMINIUM, "free")

    def grow(plate: Target) -> None:
        plate.v[:, 0], plate.v[:, 2] = 1e-4 * plate.x[:, 0], 1e-4 * (plate.x[:, 2] - 0.3)

    found = read(
        plate, grow, {"hoop": gauge(("60 mm", "10 mm")), "axial": gauge(("60 mm", "10 mm"), direction="90 deg")}
    )
    assert found["hoop"] == pytest.approx(1e-4, rel=1e-3)
    assert found["axial"] == pytest.approx(0.0, abs=1e-9)


def test_a_stretched_gauge_reads_engineering_strain():
    """A bar stretched to 1.5 times its length in many steps reads 0.5: (L - L0)/L0, not the logarithm."""
    plate = plate_of(plate_mesh(0.2, 0.16, (4, 4)), THICKNESS, ALUMINIUM, "free")
    strike = strike_on(plate)
    reading = readings({"e": gauge(("0 mm", "0 mm"))}, strike)["e"]  # pyright: ignore[reportArgumentType]
    start = plate.x[:, 0].copy()
    for step in range(400):
        plate.v[:, 0] = start * 0.5 / 400
        plate.x[:, 0] = start * (1.0 + 0.5 * (step + 1) / 400)
        plate.update_forces(1.0)
    assert reading(strike) == pytest.approx(0.5, rel=1e-4)  # pyright: ignore[reportArgumentType]


def test_weights_bring_quadratic_fields_exactly_to_the_point():
    offsets = np.stack(np.meshgrid([-0.02, -0.01, 0.003], [-0.01, 0.0, 0.012]), axis=-1).reshape(-1, 2)
    x, y = offsets.T
    weights = blend(offsets)
    for field, value in ((np.ones(9), 1.0), (x, 0.0), (y, 0.0), (x * x, 0.0), (x * y, 0.0), (y * y, 0.0)):
        assert weights @ field == pytest.approx(value, abs=1e-10)
    assert blend(np.array([[0.01, 0.02]])) == pytest.approx([1.0])


def test_surface_strain_of_the_loaded_clamped_plate():
    """Uniform pressure on a clamped square: M = 0.0231 q a^2 at the centre, -0.0513 q a^2 in the middle of an edge.

    S. P. Timoshenko & S. Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., Table 35 (nu = 0.3).
    """
    a, q = 0.4, 1e4
    plate = plate_of(plate_mesh(a, a, (24, 24)), THICKNESS, ALUMINIUM, "clamped")
    sensors = {"centre": gauge(("0 mm", "0 mm")), "edge": gauge(("200 mm", "0 mm"), side="impact")}
    strike = strike_on(plate)
    found = readings(sensors, strike)  # pyright: ignore[reportArgumentType]
    load = np.zeros_like(plate.x)
    np.add.at(load[:, 2], plate.quads.ravel(), -np.repeat(0.25 * q * plate.shells.shape[:, 4], 4))
    dt = 0.9 * plate.stable_step()
    for step in range(2500):
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt, dt, load)
        plate.v[:] *= 1.0 - 7000.0 * dt
        plate.omega[:] *= 1.0 - 7000.0 * dt
    rigidity = 71e9 * THICKNESS**3 / (12.0 * (1.0 - 0.3**2))
    centre = 0.0231 * q * a**2 / (rigidity * 1.3) * 0.5 * THICKNESS
    edge = 0.0513 * q * a**2 / rigidity * 0.5 * THICKNESS
    assert found["centre"](strike) == pytest.approx(centre, rel=0.01)  # pyright: ignore[reportArgumentType]
    assert found["edge"](strike) == pytest.approx(edge, rel=0.03)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("rigid", [True, False])
def test_a_pressure_gauge_reads_the_pressure_on_it(rigid):
    """A layer of particles, one on each square of edge d and each pushing with p d^2, reads p."""
    mesh, spacing, pressure = plate_mesh(0.2, 0.16, (10, 8)), 5e-3, 3e6
    plate = rigid_plate_of(mesh, THICKNESS) if rigid else plate_of(mesh, THICKNESS, ALUMINIUM, "clamped")
    grid = np.stack(np.meshgrid(np.arange(-12, 13), np.arange(-12, 13)), axis=-1).reshape(-1, 2) * spacing
    height = 0.5 * (THICKNESS + spacing) - pressure * spacing / SEED.bulk_modulus
    bird = Bird(
        np.column_stack([grid, np.full(len(grid), height)]),
        np.zeros((len(grid), 3)),
        SEED.rho0 * spacing**3,
        1.2 * spacing,
        SEED,
        (1.0, 2.0),
    )
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    strike = SimpleNamespace(plate=plate, contact=contact, bird=bird)
    sensors = {r: SENSORS.validate({"kind": "pressure", "radius": f"{r} mm"}) for r in ("15", "20", "40")}
    found = readings(sensors, strike)  # pyright: ignore[reportArgumentType]
    assert found["15"](strike) == pytest.approx(pressure, rel=0.03)  # pyright: ignore[reportArgumentType]
    assert found["20"](strike) == pytest.approx(pressure, rel=0.02)  # pyright: ignore[reportArgumentType]
    assert found["40"](strike) == pytest.approx(pressure, rel=0.01)  # pyright: ignore[reportArgumentType]
    small = {"kind": "pressure", "radius": f"{spacing!r} m"}  # in the mean over places it reads as much, however small
    places = [
        [f"{x!r} m", f"{y!r} m"]
        for x in (np.arange(6) * spacing / 6.0).tolist()
        for y in (np.arange(6) * spacing / 6.0).tolist()
    ]
    at_each = {str(i): SENSORS.validate(small | {"at": at}) for i, at in enumerate(places)}
    mean = np.mean([one(strike) for one in readings(at_each, strike).values()])  # pyright: ignore[reportArgumentType]
    assert mean == pytest.approx(pressure, rel=5e-3)


def test_sampling_lets_no_alias_of_a_force_or_a_strain_through():
    """A 50.5 kHz ringing sampled every 20 us would come back as a 0.5 kHz wave of full size; as means it leaves 1 %."""
    time = np.arange(0.0, 5e-3, 0.4e-6)
    clock = 20e-6 * np.arange(240)
    ringing = np.sin(2.0 * np.pi * 50.5e3 * time)
    assert np.abs(SENSORS.validate({"kind": "displacement"}).sampled(clock, time, ringing)[2:-2]).max() > 0.95
    for kind in ("strain", "contact_force", "reaction_force", "pressure"):
        assert np.abs(SENSORS.validate({"kind": kind}).sampled(clock, time, ringing)[2:-2]).max() < 0.011


def test_a_pressure_gauge_off_centre_of_its_particles_still_reads():
    assert abs(gauge_under_a_layer(radius=0.031, spacing=4e-3).error) < 0.01
