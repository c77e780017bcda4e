"""The clamped plate's step response by independent codes, and the distance of ours from theirs."""

from __future__ import annotations

import numpy as np
import pandas as pd

from data.histories import Array
from data.paths import REFERENCE


def reference(column: str) -> tuple[Array, Array]:
    """Time [s] and displacement [m] of one independent solution."""
    table = pd.read_csv(REFERENCE / "plate_step_response.csv", comment="#")
    return table["t_ms"].to_numpy() * 1e-3, table[column].to_numpy() * 1e-3


def rms_of_peak(time: Array, w: Array, column: str) -> float:
    """RMS difference from an independent solution, in % of its peak."""
    t, expected = reference(column)
    return 100.0 * float(np.sqrt(np.mean((np.interp(t, time, w) - expected) ** 2)) / expected.max())
