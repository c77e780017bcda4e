"""A fitted emulator as plain tables of arrays: all that another program needs to give the same curves and errors.

A Gaussian process is mean(u) = sum_i weights_i m(|u / lengths - points_i|) with the Matern correlation of order 5/2,
m(r) = (1 + x + x^2 / 3) exp(-x), x = sqrt(5) r; the variance of its error is the mean of `squares`, each weighed by
m^locality, times Student's t (see gaussian_process). The same mean of `nearby` multiplies the `rest`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.surrogate.emulator import CurveEmulator, Emulator
from birdstrike.surrogate.features import FEATURES, which_logarithmic
from birdstrike.surrogate.gaussian_process import GaussianProcess, LocalVariance, student_inflation

FREEDOMS = 1.0 / np.linspace(1e-3, 0.5, 512)
"""Degrees of freedom at which Student's t is tabulated, equally spaced in their inverse."""


def student_table() -> Array:
    """(512,) factor on a variance known by FREEDOMS degrees of freedom."""
    return np.array([student_inflation(nu) for nu in FREEDOMS])


def process_table(process: GaussianProcess) -> dict[str, Any]:
    """weights (n,), and those of `variance_table`."""
    return {"weights": process.size * process.scale * np.asarray(process.model.alpha_)} | variance_table(process.missed)


def variance_table(missed: LocalVariance) -> dict[str, Any]:
    """lengths (d,), points (n, d) over the lengths, squares (n,) of the errors, locality."""
    return {
        "lengths": missed.lengths,
        "points": missed.points,
        "squares": missed.squares,
        "locality": missed.locality,
    }


def channel_table(channel: CurveEmulator) -> dict[str, Any]:
    """mean (m,), basis (p, m), processes of p scores, correlation (p, p) of their errors, SI; variances (m,): rest, on
    the average of the runs, nearby: its factor at a place, outside: of what that leaves out."""
    kept = len(channel.processes)
    return {
        "mean": channel.mean,
        "basis": channel.basis[:kept],
        "processes": [process_table(process) for process in channel.processes],
        "correlation": channel.mixing @ channel.mixing.T,
        "rest": (channel.remainder**2).sum(axis=0),
        "nearby": variance_table(channel.nearby),
        "outside": channel.outside,
    }


def emulator_table(emulator: Emulator) -> dict[str, Any]:
    """time (m,) [s]; features: how each parameter enters; varied: those that do; low, high: of the scaling to 0..1;
    regions: boxes [low, high] with runs behind them; channels by name."""
    time = next(iter(emulator.channels.values())).time
    last = [name.rsplit(".", 1)[-1] for name in emulator.names]
    logarithmic = which_logarithmic(emulator.names, emulator.scales)
    return {
        "names": list(emulator.names),
        "time": time,
        "features": [
            key if key in FEATURES else "logarithm" if log else "" for key, log in zip(last, logarithmic, strict=True)
        ],
        "varied": np.flatnonzero(~emulator.scaling.constant).tolist(),
        "low": emulator.scaling.low,
        "high": emulator.scaling.high,
        "regions": [[box.lows, box.highs] for box in emulator.regions],
        "channels": {name: channel_table(channel) for name, channel in emulator.channels.items()},
    }
