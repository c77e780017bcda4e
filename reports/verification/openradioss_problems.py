"""The whole strike against OpenRadioss: centre displacement and momentum transfer of three variants."""

from __future__ import annotations

from functools import partial

from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.openradioss import SOURCE, VARIANTS, Misfit, Reference, compare, reference
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import Row, below, matches

W_TOLERANCE, J_TOLERANCE = 3.0, 2.0  # %
ROW_W, ROW_J, ROW_J_MAX = "displacement, RMS of peak", "momentum J(t), RMS of final", "momentum J(t), largest miss"


def solve(variant: str, strikes: Strikes) -> Outcome:
    """One variant: displacement RMS in % of the peak, momentum RMS and largest difference in % of the final value."""
    truth = reference(variant)
    ours = compare(strikes[VARIANTS[variant]], truth)
    return Outcome(tuple(rows_of(variant, truth, ours)), (picture(variant, truth, ours),))


def rows_of(variant: str, truth: Reference, ours: Misfit) -> list[Row]:
    """Gated: the displacement's RMS, J's largest miss. Shown: J's RMS, peaks and final values."""
    figure = f"openradioss_{variant}"
    peaks = (1e3 * ours.peak, 1e3 * float(truth.w.max()), "mm", None, SOURCE, "", figure)
    finals = (ours.final, float(truth.J[-1]), "N s", None, SOURCE, "", figure)
    return [
        below(f"{variant}: {ROW_W}", ours.w_rms, W_TOLERANCE, "%", SOURCE, "", figure),
        below(f"{variant}: {ROW_J}", ours.J_rms, None, "%", SOURCE, "", figure),
        below(f"{variant}: {ROW_J_MAX}", ours.J_max, J_TOLERANCE, "%", SOURCE, "", figure),
        matches(f"{variant}: peak displacement", *peaks),
        matches(f"{variant}: momentum given by 3 ms", *finals),
    ]


def picture(variant: str, truth: Reference, ours: Misfit) -> Picture:
    """Displacement and momentum, both codes."""
    time = 1e3 * truth.time
    w = (Curve("OpenRadioss", time, 1e3 * truth.w, truth=True), Curve("birdstrike", time, 1e3 * ours.w))
    given = (Curve("OpenRadioss", time, truth.J, truth=True), Curve("birdstrike", time, ours.J))
    figure = draw(
        Panel("time [ms]", "centre displacement [mm]", w),
        Panel("time [ms]", "momentum given to the plate [N s]", given),
    )
    caption = (
        f"The {variant} strike. Displacement: RMS {ours.w_rms:.2f} % of the peak, peak {1e3 * ours.peak:.2f} mm "
        f"against "
        f"{1e3 * truth.w.max():.2f} mm. Momentum: RMS {ours.J_rms:.2f} %, largest miss {ours.J_max:.2f} % of the final "
        f"value, {ours.final:.2f} N s against {truth.J[-1]:.2f} N s. Both clocks start 0.05 mm above first contact."
    )
    return Picture(f"openradioss_{variant}", figure, caption)


ABOUT = (
    "The same strike in another code: 1.876 kg at 938 kg/m³, 4488 particles, 50 x 40 shells, 91.1 m/s at 30 degrees. "
    "Artificial viscosity is off, as the header of the reference says of its own; every other knob is at its default. "
    "All are equal in the three variants, and the time origin is first contact. Viscous: MU 641 Pa s; inviscid: MU 0; "
    "touch: viscous, first touch at the plate's centre."
)
PROBLEMS = tuple(
    Problem(
        f"openradioss_{variant}", "The OpenRadioss strike", ABOUT if i == 0 else "", partial(solve, variant), (shot,)
    )
    for i, (variant, shot) in enumerate(VARIANTS.items())
)
