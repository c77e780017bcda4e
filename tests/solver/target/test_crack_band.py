"""Energy that a crack costs in shells of any shape, by their width across it."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.metal import SOFTENING, crack_band
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.interface import Metal
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.mesh import plate_mesh, shell_mesh
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.section import Section
from birdstrike.solver.target.supports import NAMED, rim_supports
from birdstrike.solver.target.triangle_block import shell_blocks
from tests.solver.target.triangles import cut


def law_with_fracture() -> Metal:
    table = {"law": "power", "young": "73 GPa", "poisson": 0.0, "density": "2780 kg/m^3", "a": "350 MPa", "b": "0 MPa"}
    law = TARGET_LAWS.validate(table | {"n": 0.34, "failure_strain": 0.005, "fracture_energy": "20 kN/m"})
    assert isinstance(law, Metal)
    return law


def pulled_shell(length: float, width: float, triangles: bool, turned: Array | None = None) -> Target:
    """A free rectangle of one quadrilateral or two triangles; turned (2, 2): what its nodes are multiplied by."""
    mesh = plate_mesh(length, width, (1, 1))
    nodes = mesh.nodes if turned is None else np.column_stack([mesh.nodes[:, :2] @ turned, mesh.nodes[:, 2]])
    quads = cut(mesh.quads, crossed=False) if triangles else mesh.quads
    mesh, law = shell_mesh(nodes, quads), law_with_fracture()
    blocks = shell_blocks(nodes, quads, [Section(2e-3, law.density, law.row())])
    return Target(mesh, Nodes(nodes), blocks, rim_supports(mesh, NAMED["free"]))


def fracture_energy_of(length: float, width: float, triangles: bool, turned: Array | None = None) -> float:
    """Work [J/m^2] that a shell takes, per area of a crack across its length, once softening has begun.

    What it held elastically then it gives back as it softens.
    """
    target = pulled_shell(length, width, triangles, turned)
    dt, grown = 1e-6, 2e-5
    target.v[:, 0] = target.x[:, 0] * grown / dt
    earlier, before, held = 0.0, 0.0, None
    while all(block.alive.all() for block in target.straining):
        target.x[:] += dt * target.v
        target.update_forces(dt)
        target.update_energies()
        if held is None and target.straining[0].memory[0, 0, SOFTENING] > 0.0:
            stress = target.straining[0].stress[0, 0]
            held = 0.5 * float(stress @ stress + stress[2] ** 2) / 73e9 * length * width * 2e-3
            before = earlier
        earlier = sum(target.energies.values())
    assert held is not None
    return (sum(target.energies.values()) - before + held) / (2e-3 * width)


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize(("length", "width"), [(5e-3, 5e-3), (8e-3, 4e-3), (4e-3, 8e-3)])
def test_a_crack_across_shells_of_any_shape_costs_its_energy(length, width, triangles):
    """A shell pulled along its length, less what it had taken until it softened: G per area of the crack across it.

    By the root of its area it was (length/width)^(1/2) times that along its length. The shells are stretched by up to
    3 % when they soften, and take as much more.
    """
    assert fracture_energy_of(length, width, triangles) == pytest.approx(1.015 * 20e3, rel=0.015)


@pytest.mark.parametrize("shear", [0.5, 1.0])
def test_a_crack_along_a_row_of_sheared_shells_costs_its_energy(shear):
    """The crack runs along the sheared sides' ends: the row is as high as that of the rectangle, whatever the shear.

    By the length through the shell's middle along the pull it cost (1 + shear^2)^(1/2) times as much.
    """
    turned = np.array([[1.0, shear], [0.0, 1.0]])
    assert fracture_energy_of(5e-3, 5e-3, False, turned) == pytest.approx(1.015 * 20e3, rel=0.015)


@pytest.mark.parametrize("triangles", [False, True])
def test_a_square_s_width_is_the_root_of_its_area_in_every_direction(triangles):
    """To the last bit, however the square lies and whichever way its stress pulls."""
    c, s = np.cos(0.3), np.sin(0.3)
    block = pulled_shell(5e-3, 5e-3, triangles, np.array([[c, s], [-s, c]])).straining[0]
    stress = np.random.default_rng(0).normal(0.0, 1e8, (50, 3))
    row = law_with_fracture().row()
    assert {crack_band(row, size, one) for size in block.size for one in stress} == set(block.size[:, 0])
    assert block.size[:, 0] == pytest.approx(5e-3)


def test_between_its_axes_a_rectangle_is_as_wide_as_its_staircases():
    """Along a crack at 45 degrees through rectangles four times as long as wide, the least torn shells, four of each
    column, have an area of 16 times their width squared, per 4 2^(1/2) widths of crack: a band of 2.83 widths.
    """
    row, size = law_with_fracture().row(), pulled_shell(8e-3, 2e-3, False).straining[0].size[0]
    widths = [
        crack_band(row, size, np.array([np.cos(a) ** 2, np.sin(a) ** 2, np.cos(a) * np.sin(a)]))
        for a in (0.0, 0.25 * np.pi, 0.5 * np.pi)
    ]
    assert widths == pytest.approx([8e-3, 16.0 / (4.0 * np.sqrt(2.0)) * 2e-3, 2e-3], rel=0.04)


@pytest.mark.parametrize("apex", [(0.5, 0.75**0.5), (0.5, 2.0)])
def test_a_triangle_s_width_does_not_depend_on_the_order_of_its_nodes(apex):
    """Of several longest sides the first was taken: an equilateral triangle was 0.87 or 1.22 of its side wide, as it
    was numbered. By the mean over all three it is as wide as its side in every direction.
    """
    nodes, law = 5e-3 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [*apex, 0.0]]), law_with_fracture()
    quads = np.array([[*order, order[2]] for order in permutations(range(3))])
    (block,) = shell_blocks(nodes, quads, [Section(2e-3, law.density, law.row())])
    for angle in np.linspace(0.0, np.pi, 7):
        pull = block.frame.reshape(-1, 3, 3)[:, :2] @ [np.cos(angle), np.sin(angle), 0.0]
        stress = np.column_stack([pull**2, pull.prod(axis=1)])
        widths = [crack_band(law.row(), size, one) for size, one in zip(block.size, stress, strict=True)]
        assert widths == pytest.approx([widths[0]] * 6, rel=1e-9)
        if apex[1] < 1.0:
            assert widths[0] == pytest.approx(5e-3)
