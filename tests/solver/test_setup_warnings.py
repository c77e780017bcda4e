"""What is said of a case before it is run: a mesh too coarse, a bird beside the plate, an instrument too late."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.paths import CASES
from birdstrike.solver.case.case import load_case
from birdstrike.solver.setup_warnings import setup_warnings, share_beside_plate

HEAD_ON = {"impact.angle": "90 deg"}
SMALL = {"bird.particles": "300", "plate.elements": "[12, 10]", "time.end": "0.4 ms", "time.snapshots": "[]"}


def told(command: str, settings: dict[str, str], out: Path) -> list[str]:
    """Warnings in the --json line of `check` or `simulate` of the reference strike."""
    options = [word for key, text in (SMALL | settings).items() for word in ("--set", f"{key}={text}")]
    where = ["--out", str(out)] if command == "simulate" else []
    result = CliRunner().invoke(app, [command, "reference_strike", "--json", *where, *options])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1])["warnings"]


@pytest.mark.parametrize("case", sorted(path.stem for path in CASES.glob("*.toml")))
def test_nothing_is_said_of_a_shipped_case(case: str) -> None:
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


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_an_instrument_later_than_the_run_is_told(command: str, tmp_path: Path) -> None:
    late = {"instrument.displacement_centre.time_offset": "8 ms"}
    (line,) = [line for line in told(command, late, tmp_path) if "time_offset" in line]
    assert line.startswith("instrument.displacement_centre.time_offset = 8 ms: first contact, at 0.169 ms, reaches")
    assert "no measurement of the impact" in line
    in_time = {"instrument.displacement_centre.time_offset": "0.1 ms"}
    assert not [line for line in told(command, in_time, tmp_path) if "time_offset" in line]
