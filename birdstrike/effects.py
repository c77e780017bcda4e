"""Effects of one's own: what a package or a script needs to add one to the library."""

from __future__ import annotations

from birdstrike.solver.effects import registry
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effects, unregister

__all__ = ["Effect", "effects", "register", "unregister"]


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
    if effect.name == "none":
        raise ValueError('an effect cannot be named "none", as an answer calls the model without effects; rename it')
    return registry.register(effect)
