"""Another code's curves beside ours: errors over the peak, impulses, and the rating of ISO/TS 18571, by sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories, largest
from birdstrike.reports.comparison.scores import Score, same_side, score

FORCE = "N"
SHORT = 0.98
"""Share of our run's time that the other curve has to cover for peaks and errors to be those of the whole."""


@dataclass(frozen=True)
class CurvePair:
    """One sensor in both codes, SI, over the time that both cover (n,).

    score: of ours against theirs, None where theirs is nowhere above 0; impulses: of forces alone [N s], ours and
    theirs.
    """

    name: str
    unit: str
    time: Array
    ours: Array
    theirs: Array
    score: Score | None
    impulses: tuple[float, float] | None

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        found = self.score
        rating = None if found is None or found.rating is None else found.rating
        return {
            "unit": self.unit,
            "peak_ours": float(self.ours[same_side(self.theirs, self.ours)[1]]),
            "peak_theirs": float(largest(self.theirs)),
            "peak_time_difference": None if found is None else found.peak_time,
            "rms": None if found is None else found.rms,
            "rms_of_peak": None if found is None else found.share,
            "impulse_ours": None if self.impulses is None else self.impulses[0],
            "impulse_theirs": None if self.impulses is None else self.impulses[1],
            "iso18571": None if rating is None else rating.overall,
            "iso18571_grade": None if rating is None else rating.grade,
        }


def curve_pairs(ours: Histories, theirs: Histories) -> tuple[CurvePair, ...]:
    """The sensors that both have; raises UserError where there are none, or units that differ."""
    shared = [name for name in ours.channels if name in theirs.channels]
    if not shared:
        raise UserError(
            f"no sensor is in both: the case has {', '.join(ours.channels)}, the other curves are "
            f"{', '.join(theirs.channels)}; name them as the case does (birdstrike import --sensor NAME=COLUMN)"
        )
    wrong = [name for name in shared if ours.units[name] != theirs.units[name]]
    if wrong:
        raise UserError(
            f"{name}: the case records {ours.units[name] or 'a ratio'}, the other curve is in {theirs.units[name]}; "
            "import it with its unit"
            for name in wrong
        )
    return tuple(_pair(name, ours, theirs) for name in shared)


def remarks(pairs: tuple[CurvePair, ...], ours: Histories) -> list[str]:
    """What the figures do not say: curves that end before ours, and forces whose sign is the other way round."""
    found, begin, end = list[str](), float(ours.time[0]), float(ours.time[-1])
    late = begin + (1.0 - SHORT) * (end - begin)
    for pair in pairs:
        if pair.time[0] > late or pair.time[-1] < SHORT * end:
            found.append(
                f"{pair.name}: the other curve covers {1e3 * pair.time[0]:.4g} to {1e3 * pair.time[-1]:.4g} ms of the "
                f"case's {1e3 * end:.4g} ms: peaks and errors are those of that time"
            )
    for pair in pairs:
        if pair.impulses is not None and pair.impulses[0] * pair.impulses[1] < 0.0:
            found.append(
                f"{pair.name}: the impulses have opposite signs; forces count positive in the push, so turn the other "
                f"curve (birdstrike import --scale {pair.name}=-1)"
            )
    return found


def _pair(name: str, ours: Histories, theirs: Histories) -> CurvePair:
    start, end = max(ours.time[0], theirs.time[0]), min(ours.time[-1], theirs.time[-1])
    inside = (theirs.time >= start) & (theirs.time <= end) & np.isfinite(theirs.channels[name])
    if np.count_nonzero(inside) < 2:
        raise UserError(
            f"{name}: the other curve has no two points between 0 and {1e3 * float(ours.time[-1]):.4g} ms, which the "
            "case simulates; is its clock in the right unit, and does it begin with the run?"
        )
    time, record = theirs.time[inside], theirs.channels[name][inside]
    own = ours.at(name, time)
    impulses = None
    if ours.units[name] == FORCE:
        impulses = (float(np.trapezoid(own, time)), float(np.trapezoid(record, time)))
    return CurvePair(
        name=name,
        unit=ours.units[name],
        time=time,
        ours=own,
        theirs=record,
        score=score(time, record, ours, name, 0.0),
        impulses=impulses,
    )
