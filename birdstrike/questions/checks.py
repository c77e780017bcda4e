"""What an answer may be: a quantity of a case, a choice, a number, a place on the plate. Each raises UserError."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pydantic_core import PydanticCustomError

from birdstrike.data.errors import UserError
from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.fields import Between, Count
from birdstrike.solver.sensors.sensor import Sensor

Check = Callable[[Any], Any]
YES, NO = ("yes", "y", "true"), ("no", "n", "false")


def of_case(key: str) -> tuple[Check, str]:
    """Check of a quantity of a case by its dotted key, and its range in words."""
    mark = quantity_at(key)
    assert mark is not None, key
    return of_range(mark)


def of_range(mark: Between) -> tuple[Check, str]:
    """Check of a quantity with a unit, or of a bare number; the text is kept."""

    def check(value: Any) -> Any:
        given = value.strip() if isinstance(value, str) else value
        if not mark.unit and isinstance(given, str):
            given = _number(given)
        try:
            mark.validate(given)
        except PydanticCustomError as error:
            raise UserError(error.message()) from error
        return given

    return check, f"{mark.low} .. {mark.high}"


def of_noise(kind: type[Sensor]) -> Check:
    """Check of the noise that is stated of a kind of sensor; the text is kept. A case reads 0 as none."""
    number, _ = of_range(kind.noise_range)
    unit = f" {kind.noise_range.shown}".rstrip()

    def check(value: Any) -> Any:
        given = number(value)
        if kind.noise_range.valid(given) == 0.0:
            raise UserError(
                f"is no noise: it must be above 0{unit}, at most {kind.noise_range.high}; leave it out where none is "
                "known, and the record's own is taken"
            )
        return given

    return check


def of_count(low: int, high: int) -> tuple[Check, str]:
    """Check of a whole number."""

    def check(value: Any) -> int:
        given = _number(value) if isinstance(value, str) else value
        whole = int(given) if isinstance(given, float) and given.is_integer() else given
        try:
            return Count(low, high).validate(whole)
        except PydanticCustomError as error:
            raise UserError(error.message()) from error

    return check, f"{low} .. {high}"


def of_choice(*choices: str) -> tuple[Check, str]:
    """Check of one of several words."""

    def check(value: Any) -> str:
        given = str(value).strip()
        if given not in choices:
            raise UserError(f"is none of {', '.join(choices)}")
        return given

    return check, ", ".join(choices)


def yes_or_no(value: Any) -> bool:
    """True or false."""
    if isinstance(value, bool):
        return value
    word = str(value).strip().lower()
    if word not in (*YES, *NO):
        raise UserError("must be yes or no")
    return word in YES


def of_pair(check: Check) -> Check:
    """Check of two values, in a list or with a comma between them."""

    def pair(value: Any) -> list[Any]:
        parts: Sequence[Any] = value.strip("[] ").split(",") if isinstance(value, str) else value
        if not isinstance(parts, Sequence) or len(parts) != 2:
            raise UserError("must be two values such as 60 mm, 0 mm")
        return [check(part.strip(" \"'") if isinstance(part, str) else part) for part in parts]

    return pair


def of_limits(key: str) -> tuple[Check, str]:
    """Check of the range in which a parameter is sought."""
    one, allowed = of_case(key)
    mark = quantity_at(key)
    assert mark is not None

    def check(value: Any) -> list[Any]:
        low, high = of_pair(one)(value)
        if not mark.validate(low) < mark.validate(high):
            raise UserError("must rise: the lower limit first")
        return [low, high]

    return check, f"two values in {allowed}"


def _number(text: str) -> Any:
    """A number typed by hand; what is none is left to the check that follows."""
    try:
        value = float(text)
    except ValueError:
        return text
    return int(value) if value.is_integer() and "." not in text and "e" not in text.lower() else value
