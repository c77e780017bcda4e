"""A bird end on against a rigid plate, with a pressure gauge in the middle: Wilbeck's set-up as changes of a case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from birdstrike.data.histories import Histories
from birdstrike.reports.verification.shots import Shot
from birdstrike.solver.bird.eos.interface import EquationOfState
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


def rigid_shot(spacing: float, length: float, speed: float, end: float, **changes: str) -> Shot:
    """A flat cylinder of DIAMETER, particles `spacing` [m] apart, no viscosity; speed [m/s], end [s].

    changes: as of `Shot.with_`.
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
    return Shot("reference_strike", tuple(table.items())).with_(**changes)


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


def pressures(of: Shot, run: Histories) -> Wilbeck:
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
        bernoulli(eos, speed),
        float(curve[steady].std()),
        int(run.summary["particles"]),
    )


def bernoulli(eos: EquationOfState, speed: float) -> float:
    """Stagnation pressure [Pa] of a steady compressible stream: the integral of dp/rho from rest to it is u0^2/2."""
    rho = eos.rho0 * (1.0 + np.linspace(0.0, eos.hugoniot(speed)[2], 2001))
    p = np.array([eos.pressure(value / eos.rho0 - 1.0) for value in rho]) - eos.pressure_at_rest
    return float(np.interp(0.5 * speed**2, cumulative_trapezoid(1.0 / rho, p, initial=0.0), p))
