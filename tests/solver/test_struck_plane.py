"""A strike on a mesh from a file is the same however the mesh lies: normal speed, stand-off, forces, energy balance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.histories import Array, Histories
from birdstrike.solver.build import outline_of
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.struck import _shells_near
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.setup_warnings import setup_warnings, share_beside_plate
from birdstrike.solver.simulate import simulate
from tests.solver.test_contact_of_assemblies import Numbers, X, Y, Z, grid, joined

SLOPE = np.radians(60.0)


def about_y(degrees: float) -> Array:
    """Turns columns about y, z towards x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def written(nodes: Array, quads: Numbers, path: Path) -> str:
    """An Abaqus file in metres of one part, skin, with its border as the set rim."""
    rim = np.flatnonzero(np.bincount(quads.ravel(), minlength=len(nodes)) < 4) + 1
    lines = ["*NODE", *(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(nodes.tolist(), 1))]
    lines += ["*ELEMENT, TYPE=S4, ELSET=skin", *(f"{i}, {', '.join(map(str, q + 1))}" for i, q in enumerate(quads, 1))]
    lines += ["*NSET, NSET=rim", *map(str, rim)]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def plate() -> tuple[Array, Numbers]:
    """Nodes and shells of 0.2 x 0.2 m."""
    return joined(grid(np.array([-0.1, -0.1, 0.0]), X, Y, (10, 10)))[:2]


def strike(tmp_path: Path, degrees: float, **impact: Any) -> Case:
    """A plate of 0.2 x 0.2 m struck at 60 degrees, plate and flight turned about y."""
    turn = about_y(degrees)
    nodes, quads = plate()
    table = load_case("reference_strike", {"bird.particles": "250", "time.snapshots": "[]"}).table
    del table["plate"], table["impact"]["angle"]
    metal = {"law": "bilinear", "young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "300 MPa"}
    table["target"] = {
        "mesh": written(nodes @ turn.T, quads, tmp_path / f"{degrees}.inp"),
        "mesh_unit": "m",
        "parts": {"skin": {"thickness": "3 mm", "material": "al"}},
        "materials": {"al": metal},
        "supports": {"rim": "clamped"},
    }
    direction = turn @ [np.cos(SLOPE), 0.0, -np.sin(SLOPE)]
    table["impact"] |= {"direction": direction.tolist(), "aim": "axis", "standoff": "5 mm", "friction": 0.2} | impact
    table["time"] = {"end": "0.6 ms", "output_interval": "5 us"}
    points = {"u": [0.0, 0.0, 0.0], "v": [0.04, 0.02, 0.0]}
    table["sensors"] = {
        name: {
            "kind": "displacement",
            "point": [f"{c!r} m" for c in (turn @ at).tolist()],
            "along": (-turn @ Z).tolist(),
        }
        for name, at in points.items()
    }
    table["sensors"] |= {
        "force": {"kind": "contact_force"},
        "push": {"kind": "displacement", "point": table["sensors"]["v"]["point"]},
        "frame": {"kind": "reaction_force"},
        "rim": {"kind": "reaction_force", "support": "rim", "along": (turn @ X).tolist()},
    }
    return load_case(table)


@pytest.fixture(scope="module")
def level(tmp_path_factory: pytest.TempPathFactory) -> Histories:
    return simulate(strike(tmp_path_factory.mktemp("level"), 0.0))


@pytest.mark.parametrize("degrees", [-25.0, 30.0, 90.0])
def test_a_turned_plate_is_struck_as_a_level_one(tmp_path, level, degrees):
    """Sensors along the plate's own normal, stated or in the push, forces and every energy, the same at the same time.

    At 90 degrees the plate stands upright. With z as the normal the balance there was a share of a third of the energy.
    """
    case = strike(tmp_path, degrees)
    assert case.normal_speed == pytest.approx(case.impact.speed * np.sin(SLOPE))
    turned = simulate(case)
    assert turned.channels["push"] == pytest.approx(turned.channels["v"], rel=1e-9)
    assert turned.summary["steps"] == level.summary["steps"]
    for name, values in level.channels.items():
        assert turned.channels[name] == pytest.approx(values, abs=1e-6 * np.abs(values).max()), name
    for name in ("normal", "initial", "plate_internal", "contact", "friction"):
        assert turned.summary["energies_J"][name] == pytest.approx(level.summary["energies_J"][name], rel=1e-6)
    assert turned.summary["worst_energy_error"] == pytest.approx(level.summary["worst_energy_error"], rel=1e-4)
    assert turned.summary["warnings"] == level.summary["warnings"]


@pytest.mark.parametrize("degrees", [-25.0, 30.0, 90.0])
def test_a_bird_aimed_at_the_border_of_a_turned_plate_flies_past_it_by_the_same_share(tmp_path, degrees):
    found = []
    for turn in (0.0, degrees):
        point = [f"{c!r} m" for c in (about_y(turn) @ [0.09, 0.03, 0.0]).tolist()]
        case = strike(tmp_path, turn, point=point)
        strike_there = Coupling(case)
        found.append((share_beside_plate(case), strike_there.first_touch_off_plate, len(setup_warnings(case))))
        assert outline_of(case).sides == pytest.approx([0.2, 0.2])
    assert 0.2 < found[0][0] < 0.6
    assert found[1] == (pytest.approx(found[0][0], abs=1e-3), *found[0][1:])


def test_a_turned_plate_can_be_struck_squarely(tmp_path):
    """Rounded, the velocity's component along the normal of this one is larger than the velocity."""
    case = strike(tmp_path, 34.0, direction=(-about_y(34.0) @ Z).tolist())
    assert outline_of(case).direction[2] < -1.0
    assert share_beside_plate(case) == 0.0


def test_a_level_mesh_counts_from_z_0_as_a_plate_does(tmp_path):
    case = strike(tmp_path, 0.0)
    assert case.struck_plane is None
    assert case.normal_speed == case.impact.speed * np.sin(case.impact.angle)


def test_the_edge_of_a_rib_counts_from_z_0(tmp_path):
    """Struck along its shells, which have no part of the velocity along their normals."""
    case = strike(tmp_path, 90.0, direction=[0.02, 0.0, -1.0], point=["0 m", "0 m", "0.1 m"])
    assert case.meets_edge
    assert case.struck_plane is None
    assert case.normal_speed == pytest.approx(case.impact.speed, rel=1e-3)


def normal_of(case: Case) -> Array:
    plane = case.struck_plane
    assert plane is not None
    return plane.normal


def test_a_node_that_lies_wrong_at_the_aim_does_not_tilt_the_struck_plane(tmp_path):
    """6 mm off over shells of 20 mm, at the aim's own node; the shells there, taken alone, are tilted by 6 degrees."""
    case = strike(tmp_path, 30.0, point=["2 mm", "3 mm", "0 mm"])
    upright = about_y(30.0) @ Z
    nodes, quads = plate()
    nodes[np.linalg.norm(nodes, axis=1).argmin(), 2] += 0.006
    written(nodes @ about_y(30.0).T, quads, tmp_path / "30.0.inp")
    assert normal_of(case) == pytest.approx(upright, abs=1e-12)


def test_the_fold_of_a_part_beside_the_aim_does_not_tilt_the_struck_plane(tmp_path):
    case = strike(tmp_path, 30.0, point=["60.6 mm", "2 mm", "-35 mm"])
    nodes, quads = plate()
    beyond = nodes[:, 0] > 0.081
    nodes[beyond] = np.column_stack([np.full(beyond.sum(), 0.08), nodes[beyond, 1], 0.08 - nodes[beyond, 0]])
    written(nodes @ about_y(30.0).T, quads, tmp_path / "30.0.inp")
    assert normal_of(case) == pytest.approx(about_y(30.0) @ Z, abs=1e-12)


def test_a_web_behind_the_aim_does_not_tilt_the_struck_plane(tmp_path):
    """One part of a skin and the web on which it is struck."""
    case = strike(tmp_path, 30.0)
    nodes, quads = plate()
    above = np.flatnonzero(np.abs(nodes[:, 0]) < 1e-9)
    below = len(nodes) + np.arange(len(above))
    web = np.column_stack([above[:-1], above[1:], below[1:], below[:-1]])
    nodes = np.vstack([nodes, nodes[above] - 0.02 * Z])
    written(nodes @ about_y(30.0).T, np.vstack([quads, web]), tmp_path / "30.0.inp")
    assert normal_of(case) == pytest.approx(about_y(30.0) @ Z, abs=1e-12)


@pytest.mark.parametrize(
    ("half", "longer", "y"),
    [(60.0, 1.0, 0.0), (60.0, 3.0, 0.0), (46.0, 3.0, 0.005), (40.0, 3.0, 0.0), (15.0, 1.0, 0.0)],
)
def test_the_ridge_of_a_wedge_is_struck_squarely(tmp_path, half, longer, y):
    """At a node of it and between two; where one flank has longer shells, the normal leant to it by up to 26 degrees.

    Of half an angle of 45 degrees and less no shell lies as their mean: the normal was no number.
    """
    case = strike(tmp_path, 0.0, direction=[0.0, 0.0, -1.0], point=["0 m", f"{y} m", "0 m"])
    nodes, quads = plate()
    flank = np.array([np.sin(np.radians(half)), -np.cos(np.radians(half))])
    along = np.where(nodes[:, 0] > 0.0, longer, 1.0) * nodes[:, 0]
    nodes[:, [0, 2]] = np.column_stack([along, np.abs(along)]) * flank
    written(nodes, quads, tmp_path / "0.0.inp")
    assert case.struck_plane is None, "level, as their mean is"
    assert case.normal_speed == pytest.approx(case.impact.speed)


def test_the_struck_plane_is_sought_once_and_follows_the_case_and_its_file(tmp_path):
    case = strike(tmp_path, 30.0)
    normal_of(case)
    sought = _shells_near.cache_info().misses
    assert normal_of(case.with_values({"impact.speed": 50.0})) == pytest.approx(about_y(30.0) @ Z)
    assert _shells_near.cache_info().misses == sought
    moved = case.overlaid({"impact": {"point": [f"{c!r} m" for c in (about_y(30.0) @ [0.04, 0.0, 0.0]).tolist()]}})
    assert moved.struck_plane is not None
    assert moved.struck_plane.point == pytest.approx(about_y(30.0) @ [0.04, 0.0, 0.0])
    nodes, quads = plate()
    written(nodes @ about_y(-20.0).T, quads, tmp_path / "30.0.inp")
    assert normal_of(case) == pytest.approx(about_y(-20.0) @ Z)
