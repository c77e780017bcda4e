"""A stand-in with the bird's erosion limits: flat where they are off, felt where they act."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import qmc

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array, Histories
from tests.inversion.stand_in import CHANNEL, TIME, pulse

NAMES = ("bird.material.viscosity", "bird.material.tension_erosion", "bird.material.compression_erosion")
LOWS, HIGHS = np.array([0.0, 0.05, 0.05]), np.array([1500.0, 1.25, 1.25])


def curve(theta: Array) -> Array:
    """Viscosity lowers and delays the peak; active tension erosion takes from the tail; the third does nothing."""
    viscosity, tension = theta[0] / 1500.0, theta[1]
    y = pulse(np.array([6.0e-3 - 1.0e-3 * viscosity, 2.4e-3 + 0.2e-3 * viscosity, 0.1, 0.0]))
    taken = 0.6e-3 * (1.3 - tension) / 0.3 if tension > 1.0 else 0.0
    return y - taken * np.exp(-(((TIME - 2.2e-3) / 0.4e-3) ** 2))


def forward(theta: Mapping[str, float]) -> Histories:
    """As a solver would return it."""
    y = curve(np.array([theta[name] for name in NAMES]))
    return Histories(TIME, {CHANNEL: y}, {CHANNEL: "m"})


def campaign(runs: int = 40) -> Dataset:
    """Runs over the whole box; compression erosion between 0.97 and 1 deletes the bird and is not smooth."""
    unit = qmc.LatinHypercube(3, rng=1, optimization="random-cd").random(runs)
    theta = LOWS + unit * (HIGHS - LOWS)
    smooth = ~((theta[:, 2] > 0.97) & (theta[:, 2] < 1.0))
    curves = np.stack([curve(row) if kept else 0.2 * curve(row) for row, kept in zip(theta, smooth, strict=True)])
    return Dataset(
        NAMES,
        ("Pa s", "", ""),
        LOWS,
        HIGHS,
        np.arange(1, runs + 1),
        theta,
        TIME,
        {CHANNEL: curves},
        {CHANNEL: "m"},
        smooth,
        "e",
    )
