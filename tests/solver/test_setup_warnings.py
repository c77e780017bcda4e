"""Rules that warn of a case before it is run: the error of its mesh, the share of the bird beside the plate."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.paths import CASES, TEMPLATES
from birdstrike.solver.case.case import load_case
from birdstrike.solver.estimate import estimate
from birdstrike.solver.setup_warnings import (
    MESH_LIMIT,
    bird_beside_plate,
    coarse_mesh,
    plate_mesh_error,
    setup_warnings,
    share_beside_plate,
)
from birdstrike.solver.simulate import simulate
from tests.solver.target.triangles import abaqus_file

HEAD_ON = {"impact.angle": "90 deg"}


@pytest.mark.parametrize("case", sorted([*CASES.glob("*.toml"), TEMPLATES / "case.toml"]), ids=lambda path: path.stem)
def test_nothing_is_said_of_a_shipped_case_nor_of_the_one_to_start_from(case: Path) -> None:
    assert setup_warnings(load_case(case)) == []


def test_a_bird_half_off_the_plate_is_half_of_its_cross_section() -> None:
    """Where the axis meets the edge, half the disc; beyond a chord at radius/2, acos(1/2)/pi - sqrt(3)/(4 pi)."""
    edge = {"impact.offset": '["0 mm", "215 mm"]'}
    assert share_beside_plate(load_case("reference_strike", HEAD_ON | edge)) == pytest.approx(0.5, abs=0.005)
    inside = {"impact.offset": '["0 mm", "188.5 mm"]'}
    segment = math.acos(0.5) / math.pi - math.sqrt(3.0) / (4.0 * math.pi)
    assert share_beside_plate(load_case("reference_strike", HEAD_ON | inside)) == pytest.approx(segment, abs=0.005)
    assert share_beside_plate(load_case("reference_strike", HEAD_ON)) == 0.0


def test_an_oblique_bird_casts_a_longer_shadow() -> None:
    """At 30 degrees it is twice as long as wide: half the plate's length less 106 mm is where it begins to leave."""
    for offset, beyond in ((156.0, False), (175.0, True)):
        case = load_case("reference_strike", {"impact.offset": f'["{offset} mm", "0 mm"]'})
        assert (share_beside_plate(case) > 0.0) == beyond


def test_the_error_to_expect_is_that_of_a_simulation() -> None:
    """Peaks of a short strike on four meshes against a finer one: within a factor of 2 where it is told, else small."""

    def peak(*elements: int) -> tuple[float, float]:
        settings = {"plate.elements": elements, "bird.particles": 300, "time.end": "2 ms"}
        case = load_case("synthetic_strike", settings)
        return float(simulate(case, threads=1).channels["displacement_centre"].max()), plate_mesh_error(case)

    fine, _ = peak(24, 20)
    for elements in ((2, 2), (3, 3), (20, 2), (7, 7), (9, 9)):
        found, expected = peak(*elements)
        assert 0.5 * expected < abs(found / fine - 1.0) < 2.0 * expected
        assert expected > MESH_LIMIT
    found, expected = peak(12, 10)
    assert abs(found / fine - 1.0) < expected < MESH_LIMIT


def test_the_mesh_that_is_named_instead_is_fine_enough() -> None:
    odd = {"plate.elements": [10, 10]}
    small = {"bird.diameter": "30 mm", "bird.length": "60 mm", "plate.elements": [18, 15]}
    for settings in ({"plate.elements": [8, 8]}, {"plate.elements": [8, 30]}, odd, small, {"bird.particles": 300}):
        assert coarse_mesh(load_case("reference_strike", settings)) == []


def sheet_from_a_file(folder: Path, corner: float = -0.1) -> dict[str, Any]:
    """Table of a case whose target is a file's square of 3 x 3 shells, 0.2 m wide; corner: its x and y [m]."""
    x = corner + np.linspace(0.0, 0.2, 4)
    nodes = np.array([[a, b, 0.0] for a in x for b in x])
    quads = np.array([[4 * i + j, 4 * i + 4 + j, 4 * i + 5 + j, 4 * i + 1 + j] for i in range(3) for j in range(3)])
    table = load_case("openradioss_panel").table
    table["target"] = {
        **{key: table["target"][key] for key in ("materials",)},
        "mesh": str(abaqus_file(folder / "plate.inp", nodes, [("S4", "skin", 1, quads)], {})),
        "mesh_unit": "m",
        "parts": {"skin": {"thickness": "3 mm", "material": "aluminium"}},
        "supports": {"free_edges": "clamped"},
    }
    table["sensors"] = {"w": {"kind": "displacement"}}
    return table


def test_a_coarse_mesh_from_a_file_is_told_at_once(tmp_path: Path) -> None:
    """It cannot be refined for a better number to name."""
    (said, *_) = coarse_mesh(load_case(sheet_from_a_file(tmp_path)))
    assert "3 shells across the plate" in said
    assert "refine the file of target.mesh" in said
    assert "compare with a simulation on a finer file" in said
    assert "birdstrike converge" not in said


def test_the_share_beside_a_mesh_from_a_file_hangs_on_its_place_and_not_on_the_origin(tmp_path: Path) -> None:
    """A mesh whose corner is the origin was said to be missed by a bird that meets its middle."""
    table = sheet_from_a_file(tmp_path, corner=0.0)
    table["impact"]["point"] = ["100 mm", "100 mm", "0 mm"]
    assert share_beside_plate(load_case(table)) == 0.0
    assert estimate(load_case(table))["first_contact"] is not None
    table["impact"]["point"] = ["0 mm", "100 mm", "0 mm"]
    assert share_beside_plate(load_case(table)) == pytest.approx(0.5, abs=0.005)


def test_a_point_beside_the_plate_is_named_as_such() -> None:
    aim = {"impact.point": '["300 mm", "0 mm", "0 mm"]', "impact.aim": "axis"}
    (line,) = bird_beside_plate(load_case("reference_strike", aim))
    assert "impact.point = 300 and 0 mm" in line
    assert "correct impact.point" in line
    assert "impact.offset" not in line
