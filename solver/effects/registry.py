"""Effects that a model may lack: their registry, and what each changes in a case.

An effect is physics of the solver or of the instrument, never a correction of a curve. Its magnitude is physical, has a
unit, and is 0 where the effect is absent; a case states it as `effects.<name> = "0.2 mm"`, relative to what the case
declares otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from birdstrike.solver.case.case import Case

ENTRY_POINTS = "birdstrike.effects"
GROUPS = ("plate and support", "bird and impact", "instrument", "user")

Table = Mapping[str, Any]


@dataclass(frozen=True)
class Effect:
    """One effect.

    meaning: what it is, in a few words that fit "the model lacks ..."; unit: SI unit of the magnitude; change: from a
    case and a magnitude to the tables of the case that it sets, written as in a file; size: a plausible magnitude for
    a case, SI, positive; least: the smallest magnitude that means anything (0: one-sided; -inf: none); refuses: why a
    case cannot carry it, empty where it can; source: where its model is described.
    """

    name: str
    meaning: str
    unit: str
    change: Callable[[Case, float], Table]
    size: Callable[[Case], float]
    least: Callable[[Case], float] = lambda _: -math.inf
    refuses: Callable[[Case], str] = lambda _: ""
    group: str = "user"
    source: str = ""

    def one_sided(self, case: Case) -> bool:
        """Whether only magnitudes above 0 make sense for the case."""
        return self.least(case) == 0.0


_own: dict[str, Effect] = {}


def register(effect: Effect) -> Effect:
    """Add an effect of one's own; returns it. Raises ValueError for a name that is taken or cannot be a key."""
    if not effect.name.isidentifier() or effect.name == "none":
        raise ValueError(f'"{effect.name}" cannot be an effect\'s name; use letters, digits and _')
    if effect.name in effects():
        raise ValueError(f'an effect named "{effect.name}" exists already')
    _own[effect.name] = effect
    return effect


def unregister(name: str) -> None:
    """Forget an effect that `register` added."""
    _own.pop(name, None)


def effects() -> dict[str, Effect]:
    """Every effect by name: the library in its order, then those of installed packages, then one's own."""
    return {**_library(), **_installed(), **_own}


@cache
def _library() -> dict[str, Effect]:
    from birdstrike.solver.effects.bird import BIRD
    from birdstrike.solver.effects.instrument import INSTRUMENT
    from birdstrike.solver.effects.plate import PLATE

    return {effect.name: effect for effect in (*PLATE, *BIRD, *INSTRUMENT)}


@cache
def _installed() -> dict[str, Effect]:
    """Effects of installed packages: entry points of the group `birdstrike.effects`, each an Effect."""
    found = (entry.load() for entry in entry_points(group=ENTRY_POINTS))
    return {effect.name: effect for effect in found if effect.name not in _library()}
