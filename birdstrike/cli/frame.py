"""What every command has in common: exit codes, error lines, warnings, the --json line, the progress bar."""

from __future__ import annotations

import errno
import functools
import json
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any, NamedTuple, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from birdstrike.data.errors import MachineFailure, RunFailed, Terminated, UserError
from birdstrike.data.formatting import listing, many

console = Console(highlight=False, soft_wrap=True)
errors = Console(stderr=True, highlight=False, soft_wrap=True)

INTERRUPTED = 130
LONG_S = 2.0
SETTLING_S = 0.3
PLAIN_EVERY_S = 15.0
DISK_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system answers when nothing more can be written: no space, no quota, no larger file."""

MOST_WARNINGS = 5
"""On the terminal, in all of a command; --json and the files of the command keep every one."""

HEARD = "the output of --json"
"""What holds the warnings that were given on the way to a result."""


def say(text: str = "") -> None:
    """One line of plain text for the user; square brackets stay what they are."""
    console.print(escape(text))


@dataclass
class _Warnings:
    """Warnings of the running command.

    waiting: line -> what holds all of its kind, until they are shown; past: lines that were; room: for how many more
    there is.
    """

    waiting: dict[str, str] = field(default_factory=dict)
    past: set[str] = field(default_factory=set)
    room: int = MOST_WARNINGS

    def reset(self) -> None:
        """Begin a command."""
        self.waiting, self.past, self.room = {}, set(), MOST_WARNINGS

    def add(self, lines: Iterable[str], where: str) -> None:
        """Keep lines that are new, the gravest first; where: what holds all of them."""
        new = {line: where for line in lines if line not in self.past}
        self.waiting = {line: held for line, held in self.waiting.items() if line not in new} | new

    def show(self) -> None:
        """Those of the result and those given on the way in turn, as far as there is room; then what holds the others.

        Those of the result on stdout, those given on the way on stderr.
        """
        heard = [line for line, where in self.waiting.items() if where == HEARD]
        own = [line for line, where in self.waiting.items() if where != HEARD]
        ordered = [line for pair in zip_longest(own, heard) for line in pair if line is not None]
        for line in ordered[: self.room]:
            self._print(f"warning: {line}", self.waiting[line])
        if held := [self.waiting[line] for line in ordered[self.room :]]:
            self._print(f"{many(len(held), 'more warning')} in {listing([*dict.fromkeys(held)])}", held[0])
        self.room -= min(self.room, len(ordered))
        self.past |= self.waiting.keys()
        self.waiting.clear()

    def _print(self, text: str, where: str) -> None:
        (errors if where == HEARD else console).print(escape(text))


_warnings = _Warnings()


def warn(lines: Iterable[str], where: str) -> None:
    """Show the warnings of a result, which stands, the gravest first, and all that were given on the way to it.

    where: what holds them.
    """
    _warnings.add(lines, where)
    _warnings.show()


class Ending(NamedTuple):
    """How a command ends badly: its error lines, its exit code, what stands above and below them."""

    lines: Iterable[str]
    code: int
    heading: str = ""
    remedy: str = ""


def ending(error: BaseException) -> Ending:
    """The ending that an error means; raises the error itself where it is the programmer's."""
    if isinstance(error, UserError):
        return Ending(error.errors, error.exit_code, error.heading)
    if isinstance(error, RunFailed | MachineFailure):
        return Ending([error.reason], error.exit_code, remedy=error.remedy)
    if isinstance(error, MemoryError):
        remedy = "run again with fewer --workers or a coarser case: fewer bird.particles and shells"
        return Ending(["a simulation does not fit into memory"], RunFailed.exit_code, remedy=remedy)
    if isinstance(error, Terminated):
        return Ending(["ended by SIGTERM; run the same command again to resume"], error.exit_code)
    if isinstance(error, KeyboardInterrupt):
        return Ending(["interrupted; run the same command again to resume"], INTERRUPTED)
    if isinstance(error, OSError) and error.errno in DISK_FULL:
        what = "" if error.filename is None else f" {error.filename}"
        return Ending([f"cannot write{what}: disk full; free space and run again to resume"], RunFailed.exit_code)
    if isinstance(error, OSError) and error.filename is not None:
        return Ending([f"{error.filename}: {error.strerror}"], UserError.exit_code)
    if isinstance(error, OSError) and error.errno != errno.EPIPE:  # a closed pipe is click's
        reason = error.strerror or str(error) or type(error).__name__
        return Ending([reason], MachineFailure.exit_code, remedy="run the same command again")
    raise error


EXPECTED = (UserError, RunFailed, MachineFailure, MemoryError, OSError, KeyboardInterrupt)


def framed(command: Callable[..., Mapping[str, Any] | None]) -> Callable[..., None]:
    """A command with the common ending: its return is the --json line; UserError, RunFailed, Ctrl-C exit 1, 2, 130."""

    @functools.wraps(command)
    def run(*args: Any, **kwargs: Any) -> None:
        as_json = bool(kwargs.get("json"))
        heard = list[str]()
        try:
            with plain_warnings(heard):
                outcome = command(*args, **kwargs)
        except EXPECTED as error:
            _fail(ending(error), as_json, heard)
        if as_json:
            print_json(with_warnings(outcome or {}, heard))

    return run


def with_warnings(outcome: Mapping[str, Any], heard: list[str]) -> Mapping[str, Any]:
    """The --json line's content with the warnings that were given on the way, each once."""
    return {**outcome, "warnings": list(dict.fromkeys([*outcome.get("warnings", ()), *heard]))} if heard else outcome


@contextmanager
def plain_warnings(heard: list[str]) -> Iterator[None]:
    """Warnings meant for the user as plain text without the source line, added to `heard`; shown with the result's."""
    _warnings.reset()
    with warnings.catch_warnings():
        with_source = warnings.showwarning

        def keep(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if category is UserWarning:
                heard.append(str(message))
                _warnings.add([str(message)], HEARD)
            else:
                with_source(message, category, *place, **more)

        warnings.showwarning = keep
        try:
            yield
        finally:
            _warnings.show()


def _fail(end: Ending, as_json: bool, heard: list[str]) -> NoReturn:
    """Print why, and leave with the exit code."""
    if end.heading:
        errors.print(f"[bold red]{escape(end.heading)}[/]")
    lines = list(end.lines)
    for line in lines:
        errors.print(f"[red]{escape(line)}[/]")
    if end.remedy:
        errors.print(escape(end.remedy))
    if as_json:
        print_json(with_warnings({"exit_code": end.code, "errors": lines, "remedy": end.remedy or None}, heard))
    raise typer.Exit(end.code)


def print_json(content: Mapping[str, Any]) -> None:
    """The machine-readable line that --json asks for, the last one on stdout."""
    from birdstrike.data.storage.files import json_values  # late, because --help has no use for numpy

    typer.echo(json.dumps(json_values({"schema_version": 1, **content}), allow_nan=False))


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[float], None]]:
    """A bar with the time left, fed with fractions 0..1; it appears once the work promises to last over 2 s.

    Off a terminal: one plain line now and then.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=errors, transient=True)
    task = bar.add_task(label, total=1.0)
    begun = spoken = time.monotonic()

    def advance(fraction: float) -> None:
        nonlocal spoken
        now = time.monotonic()
        bar.update(task, completed=fraction)
        if errors.is_terminal:
            if not bar.live.is_started and now - begun > max(SETTLING_S, LONG_S * fraction):
                bar.start()
        elif now - spoken > PLAIN_EVERY_S:
            spoken = now
            errors.print(f"{escape(label)}: {fraction:.0%}")

    try:
        yield advance
    finally:
        if bar.live.is_started:
            bar.stop()
