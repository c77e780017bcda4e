"""Meshes from files: the same target as from the generator, and faults that are told by name."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from birdstrike.data.errors import CaseError, UserError
from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.case.write import copy_case
from birdstrike.solver.setup_warnings import doubtful_shells
from birdstrike.solver.target.files.mesh_file import read_mesh
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.mesh import is_triangle
from birdstrike.solver.target.part_mesh import PartMesh
from tests.solver.target.triangles import abaqus_file, cut

PART = {"thickness": "3 mm", "material": "aluminium"}
PANEL = {"kind": "stiffened_panel", "length": "500 mm", "width": "500 mm", "element_size": "50 mm"}
PANEL |= {"stiffeners": 2, "pitch": "200 mm", "height": "40 mm"}
MESH: PartMesh = GENERATORS.validate(PANEL).mesh()
COARSE = {"target.generator.element_size": "50 mm"}


def written(path: Path, nodes: np.ndarray = MESH.nodes, quads: np.ndarray = MESH.quads, sets: bool = True) -> Path:
    """The panel in the format that the file's ending names, with names where the format has them."""
    part = MESH.part if len(quads) == len(MESH.part) else np.zeros(len(quads), np.int64)
    more: dict[str, Any] = {}
    if path.suffix == ".inp":
        more["cell_sets"] = {name: [np.flatnonzero(part == i)] for i, name in enumerate(MESH.parts)}
        more["point_sets"] = {"edges": MESH.sets["edges"]} if sets else {}
    elif path.suffix == ".msh":
        more["cell_data"] = {"gmsh:physical": [part + 1], "gmsh:geometrical": [part + 1]}
        more["field_data"] = {name: np.array([i + 1, 2]) for i, name in enumerate(MESH.parts)}
    else:
        more["cell_data"] = {"nastran:ref" if path.suffix == ".bdf" else "part": [part + 1]}
    kind = {"file_format": "gmsh22", "binary": False} if path.suffix == ".msh" else {}
    meshio.Mesh(nodes, [("quad", quads)], **more).write(path, **kind)
    return path


def table_with(path: Path, **target: Any) -> dict[str, Any]:
    """The shipped panel's case with the mesh of a file in place of the generator."""
    table = load_case("openradioss_panel").table
    del table["target"]["generator"]
    table["target"] |= {"mesh": str(path), "mesh_unit": "m", **target}
    for sensor in table["sensors"].values():
        sensor.pop("part", None)  # not every format has names
    return table


def test_the_target_of_a_file_is_that_of_the_generator_bit_for_bit(tmp_path):
    """Same nodes, shells, masses and holds: the solver is given the same numbers, so it gives the same histories."""
    ours = build_plate(load_case(table_with(written(tmp_path / "panel.inp"))))
    theirs = build_plate(load_case("openradioss_panel", COARSE))
    for name in ("x", "quads", "mass", "inertia", "skin"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name)), name
    assert np.array_equal(ours.nodes.held, theirs.nodes.held)
    assert np.array_equal(ours.shells.section, theirs.shells.section)


@pytest.mark.parametrize("ending", [".inp", ".msh", ".vtu"])
def test_formats_hold_the_same_mesh(tmp_path, ending):
    named = ("skin", "stiffeners") if ending != ".vtu" else ("part_1", "part_2")
    parts = {name: {"thickness": "3 mm", "material": "aluminium"} for name in named}
    table = table_with(written(tmp_path / f"panel{ending}"), parts=parts, supports={"free_edges": "clamped"})
    plate = build_plate(load_case(table))
    assert np.array_equal(plate.x, MESH.nodes)
    assert np.array_equal(plate.quads, MESH.quads)
    assert np.array_equal(plate.shells.section, MESH.part)


def test_the_hash_holds_the_mesh_s_content_and_not_its_name(tmp_path):
    one, same = written(tmp_path / "one.inp"), written(tmp_path / "same.inp")
    moved = MESH.nodes.copy()
    moved[40, 0] += 1e-4
    other = written(tmp_path / "other.inp", moved)
    first, second, third = (case_hash(load_case(table_with(path))) for path in (one, same, other))
    assert first == second
    assert first != third


def test_a_file_in_millimetres_is_the_same_panel(tmp_path):
    path = written(tmp_path / "panel.inp", 1e3 * MESH.nodes)
    plate = build_plate(load_case(table_with(path, mesh_unit="mm")))
    assert plate.x == pytest.approx(MESH.nodes, abs=1e-15)


def test_the_origin_moves_the_mesh_under_the_bird(tmp_path):
    path = written(tmp_path / "panel.inp", MESH.nodes + np.array([0.3, 0.0, 0.1]))
    plate = build_plate(load_case(table_with(path, origin=["300 mm", "0 mm", "100 mm"])))
    assert plate.x == pytest.approx(MESH.nodes, abs=1e-12)


def keyword_file(path: Path, nodes: np.ndarray, shells: np.ndarray) -> Path:
    """The panel as an LS-DYNA keyword file, node numbers from 101 on."""
    lines = ["*KEYWORD", "*NODE"]
    lines += [f"{101 + i:8d}" + "".join(f"{c:16.9e}" for c in node) for i, node in enumerate(nodes)]
    lines.append("*ELEMENT_SHELL")
    parts = np.concatenate([MESH.part, np.repeat(MESH.part[3], len(shells) - len(MESH.part))])
    for i, (part, corners) in enumerate(zip(parts, shells, strict=True)):
        lines.append(f"{i + 1:8d}{part + 7:8d}" + "".join(f"{101 + node:8d}" for node in corners))
    for i, name in enumerate(MESH.parts):
        lines += ["*PART", name, f"{i + 7:10d}{1:10d}{1:10d}"]
    edges = [101 + int(node) for node in MESH.sets["edges"]]
    lines += ["*SET_NODE_LIST_TITLE", "edges", f"{5:10d}"]
    lines += ["".join(f"{node:10d}" for node in edges[k : k + 8]) for k in range(0, len(edges), 8)]
    path.write_text("\n".join([*lines, "*END"]) + "\n")
    return path


def test_a_keyword_file_is_the_same_panel_with_its_names(tmp_path):
    path = keyword_file(tmp_path / "panel.k", MESH.nodes, MESH.quads)
    plate = build_plate(load_case(table_with(path)))
    assert plate.x == pytest.approx(MESH.nodes, abs=1e-9)
    assert np.array_equal(plate.quads, MESH.quads)
    assert np.array_equal(plate.shells.section, MESH.part)
    assert np.array_equal(np.flatnonzero(plate.fixed), np.sort(MESH.sets["edges"]))


@pytest.mark.parametrize("last", [2, None])
def test_a_keyword_file_s_triangles_are_read(tmp_path, last):
    """n4 equal to n3, or 0."""
    shells = np.concatenate([MESH.quads, MESH.quads[3:4, [0, 2, 3, 3]]])
    shells[3] = [*MESH.quads[3, :3], MESH.quads[3, 2]]
    path = keyword_file(tmp_path / "panel.k", MESH.nodes, shells)
    if last is None:
        path.write_text(path.read_text().replace(2 * f"{101 + shells[3, 2]:8d}", f"{101 + shells[3, 2]:8d}{0:8d}"))
    plate = build_plate(load_case(table_with(path)))
    assert [len(block.alive) for block in plate.blocks] == [len(MESH.quads) - 1, 2]
    assert plate.nodes.mass.sum() == pytest.approx(build_plate(load_case("openradioss_panel", COARSE)).mass.sum())
    assert set(plate.quads[-2:].ravel()) == set(MESH.quads[3])


def test_a_keyword_file_without_shells_is_told(tmp_path):
    path = tmp_path / "panel.k"
    path.write_text("*KEYWORD\n*NODE\n       1             0.0             0.0             0.0\n*END\n")
    with pytest.raises(CaseError) as error:
        load_case(table_with(path))
    assert any("holds no *ELEMENT_SHELL" in line for line in error.value.errors)


def wrong_quads(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and quadrilaterals with one fault each."""
    nodes, quads = MESH.nodes.copy(), MESH.quads.copy()
    if kind == "twice":
        quads = np.vstack([quads, quads[:1, ::-1]])
    elif kind == "point":
        quads[3, 1:] = quads[3, 2]
    elif kind == "needle":
        nodes = np.vstack([nodes, nodes[quads[0, :2]] + [0.0, -1e-3, 0.0]])
        quads = np.vstack([quads, [*quads[0, [1, 0]], len(nodes) - 2, len(nodes) - 1]])
    elif kind == "arrow":  # a node of its own, for the shell alone to turn inwards
        nodes = np.vstack([nodes, 0.3 * nodes[quads[45, 1]] + 0.7 * nodes[quads[45, 3]]])
        quads[45, 1] = len(nodes) - 1
    elif kind == "warped":
        nodes[quads[45, 0], 2] += 0.06
    elif kind == "loose":
        nodes = np.vstack([nodes, nodes[quads[0]] + [0.0, 0.0, 0.05]])
        quads = np.vstack([quads, [np.arange(len(nodes) - 4, len(nodes))]])
    return nodes, quads


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("twice", "1 shells (number 121) of skin lie on the nodes of another; delete them"),
        ("point", "1 shells (number 4) of skin have corners at one place or no area"),
        (
            "needle",
            "1 shells (number 121) of skin are more than 20 times as long as wide; mesh them anew (worst: 50 times",
        ),
        ("arrow", "1 shells (number 46) of skin have a corner of more than 180 degrees; move a node"),
        ("warped", "are warped by more than 20 degrees"),
        ("loose", "it falls into 2 pieces that share no node"),
    ],
)
def test_a_mesh_that_would_spoil_any_run_is_refused(tmp_path, kind, said):
    nodes, quads = wrong_quads(kind)
    parts = {"skin": {"thickness": "3 mm", "material": "aluminium"}}
    given = {} if kind in ("point", "arrow", "warped") else {"parts": parts}
    path = written(tmp_path / "wrong.inp", nodes, quads, sets=False)
    with pytest.raises(CaseError) as caught:
        load_case(table_with(path, supports={}, **given))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mesh_unit": "in"}, "would it be in m?"),
        ({"mesh_unit": "furlong"}, "unknown; available: m, cm, mm, in"),
        ({"mesh": "nowhere.inp"}, "cannot be read"),
        ({"parts": {"skin": PART, "rear rib": PART}}, 'has parts."rear rib", which the mesh has not'),
        ({"struck": "roof"}, 'struck = "roof", a part that the mesh has not; its parts: skin, stiffeners'),
        ({"supports": {"rim": "clamped"}}, "a set of nodes that does not exist; sets: free_edges, edges"),
    ],
)
def test_what_a_file_has_not_is_told_by_name(tmp_path, changes, said):
    path = written(tmp_path / "panel.inp")
    with pytest.raises(CaseError) as caught:
        load_case(table_with(path, **changes))
    assert said in str(caught.value)


def test_shells_on_nodes_that_are_not_there_are_told(tmp_path):
    quads = MESH.quads.copy()
    quads[3, 1] = len(MESH.nodes) + 7
    with pytest.raises(CaseError, match="1 of its shells name nodes that are not there, of 143; write the file anew"):
        load_case(table_with(written(tmp_path / "panel.vtu", quads=quads)))


def test_a_fault_of_the_reading_is_no_file_that_cannot_be_read(tmp_path, monkeypatch):
    """Its own words stay: they say what to look for."""

    def broken(_: Any) -> None:
        raise ValueError("arrays of unlike length")

    path = written(tmp_path / "panel.inp")
    monkeypatch.setattr("birdstrike.solver.target.files.mesh_file.findings_of", broken)
    with pytest.raises(ValueError, match="arrays of unlike length"):
        read_mesh(str(path), "m")
    with pytest.raises(UserError, match=r"is a folder; name the mesh file in it"):
        read_mesh(str(tmp_path), "m")
    with pytest.raises(UserError, match=r"cannot be read: No such file.*; correct the path"):
        read_mesh(str(tmp_path / "nowhere.inp"), "m")


def test_a_mesh_of_inches_called_metres_is_told(tmp_path):
    path = written(tmp_path / "panel.inp", MESH.nodes / 0.0254)
    with pytest.raises(CaseError, match=r"it is 19\.69 m across in target\.mesh_unit = m.*would it be in cm or in"):
        load_case(table_with(path))


def test_a_mesh_replaces_the_inherited_generator_and_a_generator_the_mesh(tmp_path):
    given = {"target.mesh": str(written(tmp_path / "panel.inp")), "target.mesh_unit": "m"}
    case, table = load_case("openradioss_panel", given), table_with(tmp_path / "panel.inp")
    assert case.table["target"] == table["target"]
    back = load_case(case.table, {f"target.generator.{key}": value for key, value in PANEL.items()})
    assert case_hash(back) == case_hash(load_case("openradioss_panel", COARSE))


def test_names_of_the_inherited_generator_go_where_the_case_says_its_own(tmp_path):
    sets: Any = {"all": [np.arange(len(MESH.quads))]}
    cells: Any = [("quad", MESH.quads)]
    meshio.Mesh(MESH.nodes, cells, cell_sets=sets).write(tmp_path / "one.inp")
    own: dict[str, Any] = {"mesh": str(tmp_path / "one.inp"), "mesh_unit": "m"}
    own |= {"parts": {"all": {"thickness": "3 mm", "material": "aluminium"}}, "supports": {"free_edges": "clamped"}}
    sensors = {"u": {"kind": "displacement", "at": ["0 mm", "0 mm"]}}
    table = load_case({"extends": "openradioss_panel", "target": own, "sensors": sensors}).table
    assert not any("part" in sensor for sensor in table["sensors"].values())
    assert set(table["target"]["parts"]) == {"all"}
    assert set(table["target"]["supports"]) == {"free_edges"}
    assert "generator" not in table["target"]


def test_a_generator_and_a_mesh_in_one_case_are_told_with_the_remedy(tmp_path):
    table = table_with(written(tmp_path / "panel.inp"))
    table["target"]["generator"] = PANEL
    with pytest.raises(CaseError, match=r"has two meshes, target\.generator and target\.mesh: leave one out"):
        load_case(table)


def test_a_unit_must_be_stated(tmp_path):
    table = table_with(written(tmp_path / "panel.inp"))
    del table["target"]["mesh_unit"]
    with pytest.raises(CaseError, match="has no mesh_unit: say in which unit"):
        load_case(table)


def test_elements_that_are_no_shells_of_first_order_are_told(tmp_path):
    path = tmp_path / "solid.vtu"
    meshio.Mesh(MESH.nodes, [("tetra", MESH.quads)]).write(path)
    with pytest.raises(CaseError, match="holds tetra; a target is of shells of first order: mesh it with quadrilat"):
        load_case(table_with(path))


@pytest.mark.parametrize("ending", [".inp", ".msh", ".vtu", ".bdf"])
def test_triangles_of_every_format_are_read(tmp_path, ending):
    """All of the skin cut into triangles: their mass is the skin's, quadrilaterals come first."""
    path, skin = tmp_path / f"panel{ending}", MESH.part == 0
    halves, webs = cut(MESH.quads[skin])[:, :3], MESH.quads[~skin]
    numbers = [np.repeat(i + 1, len(own)) for i, own in enumerate((halves, webs))]
    named = ("skin", "stiffeners")
    if ending == ".inp":
        abaqus_file(path, MESH.nodes, [("S3R", "skin", 1, halves), ("S4", "stiffeners", 900, webs)], {})
    else:
        key = {".msh": "gmsh:physical", ".bdf": "nastran:ref"}.get(ending, "part")
        more: dict[str, Any] = {"cell_data": {key: numbers}}
        if ending == ".msh":
            more["cell_data"]["gmsh:geometrical"] = numbers
            more["field_data"] = {"skin": np.array([1, 2]), "stiffeners": np.array([2, 2])}
        else:
            named = ("part_1", "part_2")
        kind = {"file_format": "gmsh22", "binary": False} if ending == ".msh" else {}
        meshio.Mesh(np.round(MESH.nodes, 6), [("triangle", halves), ("quad", webs)], **more).write(path, **kind)
    parts = {name: {"thickness": "3 mm", "material": "aluminium"} for name in named}
    plate = build_plate(load_case(table_with(path, parts=parts, supports={"free_edges": "clamped"})))
    assert [len(block.alive) for block in plate.blocks] == [len(webs), len(halves)]
    assert len(plate.mesh.parts[named[0]]) == len(halves)
    assert plate.mass.sum() == pytest.approx(build_plate(load_case("openradioss_panel", COARSE)).mass.sum(), rel=1e-6)


BLOCKS = [("S4", "skin", 1, MESH.quads[MESH.part == 0]), ("S4", "stiffeners", 900, MESH.quads[MESH.part == 1])]


@pytest.mark.parametrize("first", range(4))
def test_a_quadrilateral_whose_neighbouring_nodes_are_one_is_a_triangle(tmp_path, first):
    """Whichever they are: only the last two were taken, the others refused."""
    points = np.array([[0, 0, 0], [50, 0, 0], [50, 50, 0], [0, 50, 0], [100, 0, 0]], np.float64)
    collapsed = np.roll([1, 4, 2, 2], first)
    meshio.Mesh(points, [("quad", np.array([[0, 1, 2, 3], collapsed]))]).write(tmp_path / "m.vtk")
    quads = read_mesh(str(tmp_path / "m.vtk"), "mm").quads
    assert list(is_triangle(quads)) == [False, True]
    assert list(quads[1]) in ([1, 4, 2, 2], [4, 2, 1, 1], [2, 1, 4, 4]), "wound as the file has it"


def test_nodes_without_coordinates_are_told(tmp_path):
    points = np.array([[0, 0, 0], [50, 0, 0], [50, 50, np.nan], [0, 50, 0]], np.float64)
    meshio.Mesh(points, [("quad", np.array([[0, 1, 2, 3]]))]).write(tmp_path / "m.vtu")
    with pytest.raises(UserError, match="1 nodes of its shells have no finite coordinates"):
        read_mesh(str(tmp_path / "m.vtu"), "mm")


def test_a_quadrilateral_with_its_last_node_twice_is_a_triangle_wherever_it_stands(tmp_path):
    halves = cut(MESH.quads[:1])
    skin = np.concatenate([halves, MESH.quads[MESH.part == 0][1:]])
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, [("S4", "skin", 1, skin), BLOCKS[1]], MESH.sets)
    plate = build_plate(load_case(table_with(path)))
    assert [len(block.alive) for block in plate.blocks] == [len(MESH.quads) - 1, 2]
    mesh = read_mesh(str(path), "m")
    assert [mesh.number(-1), mesh.number(-2), mesh.number(0)] == [2, 1, 3]
    assert build_plate(load_case(table_with(path))).mass.sum() == pytest.approx(plate_of_generator().mass.sum())


def plate_of_generator() -> Any:
    return build_plate(load_case("openradioss_panel", COARSE))


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [("TYPE=S4", "type=s4"), ("*ELEMENT, TYPE=S4, ELSET=skin", "*Element,elset=skin , Type = s4r")],
)
def test_kinds_of_elements_may_be_written_small(tmp_path, ours, theirs):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    path.write_text(path.read_text().replace(ours, theirs))
    assert np.array_equal(build_plate(load_case(table_with(path))).quads, plate_of_generator().quads)


def test_a_generated_set_counts_by_one_where_it_says_nothing(tmp_path):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    path.write_text(path.read_text() + "*NSET, NSET=first, GENERATE\n1, 7\n")
    assert np.array_equal(read_mesh(str(path), "m").sets["first"], np.arange(7))


def test_a_set_across_the_parts_is_none_of_them(tmp_path):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    path.write_text(path.read_text() + "*ELSET, ELSET=ALL, GENERATE\n1, 1000, 1\n")
    assert read_mesh(str(path), "m").parts == ("skin", "stiffeners")


def test_shells_in_no_part_are_told_with_the_sets_that_overlap(tmp_path):
    cells: Any = [("quad", MESH.quads)]
    sets: Any = {"one": [np.arange(10)], "two": [np.arange(5, 20)]}
    meshio.Mesh(MESH.nodes, cells, cell_sets=sets).write(tmp_path / "panel.inp")
    with pytest.raises(UserError, match=r"shells are in no set of elements; its sets: one; .*two shares 5 with one"):
        read_mesh(str(tmp_path / "panel.inp"), "m")


def test_named_curves_of_gmsh_are_sets_of_nodes(tmp_path):
    ends = np.column_stack([MESH.sets["edges"][:-1], MESH.sets["edges"][1:]])
    numbers = [np.full(len(ends), 7), MESH.part + 1]
    meshio.Mesh(
        MESH.nodes,
        [("line", ends), ("quad", MESH.quads)],
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
        field_data={"rim": np.array([7, 1]), "skin": np.array([1, 2]), "stiffeners": np.array([2, 2])},
    ).write(tmp_path / "panel.msh", file_format="gmsh22", binary=False)
    table = table_with(tmp_path / "panel.msh", supports={"rim": "clamped"})
    assert np.array_equal(build_plate(load_case(table)).fixed, plate_of_generator().fixed)
    assert not doubtful_shells(load_case(table))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*ELEMENT, TYPE=B31, ELSET=beams\n5000, 1, 2\n", "1 beams, bars or springs left out"),
        ("*MASS, ELSET=lump\n1.5\n", "MASS left out: their stiffness, mass and joints are not in the model"),
        ("*INSTANCE, NAME=a, PART=b\n0, 0, 0.1\n*END INSTANCE\n", "INSTANCE is not read"),
    ],
)
def test_what_is_no_shell_and_changes_the_answer_is_told(tmp_path, more, said):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    assert not doubtful_shells(load_case(table_with(path)))
    path.write_text(path.read_text() + more)
    (found,) = doubtful_shells(load_case(table_with(path)))
    assert said in found


def test_an_instance_that_stays_in_place_is_nothing_to_tell(tmp_path):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    path.write_text(path.read_text() + "*INSTANCE, NAME=a, PART=b\n*END INSTANCE\n")
    assert not doubtful_shells(load_case(table_with(path)))


def test_the_reason_why_a_file_is_not_read_is_told_and_nothing_is_printed(tmp_path, capfd):
    path = abaqus_file(tmp_path / "panel.inp", MESH.nodes, BLOCKS, MESH.sets)
    path.write_text(path.read_text().replace("TYPE=S4", "TYPE=S99"))
    with pytest.raises(UserError, match=r"Element type not available: S99; .* S4 and S3"):
        read_mesh(str(path), "m")
    path.write_text(path.read_text().replace("TYPE=S99", "TYPE=S4") + "*NSET, NSET=lost\n99999\n")
    with pytest.raises(UserError, match="refers to 99999, which is not there"):
        read_mesh(str(path), "m")
    assert capfd.readouterr() == ("", "")


def test_a_copied_case_takes_its_mesh_along_and_what_that_includes(tmp_path: Path) -> None:
    home, copy = tmp_path / "home", tmp_path / "copy"
    (home / "parts").mkdir(parents=True)
    whole = written(home / "whole.inp").read_text()
    (home / "parts" / "panel.inp").write_text(whole)
    (home / "main.inp").write_text("*Heading\n panel\n*Include, input=parts/panel.inp\n")
    for name in ("whole.inp", "main.inp"):
        case = load_case(table_with(home / name))
        digest = case_hash(case)
        copy_case(case, copy)
        (tmp_path / "moved").mkdir(exist_ok=True)
        moved = shutil.copytree(copy, tmp_path / "moved" / name)
        shutil.move(home, tmp_path / "gone")
        assert case_hash(load_case(moved / "case.toml")) == digest
        shutil.move(tmp_path / "gone", home)
    files = {path.relative_to(copy / "mesh").as_posix() for path in (copy / "mesh").rglob("*.inp")}
    assert files == {"whole.inp", "main.inp", "parts/panel.inp"}
    copy_case(load_case(copy / "case.toml"), copy)
    assert (copy / "mesh" / "main.inp").read_text().startswith("*Heading")
