"""What the documentation's build adds: equations, tables from the code, docstrings, sessions of a terminal."""

from __future__ import annotations

import importlib
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest
import typer

from birdstrike.cli.app import COMMANDS, app
from tests.docs.pages import PAGES, ROOT, blocks

GROUP: click.Group = typer.main.get_command(app)  # pyright: ignore[reportAssignmentType] (typer's own group is click's)


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Imports a script of docs/, which is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module


def test_tables_hold_every_command_and_every_unit_system(module: Any) -> None:
    tables = module("build_pages")
    source = ["<!-- commands -->\n<!-- units -->"]
    tables.fill(None, "page", source)
    for name in COMMANDS:
        assert f"## birdstrike {name}\n" in source[0]
    assert "| `mm-ms-kg-GPa` | mm, ms, kg; hence stress GPa" in source[0]
    assert "`--measured`" in source[0]


def test_docstrings_keep_their_code_and_lose_no_character(module: Any) -> None:
    lines = ["*MAT_NULL of `a|b`: |x| and c_ and d_e"]
    module("docstrings").as_restructured_text(None, "function", "f", None, None, lines)
    assert lines == [r"\*MAT\_NULL of ``a|b``: \|x\| and c\_ and d_e".replace(r"MAT\_NULL", "MAT_NULL")]


def test_a_session_is_put_where_a_page_asks_for_it(module: Any) -> None:
    sessions = module("make_session")
    page = "a\n<!-- session loop -->\nold\n<!-- /session -->\nb\n<!-- session demo -->\n<!-- /session -->\n"
    assert sessions.inserted(page, "loop", "$ x") == page.replace("old\n", "```text\n$ x\n```\n")
    assert sessions.folded("a" * 100) == ["a" * 100]
    assert sessions.folded(f"{'a' * 99} b c") == ["a" * 99, "  b c"]


def test_a_session_is_what_the_commands_print(module: Any) -> None:
    text = module("make_session").session(["birdstrike new shot", "head -1 shot.toml"])
    assert text.splitlines() == [
        "$ birdstrike new shot",
        "Written to shot.toml; put your shot's values in. Next: birdstrike check shot.toml",
        "$ head -1 shot.toml",
        "# shot: one shot, to be calibrated.",
    ]
    with pytest.raises(subprocess.CalledProcessError):
        module("make_session").session(["birdstrike check no_such_case"])


def test_the_sessions_shown_are_of_todays_commands(module: Any) -> None:
    """Each command of a session stands in the captured text, parses today, and no session shows a failure."""
    sessions = module("make_session").SESSIONS
    shown = {page.name: "\n".join(b.text for b in blocks(page) if b.text.startswith("$ ")) for page in PAGES}
    for commands in sessions.values():
        for command in commands:
            assert f"$ {command}\n" in shown["sessions.md"]
            if command.startswith("birdstrike"):
                name, *arguments = shlex.split(command.replace("\\\n", " "))[1:]
                with GROUP.commands[name].make_context(name, arguments) as context:
                    assert context.params
    assert "Traceback" not in "".join(shown.values())


def test_the_tour_of_the_first_page_leads_from_a_record_to_cards_and_quotes_the_captured_session() -> None:
    """Its commands, and the figures that the page quotes."""
    tour = [words[0] for block in blocks(ROOT / "README.md") if block.slow for words in block.commands]
    assert tour == ["new", "simulate", "import", "start", "export"]
    (quoted,) = re.findall(r"finds (\d+) Pa s \(95 %: (\d+) to (\d+) Pa s\)", (ROOT / "README.md").read_text("utf-8"))
    session = " ".join((ROOT / "docs" / "sessions.md").read_text("utf-8").split())
    assert "viscosity MU {} Pa s (95 %: {} Pa s to {} Pa s)".format(*quoted) in session


def test_the_documentation_builds_without_a_warning(tmp_path: Path) -> None:
    """One page through the strict build of `make docs`, whose whole run belongs to `make check`."""
    for name in ("conf.py", "build_math.py", "build_pages.py", "docstrings.py"):
        (tmp_path / name).write_bytes((ROOT / "docs" / name).read_bytes())
    (tmp_path / "index.md").write_text("# Page\n\n$$ p = \\rho_0 C^2 \\mu $$\n\nand $x$.\n\n<!-- units -->\n")
    program = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from sphinx.cmd.build import main; sys.exit(main())"
    strictly = ("--quiet", "--fail-on-warning", "-b", "html", str(tmp_path), str(tmp_path / "site"))
    ended = subprocess.run(
        [sys.executable, "-c", program, *strictly], capture_output=True, text=True, timeout=120, check=False
    )
    assert ended.returncode == 0, ended.stderr
    page = (tmp_path / "site" / "index.html").read_text()
    assert page.count("<math") == 2
    assert "mm-ms-kg-GPa" in page


def test_the_links_of_the_pages_at_the_root_lead_somewhere() -> None:
    """Sphinx looks after those inside docs/."""
    for page in (ROOT / "README.md", ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md"):
        targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        assert [target for target in targets if not (ROOT / target).exists()] == []
