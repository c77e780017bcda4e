"""Every block of code in README.md and docs/ does what it says: cases load, commands run, Python runs."""

from __future__ import annotations

import importlib
import re
import shlex
from pathlib import Path
from typing import Any

import click
import pytest
import typer
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.solver.case.case import load_case
from tests.docs.pages import PAGES, ROOT, SHOWN, Block, blocks

GROUP: click.Group = typer.main.get_command(app)  # pyright: ignore[reportAssignmentType] (typer's own group is click's)
ELSEWHERE = ("make", ".", "python", "pip", "cd")
"""Words that begin a line of a shell block that is no command of birdstrike."""


def place(block: Block) -> str:
    return f"{block.page.name}, line {block.line}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_blocks_of_a_page_work_one_after_the_other(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("birdstrike.solver.effects.registry.EFFECTS.own", {})  # what a page registers is gone with it
    names: dict[str, Any] = {"__name__": "page"}
    for block in blocks(page):
        if block.title:
            (tmp_path / block.title).write_text(block.text, encoding="utf-8")
        if block.language == "python":
            exec(compile(block.text, place(block), "exec"), names)
        elif block.language == "toml":
            check_case(block, tmp_path)
        elif block.language == "bash":
            check_commands(block)
        else:
            assert block.language == SHOWN, f"{place(block)}: nothing checks a block of {block.language}"


def check_case(block: Block, folder: Path) -> None:
    """A part of a case is one over the reference strike; a file that is there to be wrong is shown by its name."""
    if block.title.startswith("wrong"):
        return
    path = folder / (block.title or "part.toml")
    if not block.title:
        extends = "" if "extends" in block.text else 'extends = "reference_strike"\n'
        path.write_text(extends + block.text, encoding="utf-8")
    load_case(path)


def check_commands(block: Block) -> None:
    """Commands run, or where they cost minutes are at least ones that exist with all of their options."""
    for line in block.lines:
        first = (line.split() or ["#"])[0]
        assert first.startswith(("birdstrike", "#")) or first in ELSEWHERE, f"{place(block)}: {line}"
    for name, *arguments in block.commands:
        if name.startswith("-"):
            continue  # the application's own options
        if block.slow:
            with GROUP.commands[name].make_context(name, list(arguments)):
                pass
        else:
            found = CliRunner().invoke(app, [name, *arguments])
            assert found.exit_code == 0, f"{place(block)}: birdstrike {name}\n{found.output}"


def test_indented_command_lines_parse() -> None:
    """Lines outside of the blocks name files of the reader's own: they are not run, but their options exist."""
    lines = [line for page in PAGES for line in re.findall(r"^ {4}birdstrike (\w.*)$", page.read_text("utf-8"), re.M)]
    assert lines
    for name, *arguments in (shlex.split(line, comments=True) for line in lines):
        with GROUP.commands[name].make_context(name, arguments):
            pass


def test_the_pages_hold_blocks_of_every_kind() -> None:
    """Guards the reading of the pages: a fence that nobody finds is a test that cannot fail."""
    found = [block for page in PAGES for block in blocks(page)]
    assert any(block.slow for block in found)
    assert {"python", "toml", "bash", "text"} <= {block.language for block in found}
    assert sum(page.read_text(encoding="utf-8").count("\n```") for page in PAGES) - fences_of_sphinx() == 2 * len(found)


def fences_of_sphinx() -> int:
    """Ends and beginnings of directives, ```{name}, which the build itself checks."""
    return 2 * sum(page.read_text(encoding="utf-8").count("\n```{") for page in PAGES)


def test_docs_run_executes_blocks_as_they_stand_and_says_which_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The script of `make docs-run` on two pages: a pipe, a slow block and Python run; a wrong command is named."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    script = importlib.import_module("run_commands")
    right, wrong = tmp_path / "right.md", tmp_path / "wrong.md"
    right.write_text(
        '```text title="a.txt"\nhello\n```\n\n<!-- slow -->\n```bash\ncat a.txt | tr a-z A-Z > b.txt\n```\n\n'
        '```python\nassert open("b.txt").read() == "HELLO\\n"\n```\n\n    birdstrike diagnose CASE --measured my.csv\n'
    )
    wrong.write_text("```bash\nbirdstrike no-such-command\n```\n")
    monkeypatch.setattr(script, "PAGES", (right, wrong))
    assert script.main([]) == 1
    said = capsys.readouterr().out
    assert "right.md, line 5: ran" in said
    assert "wrong.md, line 1: FAILED" in said
    assert "1 indented lines are shown" in said
    assert "1 blocks failed: wrong.md, line 1" in said
    monkeypatch.setattr(script, "PAGES", (right,))
    assert script.main([]) == 0
