"""Trends that experiments show: peak displacement and reaction linear in speed."""

from __future__ import annotations

import numpy as np

from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import shown
from birdstrike.reports.verification.shots import Shot

SOURCE = "measured on steel plates, 70 to 170 m/s: linear (J. Vib. Shock 32(4) 2013, 15; abstract)"
SPEEDS = (70.0, 95.0, 120.0, 145.0, 170.0)
BASE = Shot("reference_strike_156mm", (("bird.particles", "1500"), ("time.snapshots", "[]"), ("time.end", "2.5 ms")))
SHOTS = tuple(BASE.with_(impact__speed=f"{speed:g} m/s") for speed in SPEEDS)


def solve(strikes: Strikes) -> Outcome:
    """Straight line through the peaks: its departure, and the exponent of a power law."""
    speeds = np.array(SPEEDS)
    panels, rows = [], []
    labels = {"displacement_centre": ("peak displacement", "mm", 1e3), "reaction_force": ("peak reaction", "kN", 1e-3)}
    said = []
    for channel, (label, unit, scale) in labels.items():
        peaks = scale * np.array([strikes[s].summary["peak"][channel]["value"] for s in SHOTS])
        line = np.polyval(np.polyfit(speeds, peaks, 1), speeds)
        off = 100.0 * float(np.abs(peaks / line - 1.0).max())
        exponent = float(np.polyfit(np.log(speeds), np.log(peaks), 1)[0])
        rows.append(shown(f"{label}: largest departure from a line", off, "%", SOURCE, "", "trend_speed"))
        rows.append(shown(f"{label}: exponent of speed", exponent, "", SOURCE, "", "trend_speed"))
        said.append(f"{label} departs from a line by at most {off:.1f} %, exponent {exponent:.2f}")
        curves = (Curve("straight line", speeds, line, truth=True), Curve("birdstrike", speeds, peaks, dots=True))
        panels.append(Panel("speed [m/s]", f"{label} [{unit}]", curves))
    caption = f"The 1.00 kg bird (1500 particles) at 30 degrees on the aluminium plate: {'; '.join(said)}."
    return Outcome(tuple(rows), (Picture("trend_speed", draw(*panels), caption),))


ABOUT = (
    "No gate: the experiments' plates and birds are others, so that only the trend can be compared. A strike much "
    "shorter than the plate's period (2.5 ms) loads it by its momentum, which grows as u; a longer one by its force, "
    "which grows as u²: this bird flies its length in 2.2 to 0.9 ms, and exponents between 1 and 2 are expected."
)
PROBLEMS = (Problem("trend_speed", "Trends", ABOUT, solve, SHOTS),)
