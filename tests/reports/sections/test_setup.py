"""The page and the evidence say what a case states of effects and instruments."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.reports.blocks import Picture, Table
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.setup import _caption, _facts, _plate, section
from birdstrike.solver.case.case import load_case
from tests.solver.target.triangles import abaqus_file
from tests.solver.test_struck_plane import strike


def test_the_set_up_has_the_effects_and_the_instruments_of_the_case(results: Results) -> None:
    case = results.case.with_effects({"edge_slip": 1e-9})
    case = case.overlaid({"instrument": {"displacement_centre": {"bandwidth": "20 kHz", "gain": 1.03}}})
    (table,) = (block for block in section(replace(results, case=case)).blocks if isinstance(block, Table))
    rows = {str(row[0]): str(row[1]) for row in table.rows}
    assert rows["effect of the case"].startswith("effects.edge_slip = +1 mm²/kN")
    assert rows["instrument of displacement centre"] == "bandwidth 20 kHz, gain 1.03"


def test_the_lines_of_a_records_provenance_are_told_apart(results: Results) -> None:
    """Heads of an export ran into one another."""
    lines = ("Imported by birdstrike from a.csv.", "its head: Model,MSO54", "its head: Label,LASER")
    shown = replace(results, record=replace(results.record, provenance=lines))
    (table,) = (block for block in section(shown).blocks if isinstance(block, Table))
    rows = {str(row[0]): str(row[1]) for row in table.rows}
    assert rows["provenance"] == "\n".join(lines)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({}, "the bird's axis points at the plate's centre;"),
        ({"aim": "first_touch"}, "the plate's centre is touched first;"),
        ({"offset": ["10 mm", "-5 mm"]}, "points at the plate's centre, (10, -5) mm beside it along length and width;"),
        ({"point": ["1 mm", "2 mm", "0 mm"]}, "the bird's axis flies through (1, 2, 0) mm;"),
    ],
)
def test_the_caption_says_where_the_bird_is_aimed(results: Results, change: dict[str, object], said: str) -> None:
    """A bird beside the centre was said to be aimed at it."""
    assert said in _caption(results.case.overlaid({"impact": change}))


def test_the_caption_of_a_mesh_that_lies_aslant_has_the_angle_to_its_own_surface(tmp_path: Path) -> None:
    """It told the angle to the plane z = 0 beside the speed normal to the shells."""
    case = strike(tmp_path, 25.0)
    assert case.impact.angle == pytest.approx(np.radians(85.0))
    assert "makes 60° with the plate's surface, so that 78.9 m/s of " in _caption(case)
    assert dict(_plate(case))["target"].startswith("200 mm × 200 mm, mesh "), "not its extent in x and y"


def test_the_caption_of_a_mesh_from_a_file_names_its_point_and_the_table_the_file(tmp_path: Path) -> None:
    """The point of aim is one of the file's axes; it was called the plate's centre."""
    corners = np.array([[x, y, 0.0] for x in (0.0, 150.0, 300.0) for y in (0.0, 100.0, 200.0)])
    quads = np.array([[0, 3, 4, 1], [1, 4, 5, 2], [3, 6, 7, 4], [4, 7, 8, 5]])
    mesh = abaqus_file(tmp_path / "skin.inp", corners, [("S4", "skin", 1, quads)], {"rim": np.array([0, 1, 2])})
    table = load_case("openradioss_panel").table
    target = {"mesh": str(mesh), "mesh_unit": "mm", "origin": ["100 mm", "50 mm", "0 mm"]}
    target |= {"parts": {"skin": {"thickness": "3 mm", "material": "aluminium"}}, "supports": {"rim": "clamped"}}
    table["target"] = target | {"materials": table["target"]["materials"]}
    table["sensors"] = {"force": {"kind": "contact_force"}}
    case = load_case(table)
    assert "the bird's axis points at the point (100, 50, 0) mm of the mesh file;" in _caption(case)
    assert dict(_facts(case))["target"].startswith("300 mm × 200 mm, mesh skin.inp, 4 shells")


@pytest.mark.parametrize(
    "change",
    [
        {"impact": {"offset": ["60 mm", "30 mm"]}},
        {"impact": {"yaw": "20 deg"}},
        {"impact": {"pitch": "10 deg"}},
        {"plate": {"radius": "2 m"}},
    ],
)
def test_the_picture_shows_where_the_bird_flies(results: Results, change: dict[str, dict[str, object]]) -> None:
    """The sketch in one plane was the same whatever the aim."""
    (picture,) = (
        b for b in section(replace(results, case=results.case.overlaid(change))).blocks if isinstance(b, Picture)
    )
    (plain,) = (block for block in section(results).blocks if isinstance(block, Picture))
    assert "<svg" in plain.markup
    assert "image/png" in picture.markup
