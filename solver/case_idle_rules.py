"""Keys that would do nothing: refused where the case itself gives them; inherited, they were void (`overlay`)."""

from __future__ import annotations

from collections.abc import Iterator

from solver.case_overlay import IDLE_FOR_RIGID, METHOD, ONLY_FOR, Raw, at

BIRD_OF = {"sph": "particles", "hexahedra": "hexahedra"}


def idle_rules(raw: Raw) -> Iterator[str]:
    """One line for every key, given or sought, that this plate or this bird has no use for."""
    if at(raw, "plate.rigid") is True:
        for key in IDLE_FOR_RIGID:
            yield from _idle(raw, key, "a rigid plate", "or leave plate.rigid out")
    method = str(at(raw, "bird.method") or METHOD)
    for other, keys in ONLY_FOR.items():
        if method in ONLY_FOR and other != method:
            for key in keys:
                yield from _idle(raw, key, f"a bird of {BIRD_OF[method]}", f'or choose bird.method = "{other}"')


def _idle(raw: Raw, key: str, whom: str, otherwise: str) -> Iterator[str]:
    value, sought = at(raw, key), at(raw, "inversion.parameters")
    if value is not None:
        yield f"{key} = {value} does nothing to {whom}; leave it out, {otherwise}"
    for name in sought if isinstance(sought, dict) else ():
        if name == key or name.startswith(f"{key}."):
            yield f'inversion.parameters."{name}" does nothing to {whom}; leave it out, {otherwise}'
