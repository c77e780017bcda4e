"""Analytic toy models of a diagnosis: known tangent planes and signatures, in whitened rows."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.linear import Linear
from birdstrike.inversion.diagnosis.statistics import Reference

T = np.linspace(0.0, 1.0, 120)
PARAMETERS = np.stack([np.sin(np.pi * T), T * np.exp(-2.0 * T)], axis=1) * 30.0
SIGNATURES = {
    "ringing": 4.0 * np.sin(11.0 * np.pi * T),
    "late": 4.0 * np.maximum(T - 0.6, 0.0) ** 0.5,
    "step": 3.0 * (T > 0.3),
    "echo": 4.0 * np.sin(11.0 * np.pi * T + 0.05),  # a twin of ringing
}
PRIOR = np.sqrt(12.0)


def linear(own: str | None, data: Array, names: tuple[str, ...] = ("ringing", "late", "step")) -> Linear:
    """The model with the effect `own` free, for whitened data."""
    effects = np.stack([SIGNATURES[name] for name in names], axis=1)
    columns = [PARAMETERS] + ([SIGNATURES[own][:, None]] if own else [])
    design = np.hstack(columns)
    prior = np.zeros((2, design.shape[1]))
    prior[:, :2] = PRIOR * np.eye(2)
    rows = np.vstack([design, prior])
    residual = np.concatenate([data, np.zeros(2)])
    return Linear(names, residual, rows, np.vstack([effects, np.zeros((2, len(names)))]), np.zeros(len(names), bool))


def judged(own: str | None, data: Array, names: tuple[str, ...] = ("ringing", "late", "step")) -> float:
    """p of the model."""
    return Reference.of(linear(own, data, names), draws=4000).judge().p


def records(count: int, truth: Array, seed: int = 0) -> Array:
    """(count, n) truth with unit noise."""
    return truth + np.random.default_rng(seed).standard_normal((count, len(T)))
