"""Candidate sensors: none beside one of its kind, none off the target."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.inversion.diagnosis.conclusions.next_measurement import described
from birdstrike.inversion.diagnosis.preparation.plan import (
    PREFIX,
    candidate_sensors,
    with_candidate_sensors,
)
from birdstrike.solver.build import rest_mesh
from birdstrike.solver.case.case import load_case
from birdstrike.solver.sensors.sensor import Placed
from birdstrike.solver.sensors.strain import Strain
from tests.solver.test_setup_warnings import sheet_from_a_file
from tests.solver.test_struck_plane import about_y, strike


def test_a_candidate_sensor_beside_one_of_its_kind_is_none() -> None:
    """131 mm from the centre was proposed beside a sensor at 130 mm."""
    case = load_case("audit_strike")
    assert "displacement_quarter" in case.sensors
    found = candidate_sensors(case)
    assert "probe_displacement_fore" not in found
    assert {"probe_displacement_aft", "probe_displacement_side", "probe_strain_fore"} <= set(found)
    assert "probe_strain_centre" not in found


def test_a_cell_along_another_direction_does_not_stand_for_the_reaction_in_the_push() -> None:
    case, cell = load_case("reference_strike"), {"sensors": {"reaction_force": {"along": [0.0, 1.0, 0.0]}}}
    assert "probe_reaction_force" not in candidate_sensors(case)
    assert "probe_reaction_force" in candidate_sensors(case.overlaid(cell))


def test_candidate_sensors_lie_on_a_mesh_from_a_file_wherever_its_origin_is(tmp_path: Path) -> None:
    """Places counted from the origin were off a mesh that begins there, and ended the diagnosis with an error."""
    case = load_case(sheet_from_a_file(tmp_path, corner=0.0))
    found = candidate_sensors(case)
    assert found["probe_strain_centre"]["at"] == ["100 mm", "100 mm"]
    assert found["probe_displacement_corner"]["at"] == ["150 mm", "150 mm"]
    mesh = rest_mesh(case)
    assert not [
        line for name, sensor in with_candidate_sensors(case).sensors.items() for line in sensor.misplaced(name, mesh)
    ]


def test_a_candidate_sensor_off_the_outline_of_a_mesh_is_none(tmp_path: Path) -> None:
    """Of 3 x 3 shells an angle is left, along two sides."""
    table = sheet_from_a_file(tmp_path)
    mesh, gone = tmp_path / "plate.inp", ("5, 6,", "6, 7,", "8, 10,", "9, 11,")
    mesh.write_text("".join(line for line in mesh.read_text().splitlines(True) if not line.startswith(gone)))
    found = candidate_sensors(load_case(table))
    assert "probe_displacement_aft" in found
    assert "probe_displacement_corner" not in found


def test_candidate_sensors_on_a_turned_plate_lie_where_those_on_a_level_one_do(tmp_path: Path) -> None:
    """Places in plan were off the shells of an upright plate: it had no candidate but the reaction force."""
    found = {turn: with_candidate_sensors(strike(tmp_path, turn)) for turn in (0.0, 30.0, 90.0)}
    for turn in (30.0, 90.0):
        assert list(found[turn].sensors) == list(found[0.0].sensors)
        for name, level in found[0.0].sensors.items():
            sensor = found[turn].sensors[name]
            if name.startswith(PREFIX) and isinstance(level, Placed) and isinstance(sensor, Placed):
                assert sensor.point == pytest.approx(about_y(turn) @ [*level.at, 0.0], abs=1e-7)
                assert not list(sensor.misplaced(name, rest_mesh(found[turn])))
            if isinstance(sensor, Strain):
                assert sensor.along == pytest.approx(about_y(turn) @ [1.0, 0.0, 0.0])
    assert "probe_strain_side" in found[90.0].sensors
    assert "probe_displacement_centre" not in found[90.0].sensors
    words = described("probe_strain_fore", found[90.0].sensors["probe_strain_fore"], found[90.0])
    assert words.endswith(" at (0, 0, -50) mm from target.origin"), words
