"""What a sensor reads at rest is no model error that a comparison of models hands on."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.inversion.observations.observations import observed
from birdstrike.inversion.observations.reader import Expected
from birdstrike.inversion.prediction.from_models import readings
from tests.inversion.diagnosis.rig import tiny

TIME = 5e-6 * np.arange(-120, 180)
SHAPE = 5e-3 * np.sin(np.pi * np.clip(TIME - 5e-5, 0.0, None) / 2e-3)
NAMES = ("displacement_centre", "displacement_side")


def record(offset: float) -> Measured:
    """One sensor with an offset, one without."""
    rng = np.random.default_rng(4)
    noisy = {name: SHAPE + 2e-5 * rng.standard_normal(len(TIME)) for name in NAMES}
    noisy[NAMES[0]] = noisy[NAMES[0]] + offset
    return Measured(TIME, noisy, {}, dict.fromkeys(NAMES, "m"))


def test_an_offset_of_a_record_is_no_error_of_the_models_that_were_calibrated_without_it() -> None:
    shifted, clean, end = record(3e-4), record(0.0), float(TIME[-1])
    found = readings(shifted, tiny(), end)
    assert found[NAMES[0]] == pytest.approx(clean.channels[NAMES[0]], abs=8e-6)
    assert found[NAMES[1]] == pytest.approx(clean.channels[NAMES[1]])
    fitted = {one.name: one for one in observed(shifted, Expected.of_case(tiny(), end)).channels}
    for name, values in found.items():
        assert np.interp(fitted[name].times, TIME, values) == pytest.approx(fitted[name].values, abs=1e-12)
