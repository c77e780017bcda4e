"""Numbers and names in the user's words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from birdstrike.data.key_labels import key_labels
from birdstrike.data.units import display, rounded

if TYPE_CHECKING:
    from birdstrike.solver.case.sections import Impact


def quantity(value: float, si_unit: str, digits: int = 3) -> str:
    """An SI value in the engineers' unit: quantity(5e-5, "m") is "0.05 mm"."""
    number, unit = display(value, si_unit)
    return f"{rounded(number, digits)} {unit}".rstrip()


DIGITS = 12
"""Most significant digits of an interval's ends."""


def span(low: float, high: float, si_unit: str, digits: int = 3) -> str:
    """Two SI values with their unit once: "555 .. 643 Pa s"; with more digits where the ends would look alike."""
    start, end = display(low, si_unit)[0], display(high, si_unit)[0]
    while start != end and digits < DIGITS and rounded(start, digits) == rounded(end, digits):
        digits += 1
    return f"{rounded(start, digits)} .. {quantity(high, si_unit, digits)}"


def many(count: int, what: str) -> str:
    """ "1 record", "3 records"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def listing(parts: Sequence[str], most: int | None = None) -> str:
    """ "a, b and c"; of more than `most` the rest as a number: "a, b and 4 more"."""
    shown = list(parts[:most])
    rest = len(parts) - len(shown)
    last = [f"{rest} more"] if rest else shown[-1:]
    return " and ".join(filter(None, (", ".join(shown if rest else shown[:-1]), *last)))


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
    words = [", ".join(filter(None, (effect, place, shot and f"shot {shot}"))) for effect, place, shot in members]
    return " + ".join(words).replace("_", " ")


def changes(before: Mapping[str, float], after: Mapping[str, float] | None, units: Mapping[str, str]) -> str:
    """SI values by sensor before and, if any, after: "displacement centre 0.4 mm -> 0.16 mm; ..."."""
    return "; ".join(
        f"{name.replace('_', ' ')} {quantity(old, units[name])}"
        + (f" -> {quantity(after[name], units[name])}" if after else "")
        for name, old in before.items()
        if name in units
    )


def flight(impact: Impact, digits: int = 3) -> str:
    """Speed and direction of the bird: "90 m/s at 40 deg from the surface, heading 30 deg from x towards y"."""
    heading = f", heading {quantity(impact.heading, 'rad', digits)} from x towards y" if impact.heading else ""
    at = quantity(impact.angle, "rad", digits)
    return f"{quantity(impact.speed, 'm/s', digits)} at {at} from the surface{heading}"


def plain(name: str, among: Iterable[str] = ()) -> str:
    """A dotted key or a sensor's name as words: "bird.material.viscosity" is "viscosity".

    among: the other keys in question, from which parents tell it ("left thickness", "right thickness").
    """
    return key_labels((name, *among))[name].replace("_", " ")
