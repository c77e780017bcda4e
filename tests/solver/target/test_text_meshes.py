"""Meshes from Abaqus's, Nastran's and LS-DYNA's files, however they are written: all shells and sets, or an error."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from birdstrike.data.errors import CaseError, UserError
from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import load_case
from birdstrike.solver.setup_warnings import doubtful_shells, free_target, other_thicknesses
from birdstrike.solver.target.files.mesh_file import included_files, inspect_mesh, read_mesh
from birdstrike.solver.target.part_mesh import PartMesh
from tests.solver.target.test_mesh_file import table_with

NODES = [(50.0 * i, 50.0 * j, 0.0) for i in range(5) for j in range(2)]
"""Of a strip of four squares, mm; numbered from 1."""
QUADS = [(2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2) for i in range(4)]
NODE_LINES = [f"{i + 1}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(NODES)]
SHELL_LINES = [", ".join(str(n) for n in (i + 1, *quad)) for i, quad in enumerate(QUADS)]
INP = "\n".join(
    ["*NODE", *NODE_LINES, "*ELEMENT, TYPE=S4, ELSET=skin", *SHELL_LINES, "*NSET, NSET=a", "1, 2", "*NSET, NSET=b", "9"]
)
PART = {"thickness": "2 mm", "material": "aluminium"}


def read(path: Path, text: str) -> PartMesh:
    """The mesh of a text."""
    path.write_text(text + "\n")
    return read_mesh(str(path), "mm")


def warnings(path: Path, text: str) -> list[str]:
    """What is said of a text's mesh besides."""
    path.write_text(text + "\n")
    return [found.text for found in inspect_mesh(str(path), "mm", (0.0, 0.0, 0.0))[1]]


def nodes_of(mesh: PartMesh, name: str) -> list[int]:
    """Numbers of a set's nodes."""
    return [int(node) + 1 for node in mesh.sets[name]]


@pytest.mark.parametrize("before", ["4, 7", "5, 200.0, 0.0", "3, 100.0", "9"])
def test_a_comment_takes_nothing_from_a_block(tmp_path, before):
    text = INP.replace(f"\n{before}", f"\n** a comment\n{before}", 1).replace("1, 2\n", "1,\n** a comment\n2\n")
    mesh = read(tmp_path / "m.inp", text)
    assert len(mesh.quads) == 4
    assert nodes_of(mesh, "a") == [1, 2]


@pytest.mark.parametrize(
    ("more", "name", "nodes"),
    [
        ("*NSET, NSET=a\n3, 4\n*NSET, NSET=A\n5", "a", [1, 2, 3, 4, 5]),
        ("*NSET, NSET=both, UNSORTED\na, b\n7", "both", [1, 2, 7, 9]),
        ("*NSET, NSET=c, GEN\n1, 5, 2", "c", [1, 3, 5]),
        ("*NSET, NSET=c,\nGENERATE\n1, 5, 2", "c", [1, 3, 5]),
        ('*NSET, NSET="rim, left"\n3\n*NSET, NSET=c\n"rim, left", 4', "c", [3, 4]),
        ("*NSET, NSET=both\n7, a", "both", [1, 2, 7]),
        ("*NSET, NSET=a, GENERATE\n3, 7, 2\n9, 10", "a", [1, 2, 3, 5, 7, 9, 10]),
        ("*NSET, NSET=of, ELSET=end\n*ELSET, ELSET=more\nend\n*NSET, NSET=of, ELSET=more", "of", [7, 8, 9, 10]),
        ("*NSET, NSET=c\nStrip-1.b, Strip-1.3", "c", [3, 9]),
        ("*NODE, NSET=c\n3, 50., 0., 0.\n4, 50., 50., 0.", "c", [3, 4]),
        ("*NSET, NSET=twice\n3, 4, 3\n3", "twice", [3, 4]),
    ],
)
def test_sets_of_nodes_grow_and_may_name_others(tmp_path, more, name, nodes):
    text = INP.replace("*NSET, NSET=a", "*ELSET, ELSET=end\n4\n*NSET, NSET=a", 1)
    assert nodes_of(read(tmp_path / "m.inp", f"{text}\n{more}"), name) == nodes


def test_sets_of_elements_grow_and_may_name_others(tmp_path):
    bare = INP.replace(", ELSET=skin", "")
    sets = "*ELSET, ELSET=left\n1\n*ELSET, ELSET=left\n2\n*ELSET, ELSET=one\n3\n*ELSET, ELSET=right\none\n4"
    mesh = read(tmp_path / "m.inp", f"{bare}\n*ELSET, ELSET=right\n3\n{sets}")
    assert mesh.parts == ("right", "left")
    assert list(mesh.part) == [1, 1, 0, 0]


@pytest.mark.parametrize(
    "head",
    [
        "*Element, type=S4,\nELSET=skin",
        "*ELEMENT , Elset = skin, TYPE=S4R,",
        "*ELEMENT, TYPE=S4",
        "  *ELEMENT, TYPE=S4, ELSET=skin",
        '*ELEMENT, ELSET="skin", TYPE=S4',
    ],
)
def test_a_keyword_s_options_may_go_on_in_the_next_line(tmp_path, head):
    mesh = read(tmp_path / "m.inp", INP.replace("*ELEMENT, TYPE=S4, ELSET=skin", head))
    assert len(mesh.quads) == 4
    assert mesh.parts == (("skin",) if "skin" in head else ("part_1",))


def test_several_blocks_and_an_included_file_are_one_mesh(tmp_path):
    (tmp_path / "nodes.inc").write_text("*NODE\n" + "\n".join(NODE_LINES[6:]) + "\n")
    text = INP.replace("\n".join(NODE_LINES[6:]), "*INCLUDE, INPUT=nodes.inc").replace(
        "\n4, 50.0,", "\n*NODE\n4, 50.0,"
    )
    assert read(tmp_path / "m.inp", text).nodes == pytest.approx(1e-3 * np.array(NODES))


def test_data_that_stand_in_another_file_are_read(tmp_path):
    """INPUT of *NODE and *ELEMENT; an included file's own are looked for beside the first one too."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "all.inp").write_text("*NODE, INPUT=parts/nodes.inp\n*INCLUDE, INPUT=shells.inp\n")
    (tmp_path / "parts" / "nodes.inp").write_text("\n".join(NODE_LINES).replace("50.0", "5.D+1") + "\n")
    (tmp_path / "parts" / "shells.inp").write_text("\n".join(["*ELEMENT, TYPE=S4", *SHELL_LINES[:3]]) + "\n")
    (tmp_path / "last.inp").write_text(SHELL_LINES[3] + "\n")
    text = "\ufeff*INCLUDE, INPUT=parts/all.inp\n*ELEMENT, TYPE=S4, INPUT=last.inp"
    mesh = read(tmp_path / "m.inp", text)
    assert mesh.nodes == pytest.approx(1e-3 * np.array(NODES))
    assert np.array_equal(mesh.quads + 1, QUADS)
    assert list(included_files(tmp_path / "m.inp")) == [
        "last.inp", "parts/all.inp", "parts/nodes.inp", "parts/shells.inp"
    ]  # fmt: skip


def test_an_included_file_that_has_changed_is_read_anew(tmp_path):
    text = INP.replace("\n".join(NODE_LINES), "*INCLUDE, INPUT=nodes.inp")
    for height in (50.0, 60.0):
        (tmp_path / "nodes.inp").write_text("\n".join(NODE_LINES).replace(", 50.0, 0.0", f", {height}, 0.0") + "\n")
        if height == 50.0:
            (tmp_path / "m.inp").write_text(text + "\n")
        assert np.ptp(read_mesh(str(tmp_path / "m.inp"), "mm").nodes[:, 1]) == pytest.approx(1e-3 * height)
    assert read_mesh(str(tmp_path / "m.inp"), "mm") is read_mesh(str(tmp_path / "m.inp"), "mm")


def test_an_offset_of_shells_is_told(tmp_path):
    (said,) = warnings(tmp_path / "m.inp", f"{INP}\n*SHELL SECTION, ELSET=skin, OFFSET=SPOS\n2.")
    assert said.startswith("OFFSET of *SHELL SECTION is not read")
    assert warnings(tmp_path / "m.inp", f"{INP}\n*SHELL SECTION, ELSET=skin, OFFSET=0.0\n2.") == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (INP.replace(SHELL_LINES[3], "4, 7, 9"), "element 4 has 2 nodes, not 4; is its line"),
        (INP.replace(SHELL_LINES[1], "2, 3, 5"), "element 2 has 7 nodes, not 4"),
        (INP[: INP.index("50.0, 0.0\n9")], 'the line "8, 150.0," has 1 coordinates, those before have 3'),
        (INP + "\n*NODE\n1, 5., 0., 0.", "node 1 is given twice, at different places"),
        (INP + "\n*NSET, NSET=c\nrim", "*NSET c names rim, which is neither a number nor a set that stands before"),
        (INP + "\n*NSET, NSET=c\n99", "the set of nodes c refers to 99, which is not there"),
        (INP + "\n*ELGEN\n1, 2, 3, 4", "it makes elements by *ELGEN, which is not read"),
        (INP + "\n*INCLUDE, INPUT=lost.inp", "it includes lost.inp, which is not there; put it beside m.inp"),
        (INP + "\n*INSTANCE, PART=p\n*INSTANCE, PART=P\n1., 0., 0.", "2 *INSTANCE place the part P, which is not read"),
        (INP + "\n*INCLUDE, INPUT=m.inp", "it includes m.inp, and that at last itself"),
        (INP.replace("4, 7", "4, x"), '*ELEMENT: "x" in the line "4, x, 9, 10, 8" is no whole number'),
    ],
)
def test_an_abaqus_file_that_is_not_whole_is_refused(tmp_path, text, said):
    with pytest.raises(UserError, match=re.escape(f"{tmp_path / 'm.inp'}: ") + ".*" + re.escape(said)):
        read(tmp_path / "m.inp", text)


def strip_table(tmp_path: Path, more: str, **target: Any) -> dict[str, Any]:
    """The shipped panel's case with the strip as target."""
    path = tmp_path / "m.inp"
    path.write_text(f"{INP}\n{more}\n")
    return table_with(path, mesh_unit="mm", parts={"skin": PART}, **target)


LOST = "*NODE\n20, 0., 0., 9.\n*NSET, NSET=lost\n20"


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ({"supports": {"lost": "clamped"}}, "supports.lost, a set"),
        (
            {"supports": {}, "ties": {"t": {"nodes": "lost", "onto": "skin", "distance": "1 mm"}}},
            'ties.t.nodes = "lost"',
        ),
    ],
)
def test_a_set_that_holds_no_node_is_refused_where_it_is_named(tmp_path, target, said):
    with pytest.raises(CaseError) as caught:
        load_case(strip_table(tmp_path, LOST, **target))
    assert said in str(caught.value)
    assert "that holds no node of the shells; sets that hold nodes: free_edges, a, b" in str(caught.value)


def test_springs_without_stiffness_hold_nothing(tmp_path):
    springs = {"rotational": "0 kN*m/rad/m", "in_plane": "0 N/mm^2", "transverse": "0 N/mm^2"}
    assert free_target(load_case(strip_table(tmp_path, "", supports={"a": springs})))
    assert not free_target(load_case(strip_table(tmp_path, "", supports={"a": "pinned"})))


def test_point_elements_of_abaqus_are_told(tmp_path):
    table = strip_table(tmp_path, "*ELEMENT, TYPE=MASS, ELSET=lump\n90, 1", supports={"a": "clamped"})
    assert any("*ELEMENT, TYPE=MASS left out" in text for text in doubtful_shells(load_case(table)))


GRIDS = [f"GRID    {i + 1:8d}{'':8s}{x:8.2f}{y:8.2f}{z:8.2f}" for i, (x, y, z) in enumerate(NODES)]
CARDS = [f"CQUAD4  {i + 1:8d}{1 + i // 2:8d}" + "".join(f"{n:8d}" for n in quad) for i, quad in enumerate(QUADS)]
LARGE = [
    f"CQUAD4* {i + 1:16d}{1 + i // 2:16d}{a:16d}{b:16d}\n*       {c:16d}{d:16d}" for i, (a, b, c, d) in enumerate(QUADS)
]


def bulk(cards: list[str], *more: str) -> str:
    return "\n".join(["BEGIN BULK", *GRIDS, *cards, *more, "ENDDATA"])


@pytest.mark.parametrize(
    "text",
    [
        bulk(CARDS),
        bulk(CARDS).lower(),
        bulk([f"{card}     30." for card in CARDS]),
        bulk([f"{card}     30.      0.\n        +             2.      2.      2.      2." for card in CARDS]),
        bulk([f"{card}  $ a comment, behind the card" for card in CARDS]),
        bulk(LARGE),
        bulk([re.sub(r"\s+", ",", card) for card in CARDS]),
        bulk(CARDS).replace("  200.00", "   2.0+2"),
    ],
)
def test_nastran_s_cards_are_read_in_every_form(tmp_path, text):
    mesh = read(tmp_path / "m.bdf", text)
    assert mesh.nodes == pytest.approx(1e-3 * np.array(NODES))
    assert np.array_equal(mesh.quads + 1, QUADS)
    assert mesh.parts == ("part_1", "part_2")
    assert [mesh.number(i) for i in range(4)] == [1, 2, 3, 4]


def test_nastran_s_included_cards_are_read_and_offsets_are_told(tmp_path):
    (tmp_path / "shells.bdf").write_text("\n".join(f"{card}{'':8s}     1.5" for card in CARDS) + "\n")
    (said,) = warnings(tmp_path / "m.bdf", bulk(["INCLUDE 'shells.bdf'"]))
    assert said.startswith("ZOFFS of 4 shells is not read")
    text = bulk(["INCLUDE 'shells.bdf' $ 'the shells'"]) + "\nINCLUDE 'behind_the_end.bdf'"
    assert len(read(tmp_path / "m.bdf", text).quads) == 4
    assert list(included_files(tmp_path / "m.bdf")) == ["shells.bdf"]
    with pytest.raises(UserError, match=r"it includes lost.bdf, which is not there"):
        read(tmp_path / "m.bdf", bulk(CARDS, "INCLUDE 'lost.bdf'"))


def test_the_name_of_an_included_nastran_file_may_go_on_in_the_next_line(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "shells.bdf").write_text("\n".join(CARDS) + "\n")
    assert len(read(tmp_path / "m.bdf", bulk(["INCLUDE 'parts/", "  shells.bdf' $ here"])).quads) == 4


def test_enddata_of_an_included_file_ends_that_file_alone(tmp_path):
    """What the including file had behind it was lost without a word: shells, or what holds them."""
    (tmp_path / "half.bdf").write_text("\n".join(["BEGIN BULK", *CARDS[:2], "ENDDATA"]) + "\n")
    mesh = read(tmp_path / "m.bdf", bulk(["INCLUDE 'half.bdf'", *CARDS[2:]], "SPC1,5,123456,1,2"))
    assert len(mesh.quads) == 4
    assert nodes_of(mesh, "spc_5_123456") == [1, 2]


def test_thicknesses_of_nastran_s_shells_are_told(tmp_path):
    """They were passed over without a word."""
    quads = [f"{card}\n{'':24s}     1.5     1.5     1.5     1.5" for card in CARDS[1:]]
    triangles = ["CTRIA3,20,1,1,3,4", ",,,1.5,1.5,1.5", "CTRIA3,21,1,1,4,2"]
    (said,) = warnings(tmp_path / "m.bdf", bulk([*triangles, *quads]))
    assert said.startswith("T1 .. T4 of 4 shells are not read: thicknesses are those of target.parts")


def test_nastran_s_repeated_cards_are_refused(tmp_path):
    with pytest.raises(UserError, match=r"it repeats cards by =, which is not read"):
        read(tmp_path / "m.bdf", bulk(CARDS, "=,*1,=,*2,*2,*2,*2", "=(2)"))


@pytest.mark.parametrize(
    ("cards", "sets"),
    [
        (["SPC1,5,123456,1,2,9"], {"spc_5_123456": [1, 2, 9]}),
        (["SPC1           5  123456       1    THRU       4"], {"spc_5_123456": [1, 2, 3, 4]}),
        (["SPC1,5,123456,1,3,THRU,5,9,,+A", "+A,8"], {"spc_5_123456": [1, 3, 4, 5, 8, 9]}),
        (["SPC1*                  5             321               1               2", "*                      4"],
         {"spc_5_123": [1, 2, 4]}),
        (["spc1,5,123,1,2,3,4,5,6", "+,7,8"], {"spc_5_123": [1, 2, 3, 4, 5, 6, 7, 8]}),
        (["SPC            5       1     123      0.       2  123456"], {"spc_5_123": [1], "spc_5_123456": [2]}),
        (["SPC1,5,123,1,2", "SPC1,5,456,2,4"], {"spc_5_123": [1], "spc_5_123456": [2]}),
        (["SPCADD,9,5,6", "SPC1,5,123,1", "SPC1,6,123456,1,2"],
         {"spc_5_123": [1], "spc_6_123456": [1, 2], "spc_9_123456": [1, 2]}),
        (["GRID,20,,0.,0.,0.,,123456", "CTRIA3,20,1,10,9,20"], {"grid_123456": [11]}),
    ],
)  # fmt: skip
def test_what_nastran_s_cards_hold_are_sets_of_nodes(tmp_path, cards, sets):
    mesh = read(tmp_path / "m.bdf", bulk(CARDS, *cards))
    assert {name: nodes_of(mesh, name) for name in mesh.sets if name != "free_edges"} == sets


def test_a_case_is_held_by_the_nodes_of_an_spc(tmp_path):
    (tmp_path / "m.bdf").write_text(bulk(CARDS, "SPC1,5,123456,1,2"))
    parts = {"part_1": PART, "part_2": PART}
    case = load_case(table_with(tmp_path / "m.bdf", mesh_unit="mm", parts=parts, supports={"spc_5_123456": "clamped"}))
    assert list(np.flatnonzero(build_plate(case).fixed)) == [0, 1]


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        (["SPC1,5,246,1,2"], "spc_5_246 is not read: it holds the freedoms 246 of 2 nodes, and a support those of 123"),
        (["SPC,5,1,123,0.5"], "SPC 5 moves node 1, which is not read"),
        (["SPCD,5,1,3,0.5"], "SPCD is not read"),
        (["GRDSET,,,,,,,345"], "GRDSET is not read"),
        (["SET1,4,1,THRU,4"], "SET1 is not read: no set is made of what it holds; write its nodes as an SPC1"),
    ],
)  # fmt: skip
def test_holds_of_nastran_that_no_support_is_are_told(tmp_path, cards, said):
    (found,) = warnings(tmp_path / "m.bdf", bulk(CARDS, *cards))
    assert found.startswith(said)


def test_a_support_that_names_a_set_which_is_not_read_says_why(tmp_path):
    """It was "does not exist" alone, beside a file that has it."""
    (tmp_path / "m.bdf").write_text(bulk(CARDS, "SPC1,5,246,1,2"))
    parts = {"part_1": PART, "part_2": PART}
    given = table_with(tmp_path / "m.bdf", mesh_unit="mm", parts=parts, supports={"spc_5_246": "pinned"})
    with pytest.raises(UserError, match=r"spc_5_246, a set of nodes that is left out: .* the freedoms 246 of 2 nodes"):
        load_case(given)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("SPC1,5,123,1,2,99", "the set of nodes spc_5_123 refers to 99, which is not there"),
        ("SPC1,5,127,1", '"127" in the line "SPC1 5 127 1.*" names no freedoms of 1 to 6'),
        ("SPC1,5,123,1,THRU,9,BY,2", 'SPC1: "BY" in the line "SPC1 5 123 1 THRU 9 BY 2 *" is not read; write'),
        ("SPC1,5,123,1,THRU", 'SPC1: "" in the line'),
        ("SPC1,5,123,1,2,3,4,5,6,7,8", "has more than 8 fields behind its name"),
        ("SPC1,5,123,1,2,3,4,5,6,7", "has more than 8 fields behind its name"),
        ("SPCADD,5,7", "SPCADD 5 adds 7, which no SPC or SPC1 is"),
    ],
)
def test_holds_of_nastran_that_are_not_whole_are_refused(tmp_path, card, said):
    with pytest.raises(UserError, match=said):
        read(tmp_path / "m.bdf", bulk(CARDS, card))


def keywords(*more: str, shells: str = "*ELEMENT_SHELL", second: tuple[str, ...] = (), wide: int = 8) -> str:
    """The strip as a keyword file; second: lines after each shell's own."""
    places = [f"{i + 1:{wide}d}" + "".join(f"{c:{max(wide, 16)}.6e}" for c in node) for i, node in enumerate(NODES)]
    lines = ["*KEYWORD LONG=Y" if wide == 20 else "*KEYWORD", "*NODE", *places, shells]
    for i, quad in enumerate(QUADS):
        lines += ["".join(f"{n:{wide}d}" for n in (i + 1, 7 + i // 2, *quad)), *second]
    return "\n".join([*lines, "*PART", "$ heading", "skin", f"{7:{max(wide, 10)}d}", *more, "*END"])


def ten(*numbers: object) -> str:
    return "".join(f"{number!s:>10}" for number in numbers)


THICK = "".join(f"{2.0:16.4f}" for _ in range(4))


@pytest.mark.parametrize(
    "text",
    [
        keywords(),
        keywords().lower(),
        keywords(wide=20),
        keywords(shells="*ELEMENT_SHELL_THICKNESS", second=(THICK,)),
        keywords(shells="*ELEMENT_SHELL_THICKNESS", second=("",)),
        keywords(shells="*ELEMENT_SHELL_THICKNESS_OFFSET", second=("", "")),
        keywords(wide=20)
        .replace(" LONG=Y", "")
        .replace("*NODE", "*NODE +")
        .replace("_SHELL", "_SHELL+")
        .replace("*PART", "*PART+"),
        keywords(shells="*ELEMENT_SHELL_THICKNESS_OFFSET", second=(THICK, f"{1.0:16.4f}")),
        keywords()
        .replace("\n       3       8", "\n*ELEMENT_SHELL_THICKNESS\n       3       8", 1)
        .replace("       5       7       8       6\n       4", f"       5       7       8       6\n{THICK}\n       4")
        .replace("       7       9      10       8\n", f"       7       9      10       8\n{THICK}\n"),
    ],
)
def test_a_keyword_file_s_shells_are_read_in_every_form(tmp_path, text):
    mesh = read(tmp_path / "m.k", text)
    assert mesh.nodes == pytest.approx(1e-3 * np.array(NODES))
    assert np.array_equal(mesh.quads + 1, QUADS)
    assert mesh.parts == ("skin", "part_8")


@pytest.mark.parametrize(
    ("block", "name", "nodes"),
    [
        (("*SET_NODE", ten(5), ten(1, 2, 2)), "set_5", [1, 2]),
        (("*SET_NODE_LIST_TITLE", "rim", ten(5), ten(1, 2), ten(9)), "rim", [1, 2, 9]),
        (("*SET_NODE_LIST_GENERATE", ten(5), ten(1, 3, 8, 9)), "set_5", [1, 2, 3, 8, 9]),
        (("*SET_NODE_LIST_GENERATE_INCREMENT_TITLE", "rim", ten(5), ten(1, 7, 3)), "rim", [1, 4, 7]),
        (("*SET_NODE_COLUMN", ten(5), ten(3, 1.0), ten(4, 1.0)), "set_5", [3, 4]),
        (("*SET_NODE_GENERAL", ten(5), ten("NODE", 1), ten("PART", 8), ten("DNODE", 5)), "set_5", [1, 6, 7, 8, 9, 10]),
        (("*SET_NODE", ten(1), ten(3), "*SET_NODE_ADD", ten(5), ten(1)), "set_5", [3]),
        (
            (
                *("*SET_NODE_ADD", ten(5), ten(4, 1), "*SET_NODE_ADD", ten(4), ten(2)),
                *("*SET_NODE", ten(1), ten(3), "*SET_NODE", ten(2), ten(9)),
            ),
            "set_5",
            [3, 9],
        ),
    ],
)
def test_a_keyword_file_s_sets_are_read_in_every_form(tmp_path, block, name, nodes):
    assert nodes_of(read(tmp_path / "m.k", keywords(*block)), name) == nodes


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_names_are_read_in_the_encodings_of_pre_processors(tmp_path, encoding):
    """In cp1252 their letters beyond ASCII were replaced, so that no case could name them."""
    text = keywords("*SET_NODE_TITLE", "Einspannung au\u00dfen", ten(5), ten(1))
    (tmp_path / "m.k").write_bytes(text.encode(encoding))
    assert "Einspannung_au\u00dfen" in read_mesh(str(tmp_path / "m.k"), "mm").sets


def test_parts_and_sets_of_one_name_are_told_apart_by_their_numbers(tmp_path):
    sets = ("*SET_NODE_TITLE", "rim", ten(5), ten(1), "*SET_NODE_TITLE", "rim", ten(6), ten(2))
    mesh = read(tmp_path / "m.k", keywords("*PART_COMPOSITE", "skin", ten(8), ten(1, 1.0), *sets))
    assert mesh.parts == ("skin_7", "skin_8")
    assert (nodes_of(mesh, "rim_5"), nodes_of(mesh, "rim_6")) == ([1], [2])


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("*ELEMENT_BEAM", "       9       3       1       2"), "*ELEMENT_BEAM left out: their stiffness"),
        (("*element_mass", "       9       1             0.5"), "*ELEMENT_MASS left out"),
        (("*CONSTRAINED_SPOTWELD", ten(1, 2)), "*CONSTRAINED_SPOTWELD left out"),
        (
            ("*SECTION_SHELL_TITLE", "skin", ten(1, 2), ten(2.0, 2.0, 2.0, 2.0, 1.0)),
            "NLOC of *SECTION_SHELL is not read",
        ),
        (("*NODE_TRANSFORM", ten(1, 5)), "*NODE_TRANSFORM is not read: nodes stay"),
        (("*INCLUDE_TRANSFORM", "o.k"), "*INCLUDE_TRANSFORM is not read"),
        (("*BOUNDARY_SPC_NODE", ten(1, 0, 1, 1, 1)), "*BOUNDARY_SPC_NODE is not read: no set is made of the nodes"),
        (("*NODE", "1, 0., 0., 0., 7, 7", "2, 0., 50., 0., 0, 3"), "TC and RC of *NODE are not read: no set is made"),
        (("*SET_NODE_GENERAL", ten(5), ten("BOX", 1)), "*SET_NODE_GENERAL is not read: there is no set_5"),
    ],
)
def test_what_a_keyword_file_has_besides_is_told(tmp_path, more, said):
    (found,) = warnings(tmp_path / "m.k", keywords(*more))
    assert said in found


@pytest.mark.parametrize(
    "lines", [(), (ten(1, 2),), (ten(1, 2), ten(2.0, 2.0, 2.0, 2.0)), (ten(1, 2), "2., 2., 2., 2., 0.")]
)
def test_a_section_about_its_nodes_is_nothing_to_tell(tmp_path, lines):
    assert warnings(tmp_path / "m.k", keywords("*SECTION_SHELL", *lines)) == []


@pytest.mark.parametrize("given", [f"{'R dx':10}{50.0:10.1f}{'I last':10}{10:10d}", "rDX, 50., i last, 10"])
@pytest.mark.parametrize("included", [False, True])
def test_parameters_stand_for_numbers(tmp_path, given, included):
    (tmp_path / "given.k").write_text(f"*PARAMETER\n{given}\n*END\n")
    head = ("*INCLUDE", "given.k") if included else ("*PARAMETER", given)
    text = keywords("*SET_NODE", ten(5), ten(1, "&last")).replace("*NODE\n", "\n".join([*head, "*NODE", ""]))
    text = text.replace(f"{50.0:16.6e}", f"{'&dx':>16}")
    assert text.count("&dx") > 2
    mesh = read(tmp_path / "m.k", text)
    assert mesh.nodes == pytest.approx(1e-3 * np.array(NODES))
    assert nodes_of(mesh, "set_5") == [1, 10]


@pytest.mark.parametrize(("value", "use"), [("50.0", "&dx"), ("-50.0", "-&dx"), ("+50.0", "&DX")])
def test_a_parameter_may_have_a_sign_before_it(tmp_path, value, use):
    text = keywords("*PARAMETER", f"R dx, {value}").replace(f"{50.0:16.6e}", f"{use:>16}")
    assert read(tmp_path / "m.k", text).nodes == pytest.approx(1e-3 * np.array(NODES))


def test_a_keyword_file_s_included_one_is_read(tmp_path):
    (tmp_path / "sets.k").write_text("*SET_NODE\n" + ten(5) + "\n" + ten(1) + "\n*END\n")
    more = ("*PART", "included spar", ten(8), "*INCLUDE", "se +", "ts.k", "")
    text = keywords(*more) + "\n*INCLUDE\nbehind_the_end.k"
    assert nodes_of(read(tmp_path / "m.k", text), "set_5") == [1]
    assert list(included_files(tmp_path / "m.k")) == ["sets.k"]


@pytest.mark.parametrize("keyword", ["*INCLUDE_PATH", "*INCLUDE_PATH_RELATIVE"])
def test_an_included_keyword_file_may_stand_in_a_folder_that_is_named(tmp_path, keyword):
    (tmp_path / "sets").mkdir()
    (tmp_path / "sets" / "rim.k").write_text("*SET_NODE\n" + ten(5) + "\n" + ten(1) + "\n*END\n")
    text = keywords(keyword, "sets", "*INCLUDE", "rim.k")
    assert nodes_of(read(tmp_path / "m.k", text), "set_5") == [1]
    assert warnings(tmp_path / "m.k", text) == []
    assert list(included_files(tmp_path / "m.k")) == ["sets/rim.k"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (keywords("*INCLUDE", "lost.k"), "it includes lost.k, which is not there"),
        (keywords("*SET_NODE_ADD", ten(5), ten(1)), "the set set_5 adds the set 1, which is not there or not read"),
        (keywords("*SET_NODE_ADD", ten(5), ten(5)), "the set set_5 adds itself up"),
        (keywords(shells="*ELEMENT_SHELL_COMPOSITE"), "*ELEMENT_SHELL_COMPOSITE is not read"),
        (
            keywords(shells="*ELEMENT_SHELL_OFFSET", second=("1.0",)).replace("\n1.0\n*PART", "\n*PART"),
            "has 7 lines, of 2",
        ),
        (keywords().replace("*NODE\n", "*NODE %\n"), "*NODE is in the I10 format (%)"),
        (
            keywords(
                "*PARAMETER", "R dy, 50., C s, text", "*PARAMETER_EXPRESSION", "R dx, dy", "*SET_NODE", ten("&dx")
            ),
            '*SET_NODE: "&dx" in the line "&dx" is no parameter of the file; its parameters (R and I of '
            "*PARAMETER): DY. Give it there by a number",
        ),
        (keywords("*SET_NODE", ten(5), "1,2,3,4,5,6,7,8,9"), '"1,2,3,4,5,6,7,8,9" has more than 8 numbers; begin new'),
        (keywords("*PARAMETER", "R dx, 5., R DX, 6."), "*PARAMETER: DX is given twice, as 5. and as 6.; leave one"),
        (keywords("*PARAMETER", "R dx, five"), '*PARAMETER: "five" in the line "R dx, five" is no number'),
        (keywords("*PARAMETER", "dx, 5."), '*PARAMETER: "dx" in the line "dx, 5." is no R or I with a name'),
        (keywords("*SET_NODE", ten(99999999999)), "is beyond 2147483647; renumber it"),
        (keywords().replace("*KEYWORD", "*KEYWORD LONG=Y"), "is no number"),
        (keywords("*NODE", f"{1:8d}{9.0:16.3f}{0.0:16.3f}{0.0:16.3f}"), "node 1 is given twice, at different places"),
    ],
)
def test_a_keyword_file_that_is_not_read_is_refused_by_name(tmp_path, text, said):
    with pytest.raises(UserError, match=re.escape(said)):
        read(tmp_path / "m.k", text)


def msh4(*lines: str) -> str:
    """The strip of Gmsh's version 4.1, with two curves at its ends; lines: names of groups, tags of entities."""
    rows = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", *lines, "$Nodes", "1 10 1 10", "2 1 0 10"]
    rows += [*(str(i + 1) for i in range(10)), *(" ".join(map(str, node)) for node in NODES), "$EndNodes"]
    rows += ["$Elements", "3 6 1 6", "1 1 1 1", "1 1 2", "1 2 1 1", "2 9 10", "2 1 3 4"]
    rows += [f"{i + 3} {' '.join(map(str, quad))}" for i, quad in enumerate(QUADS)]
    return "\n".join([*rows, "$EndElements"])


def entities(first: str, second: str) -> list[str]:
    """Groups of two curves and one surface: how many tags, and these."""
    curves = [f"1 0 0 0 0 1 0 {first} 0", f"2 4 0 0 4 1 0 {second} 0"]
    return ["$Entities", "0 2 1 0", *curves, "1 0 0 0 4 1 0 1 3 0", "$EndEntities"]


NAMED = ["$PhysicalNames", "3", '1 1 "left"', '1 2 "ends"', '2 3 "skin"', "$EndPhysicalNames"]


def test_a_curve_in_several_groups_of_gmsh_belongs_to_each(tmp_path):
    """Its nodes were in the first group alone, and missing from the others' supports without a word."""
    mesh = read(tmp_path / "m.msh", msh4(*NAMED, *entities("2 1 2", "1 2")))
    assert mesh.parts == ("skin",)
    assert (nodes_of(mesh, "left"), nodes_of(mesh, "ends")) == ([1, 2], [1, 2, 9, 10])


@pytest.mark.parametrize(("name", "lost"), [(None, "1, 2"), ("skin", "2")])
def test_groups_of_gmsh_without_a_name_of_their_own_are_told(tmp_path, name, lost):
    """As where a curve's group is called as a surface's is: they were no sets, without a word."""
    names = [] if name is None else [line.replace("ends", name) for line in NAMED]
    said = warnings(tmp_path / "m.msh", msh4(*names, *entities("1 1", "1 2")))
    assert len(said) == 1
    assert said[0].startswith(f"Gmsh's groups of points or curves {lost} are not read: they have no name of their own")


def test_elements_of_gmsh_in_no_group_are_told_with_the_remedy(tmp_path):
    with pytest.raises(UserError, match=r"some of its elements are in no physical group.*Mesh.SaveAll = 0"):
        read(tmp_path / "m.msh", msh4(*NAMED, *entities("0", "1 2")))


def test_nodes_that_abaqus_holds_one_by_one_are_told(tmp_path):
    (said,) = warnings(tmp_path / "m.inp", f"{INP}\n*BOUNDARY\na, 1, 6\nPart-1.2, ENCASTRE")
    assert said.startswith("*BOUNDARY holds single nodes, which is not read")
    assert warnings(tmp_path / "n.inp", f"{INP}\n*BOUNDARY\na, 1, 6") == []


def test_lists_of_bounding_entities_of_gmsh_are_no_parts(tmp_path):
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "0 0 1 0", "1 0 0 0 1 1 1 0 4 501 -502 503 504"]
    lines += ["$EndEntities", "$Nodes", "1 10 1 10", "2 1 0 10", *(str(i + 1) for i in range(10))]
    lines += [" ".join(map(str, node)) for node in NODES]
    lines += ["$EndNodes", "$Elements", "1 4 1 4", "2 1 3 4"]
    lines += [f"{i + 1} {' '.join(map(str, quad))}" for i, quad in enumerate(QUADS)]
    assert read(tmp_path / "m.msh", "\n".join([*lines, "$EndElements"])).parts == ("part_1",)


@pytest.mark.parametrize(
    ("name", "text", "stated"),
    [
        ("m.inp", f"{INP}\n*SHELL SECTION, ELSET=SKIN, MATERIAL=al\n2.5, 5", {"skin": 2.5e-3}),
        ("m.inp", f"{INP}\n*SHELL SECTION, ELSET=skin, COMPOSITE\n0.1, 3, ply, 45.", {}),
        ("m.inp", f"{INP}\n*SHELL SECTION, ELSET=skin, SHELL THICKNESS=field", {}),
        ("m.bdf", bulk(CARDS, "PSHELL,1,1,2.5", "PSHELL   2       1      3.1"), {"part_1": 2.5e-3, "part_2": 3.1e-3}),
        ("m.bdf", bulk(CARDS, "PSHELL,1,1", "PCOMP,2"), {}),
        ("m.k", keywords(ten(8), "*SECTION_SHELL", ten(8, 2), ten(2.5, 2.5, 2.5, 2.5)), {}),
        ("m.k", keywords("*PART", "web", ten(8, 4), "*SECTION_SHELL_TITLE", "t", ten(4, 2), ten(2.5)), {"web": 2.5e-3}),
        ("m.k", keywords("*PART_COMPOSITE", "web", ten(8, 4), "*SECTION_SHELL", ten(4, 2), ten(2.5)), {}),
    ],
)
def test_thicknesses_that_a_file_states_of_its_parts_are_known(tmp_path, name, text, stated):
    assert read(tmp_path / name, text).thicknesses == pytest.approx(stated)


def test_another_thickness_in_the_file_than_in_the_case_is_told(tmp_path):
    """The case's was simulated without a word."""
    (tmp_path / "m.bdf").write_text(bulk(CARDS, "PSHELL,1,1,2.", "PSHELL,2,1,3.1") + "\n")
    parts = {"part_1": PART, "part_2": PART}
    case = load_case(table_with(tmp_path / "m.bdf", mesh_unit="mm", parts=parts, supports={"free_edges": "clamped"}))
    (said,) = other_thicknesses(case)
    assert said.startswith("m.bdf states another thickness than the case, whose own is simulated: part_2 3.1 mm (")
    sought = {"inversion": {"parameters": {"target.parts.part_2.thickness": {"range": ["1 mm", "4 mm"]}}}}
    assert other_thicknesses(case.overlaid(sought)) == []


def test_numbers_of_parts_in_an_array_of_another_name_are_told(tmp_path):
    """Both parts were one, without a word."""
    cells: Any = [("quad", np.array(QUADS) - 1)]
    for name, values, told in (("PartId", [1, 1, 2, 2], 1), ("part", [1, 1, 2, 2], 0), ("id", [1, 2, 3, 4], 0)):
        meshio.Mesh(np.array(NODES), cells, cell_data={name: [np.array(values)]}).write(tmp_path / f"{name}.vtu")
        found = inspect_mesh(str(tmp_path / f"{name}.vtu"), "mm", (0.0, 0.0, 0.0))[1]
        assert [one.text.startswith(f"the array {name} is not read") for one in found] == [True] * told


def test_a_format_with_an_ending_of_another_is_told_to_be_renamed(tmp_path):
    """Nastran's .dat is Tecplot's to meshio."""
    with pytest.raises(UserError, match=r"rename it, where it is one of these with another ending, .*Nastran \.bdf"):
        read(tmp_path / "m.dat", bulk(CARDS))


def test_shells_without_a_number_of_their_part_are_refused(tmp_path):
    part: Any = [np.array([1.0, 1.0, np.nan, 2.0])]
    meshio.Mesh(np.array(NODES), [("quad", np.array(QUADS) - 1)], cell_data={"part": part}).write(tmp_path / "m.vtu")
    with pytest.raises(UserError, match="1 of 4 shells have no number in the array part"):
        read_mesh(str(tmp_path / "m.vtu"), "mm")


def test_a_part_is_what_a_shell_section_names_though_other_sets_make_it_up(tmp_path):
    """Skin and web of quadrilaterals and triangles come as four blocks; an effect on one block alone is none."""
    blocks = [f"*ELEMENT, TYPE=S4, ELSET={name}\n{line}" for name, line in zip("pqrs", SHELL_LINES, strict=True)]
    sets = ["*ELSET, ELSET=skin\np, r", "*ELSET, ELSET=web\nq, s", "*ELSET, ELSET=all\np, q, r, s"]
    text = "\n".join(["*NODE", *NODE_LINES, *blocks, *sets])
    assert read(tmp_path / "blocks.inp", text).parts == ("p", "q", "r", "s")
    section = "*SHELL SECTION, ELSET={}, MATERIAL=m\n2.0"
    mesh = read(tmp_path / "parts.inp", "\n".join([text, *map(section.format, ("Web", "Part-1.skin"))]))
    assert mesh.parts == ("skin", "web")
    assert mesh.part.tolist() == [0, 1, 0, 1]
    one = read(tmp_path / "one.inp", "\n".join([text, section.format("skin")]))
    assert one.parts == ("p", "q", "r", "s")
