"""An effect that a model may lack: physics of the solver or of the instrument, never a correction of a curve.

Its magnitude is physical, has a unit, and is 0 where the effect is absent; a case states it as
`effects.<name> = "0.2 mm"`, relative to what the case declares otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any, Protocol

from birdstrike.data.errors import CaseError, UnitError, UserError
from birdstrike.data.units import si_unit
from birdstrike.solver.effects.fault import Fault
from birdstrike.solver.sensors.instrument import Instrument
from birdstrike.solver.sensors.sensor import Sensor
from birdstrike.solver.sources import defining_module

SECTIONS = ("plate", "target", "bird", "impact", "sensors", "instrument", "solver")
"""Sections of a case that an effect may change; the others say what is recorded, sought or run elsewhere."""

FAMILIES = ("support", "plate", "impact", "bird", "instrument", "user")
"""What an answer sums probabilities by; among families they are shared out alike beforehand."""

SCOPES = ("shot", "bird", "plate", "rig", "sensor")
"""What an effect belongs to, with which it comes along to another case: this one shot, the bird's substance, the plate,
the rig with its supports, or one sensor."""

ANSWERS: dict[str, tuple[type | tuple[type, ...], str]] = {
    "size": (Real, "a number, SI"),
    "least": (Real, "a number, SI"),
    "refuses": ((str, type(None)), "text"),
    "places": ((tuple, list, set, frozenset), "a tuple of names"),
}
"""Functions of an effect that ask a case -> what they return."""

Table = Mapping[str, Any]


class Declared(Protocol):
    """The case as an effect's functions see it: its sections with their keys, every value in SI."""

    @property
    def plate(self) -> Any:
        """Section `plate`."""
        ...

    @property
    def target(self) -> Any:
        """Section `target`, None for a plate; what an effect sets of the plate then acts on the part that is struck."""
        ...

    @property
    def bird(self) -> Any:
        """Section `bird`."""
        ...

    @property
    def impact(self) -> Any:
        """Section `impact`."""
        ...

    @property
    def solver(self) -> Any:
        """Section `solver`."""
        ...

    @property
    def sensors(self) -> Mapping[str, Sensor]:
        """Sensors by name."""
        ...

    @property
    def instrument(self) -> Mapping[str, Instrument]:
        """Instruments by the name of their sensor."""
        ...


@dataclass(frozen=True)
class Effect:
    """One effect.

    meaning: what it is, in a few words that fit "the model lacks ..."; unit: SI unit of the magnitude; change: from a
    case and a magnitude to the tables of the case that it sets, written as in a file; size: a plausible magnitude for
    a case, SI, positive; least: the smallest magnitude that means anything (0: one-sided; -inf: none); refuses: why a
    case cannot carry it, empty where it can; family: one of `FAMILIES`; source: where its model is described;
    alternative: another SI unit in which a case may state the magnitude, and the magnitude of a value in it; places:
    parts of a case of which each can have the effect alone, and `alone` the effect of one of them, which a case states
    as `effects.<name>.<place>`; scope: one of `SCOPES`; level: plausible sizes at which its response is learnt, large
    beside the scatter of runs and still linear; particles: of a bird, below which its response is not that of a finer
    one; fault: of an effect of the instruments, what it does to one of them, so that no simulation is needed.
    """

    name: str
    meaning: str
    unit: str
    change: Callable[[Any, float], Table]
    size: Callable[[Any], float]
    least: Callable[[Any], float] = lambda _: -math.inf
    refuses: Callable[[Any], str] = lambda _: ""
    family: str = "user"
    source: str = ""
    alternative: tuple[str, Callable[[float], float]] | None = None
    places: Callable[[Any], tuple[str, ...]] = lambda _: ()
    alone: Callable[[str], Effect] | None = None
    scope: str = "rig"
    level: float = 2.0
    particles: int = 0
    fault: Fault | None = None

    def __post_init__(self) -> None:
        """Raises UnitError for a unit in which a case could not state the magnitude, UserError for what is no
        function, and for a family or scope that is unknown."""
        for own, known in (("family", FAMILIES), ("scope", SCOPES)):
            if (given := getattr(self, own)) not in known:
                raise UserError(f'effect "{self.name}": its `{own}` is {given!r}; known: {", ".join(known)}')
        if si_unit(self.unit) != self.unit:
            raise UnitError(
                f'effect "{self.name}": its unit "{self.unit}" is not SI; give the magnitude in "{si_unit(self.unit)}"'
            )
        for own in ("change", *ANSWERS):
            if not callable(given := getattr(self, own)):
                always = f"; where it is always the same: {own}=lambda case: {given!r}" if own in ANSWERS else ""
                said = f"its `{own}` is {given!r} and must be a function of the case"
                raise UserError(f'effect "{self.name}": {said}{always}')
        for own in ANSWERS:
            object.__setattr__(self, own, _Asked(getattr(self, own), self.name, own))

    def one_sided(self, case: Declared) -> bool:
        """Whether only magnitudes above 0 make sense for the case."""
        return self.least(case) == 0.0


class _Asked(partial[Any]):
    """A function of an effect that asks a case; CaseError names effect, function and module where it fails."""

    def __new__(cls, function: Callable[[Any], Any], *_: str) -> _Asked:
        return super().__new__(cls, function)

    def __init__(self, _function: Callable[[Any], Any], name: str = "", own: str = "size") -> None:
        self.name, self.own = name, own

    def __call__(self, case: Any) -> Any:
        kind, wanted = ANSWERS[self.own]
        try:
            found = super().__call__(case)
        except CaseError:
            raise
        except Exception as error:  # whatever a function from outside may raise
            raise CaseError(f"effects.{self.name}: {failed(self.own, self, error)}") from error
        if not isinstance(found, kind):
            said = f"its function `{self.own}` returns {found!r}, which is not {wanted}"
            raise CaseError(f"effects.{self.name}: {said}; correct it in {defining_module(self)}")
        return "" if found is None else tuple(sorted(found)) if isinstance(found, set | frozenset) else found


def failed(own: str, function: Callable[..., Any], error: Exception) -> str:
    """Says that a function of an effect has failed, and where it is."""
    where = defining_module(function)
    remedy = f"; correct it in {where}" if where else ""
    return f"its function `{own}` failed: {type(error).__name__}: {error}{remedy}"
