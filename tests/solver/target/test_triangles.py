"""The three-node shell: patches, rigid motion, thin plates without locking, frequencies, and in one mesh with quads."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.problems.plate import ALUMINIUM, RITZ
from birdstrike.solver.case.case import load_case
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.block import Block
from birdstrike.solver.target.mesh import plate_mesh, shell_mesh
from birdstrike.solver.target.modes import natural_frequencies, static_deflection
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.supports import EVERYTHING
from birdstrike.solver.target.triangle_block import TriangleBlock
from tests.solver.target.rigid_motion import assert_strained_by_no_rigid_motion
from tests.solver.target.test_mesh_file import MESH, table_with
from tests.solver.target.triangles import abaqus_file, cut, mixed

MINDLIN_HZ = np.array([397.7, 708.2, 897.6])
DT = 1e-12


def triangles(
    cells: tuple[int, int],
    edges: str = "free",
    thickness: float = RITZ.thickness,
    size: tuple[float, float] = (RITZ.length, RITZ.width),
) -> Target:
    """A plate of triangles."""
    mesh = plate_mesh(*size, cells)
    return plate_of(shell_mesh(mesh.nodes, cut(mesh.quads, crossed=True)), thickness, ALUMINIUM, edges)


def distorted(plate: Target) -> Target:
    """Its inner nodes moved at random, in the plane."""
    inner = np.setdiff1d(np.arange(len(plate.x)), plate.mesh.rim)
    plate.x[inner, :2] += np.random.default_rng(0).uniform(-0.02, 0.02, (len(inner), 2))
    return plate


def in_global_axes(plate: Target) -> np.ndarray:
    """Strains, curvatures and shears (e, 8) turned from the elements' axes into x and y, rates."""
    block = plate.shells
    assert isinstance(block, TriangleBlock)
    block.strain[:, 6:] /= block.shear_root[:, None]
    turn = block.frame.reshape(-1, 3, 3)[:, :2, :2]
    rates = block.strain / DT
    found = np.empty_like(rates)
    for first in (0, 3):
        half = 0.5 * rates[:, first + 2]
        tensor = np.stack([rates[:, first], half, half, rates[:, first + 1]], axis=1).reshape(-1, 2, 2)
        there = np.einsum("eji,ejk,ekl->eil", turn, tensor, turn)
        found[:, first], found[:, first + 1] = there[:, 0, 0], there[:, 1, 1]
        found[:, first + 2] = 2.0 * there[:, 0, 1]
    found[:, 6:] = np.einsum("eji,ej->ei", turn, rates[:, 6:])
    return found


@pytest.mark.parametrize("pattern", ["membrane", "bending", "shear"])
def test_constant_strain_patches(pattern):
    """Distorted triangles reproduce constant membrane strain, pure bending without shear, and constant shear."""
    plate = distorted(triangles((5, 4)))
    x, y = plate.x[:, 0], plate.x[:, 1]
    expected = np.zeros(8)
    if pattern == "membrane":
        plate.v[:, 0], plate.v[:, 1] = 2.0 * x + 1.0 * y, 3.0 * y
        expected[:3] = 2.0, 3.0, 1.0
    elif pattern == "bending":
        plate.v[:, 2] = -(x * x + 1.5 * y * y + 0.25 * x * y)
        plate.omega[:, 1], plate.omega[:, 0] = 2.0 * x + 0.25 * y, -3.0 * y - 0.25 * x
        expected[3:6] = 2.0, 3.0, 0.5
    else:
        plate.v[:, 2] = 2.0 * x - 1.0 * y
        expected[6:] = 2.0, -1.0
    plate.update_forces(DT)
    assert np.allclose(in_global_axes(plate), expected, rtol=1e-9, atol=1e-9)
    assert np.abs(plate.shells.hourglass_strain[:, 0]).max() < 1e-10 * DT, "no turning shear"


def test_rigid_motion_strains_nothing():
    """Translation and spin of a warped plate, turned out of its plane."""
    plate = triangles((6, 5))
    plate.x[:] += np.random.default_rng(4).normal(0.0, 5e-3, plate.x.shape)
    assert_strained_by_no_rigid_motion(plate)


def test_a_stressed_plate_that_turns_keeps_its_stress_in_its_own_axes():
    """A quarter turn about an axis aslant in 1000 steps: the membrane force turns with the plate."""
    plate = triangles((2, 2))
    plate.shells.stress += np.array([50e6, 10e6, 5e6])
    plate.update_forces(0.0)
    start = plate.shells.resultant.copy()
    axis, steps = np.array([0.6, 0.0, 0.8]), 1000
    k = np.cross(axis, np.eye(3)).T
    angle = 0.5 * np.pi / steps
    step = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    for _ in range(steps):
        moved = plate.x @ step.T
        plate.v[:], plate.omega[:] = moved - plate.x, angle * axis
        plate.x[:] = moved
        plate.update_forces(1.0)
    assert np.abs(plate.shells.resultant[:, :3] - start[:, :3]).max() < 1e-3 * np.abs(start).max()


def test_nodal_forces_do_the_work_of_the_stresses_whatever_the_numbering():
    """Virtual work on a warped mesh; and the corners' order changes no force."""
    mesh = plate_mesh(0.4, 0.3, (4, 3))
    quads = cut(mesh.quads)
    forces = []
    for turned in (quads, np.column_stack([quads[:, [1, 2, 0]], quads[:, 0]])):
        plate = plate_of(shell_mesh(mesh.nodes, turned), 0.005, ALUMINIUM, "free")
        rng = np.random.default_rng(1)
        plate.x[:] += rng.normal(0.0, 0.005, plate.x.shape)
        plate.v[:], plate.omega[:] = rng.normal(0.0, 1.0, plate.x.shape), rng.normal(0.0, 10.0, plate.x.shape)
        plate.update_forces(1e-18)
        shells = plate.shells
        inside = (shells.shape[:, 4:5] * shells.resultant * shells.strain).sum() / 1e-18
        inside += (shells.hourglass * shells.hourglass_strain).sum() / 1e-18
        outside = (plate.nodal[:, :3] * plate.v).sum() + (plate.nodal[:, 3:] * plate.omega).sum()
        assert outside == pytest.approx(-inside, rel=1e-12)
        forces.append(plate.nodal.copy())
    assert forces[0] == pytest.approx(forces[1], abs=1e-9 * np.abs(forces[0]).max())


def test_a_clamped_plate_vibrates_as_mindlin_says():
    """Errors of three frequencies fall at second order, to below 0.8 %."""
    coarse, fine = (
        np.abs(natural_frequencies(triangles(cells, "clamped"), 3)[0] / MINDLIN_HZ - 1.0)
        for cells in ((10, 8), (20, 16))
    )
    assert (fine < 0.3 * coarse).all()
    assert fine.max() < 0.008


@pytest.mark.parametrize("slenderness", [100.0, 1000.0, 10000.0])
def test_a_thin_clamped_plate_does_not_lock(slenderness):
    """Uniform pressure: the centre deflects by 0.00126532 q L^4/D (Timoshenko), at any thickness alike."""
    plate = triangles((16, 16), "clamped", 1.0 / slenderness, (1.0, 1.0))
    load = np.zeros_like(plate.x)
    corners = plate.quads[:, :3].ravel()
    np.add.at(load[:, 2], corners, -np.repeat(plate.shells.shape[:, 4] / 3.0, 3))
    moved = np.abs(static_deflection(plate, load)[:, :3]).max()
    rigidity = ALUMINIUM.young * plate.thickness**3 / 12.0 / (1.0 - ALUMINIUM.poisson**2)
    assert moved * rigidity == pytest.approx(0.00126532, rel=0.015)


def test_a_thin_cantilever_does_not_lock():
    """A strip 1000 times as long as thick under a force at its end: F L^3/(3 E I), Poisson's ratio 0."""
    metal = ALUMINIUM.__class__(70e9, 0.0, 2700.0)
    mesh = plate_mesh(1.0, 0.1, (40, 4))
    plate = plate_of(shell_mesh(mesh.nodes, cut(mesh.quads)), 1e-3, metal, "free")
    root = np.flatnonzero(plate.x[:, 0] < -0.4999)
    plate.supports.hold_globally(root, EVERYTHING)
    tip = np.flatnonzero(plate.x[:, 0] > 0.4999)
    load = np.zeros_like(plate.x)
    load[tip, 2] = 1.0 / len(tip)
    bent = static_deflection(plate, load)[tip, 2].mean()
    assert bent == pytest.approx(1.0 / (3.0 * 70e9 * 0.1 * 1e-9 / 12.0), rel=0.01)


def test_the_stable_step_is_that_of_the_narrowest_triangle_s_membrane():
    """Its smallest height over the speed of sound of a sheet, for right triangles of any thickness below their side."""
    for thickness in (1e-3, 4e-3):
        mesh = plate_mesh(0.12, 0.12, (12, 12))
        plate = plate_of(shell_mesh(mesh.nodes, cut(mesh.quads)), thickness, ALUMINIUM, "free")
        block = TriangleBlock(plate.mesh.nodes, plate.quads, plate.shells.sections, None, scaled_inertia=True)
        plate.blocks = list[Block]([block])
        plate.nodes.mass[:] = plate.nodes.inertia[:] = 0.0
        block.add_mass(plate.nodes)
        speed = np.sqrt(ALUMINIUM.young / (1.0 - ALUMINIUM.poisson**2) / ALUMINIUM.density)
        assert plate.stable_step() * speed / (0.01 / np.sqrt(2.0)) == pytest.approx(0.98, abs=0.03)


def test_constant_strain_passes_between_quadrilaterals_and_triangles():
    """A mesh of both, nodes shared: the same membrane strain everywhere, and no force on inner nodes."""
    mesh = plate_mesh(0.5, 0.4, (6, 5))
    quads = mixed(mesh.quads, np.random.default_rng(3).random(30) < 0.5)
    plate = distorted(plate_of(shell_mesh(mesh.nodes, quads), 0.005, ALUMINIUM, "free"))
    plate.v[:, :2] = plate.x[:, :2] @ np.array([[2e-3, 1e-3], [1e-3, -1e-3]])
    plate.update_forces(1.0)
    inner = np.setdiff1d(np.arange(len(plate.x)), plate.mesh.rim)
    assert len(plate.blocks) == 2
    assert plate.nodes.mass.sum() == pytest.approx(0.5 * 0.4 * 0.005 * ALUMINIUM.density, rel=1e-12)
    assert np.abs(plate.nodal[inner]).max() < 2e-3 * np.abs(plate.nodal).max()
    for block in plate.straining:
        assert np.allclose(block.strain[:, 0] + block.strain[:, 1], 1e-3, atol=1e-5)


FAILING = {
    "target.materials.aluminium.failure_strain": "0.02",
    "target.materials.aluminium.return_mapping": "closest_point",
    "impact.speed": "150 m/s",
}
SMALL = {"bird.particles": "300", "time.end": "1 ms", "time.snapshots": '["1 ms"]'}


@pytest.mark.parametrize("tears", [False, True])
def test_a_strike_on_quadrilaterals_and_triangles_balances(tmp_path, tears):
    """The stiffened panel with a third of its skin in triangles: balances, sensors on both kinds, tears."""
    skin, third = MESH.part == 0, 34
    corners = MESH.quads[:third]
    blocks = [
        ("S4R", "skin", 1, MESH.quads[third:][MESH.part[third:] == 0]),
        ("S3", "skin", 5001, cut(corners)[:, :3]),
        ("S4R", "stiffeners", 9001, MESH.quads[~skin]),
    ]
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, blocks, {"edges": MESH.sets["edges"]})
    place = MESH.nodes[corners[20]].mean(axis=0)
    table = table_with(path)
    table["sensors"] |= {
        "gauge": {"kind": "strain", "point": [f"{1e3 * c:.6f} mm" for c in place], "part": "skin", "along": [1, 0, 0]}
    }
    run = simulate(load_case(table, SMALL | (FAILING if tears else {})))
    assert run.summary["worst_energy_error"] < (0.02 if tears else 0.01)
    assert run.summary["momentum_error"] < (1e-9 if tears else 1e-10)
    assert (run.summary["eroded_shells"] > 0) == tears
    assert np.abs(run.channels["gauge"]).max() > 1e-5
    if not tears:
        whole = simulate(load_case("openradioss_panel", SMALL | {"target.generator.element_size": "50 mm"}))
        ours, theirs = (one.channels["w_centre"].max() for one in (run, whole))
        assert ours == pytest.approx(theirs, rel=0.03)
