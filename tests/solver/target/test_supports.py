"""Holds of several sets that meet in a node, and what a load cell under one of them reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.solver.target.assembled import PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.mesh import shell_mesh
from birdstrike.solver.target.part_mesh import PartMesh, Patch, merged
from birdstrike.solver.target.supports import RIGID, EdgeStiffness, Held, Supports

METAL = TARGET_LAWS.validate(
    {"law": "bilinear", "young": "70 GPa", "poisson": 0.3, "density": "2700 kg/m^3", "yield_stress": "10000 MPa"}
)
X, Y, Z = np.eye(3)
ACROSS = EdgeStiffness(in_plane=1e6, transverse=RIGID, rotational=0.0)
SPRINGS = EdgeStiffness(in_plane=1e6, transverse=2e6, rotational=0.0)


def t_joint() -> PartMesh:
    """A skin in z = 0 with a web below its middle line; sets: the ends of either at y = 0.1 m."""
    places = np.linspace(-0.1, 0.1, 5)
    skin = np.stack([*np.meshgrid(places, places, indexing="ij"), np.zeros((5, 5))], axis=-1)
    y, z = np.meshgrid(places, np.linspace(0.0, -0.1, 3), indexing="ij")
    patches = [Patch("skin", skin), Patch("web", np.stack([np.zeros_like(y), y, z], axis=-1))]
    nodes, quads, part = merged(patches)
    end = nodes[:, 1] > 0.099
    sets = {"A": np.flatnonzero(end & (nodes[:, 2] > -1e-6)), "B": np.flatnonzero(end & (np.abs(nodes[:, 0]) < 1e-6))}
    sets |= {"AB": np.union1d(sets["A"], sets["B"]), "far": np.flatnonzero(nodes[:, 1] < -0.099)}
    return PartMesh(nodes, quads, part, ("skin", "web"), sets)


def held_at_the_joint(**supports: EdgeStiffness) -> np.ndarray:
    """Projection (3, 3) of a displacement of the joint's end onto what is held there."""
    parts = t_joint()
    target = assembled(parts, dict.fromkeys(parts.parts, PartData(2e-3, METAL)), supports)
    node = int(np.argmin(np.linalg.norm(parts.nodes - [0.0, 0.1, 0.0], axis=1)))
    return held_at(target.supports, node)


def held_at(supports: Supports, node: int) -> np.ndarray:
    held = [axis for bit, axis in enumerate(supports.axes[node]) if supports.held[node] >> bit & 1]
    return sum((np.outer(axis, axis) for axis in held), np.zeros((3, 3)))


@pytest.mark.parametrize("names", [("A", "B"), ("B", "A"), ("AB",)])
def test_what_two_sets_hold_in_a_node_is_held_whichever_is_named_first(names):
    """Across the skin by one, across the web by the other: the order decided which of the two was kept."""
    assert held_at_the_joint(**dict.fromkeys(names, ACROSS)) == pytest.approx(np.diag([1.0, 0.0, 1.0]), abs=1e-12)


@pytest.mark.parametrize("names", [("A", "B"), ("B", "A")])
def test_a_set_of_springs_leaves_the_hold_of_another_as_it_is(names):
    """The skin is held across itself; springs on the web turned that hold to the web's normal."""
    held = {name: ACROSS if name == "A" else SPRINGS for name in names}
    assert held_at_the_joint(**held) == pytest.approx(np.diag([0.0, 0.0, 1.0]), abs=1e-12)


def cube_corner(normals: list[np.ndarray], stiffness: EdgeStiffness) -> np.ndarray:
    """What is held in a node in which surfaces of these normals meet, all held alike."""
    nodes = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    group = Held(np.zeros(len(normals), np.int64), stiffness, np.ones(len(normals)), np.array(normals))
    return held_at(Supports(shell_mesh(nodes, np.array([[0, 1, 2, 3]])), {"corner": group}), 0)


@pytest.mark.parametrize(
    ("normals", "stiffness", "held"),
    [
        ([Z], ACROSS, [0.0, 0.0, 1.0]),
        ([Z, X], ACROSS, [1.0, 0.0, 1.0]),
        ([Z, X, Y], ACROSS, [1.0, 1.0, 1.0]),
        ([Z, 0.5 * Z + np.sqrt(0.75) * X, 0.5 * Z - np.sqrt(0.75) * X], ACROSS, [1.0, 0.0, 1.0]),
        ([Z, X], replace(ACROSS, in_plane=RIGID, transverse=1e6), [1.0, 1.0, 1.0]),
        ([Z], replace(ACROSS, in_plane=RIGID, transverse=1e6), [1.0, 1.0, 0.0]),
    ],
    ids=["one", "two", "corner of three", "three about a line", "along two", "along one"],
)
def test_all_surfaces_that_meet_in_a_node_are_held_and_nothing_else(normals, stiffness, held):
    assert cube_corner(normals, stiffness) == pytest.approx(np.diag(held), abs=1e-12)


@pytest.mark.parametrize(("degrees", "held"), [(60.0, 2), (30.0, 1)])
def test_a_bent_sheet_is_one_surface_and_a_fold_two(degrees, held):
    """From a cosine of 0.7 on; of one surface what is held lies between the normals."""
    turn = np.deg2rad(degrees)
    found = cube_corner([Z, np.cos(turn) * Z + np.sin(turn) * X], ACROSS)
    between = np.cos(0.5 * turn) * Z + np.sin(0.5 * turn) * X
    assert np.trace(found) == pytest.approx(held)
    assert found @ between == pytest.approx(between)


def pushed(springs: EdgeStiffness) -> tuple[Target, np.ndarray]:
    """The T-joint on springs at one end and clamped at the other, moved so that both pull; and the whole reaction."""
    parts = t_joint()
    data = dict.fromkeys(parts.parts, PartData(2e-3, METAL))
    target = assembled(parts, data, {"AB": springs, "far": EdgeStiffness()})
    target.v[:] = 1e-3 * (parts.nodes[:, 1:2] + 0.1) * [0.3, 0.2, -1.0]
    target.x[:] += target.v
    target.update_forces(1.0)
    whole = np.zeros(3)
    target.reaction(np.zeros_like(target.x), whole)
    return target, whole


def test_load_cells_under_springs_and_rigid_holds_together_read_the_whole_reaction():
    """That under the springs reads the sum of stiffness times displacement: 2 MPa x 0.3 m x 0.2 mm here, across."""
    target, whole = pushed(EdgeStiffness(in_plane=2e6, transverse=2e6, rotational=0.0))
    none = np.zeros_like(target.x)
    each = {name: target.supports.reaction_of(name, target.nodes, none) for name in ("AB", "far")}
    assert each["AB"] + each["far"] == pytest.approx(whole, rel=1e-9)
    assert each["AB"] == pytest.approx(2e6 * 0.3 * 2e-4 * np.array([0.3, 0.2, -1.0]), rel=1e-6)
