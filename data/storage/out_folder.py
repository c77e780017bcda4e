"""A folder of results says what it holds, so that the output of another command does not go into it."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import ParamSpec, TypeVar

from birdstrike.data.arguments import as_path
from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import write_json

Given = ParamSpec("Given")
Returned = TypeVar("Returned")

MARK = ".birdstrike.json"
TELLTALES = {
    "run-doe": ("case.json", "design.csv"),
    "close-the-loop": ("close_the_loop.json",),
    "train-and-invert": ("inversion.json",),
    "compare-methods": ("comparison.json",),
    "calibrate-models": ("models.json",),
    "diagnose": ("diagnosis.json",),
    "predict": ("prediction.json",),
    "audit": ("audit.json",),
    "compare": ("compare.json",),
    "converge": ("convergence.json",),
    "simulate": ("histories.csv", "summary.json"),
    "start": ("answers.toml",),
}
"""Command that makes a folder -> files that only it writes there, by which a folder without a mark is known."""


@contextmanager
def reserved(folder: Path, command: str) -> Iterator[None]:
    """While a command writes into a folder; afterwards the folder is marked as that command's.

    Raises UserError, before anything is written, where the folder holds what another command made, or is a file. A
    folder that was there before is marked only if the command succeeds.
    """
    if folder.exists() and not folder.is_dir():
        raise UserError(f"--out {folder} is a file; the output of {command} goes into a folder: choose another --out")
    maker, was_there = maker_of(folder), folder.is_dir()
    if of_model := model_of(folder):
        raise UserError(
            f"{folder} is of the bird model {of_model[1]} in {of_model[0]}, which birdstrike calibrate-models made; "
            f"the output of {command} does not go into it: choose another --out"
        )
    if maker not in (None, command):
        raise UserError(
            f"{folder} was made by birdstrike {maker}; the output of {command} does not go into it, because both write "
            "files of the same names: choose another --out"
        )
    try:
        yield
    except BaseException:
        if not was_there:
            _mark(folder, command)
        raise
    _mark(folder, command)


def fills_out(command: str) -> Callable[[Callable[Given, Returned]], Callable[Given, Returned]]:
    """Decorate a function that writes into the folder `out` as `command` does: `reserved` holds while it runs."""

    def decorated(function: Callable[Given, Returned]) -> Callable[Given, Returned]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def run(*args: Given.args, **kwargs: Given.kwargs) -> Returned:
            out = signature.bind(*args, **kwargs).arguments.get("out")
            with nullcontext() if out is None else reserved(as_path("out", out), command):
                return function(*args, **kwargs)

        return run

    return decorated


def maker_of(folder: Path) -> str | None:
    """The command that made the results in a folder; None where there are none."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        return str(json.loads((folder / MARK).read_text(encoding="utf-8"))["command"])
    found = (name for name, files in TELLTALES.items() if all((folder / file).is_file() for file in files))
    return next(found, None)


def model_of(folder: Path) -> tuple[Path, str] | None:
    """The calibrate-models' folder in which this one is a bird model's, and the model; None for any other folder."""
    place = folder.resolve()
    if maker_of(place) is not None or maker_of(place.parent) != "calibrate-models":
        return None
    if not any(place.glob("*/case.toml")):  # its campaigns
        return None
    return (folder.parent if folder.name == place.name else place.parent), place.name


def _mark(folder: Path, command: str) -> None:
    """Write the mark where the command has made the folder; a folder that cannot be written to stays unmarked."""
    if folder.is_dir() and not (folder / MARK).exists():
        with suppress(OSError):
            write_json(folder / MARK, {"command": command})
