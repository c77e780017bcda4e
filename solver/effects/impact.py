"""Effects of the impact: speed, angle, aim and yaw of the bird's flight, friction where it meets the plate."""

from __future__ import annotations

import math

from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table

NEARLY_NORMAL = math.radians(80.0)
"""Angle from which on an error of the angle may carry a shot beyond the normal."""


def _impact(case: Declared, key: str, unit: str, change: float) -> Table:
    value = getattr(case.impact, key) + change
    return {"impact": {key: quantity_text(value, unit) if unit else value}}


def _offset(case: Declared, along: float, across: float) -> Table:
    declared = case.impact.offset
    return {"impact": {"offset": [quantity_text(declared[0] + along, "m"), quantity_text(declared[1] + across, "m")]}}


def _angle(case: Declared, change: float) -> Table:
    """Of a nearly normal shot beyond the normal: the same slope, the bird flying the other way over the plate."""
    impact = case.impact
    steeper = impact.angle + change
    if steeper <= 0.5 * math.pi or impact.angle < NEARLY_NORMAL or impact.aim != "axis":
        return _impact(case, "angle", "rad", change)
    slope, heading = math.pi - steeper, impact.heading + math.pi
    direction = [math.cos(slope) * math.cos(heading), math.cos(slope) * math.sin(heading), -math.sin(slope)]
    return {"impact": {"direction": direction, "angle": quantity_text(slope, "rad")}}


def _sphere(case: Declared) -> str:
    return "a sphere has no axis that could be turned" if case.bird.shape == "sphere" else ""


IMPACT = (
    Effect(
        "impact_speed",
        "a bird faster or slower than measured",
        "m/s",
        lambda case, x: _impact(case, "speed", "m/s", x),
        lambda case: 0.02 * case.impact.speed,
        lambda case: -case.impact.speed,
        family="impact",
        scope="shot",
        source="light gates and high-speed video: 1 to 2 % of the speed",
    ),
    Effect(
        "impact_angle",
        "an impact at another angle",
        "rad",
        _angle,
        lambda _: math.radians(1.0),
        lambda case: -case.impact.angle,
        family="impact",
        scope="shot",
        source="pitch of the bird and of the target's frame: about a degree",
    ),
    Effect(
        "impact_offset",
        "a bird that arrives beside the point of aim, along the plate's length",
        "m",
        lambda case, x: _offset(case, x, 0.0),
        lambda case: 0.05 * case.bird.diameter,
        family="impact",
        scope="shot",
        source="dispersion of a gas gun: some millimetres",
    ),
    Effect(
        "impact_offset_across",
        "a bird that arrives beside the point of aim, along the plate's width",
        "m",
        lambda case, x: _offset(case, 0.0, x),
        lambda case: 0.05 * case.bird.diameter,
        family="impact",
        scope="shot",
        source="dispersion of a gas gun: some millimetres",
    ),
    Effect(
        "bird_yaw",
        "a bird whose axis is turned sideways out of its velocity",
        "rad",
        lambda case, x: _impact(case, "yaw", "rad", x),
        lambda _: math.radians(3.0),
        refuses=_sphere,
        family="impact",
        scope="shot",
        source="free flight after the sabot: a few degrees; the velocity stays as stated",
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
        family="bird",
        scope="bird",
        source="Coulomb friction coefficient",
    ),
)
