"""The effects that a model may lack: the library, those of installed packages, and those of one's own.

An installed package adds its own by entry points `birdstrike.effects`, a script by `register`.
"""

from __future__ import annotations

from typing import Any

from birdstrike.solver.effects.bird import BIRD
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.impact import CONTACT, IMPACT
from birdstrike.solver.effects.instrument import INSTRUMENT
from birdstrike.solver.effects.plate import PLATE
from birdstrike.solver.registry import Registry
from birdstrike.solver.sources import defining_module

LIBRARY = (*PLATE, *IMPACT, *BIRD, *CONTACT, *INSTRUMENT)
"""In the order in which they act."""

RESERVED = {"none": "the model without effects", "something_else": "what no effect of the library describes"}
"""Names of an answer -> what it means by them."""


class _Effects(Registry[Effect]):
    """Of effects, whose names are keys of a case and labels of an answer."""

    def fault(self, name: str, thing: Any, /) -> str:
        """It must be an Effect with a name that a case can state and an answer can give."""
        return super().fault(name, thing) or unfit_name(thing.name)


def unfit_name(name: str) -> str:
    """Why an effect cannot be called so; empty where it can."""
    if name in RESERVED:
        return f'an effect cannot be named "{name}", as an answer calls {RESERVED[name]}; rename it'
    if not isinstance(name, str) or not name.isidentifier():
        return f'"{name}" cannot be an effect\'s name; use letters, digits and _'
    return ""


EFFECTS = _Effects(
    "effect",
    "birdstrike.effects",
    {effect.name: effect for effect in LIBRARY},
    Effect,
    lambda _, effect: effect.name,
    lambda effect: effect.change,
)


def register(effect: Effect) -> Effect:
    """Add an effect of one's own to the library; returns it.

    Raises
    ------
    TypeError
        What is given is no Effect.
    ValueError
        Its name is taken or cannot be a key of a case.
    """
    if not isinstance(effect, Effect):
        raise TypeError(f"{effect!r} is no effect; write register(Effect(name, meaning, unit, change, size))")
    if reason := unfit_name(effect.name):
        raise ValueError(reason)
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


def effects_of(case: Any) -> dict[str, Effect]:
    """Every effect by name, and after each that acts in several places of the case those of one place alone."""
    found: dict[str, Effect] = {}
    for name, effect in EFFECTS.items():
        found[name] = effect
        if effect.alone is not None:
            found |= {f"{name}.{place}": effect.alone(place) for place in effect.places(case)}
    return found


def kind_of(name: str) -> str:
    """An effect's name without its place: `clamp_rotation` of `clamp_rotation.frame`."""
    return name.partition(".")[0]


def effect_named(name: str) -> Effect:
    """An effect by its name, with or without a place; raises KeyError where there is none of that name."""
    kind, dot, place = name.partition(".")
    effect = EFFECTS[kind]
    if not dot:
        return effect
    if effect.alone is None or not place:
        raise KeyError(name)
    return effect.alone(place)
