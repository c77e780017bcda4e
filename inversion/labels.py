"""What a diagnosis calls its models and shots, and where its records come from, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from birdstrike.data.formatting import quantity, reading

if TYPE_CHECKING:
    from birdstrike.solver.case.sections import Impact


def provenance(shots: Sequence[str], simulated: Sequence[str]) -> str:
    """ "The record is measured"; where only some of several shots are simulated, these by name."""
    some = simulated if 0 < len(simulated) < len(shots) else []
    records, be = ("records", "are") if len(some or shots) > 1 else ("record", "is")
    which = f" of {', '.join(some)}" if some else ""
    return f"The {records}{which} {be} {'simulated, not measured' if simulated else 'measured'}"


def provenance_of(content: Mapping[str, Any], shots: Sequence[str]) -> str:
    """`provenance` by a results file's record; one that does not name its simulated shots has all or none."""
    return provenance(shots, content.get("simulated_shots", shots if content["simulated"] else []))


def runs_near_the_fits(refinement: Mapping[str, Any]) -> str:
    """Runs that a diagnosis added near its fits, and what they did; of `strikes.refinement` of diagnosis.json."""
    shares = " -> ".join(f"{100 * share:.0f} %" for share in refinement["added_variance"])
    return f"runs near the fits: {refinement['added']} added; the emulator adds {shares} to an interval's variance"


def label_parts(label: str) -> tuple[str, str, str]:
    """Effect, place and shot of an effect's label in a diagnosis, "" where it has none.

    place: the one sensor or set of nodes that it acts on, as in `sensor_gain.displacement_centre`; shot: as in
    `impact_speed@speed_91.1`, whose name may hold dots.
    """
    name, _, shot = label.partition("@")
    effect, _, place = name.partition(".")
    return effect, place, shot


def in_words(model: str) -> str:
    """A model's name as words: "sensor_gain.displacement_centre" is "sensor gain, displacement centre"."""
    members = [label_parts(label) for label in model.split("+")]
    words = [", ".join(filter(None, (effect, place, _shot(shot)))) for effect, place, shot in members]
    return " + ".join(words).replace("_", " ")


def _shot(name: str) -> str:
    """ "shot speed_91"; a shot that is called "shot7" is that already."""
    return name if not name or name.lower().startswith("shot") else f"shot {name}"


def changes(before: Mapping[str, float], after: Mapping[str, float] | None, units: Mapping[str, str]) -> str:
    """SI values by sensor before and, if any, after: "displacement centre 0.4 mm -> 0.16 mm; ..."."""
    return "; ".join(
        f"{name.replace('_', ' ')} {reading(old, units[name])}"
        + (f" -> {reading(after[name], units[name])}" if after else "")
        for name, old in before.items()
        if name in units
    )


def flight(impact: Impact, digits: int = 3) -> str:
    """Speed and direction of the bird: "90 m/s at 40 deg from the surface, heading 30 deg from x towards y"."""
    heading = f", heading {quantity(impact.heading, 'rad', digits)} from x towards y" if impact.heading else ""
    at = quantity(impact.angle, "rad", digits)
    return f"{quantity(impact.speed, 'm/s', digits)} at {at} from the surface{heading}"
