"""Shots of a rig with a formula in the solver's place: what the bird's stiffness, strength and viscosity do to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Histories
from birdstrike.inversion.models.candidates import calibrated_case, candidate
from birdstrike.solver.case.case import Case
from tests.inversion.diagnosis.rig import as_solver, tiny

TIME = np.linspace(0.0, 1.0e-3, 51)
NOISE = 1e-5
TRUTH = {"bird.material.eos.B": 60e6, "bird.material.eos.g": 7.0, "bird.material.viscosity": 300.0}
CALLS: list[str] = []


def shot(speed: float) -> Case:
    """The tiny rig at a speed, with two sensors."""
    return tiny().overlaid({"impact": {"speed": f"{speed} m/s"}})


@as_solver
def strike(case: Case) -> Histories:
    """A pulse whose size and period follow from the bulk modulus, its tail from strength and viscosity.

    A solid that fails erodes the more, the lower its failure strain.
    """
    CALLS.append(case.name)
    bird = case.bird.material.build(case.bird.actual_density)
    stiff = np.log10(bird.bulk_modulus / 1e8)
    drag = np.log10(1.0 + bird.viscosity / 300.0) + 0.3 * np.log10(1.0 + bird.shear_modulus / 1e6)
    speed = case.impact.speed / 80.0
    phase = np.pi * TIME / ((0.9 - 0.1 * stiff * speed) * 1e-3)
    y = 4e-3 * speed * (1.0 + 0.15 * stiff * speed) * np.exp(-0.3 * drag * speed * TIME / 1e-3) * np.sin(phase)
    lost = min(0.6, 0.3 / bird.failure_strain)
    channels = {"displacement_centre": y, "displacement_side": 0.6 * y + 2e-4 * drag * np.sin(2.0 * phase)}
    return Histories(TIME, channels, dict.fromkeys(channels, "m"), {"eroded_mass_fraction": lost})


def record(case: Case, truth: str, values: Mapping[str, float], seed: int, name: str) -> Measured:
    """What the sensors would have seen of a bird of the model `truth`."""
    run = strike(calibrated_case(candidate(truth), case).with_values(values))
    rng = np.random.default_rng(seed)
    time = run.time[::2]
    seen = {k: v[::2] + NOISE * rng.standard_normal(len(time)) for k, v in run.channels.items()}
    sigma = {k: np.full(len(time), NOISE) for k in seen}
    return Measured(time, seen, sigma, dict(run.units), ("SIMULATED",), f"{name}.csv")


def shots(truth: str = "murnaghan", values: Mapping[str, float] = TRUTH) -> tuple[list[Case], list[Measured]]:
    """Two speeds."""
    cases = [shot(60.0), shot(100.0)]
    return cases, [record(case, truth, values, i, f"shot_{i}") for i, case in enumerate(cases)]


@contextmanager
def formula_for_solver() -> Iterator[Any]:
    """No process is started and nothing is simulated."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.inversion.forward.simulate", strike)
        patch.setattr("birdstrike.inversion.models.simulations.process_pool", ThreadPoolExecutor)
        patch.setattr("birdstrike.inversion.models.joint_fit.AMPLITUDES", (0.0, 0.01, 0.03))
        yield patch
