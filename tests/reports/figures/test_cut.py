"""A target in section: every sheet that the plane crosses, and nothing where a facet has failed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from birdstrike.reports.figures.cut import Sheets, cut, strips
from birdstrike.reports.figures.views import PLATE_FACE, Scene, draw_section, part_colours
from birdstrike.solver.target.mesh import rectangle, shell_mesh
from tests.reports.synthetic import strike

GRID, QUADS = rectangle(0.2, 0.1, (10, 4))
NODES = np.concatenate([np.column_stack([GRID, np.full(len(GRID), z)]) for z in (0.0, -0.03)])
TWO = np.concatenate([QUADS, QUADS + len(GRID)])
MESH = replace(shell_mesh(NODES, TWO), parts={"skin": np.arange(40), "inner_skin": np.arange(40, 80)})
SHEETS = Sheets.of(MESH, {"skin": 0.002, "inner_skin": 0.004})
SNAPSHOT = replace(strike().snapshots[0], nodes=NODES, quads=TWO, plate_stress=np.zeros(80))
SCENE = Scene(NODES, 0.002, 0.008, 1.0, SHEETS)


@pytest.mark.parametrize("y", [0.01, 0.0, -0.025])
def test_a_cut_of_two_sheets_has_a_segment_for_each_facet_crossed(y: float):
    """Ten facets of either sheet, also where the plane holds a row of nodes, and all of the sheets' length."""
    segments, facet = cut(NODES, TWO, y)
    assert len(segments) == len(np.unique(facet)) == 20
    assert np.allclose(segments[:, :, 1], y)
    assert np.allclose(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1), 0.02)
    assert np.count_nonzero(SHEETS.part[facet] == 1) == 10


def test_a_triangle_and_a_slanting_sheet_are_cut_where_the_plane_meets_them():
    nodes = np.array([[0.0, -1.0, 0.0], [2.0, -1.0, 0.0], [1.0, 1.0, 4.0]])
    segments, _ = cut(nodes, np.array([[0, 1, 2, 2]]), 0.0)
    assert np.allclose(np.sort(segments[0, :, 0]), [0.5, 1.5])
    assert np.allclose(segments[0, :, 2], 2.0)


def test_a_strip_is_as_thick_as_its_sheet_whatever_its_slope():
    segments = np.array([[[0.0, 0.0, 0.0], [0.03, 0.0, 0.04]]])
    corners = strips(segments, np.array([0.002]))[0]
    assert np.linalg.norm(corners[0] - corners[3]) == pytest.approx(0.002)
    assert (corners[0] - corners[3]) @ [3.0, 4.0] == pytest.approx(0.0, abs=1e-12)


def test_a_failed_facet_is_not_drawn():
    failed = cut(NODES, TWO, 0.0)[1][13]
    torn = replace(SNAPSHOT, quads=np.delete(TWO, failed, axis=0), plate_stress=np.zeros(79))
    for snapshot, count in ((SNAPSHOT, 20), (torn, 19)):
        axes = Figure().subplots()
        draw_section(axes, snapshot, SCENE)
        (drawn,) = axes.collections
        assert len(drawn.get_paths()) == count
    middle = 1e3 * NODES[TWO[failed]].mean(axis=0)
    boxes = [path.get_extents() for path in drawn.get_paths()]
    inside = [box.x0 < middle[0] < box.x1 and box.y0 < middle[2] < box.y1 for box in boxes]
    assert not any(inside), "a gap where the facet was"


def test_parts_have_colours_of_their_own_and_a_plate_alone_that_of_plates():
    colours = part_colours(SHEETS.names)
    assert len(np.unique(colours, axis=0)) == 2
    assert len(part_colours(("plate",))) == 1
    assert PLATE_FACE.startswith("#")
