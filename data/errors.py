"""How a command can end badly: the user's input (exit code 1), or a run that failed or was ended (exit code 2)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Integral


class UserError(Exception):
    """Something in the user's input: each of `errors` is one line that names the field, its value and the remedy."""

    exit_code = 1

    def __init__(self, errors: str | Iterable[str], heading: str = "") -> None:
        self.errors = [errors] if isinstance(errors, str) else list(errors)
        self.heading = heading
        super().__init__("\n".join([heading, *self.errors] if heading else self.errors))

    def __reduce__(self) -> tuple[type[UserError], tuple[list[str], str]]:
        """Errors cross process borders whole (a campaign's workers raise them)."""
        return type(self), (self.errors, self.heading)


def refuse_not_whole(option: str, value: object, remedy: str, least: float = -math.inf) -> None:
    """Raise UserError where what is counted is no whole number, or below the least, as a Python call may give it."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        least_said = "" if least == -math.inf else f" of at least {least}"
        raise UserError(f"{option} = {value!r} is no whole number{least_said}; {remedy}")


class UnitError(UserError, ValueError):
    """A quantity without a unit, or with one of another dimension."""


class CaseError(UserError):
    """A case file that cannot be used; all its errors at once."""


class MeasuredError(UserError):
    """A measured-data file that cannot be used; every error with its line number."""


class RunFailed(Exception):
    """A run of the solver that failed, or whose result is refused: why, and what to change."""

    exit_code = 2

    def __init__(self, reason: str, remedy: str = "") -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(f"{reason}; {remedy}" if remedy else reason)

    def __reduce__(self) -> tuple[type[RunFailed], tuple[str, str]]:
        return type(self), (self.reason, self.remedy)


class Terminated(KeyboardInterrupt):
    """SIGTERM, as a queueing system or `timeout` sends it: ends a command as Ctrl-C does, its workers with it."""

    exit_code = 143


class MachineFailure(Exception):
    """A run that the machine ended (memory, disk, a signal): that says nothing of the run, which stays due."""

    exit_code = 2

    def __init__(self, reason: str, remedy: str = "run the same command again") -> None:
        self.reason = reason
        self.remedy = remedy
        super().__init__(f"{reason}; {remedy}")

    def __reduce__(self) -> tuple[type[MachineFailure], tuple[str, str]]:
        return type(self), (self.reason, self.remedy)
