"""The reference strike as OpenRadioss ran it: its curves, our case of it, and the misfit between the two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from birdstrike.data.histories import Array, Histories
from birdstrike.data.paths import REFERENCE
from birdstrike.reports.verification.shots import Shot, momentum_given

SOURCE = "OpenRadioss, one run, no convergence study (simulated): data/reference/openradioss_reference_strike.csv"
END = 3e-3
VARIANTS = {name: Shot(f"openradioss_{name}", (("time.snapshots", "[]"),)) for name in ("viscous", "inviscid", "touch")}


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
    astray = 100.0 * np.abs(given - truth.J) / truth.J[-1]
    w_rms = 100.0 * float(np.sqrt(np.mean((w - truth.w) ** 2)) / truth.w.max())
    return Misfit(
        w, given, w_rms, float(np.sqrt(np.mean(astray**2))), float(astray.max()), float(w.max()), float(given[-1])
    )
