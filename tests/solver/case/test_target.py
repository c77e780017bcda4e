"""A case's target of several parts: its mesh, its hash, its dotted keys, its errors, and effects on the part struck."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.build import build_plate, rest_mesh
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.case.load import read_case
from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.case.target import Target
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.modes import edge_stiffness

PANEL = load_case("openradioss_panel")
ANGLE = {"section": "L", "flange": "25 mm"}


def target_of(case: Case) -> Target:
    assert case.target is not None
    return case.target


def plain_skin(supports: dict[str, Any]) -> Case:
    """The panel's skin without stiffeners, held so."""
    raw = read_case("openradioss_panel")
    target = raw["target"] | {"generator": raw["target"]["generator"] | {"stiffeners": 0}, "supports": supports}
    target["parts"] = {"skin": target["parts"]["skin"]}
    return load_case({key: value for key, value in raw.items() if key != "sensors"} | {"target": target})


def panel_mesh(**changes: str):
    table = {"kind": "stiffened_panel", "length": "500 mm", "width": "400 mm", "element_size": "20 mm"}
    table |= {"stiffeners": 3, "pitch": "130 mm", "height": "40 mm"}
    return GENERATORS.validate(table | changes).mesh()


@pytest.mark.parametrize("section", [{}, ANGLE], ids=["blade", "angle"])
def test_a_panel_has_its_dimensions_and_its_joints_share_nodes(section):
    mesh = panel_mesh(**section)
    corners = mesh.nodes[mesh.quads]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    each = [float(area[mesh.part == number].sum()) for number in range(2)]
    assert each[0] == pytest.approx(0.5 * 0.4)
    assert each[1] == pytest.approx(3 * 0.4 * (0.04 + (0.025 if section else 0.0)))
    shared = np.intersect1d(mesh.quads[mesh.part == 0], mesh.quads[mesh.part == 1])
    assert len(shared) == 3 * 21, "every node of a web's foot is the skin's"
    assert np.unique(np.round(mesh.nodes, 9), axis=0).shape == mesh.nodes.shape
    sides = np.sqrt(area)
    assert sides.min() > 0.010
    assert sides.max() < 0.030


def test_sets_hold_the_nodes_that_they_name():
    mesh = panel_mesh()
    x, y, z = mesh.nodes[mesh.sets["edges"]].T
    assert ((np.abs(x) > 0.2499) | (np.abs(y) > 0.1999)).all()
    assert (z < -1e-6).sum() == 2 * 3 * 2, "the webs' ends below the skin"
    assert len(np.union1d(mesh.sets["skin_edges"], mesh.sets["stiffener_ends"])) == len(mesh.sets["edges"])


@pytest.mark.parametrize("order", [1, -1])
def test_an_edges_effect_acts_in_series_on_every_support_that_holds_and_on_no_other(order):
    held: dict[str, Any] = {"width_low": "clamped", "width_high": "pinned", "length_low": "free"}
    held["length_high"] = {"rotational": "100 kN*m/rad/m"}
    named = dict(list(held.items())[::order])
    case = plain_skin(named)
    softer: dict[str, Any] = target_of(case.with_effects({"clamp_rotation": 1e-5})).supports
    assert (softer["width_high"], softer["length_low"]) == ("pinned", "free")
    assert softer["width_low"].rotational == pytest.approx(1e5)
    assert softer["length_high"].rotational == pytest.approx(0.5e5)
    slips: dict[str, Any] = target_of(case.with_effects({"edge_slip": 1e-9})).supports
    assert slips["length_low"] == "free"
    assert all(slips[name].in_plane == pytest.approx(1e9) for name in held if name != "length_low")
    assert slips["width_high"].rotational == 0.0
    with pytest.raises(CaseError, match="do not hold it at all"):
        plain_skin({"edges": "pinned"}).with_effects({"clamp_rotation": 1e-5})


def test_springs_of_four_sides_are_those_of_the_whole_rim_and_a_free_set_adds_none():
    springs = {"in_plane": "100 N/mm^2", "transverse": "100 N/mm^2", "rotational": "1 kN*m/rad/m"}
    sides = ("length_low", "length_high", "width_low", "width_high")

    def length(**held: object) -> float:
        return float(build_plate(plain_skin(held)).supports.springs[:, 0].sum()) / 100e6

    assert length(skin_edges=springs) == pytest.approx(2.0)
    assert length(**dict.fromkeys(sides, springs)) == pytest.approx(2.0)
    ends = dict.fromkeys(sides[:2], springs)
    assert length(**ends) == pytest.approx(1.0)
    assert length(**ends, **dict.fromkeys(sides[2:], "free")) == pytest.approx(1.0)


def test_load_cells_share_the_rim_of_a_flat_plate_alike():
    """Every node of the rim is in one cell; springs of all cells are those of the whole rim, an eighth each."""
    case = load_case("flat_plate_002", {"target.generator.element_size": "25 mm"})
    mesh, supports = target_of(case).source.mesh(), build_plate(case).supports
    cells = [mesh.sets[f"cell_{i}"] for i in range(1, 9)]
    assert np.array_equal(np.sort(np.concatenate(cells)), mesh.sets["edges"])
    middles = np.array([mesh.nodes[cell][:, :2].mean(axis=0) for cell in cells])
    assert middles[0] == pytest.approx([0.3, 0.0], abs=0.013)
    assert middles[2] == pytest.approx([0.0, 0.3], abs=0.013)
    assert middles[5] == pytest.approx([-0.25, -0.25], abs=0.03)
    each = [supports.springs[supports.sets[f"cell_{i}"], 1].sum() for i in range(1, 9)]
    assert each == pytest.approx([2000e6 * 0.3] * 8)


def test_the_target_is_built_as_the_case_says():
    plate = build_plate(PANEL.overlaid({"target": {"generator": {"element_size": "25 mm"}}}))
    volume = 0.003 * (0.5 * 0.5 + 2 * 0.5 * 0.04)
    assert plate.mass.sum() == pytest.approx(2780.0 * volume, rel=1e-9)
    assert np.count_nonzero(plate.fixed) == 2 * 4 * 20 // 2 + 2 * 2 * 2
    assert not plate.one_sided
    assert np.isfinite(plate.nodes.axes).all()


def test_a_target_s_keys_can_be_sought_and_change_its_hash():
    key = "target.parts.skin.thickness"
    mark = quantity_at(key)
    assert mark is not None
    assert mark.unit == "m"
    assert quantity_at("target.materials.aluminium.a") is not None
    assert quantity_at("target.parts.skin.material") is None
    thicker = PANEL.with_values({key: 0.0031})
    assert target_of(thicker).parts["skin"].thickness == pytest.approx(0.0031)
    assert case_hash(thicker) != case_hash(PANEL)
    assert case_hash(PANEL.with_values({key: 0.003})) == case_hash(PANEL)


def test_another_mesh_keeps_the_panel():
    finer = PANEL.with_mesh(500, (100, 100))
    assert target_of(finer).source.element_size == pytest.approx(0.005)
    assert finer.bird.particles == 500
    assert len(rest_mesh(PANEL).quads) == 2900


def test_effects_on_the_plate_act_on_the_part_that_is_struck():
    acted = PANEL.with_effects({"plate_thickness": 1e-4, "plate_yield": 1e7, "plate_density": 20.0})
    target = target_of(acted.resolved())
    assert target.parts["skin"].thickness == pytest.approx(0.0031)
    assert target.parts["stiffeners"].thickness == pytest.approx(0.003)
    assert target.materials["aluminium"].density == pytest.approx(2800.0)
    assert getattr(target.materials["aluminium"], "a") == pytest.approx(360e6)  # noqa: B009


@pytest.mark.parametrize(
    ("effect", "said"),
    [("plate_hardening", "no tangent_modulus"), ("plate_preload", "takes no preload")],
)
def test_an_effect_that_the_target_cannot_carry_is_refused_by_name(effect, said):
    with pytest.raises(CaseError, match=rf"effects\.{effect}.*{said}"):
        PANEL.with_effects({effect: 1e6}).resolved()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"target.parts.skin.material": "steel"}, 'parts.skin.material = "steel", unknown; materials: aluminium'),
        ({"target.supports.rim": "clamped"}, "supports.rim, a set of nodes that does not exist; sets: edges"),
        ({"target.parts.rib.thickness": "2 mm", "target.parts.rib.material": "aluminium"}, "parts.rib, which the mesh"),
        ({"target.materials.aluminium.law": "granite"}, "granite is unknown; available: bilinear, power"),
        ({"target.generator.pitch": "600 mm"}, "puts 2 stiffeners beyond"),
        ({"target.generator.flange": "20 mm"}, 'flange is the inner flange of section = "L"'),
        ({"target.parts.skin.thickness": "3 m"}, "outside 0.1 mm .. 50 mm; millimetres"),
        ({"plate.length": "500 mm"}, "plate and target are both given"),
        ({"target.materials.aluminium.b": 426}, "has no unit"),
    ],
)
def test_a_wrong_target_is_told_by_name(changes, said):
    with pytest.raises(CaseError) as caught:
        load_case("openradioss_panel", changes)
    assert said in str(caught.value)


SPAN = ["1 mm", "2 mm"]


def sought(key: str, limits: list[str]) -> dict[str, object]:
    """A case of one sought parameter."""
    return {"extends": "openradioss_panel", "inversion": {"parameters": {key: {"range": limits}}}}


def test_dimensions_of_a_generated_mesh_can_be_sought():
    """They were "no quantity of a case", against the page on targets."""
    case = load_case(sought("target.generator.pitch", ["150 mm", "250 mm"]))
    assert [(one.name, one.low, one.high) for one in case.parameters()] == [("target.generator.pitch", 0.15, 0.25)]
    generator = target_of(case.with_values({"target.generator.pitch": 0.18})).generator
    assert generator is not None
    assert getattr(generator, "pitch") == pytest.approx(0.18)  # noqa: B009


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("target.parts.sikn.thickness", "is of sikn, which is not in target.parts: skin, stiffeners; correct the key"),
        ("target.ties.web.distance", "is of web, which is not in target.ties: none; correct the key, or leave it out"),
        ("plate.thickness", "is of a plate, and the case has a target; correct the key, or leave it out"),
    ],
)
def test_a_sought_key_of_what_the_case_has_not_is_refused_at_once(key, said):
    """`check` passed it, and the campaign refused its runs."""
    with pytest.raises(CaseError) as caught:
        load_case(sought(key, SPAN))
    assert f'inversion.parameters."{key}" {said}' in str(caught.value)


def test_springs_are_shared_out_over_the_edges_of_skin_and_webs():
    changes = {"target.supports.edges": {"in_plane": "100 N/mm^2"}, "target.generator.element_size": "50 mm"}
    supports = build_plate(load_case("openradioss_panel", changes)).supports
    edge = 4 * 0.5 + 2 * 2 * 0.04
    assert supports.springs[:, 0].sum() == pytest.approx(100e6 * edge)
    assert not supports.springs[:, 1:].any(), "what is not stated is rigid"


def test_where_a_web_meets_the_skin_each_is_held_along_and_across_its_own_surface():
    """The stiffness is the sum of both: along a mean normal it hung on how the shells are wound (force 16 %)."""
    springs = {"in_plane": "100 N/mm^2", "transverse": "20 N/mm^2", "rotational": "1 kN*m/rad/m"}
    changes = {"target.supports.edges": springs, "target.generator.element_size": "50 mm"}
    plate = build_plate(load_case("openradioss_panel", changes))
    joint = int(np.argmin(np.linalg.norm(plate.x - [0.1, 0.25, 0.0], axis=1)))
    block = edge_stiffness(plate).toarray()[6 * joint : 6 * joint + 3, 6 * joint : 6 * joint + 3]
    skin, web = 0.05, 0.5 * 0.04
    expected = [100e6 * skin + 20e6 * web, 100e6 * (skin + web), 20e6 * skin + 100e6 * web]
    assert block == pytest.approx(np.diag(expected), abs=1e-9 * max(expected))


def test_a_frame_that_lets_edges_slip_holds_skin_and_web_across_themselves_where_they_meet():
    changes = {"target.supports.edges": {"in_plane": "100 N/mm^2"}, "target.generator.element_size": "50 mm"}
    plate = build_plate(load_case("openradioss_panel", changes))
    joint = int(np.argmin(np.linalg.norm(plate.x - [0.1, 0.25, 0.0], axis=1)))
    held = [axis for bit, axis in enumerate(plate.supports.axes[joint]) if plate.supports.held[joint] >> bit & 1]
    assert sorted(np.argmax(np.abs(held), axis=1)) == [0, 2], "across the web and across the skin, free along the edge"
    assert np.abs(held).max(axis=1) == pytest.approx([1.0, 1.0])


def test_a_part_without_a_thickness_is_told():
    table = PANEL.table
    del table["target"]["parts"]["stiffeners"]
    with pytest.raises(CaseError, match=r"has no parts\.stiffeners: give it a thickness and a material"):
        load_case(table)


def test_a_misspelt_part_is_told_with_the_nearest():
    with pytest.raises(CaseError) as caught:
        load_case("openradioss_panel", {"target.parts.skinn.thickness": "2 mm"})
    told = "target has parts.skinn, which the mesh has not; did you mean skin? Its parts: skin, stiffeners"
    assert caught.value.errors == [told]


def test_all_wrong_references_of_a_target_are_told_at_once():
    table = PANEL.table
    table["target"]["parts"]["skin"]["material"] = "alu"
    table["target"]["supports"]["edgs"] = "clamped"
    row = {"parts": ["skn", "skin"], "start": ["0 mm"] * 3, "end": ["10 mm", "0 mm", "0 mm"], "pitch": "5 mm"}
    table["target"]["rivets"] = {"row": row | {"tension_strength": "5 kN", "shear_strength": "5 kN"}}
    table["sensors"] = {"w": {"kind": "displacement", "point": ["0 mm"] * 3, "part": "sken"}}
    table["sensors"]["r"] = {"kind": "reaction_force", "support": "nix"}
    with pytest.raises(CaseError) as caught:
        load_case(table)
    wrong = ("skin.material", "supports.edgs", 'parts with "skn"', "sensors.w.part", "sensors.r.support")
    assert len(caught.value.errors) == len(wrong)
    assert all(what in line for what, line in zip(wrong, caught.value.errors, strict=True))


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b"])
def test_a_mesh_whose_name_no_file_can_have_is_the_user_s_error(name):
    table = PANEL.table
    del table["target"]["generator"]
    table["target"] |= {"mesh": name, "mesh_unit": "mm"}
    with pytest.raises(CaseError, match="cannot be read"):
        load_case(table)
