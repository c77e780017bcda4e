"""One reader of a measured record, for calibration and diagnosis alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError
from birdstrike.inversion.diagnosis.preparation.shots import read_record as read_for_diagnosis
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.observations.reader import CLIPPED, OUTLIER, OUTSIDE, read_record
from birdstrike.solver.case.case import load_case
from tests.inversion.stand_in import CHANNEL, record, truth

STEP = 1e-5
CLOCK = STEP * np.arange(-60, 320)
SIGMA = 2e-5
EXPECTED = Expected({CHANNEL: "m"}, 0.0, 3e-3, 0.0, {CHANNEL: SIGMA})


def measured(**changes: Any) -> Measured:
    """A pulse with noise, 0.6 ms before contact and 0.2 ms after the simulated record."""
    found = record(truth(0.5), CLOCK, noise=SIGMA)
    return replace(found, **changes)


def spoilt() -> Measured:
    """A gap, a flat top and an outlier in one record."""
    values = np.minimum(measured().channels[CHANNEL], 4e-3)
    values[100] = np.nan
    values[250] += 1e-3
    return replace(measured(), channels={CHANNEL: values})


def test_what_is_cut_is_named_with_its_instants() -> None:
    (channel,) = read_record(spoilt(), EXPECTED)
    cut = {one.reason: one.times for one in channel.cuts}
    np.testing.assert_array_equal(cut[OUTSIDE], [*CLOCK[:60], *CLOCK[361:]])
    np.testing.assert_array_equal(cut[OUTLIER], [CLOCK[250]])
    np.testing.assert_array_equal(cut[CLIPPED], CLOCK[spoilt().channels[CHANNEL] == 4e-3])
    assert len(cut[CLIPPED]) > 20
    assert len(channel.times) + sum(map(len, cut.values())) == len(CLOCK) - 1  # the gap
    assert len(channel.warnings) == 2


def test_values_are_never_changed() -> None:
    (channel,) = read_record(spoilt(), EXPECTED)
    np.testing.assert_array_equal(channel.values, spoilt().channels[CHANNEL][np.isin(CLOCK, channel.times)])


def test_calibration_and_diagnosis_read_the_same_points_and_noise(dataset: Dataset) -> None:
    (one,) = observe(spoilt(), dataset, {CHANNEL: SIGMA}).channels
    (other,) = read_for_diagnosis(spoilt(), EXPECTED).traces
    np.testing.assert_array_equal(one.times, other.times)
    np.testing.assert_array_equal(one.values, other.values)
    np.testing.assert_array_equal(one.noise, other.noise.sigma)


def test_a_stated_noise_that_the_record_before_contact_rejects() -> None:
    stated = replace(EXPECTED, noise={CHANNEL: 3.0 * SIGMA})
    (tested,) = read_record(measured(), stated)
    assert tested.noise.source == "record before contact"
    assert tested.noise.level == pytest.approx(SIGMA, rel=0.25)  # 58 degrees of freedom: 9 % at one sigma
    (kept,) = read_record(measured(), stated, test_stated=False)
    assert kept.noise.source == "case"
    assert (kept.noise.sigma == 3.0 * SIGMA).all()


@pytest.mark.parametrize("spike", [30, -500, 5000])
def test_one_spike_before_contact_does_not_overrule_a_stated_noise(spike: float) -> None:
    """Nor does it change the level: the fit of what is left is that of a record without this point."""
    values = measured().channels[CHANNEL].copy()
    values[17] += spike * SIGMA
    (spiked,) = read_record(measured(channels={CHANNEL: values}), EXPECTED)
    assert spiked.noise.source == "case"
    gap = values.copy()
    gap[17] = np.nan
    (without,) = read_record(measured(channels={CHANNEL: gap}), EXPECTED)
    assert spiked.noise.before == without.noise.before
    assert spiked.offset == without.offset
    assert not spiked.remarks


def test_noise_before_contact_without_spikes_keeps_every_point() -> None:
    """White noise, a drift, a burst of neighbours, and a digitiser that mostly reads one step: all points count."""
    rng, times = np.random.default_rng(1), STEP * np.arange(60)
    white = rng.standard_normal(60)
    burst, steps = white.copy(), np.zeros(60)
    burst[20:24] += 40.0
    steps[[7, 30, 41]] = 1.0
    for values in (white, white + 3e5 * times, burst, steps):
        before = BeforeContact.of(times, values, 100.0)
        assert len(before.times) == 60
        line = np.polynomial.Polynomial.fit(times, values, 1)(times)
        counting = 60 - 2.0 * before.correlation.of_mean  # 58 but of the burst, whose points are alike
        assert before.level == pytest.approx(np.sqrt(((values - line) ** 2).sum() / counting), rel=1e-9)
        assert (counting < 58) == (values is burst)


def test_what_is_left_out_or_correlated_says_what_it_means_and_what_to_do() -> None:
    (channel,) = read_record(spoilt(), EXPECTED)
    cut, single = channel.warnings
    assert "are clipped (the same reading in a row) and are left out: the fit does not know the curve there" in cut
    assert "give the sensor a larger range in the next shot, or look for why the logger stopped there" in cut
    assert "is far off its neighbours and is left out: single readings would pull the fit; look at the record" in single
    smooth = np.convolve(measured().channels[CHANNEL], np.full(4, 0.25), "same")
    (text,) = read_record(measured(channels={CHANNEL: smooth}), replace(EXPECTED, noise={}))[0].remarks
    assert "the noise before contact is correlated (0." in text
    assert "intervals are wider than with white noise; look for hum or a filter in the measuring chain" in text


def test_a_sigma_column_is_compared_where_the_plate_is_at_rest() -> None:
    """Noise that grows with the signal is right before contact and must stand."""
    growing = np.where(CLOCK < 0.0, SIGMA, 10.0 * SIGMA)
    (channel,) = read_record(replace(measured(), sigma={CHANNEL: growing}), EXPECTED)
    assert channel.noise.source == "sigma column"
    np.testing.assert_array_equal(channel.noise.sigma, growing[np.isin(CLOCK, channel.times)])


def test_a_sensor_that_does_not_read_zero_before_contact_is_named() -> None:
    shifted = {CHANNEL: measured().channels[CHANNEL] + 2e-4}
    (channel,) = read_record(replace(measured(), channels=shifted), EXPECTED)
    assert channel.offset == pytest.approx(2e-4, rel=0.05)
    assert any("reads 0.2 mm before contact" in remark for remark in channel.remarks)
    assert not read_record(measured(), EXPECTED)[0].remarks


def test_nothing_known_of_the_noise_is_one_per_cent_of_the_peak() -> None:
    every = slice(None, None, 9)  # too few points to estimate the noise from their scatter
    late = measured(time=CLOCK[every] + 1e-3, channels={CHANNEL: measured().channels[CHANNEL][every]})
    expected = Expected({CHANNEL: "m"}, 0.0, 4e-3, -1.0)
    (channel,) = read_record(late, expected)
    assert not channel.noise.known
    assert channel.noise.level == pytest.approx(0.01 * channel.peak)


def test_the_case_says_units_noise_and_when_the_plate_is_at_rest() -> None:
    case = load_case("reference_strike")
    expected = Expected.of_case(case, case.time.end, spare=1e-4)
    assert expected.end == pytest.approx(case.time.end - 1e-4)
    offset = case.inversion.nuisance.get("time_offset", 0.0)
    assert expected.rest_until == pytest.approx(case.first_contact - 1e-4 - 4.0 * offset)
    assert set(expected.units) == set(case.sensors)


def test_a_channel_with_too_few_points_is_refused_with_their_number() -> None:
    with pytest.raises(MeasuredError, match=r"has 1 point in the simulated record .* and needs 3"):
        read_record(measured(), replace(EXPECTED, start=1e-3 - 1e-9, end=1e-3), fewest=3)
    stuck = {CHANNEL: np.full(len(CLOCK), 1e-3)}
    with pytest.raises(MeasuredError, match=r"reads 1 mm everywhere: a dead or saturated sensor.*--channels"):
        read_record(measured(channels=stuck), EXPECTED)
