"""The `birdstrike` command: its sub-commands in the order in which they are used."""

from __future__ import annotations

import io
import sys
from importlib import import_module
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version
from itertools import pairwise
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand

from birdstrike.cli.frame import print_json
from birdstrike.cli.options import missing_sign
from birdstrike.data.errors import UserError

COMMANDS = (
    "start",
    "new",
    "check",
    "simulate",
    "converge",
    "import",
    "run-doe",
    "train-and-invert",
    "compare-methods",
    "calibrate-models",
    "diagnose",
    "predict",
    "audit",
    "report",
    "explore",
    "export",
    "compare",
    "evidence",
    "close-the-loop",
    "verify",
)
RESERVED = {"import": "import_curve"}
"""Commands whose name Python keeps for itself."""
RECORDS = ("--measured", "--heldout")
"""Options that name a record."""


def module_of(command: str) -> str:
    """Name of a command's module, which is that of its Python verb too."""
    return RESERVED.get(command, command.replace("-", "_"))


# A command line that cannot be read is the user's input: 1, as everywhere; typer's own 2 means a failed run here.
USAGE_ERROR = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "UsageError")
setattr(USAGE_ERROR, "exit_code", UserError.exit_code)  # noqa: B010 (click's attribute, unknown to the base class)

_said = typer.BadParameter.format_message
# typer has pydantic read words, whose sentence begins with its own name for what went wrong
setattr(typer.BadParameter, "format_message", lambda error: _said(error).replace("Value error, ", "", 1))  # noqa: B010


class StrictCommand(TyperCommand):
    """A command that refuses a second record where it takes one: the last would count, without a word.

    Of other options the last counts, as is usual, so that scripts can override their own. A --set without its sign is
    named as such, before what follows it is taken for an argument too many.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As the base class, which takes the last of the values."""
        if args and not ctx.resilient_parsing:
            for option, setting in pairwise(args):
                if option == "--set" and "=" not in setting:
                    ctx.fail(missing_sign(setting))
            order = self.make_parser(ctx).parse_args(args=list(args))[2]
            single = [one.opts[0] for one in order if not getattr(one, "multiple", False)]
            for name in RECORDS:
                if (times := single.count(name)) > 1:
                    ctx.fail(f"{name} was given {times} times, and {ctx.info_name} takes one; leave the others out")
        return super().parse_args(ctx, args)


app = typer.Typer(
    name="birdstrike",
    help="Bird parameters from one instrumented shot, with 95 % intervals.",
    epilog="Start with: birdstrike start my_shot.csv, or birdstrike check reference_strike",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

for _name in COMMANDS:
    app.command(_name, cls=StrictCommand)(import_module(f"birdstrike.cli.{module_of(_name)}").command)


def _print_version(wanted: bool) -> None:
    if not wanted:
        return
    try:
        typer.echo(f"birdstrike {installed_version('birdstrike')}")
    except PackageNotFoundError:
        typer.echo("birdstrike, run from its source without being installed")
    raise typer.Exit


Version = Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")]


@app.callback()
def _root(version: Version = False) -> None:
    """Bird parameters from one instrumented shot, with 95 % intervals."""


def main() -> None:
    """Entry point of the console script."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that lacks a character shows ? instead of a traceback
    try:
        app()
    except SystemExit as ended:
        unread = ended.__context__  # typer has shown it; no command has begun that could end with its own line
        if isinstance(unread, USAGE_ERROR) and "--json" in sys.argv:
            reason = cast(typer.BadParameter, unread).format_message()
            print_json({"exit_code": UserError.exit_code, "errors": [reason], "remedy": None})
        raise
