"""A clamped plate set in motion without a bird, against another code on the same mesh."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.problems.assembly import impulse_target, panel_reference, set_in_motion

END = 6e-4  # s, past the centre's peak; make verify runs on


def test_an_impulsively_loaded_target_follows_openradioss_past_its_peak():
    """Centre and a point beside it within 1 % of their peaks (RMS), with plasticity and large deflections."""
    table = panel_reference("openradioss_plate_impulse")
    clock = 1e-3 * table["time [ms]"].to_numpy()
    seen = clock <= END
    time, deflections = set_in_motion(impulse_target(), END)
    for name, ours in deflections.items():
        truth = 1e-3 * table[f"qeph42_{name} [mm]"].to_numpy()
        error = np.sqrt(np.mean((np.interp(clock[seen], time, ours) - truth[seen]) ** 2)) / truth.max()
        assert error < 0.01, name
    assert deflections["centre"].max() == pytest.approx(0.02452, rel=0.02)
