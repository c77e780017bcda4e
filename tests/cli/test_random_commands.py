"""Random command lines: each ends with exit code 0, 1 or 2 and without a traceback.

What would take long begins with an option that is refused; what a command makes stays in a folder of its own.
"""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
import tomli_w
import typer
from hypothesis import event, given
from hypothesis import strategies as st
from typer.testing import CliRunner

from birdstrike.cli.app import COMMANDS, app
from tests.fuzz import fuzzed
from tests.solver.case.random_keys import TINY, WORDS

FILES = {
    "tiny.toml": tomli_w.dumps(TINY).encode(),
    "garbage.toml": b"\xff\xfe\x00[[[",
    "empty.toml": b"",
    "record.csv": b"time [ms],w [mm]\n0,0\n0.02,0.1\n0.04,0.2\n0.06,0.3\n",
    "garbage.csv": b"\x00\x01;;;\n1,2,3\n",
    "empty.csv": b"",
    "loop/close_the_loop.json": b"{}",
    "campaign/design.csv": b"run\n1\n",
    "campaign/summary.json": b"[]",
    "broken/design.csv": b"",
    "broken/case.toml": b"[plate]\n",
    "inverted/inversion.json": b'{"methods": 3}',
}
NAMES = [
    *FILES,
    "loop",
    "campaign",
    "broken",
    "inverted",
    "demo",
    "table7_group5",
    "nowhere",
    "",
    ".",
    "..",
    "/dev/null",
]
CHEAP = ("new", "check", "simulate", "import", "export", "report")
OPTIONS = {
    "new": ["--json"],
    "check": ["--set"],
    "simulate": ["--set", "--noise", "--threads", "--fields", "--out"],
    "import": [
        "--sensor",
        "--unit",
        "--time",
        "--time-unit",
        "--node",
        "--scale",
        "--shift",
        "--simulated",
        "--out",
        "--rate",
        "--sigma",
        "--decimal",
        "--table",
        "--picture",
        "--zero",
        "--beside",
    ],
    "export": ["--to", "--out", "--units", "--method", "--case", "--deck", "--model", "--set"],
    "report": ["--out", "--doe", "--diagnosis", "--no-models"],
    "converge": ["--set", "--ratio", "--meshes", "--place"],
    "run-doe": ["--design", "--runs", "--seed", "--set", "--scheduler"],
    "train-and-invert": [
        "--measured",
        "--case",
        "--trainer",
        "--method",
        "--refine",
        "--filter",
        "--filtered",
        "--hidden",
        "--copies",
        "--discrepancy",
        "--mesh",
        "--mesh-correction",
    ],
    "compare-methods": ["--case", "--truths"],
    "diagnose": [
        "--measured",
        "--doe",
        "--heldout",
        "--alpha",
        "--set",
        "--channels",
        "--baseline",
        "--baseline-bird",
        "--refine",
    ],
    "audit": ["--experiments", "--draws", "--channels"],
    "close-the-loop": ["--measured", "--design", "--runs", "--seed", "--trainer"],
    "verify": ["--only", "--list"],
}
SETTINGS = [
    "time.end=1,5 ms",
    "time.end=0.004 ms",
    "plate.elements=[2,2]",
    "a=b=c",
    "=",
    "x",
    "bird.particles=1e9",
    "plate=[[[[",
]
WITHOUT_VALUE = ("--fields", "--simulated", "--zero", "--no-models", "--mesh-correction", "--deck", "--list", "--json")
VALUES = st.one_of(
    st.sampled_from([*NAMES, *(word for word in WORDS if not {"\x00", "/"} & set(word))]),
    st.sampled_from(SETTINGS),
    st.sampled_from(["0", "1", "-1", "2", "nan", "1e99", "w", "w=1", "w=w", "displacement_centre", "lm", "lsdyna"]),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x00/~."), max_size=6),
)
HARMLESS = {"verify": ["--only", "no_such_problem"], "audit": ["--experiments", "nowhere"]}
"""What a command that takes long even without a case begins with, so that it ends at once."""

GROUP: click.Group = typer.main.get_command(app)  # pyright: ignore[reportAssignmentType] (typer's own group is click's)
KNOWN = {
    name: {word: option for option in command.params for word in (*option.opts, *option.secondary_opts)}
    for name, command in GROUP.commands.items()
}
"""Command -> its options, as the application has them."""


@pytest.mark.parametrize("command", OPTIONS)
def test_the_options_that_are_drawn_exist(command: str) -> None:
    """Any other ends every line that has it as a usage error, and nothing behind it is tested."""
    for word in OPTIONS[command]:
        assert word in KNOWN[command], f"birdstrike {command} {word}"
        assert getattr(KNOWN[command][word], "is_flag", False) is (word in WITHOUT_VALUE)


@st.composite
def lines(draw: st.DrawFn) -> list[str]:
    """A command, its arguments, its options with values; of a command that takes long, a case that does not exist."""
    command = draw(st.sampled_from([*COMMANDS, *CHEAP, *CHEAP]))
    if command not in OPTIONS:
        return [command, draw(VALUES)]
    words = [command, *HARMLESS.get(command, [])]
    words += draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=2)) if command in CHEAP else ["nowhere"]
    for option in draw(st.lists(st.sampled_from(OPTIONS[command]), max_size=4)):
        words += [option] if option in WITHOUT_VALUE else [option, draw(VALUES)]
    if "--out" in KNOWN[command] and draw(st.booleans()):
        words += ["--out", draw(st.sampled_from(["made", "made/deeper", "record.csv", "campaign", "/dev/null/x"]))]
    return [*words, "--json"] if draw(st.booleans()) else words


@given(line=lines())
@fuzzed
def test_a_random_command_line_ends_without_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch, line: list[str]
) -> None:
    folder = tmp_path_factory.mktemp("fuzz")
    for name, content in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    monkeypatch.chdir(folder)
    ended = CliRunner().invoke(app, line)
    event(f"{line[0]}: {ended.exit_code}")
    assert ended.exception is None or isinstance(ended.exception, SystemExit), (line, ended.exception)
    assert ended.exit_code in (0, 1, 2), line
    assert Path(folder / "garbage.toml").read_bytes() == FILES["garbage.toml"]
    if "--json" in line and "--help" not in line and ended.stdout.strip():
        last = ended.stdout.strip().splitlines()[-1]
        assert not last.startswith("{") or json.loads(last)["schema_version"] == 1
