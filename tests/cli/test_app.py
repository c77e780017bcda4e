"""The command as a whole: its help, what it loads, and who may stand in its way."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import birdstrike
from birdstrike.cli.app import COMMANDS, app, main, module_of

ROOT = Path(__file__).resolve().parents[2]
HEAVY = ("numpy", "torch", "matplotlib", "numba", "scipy", "sklearn", "pandas", "pint", "h5py")


def in_python(program: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """A fresh interpreter that sees this birdstrike."""
    start = f"import sys; sys.path.append({str(ROOT)!r})\n"
    return subprocess.run(
        [sys.executable, "-c", start + program], cwd=cwd, capture_output=True, text=True, timeout=60, check=False
    )


def test_help_names_every_command() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert result.exit_code == 0
    assert [name for name in COMMANDS if name not in result.stdout] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_an_example(name: str) -> None:
    result = CliRunner().invoke(app, [name, "--help"])
    assert result.exit_code == 0
    assert f"birdstrike {name}" in " ".join(result.stdout.split())
    assert "--json" in result.stdout


def test_a_word_that_is_no_choice_is_told_in_plain_words() -> None:
    result = CliRunner().invoke(app, ["export", "reference_strike", "--to", "foo"])
    said = " ".join(result.output.replace("│", " ").split())
    assert result.exit_code == 1
    assert "Invalid value for '--to': 'foo' is not one of 'lsdyna', 'radioss'." in said


def test_a_second_record_is_refused_by_a_command_that_takes_one() -> None:
    """`close-the-loop CASE --measured a.csv --measured b.csv` answered for b.csv alone."""
    words = ["--measured", "nowhere_1.csv", "--measured", "nowhere_2.csv", "--out", "nowhere"]
    refused = CliRunner().invoke(app, ["close-the-loop", "demo_rig", *words])
    said = " ".join(refused.output.replace("│", " ").split())
    assert refused.exit_code == 1
    assert "--measured was given 2 times, and close-the-loop takes one" in said
    several = CliRunner().invoke(app, ["diagnose", "demo_rig", *words])
    assert several.exit_code == 1
    assert "nowhere_1.csv" in several.output


def test_asking_for_help_loads_nothing_heavy() -> None:
    ended = in_python(
        f"from birdstrike.cli.app import app\ntry: app(['--help'])\nexcept SystemExit: pass\n"
        f"print('LOADED', [name for name in {HEAVY!r} if name in sys.modules])"
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.strip().endswith("LOADED []")


def test_reading_a_shipped_case_needs_no_library_of_units() -> None:
    """Its import is a tenth of a short command; every unit of the shipped cases stands in `units.SIZES`."""
    ended = in_python(
        "from birdstrike.solver.case.case import load_case\n"
        "for name in ('reference_strike', 'sidewall_004', 'flat_plate_002', 'demo_rig'): load_case(name)\n"
        "print('LOADED', [name for name in sys.modules if name == 'pint'])"
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.strip().endswith("LOADED []")


def test_the_python_verbs_have_the_commands_names() -> None:
    assert {module_of(name) for name in COMMANDS} <= set(birdstrike.__all__)
    for name in birdstrike.__all__:
        assert callable(getattr(birdstrike, name))
    with pytest.raises(AttributeError, match="birdstrike has no invert"):
        birdstrike.__getattr__("invert")


PACKAGES = ("data", "solver", "doe", "surrogate", "inversion", "reports")


def test_a_users_folders_with_the_names_of_the_packages_are_no_obstacle(tmp_path: Path) -> None:
    for name in PACKAGES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit(3)")
    imports = "\n".join(f"import birdstrike.{name}" for name in PACKAGES)
    assert in_python(f"{imports}\nfrom birdstrike import load_case; load_case('demo')", cwd=tmp_path).returncode == 0


def test_a_users_files_with_the_names_of_the_packages_are_no_obstacle(tmp_path: Path) -> None:
    for name in PACKAGES:
        (tmp_path / f"{name}.py").write_text("raise SystemExit(3)")
    assert in_python("import birdstrike; birdstrike.load_case('demo')", cwd=tmp_path).returncode == 0


def test_an_unknown_command_is_the_users_error() -> None:
    result = CliRunner().invoke(app, ["simulat"])
    assert result.exit_code == 1
    assert "simulate" in result.output


def test_a_missing_option_is_the_users_error() -> None:
    result = CliRunner().invoke(app, ["simulate", "demo"])
    assert result.exit_code == 1
    assert "--out" in result.output


UNREADABLE = [
    (["simulate", "demo", "--json"], "Missing option '--out'"),
    (["train-and-invert", "x", "--measured", "m", "--out", "o", "--trainer", "foo", "--json"], "'foo' is not one of"),
]


@pytest.mark.parametrize(("arguments", "why"), UNREADABLE)
def test_a_command_line_that_cannot_be_read_has_its_json_line_too(monkeypatch, capsys, arguments, why: str) -> None:
    monkeypatch.setattr(sys, "argv", ["birdstrike", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    shown = capsys.readouterr()
    assert ended.value.code == 1
    assert "Usage" in shown.err
    (line,) = shown.out.splitlines()
    assert json.loads(line)["exit_code"] == 1
    assert why in json.loads(line)["errors"][0]


def test_without_json_an_unreadable_command_line_prints_no_json(monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["birdstrike", "simulate", "demo"])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().out == ""


def test_a_terminal_that_lacks_a_character_shows_another(tmp_path: Path) -> None:
    program = (
        "import sys; sys.argv = ['birdstrike', 'check', 'Dömö', '--json']\nfrom birdstrike.cli.app import main\nmain()"
    )
    start = f"import sys; sys.path.append({str(ROOT)!r})\n"
    ended = subprocess.run(
        [sys.executable, "-c", start + program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii:strict"},
    )
    assert ended.returncode == 1
    assert '"D?m?" is no case here' in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.parametrize("module", ["typer", "birdstrike.cli.diagnose", "birdstrike.solver.case.case", "numba"])
def test_ctrl_c_while_modules_load_ends_without_a_traceback(module: str) -> None:
    """The interrupt comes in the middle of an import, before a command has begun or in it."""
    ended = in_python(
        "import importlib.abc, os, runpy, signal\n"
        "class Interrupted(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupted())\n"
        "sys.argv = ['birdstrike', 'check', 'demo']\n"
        "runpy.run_module('birdstrike', run_name='__main__', alter_sys=True)"
    )
    assert "Traceback" not in ended.stderr
    assert ended.stderr.startswith("interrupted")
    assert ended.returncode in (130, -2)  # numba answers the signal itself, too


def test_a_setting_without_its_sign_is_named_and_not_what_follows_it() -> None:
    found = CliRunner().invoke(app, ["check", "demo_rig", "--set", "plate.thickness", "8", "mm"])
    assert found.exit_code == 1
    assert "--set plate.thickness: write --set key=value" in found.output
