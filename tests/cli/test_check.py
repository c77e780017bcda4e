"""`birdstrike check`: all errors at once, or facts that agree with the formulas."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.cli.check import check, shown
from birdstrike.data.errors import CaseError
from birdstrike.solver.case.case import load_case
from tests.doe.external_case import written
from tests.solver.case.wrong_cases import raised

ROOT = Path(__file__).resolve().parents[2]
SMALL = ["--set", "bird.particles=300", "--set", "plate.elements=[12, 10]"]


def test_a_wrong_case_lists_all_its_errors_and_exits_with_1(tmp_path: Path) -> None:
    case = tmp_path / "mine.toml"
    case.write_text(
        'extends = "reference_strike"\n[plate]\nthicknes = "10 mm"\nwidth = "-4 mm"\n[impact]\nspeed = 91.1\n'
    )
    program = [sys.executable, "-m", "birdstrike", "check", str(case)]
    ended = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 1
    assert ended.stderr.splitlines() == [
        "case mine: 3 errors",
        "plate.width = -4 mm is outside 20 mm .. 5000 mm; without the minus sign?",
        "plate.thicknes is not a key of a case; did you mean thickness?",
        'impact.speed = 91.1 has no unit; write "91.1 m/s" (accepted units: m/s, mm/ms, km/h, kn)',
    ]
    assert ended.stdout == ""


def test_facts_follow_from_the_case() -> None:
    result = CliRunner().invoke(app, ["check", "reference_strike", "--json", *SMALL])
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout.splitlines()[-1])
    assert facts["mass"] == pytest.approx(1.8, abs=5e-4)
    assert facts["density"] == 900.0
    assert facts["normal_speed"] == pytest.approx(91.1 * math.sin(math.radians(30)))
    assert facts["shells"] == 120
    assert facts["particles"] == pytest.approx(300, rel=0.05)
    assert facts["steps"] == pytest.approx(3e-3 / facts["stable_step"], abs=1)
    assert facts["inactive"] == ["tension_erosion"]


def test_the_table_and_the_remarks_are_readable() -> None:
    result = CliRunner().invoke(
        app, ["check", "reference_strike", "--set", "time.end=0.1 ms", "--set", "time.snapshots=[]", *SMALL]
    )
    assert result.exit_code == 0, result.output
    assert "1.8 kg" in result.stdout
    assert "45.55 m/s" in result.stdout
    assert "bird.material.tension_erosion = 0.34 is inactive" in result.stdout
    assert "does not reach the plate before time.end" in result.stdout


def test_the_verb_takes_a_loaded_case_too() -> None:
    from birdstrike.solver.case.case import load_case

    case = load_case("reference_strike", {"bird.particles": "300", "plate.elements": "[12, 10]"})
    assert check(case)["shells"] == 120


def test_facts_are_shown_in_engineers_units() -> None:
    assert shown(2.5e-3, "s") == "2.5 ms"
    assert shown(1.2e-6, "s") == "1.2 us"
    assert shown(2591, "") == "2,591"
    assert shown(900.0, "kg/m^3") == "900 kg/m³"


def test_a_bird_of_hexahedra_has_elements() -> None:
    result = CliRunner().invoke(app, ["check", "reference_strike", "--set", "bird.method=hexahedra", *SMALL])
    assert result.exit_code == 0, result.output
    assert "│ elements" in result.stdout
    assert "particles" not in result.stdout.split("Next:")[0]


def test_a_bird_under_pressure_in_flight_is_told() -> None:
    law = 'bird.material.eos={kind="murnaghan", B="9.3 MPa", g=7.14, p0="0.1 MPa"}'
    result = CliRunner().invoke(app, ["check", "reference_strike", "--set", law, *SMALL])
    assert "set bird.material.eos.p0 to 0" in result.stdout


def test_the_verb_takes_a_table_and_lists_its_errors() -> None:
    table = {"extends": "reference_strike", "bird": {"particles": 300}, "plate": {"elements": [12, 10]}}
    assert isinstance(error := raised(lambda: check({"a": 1})), CaseError)
    assert "a is not a key of a case; did you mean" in str(error) or "a is not a key of a case; known" in str(error)
    assert check(table)["shells"] == 120


def test_a_case_of_another_solver_is_told_that_its_program_is_not_here(tmp_path: Path) -> None:
    case = written(tmp_path / "case")
    command = ["check", str(case), "--json", "--set"]
    missing = CliRunner().invoke(app, [*command, 'external.command=["no_such_solver", "{input}"]'])
    assert missing.exit_code == 0, missing.output
    told = json.loads(missing.stdout.splitlines()[-1])
    assert 'no program "no_such_solver" can be run on this machine' in str(told.get("warnings"))
    assert told["program"] is None
    assert "Next: birdstrike simulate" not in missing.stdout
    found = CliRunner().invoke(app, ["check", str(case), "--json"])
    assert json.loads(found.stdout.splitlines()[-1])["warnings"] == []
    assert "Next: birdstrike simulate" in found.stdout


def test_a_case_of_another_solver_is_told_that_its_scratch_folder_is_not_here(tmp_path: Path) -> None:
    scratch = f"external.scratch={tmp_path / 'missing'}"
    found = CliRunner().invoke(app, ["check", str(written(tmp_path / "case")), "--json", "--set", scratch])
    told = json.loads(found.stdout.splitlines()[-1])
    assert 'missing" is no folder that can be written on this machine' in told["warnings"][0]


def test_a_bird_of_one_row_of_particles_is_the_user_s_error() -> None:
    """Thin and long, of the fewest particles: it would have no width at all."""
    thin = ("bird.length=3 m", "bird.diameter=60 mm", "bird.particles=100", "plate.elements=[12, 10]")
    result = CliRunner().invoke(app, ["check", "reference_strike", *(w for text in thin for w in ("--set", text))])
    assert result.exit_code == 1
    assert "bird.particles = 100 makes a single row of particles in a bird of 60 mm in diameter" in result.stderr


def test_the_python_verb_checks_the_template_and_states_no_steps_of_another_solver(tmp_path: Path) -> None:
    case = written(tmp_path / "case")
    facts = check(case)
    assert facts["solver_version"] == "external: oscillator 1"
    assert facts["mass"] == pytest.approx(case_mass(case))
    assert "plate_thickness" in facts["effects"]
    assert facts["not_carried"]["bird_friction"] == "the deck has no place for impact.friction"
    assert not {"steps", "stable_step", "estimated_wall_s", "shells"} & facts.keys()
    deck = case.parent / "strike.k.j2"
    deck.write_text(deck.read_text() + "$ {{ viscosty }}\n")
    with pytest.raises(CaseError, match="'viscosty' is undefined; a template may name the whole keys of the case"):
        check(case)


def case_mass(case: Path) -> float:
    """A cylinder with round ends, as the case's shape is by default [kg]."""
    bird = load_case(case).bird
    return 950.0 * bird.volume
