"""The effects that a model may lack: the library, those of installed packages, and those of one's own.

An installed package adds its own by entry points `birdstrike.effects`, a script by `register`.
"""

from __future__ import annotations

from birdstrike.solver.effects.bird import BIRD
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.impact import CONTACT, IMPACT
from birdstrike.solver.effects.instrument import INSTRUMENT
from birdstrike.solver.effects.plate import PLATE
from birdstrike.solver.registry import Registry
from birdstrike.solver.sources import defining_module

LIBRARY = (*PLATE, *IMPACT, *BIRD, *CONTACT, *INSTRUMENT)
"""In the order in which they act."""

EFFECTS: Registry[Effect] = Registry(
    "effect",
    "birdstrike.effects",
    {effect.name: effect for effect in LIBRARY},
    Effect,
    lambda _, effect: effect.name,
    lambda effect: effect.change,
)


def register(effect: Effect) -> Effect:
    """Add an effect of one's own; returns it. Raises ValueError for a name that is taken or cannot be a key."""
    if not effect.name.isidentifier() or effect.name == "none":
        raise ValueError(f'"{effect.name}" cannot be an effect\'s name; use letters, digits and _')
    if effect.name in EFFECTS:
        raise ValueError(f'an effect named "{effect.name}" exists already')
    EFFECTS.own[effect.name] = (effect, defining_module(effect.change))
    return effect


def unregister(name: str) -> None:
    """Forget an effect that `register` added."""
    EFFECTS.own.pop(name, None)


def effects() -> dict[str, Effect]:
    """Every effect by name: the library in its order, then those of installed packages, then one's own."""
    return dict(EFFECTS)
