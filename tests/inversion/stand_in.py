"""A cheap forward model with known answers: a damped pulse of four parameters, and a campaign of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array, Histories

NAMES = ("pulse.peak", "pulse.period", "pulse.damping", "pulse.rebound")
LOWS = np.array([4.0e-3, 2.4e-3, 0.05, 0.0])
HIGHS = np.array([7.0e-3, 2.7e-3, 0.25, 0.8e-3])
UNITS = ("m", "s", "", "m")
TIME = np.linspace(0.0, 3.0e-3, 301)
CHANNEL = "displacement_centre"
TIMES = np.linspace(0.4e-3, 2.6e-3, 12)
START = 0.3e-3


def pulse(theta: Array, time: Array = TIME) -> Array:
    """Displacement [m] from 0.3 ms on: a damped sine with a bump of height `rebound` at 2.2 ms; theta (4,)."""
    peak, period, damping, rebound = theta
    phase = 2.0 * np.pi * np.maximum(time - START, 0.0) / period
    return peak * np.exp(-damping * phase) * np.sin(phase) + rebound * np.exp(-(((time - 2.2e-3) / 0.3e-3) ** 2))


def forward(theta: Mapping[str, float]) -> Histories:
    """The pulse as a solver would return it, with a second channel proportional to its speed."""
    y = pulse(np.array([theta[name] for name in NAMES]))
    channels = {CHANNEL: y, "contact_force": 1e3 * np.gradient(y, TIME)}
    return Histories(TIME, channels, {CHANNEL: "m", "contact_force": "N"})


def campaign(design: Array) -> Dataset:
    """A campaign of the pulse at `design` (n, 4) in 0..1."""
    theta = LOWS + design * (HIGHS - LOWS)
    runs = [forward(dict(zip(NAMES, row, strict=True))) for row in theta]
    return Dataset(
        names=NAMES,
        units=UNITS,
        lows=LOWS,
        highs=HIGHS,
        runs=np.arange(1, len(theta) + 1),
        parameters=theta,
        time=TIME,
        curves={name: np.stack([run.channels[name] for run in runs]) for name in runs[0].channels},
        channel_units=dict(runs[0].units),
        smooth=np.ones(len(theta), dtype=bool),
        case_hash="stand-in",
    )


def over_decades(dataset: Dataset) -> Dataset:
    """The same runs, their first parameter sought over three decades in its logarithm."""
    low, high = dataset.lows.copy(), dataset.highs.copy()
    low[0], high[0] = 1e-5, 1e-2
    wide = replace(dataset, lows=low, highs=high, scales=("logarithmic", *("linear",) * (len(NAMES) - 1)))
    return replace(wide, parameters=wide.to_physical(dataset.to_unit(dataset.parameters)))


def spread(runs: int = 40, seed: int = 0) -> Array:
    """A space-filling design (runs, 4) in 0..1."""
    return qmc.LatinHypercube(4, rng=seed, optimization="random-cd").random(runs)


def diagonal(runs: int = 25) -> Array:
    """A design like Table 6 of the bird-strike paper: all parameters rise or fall together."""
    k = np.linspace(0.0, 1.0, runs)
    return np.stack([1.0 - k, k, k, 1.0 - k], axis=1)


def truth(share: float | Sequence[float] | Array) -> Array:
    """Parameters at a share of their ranges."""
    return LOWS + np.asarray(share) * (HIGHS - LOWS)


def record(theta: Array, times: Array = TIMES, noise: float = 0.0, t0: float = 0.0, seed: int = 0) -> Measured:
    """The pulse as an instrument would give it, its clock t0 [s] ahead of the model's."""
    values = pulse(theta, times - t0) + noise * np.random.default_rng(seed).normal(size=len(times))
    return Measured(times, {CHANNEL: values}, {}, {CHANNEL: "m"}, ("SIMULATED by a formula",), "stand_in.csv")
