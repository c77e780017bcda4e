"""Sensors at points in space: displacement along a direction, strain on a web, whichever way its shells are wound."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.cli.check import check
from birdstrike.data.errors import CaseError, UserError
from birdstrike.reports.verification.columns import SEED
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import load_case
from birdstrike.solver.case.struck import UP
from birdstrike.solver.contact import Contact
from birdstrike.solver.sensors.places import facing, place_in_space, point_at
from birdstrike.solver.sensors.recording import readings
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.assembled import PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.links.anchors import Surface
from birdstrike.solver.target.mesh import rectangle, shell_mesh
from birdstrike.solver.target.part_mesh import PartMesh, Patch, merged
from birdstrike.solver.target.shell_block import ShellBlock

METAL = TARGET_LAWS.validate(
    {"law": "bilinear", "young": "70 GPa", "poisson": 0.3, "density": "2700 kg/m^3", "yield_stress": "1000 MPa"}
)
ON_WEB = {"point": ["100 mm", "30 mm", "-20 mm"], "part": "stiffeners"}
ON_SKIN = {"point": ["20 mm", "30 mm", "0 mm"], "part": "skin", "along": [1.0, 0.0, 0.0]}


def panel() -> Target:
    return build_plate(load_case("openradioss_panel", {"target.generator.element_size": "20 mm"}))


def wound_anyhow() -> Target:
    """The panel with every fifth shell wound the other way."""
    plate = panel()
    quads = plate.shells.quads.copy()
    quads[::5] = quads[::5][:, [0, 3, 2, 1]]
    plate.blocks[0] = ShellBlock(plate.mesh.nodes, quads, plate.shells.sections, plate.shells.section, True)
    plate.quads, plate.mesh.quads[:] = quads, quads
    return plate


def read(
    plate: Target, sensors: dict[str, dict[str, Any]], gradient: np.ndarray, bend: float = 0.0
) -> dict[str, float]:
    """Readings after one step of 1 s of the displacement field gradient @ x, and of bending about y."""
    run: Any = SimpleNamespace(plate=plate, normal=UP, contact=SimpleNamespace(spacing=5e-3))
    found = readings({name: SENSORS.validate(table) for name, table in sensors.items()}, run)
    plate.v[:] = plate.x @ gradient.T
    if bend:
        plate.v[:, 2] += 0.5 * bend * plate.x[:, 0] ** 2
        plate.omega[:, 1] -= bend * plate.x[:, 0]
    plate.x[:] += plate.v
    plate.update_forces(1.0)
    return {name: reading(run) for name, reading in found.items()}


def test_displacement_of_a_web_along_a_direction():
    gradient = 1e-6 * np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]])
    sensors = {
        "sideways": {"kind": "displacement", "along": [1.0, 0.0, 0.0], **ON_WEB},
        "push": {"kind": "displacement", **ON_WEB},
        "slanted": {"kind": "displacement", "along": [0.0, 0.6, 0.8], **ON_WEB},
        "short": {"kind": "displacement", "along": [0.0, 0.3, 0.4], **ON_WEB},
    }
    moved = gradient @ np.array([0.1, 0.03, -0.02])
    found = read(panel(), sensors, gradient)
    assert found["sideways"] == pytest.approx(moved[0])
    assert found["push"] == pytest.approx(-moved[2])
    assert found["slanted"] == pytest.approx(0.6 * moved[1] + 0.8 * moved[2])
    assert found["short"] == pytest.approx(found["slanted"], rel=1e-12), "a direction of any length"


@pytest.mark.parametrize("target", [panel, wound_anyhow])
def test_strain_of_a_web_along_and_across_it(target):
    """A uniform field: each direction reads its own strain, on both sides alike."""
    gradient = np.diag([1e-6, 2e-6, 3e-6])
    sensors = {
        f"{name}_{side}": {"kind": "strain", "along": along, "side": side, **ON_WEB}
        for name, along in (("along", [0.0, 1.0, 0.0]), ("down", [0.0, 0.0, -1.0]))
        for side in ("impact", "back")
    }
    found = read(target(), sensors, gradient)
    for side in ("impact", "back"):
        assert found[f"along_{side}"] == pytest.approx(2e-6, rel=1e-3)
        assert found[f"down_{side}"] == pytest.approx(3e-6, rel=1e-3)


@pytest.mark.parametrize("target", [panel, wound_anyhow])
def test_bending_strains_the_sides_of_the_skin_oppositely(target):
    """w'' = 1e-4/m on 3 mm: -1.5e-7 on the impact side where the skin is dished upwards, +1.5e-7 on its back."""
    sensors = {
        f"{side}_{long}": {"kind": "strain", "side": side, **ON_SKIN} | ({"length": "60 mm"} if long else {})
        for side in ("impact", "back")
        for long in (False, True)
    }
    found = read(target(), sensors, np.zeros((3, 3)), bend=1e-4)
    for long in (False, True):
        assert found[f"impact_{long}"] == pytest.approx(-1.5e-7, rel=0.02)
        assert found[f"back_{long}"] == pytest.approx(1.5e-7, rel=0.02)


@pytest.mark.parametrize("x", [-25.0, -5.0, -1.0, 1.0, 5.0, 25.0])
def test_a_gauge_beside_a_step_of_thickness_reads_its_own_part(x):
    """A strip of 1 mm and 2 mm in tension: twice the strain in the thin half, up to the step."""
    places = np.meshgrid(np.linspace(-0.1, 0.1, 21), np.linspace(-0.03, 0.03, 7), indexing="ij")
    nodes, quads, _ = merged([Patch("", np.stack([*places, np.zeros((21, 7))], axis=-1))])
    half = (nodes[quads].mean(axis=1)[:, 0] > 0.0).astype(np.int64)
    parts = {"thin": PartData(1e-3, METAL), "thick": PartData(2e-3, METAL)}
    target = assembled(PartMesh(nodes, quads, half, tuple(parts), {}), parts, {})
    run: Any = SimpleNamespace(plate=target)
    gauge = {"kind": "strain", "point": [f"{x} mm", "1 mm", "0 mm"], "along": [1.0, 0.0, 0.0]}
    reading = readings({"gauge": SENSORS.validate(gauge)}, run)["gauge"]
    target.v[:, 0] = np.where(nodes[:, 0] < 0.0, 2e-6, 1e-6) * nodes[:, 0]
    target.update_forces(1.0)
    assert reading(run) == pytest.approx(2e-6 if x < 0.0 else 1e-6, rel=1e-3)


@pytest.mark.parametrize("length", [{}, {"length": "15 mm"}])
def test_a_gauge_beside_a_shell_that_has_torn_reads_those_that_are_left(length):
    """Stretched twice by 1e-6, a shell beside the gauge torn in between: what that had felt stands still."""
    target = plain_strip()
    run: Any = SimpleNamespace(plate=target)
    gauge = {"kind": "strain", "point": ["1 mm", "1 mm", "0 mm"], "along": [1.0, 0.0, 0.0], **length}
    reading = readings({"gauge": SENSORS.validate(gauge)}, run)["gauge"]
    target.v[:, 0] = 1e-6 * target.mesh.nodes[:, 0]
    target.update_forces(1.0)
    assert reading(run) == pytest.approx(1e-6, rel=1e-4)
    middles = target.mesh.nodes[target.quads].mean(axis=1)
    target.alive[np.argmin(np.linalg.norm(middles - [0.015, 0.0, 0.0], axis=1))] = False
    target.update_forces(1.0)
    assert reading(run) == pytest.approx(2e-6, rel=1e-4)


def plain_strip() -> Target:
    """A strip of 200 x 60 mm, of one part."""
    places = np.meshgrid(np.linspace(-0.1, 0.1, 21), np.linspace(-0.03, 0.03, 7), indexing="ij")
    nodes, quads, _ = merged([Patch("", np.stack([*places, np.zeros((21, 7))], axis=-1))])
    parts = {"strip": PartData(1e-3, METAL)}
    return assembled(PartMesh(nodes, quads, np.zeros(len(quads), np.int64), tuple(parts), {}), parts, {})


def test_a_place_on_a_large_shell_beside_small_ones_is_found():
    """However many small shells have their centres nearer."""
    small = np.column_stack([rectangle(0.05, 0.05, (10, 10))[0] + [0.05, 0.0], np.zeros(121)])
    large = np.array([[-0.025, -0.025, 0.0], [0.025, -0.025, 0.0], [0.025, 0.025, 0.0], [-0.025, 0.025, 0.0]])
    quads = np.vstack([[[0, 1, 2, 3]], rectangle(0.05, 0.05, (10, 10))[1] + 4])
    mesh = shell_mesh(np.vstack([large, small]), quads)
    point = np.array([0.022, 0.001, 0.0])
    assert place_in_space(mesh, point)[0] == 0
    assert point_at(mesh, *place_in_space(mesh, point)) == pytest.approx(point)
    assert Surface(mesh.nodes, quads).foot(point).distance == pytest.approx(0.0, abs=1e-12)


def test_the_impact_side_of_an_upright_web_does_not_hang_on_how_its_shells_are_wound():
    """A web bent about y, u'' = 1e-4/m towards +x: its face at +x, the impact side, is shortened on 3 mm."""
    sensors = {
        side: {"kind": "strain", "along": [0.0, 0.0, -1.0], "side": side, **ON_WEB} for side in ("impact", "back")
    }
    run: Any = SimpleNamespace(contact=SimpleNamespace(spacing=5e-3))
    for target in (panel(), wound_anyhow()):
        run.plate = target
        found = readings({name: SENSORS.validate(table) for name, table in sensors.items()}, run)
        target.v[:, 0] += 0.5e-4 * target.x[:, 2] ** 2
        target.omega[:, 1] += 1e-4 * target.x[:, 2]
        target.x[:] += target.v
        target.update_forces(1.0)
        assert found["impact"](run) == pytest.approx(-1.5e-7, rel=0.05)
        assert found["back"](run) == pytest.approx(1.5e-7, rel=0.05)


@pytest.mark.parametrize(
    ("normal", "side"),
    [
        ([-0.6, 0.0, 0.8], 1),
        ([0.8, 0.0, -0.6], -1),
        ([0.6, -0.8, 0.0], 1),
        ([-0.6, 0.8, 0.0], -1),
        ([0.0, -1.0, 0.0], -1),
        ([0.005, -1.0, -0.005], -1),
    ],
)
def test_a_shell_faces_z_an_upright_one_x_and_one_in_the_plane_of_both_y(normal, side):
    assert facing(np.array(normal)) == side


def test_a_gauge_on_a_curved_skin_has_its_length_on_the_skin():
    """Radius 300 mm, at x = 150 mm the slope is 30 degrees: 40 mm along x lie on the arc."""
    mesh = build_plate(load_case("openradioss_panel", {"target.generator.radius": "300 mm"})).mesh
    place = {"point": ["150 mm", "0 mm", f"{1e3 * (math.sqrt(0.3**2 - 0.15**2) - 0.3)} mm"], "part": "skin"}
    for direction in ({"along": [1.0, 0.0, 0.0]}, {}):
        gauge: Any = SENSORS.validate({"kind": "strain", "length": "40 mm", **place, **direction})
        low, high = (point_at(mesh, *gauge.shifted(by, mesh).on(mesh)) for by in (-0.02, 0.02))
        assert np.linalg.norm(high - low) == pytest.approx(0.04, rel=3e-3)
        assert (high - low) @ gauge.laid(mesh) == pytest.approx(0.04, rel=3e-3)


@pytest.mark.parametrize(
    ("case", "sensor", "said"),
    [
        ("openradioss_panel", {"point": ["0 mm"] * 3, "part": "wing"}, "no such part; its parts: skin, stiffeners"),
        ("openradioss_panel", {"at": ["0 mm", "0 mm"], "point": ["0 mm"] * 3}, "has at and point, two places"),
        ("openradioss_panel", {"part": "skin"}, "sensors.w.part = skin needs a point in space"),
        ("openradioss_panel", {"along": [0.0, 0.0, 0.0]}, "is no direction; write one such as"),
        (
            "openradioss_panel",
            {"kind": "reaction_force", "support": "rim"},
            "holds nothing; target.supports that hold: edges",
        ),
        (
            "openradioss_panel",
            {"kind": "strain", "along": [1.0, 0.0, 0.0], "direction": "90 deg"},
            "sensors.w.direction = 90 deg does nothing beside sensors.w.along = [1.0, 0.0, 0.0]; leave one of the two",
        ),
        ("reference_strike", {"point": ["0 mm"] * 3, "part": "skin"}, "does nothing on a plate, which has no parts"),
        ("reference_strike", {"kind": "reaction_force", "support": "edges"}, "does nothing on a plate, which has one"),
    ],
)
def test_names_and_places_that_the_target_has_not_are_told(case, sensor, said):
    with pytest.raises(CaseError) as caught:
        load_case(case, {"sensors": {"w": {"kind": "displacement"} | sensor}})
    (line,) = caught.value.errors
    assert said in line
    assert line.startswith("sensors.w")


@pytest.mark.parametrize(
    ("case", "sensor", "said"),
    [
        ("openradioss_panel", {"point": ["400 mm", "0 mm", "0 mm"]}, "150 mm off the target's shells at rest; the "),
        ("openradioss_panel", {"at": ["0 mm", "300 mm"]}, "nearest place is (0, 250, 0) mm on part skin"),
        ("openradioss_panel", {"point": ["0 mm"] * 3, "part": "stiffeners"}, "100 mm off the target's shells of part"),
        (
            "openradioss_panel",
            {"kind": "strain", "at": ["0 mm", "150 mm"], "direction": "90 deg", "length": "300 mm"},
            "sensors.w.length: (0, 300, 0) mm lies 50 mm off",
        ),
        (
            "openradioss_panel",
            {"kind": "strain", "point": ["20 mm", "0 mm", "0 mm"], "along": [0.0, 0.0, 1.0]},
            "is normal to the shell under the gauge",
        ),
        (
            "openradioss_panel",
            {"kind": "strain", "point": ["100 mm", "30 mm", "-20 mm"], "part": "stiffeners"},
            "stands upright, where its direction cannot be counted",
        ),
        ("reference_strike", {"point": ["0 mm", "0 mm", "900 mm"]}, "900 mm off the target's shells"),
        (
            "openradioss_panel",
            {"kind": "pressure", "at": ["245 mm", "0 mm"], "radius": "40 mm"},
            "sensors.w.radius = 40 mm: the gauge reaches 35 mm beyond part skin, whose shells alone it feels; a",
        ),
        (
            "openradioss_panel",
            {"kind": "pressure", "point": ["100 mm", "0 mm", "-20 mm"], "part": "stiffeners", "radius": "25 mm"},
            "reaches 5 mm beyond part stiffeners",
        ),
    ],
)
def test_a_sensor_off_the_shells_is_told_with_the_nearest_place_by_check_and_before_a_run(case, sensor, said):
    found = load_case(case, {"sensors": {"w": {"kind": "displacement"} | sensor}})
    for verb in (check, simulate):
        with pytest.raises(UserError) as caught:
            verb(found)
        assert said in str(caught.value)


def test_a_place_within_half_a_shell_is_taken():
    beside = {"w": {"kind": "displacement", "point": ["252 mm", "0 mm", "3 mm"]}}
    assert check(load_case("openradioss_panel", {"sensors": beside}))


def test_a_gauge_that_is_laid_over_another_replaces_what_it_says_in_another_way():
    """A case that extends another has no way to leave out a key of it."""
    gauge = {"kind": "strain", "at": ["20 mm", "0 mm"], "direction": "90 deg"}
    other = {"point": ["100 mm", "0 mm", "-20 mm"], "part": "stiffeners", "along": [0.0, 1.0, 0.0]}
    laid = load_case("openradioss_panel", {"sensors": {"w": gauge}}).overlaid({"sensors": {"w": other}})
    assert laid.table["sensors"]["w"] == {"kind": "strain", **other}


def test_a_gauge_on_a_rigid_part_and_a_load_cell_under_a_free_set_are_refused():
    """They read nothing, and the force of another set at the corner that both have."""
    hard = {"target.materials.hard.law": "rigid", "target.parts.stiffeners.material": "hard"}
    for place in (ON_WEB, {"point": ON_WEB["point"]}):
        on_web = {"sensors.w": {"kind": "strain", "along": [0.0, 1.0, 0.0], **place}}
        with pytest.raises(
            UserError, match=r"sensors\.w\.kind = strain: part stiffeners is of law = \"rigid\" and has"
        ):
            check(load_case("openradioss_panel", hard | on_web))
    for free in ("free", {"in_plane": "0 N/mm^2", "transverse": "0 N/mm^2", "rotational": "0 kN*m/rad/m"}):
        cell = {"target.supports.width_low": free, "sensors.w": {"kind": "reaction_force", "support": "width_low"}}
        with pytest.raises(CaseError, match=r'support = "width_low" holds nothing; target.supports that hold: edges'):
            load_case("openradioss_panel", cell)


SPACING, PRESSURE = 5e-3, 3e6


def pressed(heights: tuple[float, ...]) -> Bird:
    """Layers of particles on a square, at these heights [m]."""
    grid = np.stack(np.meshgrid(*[np.arange(-8, 9) * SPACING] * 2), axis=-1).reshape(-1, 2)
    x = np.vstack([np.column_stack([grid, np.full(len(grid), height)]) for height in heights])
    return Bird(x, np.zeros_like(x), SEED.rho0 * SPACING**3, 1.2 * SPACING, SEED, (1.0, 2.0))


def test_a_pressure_gauge_feels_the_impact_side_of_its_own_part_alone():
    """Particles press on both sides of a sheet and on another behind it: the gauge on the first read all three."""
    places = np.meshgrid(np.linspace(-0.1, 0.1, 6), np.linspace(-0.1, 0.1, 6), indexing="ij")
    sheets = [
        Patch(name, np.stack([*places, np.full((6, 6), z)], axis=-1)) for name, z in (("front", 0.0), ("back", -0.02))
    ]
    nodes, quads, part = merged(sheets)
    data = {name: PartData(2e-3, METAL) for name in ("front", "back")}
    target = assembled(PartMesh(nodes, quads, part, ("front", "back"), {}), data, {})
    off = 0.5 * (2e-3 + SPACING) - PRESSURE * SPACING / SEED.bulk_modulus
    bird = pressed((off, -off, -0.02 + off))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    run: Any = SimpleNamespace(plate=target, contact=contact, bird=bird)
    for part_of_gauge, z in (("front", "0 mm"), ("back", "-20 mm")):
        gauge = {"kind": "pressure", "point": ["0 mm", "0 mm", z], "part": part_of_gauge, "radius": "20 mm"}
        assert readings({"p": SENSORS.validate(gauge)}, run)["p"](run) == pytest.approx(PRESSURE, rel=0.02)
