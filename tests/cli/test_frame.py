"""What all commands share: exit codes, error lines without a traceback, the JSON line, the progress bar."""

from __future__ import annotations

import json as json_format
import warnings
from collections.abc import Callable
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from birdstrike.cli import frame
from birdstrike.cli.frame import framed, progress_bar, say, warn
from birdstrike.cli.options import Json, names_of, overrides
from birdstrike.data.errors import CaseError, MachineFailure, RunFailed, UserError


def ends(action: Callable[[], dict[str, Any] | None], *arguments: str) -> Any:
    """Result of a command that does `action`."""
    app = typer.Typer(pretty_exceptions_enable=False)

    @app.command()
    @framed
    def command(json: Json = False) -> dict[str, Any] | None:  # noqa: ARG001
        return action()

    return CliRunner().invoke(app, list(arguments))


def test_a_list_that_names_nothing_is_refused_by_its_option() -> None:
    assert names_of("a, b,") == ("a", "b")
    with pytest.raises(UserError, match='--models "," names nothing; give names with commas between, such as null'):
        names_of(",", "--models", "null,elastic")


def raising(error: BaseException) -> Callable[[], None]:
    def action() -> None:
        raise error

    return action


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (
            CaseError(["a = 1 is [wrong]", "b is missing"], "two errors"),
            1,
            "two errors\na = 1 is [wrong]\nb is missing\n",
        ),
        (RunFailed("the run is unstable", "lower solver.courant"), 2, "the run is unstable\nlower solver.courant\n"),
        (KeyboardInterrupt(), 130, "interrupted; run the same command again to resume\n"),
        (OSError(28, "No space left", "/x/y"), 2, "cannot write /x/y: disk full; free space and run again to resume\n"),
        (OSError(27, "File too large"), 2, "cannot write: disk full; free space and run again to resume\n"),
        (PermissionError(13, "Permission denied", "/x/y"), 1, "/x/y: Permission denied\n"),
        (OSError(24, "Too many open files"), 2, "Too many open files\nrun the same command again\n"),
        (OSError("no [answer]"), 2, "no [answer]\nrun the same command again\n"),
    ],
)
def test_each_ending_has_its_code_and_its_lines_and_no_traceback(error: BaseException, code: int, text: str) -> None:
    result = ends(raising(error))
    assert result.exit_code == code
    assert result.stderr == text
    assert result.stdout == ""


def test_json_is_the_last_line_also_of_a_failure() -> None:
    result = ends(lambda: {"rmse": 0.5, "bad": float("nan")}, "--json")
    assert json_format.loads(result.stdout.splitlines()[-1]) == {"schema_version": 1, "rmse": 0.5, "bad": None}
    failed = ends(raising(RunFailed("unstable", "lower it")), "--json")
    assert json_format.loads(failed.stdout.splitlines()[-1]) == {
        "schema_version": 1,
        "exit_code": 2,
        "errors": ["unstable"],
        "remedy": "lower it",
    }


def test_a_warning_is_one_plain_line_without_its_source() -> None:
    result = ends(lambda: warnings.warn("run [3] is damaged", stacklevel=1))
    assert result.exit_code == 0
    assert result.stderr == "warning: run [3] is damaged\n"


SEVEN = [
    "the model cannot produce this curve",
    "the sampler has not converged: R-hat 1.2",
    "the network's inputs lie outside what it was trained on",
    "the noise of a sensor is not stated",
    "sensors.centre is named twice",
    "one point was taken out",
    "a unit was assumed",
]
"""Of one result, in its order."""


def test_of_many_warnings_the_first_five_are_shown_and_all_are_in_the_json() -> None:
    def warned() -> dict[str, list[str]]:
        warn([*SEVEN, SEVEN[0]], "inversion.json")
        return {"warnings": SEVEN}

    *told, more, line = ends(warned, "--json").stdout.splitlines()
    assert told == [f"warning: {one}" for one in SEVEN[:5]]
    assert more == "2 more warnings in inversion.json"
    assert json_format.loads(line)["warnings"] == SEVEN


def test_warnings_given_on_the_way_are_capped_and_kept_for_the_json() -> None:
    def warned() -> None:
        for number in range(7):
            warnings.warn(f"run {number} is damaged", stacklevel=1)

    result = ends(warned, "--json")
    lines = result.stderr.splitlines()
    assert lines[:5] == [f"warning: run {number} is damaged" for number in range(5)]
    assert lines[5:] == ["2 more warnings in the output of --json"]
    assert len(json_format.loads(result.stdout.splitlines()[-1])["warnings"]) == 7


def test_warnings_of_the_result_and_on_the_way_share_the_five_lines_in_turn() -> None:
    """Three damaged runs, one of them named twice, do not hide what makes the result void."""

    def warned() -> dict[str, list[str]]:
        for number in range(3):
            warnings.warn(f"run {number} is damaged", stacklevel=1)
        warnings.warn("run 2 is damaged", stacklevel=1)
        warn([*SEVEN[:4], "run 0 is damaged"], "inversion.json")
        say("Next: birdstrike report")
        return {"warnings": SEVEN[:4]}

    result = ends(warned, "--json")
    *told, following, line = result.stdout.splitlines()
    assert told == [*(f"warning: {one}" for one in SEVEN[:3]), "2 more warnings in inversion.json"]
    assert result.stderr.splitlines() == ["warning: run 1 is damaged", "warning: run 2 is damaged"]
    assert following == "Next: birdstrike report"
    assert json_format.loads(line)["warnings"] == [*SEVEN[:4], *(f"run {number} is damaged" for number in range(3))]


def test_three_and_four_warnings_leave_two_that_are_counted() -> None:
    def warned() -> None:
        for number in range(3):
            warnings.warn(f"run {number} is damaged", stacklevel=1)
        warn(SEVEN[:2] + SEVEN[5:], "summary.json")

    lines = ends(warned).output.splitlines()
    assert sum(line.startswith("warning: ") for line in lines) == 5
    assert lines[-1] == "2 more warnings in the output of --json and summary.json"


def test_what_follows_a_result_has_the_room_that_is_left() -> None:
    def warned() -> None:
        warn(SEVEN[:4], "summary.json")
        for number in range(3):
            warnings.warn(f"run {number} is damaged", stacklevel=1)

    result = ends(warned)
    assert len(result.stdout.splitlines()) == 4
    assert result.stderr.splitlines() == ["warning: run 0 is damaged", "2 more warnings in the output of --json"]


def test_a_failure_shows_and_keeps_what_was_given_before_it() -> None:
    def warned() -> None:
        warnings.warn("run 3 is damaged", stacklevel=1)
        raise RunFailed("unstable", "lower it")

    result = ends(warned, "--json")
    assert result.stderr.splitlines() == ["warning: run 3 is damaged", "unstable", "lower it"]
    assert json_format.loads(result.stdout)["warnings"] == ["run 3 is damaged"]


def test_memory_and_the_machine_end_a_command_as_a_failed_run_does() -> None:
    for error in (MemoryError(), MachineFailure("killed by signal 9")):
        result = ends(raising(error))
        assert result.exit_code == 2
        assert "Traceback" not in result.output


def test_without_json_there_is_no_json() -> None:
    assert ends(lambda: {"rmse": 0.5}).stdout == ""


def test_a_programmers_mistake_is_not_dressed_up_as_the_users() -> None:
    with pytest.raises(ZeroDivisionError):
        raise ends(raising(ZeroDivisionError())).exception


def test_overrides_are_split_at_the_first_sign() -> None:
    assert overrides(["a.b = 8 mm", "c=x=y"]) == {"a.b": "8 mm", "c": "x=y"}
    with pytest.raises(UserError, match="--set thickness"):
        overrides(["thickness"])


class Clock:
    """A clock that moves when told."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.mark.parametrize(("seconds", "shown"), [(1.0, False), (20.0, True)])
def test_a_bar_appears_only_for_work_of_over_two_seconds(monkeypatch, seconds: float, shown: bool) -> None:
    clock = Clock()
    monkeypatch.setattr(frame, "time", clock)
    monkeypatch.setattr(frame, "errors", frame.Console(stderr=True, force_terminal=True, width=80))
    started: list[bool] = []
    monkeypatch.setattr(frame.Progress, "start", lambda _: started.append(True))
    with progress_bar("strike") as advance:
        for step in range(101):
            clock.now = seconds * step / 100
            advance(step / 100)
    assert bool(started) is shown


def test_off_a_terminal_progress_is_a_plain_line_now_and_then(monkeypatch, capsys) -> None:
    clock = Clock()
    monkeypatch.setattr(frame, "time", clock)
    with progress_bar("strike") as advance:
        for step in range(101):
            clock.now = 0.4 * step
            advance(step / 100)
    assert capsys.readouterr().err == "strike: 38%\nstrike: 76%\n"
