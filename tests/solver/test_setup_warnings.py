"""What is said of a case before it is run: a mesh too coarse, a bird beside the plate, an instrument too late."""

from __future__ import annotations

import json
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.cli.frame import gravity
from birdstrike.data.paths import CASES, TEMPLATES
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.solver.case.case import load_case
from birdstrike.solver.setup_warnings import (
    MESH_LIMIT,
    coarse_mesh,
    plate_mesh_error,
    setup_warnings,
    share_beside_plate,
)
from birdstrike.solver.simulate import simulate
from tests.doe.stand_in import design, reference, strike

HEAD_ON = {"impact.angle": "90 deg"}
SMALL = {"bird.particles": "300", "plate.elements": "[12, 10]", "time.end": "0.4 ms", "time.snapshots": "[]"}


def told(command: str, settings: dict[str, str], out: Path) -> list[str]:
    """Warnings in the --json line of `check` or `simulate` of the reference strike."""
    options = [word for key, text in (SMALL | settings).items() for word in ("--set", f"{key}={text}")]
    where = ["--out", str(out)] if command == "simulate" else []
    result = CliRunner().invoke(app, [command, "reference_strike", "--json", *where, *options])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1])["warnings"]


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


@pytest.mark.parametrize("command", ["check", "simulate"])
@pytest.mark.parametrize(
    ("settings", "share"),
    [
        ({"plate.width": "80 mm", "plate.length": "300 mm"}, "14%"),
        (HEAD_ON | {"impact.offset": '["0 mm", "215 mm"]'}, "50%"),
    ],
)
def test_a_bird_that_flies_past_the_plate_in_part_is_told(
    command: str, settings: dict[str, str], share: str, tmp_path: Path
) -> None:
    (line,) = [line for line in told(command, settings, tmp_path) if "fly past the plate's edges" in line]
    assert line.startswith(f"{share} of the bird's cross-section")


COARSE = [
    ({"plate.elements": "[2, 2]"}, "plate.elements = [2, 2] is too coarse: expect an error of about 85%", "[8, 8]"),
    ({"plate.elements": "[3, 2]"}, "plate.elements = [3, 2] is too coarse: expect an error of about 85%", "[8, 8]"),
    ({"plate.elements": "[4, 30]"}, "plate.elements = [4, 30] is too coarse: expect an error of about 30%", "[8, 30]"),
    (
        {"bird.diameter": "30 mm", "bird.length": "60 mm", "bird.particles": "400"},
        "plate.elements = [12, 10] is too coarse: expect an error of about 11%",
        "[18, 15]",
    ),
    ({"bird.particles": "100"}, "bird.particles = 100 is too coarse: expect an error of about 5%", "300"),
]


@pytest.mark.parametrize("command", ["check", "simulate"])
@pytest.mark.parametrize(("settings", "start", "enough"), COARSE)
def test_a_mesh_too_coarse_is_told_with_the_error_to_expect(
    command: str, settings: dict[str, str], start: str, enough: str, tmp_path: Path
) -> None:
    (line,) = [line for line in told(command, settings, tmp_path) if "too coarse" in line]
    assert line.startswith(start)
    key = start.split(" ", 1)[0]
    assert f"set {key} = {enough} or" in line
    assert line.endswith("measure what is left with birdstrike converge")
    finer = {**SMALL, **settings, key: enough}
    assert coarse_mesh(load_case("reference_strike", finer)) == []


def test_the_error_to_expect_is_that_of_a_simulation() -> None:
    """Peaks of a short strike on four meshes against a finer one: within a factor of 2 where it is told, else small."""

    def peak(*elements: int) -> tuple[float, float]:
        settings = {"plate.elements": elements, "bird.particles": 300, "time.end": "2 ms"}
        case = load_case("synthetic_strike", settings)
        return float(simulate(case, threads=1).channels["displacement_centre"].max()), plate_mesh_error(case)

    fine, _ = peak(24, 20)
    for elements in ((2, 2), (3, 3), (20, 2)):
        found, expected = peak(*elements)
        assert 0.5 * expected < abs(found / fine - 1.0) < 2.0 * expected
        assert expected > MESH_LIMIT
    found, expected = peak(12, 10)
    assert abs(found / fine - 1.0) < expected < MESH_LIMIT


def test_a_campaign_on_a_coarse_mesh_says_so_before_its_runs(tmp_path: Path) -> None:
    said = list[str]()
    case = reference(plate__elements="[3, 2]")
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            case, design(8), tmp_path, workers=1, simulate=strike, executor=executor, say=said.append
        )  # fmt: skip
    assert said[0].startswith("plate.elements = [3, 2] is too coarse")


def test_a_coarse_mesh_is_graver_than_a_warning_about_intervals() -> None:
    (coarse,) = coarse_mesh(load_case("reference_strike", {"plate.elements": "[2, 2]"}))
    assert gravity(coarse) < gravity("the interval is widened")


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_an_instrument_later_than_the_run_is_told(command: str, tmp_path: Path) -> None:
    late = {"instrument.displacement_centre.time_offset": "8 ms"}
    (line,) = [line for line in told(command, late, tmp_path) if "time_offset" in line]
    assert line.startswith("instrument.displacement_centre.time_offset = 8 ms: first contact, at 0.169 ms, reaches")
    assert "no measurement of the impact" in line
    in_time = {"instrument.displacement_centre.time_offset": "0.1 ms"}
    assert not [line for line in told(command, in_time, tmp_path) if "time_offset" in line]
