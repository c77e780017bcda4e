"""Every command, whatever it does: an example that parses, --json, exit codes, no traceback, completion."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
import typer
from typer.testing import CliRunner, Result

from birdstrike.cli.app import COMMANDS, app

ROOT = Path(__file__).resolve().parents[2]
GROUP: click.Group = typer.main.get_command(app)  # pyright: ignore[reportAssignmentType] (typer's own group is click's)
NOWHERE = "no_such_thing_here"


def example(name: str) -> list[str]:
    """Arguments of the example in a command's help."""
    found = re.search(rf"Example: birdstrike {name} ?(.*)", GROUP.commands[name].help or "")
    assert found, f"birdstrike {name} --help has no example"
    return shlex.split(found[1])


def further_examples() -> list[list[str]]:
    """Every other command line of a help: `With a limit: birdstrike predict ...`."""
    texts = [GROUP.commands[name].help or "" for name in COMMANDS]
    return [shlex.split(line) for text in texts for line in re.findall(r"^(?!Example).+: birdstrike (.+)$", text, re.M)]


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments, env={"COLUMNS": "200"})


def test_the_application_has_exactly_the_listed_commands() -> None:
    assert tuple(GROUP.commands) == COMMANDS


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_is_a_command_line_that_parses(name: str) -> None:
    with GROUP.commands[name].make_context(name, example(name)) as context:
        assert context.params


@pytest.mark.parametrize("words", further_examples(), ids=" ".join)
def test_a_further_example_is_a_command_line_that_parses(words: list[str]) -> None:
    name, *arguments = words
    with GROUP.commands[name].make_context(name, arguments) as context:
        assert context.params


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_one_sentence_and_every_option_is_explained(name: str) -> None:
    command = GROUP.commands[name]
    assert re.match(r"[A-Z][^\n]+[.:]", command.help or "")
    unexplained = [p.name for p in command.params if not getattr(p, "help", "") and p.name != "help"]
    assert unexplained == []
    assert "--json" in [option for p in command.params for option in p.opts]


@pytest.mark.parametrize("name", COMMANDS)
def test_an_ending_by_error_or_ctrl_c_goes_through_the_frame(name: str) -> None:
    """The frame, which has tests of its own, is what turns exceptions and Ctrl-C into lines and exit codes."""
    callback = GROUP.commands[name].callback
    framed = getattr(callback, "__wrapped__", callback)  # typer wraps the frame, the frame the command
    assert framed is not None
    assert hasattr(framed, "__wrapped__"), f"birdstrike {name} is not framed"


def broken(name: str, folder: Path) -> list[str]:
    """The command's example with its first argument, or its patterns, replaced by what does not exist."""
    if name == "new":
        (folder / "taken.toml").write_text("")
        return ["taken"]
    if name == "verify":
        return ["--only", NOWHERE]
    if name == "audit":
        return ["--experiments", NOWHERE, *example(name)]
    return [NOWHERE, *example(name)[1:]]


@pytest.mark.parametrize("name", COMMANDS)
def test_what_does_not_exist_is_the_users_error_in_plain_words(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 1, a line that names it, a last line of JSON, no traceback, and nothing written."""
    monkeypatch.chdir(tmp_path)
    found = invoke(name, *broken(name, tmp_path), "--json")
    assert found.exit_code == 1, found.output
    assert isinstance(found.exception, SystemExit)
    assert "Traceback" not in found.output
    last = json.loads(found.stdout.splitlines()[-1])
    assert last["exit_code"] == 1
    assert any(word in " ".join(last["errors"]) for word in (NOWHERE, "taken"))
    assert [path.name for path in tmp_path.iterdir()] in ([], ["taken.toml"])


def complete(words: str) -> list[str]:
    """What bash would offer after these words."""
    program = "import sys; sys.argv = ['birdstrike']; from birdstrike.cli.app import main; main()"
    asked = {"_BIRDSTRIKE_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    environment = {**os.environ, **asked, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.split()


def test_the_shell_completes_commands_options_and_unit_systems() -> None:
    assert set(complete("birdstrike ex")) == {"explore", "export"}
    assert "--measured" in complete("birdstrike close-the-loop --m")
    assert "mm-ms-kg-GPa" in complete("birdstrike export loop --units ")
