"""Late and slow are alike to first order: on a formula in the solver's place each is named, with its size."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.diagnose import diagnose
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.instrument import Instrument, recorded
from tests.inversion.diagnosis.rig import few_simulations, tiny

TIME = np.linspace(0.0, 0.9e-3, 181)
NOISE = 1.5e-5  # m
CENTRE, SIDE = "displacement_centre", "displacement_side"
UNITS = {"displacement": "m", "strain": "1", "strain_principal": "1", "contact_force": "N", "reaction_force": "N"}


def deflections(viscosity: float, speed: float, thickness: float) -> dict[str, Array]:
    """channel -> (m,) [m]: a bending mode, and a faster one that a viscous bird excites less."""
    t = np.maximum(TIME - 2e-5, 0.0)
    rise = -np.expm1(-((t / (1.2e-4 * (viscosity / 400.0) ** 0.15)) ** 2))
    slow = np.sin(4.4e3 * thickness / 6e-3 * t) * np.exp(-t / 1.5e-3)
    fast = np.sin(2.3e4 * thickness / 6e-3 * t) * np.exp(-t / 3e-4 * (400.0 / viscosity) ** 0.1)
    size = 4e-3 * (speed / 80.0) ** 1.3 * (6e-3 / thickness) ** 1.5
    return {CENTRE: size * rise * (slow + 0.25 * fast), SIDE: 0.7 * size * rise * (slow - 0.15 * fast)}


def strike(
    case: Case,
    *,
    step_factor: float = 1.0,  # noqa: ARG001 (a solver takes it)
    threads: int | None = None,  # noqa: ARG001
    progress: Callable[[float], None] | None = None,  # noqa: ARG001
) -> Histories:
    """What a simulation would give; every other sensor reads a mixture of the two."""
    own = deflections(case.bird.material.viscosity, case.impact.speed, case.plate.thickness)
    rest = {name: 0.3 * own[CENTRE] + 0.4 * own[SIDE] for name in case.sensors if name not in own}
    channels = own | rest
    units = {name: UNITS[case.sensors[name].kind] for name in channels}
    return Histories(TIME, channels, units, {"eroded_mass_fraction": 0.0})


def shot(instruments: dict[str, Instrument]) -> Measured:
    """What the two sensors record."""
    rng, time = np.random.default_rng(3), TIME[::2]
    curves = deflections(430.0, 80.0, 6e-3)
    seen = {name: recorded(instruments.get(name), TIME, curve)[::2] for name, curve in curves.items()}
    seen = {name: curve + NOISE * rng.standard_normal(len(time)) for name, curve in seen.items()}
    sigma = {name: np.full(len(time), NOISE) for name in seen}
    return Measured(time, seen, sigma, dict.fromkeys(seen, "m"), ("SIMULATED by a formula",), "shot.csv")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose simulations the others use."""
    return tmp_path_factory.mktemp("late_and_slow") / "first"


@pytest.mark.parametrize(
    ("effect", "size", "own"),
    [
        ("time_offset", 5e-5, {"time_offset": "50 us"}),
        ("time_offset", -5e-5, {"time_offset": "-50 us"}),
        ("sensor_bandwidth", 5e-5, {"bandwidth": f"{1.0 / (2.0 * np.pi * 5e-5)} Hz"}),
    ],
)
def test_late_and_slow_are_told_apart(
    simulated: Path, tmp_path: Path, effect: str, size: float, own: dict[str, str]
) -> None:
    measured = shot({CENTRE: Instrument.model_validate(own)})
    out, further = (tmp_path, simulated) if simulated.exists() else (simulated, None)
    with few_simulations(sought=("plate_thickness", "impact_speed")) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        found = diagnose(tiny(), measured, out, doe=further)
    first = max(found.effects, key=lambda one: one.probability)
    assert first.name == f"{effect}.{CENTRE}"
    assert first.probability > 0.95
    assert first.interval_95 is not None
    low, high = first.interval_95
    assert low < size < high
    assert high - low < 1e-5
