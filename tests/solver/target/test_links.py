"""Ties and rivets: constant strain across meshes that do not match, momenta kept, strength exact, energy counted."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.errors import CaseError, UserError
from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import load_case
from birdstrike.solver.kernels.target.links import EITHER_WAY, ONE_WAY, use_of_strength
from birdstrike.solver.setup_warnings import long_rivets, loose_ties
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.assembled import LinkData, PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.links.rivets import RivetData, Rivets
from birdstrike.solver.target.links.ties import TieData, Ties
from birdstrike.solver.target.modes import natural_frequencies
from birdstrike.solver.target.part_mesh import PartMesh, Patch, Row, merged
from birdstrike.solver.target.shell_block import ShellBlock
from birdstrike.solver.target.supports import NAMED, ROTATIONS, EdgeStiffness
from birdstrike.solver.target.triangle_block import TriangleBlock
from tests.solver.target.triangles import cut

METAL = TARGET_LAWS.validate(
    {"law": "bilinear", "young": "70 GPa", "poisson": 0.3, "density": "2700 kg/m^3", "yield_stress": "10000 MPa"}
)
ZERO = (0.0, 0.0, 0.0)


def level(x: tuple[float, float], y: tuple[float, float], cells: tuple[int, int], z: float = 0.0) -> Patch:
    places = np.meshgrid(np.linspace(*x, cells[0] + 1), np.linspace(*y, cells[1] + 1), indexing="ij")
    return Patch("", np.stack([*places, np.full_like(places[0], z)], axis=-1))


def parts_of(patches: dict[str, Patch], triangles: bool = False) -> PartMesh:
    """Patches that share no node, each a part with a set of its own name; the last of triangles where asked for."""
    each = [merged([patch]) for patch in patches.values()]
    if triangles:
        nodes, quads, patch = each[-1]
        each[-1] = nodes, cut(quads, crossed=True), np.repeat(patch, 2)
    offsets = np.cumsum([0, *(len(nodes) for nodes, _, _ in each)])
    quads = np.concatenate([quads + at for (_, quads, _), at in zip(each, offsets, strict=False)])
    part = np.repeat(np.arange(len(each)), [len(quads) for _, quads, _ in each])
    sets = {name: np.arange(offsets[i], offsets[i + 1]) for i, name in enumerate(patches)}
    return PartMesh(np.concatenate([nodes for nodes, _, _ in each]), quads, part, tuple(patches), sets)


def target_of(parts: PartMesh, links: LinkData, thickness: float = 2e-3) -> Target:
    return assembled(parts, dict.fromkeys(parts.parts, PartData(thickness, METAL)), {}, 0.0, links)


def halves(left: int, right: int, triangles: bool = False) -> PartMesh:
    """A square of 120 mm in two halves, with so many shells each along the line between them."""
    return parts_of(
        {
            "left": level((-0.06, 0.0), (-0.06, 0.06), (2, left)),
            "right": level((0.0, 0.06), (-0.06, 0.06), (3, right)),
        },
        triangles,
    )


def tied(parts: PartMesh) -> Target:
    return target_of(parts, LinkData({"seam": TieData("right", "left", 1e-4)}))


def ties_in(target: Target) -> Ties:
    assert target.ties is not None
    return target.ties


def rivets_in(target: Target) -> Rivets:
    assert target.rivets is not None
    return target.rivets


def momenta(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum of the nodes that have mass."""
    linear = target.mass[:, None] * target.v
    return linear.sum(axis=0), (np.cross(target.x, linear) + target.inertia[:, None] * target.omega).sum(axis=0)


def fly(target: Target, steps: int, dt: float) -> float:
    """Steps of a target that is left alone; its whole energy [J] at the last of them."""
    still, before = np.zeros_like(target.x), 0.0
    for k in range(steps + 1):
        target.update_forces(dt if k else 0.0)
        target.update_energies()
        before = target.kinetic_energy()
        target.kick_and_drift(dt if k else 0.5 * dt, dt, still)
    return 0.5 * (before + target.kinetic_energy()) + sum(target.energies.values())


def all_strains(target: Target) -> np.ndarray:
    """Membrane strains (e, 3) of the last step in x and y, of quadrilaterals and of triangles."""
    found = []
    for block in target.blocks:
        assert isinstance(block, ShellBlock | TriangleBlock)
        turn = block.frame.reshape(-1, 3, 3)[:, :2, :2]
        half = 0.5 * block.strain[:, 2]
        tensor = np.stack([block.strain[:, 0], half, half, block.strain[:, 1]], axis=1).reshape(-1, 2, 2)
        there = np.einsum("eji,ejk,ekl->eil", turn, tensor, turn)
        found.append(np.column_stack([there[:, 0, 0], there[:, 1, 1], 2.0 * there[:, 0, 1]]))
    return np.concatenate(found)


@pytest.mark.parametrize("cells", [(2, 3), (4, 7), (3, 3)])
def test_constant_strain_passes_a_tie_onto_triangles(cells):
    """Quadrilaterals on one side, triangles on the other: every shell has the strain of the field, inner nodes rest."""
    target = tied(halves(*cells, triangles=True))
    assert len(target.blocks) == 2
    target.v[:, :2] = target.x[:, :2] @ np.array([[1e-3, 4e-4], [4e-4, -5e-4]])
    ties_in(target).follow(target.nodes, 0.0)
    dt = 1e-6
    target.update_forces(dt)
    assert np.allclose(all_strains(target) / dt, [1e-3, -5e-4, 8e-4], rtol=0.0, atol=1e-8 * 1e-3)
    target.share_forces(np.zeros_like(target.x))
    inner = (np.abs(target.x[:, :2]) < 0.0599).all(axis=1)
    assert inner.sum() > cells[0] - 1
    assert np.abs(target.nodal[inner]).max() < 1e-8 * np.abs(target.nodal).max()


@pytest.mark.parametrize("cells", [(2, 3), (4, 7), (3, 3)])
def test_constant_strain_passes_a_tie_between_meshes_that_do_not_match(cells):
    """Every shell has the strain of the field, and the forces of all inner nodes vanish."""
    target = tied(halves(*cells))
    gradient = np.array([[1e-3, 4e-4, 0.0], [4e-4, -5e-4, 0.0], ZERO])
    target.v[:] = target.x @ gradient.T
    ties_in(target).follow(target.nodes, 0.0)
    assert np.allclose(target.v, target.x @ gradient.T, rtol=0.0, atol=1e-8 * 1e-3 * 0.06)
    target.update_forces(1.0)
    strains = target.shells.strain[:, :3]
    assert np.abs(strains - strains[0]).max() < 1e-8 * np.abs(strains[0]).max()
    target.share_forces(np.zeros_like(target.x))
    inner = (np.abs(target.x[:, :2]) < 0.0599).all(axis=1)
    assert inner.sum() > cells[0] - 1
    assert np.abs(target.nodal[inner]).max() < 1e-8 * np.abs(target.nodal).max()


def test_a_tied_plate_that_flies_and_spins_keeps_its_momenta():
    """Also where the tied part lies beside the other, on an arm."""
    parts = parts_of(
        {
            "left": level((-0.06, 0.03), (-0.06, 0.06), (3, 4)),
            "right": level((0.01, 0.06), (-0.05, 0.05), (2, 3), -5e-3),
        }
    )
    edge = np.flatnonzero((np.abs(parts.nodes[:, 0] - 0.01) < 1e-9) & (parts.nodes[:, 2] < 0.0))
    parts = replace(parts, sets={**parts.sets, "edge": edge})
    target = target_of(parts, LinkData({"bond": TieData("edge", "left", 6e-3)}))
    assert len(ties_in(target).followers) == len(edge)
    rng = np.random.default_rng(1)
    moving = (target.mass > 0.0)[:, None]
    target.v[:] = moving * (0.1 * rng.normal(size=target.v.shape) + np.cross([30.0, 20.0, 50.0], target.x))
    target.omega[:] = moving * np.array([30.0, 20.0, 50.0])
    ties_in(target).follow(target.nodes, 0.0)
    before, dt = momenta(target), 0.5 * target.stable_step()
    energy = target.kinetic_energy()
    after = fly(target, 300, dt)
    linear, angular = momenta(target)
    assert np.linalg.norm(linear - before[0]) < 1e-12 * np.linalg.norm(before[0])
    assert np.linalg.norm(angular - before[1]) < 1e-12 * np.linalg.norm(before[1])
    assert after == pytest.approx(energy, rel=1e-3)
    follower = ties_in(target).followers
    gap = target.x[follower] - ties_in(target).anchors.means(target.x)
    assert np.allclose(np.linalg.norm(gap, axis=1), np.linalg.norm(ties_in(target).arm, axis=1), rtol=1e-9)
    assert np.allclose(np.linalg.norm(ties_in(target).arm, axis=1), 5e-3, rtol=1e-9)


def test_a_tied_plate_vibrates_as_one_whose_nodes_are_merged():
    whole = PartMesh(*merged([level((-0.06, 0.06), (-0.06, 0.06), (6, 6))]), ("plate",), {})
    first = natural_frequencies(target_of(whole, LinkData()), 10)[0][6:]
    parts = parts_of(
        {
            "left": level((-0.06, 0.0), (-0.06, 0.06), (3, 6)),
            "right": level((0.0, 0.06), (-0.06, 0.06), (3, 6)),
        }
    )
    assert natural_frequencies(tied(parts), 10)[0][6:] == pytest.approx(first, rel=2e-5)


def test_a_tied_node_gives_its_mass_and_the_inertia_of_its_arm_to_those_that_it_follows():
    """As much mass in all, and for each follower m arm^2 more inertia about the nodes that carry it."""
    parts = parts_of(
        {"skin": level((-0.06, 0.06), (-0.06, 0.06), (3, 3)), "web": level((-0.03, 0.03), (0.0, 0.03), (2, 1))}
    )
    parts.nodes[parts.sets["web"], 2] -= 5e-3
    free, bound = target_of(parts, LinkData()), target_of(parts, LinkData({"bond": TieData("web", "skin", 6e-3)}))
    assert list(ties_in(bound).followers) == list(parts.sets["web"])
    carried = free.mass[parts.sets["web"]].sum()
    assert carried > 0.0
    assert bound.mass.sum() == pytest.approx(free.mass.sum(), rel=1e-12)
    assert bound.inertia.sum() == pytest.approx(free.inertia.sum() + carried * 5e-3**2, rel=1e-12)
    assert 5e-3**2 * carried > 0.01 * free.inertia.sum()


RIVET = RivetData(2e7, 3e7, 100.0, tension=3500.0, shear=4500.0)


def lap_joint(rivet: RivetData = RIVET, triangles: bool = False) -> Target:
    """Two strips, one 2 mm behind the other, joined by one rivet at the origin."""
    parts = parts_of(
        {
            "front": level((-0.05, 0.01), (-0.01, 0.01), (6, 2)),
            "back": level((-0.01, 0.05), (-0.01, 0.01), (6, 2), -2e-3),
        },
        triangles,
    )
    row = Row(np.array([[0.0, 0.0, -1e-3]]), ("front", "back"))
    return target_of(parts, LinkData({}, (("row", row, rivet),)))


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_a_lap_joint_breaks_at_its_strength_exactly_and_its_energy_is_counted(degrees):
    """One strip is drawn away steadily, from along the sheets to straight off them."""
    target, a = lap_joint(), np.deg2rad(degrees)
    rivets, dt = rivets_in(target), 1e-7
    back = target.x[:, 2] < -1e-3
    target.v[back] = np.array([np.cos(a), 0.0, -np.sin(a)])
    most, energy, steps = 0.0, 0.0, 0
    assert rivets.losses(0.0) == ""
    while not rivets.lost:
        steps += 1
        target.nodal[:] = 0.0
        target.x[:] += dt * target.v
        energy += rivets.update_forces(target.nodes, dt)
        most = max(most, float(np.linalg.norm(rivets.force[0, :3])))
    assert rivets.losses(-1e-3) == f"1 of 1 of row at {1e3 * steps * dt - 1.0:.3f} ms"
    tension, shear = RIVET.along * np.sin(a), RIVET.across * np.cos(a)
    give = 1.0 / np.hypot(tension / RIVET.tension, shear / RIVET.shear)
    assert most == pytest.approx(np.hypot(tension, shear) * give, rel=1e-9)
    assert energy == pytest.approx(
        0.5 * (RIVET.along * np.sin(a) ** 2 + RIVET.across * np.cos(a) ** 2) * give**2, rel=5e-3
    )
    assert not rivets_in(target).update_forces(target.nodes, dt)


@pytest.mark.parametrize(
    ("give", "limit", "use"),
    [
        ((1e-4, 0.0, 0.0), ONE_WAY, (2000.0 / 3500.0) ** 1.5),
        ((-1e-4, 0.0, 0.0), ONE_WAY, 0.0),
        ((-1e-4, 0.0, 0.0), EITHER_WAY, (2000.0 / 3500.0) ** 1.5),
        ((1e-4, 6e-5, -8e-5), ONE_WAY, (2000.0 / 3500.0) ** 1.5 + (3000.0 / 4500.0) ** 3.0),
    ],
)
def test_tension_and_shear_use_a_rivet_s_strength_each_by_its_own_exponent(give, limit, use):
    """Sheets that are pressed together use none of it."""
    row = replace(RIVET, exponents=(1.5, 3.0)).row(limit)
    assert use_of_strength(row, np.array([*give, 0.0, 0.0, 0.0]), 1.0) == pytest.approx(use, rel=1e-12)


PULLED = METAL.model_copy(update={"poisson": 0.0})
"""Bars, so that strips one shell wide stretch alone."""
RATIO = RIVET.across * 0.025 / (70e9 * 0.03 * 2e-3)
"""Stiffness of a rivet over that of a strip between two of them."""


def pulled_joint(rivet: RivetData) -> tuple[Target, np.ndarray]:
    """Two strips of 30 x 2 mm in one plane, one shell wide, joined by three rivets 25 mm apart; one is held at its end.

    Returns the target and the nodes at the end of the other.
    """
    parts = parts_of(
        {
            "front": level((-0.05, 0.075), (-0.015, 0.015), (5, 1)),
            "back": level((0.0, 0.125), (-0.015, 0.015), (5, 1)),
        }
    )
    held, end = np.flatnonzero(parts.nodes[:, 0] < -0.049), np.flatnonzero(parts.nodes[:, 0] > 0.124)
    parts = replace(parts, sets={"left": held})
    row = Row(np.array([[0.025 * i, 0.0, 0.0] for i in range(3)]), ("front", "back"))
    data = dict.fromkeys(parts.parts, PartData(2e-3, PULLED))
    links = LinkData({}, (("row", row, rivet),))
    return assembled(parts, data, {"left": NAMED["clamped"]}, 6e4, links), end


def pull(target: Target, end: np.ndarray, force: np.ndarray, dt: float = 2e-6) -> np.ndarray:
    """Forces (steps, rivets, 3) on the second strip while its end is drawn by `force` (steps,) [N] along x."""
    rivets, found = rivets_in(target), np.zeros((len(force), len(rivets_in(target)), 3))
    for k, whole in enumerate(force):
        applied = np.zeros_like(target.x)
        applied[end, 0] = whole / len(end)
        target.update_forces(dt if k else 0.0)
        found[k] = rivets.force[:, :3]
        target.kick_and_drift(dt if k else 0.5 * dt, dt, applied)
    return found


def test_rivets_of_a_pulled_lap_joint_share_the_load_as_springs_between_bars():
    """Of three rivets of stiffness k at a pitch p, F1 = F3 = F2 (1 + k p/E A); together they carry what is applied."""
    target, end = pulled_joint(RIVET)
    forces = -pull(target, end, np.full(600, 1000.0))[-1, :, 0]
    assert forces.sum() == pytest.approx(1000.0, rel=1e-4)
    assert forces == pytest.approx(np.array([1.0 + RATIO, 1.0, 1.0 + RATIO]) * 1000.0 / (3.0 + 2.0 * RATIO), rel=2e-4)


def test_a_slowly_pulled_lap_joint_fails_where_its_outer_rivets_reach_their_strength():
    target, end = pulled_joint(RIVET)
    force = np.linspace(0.0, 13500.0, 3000)
    forces = np.linalg.norm(pull(target, end, force), axis=2)
    first = int(np.argmax(forces.max(axis=1) >= RIVET.shear * (1.0 - 1e-9)))
    assert force[first] == pytest.approx(RIVET.shear * (3.0 + 2.0 * RATIO) / (1.0 + RATIO), rel=0.02)
    assert forces.max() == pytest.approx(RIVET.shear, rel=1e-9)
    assert rivets_in(target).lost == 3


@pytest.mark.parametrize("triangles", [False, True])
def test_strips_that_tear_off_their_rivet_keep_momenta_and_energy(triangles):
    """Both of quadrilaterals, or the one behind of triangles."""
    target = lap_joint(triangles=triangles)
    target.v[target.x[:, 2] < -1e-3] = [40.0, 5.0, -30.0]
    before, energy, dt = momenta(target), target.kinetic_energy(), 0.5 * target.stable_step()
    after = fly(target, 400, dt)
    assert rivets_in(target).lost == 1
    linear, angular = momenta(target)
    assert np.linalg.norm(linear - before[0]) < 1e-12 * np.linalg.norm(before[0])
    assert np.linalg.norm(angular - before[1]) < 1e-12 * np.linalg.norm(before[1])
    assert after == pytest.approx(energy, rel=5e-3)


@pytest.mark.parametrize(
    ("nodes", "held", "said"),
    [
        ("left", {}, "all nodes of left belong to left itself"),
        ("right", {"right": NAMED["clamped"]}, "is held by target"),
    ],
)
def test_a_tie_whose_nodes_can_follow_nothing_is_named(nodes, held, said):
    parts = halves(2, 3)
    data = dict.fromkeys(parts.parts, PartData(2e-3, METAL))
    with pytest.raises(UserError, match=said):
        assembled(parts, data, held, 0.0, LinkData({"seam": TieData(nodes, "left", 1e-3)}))


def test_nodes_whose_rotations_alone_are_held_are_not_tied():
    parts = halves(4, 4)
    sets = {"far": np.flatnonzero(parts.nodes[:, 0] < -0.059), "near": parts.sets["right"][:3]}
    supports = {"far": NAMED["clamped"], "near": EdgeStiffness(in_plane=0.0, transverse=0.0)}
    data = dict.fromkeys(parts.parts, PartData(2e-3, METAL))
    links = LinkData({"seam": TieData("right", "left", 1e-4)})
    target = assembled(replace(parts, sets={**parts.sets, **sets}), data, supports, links=links)
    assert (target.nodes.held[sets["near"]] == ROTATIONS).all()
    assert list(ties_in(target).followers) == list(parts.sets["right"][3:5])


def test_a_tie_that_reaches_nothing_and_a_part_that_hangs_on_nothing_are_named():
    parts = halves(2, 3)
    moved = parts.nodes.copy()
    moved[parts.sets["right"], 2] += 0.01
    with pytest.raises(UserError, match=r"target\.ties\.seam: no node of right lies within distance"):
        tied(replace(parts, nodes=moved))
    data = dict.fromkeys(parts.parts, PartData(2e-3, METAL))
    with pytest.raises(UserError, match="shells of right hang on nothing"):
        assembled(parts, data, {"left": NAMED["clamped"]})


PANEL = {
    "target.generator.section": "Z",
    "target.generator.foot": "20 mm",
    "target.generator.flange": "20 mm",
    "target.generator.lap": "3 mm",
    "target.generator.rivet_pitch": "25 mm",
    "target.generator.element_size": "25 mm",
    "target.rivets.stiffeners.tension_strength": "3.5 kN",
    "target.rivets.stiffeners.shear_strength": "4.5 kN",
    "bird.particles": "150",
    "impact.standoff": "1 mm",
    "time.end": "0.6 ms",
}


def test_a_strike_on_a_riveted_panel_breaks_rivets_and_balances():
    whole = simulate(load_case("openradioss_panel", PANEL | {"target.rivets.stiffeners.tension_strength": "100 kN"}))
    weak = simulate(load_case("openradioss_panel", PANEL | {"effects.rivet_strength": "-0.8"}))
    assert weak.summary["rivets"] == whole.summary["rivets"] == 40
    assert weak.summary["broken_rivets"] > whole.summary["broken_rivets"]
    (said,) = (line for line in weak.summary["warnings"] if "rivets broke" in line)
    assert re.search(r"\(\d+ of 40 of stiffeners at -?0\.\d{3} to 0\.\d{3} ms\)$", said)
    for run in (whole, weak):
        assert run.summary["worst_energy_error"] < 0.02
        assert run.summary["momentum_error"] < 1e-9
    assert weak.channels["w_x60"].max() > whole.channels["w_x60"].max()


def test_sections_of_a_riveted_curved_panel_have_their_dimensions():
    """Area of every part, rivets midway between skin and foot, and the edges' sets on the bent panel."""
    sizes = {"target.generator.radius": "1200 mm", "target.generator.pad": '["100 mm", "150 mm"]'}
    sizes |= {"target.generator.overlap": "30 mm", "target.generator.joint": "170 mm"}
    parts = {f"target.parts.{name}.{key}": value for name in ("pad", "skin_2") for key, value in METAL_OF.items()}
    strong = {f"target.rivets.{row}.{key}_strength": "4 kN" for row in ("pad", "joint") for key in ("tension", "shear")}
    target = build_plate(load_case("openradioss_panel", PANEL | sizes | parts | strong))
    corners = target.mesh.nodes[target.mesh.quads]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    each = {name: float(area[facets].sum()) for name, facets in target.mesh.parts.items()}
    assert each["skin"] == pytest.approx(0.435 * 0.5, rel=2e-3)
    assert each["skin_2"] == pytest.approx(0.095 * 0.5, rel=5e-3)
    assert each["pad"] == pytest.approx(0.1 * 0.15, rel=5e-3)
    assert each["stiffeners"] == pytest.approx(2 * 0.5 * (0.02 + 0.02 + 0.037), rel=5e-2)
    radius = np.hypot(rivets_in(target).points[:, 0], rivets_in(target).points[:, 2] + 1.2)
    assert np.allclose(radius, 1.2 - 1.5e-3, atol=2e-4)
    assert np.array_equal(np.unique(np.abs(target.x[target.mesh.parts["pad"]][:, 1]) > 0.3), [False])


@pytest.mark.parametrize("first", ["left", "right"])
@pytest.mark.parametrize("pull", [1.0, -1.0])
def test_a_rivet_of_sheets_in_one_plane_breaks_either_way_whichever_is_named_first(first, pull):
    """No sheet lies in front there: a pull along the rivet counts by its size."""
    parts = halves(4, 4)
    second = "right" if first == "left" else "left"
    row = Row(np.array([[0.0, 0.0, 0.0]]), (first, second))
    target = target_of(parts, LinkData(rivets=(("seam", row, RIVET),)))
    moved = np.zeros(len(parts.nodes), np.bool_)
    moved[np.unique(parts.quads[parts.part == 1])] = True
    target.v[moved, 2] = pull * 1.05 * RIVET.tension / RIVET.along / 1e-4
    target.x[:] += 1e-4 * target.v
    target.update_forces(1e-4)
    assert rivets_in(target).broken[0] == 1


METAL_OF = {"thickness": "2 mm", "material": "aluminium"}
ROW = {"parts": '["skin", "stiffeners"]', "pitch": "25 mm", "tension_strength": "3 kN", "shear_strength": "3 kN"}
ROW |= {"start": '["70 mm", "-100 mm", "-15 mm"]', "end": '["70 mm", "100 mm", "-15 mm"]'}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"target.generator.foot": "20 mm"}, "foot makes a riveted stiffener, and a blade has none"),
        ({"target.generator.section": "Z", "target.generator.flange": "20 mm"}, 'section = "Z" is riveted to the skin'),
        ({k: v for k, v in PANEL.items() if not k.endswith("lap")}, "lap is missing: foot needs it"),
        (
            {k: v for k, v in PANEL.items() if "rivets" not in k},
            "has no rivets.stiffeners: give it a tension_strength and a shear_strength",
        ),
        (
            PANEL | {"target.generator.overlap": "30 mm", "target.generator.joint": "110 mm"},
            "reaches a stiffener at 100 .. 120 mm",
        ),
        (
            {"target.generator.element_size": "0.5 mm"},
            "makes 1,000,000 shells of target.generator.length = 500 mm and width = 500 mm, beyond 250,000; 1 mm or",
        ),
        (
            PANEL | {"target.generator.overlap": "30 mm", "target.generator.joint": "240 mm"},
            "overlap = 30 mm lies at 225 .. 255 mm along the length, beyond the panel's end at 250 mm; make it smaller",
        ),
        (
            PANEL | {"target.generator.pad": '["50 mm", "600 mm"]'},
            "lies at -300 .. 300 mm along the width, beyond the panel's end at 250 mm; make it smaller, or move it by",
        ),
        (
            {"target.ties.web.nodes": "nowhere", "target.ties.web.onto": "skin", "target.ties.web.distance": "1 mm"},
            "does not exist",
        ),
        (
            {f"target.rivets.mine.{key}": value for key, value in (ROW | {"parts": '["skin", "skin"]'}).items()},
            "target.rivets.mine has parts with skin twice, a part joined to itself; name two parts",
        ),
    ],
)
def test_bad_joints_are_named(changes, message):
    with pytest.raises(CaseError) as error:
        load_case("openradioss_panel", changes)
    assert any(message in line for line in error.value.errors), error.value.errors


@pytest.mark.parametrize(
    ("x", "said"),
    [(0.011, "1 mm beyond the edge of front"), (-0.02, "10 mm beyond the edge of back"), (0.01, ""), (-0.01, "")],
)
def test_a_rivet_beyond_the_edge_of_a_part_is_refused(x, said):
    """Its axis was slanted from one edge to the other part, by which tension and shear changed places."""
    row = Row(np.array([[x, 0.0, -1e-3]]), ("front", "back"))
    parts = parts_of(
        {
            "front": level((-0.05, 0.01), (-0.01, 0.01), (6, 2)),
            "back": level((-0.01, 0.05), (-0.01, 0.01), (6, 2), -2e-3),
        }
    )
    links = LinkData({}, (("row", row, RIVET),))
    if said:
        with pytest.raises(UserError, match=rf"target\.rivets\.row: rivet 1 .* lies {said}, which it joins; place it"):
            target_of(parts, links)
        return
    assert rivets_in(target_of(parts, links)).along[0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)


def test_rivets_through_air_are_told():
    """Between sheets that do not lie on each other, as where a row was placed for another part."""
    changes = {f"target.rivets.mine.{key}": value for key, value in ROW.items()}
    l_section = {
        "target.generator.section": "L",
        "target.generator.flange": "30 mm",
        "target.generator.height": "30 mm",
    }
    l_section["target.generator.pitch"] = "100 mm"
    (said,) = long_rivets(load_case("openradioss_panel", changes | l_section))
    assert "target.rivets.mine joins skin and stiffeners where their mid-surfaces are up to 30 mm apart" in said
    assert long_rivets(load_case("sidewall_004", {"target.generator.element_size": "40 mm"})) == []


def test_nodes_that_a_tie_leaves_free_are_told():
    """They were free without a word, as where the distance is a sheet too small for some of the set."""
    tie = {
        "target.ties.web.nodes": "stiffener_ends",
        "target.ties.web.onto": "skin",
        "target.ties.web.distance": "15 mm",
    }
    (said,) = loose_ties(load_case("openradioss_panel", tie))
    assert "target.ties.web leaves 12 of 16 nodes of stiffener_ends free, as they lie 20 to 40 mm from skin" in said
    assert loose_ties(load_case("openradioss_panel", tie | {"target.ties.web.distance": "45 mm"})) == []
    assert loose_ties(load_case("openradioss_panel")) == []


def test_effects_on_rivets_are_refused_where_there_are_none():
    with pytest.raises(CaseError, match="rivet_strength"):
        load_case("openradioss_panel", {"effects.rivet_strength": "-0.2"})
