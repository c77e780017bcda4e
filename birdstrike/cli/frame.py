"""What every command has in common: exit codes, error lines, warnings, the --json line, the progress bar."""

from __future__ import annotations

import errno
import functools
import json
import re
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from birdstrike.data.errors import MachineFailure, RunFailed, UserError

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

GRAVITY = tuple(
    re.compile(stems, re.IGNORECASE)
    for stems in (
        r"cannot|failed|fails|not verified|never reach|does not reach|no contact|nothing can|not finite|no measurement",
        r"not converge|R-hat|diverg|oscillat|energy|momentum|\btore\b|squeezed|erosion|erode|force is zero",
        r"outside|beyond|clipped|saturat|correlat|disagree|differ|too |wider|covariance|half the time step|needed",
    )
)
"""Stems of warnings, the gravest first: no result, a result that may be wrong, an interval or a sensor that may be."""

Json = Annotated[bool, typer.Option("--json", help="End with one machine-readable JSON line.")]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Run again what is on record as failed; each failed run once.")
]
Settings = Annotated[
    list[str], typer.Option("--set", metavar="KEY=VALUE", help='Override the case: --set plate.thickness="8 mm".')
]


def say(text: str = "") -> None:
    """One line of plain text for the user; square brackets stay what they are."""
    console.print(escape(text))


@dataclass
class _Room:
    """How many more warnings of the running command go to the terminal."""

    left: int = MOST_WARNINGS

    def take(self) -> bool:
        """Whether there was room for one."""
        self.left -= 1
        return self.left >= 0


_room = _Room()


def gravity(line: str) -> int:
    """Place of a warning among others, 0 the gravest."""
    return next((rank for rank, stems in enumerate(GRAVITY) if stems.search(line)), len(GRAVITY))


def warn(lines: Iterable[str], where: str) -> None:
    """The warnings of a result, each once, the gravest first, at most MOST_WARNINGS; where: what holds all of them."""
    held = 0
    for line in sorted(dict.fromkeys(lines), key=gravity):
        if _room.take():
            say(f"warning: {line}")
        else:
            held += 1
    if held:
        say(f"{held} more {'warning' if held == 1 else 'warnings'} in {where}")


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
        remedy = "run again with fewer --workers or a coarser case (bird.particles, plate.elements)"
        return Ending(["a simulation does not fit into memory"], RunFailed.exit_code, remedy=remedy)
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
        try:
            with plain_warnings() as heard:
                outcome = command(*args, **kwargs)
        except EXPECTED as error:
            _fail(ending(error), as_json)
        if as_json:
            print_json(with_warnings(outcome or {}, heard))

    return run


def with_warnings(outcome: Mapping[str, Any], heard: list[str]) -> Mapping[str, Any]:
    """The --json line's content with the warnings that were given on the way."""
    return {**outcome, "warnings": [*outcome.get("warnings", ()), *heard]} if heard else outcome


@contextmanager
def plain_warnings() -> Iterator[list[str]]:
    """Warnings meant for the user as one line of plain text, without the source line; gives the list of them all."""
    heard, _room.left = list[str](), MOST_WARNINGS
    with warnings.catch_warnings():
        with_source = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if category is UserWarning:
                heard.append(str(message))
                if _room.take():
                    errors.print(escape(f"warning: {message}"))
            else:
                with_source(message, category, *place, **more)

        warnings.showwarning = show
        try:
            yield heard
        finally:
            if len(heard) > MOST_WARNINGS:
                errors.print(f"{len(heard) - MOST_WARNINGS} more warnings were given; --json lists them all")


def _fail(end: Ending, as_json: bool) -> NoReturn:
    """Print why, and leave with the exit code."""
    if end.heading:
        errors.print(f"[bold red]{escape(end.heading)}[/]")
    for line in end.lines:
        errors.print(f"[red]{escape(line)}[/]")
    if end.remedy:
        errors.print(escape(end.remedy))
    if as_json:
        print_json({"exit_code": end.code, "errors": list(end.lines), "remedy": end.remedy or None})
    raise typer.Exit(end.code)


def print_json(content: Mapping[str, Any]) -> None:
    """The machine-readable line that --json asks for, the last one on stdout."""
    from birdstrike.data.files import plain  # late, because --help has no use for numpy

    typer.echo(json.dumps(plain({"schema_version": 1, **content}), allow_nan=False))


def overrides(settings: Iterable[str]) -> dict[str, str]:
    """Dotted keys and texts of `--set key=value` options; raises UserError."""
    pairs = [setting.partition("=") for setting in settings]
    unread = [key for key, sign, _ in pairs if not sign]
    if unread:
        raise UserError(f'--set {key}: write --set key=value, such as --set plate.thickness="8 mm"' for key in unread)
    return {key.strip(): value.strip() for key, _, value in pairs}


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
