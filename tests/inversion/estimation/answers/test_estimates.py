"""A parameter that the curve does not determine is reported as not identified, with the reason."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.estimates import intervals, reported
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.coordinates import Box
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.invert import invert
from birdstrike.inversion.results.estimates import Estimate
from tests.inversion import eroding, stand_in
from tests.inversion.stand_in import CHANNEL, TIMES, record, truth

VISCOSITY, TENSION, COMPRESSION = eroding.NAMES


@pytest.fixture(scope="module")
def campaign() -> Dataset:
    return eroding.campaign()


def estimates(campaign: Dataset, theta: list[float], noise: float = 3e-5) -> dict[str, Estimate]:
    measured = record(truth(0.5))
    values = np.interp(TIMES, eroding.TIME, eroding.curve(np.array(theta)))
    values = values + noise * np.random.default_rng(0).normal(size=len(TIMES))
    measured = type(measured)(TIMES, {CHANNEL: values}, {}, {CHANNEL: "m"}, (), "eroding.csv")
    options = InversionOptions(sampling=None, analyse=False, method="emulator", noise={CHANNEL: noise})
    return dict(invert(campaign, measured, eroding.forward, options).inversion.methods["emulator"].parameters)


def test_interval_is_the_hull_of_all_minima_that_fit() -> None:
    def mode(z: float, sd: float, low: float, high: float, off: bool) -> Mode:
        box = Box(np.array([low]), np.array([high]), np.array([off]), np.array([low]), np.array([high]))
        return Mode(np.array([z]), np.array([z]), 0.0, np.diag([sd**2, 0.0]), 0.0, np.zeros(1), box)

    best, other = mode(0.9, 0.01, 0.8, 1.0, False), mode(0.3, 0.05, 0.0, 0.7, True)
    np.testing.assert_allclose(intervals((best,)), [[0.9 - 0.0196, 0.9 + 0.0196]], atol=1e-4)
    np.testing.assert_allclose(intervals((best, other)), [[0.0, 0.9 + 0.0196]], atol=1e-4)
    np.testing.assert_allclose(intervals((other, best)), [[0.0, 0.9 + 0.0196]], atol=1e-4)
    wide = mode(0.9, 0.5, 0.8, 1.0, False)
    np.testing.assert_allclose(intervals((wide,)), [[0.8, 1.0]])


def test_campaign_has_a_run_that_lost_the_bird(campaign: Dataset) -> None:
    assert 0 < (~campaign.smooth).sum() < 5


def test_parameter_that_is_off_is_not_identified_and_the_felt_one_is(campaign: Dataset) -> None:
    found = estimates(campaign, [600.0, 0.4, 0.5])
    assert found[VISCOSITY].identified
    assert found[VISCOSITY].value == pytest.approx(600.0, abs=60.0)
    assert not found[TENSION].identified
    interval = found[TENSION].interval_95
    assert interval is not None
    assert interval[0] == pytest.approx(0.05)
    assert interval[1] >= 1.0
    assert "off" in found[TENSION].reason


def test_parameter_without_any_effect_says_how_little_it_does(campaign: Dataset) -> None:
    """Compression erosion is flat below 0.97 and off from 1: its interval is the whole range, across the gap."""
    found = estimates(campaign, [600.0, 0.4, 0.5])[COMPRESSION]
    assert not found.identified
    assert found.interval_95 == pytest.approx((0.05, 1.25))
    assert "over its whole range, less than the noise (0.03 mm)" in found.reason


def test_active_limit_is_found_on_its_own_side(campaign: Dataset) -> None:
    found = estimates(campaign, [600.0, 1.15, 0.5])[TENSION]
    assert found.value == pytest.approx(1.15, abs=0.02)
    assert found.interval_95 is not None
    assert found.interval_95[0] > 1.0
    assert found.identified


def test_two_parameters_that_make_up_for_each_other_name_each_other() -> None:
    """Few early points: peak and period of the pulse can be traded."""
    dataset, times = stand_in.campaign(stand_in.spread()), np.linspace(0.4e-3, 0.7e-3, 6)
    options = InversionOptions(sampling=None, analyse=False, method="emulator", noise={CHANNEL: 5e-5})
    found = (
        invert(dataset, record(truth(0.5), times), stand_in.forward, options).inversion.methods["emulator"].parameters
    )
    assert not found["pulse.period"].identified
    unclear = [e.reason for e in found.values() if not e.identified]
    assert any("can make up for it (correlation" in text for text in unclear)
    rebound = found["pulse.rebound"]
    assert not rebound.identified
    assert "less than the noise" in rebound.reason


def test_reported_interval_holds_its_value_and_is_the_range_of_what_is_not_identified() -> None:
    assert reported(0.0, (0.1, 0.4), (0.0, 1.0), True) == (0.0, 0.4)  # the mode at an end, the quantiles inside
    assert reported(0.5, (0.1, 0.4), (0.0, 1.0), True) == (0.1, 0.5)
    assert reported(0.3, (0.1, 0.4), (0.0, 1.0), True) == (0.1, 0.4)
    assert reported(0.3, (0.1, 0.7), (0.0, 1.0), False) == (0.0, 1.0)


def test_estimate_outside_its_interval_is_known() -> None:
    assert not Estimate(0.0, (0.1, 0.4), "", True, "").consistent
    assert Estimate(0.1, (0.1, 0.4), "", True, "").consistent
    assert Estimate(None, (0.1, 0.4), "", False, "").consistent
