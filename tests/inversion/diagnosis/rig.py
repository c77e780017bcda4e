"""A rig so small that a diagnosis of it from nothing takes seconds: few shells, few particles, four effects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.inversion.diagnosis.preparation.plan import make_plan
from birdstrike.solver.case.case import Case, case_from_table
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.simulate import simulate

NOISE = 2e-5
PARTICLES = 120
SOUGHT = ("clamp_rotation", "plate_thickness", "impact_speed", "bird_friction")
"""The solver's effects that are looked for, beside those of the instrument."""


def tiny() -> Case:
    return case_from_table(
        {
            "plate": {
                "length": "300 mm", "width": "300 mm", "thickness": "6 mm", "elements": [10, 8], "edges": "clamped",
                "material": {"young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "690 MPa"},
            },
            "bird": {
                "shape": "hemispherical_cylinder", "diameter": "60 mm", "length": "110 mm", "density": "938 kg/m^3",
                "method": "sph", "particles": PARTICLES,
                "material": {
                    "model": "null", "pressure_cutoff": "-0.4 MPa", "viscosity": "400 Pa s",
                    "eos": {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48},
                },
            },
            "impact": {"speed": "80 m/s", "angle": "45 deg", "standoff": "1 mm"},
            "time": {"end": "0.9 ms", "output_interval": "10 us"},
            "sensors": {
                "displacement_centre": {"kind": "displacement", "noise": "0.02 mm"},
                "displacement_side": {"kind": "displacement", "at": ["75 mm", "0 mm"], "noise": "0.02 mm"},
            },
            "inversion": {"parameters": {"bird.material.viscosity": {"range": ["100 Pa s", "1000 Pa s"]}}},
        },
        "tiny",
    )  # fmt: skip


def as_solver(formula: Callable[[Case], Histories]) -> Callable[..., Histories]:
    """A formula in the solver's place: it takes what `simulate` takes, and needs none of it."""

    @wraps(formula)
    def strike(
        case: Case,
        *,
        step_factor: float = 1.0,  # noqa: ARG001 (a solver takes it)
        threads: int | None = None,  # noqa: ARG001
        progress: Progress = silent,  # noqa: ARG001
    ) -> Histories:
        return formula(case)

    return strike


@contextmanager
def few_simulations(particles: int = PARTICLES, sought: Sequence[str] = SOUGHT) -> Iterator[pytest.MonkeyPatch]:
    """A plan of 9 coarse and 5 fine simulations (four on two lattices), few effects.

    On threads, because processes would load all anew.
    """
    library = {name: effects()[name] for name in sought}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.process_pool", ThreadPoolExecutor)
        patch.setattr("birdstrike.inversion.diagnosis.preparation.plan.effects_of", lambda _: library)
        patch.setattr("birdstrike.inversion.diagnosis.preparation.plan.COARSE_PARTICLES", particles)
        patch.setattr("birdstrike.inversion.diagnosis.preparation.plan.FINE_RUNS", 5)
        patch.setattr("birdstrike.inversion.diagnosis.conclusions.solver_update.MOST", 1)
        patch.setattr("birdstrike.inversion.diagnosis.conclusions.solver_update.REPLICATES", 2)
        patch.setattr(
            "birdstrike.inversion.diagnosis.diagnose.make_plan",
            lambda case, _, seed, first: make_plan(case, 9, seed, first),
        )
        yield patch


def shot(folder: Path, name: str, seed: int, **changes: dict[str, Any]) -> Path:
    """A record by a mesh that the diagnosis does not have."""
    case = tiny().with_mesh(960, (20, 16)).overlaid({"bird": {"jitter": 0.05}, **changes})
    found, rng = simulate(case), np.random.default_rng(seed)
    time = found.time[::2]
    channels = {k: v[::2] + NOISE * rng.standard_normal(len(time)) for k, v in found.channels.items()}
    write_measured(folder / f"{name}.csv", Measured(time, channels, {}, dict.fromkeys(channels, "m"), ("SIMULATED",)))
    return folder / f"{name}.csv"
