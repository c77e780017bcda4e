"""Our own scatter on the OpenRadioss strike: what lattice, resolution, contact and numerical viscosity change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from data.histories import Histories
from reports.verification.draw import Curve, Panel, draw
from reports.verification.openradioss import VARIANTS, Misfit, Reference, compare, reference
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, shown
from reports.verification.shots import Shot

NONE = "our own default run"
Knobs = Mapping[str, Shot]


def knobs(base: Shot) -> dict[str, Shot]:
    """One knob turned at a time, by its name in the table."""
    return {
        "as compared": base,
        "lattice turned 15°": replace(base, roll=math.radians(15.0)),
        "lattice turned 30°": replace(base, roll=math.radians(30.0)),
        "lattice turned 45°": replace(base, roll=math.radians(45.0)),
        "cubic lattice": base.with_(bird__lattice="cubic"),
        "2200 particles": base.with_(bird__particles="2200"),
        "9000 particles": base.with_(bird__particles="9000"),
        "contact gap - 1 mm": replace(base, gap=-1e-3),
        "contact gap + 1 mm": replace(base, gap=1e-3),
        "contact stiffness / 4": replace(base, stiffness=0.25),
        "no artificial viscosity": base.with_(solver__shock_linear="0", solver__shock_quadratic="0"),
        "artificial viscosity x 2": base.with_(solver__shock_linear="2", solver__shock_quadratic="4"),
        "smoothing length 1.5 d": base.with_(solver__smoothing="1.5"),
        "plate 100 x 80": base.with_(plate__elements="[100, 80]"),
        "half the step": base.with_(solver__courant="0.45"),
    }


def change(run: Misfit, base: Misfit) -> float:
    """RMS of what a knob moved the displacement by, in % of the peak."""
    return 100.0 * float(np.sqrt(np.mean((run.w - base.w) ** 2))) / base.peak


def solve(variant: str, strikes: Strikes) -> Outcome:
    """Each knob's misfit against OpenRadioss beside what it moved our own curve by."""
    truth, base = reference(variant), VARIANTS[variant]
    runs = {name: compare(strikes[shot], truth) for name, shot in knobs(base).items()}
    standard = runs["as compared"]
    figure = f"knobs_{variant}"
    rows = [_row(variant, name, run, standard, strikes[knobs(base)[name]], figure) for name, run in runs.items()]
    return Outcome(tuple(rows), (picture(variant, truth, runs),))


def _row(variant: str, name: str, run: Misfit, standard: Misfit, histories: Histories, figure: str) -> Row:
    """Displacement misfit of one run, with what else it did in the note."""
    note = (
        f"moves the curve by {change(run, standard):.2f} %, peak {1e3 * run.peak:.3f} mm, J {run.final:.2f} N s "
        f"(RMS {run.J_rms:.2f} %, largest {run.J_max:.2f} %), shock viscosity as shear "
        f"{histories.summary['shock_equivalent_viscosity_Pa_s']:.0f} Pa s"
    )
    return shown(f"{variant}, {name}: displacement RMS of peak", run.w_rms, "%", NONE, note, figure)


def picture(variant: str, truth: Reference, runs: Mapping[str, Misfit]) -> Picture:
    """Difference from OpenRadioss over time, lattice and resolution left, the other knobs right."""
    time = 1e3 * truth.time
    scale = 100.0 / float(truth.w.max())
    moved = ("lattice turned 30°", "cubic lattice", "2200 particles", "9000 particles")
    other = ("contact gap - 1 mm", "contact gap + 1 mm", "no artificial viscosity", "smoothing length 1.5 d")
    panels = [
        Panel(
            "time [ms]",
            "displacement - OpenRadioss [% of peak]",
            [Curve(name, time, scale * (runs[name].w - truth.w)) for name in ("as compared", *names)],
            band=(-3.0, 3.0),
        )
        for names in (moved, other)
    ]
    turned = [runs[name] for name in runs if name == "as compared" or name.startswith("lattice turned")]
    peaks = np.array([run.peak for run in turned])
    largest = max((change(run, runs["as compared"]), name) for name, run in runs.items())
    caption = (
        f"The {variant} strike: displacement less OpenRadioss's, one knob turned at a time; grey ±3 %. Scatter of four "
        f"turns of the lattice about the bird's axis: peak {1e3 * peaks.mean():.3f} ± {1e3 * peaks.std(ddof=1):.3f} "
        f"mm. "
        f"The knob that moves our curve most is {largest[1]} ({largest[0]:.2f} % RMS)."
    )
    return Picture(f"knobs_{variant}", draw(*panels, height=3.8), caption)


ABOUT = (
    "One knob is turned at a time; nothing here was used to choose the defaults. Gap and stiffness are those of the "
    "penalty "
    "contact; the artificial viscosity acts on shocks."
)
PROBLEMS = tuple(
    Problem(
        f"knobs_{variant}",
        "Knobs of the OpenRadioss strike",
        ABOUT if variant == "viscous" else "",
        partial(solve, variant),
        tuple(knobs(VARIANTS[variant]).values()),
    )
    for variant in ("viscous", "inviscid")
)
