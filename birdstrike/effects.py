"""Effects of one's own: what a package or a script needs to add one to the library."""

from __future__ import annotations

from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effects, register, unregister

__all__ = ["Effect", "effects", "register", "unregister"]
