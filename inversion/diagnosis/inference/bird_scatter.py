"""How far the birds of several shots lie apart: what the user states of them, and what the records may show."""

from __future__ import annotations

from birdstrike.data.errors import UserError

BIRDS = {"same": 0.02, "recipe": 0.1, "other": 1.0}
"""Prior standard deviations by which the parameters of a shot's bird lie off what the shots share: birds of one batch;
birds cast by one recipe, which scatter by a tenth of what is known of a recipe beforehand; birds of which one says
nothing of the other. Each is as likely as the others unless the user states which it is."""
BIRDS_APART = tuple(BIRDS.values())
AUTO = "auto"
CONTRADICTED = 0.05  # probability by the records below which a stated bird is contradicted by them


def birds_apart(stated: str) -> tuple[float, ...]:
    """The possibilities that a stated bird leaves: all of them for `auto`; raises UserError for an unknown word."""
    if stated == AUTO:
        return BIRDS_APART
    if stated not in BIRDS:
        raise UserError(f'baseline_bird = "{stated}" is unknown; available: {", ".join((AUTO, *BIRDS))}')
    return (BIRDS[stated],)
