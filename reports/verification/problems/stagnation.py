"""Wilbeck's problem: a soft cylinder end on against a rigid plate, its pressures on a gauge in the middle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from birdstrike.data.histories import Array, Histories
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Row, Solution, matches
from birdstrike.reports.verification.runs import RunSpec
from birdstrike.solver.bird.eos.porous import porous_density
from birdstrike.solver.reference.stagnation import compressible_stagnation_pressure
from birdstrike.solver.reference.wilbeck import duration, peak, stagnation_pressure, steady_mean

DENSITY, C, S1 = 938.0, 1670.0, 2.48
DIAMETER = 0.1  # m
GAUGE = 0.1  # of the diameter: the gauge's radius


@dataclass(frozen=True)
class Compared:
    """A computed value and its reference, both SI, and what else was seen."""

    computed: float
    reference: float
    unit: str
    seen: dict[str, float]

    @property
    def error(self) -> float:
        """Relative to the reference."""
        return self.computed / self.reference - 1.0


def rigid_run(spacing: float, length: float, speed: float, end: float, **changes: str) -> RunSpec:
    """A flat cylinder of DIAMETER, particles `spacing` [m] apart, no viscosity; speed [m/s], end [s].

    changes: as of `RunSpec.with_`.
    """
    particles = round(0.25 * np.pi * DIAMETER**2 * length / spacing**3)
    table = {
        "plate.rigid": "true",
        "plate.length": "600 mm",
        "plate.width": "600 mm",
        "plate.elements": "[30, 30]",
        "bird.shape": "cylinder",
        "bird.diameter": f"{DIAMETER} m",
        "bird.length": f"{length} m",
        "bird.density": f"{DENSITY} kg/m^3",
        "bird.particles": f"{particles}",
        "bird.material.viscosity": "0 Pa s",
        "bird.material.compression_erosion": "0.0",
        "impact.speed": f"{speed} m/s",
        "impact.angle": "90 deg",
        "impact.standoff": "0 mm",
        "time.end": f"{end} s",
        "time.output_interval": "2 us",
        "time.snapshots": "[]",
        "sensors.centre.kind": "pressure",
        "sensors.centre.radius": f"{GAUGE * DIAMETER} m",
    }
    return RunSpec("reference_strike", tuple(table.items())).with_(**changes)


@dataclass(frozen=True)
class Wilbeck:
    """Peak and steady mean of the gauge [Pa] with their theories: Hugoniot, incompressible and compressible stagnation.

    scatter: standard deviation in the steady phase.
    """

    peak: float
    hugoniot: float
    steady: float
    stagnation: float
    compressible: float
    scatter: float
    particles: int


def pressures(of: RunSpec, run: Histories) -> Wilbeck:
    """What the gauge of a run says."""
    case, curve = of.load(), run.channels["centre"]
    speed, density = case.impact.speed, case.bird.actual_density
    whole = duration(case.bird.length, speed)
    steady = (run.time > whole / 3.0) & (run.time < 2.0 * whole / 3.0)
    eos = case.bird.material.build(density).eos
    return Wilbeck(
        peak(run.time, curve)[0],
        eos.hugoniot(speed)[0],
        steady_mean(run.time, curve, 0.0, whole),
        stagnation_pressure(density, speed),
        compressible_stagnation_pressure(eos, speed),
        float(curve[steady].std()),
        int(run.summary["particles"]),
    )


SPEED, LENGTH = 200.0, 3.0 * DIAMETER  # m/s, m
TENSION = "-500 MPa"  # beyond Hugoniot's 406 MPa, which the release can at most turn into tension
CUTOFF = "bird__material__pressure_cutoff"
SPACINGS = (2.0, 3.0)  # particles along the gauge's radius of 0.1 D; the finest is judged
COARSE, WIDE = 20e-3 / 3.0, "20 mm"  # m between particles, radius of the gauge: three spacings of 0.2 D
GATE, BAND = 5.0, (0.95, 1.05)  # %, and as a ratio
STEADY = "rho u0^2/2, mean from t_D/3 to 2 t_D/3: J. S. Wilbeck, AFML-TR-77-134 (1978)"
HUGONIOT = "p_H = rho0 u_s u0 of the bird's own law: J. S. Wilbeck, AFML-TR-77-134 (1978)"
POROUS = "rho_z u0^2/2 / (1 - z): eq. 9 of the sandwich-cowling paper (porous, incompressible stream)"
POROSITIES = {"10 % porous": 0.1, "30 % porous": 0.3}
SMOOTHED = 1.0 / 6.0  # of t_D: width of the running mean in the picture


def gauge_run(spacing: float, speed: float = SPEED, **changes: str) -> RunSpec:
    """A run until the steady phase's end at 2 t_D/3; spacing [m], speed [m/s]."""
    end = 2.01 * duration(LENGTH, speed) / 3.0
    return rigid_run(spacing, LENGTH, speed, end, **({CUTOFF: TENSION} | changes))


def coarse(speed: float = SPEED, **changes: str) -> RunSpec:
    """The cheap resolution."""
    return gauge_run(COARSE, speed, **({"sensors__centre__radius": WIDE} | changes))


def porous(z: float) -> RunSpec:
    """Water with a share z of air, by Wood's law; the mixture's own tension ends at -1 atmosphere."""
    law = {"kind": "porous", "z": f"{z:g}", "mixing": "wood"}
    changes = {f"bird__material__eos__{key}": text for key, text in law.items()} | {CUTOFF: "-0.1 MPa"}
    return coarse(SPEED, bird__density=f"{porous_density(z, 1000.0)} kg/m^3", **changes)


FINE = {f"{spacings:g} spacings in 0.1 D": gauge_run(GAUGE * DIAMETER / spacings) for spacings in SPACINGS}
JUDGED = list(FINE)[-1]
AGAIN, CAVITATING = "3 spacings in 0.2 D", "no tension (PC 0)"
OTHERS = {
    AGAIN: coarse(),
    CAVITATING: coarse(SPEED, **{CUTOFF: "0 MPa"}),
    "100 m/s": coarse(100.0),
    "hemispherical ends": coarse(bird__shape="hemispherical_cylinder"),
    "10 % porous": porous(0.1),
    "30 % porous": porous(0.3),
}
NOTES = {
    CAVITATING: "cavitates after the shock's release, and its waves are cut at zero",
    "30 % porous": "the peak rings over the plateau",
    "hemispherical ends": "the shock begins at a point: no plane impact",
}


def rows_of(label: str, found: Wilbeck, gate: float | None, note: str, figure: str) -> list[Row]:
    """Steady mean and peak of one run."""
    said = f"{found.particles} particles; scatter about the mean {1e-6 * found.scatter:.1f} MPa"
    said += f"; {100.0 * (found.steady / found.compressible - 1.0):+.1f} % off the compressible stream's"
    said += f" {1e-6 * found.compressible:.2f} MPa" + (f"; {note}" if note else "")
    mean, top = (1e-6 * found.steady, 1e-6 * found.stagnation), (1e-6 * found.peak, 1e-6 * found.hugoniot)
    return [
        matches(f"stagnation pressure, {label}", *mean, "MPa", gate, STEADY, said, figure),
        matches(f"gauge's peak, {label}", *top, "MPa", None, HUGONIOT, note, figure),
    ]


def solve(computed: Computed) -> Solution:
    """Two resolutions of the flat, dense bird, and the other birds at the cheap one."""
    figure, birds = "stagnation", FINE | OTHERS
    found = {label: pressures(one, computed[one]) for label, one in birds.items()}
    rows = [
        row
        for label, seen in found.items()
        for row in rows_of(label, seen, GATE if label == JUDGED else None, NOTES.get(label, ""), figure)
    ]
    rows += [stream_row(label, z, found[label], figure) for label, z in POROSITIES.items()]
    return Solution(tuple(rows), (picture(figure, computed, found),))


def stream_row(label: str, z: float, found: Wilbeck, figure: str) -> Row:
    """The mean of a porous bird against the published formula for porous streams."""
    theory = found.stagnation / (1.0 - z)
    said = "the pores close under the pressure, so that the stream has the density of the water"
    name = f"stagnation pressure, {label}, by the formula for porous birds"
    return matches(name, 1e-6 * found.steady, 1e-6 * theory, "MPa", None, POROUS, said, figure)


def picture(name: str, computed: Computed, found: Mapping[str, Wilbeck]) -> Picture:
    """The shock, the steady phase as a running mean, and both theories over porosity."""
    shock = [early(label, computed[one], found[label]) for label, one in FINE.items()]
    lines = {**FINE, CAVITATING: OTHERS[CAVITATING]}
    steady = [running(label, computed[one], found[label]) for label, one in lines.items()]
    mixtures = {0.0: found[AGAIN], 10.0: found["10 % porous"], 30.0: found["30 % porous"]}
    share = list(mixtures)
    ratios = (
        Curve("peak / Hugoniot", share, [f.peak / f.hugoniot for f in mixtures.values()]),
        Curve("mean / incompressible", share, [f.steady / f.stagnation for f in mixtures.values()]),
        Curve("mean / compressible", share, [f.steady / f.compressible for f in mixtures.values()]),
    )
    panels = (
        Panel("time [us]", "gauge pressure / Hugoniot's", shock, "shock", legend=False),
        Panel("t / t_D", "running mean / stagnation pressure", steady, "steady phase", band=BAND),
        Panel("porosity [%]", "ours / theory", ratios, "porosity, coarse", band=BAND),
    )
    off = {label: f"{100.0 * (seen.steady / seen.stagnation - 1.0):+.1f} %" for label, seen in found.items()}
    caption = (
        f"A flat cylinder, L/D 3, at {SPEED:g} m/s against a rigid plate: mean from t_D/3 to 2 t_D/3 "
        f"{' and '.join(off[label] for label in FINE)} off rho u²/2 with {' and '.join(f'{s:g}' for s in SPACINGS)} "
        f"spacings in the gauge's radius of 0.1 D. Middle: running means over t_D/6; dotted, a fluid that bears no "
        f"tension, {off[CAVITATING]} off. Grey ±5 %."
    )
    return Picture(name, draw(*panels, height=3.6), caption)


def early(label: str, run: Histories, found: Wilbeck) -> Curve:
    """The first 60 us."""
    first = run.time <= 60e-6
    return Curve(label, 1e6 * run.time[first], run.channels["centre"][first] / found.hugoniot)


def running(label: str, run: Histories, found: Wilbeck) -> Curve:
    """Running mean from t_D/4 on, over SMOOTHED t_D."""
    whole = duration(LENGTH, SPEED)
    width = int(SMOOTHED * whole / (run.time[1] - run.time[0]))
    mean: Array = uniform_filter1d(run.channels["centre"], width)
    inside = (run.time > 0.25 * whole) & (run.time < run.time[-1] - 0.5 * SMOOTHED * whole)
    return Curve(label, run.time[inside] / whole, mean[inside] / found.stagnation)


ABOUT = (
    "A flat cylinder of 100 mm end on against a rigid plate, gauge in the middle, no viscosity. The theory's jet is "
    "incompressible and never torn, so the judged bird bears tension (PC -500 MPa). One that bears none (PC 0) reads "
    "low on some lattices, for a reason that was measured once, on a coarse bird: at t_D/6 its lowest diameter is foam "
    "of 0.6 to 0.9 of its density; later the waves that the shock left in it are as large as rho u²/2 and are cut at "
    "zero, and what they held is dissipated. Between 0.4 and 0.6 t_D a third of the particles below D/4 are at any "
    "instant less dense than at rest, and p + rho v²/2 is 0.7 to 0.9 of rho u²/2 there, but 1 above. The other birds "
    "are coarse and without a gate; "
    "porous ones follow the compressible stream, in which the integral of dp/rho is u²/2."
)
PROBLEMS = (Problem("stagnation", "Target", ABOUT, solve, (*FINE.values(), *OTHERS.values())),)
