"""Commands warn of what spoils the answer of a valid case: a coarse mesh, a bird beside the plate, late instruments."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.doe.campaign.campaign import run_campaign
from tests.doe.stand_in import design, reference, strike

HEAD_ON = {"impact.angle": "90 deg"}
SMALL = {"bird.particles": "300", "plate.elements": "[12, 10]", "time.end": "0.4 ms", "time.snapshots": "[]"}


def told(command: str, settings: dict[str, str], out: Path) -> list[str]:
    """Warnings in the --json line of `check` or `simulate` of the reference strike."""
    options = [word for key, text in (SMALL | settings).items() for word in ("--set", f"{key}={text}")]
    where = ["--out", str(out)] if command == "simulate" else []
    result = CliRunner().invoke(app, [command, "reference_strike", "--json", *where, *options])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout.splitlines()[-1]).get("warnings", [])


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
    assert any(
        line.startswith(f"{share} of the bird's cross-section fly past the plate's edges")
        for line in told(command, settings, tmp_path)
    )


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
    found = [line for line in told(command, settings, tmp_path) if "too coarse" in line]
    assert [line[: len(start)] for line in found] == [start]
    assert f"set {start.split(' ', 1)[0]} = {enough} or" in found[0]
    assert found[0].endswith("measure what is left with birdstrike converge")


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_an_instrument_later_than_the_run_is_told(command: str, tmp_path: Path) -> None:
    late = {"instrument.displacement_centre.time_offset": "8 ms"}
    start = "instrument.displacement_centre.time_offset = 8 ms: first contact, at 0.169 ms, reaches its record after"
    assert any(line.startswith(start) and "no measurement" in line for line in told(command, late, tmp_path))
    in_time = {"instrument.displacement_centre.time_offset": "0.1 ms"}
    assert not [line for line in told(command, in_time, tmp_path) if "time_offset" in line]


def test_a_campaign_on_a_coarse_mesh_says_so_before_its_runs(tmp_path: Path) -> None:
    said = list[str]()
    case = reference(plate__elements="[3, 2]")
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            case, design(8), tmp_path, workers=1, simulate=strike, executor=executor, say=said.append
        )  # fmt: skip
    assert said[0].startswith("plate.elements = [3, 2] is too coarse")
