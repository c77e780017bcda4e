"""The largest reading is the one farthest from zero, with its sign, wherever it is told."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.histories import Histories, farthest, largest
from birdstrike.reports.results import measurement
from birdstrike.solver import simulate

TIME = np.array([0.0, 1e-3, 2e-3, 3e-3])
COMPRESSED = np.array([0.0, 2e-4, -5e-4, np.nan])


def test_the_largest_reading_is_of_either_sign_and_passes_over_gaps() -> None:
    curves = np.array([COMPRESSED, -COMPRESSED, [0.0, 0.0, 0.0, 1e-6]])
    assert farthest(curves).tolist() == [2, 2, 3]
    assert largest(curves) == pytest.approx([-5e-4, 5e-4, 1e-6])
    assert float(largest(COMPRESSED)) == -5e-4


def test_summary_histories_and_report_tell_the_same_peak() -> None:
    """A gauge in compression had the peak of its rebound in summary.json, and the other one on the page."""
    histories = Histories(TIME, {"gauge": COMPRESSED}, {"gauge": ""})
    assert simulate.peak(TIME, COMPRESSED) == {"value": -5e-4, "time": 2e-3}
    assert histories.peak("gauge") == measurement.peak(TIME, COMPRESSED) == (2e-3, -5e-4)
