"""What `check` says of a mesh from a file that can be used: doubtful shells by part, number, value and remedy."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.cli.check import check
from birdstrike.data.errors import CaseError, UserError
from birdstrike.reports.figures.target import MARK
from birdstrike.solver.case.case import load_case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.setup_warnings import aimed_off, doubtful_shells, edge_on, free_target
from birdstrike.solver.simulate import simulate
from tests.solver.target.test_mesh_file import MESH, PART, table_with, written
from tests.solver.target.triangles import abaqus_file

SKIN = MESH.part == 0


def panel(path: Path, nodes: np.ndarray = MESH.nodes, skin: np.ndarray = MESH.quads[SKIN], **sets: Any) -> Path:
    """The coarse panel, the skin's shells numbered from 1001 and the stiffeners' from 9001."""
    blocks = [("S4R", "skin", 1001, skin), ("S4R", "stiffeners", 9001, MESH.quads[~SKIN])]
    return abaqus_file(path / "panel.inp", nodes, blocks, {"edges": MESH.sets["edges"], **sets})


def findings(path: Path, **target: Any) -> list[str]:
    return doubtful_shells(load_case(table_with(path, **target)))


def test_a_sound_mesh_has_nothing_against_it(tmp_path):
    assert load_case(table_with(panel(tmp_path))).target.findings() == []  # pyright: ignore[reportOptionalMemberAccess]


def test_a_warped_shell_is_named_with_its_number_and_value(tmp_path):
    nodes = MESH.nodes.copy()
    nodes[MESH.quads[55, 0], 2] += 0.022
    (said,) = findings(panel(tmp_path, nodes))
    assert "of skin are warped by more than 10 degrees: their bending is that of a flat shell; refine the mesh" in said
    assert "(number 1045" in said
    assert re.search(r"\(worst: 1[0-9.]+ degrees, number 10\d\d of skin\)", said)


def test_few_slender_shells_are_named_with_what_they_cost(tmp_path):
    """A column of the skin 4 mm wide beside others of 50: too slender, and ruling the step."""
    x = MESH.nodes[:, 0]
    nodes = MESH.nodes.copy()
    nodes[np.abs(x + 0.2) < 1e-9, 0] = -0.2462
    slender, slow = findings(panel(tmp_path, nodes))
    assert "10 shells (number 1001, 1002, 1003, 1004, 1005, ...) of skin are more than 10 times as long as" in slender
    assert "stresses along them are coarse, and they rule the time step; mesh them anew (worst: 13.2 times" in slender
    assert "have a stable time step far below the others'" in slow
    assert "they cost 10.5 times as many steps; merge or enlarge them (worst: " in slow
    assert slow.endswith("of skin)")


def test_nodes_that_are_not_merged_are_named(tmp_path):
    """A slit in the skin: the nodes of one side are there twice."""
    skin = MESH.quads[SKIN].copy()
    middles = MESH.nodes[skin].mean(axis=1)
    slit = np.flatnonzero((np.abs(MESH.nodes[:, 0]) < 1e-9) & (np.abs(MESH.nodes[:, 1]) < 0.11))
    twin = dict(zip(slit.tolist(), range(len(MESH.nodes), len(MESH.nodes) + len(slit)), strict=True))
    for shell in np.flatnonzero(middles[:, 0] > 0.0):
        skin[shell] = [twin.get(int(node), int(node)) for node in skin[shell]]
    (said,) = findings(panel(tmp_path, np.vstack([MESH.nodes, MESH.nodes[slit]]), skin))
    assert f"{len(slit)} pairs of nodes lie at one place and are not merged, first at (" in said
    assert "the shells there are not joined, unless by target.ties or target.rivets; merge the nodes" in said


def test_shells_wound_against_their_neighbours_are_a_remark_and_no_warning(tmp_path):
    skin = MESH.quads[SKIN].copy()
    skin[12] = skin[12, ::-1]
    path = panel(tmp_path, skin=skin)
    assert findings(path) == []
    found = check(table_with(path))["mesh"]
    assert [one["severity"] for one in found] == ["remark"]
    assert "share an edge with one of the same part that is wound the other way" in found[0]["text"]


def test_nodes_of_a_set_that_are_on_no_shell_are_counted(tmp_path):
    nodes = np.vstack([MESH.nodes, [[9.0, 9.0, 9.0]]])
    (said,) = findings(panel(tmp_path, nodes, bolts=np.array([0, 1, len(MESH.nodes)])))
    assert "the set bolts has 1 nodes that are on no shell: they are left out, 2 remain" in said


def toml_case(folder: Path) -> Path:
    """A case file beside the mesh."""
    path = folder / "case.toml"
    path.write_text(tomli_w.dumps(table_with(folder / "panel.inp")))
    return path


@pytest.mark.parametrize("height", [0.022, 0.06])
def test_the_picture_marks_doubtful_shells_and_those_that_refuse_the_mesh(tmp_path, height):
    nodes = MESH.nodes.copy()
    nodes[MESH.quads[33, 0], 2] -= height
    panel(tmp_path, nodes)
    case, picture = toml_case(tmp_path), tmp_path / "target.svg"
    result = CliRunner().invoke(app, ["check", str(case), "--picture", str(picture)])
    assert (result.exit_code == 0) == (height < 0.03), result.output
    assert MARK.lower() in picture.read_text().lower()
    assert "warped by more than" in " ".join(result.output.split())


def test_a_part_without_thickness_is_named(tmp_path):
    table = table_with(panel(tmp_path))
    del table["target"]["parts"]["stiffeners"]["thickness"]
    with pytest.raises(CaseError, match=r"target\.parts\.stiffeners\.thickness is missing; give a value in"):
        load_case(table)


def test_a_bird_that_starts_inside_the_target_is_told_with_the_part(tmp_path):
    path = panel(tmp_path, MESH.nodes + np.array([0.0, 0.0, 0.03]))
    with pytest.raises(
        UserError, match=r"the bird starts inside the target's part skin: .* raise impact\.standoff.* comes from \+z"
    ):
        simulate(load_case(table_with(path), {"bird.particles": "200"}))


def test_a_bird_begins_outside_a_thicker_part_beside_the_one_that_it_strikes(tmp_path):
    """The stand-off counts to the struck part, a stand-off of nothing too."""
    skin = MESH.quads[SKIN]
    thin = np.abs(MESH.nodes[skin, 0].mean(axis=1)) < 0.03
    zones = [
        ("S4R", "thin", 1001, skin[thin]),
        ("S4R", "thick", 3001, skin[~thin]),
        ("S4R", "rib", 9001, MESH.quads[~SKIN]),
    ]
    path = abaqus_file(tmp_path / "zones.inp", MESH.nodes, zones, {"edges": MESH.sets["edges"]})
    parts = {
        name: {"thickness": t, "material": "aluminium"}
        for name, t in (("thin", "2 mm"), ("thick", "6 mm"), ("rib", "2 mm"))
    }
    case = load_case(table_with(path, parts=parts, struck="thin"), {"bird.particles": "200", "impact.standoff": "0 mm"})
    run = Coupling(case)
    assert run.begin < 0.0
    assert run.bird.x[: run.bird.n, 2].min() == pytest.approx(3e-3 + run.bird.skin, abs=1e-9)


def test_a_struck_part_away_from_the_aim_is_told_with_the_origin_that_meets_it(tmp_path):
    path = panel(tmp_path, MESH.nodes + np.array([0.0, 0.0, -0.06]))
    (said,) = aimed_off(load_case(table_with(path)))
    assert "lies 60 mm away from the point that the bird is aimed at" in said
    assert "set target.origin to a point of the part, nearest (0 mm, 0 mm, -60 mm)" in said
    assert aimed_off(load_case(table_with(path, origin=["0 mm", "0 mm", "-60 mm"]))) == []


@pytest.mark.parametrize("command", [check, simulate])
def test_sensors_off_a_target_that_lies_off_its_origin_are_told_with_this_cause_first(tmp_path, command):
    path = written(tmp_path / "panel.inp", MESH.nodes - [0.0, 0.0, 0.06])
    with pytest.raises(UserError) as caught:
        command(load_case(table_with(path)))
    cause, *sensors = caught.value.errors
    assert "lies 60 mm away from the point that the bird is aimed at" in cause
    assert "nearest (0 mm, 0 mm, -60 mm) in the file's axes" in cause
    assert len(sensors) == 4
    assert all("off the target's shells" in text for text in sensors)


def rib(path: Path) -> dict[str, Any]:
    """A case with a rib of 200 x 60 x 3 mm that stands upright, its foot held, struck on its upper edge."""
    lines = [f"{7 * j + k + 1}, 0., {20 * j - 100}, {-10 * k}" for j in range(11) for k in range(7)]
    shells = [(7 * j + k + 1, 7 * j + k + 8, 7 * j + k + 9, 7 * j + k + 2) for j in range(10) for k in range(6)]
    numbered = [f"{i + 1}, {', '.join(map(str, quad))}" for i, quad in enumerate(shells)]
    foot = [str(7 * j + 7) for j in range(11)]
    path.write_text("\n".join(["*NODE", *lines, "*ELEMENT, TYPE=S4, ELSET=rib", *numbered, "*NSET, NSET=foot", *foot]))
    table = table_with(path, mesh_unit="mm", parts={"rib": PART}, supports={"foot": "clamped"})
    table["bird"]["particles"], table["time"]["end"] = 300, "0.3 ms"
    sideways = {"kind": "displacement", "point": ["0 mm"] * 3, "along": [1.0, 0.0, 0.0]}
    table["sensors"] = {"u": sideways, "force": {"kind": "contact_force"}}
    return table


def test_a_rib_is_struck_on_its_edge_and_its_force_told_to_hang_on_the_particles(tmp_path, recwarn):
    """A target without an extent of its own in plan: it was refused for a plate.length that no case has."""
    table = rib(tmp_path / "rib.inp")
    (said,) = edge_on(load_case(table))
    assert "meets rib on an edge: particles 12.1 mm apart feel an edge of 3 mm as one of 15.1 mm" in said
    assert edge_on(load_case(table | {"bird": table["bird"] | {"particles": 100000}})) == []
    assert edge_on(load_case(table_with(panel(tmp_path), struck="stiffeners"))) == [], "the skin lies over them"
    run = simulate(load_case(table))
    assert max(run.channels["force"]) > 1e3
    assert np.abs(run.channels["u"]).max() < 1e-9, "the strike is symmetric"
    assert run.summary["momentum_error"] < 1e-10
    assert not any("too coarse" in text for text in run.summary["warnings"])
    assert not [one for one in recwarn if one.category is RuntimeWarning]


def test_a_free_rigid_body_is_told_whole_or_in_part(tmp_path):
    """Nothing held at all, a warning; a part that hangs on nothing while others are held, an error."""
    path = panel(tmp_path)
    (said,) = free_target(load_case(table_with(path, supports={})))
    assert "target.supports holds nothing: the whole target is a free rigid body" in said
    assert "(sets: free_edges, edges)" in said
    assert free_target(load_case(table_with(path))) == []
