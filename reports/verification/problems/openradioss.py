"""The reference strike against OpenRadioss: three variants of the SPH bird, and a Lagrangian bird of hexahedra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from birdstrike.data.histories import Array, Histories
from birdstrike.data.paths import REFERENCE
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import (
    Computed,
    Picture,
    Problem,
    Row,
    Solution,
    below,
    matches,
    rms_of_peak,
    shown,
)
from birdstrike.reports.verification.runs import RunSpec, momentum_given

SOURCE = "OpenRadioss, one run, no convergence study (simulated): data/reference/openradioss_reference_strike.csv"
END = 3e-3
VARIANTS = {
    name: RunSpec(f"openradioss_{name}", (("time.snapshots", "[]"),)) for name in ("viscous", "inviscid", "touch")
}


@dataclass(frozen=True)
class Reference:
    """time (n,) [s]; w: centre displacement (n,) [m]; J: momentum given to the plate (n,) [N s]."""

    time: Array
    w: Array
    J: Array


def reference(variant: str) -> Reference:
    """OpenRadioss's curves to 3 ms."""
    table = pd.read_csv(REFERENCE / "openradioss_reference_strike.csv", comment="#")
    time, w, given = (np.asarray(table[name], float) for name in ("time_ms", f"w_{variant}_mm", f"J_{variant}_Ns"))
    seen = time <= 1e3 * END * (1.0 + 1e-9)
    return Reference(1e-3 * time[seen], 1e-3 * w[seen], given[seen])


@dataclass(frozen=True)
class Misfit:
    """Ours on the reference's clock, and how far it is off.

    w_rms: of the displacement, in % of the reference's peak; J_rms, J_max: of the momentum, in % of its final value.
    """

    w: Array
    J: Array
    w_rms: float
    J_rms: float
    J_max: float
    peak: float
    final: float


def compare(run: Histories, truth: Reference) -> Misfit:
    """A run against reference curves, both clocks starting 0.05 mm above first contact; nothing is fitted."""
    w = run.at("displacement_centre", truth.time)
    given = np.interp(truth.time, run.time, momentum_given(run))
    difference = 100.0 * np.abs(given - truth.J) / truth.J[-1]
    return Misfit(
        w,
        given,
        rms_of_peak(w, truth.w),
        float(np.sqrt(np.mean(difference**2))),
        float(difference.max()),
        float(w.max()),
        float(given[-1]),
    )


W_TOLERANCE, J_TOLERANCE = 3.0, 2.0  # %
ROW_W, ROW_J, ROW_J_MAX = (
    "displacement, RMS of peak",
    "momentum J(t), RMS of final",
    "momentum J(t), largest difference",
)


def solve(variant: str, computed: Computed) -> Solution:
    """One variant: displacement RMS in % of the peak, momentum RMS and largest difference in % of the final value."""
    truth = reference(variant)
    ours = compare(computed[VARIANTS[variant]], truth)
    return Solution(tuple(rows_of(variant, truth, ours)), (picture(variant, truth, ours),))


def rows_of(variant: str, truth: Reference, ours: Misfit) -> list[Row]:
    """Gated: the displacement's RMS, J's largest difference. Shown: J's RMS, peaks and final values."""
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
        f"The {variant} case. Displacement: RMS {ours.w_rms:.2f} % of the peak, peak {1e3 * ours.peak:.2f} mm against "
        f"{1e3 * truth.w.max():.2f} mm. Momentum: RMS {ours.J_rms:.2f} %, largest difference {ours.J_max:.2f} % of "
        f"the final value, {ours.final:.2f} N s against {truth.J[-1]:.2f} N s. Both clocks start 0.05 mm above first "
        "contact."
    )
    return Picture(f"openradioss_{variant}", figure, caption)


ABOUT = (
    "The same impact in another code: 1.876 kg at 938 kg/m³, 4488 particles, 50 x 40 shells, 91.1 m/s at 30 degrees. "
    "Artificial viscosity is off, as the header of the reference says of its own; all other settings are the defaults. "
    "All are equal in the three variants, and the time origin is first contact. Viscous: MU 641 Pa s; inviscid: MU 0; "
    "touch: viscous, first touch at the plate's centre."
)
VARIANTS_SOLVED = tuple(
    Problem(
        f"openradioss_{variant}", "The OpenRadioss strike", ABOUT if i == 0 else "", partial(solve, variant), (spec,)
    )
    for i, (variant, spec) in enumerate(VARIANTS.items())
)


SPH = VARIANTS["viscous"]
LAGRANGIAN = SPH.with_(bird__method="hexahedra")


def solve_lagrangian(computed: Computed) -> Solution:
    """Displacement and momentum of both discretisations, beside OpenRadioss's SPH."""
    truth = reference("viscous")
    sph, hexahedra = compare(computed[SPH], truth), compare(computed[LAGRANGIAN], truth)
    apart = 100.0 * float(((hexahedra.w - sph.w) ** 2).mean() ** 0.5) / sph.peak
    given = 100.0 * abs(hexahedra.final / sph.final - 1.0)
    summary = computed[LAGRANGIAN].summary
    figure = "lagrangian"
    energy = 100.0 * summary["worst_energy_error"]
    rows = (
        below("Lagrangian less SPH: displacement RMS of peak", apart, None, "%", "our SPH bird", "", figure),
        below("Lagrangian less SPH: momentum by 3 ms", given, None, "%", "our SPH bird", "", figure),
        below("Lagrangian: displacement RMS of peak", hexahedra.w_rms, None, "%", SOURCE, "", figure),
        below("Lagrangian: energy, worst instant", energy, 1.0, "%", "energies, each from its own rate", "", figure),
        below("Lagrangian: linear momentum", summary["momentum_error"], 1e-10, "", "conservation", "", figure),
        shown("Lagrangian: mass eroded", 100.0 * summary["eroded_mass_fraction"], "%", "by distortion", "", figure),
    )
    time = 1e3 * truth.time
    panels = [
        Panel("time [ms]", label, [Curve(name, time, scale * getattr(run, field)) for name, run in runs])
        for runs in [(("SPH", sph), ("Lagrangian hexahedra", hexahedra))]
        for label, field, scale in (
            ("centre displacement [mm]", "w", 1e3),
            ("momentum given to the plate [N s]", "J", 1.0),
        )
    ]
    caption = (
        f"The viscous case with both birds: peaks {1e3 * sph.peak:.2f} mm (SPH) and {1e3 * hexahedra.peak:.2f} mm "
        f"(hexahedra), {apart:.1f} % of the peak apart (RMS); momentum {sph.final:.1f} and {hexahedra.final:.1f} N s."
    )
    return Solution(rows, (Picture(figure, draw(*panels), caption),))


ABOUT_LAGRANGIAN = (
    "Fluid hexahedra tangle at 30 degrees and erode by distortion, which particles do not; the mass lost is stated."
)
PROBLEMS = (
    *VARIANTS_SOLVED,
    Problem("lagrangian", "Lagrangian against SPH", ABOUT_LAGRANGIAN, solve_lagrangian, (SPH, LAGRANGIAN)),
)
