"""Contact on any facets: T-joints, corners, overlaps, rims, both sides; no particle gets through, none gains energy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SEED
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.contact import Contact
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.links.anchors import Anchors, Surface, weights_of_line
from birdstrike.solver.target.links.ties import Ties
from birdstrike.solver.target.mesh import shell_mesh
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.part_mesh import PartMesh
from birdstrike.solver.target.section import Section, ShellMaterial
from birdstrike.solver.target.sheets import sheets_of
from birdstrike.solver.target.supports import NAMED, rim_supports
from birdstrike.solver.target.triangle_block import shell_blocks
from tests.solver.target.triangles import cut

STEEL = ShellMaterial(200e9, 0.3, 7800.0)
SPACING = 5e-3
THICKNESS = (0.004, 0.008)
SIZE = 0.02
CELLS = 5


Numbers = NDArray[np.int64]


def grid(origin: Array, along: Array, across: Array, cells: tuple[int, int]) -> tuple[Array, Numbers]:
    """Points and quadrilaterals of a flat rectangle of SIZE-sized shells."""
    steps = [(i, j) for i in range(cells[0] + 1) for j in range(cells[1] + 1)]
    points = np.array([origin + i * SIZE * along + j * SIZE * across for i, j in steps])
    row = cells[1] + 1
    corner = np.array([i * row + j for i in range(cells[0]) for j in range(cells[1])])
    return points, np.stack([corner, corner + row, corner + row + 1, corner + 1], axis=1)


def joined(*grids: tuple[Array, Numbers]) -> tuple[Array, Numbers, Numbers]:
    """Grids with their common nodes merged: nodes, quadrilaterals, and which grid each is of."""
    points = np.concatenate([nodes for nodes, _ in grids])
    _, first, same = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    offsets = np.cumsum([0, *(len(nodes) for nodes, _ in grids)])
    quads = np.concatenate([same.ravel()[quads + at] for (_, quads), at in zip(grids, offsets, strict=False)])
    part = np.repeat(np.arange(len(grids)), [len(quads) for _, quads in grids])
    return points[first], quads.astype(np.int64), part.astype(np.int64)


X, Y, Z = np.eye(3)


def stiffened(blades: tuple[float, ...] = (0.0,), flipped: bool = False, triangles: bool = False) -> Target:
    """A skin of 0.2 x 0.1 m in z = 0 with blades at x on the side z < 0, all of whose facets can be wound anyhow."""
    skin = grid(np.array([-0.1, -0.05, 0.0]), X, Y, (10, CELLS))
    plates = [grid(np.array([x, -0.05, 0.0]), -Z, Y, (2, CELLS)) for x in blades]
    nodes, quads, part = joined(skin, *plates)
    if flipped:
        quads[::3] = quads[::3, ::-1]
    if triangles:
        quads, part = cut(quads, crossed=True), np.repeat(part, 2)
    return target_of(nodes, quads, np.minimum(part, 1))


def target_of(nodes: Array, quads: Numbers, section: Numbers) -> Target:
    mesh = shell_mesh(nodes, quads)
    sections = [Section(thickness, STEEL.density, STEEL.row()) for thickness in THICKNESS]
    blocks = shell_blocks(nodes, quads, sections, section)
    return Target(mesh, Nodes(nodes), blocks, rim_supports(mesh, NAMED["clamped"]))


def particles(x: Array, v: Array) -> Bird:
    return Bird(x, v, SEED.rho0 * SPACING**3, 1.2 * SPACING, SEED, (1.0, 2.0))


def fly(target: Target, bird: Bird, steps: int, dt: float, pull: Array | float = 0.0) -> Contact:
    """Particles without forces among themselves, pulled by `pull` [m/s^2], against a target that stands still."""
    contact = Contact(bird, target)
    for step in range(steps):
        contact.update_forces(bird, target)
        contact.update_energies(bird, target, dt if step else 0.0)
        bird.v[: bird.n] += (dt if step else 0.5 * dt) * (contact.on_bird / bird.masses[:, None] + pull)
        bird.x[: bird.n] += dt * bird.v[: bird.n]
    return contact


def test_a_skin_goes_on_over_a_joint_and_the_blade_is_a_sheet_of_its_own():
    target = stiffened((-0.04, 0.04), flipped=True)
    sheets = sheets_of(target.x, target.quads)
    assert sorted(len(sheet.facets) for sheet in sheets) == [10, 10, 50]
    skin = max(sheets, key=lambda sheet: len(sheet.facets))
    assert np.count_nonzero(skin.across < 0) == 2 * (10 + CELLS), "only the skin's own rim has no neighbour"
    corners = target.x[skin.quads]
    up = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])[:, 2]
    assert (up > 0.0).all() or (up < 0.0).all(), "wound alike, whichever way the mesh was"


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("slant", [0.0, 0.9])
def test_no_particle_gets_through_a_skin_over_a_joint(flipped, slant, triangles):
    """Dropped on both sides of two joints and onto them, straight and aslant: all come back, with their energy."""
    target = stiffened((-0.04, 0.04), flipped, triangles)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.05, 0.05, 41), np.linspace(-0.02, 0.02, 5)))
    start = np.column_stack([x, y, np.full_like(x, 0.5 * (THICKNESS[0] + SPACING) + 2e-4)])
    bird = particles(start, np.tile([40.0 * slant, 0.0, -40.0], (len(x), 1)))
    energy = bird.kinetic_energy()
    contact = fly(target, bird, 600, 1e-7)
    assert (bird.x[: bird.n, 2] > 0.5 * THICKNESS[0]).all()
    assert bird.v[: bird.n, 2] == pytest.approx(40.0, rel=1e-3)
    assert bird.kinetic_energy() == pytest.approx(energy, rel=1e-3)
    assert contact.deepest == 0.0
    assert abs(contact.energies["contact"]) < 1e-3 * energy


@pytest.mark.parametrize("triangles", [False, True])
def test_no_particle_that_slides_over_a_joint_gets_through(triangles):
    """Pressed onto the skin by 2e6 m/s^2 and sliding at 100 m/s: before sheets, all that met a joint fell through."""
    target = stiffened((-0.04, 0.04), flipped=triangles, triangles=triangles)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.05, 0.05, 41), np.linspace(-0.02, 0.02, 5)))
    start = np.column_stack([x, y, np.full_like(x, 0.5 * (THICKNESS[0] + SPACING) + 1e-5)])
    bird = particles(start, np.tile([100.0, 0.0, -1.0], (len(x), 1)))
    contact = fly(target, bird, 1500, 2e-7, np.array([0.0, 0.0, -2e6]))
    assert (bird.x[: bird.n, 2] > 0.4 * (THICKNESS[0] + SPACING)).all()
    assert contact.touching > 0


def tied_web(below: float, cells: int) -> Target:
    """As `stiffened` with the blade's nodes its own, `below` the skin [m], `cells` along it, tied onto the skin."""
    skin = grid(np.array([-0.1, -0.05, 0.0]), X, Y, (10, CELLS))
    blade = grid(np.array([0.0, -0.05, -below]), -Z, Y * CELLS / cells, (2, cells))
    nodes = np.concatenate([skin[0], blade[0]])
    quads = np.concatenate([skin[1], blade[1] + len(skin[0])])
    parts = PartMesh(nodes, quads, (np.arange(len(quads)) >= len(skin[1])).astype(np.int64), ("skin", "web"), {})
    top = len(skin[0]) + np.flatnonzero(blade[0][:, 2] == -below)
    border = np.column_stack([top[:-1], top[1:]])
    rows = weights_of_line(Surface.of(parts, "skin"), nodes, border, top)
    ties = Ties(top, Anchors.of(rows[int(node)] for node in top), nodes)
    sections = [Section(thickness, STEEL.density, STEEL.row()) for thickness in THICKNESS]
    blocks = shell_blocks(nodes, quads, sections, parts.part)
    mesh = shell_mesh(nodes, quads)
    return Target(mesh, Nodes(nodes), blocks, rim_supports(mesh, NAMED["free"]), ties=ties)


@pytest.mark.parametrize(("below", "cells"), [(0.0, CELLS), (0.0, 7), (0.001, CELLS), (0.002, 7)])
def test_the_edge_of_a_tied_web_is_not_touched_through_the_skin(below, cells):
    """Pressed onto the skin from the front, over the web and beside it: pushed by the skin alone, as by a merged one.

    Torn open, the skin lays the web's edge bare.
    """
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.03, 0.03, 31), np.linspace(-0.043, 0.043, 9)))
    start = np.column_stack([x, y, np.full_like(x, 0.5 * (THICKNESS[0] + SPACING) - 2e-4)])
    target = tied_web(below, cells)
    bird = particles(start, np.zeros_like(start))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    assert contact.touching == len(x)
    assert contact.on_bird == pytest.approx(np.tile(contact.stiffness * 2e-4 * Z, (len(x), 1)), rel=1e-6, abs=1e-6)
    target.blocks[0].alive[: 10 * CELLS] = False
    away = particles(start + 0.01 * Z, np.tile(-40.0 * Z, (len(x), 1)))
    contact = fly(target, away, 400, 1e-6)
    falling = away.v[: away.n, 2]
    assert (falling[np.abs(x) < 3e-3] > 0.0).all(), "thrown back by the edge"
    assert (falling[np.abs(x) > 0.5 * (THICKNESS[1] + SPACING)] == -40.0).all()


def test_a_particle_in_a_corner_touches_both_walls():
    """Behind the skin beside a blade, pressed 0.5 mm into both: pushed from each along its own normal."""
    target = stiffened()
    inside = 0.5 * (np.array(THICKNESS) + SPACING) - 5e-4
    bird = particles(np.array([[inside[1], 0.01, -inside[0]]]), np.zeros((1, 3)))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    assert contact.touching == 2
    push = contact.stiffness * 5e-4
    assert contact.on_bird[0] == pytest.approx([push, 0.0, -push], abs=1e-6 * push)


@pytest.mark.parametrize("speed", [[30.0, 0.0, 30.0], [30.0, 5.0, 20.0], [-25.0, 0.0, 30.0]])
@pytest.mark.parametrize("triangles", [False, True])
def test_a_particle_bounces_out_of_a_corner_without_loss(speed, triangles):
    """Into the corner of skin and blade from behind; it leaves with its energy, on the side that it came from."""
    target = stiffened(triangles=triangles)
    side = -np.sign(speed[0])
    bird = particles(np.array([[0.010 * side, 0.01, -0.008]]), np.array([speed]))
    energy = bird.kinetic_energy()
    fly(target, bird, 3500, 1e-7)
    assert bird.x[0, 0] * side > 0.0
    assert bird.x[0, 2] < 0.0
    assert bird.kinetic_energy() == pytest.approx(energy, rel=2e-3)
    assert bird.v[0, 2] < 0.0
    assert bird.v[0, 0] * side > 0.0


@pytest.mark.parametrize("triangles", [False, True])
def test_a_free_edge_is_touched_and_pushes_along_the_line_from_it(triangles):
    """A particle that flies at a blade's free edge from below is thrown back, without gaining energy."""
    target = stiffened(triangles=triangles)
    bird = particles(np.array([[0.0005, 0.013, -0.049]]), np.array([[0.0, 0.0, 30.0]]))
    energy = bird.kinetic_energy()
    fly(target, bird, 2000, 1e-7)
    assert bird.v[0, 2] < 0.0, "thrown back by the edge"
    assert bird.kinetic_energy() == pytest.approx(energy, rel=2e-3)


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("lean", [0.0, 0.3, 0.8])
def test_a_free_edge_is_touched_all_along_it(lean, triangles):
    """0.3 mm deep everywhere; where a triangle only has a corner there, what is beside it has the same corner."""
    target = stiffened(triangles=triangles)
    y, away = np.linspace(-0.045, 0.045, 91), 0.5 * (THICKNESS[1] + SPACING) - 3e-4
    at = np.column_stack([np.full_like(y, away * np.sin(lean)), y, np.full_like(y, -0.04 - away * np.cos(lean))])
    bird = particles(at, np.zeros_like(at))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    push = contact.stiffness * 3e-4 * np.array([np.sin(lean), 0.0, -np.cos(lean)])
    assert contact.on_bird == pytest.approx(np.tile(push, (len(y), 1)), abs=1e-6 * contact.stiffness * 3e-4)


def test_an_angle_s_outer_corner_is_touched_once():
    """A sharp fold: two sheets, one edge. From outside at 45 degrees the edge pushes once, along the bisector."""
    one = grid(np.array([0.0, -0.05, 0.0]), X, Y, (3, CELLS))
    other = grid(np.array([0.0, -0.05, 0.0]), -Z, Y, (3, CELLS))
    nodes, quads, _ = joined(one, other)
    target = target_of(nodes, quads, np.zeros(len(quads), np.int64))
    assert len(sheets_of(nodes, quads)) == 2
    gap = 0.5 * (THICKNESS[0] + SPACING)
    away = (gap - 4e-4) / np.sqrt(2.0)
    bird = particles(np.array([[-away, 0.013, away]]), np.zeros((1, 3)))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    assert contact.touching == 1
    push = contact.stiffness * 4e-4 / np.sqrt(2.0)
    assert contact.on_bird[0] == pytest.approx([-push, 0.0, push], abs=1e-3 * push)


@pytest.mark.parametrize("triangles", [False, True])
def test_a_particle_that_leaves_one_facet_of_a_valley_for_the_other_gains_nothing(triangles):
    """A skin bent by 30 degrees over a blade: where the first facet ends, the second has been nearer for a while."""
    slope = np.tan(np.radians(15.0))
    target = stiffened((0.0,), triangles=triangles)
    target.x[:, 2] += slope * np.abs(target.x[:, 0])
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.015, 0.015, 31), [-0.013, 0.0, 0.017]))
    height = 0.5 * (THICKNESS[0] + SPACING) / np.cos(np.radians(15.0)) + 1e-4
    start = np.column_stack([x, y, slope * np.abs(x) + height])
    bird = particles(start, np.tile([60.0, 0.0, -30.0], (len(x), 1)))
    energy, gained = bird.kinetic_energy(), 0.0
    assert len(sheets_of(target.x, target.quads)) == 2
    contact = Contact(bird, target)
    for step in range(1200):
        contact.update_forces(bird, target)
        contact.update_energies(bird, target, 2e-7 if step else 0.0)
        gained = max(gained, contact.stored - contact.energies["contact"])
        bird.v[: bird.n] += (2e-7 if step else 1e-7) * contact.on_bird / bird.masses[:, None]
        bird.x[: bird.n] += 2e-7 * bird.v[: bird.n]
    assert gained < 1e-4 * energy
    assert bird.kinetic_energy() + contact.stored == pytest.approx(energy, rel=1e-3)


@pytest.mark.parametrize("triangles", [False, True])
def test_a_sharp_fold_of_warped_facets_is_touched_from_all_around(triangles):
    """Particles thrown past the edge between a web and a foot that has been bent: none of it is left out or late."""
    one = grid(np.array([0.0, -0.05, 0.0]), X, Y, (3, CELLS))
    other = grid(np.array([0.0, -0.05, 0.0]), -Z, Y, (3, CELLS))
    nodes, quads, _ = joined(one, other)
    sag = np.where(np.round(nodes[:, 1] / SIZE + 0.5) % 2 == 1, 0.2, -0.2)
    nodes[:, 2] -= (sag + 0.2) * nodes[:, 0]
    quads = cut(quads, crossed=True) if triangles else quads
    target = target_of(nodes, quads, np.zeros(len(quads), np.int64))
    y = np.linspace(-0.045, 0.045, 46)
    start = np.column_stack([np.full_like(y, -0.004), y, np.full_like(y, 0.008)])
    bird = particles(start, np.tile([25.0, 0.0, -25.0], (len(y), 1)))
    energy = bird.kinetic_energy()
    contact = fly(target, bird, 3000, 1e-7)
    assert len(contact.sheets) == 2
    assert bird.kinetic_energy() == pytest.approx(energy, rel=2e-3)
    assert abs(contact.energies["contact"]) < 1e-3 * energy


@pytest.mark.parametrize("triangles", [False, True])
def test_the_rims_of_a_hole_are_touched_in_time(triangles):
    """Particles that fly about in a torn skin's plane, from rim to rim and into corners, keep their energy."""
    target = stiffened((), triangles=triangles)
    middle = target.x[target.quads].mean(axis=1)
    target.alive[(np.abs(middle[:, :2] - [0.01, 0.0]) < 0.03).all(axis=1)] = False
    target.alive[(np.abs(middle[:, :2] - [0.05, 0.02]) < 0.01).all(axis=1)] = False
    rng = np.random.default_rng(4)
    start = np.column_stack([rng.uniform([-0.01, -0.02], [0.03, 0.02], (60, 2)), np.zeros(60)])
    turn = rng.uniform(0.0, 2.0 * np.pi, 60)
    bird = particles(start, 60.0 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(60)]))
    energy = bird.kinetic_energy()
    contact = fly(target, bird, 4000, 2e-7)
    assert np.count_nonzero(np.abs(bird.v[:60] @ [1.0, 1.0, 0.0] - 60.0 * (np.cos(turn) + np.sin(turn))) > 1.0) > 30
    assert bird.kinetic_energy() + contact.stored == pytest.approx(energy, rel=2e-3)
    assert contact.stored - contact.energies["contact"] < 1e-3 * energy


def test_what_lies_over_a_border_that_a_tear_lays_bare_gains_nothing():
    """A blade's edge under a skin and a particle that is pressed on the skin: sprung open, it pushes nothing."""
    target = stiffened()
    skin = np.abs(target.x[target.quads][:, :, 2]).max(axis=1) == 0.0
    bird = particles(np.array([[0.0, 0.013, 0.5 * (THICKNESS[0] + SPACING) - 1e-4]]), np.array([[0.0, 0.0, -10.0]]))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    target.alive[skin] = False
    for _ in range(20):
        contact.update_forces(bird, target)
        assert contact.touching == 0
        bird.x[: bird.n] += 1e-6 * bird.v[: bird.n]


@pytest.mark.parametrize("triangles", [False, True])
def test_after_a_tear_a_particle_touches_what_a_search_of_the_whole_surface_finds(triangles):
    """Particles that fly on over a skin that tears four times: forces as if all nearest facets were looked for anew."""
    rng = np.random.default_rng(7)
    start = rng.uniform([-0.05, -0.03, 0.0], [0.05, 0.03, 0.0], (400, 3))
    start[:, 2] = 0.5 * (THICKNESS[0] + SPACING) + rng.uniform(-2e-4, 4e-3, 400)
    speed = rng.normal(0.0, 30.0, (400, 3))
    target = stiffened((-0.04, 0.04), triangles=triangles)
    facets = np.flatnonzero(np.abs(target.x[target.quads][:, :, 2]).max(axis=1) == 0.0)
    ours, anew = (Contact(particles(start, speed), target) for _ in range(2))
    bird, touched = particles(start, speed), 0
    for step in range(200):
        if step % 50 == 25:
            target.alive[rng.choice(facets, 4, replace=False)] = False
        ours.update_forces(bird, target)
        anew.update_forces(bird, target)
        anew.search(bird, target)
        assert ours.on_bird == pytest.approx(anew.on_bird, rel=1e-9, abs=1e-9 * np.abs(anew.on_bird).max())
        touched += ours.touching
        bird.v[: bird.n] += 1e-6 * ours.on_bird / bird.masses[:, None]
        bird.x[: bird.n] += 1e-6 * bird.v[: bird.n]
    assert touched > 1000, "it is tried"


def test_overlapping_skins_are_touched_one_after_the_other():
    """Two parallel skins 6 mm apart: a particle above touches the upper alone, with the gap of its own thickness."""
    one = grid(np.array([-0.1, -0.05, 0.0]), X, Y, (10, CELLS))
    other = grid(np.array([-0.1, -0.05, -0.006]), X, Y, (10, CELLS))
    nodes, quads, part = joined(one, other)
    target = target_of(nodes, quads, part)
    bird = particles(np.array([[0.0, 0.0, 0.5 * (THICKNESS[0] + SPACING) - 2e-4]]), np.zeros((1, 3)))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    assert contact.touching == 1
    assert contact.on_bird[0, 2] == pytest.approx(contact.stiffness * 2e-4)


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_particle_that_slides_over_a_step_of_thickness_gains_nothing(way, triangles):
    """Pressed on 4 mm and on 8 mm alike; once it has been clear, it is touched at the gap of what is under it."""
    nodes, quads = grid(np.array([-0.1, -0.05, 0.0]), X, Y, (10, CELLS))
    quads = cut(quads, crossed=True) if triangles else quads
    target = target_of(nodes, quads, (nodes[quads].mean(axis=1)[:, 0] > 0.0).astype(np.int64))
    first, second = THICKNESS if way > 0.0 else THICKNESS[::-1]
    bird = particles(np.array([[-0.05 * way, 0.003, 0.5 * (first + SPACING)]]), np.array([[100.0 * way, 0.0, 0.0]]))
    contact = fly(target, bird, 1000, 1e-6, pull=np.array([0.0, 0.0, -1e5]))
    assert bird.x[0, 0] == pytest.approx(0.05 * way)
    assert contact.stored == pytest.approx(contact.energies["contact"], abs=1e-3 * contact.stored)
    for height in (0.03, 0.01, 0.5 * (second + SPACING) - 2e-4):
        bird.x[0, 2] = height
        contact.update_forces(bird, target)
    assert contact.on_bird[0, 2] == pytest.approx(contact.stiffness * 2e-4)


@pytest.mark.parametrize("web_first", [False, True])
@pytest.mark.parametrize("thicker", ["skin", "web"])
def test_a_particle_that_is_pressed_round_a_fold_between_two_thicknesses_gains_nothing(thicker, web_first):
    """Pulled from a skin's top round the fold to its web's outside: half the difference of 4 mm was 1.3 J of 0.29."""
    skin = grid(np.array([-0.1, -0.05, 0.0]), X, Y, (5, CELLS))
    web = grid(np.array([0.0, -0.05, 0.0]), -Z, Y, (3, CELLS))
    nodes, quads, part = joined(web, skin) if web_first else joined(skin, web)
    on_web = (part == 0) == web_first
    target = target_of(nodes, quads, (on_web == (thicker == "web")).astype(np.int64))
    gap = 0.5 * (THICKNESS[int(thicker == "skin")] + SPACING)
    inner = np.array([-0.012, 0.003, -0.012])
    bird = particles(np.array([[-0.012, 0.003, gap]]), np.array([[70.0, 0.0, 0.0]]))
    contact, gained = Contact(bird, target), 0.0
    for step in range(1200):
        contact.update_forces(bird, target)
        contact.update_energies(bird, target, 5e-7 if step else 0.0)
        gained = max(gained, contact.stored - contact.energies["contact"])
        pull = 3e5 * (inner - bird.x[0]) / np.linalg.norm(inner - bird.x[0])
        bird.v[: bird.n] += (5e-7 if step else 2.5e-7) * (contact.on_bird / bird.masses[:, None] + pull)
        bird.x[: bird.n] += 5e-7 * bird.v[: bird.n]
    assert bird.x[0, 2] < -0.005, "it has come round"
    assert gained < 1e-3 * 0.5 * bird.masses[0] * 70.0**2


@pytest.mark.parametrize("triangles", [False, True])
def test_forces_on_particles_and_nodes_are_equal_and_opposite(triangles):
    target = stiffened((-0.04, 0.0, 0.04), flipped=True, triangles=triangles)
    rng = np.random.default_rng(2)
    x = rng.uniform([-0.09, -0.04, -0.03], [0.09, 0.04, 0.005], (800, 3))
    bird = particles(x, np.zeros_like(x))
    contact = Contact(bird, target)
    contact.update_forces(bird, target)
    assert contact.touching > 100
    scale = np.abs(contact.on_bird).sum()
    assert np.abs(contact.on_bird.sum(axis=0) + contact.on_plate.sum(axis=0)).max() < 1e-13 * scale
    moment = np.cross(bird.x[: bird.n], contact.on_bird).sum(axis=0)
    moment += np.cross(target.x, contact.on_plate).sum(axis=0)
    assert np.abs(moment).max() < 1e-6 * scale * 0.1


def test_a_bare_joint_s_edge_is_touched_once_the_skin_has_torn():
    target = stiffened()
    skin = np.abs(target.x[target.quads][:, :, 2]).max(axis=1) == 0.0
    bird = particles(np.array([[0.0, 0.013, 0.009]]), np.array([[0.0, 0.0, -30.0]]))
    target.alive[skin] = False
    contact = fly(target, bird, 2000, 1e-7)
    assert bird.v[0, 2] > 0.0, "thrown back by the blade's edge"
    assert contact.touching == 0


def test_no_particle_gets_into_a_ball_of_triangles_nor_out_of_it():
    """Corners where five and six triangles meet, inside and outside: particles thrown at it stay on their side."""
    ball = ConvexHull(_on_a_ball(120))
    quads = np.column_stack([ball.simplices, ball.simplices[:, 2]]).astype(np.int64)
    target = target_of(0.05 * ball.points, quads, np.zeros(len(quads), np.int64))
    assert len(sheets_of(target.x, quads)) == 1
    start = np.concatenate([0.07 * _on_a_ball(150), 0.03 * _on_a_ball(150)])
    rng = np.random.default_rng(5)
    speed = np.concatenate([-40.0 * start[:150] / 0.07, 40.0 * start[150:] / 0.03]) + rng.normal(0.0, 8.0, (300, 3))
    bird = particles(start, speed)
    energy = bird.kinetic_energy()
    fly(target, bird, 12000, 1e-7)
    away = np.linalg.norm(bird.x[: bird.n], axis=1)
    assert (away[:150] > 0.05).all()
    assert (away[150:] < 0.05).all()
    assert bird.kinetic_energy() == pytest.approx(energy, rel=5e-3)


def _on_a_ball(count: int) -> Array:
    """Points of a unit sphere, evenly (Fibonacci's spiral)."""
    turn = np.pi * (1.0 + 5.0**0.5) * np.arange(count)
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    across = np.sqrt(1.0 - z * z)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
