"""How far one curve is from another: in the channel's unit, as a share of the measured peak, in units of noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from birdstrike.data.histories import Array


def rms(values: ArrayLike) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def finite(value: float) -> float | None:
    """A figure as results hold it, None where it is not finite."""
    return float(value) if np.isfinite(value) else None


def rmse(model: Array, measured: Array) -> float:
    """Root mean square difference over the instants where both exist (n,), in their SI unit; NaN where none do."""
    difference = (model - measured)[np.isfinite(model) & np.isfinite(measured)]
    return rms(difference) if difference.size else float("nan")


def relative(model: Array, measured: Array) -> float:
    """`rmse` as a share of the largest measured magnitude."""
    return rmse(model, measured) / float(np.nanmax(np.abs(measured)))


def whitened(model: Array, measured: Array, sigma: Array) -> float:
    """Root mean square of the difference over its standard deviation sigma (n,); 1 = noise."""
    return rmse(model / sigma, measured / sigma)
