"""A campaign folder made by `doe` from a real case, with a formula in the solver's place."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from birdstrike.data.curves import write_measured
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.version import SOLVER_VERSION
from tests.inversion.stand_in import CHANNEL, TIMES, pulse, record

RUNS = 25
TIME = np.linspace(0.0, 3.0e-3, 601)


def strike(
    case: Case,
    *,
    step_factor: float = 1.0,  # noqa: ARG001 (a solver takes it)
    threads: int | None = None,  # noqa: ARG001
    progress: Progress = silent,
) -> Histories:
    """Viscosity and pressure cutoff shape a pulse; erosion does nothing."""
    y = curve(case.bird.material.viscosity, case.bird.material.pressure_cutoff)
    channels = {CHANNEL: y, "contact_force": 1e3 * np.gradient(y, TIME), "reaction_force": 2e3 * np.gradient(y, TIME)}
    progress(1.0)
    return Histories(
        TIME, channels, {CHANNEL: "m", "contact_force": "N", "reaction_force": "N"}, {"eroded_mass_fraction": 0.0}
    )


def curve(viscosity: float, cutoff: float) -> np.ndarray:
    """Displacement [m] for a viscosity [Pa s] and a pressure cutoff [Pa]."""
    thick, weak = viscosity / 1500.0, -cutoff / 1.25e6
    return pulse(np.array([6.0e-3 - 1.0e-3 * thick, 2.4e-3 + 0.25e-3 * weak, 0.1 + 0.1 * thick, 0.0]), TIME)


def build(folder: Path, design: str | Path = "lhs", case: Case | None = None) -> Case:
    """A finished campaign of the reference strike in `folder`."""
    base = case or load_case("reference_strike")
    made = make_design(str(design), ParameterSpace.of(base.parameters()), RUNS, 0)
    with ThreadPoolExecutor(1) as pool:
        run_campaign(
            base,
            made,
            folder,
            workers=1,
            simulate=strike,
            solver_version=SOLVER_VERSION,
            executor=pool,
            say=lambda _: None,
        )
    return base


def write_record(path: Path, viscosity: float = 600.0, cutoff: float = -0.5e6, size: float = 1.0) -> Path:
    """What an instrument would have seen of `size` times the curve, with 0.03 mm of noise."""
    values = size * np.interp(TIMES, TIME, curve(viscosity, cutoff)) + 3e-5 * np.random.default_rng(0).normal(
        size=len(TIMES)
    )
    measured = record(np.array([5e-3, 2.5e-3, 0.1, 0.0]))
    write_measured(path, type(measured)(TIMES, {CHANNEL: values}, {}, {CHANNEL: "m"}, ("SIMULATED by a formula",)))
    return path
