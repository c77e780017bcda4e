"""A rig with a formula in the solver's place: the deflection is proportional to speed and falls with viscosity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import write_measured
from birdstrike.data.histories import Array, Histories
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.solver.case.case import Case
from birdstrike.solver.version import SOLVER_VERSION
from tests.inversion.diagnosis.rig import as_solver, tiny
from tests.inversion.models.rig import TIME, record

VISCOSITY = 300.0  # Pa s, of the record
SPEED = 80.0  # m/s
PEAK = 4e-3  # m


def largest(viscosity: float, speed: float) -> float:
    """Of the centre's deflection [m]."""
    return PEAK * speed / SPEED * (1.0 - 0.2 * np.log10(viscosity / 300.0))


def deflection(viscosity: float, speed: float) -> Array:
    """(m,) [m]."""
    return largest(viscosity, speed) * np.sin(np.pi * TIME / TIME[-1])


@as_solver
def strike(case: Case) -> Histories:
    """The side moves by six tenths of the centre; a plate of less than 3 mm tears."""
    y = deflection(case.bird.material.viscosity, case.impact.speed)
    channels = {"displacement_centre": y, "displacement_side": 0.6 * y}
    torn = int(case.plate.thickness < 3e-3)
    return Histories(TIME, channels, dict.fromkeys(channels, "m"), {"eroded_mass_fraction": 0.0, "eroded_shells": torn})


def calibrated(folder: Path) -> Path:
    """A folder of train-and-invert: one shot at 80 m/s."""
    case = tiny()
    design = make_design("lhs", ParameterSpace.of(case.parameters()), 12, 0)
    with ThreadPoolExecutor(1) as pool:
        run_campaign(
            case,
            design,
            folder / "doe",
            workers=1,
            simulate=strike,
            solver_version=SOLVER_VERSION,
            executor=pool,
            say=lambda _: None,
        )
    rng = np.random.default_rng(1)
    run = strike(case.with_values({"bird.material.viscosity": VISCOSITY}))
    time = run.time[::2]
    seen = {name: values[::2] + 2e-5 * rng.standard_normal(len(time)) for name, values in run.channels.items()}
    example = record(case, "null", {}, 0, "shot")
    write_measured(folder / "shot.csv", type(example)(time, seen, {}, dict(run.units), ("SIMULATED by a formula",)))

    def forward(theta: Mapping[str, float]) -> Histories:
        return strike(case.with_values(theta))

    train_and_invert(folder / "doe", folder / "shot.csv", folder / "inversion", method="emulator", forward=forward)
    return folder / "inversion"


@contextmanager
def formula_for_solver() -> Iterator[None]:
    """No process is started and nothing is simulated."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        patch.setattr("birdstrike.doe.campaign.simulations.process_pool", ThreadPoolExecutor)
        yield
