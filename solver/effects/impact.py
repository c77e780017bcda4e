"""Effects of the impact: speed, angle and aim of the bird's flight, friction where it meets the plate."""

from __future__ import annotations

import math

from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table

GROUP = "bird and impact"


def _impact(case: Declared, key: str, unit: str, change: float) -> Table:
    value = getattr(case.impact, key) + change
    return {"impact": {key: quantity_text(value, unit) if unit else value}}


def _offset(case: Declared, change: float) -> Table:
    along, across = case.impact.offset
    return {"impact": {"offset": [quantity_text(along + change, "m"), quantity_text(across, "m")]}}


IMPACT = (
    Effect(
        "impact_speed",
        "a bird faster or slower than measured",
        "m/s",
        lambda case, x: _impact(case, "speed", "m/s", x),
        lambda case: 0.02 * case.impact.speed,
        lambda case: -case.impact.speed,
        group=GROUP,
        source="light gates and high-speed video: 1 to 2 % of the speed",
    ),
    Effect(
        "impact_angle",
        "an impact at another angle",
        "rad",
        lambda case, x: _impact(case, "angle", "rad", x),
        lambda _: math.radians(1.0),
        lambda case: -case.impact.angle,
        group=GROUP,
        source="pitch of the bird and of the target's frame: about a degree",
    ),
    Effect(
        "impact_offset",
        "a bird that arrives beside the point of aim, along the plate's length",
        "m",
        _offset,
        lambda case: 0.05 * case.bird.diameter,
        group=GROUP,
        source="dispersion of a gas gun: some millimetres",
    ),
)

CONTACT = (
    Effect(
        "bird_friction",
        "friction between bird and plate",
        "",
        lambda case, x: _impact(case, "friction", "", x),
        lambda _: 0.1,
        lambda case: -case.impact.friction,
        group=GROUP,
        source="Coulomb friction coefficient",
    ),
)
