"""An effect that a model may lack: physics of the solver or of the instrument, never a correction of a curve.

Its magnitude is physical, has a unit, and is 0 where the effect is absent; a case states it as
`effects.<name> = "0.2 mm"`, relative to what the case declares otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from birdstrike.data.errors import UnitError
from birdstrike.data.units import si_unit
from birdstrike.solver.sensors.instrument import Instrument
from birdstrike.solver.sensors.sensor import Sensor

SECTIONS = ("plate", "target", "bird", "impact", "sensors", "instrument", "solver")
"""Sections of a case that an effect may change; the others say what is recorded, sought or run elsewhere."""

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
    case cannot carry it, empty where it can; source: where its model is described; alternative: another SI unit in
    which a case may state the magnitude, and the magnitude of a value in it; places: parts of a case of which each can
    have the effect alone, and `alone` the effect of one of them, which a case states as `effects.<name>.<place>`.
    """

    name: str
    meaning: str
    unit: str
    change: Callable[[Any, float], Table]
    size: Callable[[Any], float]
    least: Callable[[Any], float] = lambda _: -math.inf
    refuses: Callable[[Any], str] = lambda _: ""
    group: str = "user"
    source: str = ""
    alternative: tuple[str, Callable[[float], float]] | None = None
    places: Callable[[Any], tuple[str, ...]] = lambda _: ()
    alone: Callable[[str], Effect] | None = None

    def __post_init__(self) -> None:
        """Raises UnitError for a unit in which a case could not state the magnitude."""
        if si_unit(self.unit) != self.unit:
            raise UnitError(
                f'effect "{self.name}": its unit "{self.unit}" is not SI; give the magnitude in "{si_unit(self.unit)}"'
            )

    def one_sided(self, case: Declared) -> bool:
        """Whether only magnitudes above 0 make sense for the case."""
        return self.least(case) == 0.0
