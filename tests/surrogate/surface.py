"""A surface that a small network can learn: known everywhere, so that learning can be told from memorising."""

from __future__ import annotations

import numpy as np

from birdstrike.surrogate.network import Shape
from birdstrike.surrogate.trainers.training import Samples

SHAPE = Shape(2, 6, 1)


def smooth_surface(n: int, seed: int = 0) -> Samples:
    """A bowl with a ripple on 0..1: n samples to train on, 20 to test on."""
    x = np.random.default_rng(seed).random((n + 20, 2))
    t = 0.5 + 0.3 * np.sin(3.0 * x[:, :1]) * (x[:, 1:] - 0.5) + 0.2 * x[:, 1:] ** 2
    return Samples(x[:n], t[:n], x[n:], t[n:])
