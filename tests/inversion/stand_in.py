"""A cheap forward model with known answers: a damped pulse of four parameters, and a campaign of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import qmc

from data.curves import Measured
from data.dataset import Dataset
from data.histories import Array, Histories

NAMES = ("pulse.peak", "pulse.period", "pulse.damping", "pulse.tilt")
LOWS = np.array([4.0e-3, 2.2e-3, 0.05, -0.3])
HIGHS = np.array([7.0e-3, 2.8e-3, 0.45, 0.3])
TIME = np.linspace(0.0, 3.0e-3, 301)
CHANNEL = "displacement_centre"
START = 0.3e-3


def pulse(theta: Array, time: Array = TIME) -> Array:
    """Displacement [m] that starts at 0.3 ms: a damped sine whose phase is bent by `tilt`; theta (4,)."""
    peak, period, damping, tilt = theta
    tau = np.maximum(time - START, 0.0) / period
    phase = 2.0 * np.pi * tau * (1.0 + tilt * tau)
    return peak * np.exp(-damping * phase) * np.sin(phase)


def forward(theta: Mapping[str, float]) -> Histories:
    """The pulse as a solver would return it."""
    y = pulse(np.array([theta[name] for name in NAMES]))
    return Histories(TIME, {CHANNEL: y, "contact_force": 1e6 * np.gradient(y, TIME)}, {CHANNEL: "m", "contact_force": "N"})


def dataset(design: Array) -> Dataset:
    """A campaign of the pulse at `design` (n, 4) in 0..1."""
    theta = LOWS + design * (HIGHS - LOWS)
    runs = [forward(dict(zip(NAMES, row, strict=True))) for row in theta]
    curves = {name: np.stack([run.channels[name] for run in runs]) for name in runs[0].channels}
    n = len(design)
    return Dataset(
        NAMES, ("m", "s", "", ""), LOWS, HIGHS, np.arange(1, n + 1), theta, TIME, curves, runs[0].units, np.ones(n, bool), "stand-in"
    )


def spread(runs: int = 40, seed: int = 0) -> Array:
    """A space-filling design (runs, 4) in 0..1."""
    return qmc.LatinHypercube(4, seed=seed, optimization="random-cd").random(runs)


def record(theta: Array, times: Array, noise: float = 0.0, t0: float = 0.0, seed: int = 0, channel: str = CHANNEL) -> Measured:
    """The pulse as an instrument would give it, its clock t0 [s] ahead of the model's."""
    values = pulse(theta, times - t0) + noise * np.random.default_rng(seed).normal(size=len(times))
    return Measured(times, {channel: values}, {}, {channel: "m"}, ("SIMULATED by a formula",), "stand_in.csv")
