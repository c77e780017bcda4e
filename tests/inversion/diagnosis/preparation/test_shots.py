"""Reading a record for a diagnosis: where the noise comes from, correlation, outliers, averaging."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError
from birdstrike.inversion.diagnosis.preparation.shots import Record, read_record
from birdstrike.inversion.observations.baseline import baseline_of
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.noise import Noise
from birdstrike.inversion.observations.observations import observed

STEP = 5e-6
TIME = STEP * np.arange(-120, 400)
SHAPE = 5e-3 * np.where(TIME > 0.0, np.sin(np.pi * np.maximum(TIME, 0.0) / 2e-3), 0.0)
UNITS = {"middle": "m"}
WHITE = np.random.default_rng(0).standard_normal(len(TIME))


def measured(noise: np.ndarray) -> Measured:
    return Measured(TIME, {"middle": SHAPE + 1e-4 * noise}, {}, UNITS)


def read(record: Measured, **stated: float) -> Record:
    return read_record(record, Expected(UNITS, 0.0, 2e-3, 0.0, stated))


def test_the_record_before_contact_tells_the_noise() -> None:
    (trace,) = read(measured(WHITE)).traces
    assert trace.noise.source == "record before contact"
    assert trace.noise.level == pytest.approx(1e-4, rel=0.2)
    assert trace.noise.freedom == 118
    assert trace.noise.correlation_time == 0.0


def test_a_stated_noise_stands_until_the_record_rejects_it() -> None:
    assert read(measured(WHITE), middle=1e-4).traces[0].noise.source == "case"
    loud = read(measured(WHITE), middle=6e-5)
    assert loud.traces[0].noise.source == "record before contact"
    assert "which is used instead" in loud.warnings[0]


def test_a_drifting_sensor_is_not_taken_for_noise() -> None:
    clean = measured(WHITE)
    drifting = replace(clean, channels={"middle": clean.channels["middle"] + 1.0 * (TIME - TIME[0])})  # m/s
    (trace,) = read(drifting, middle=1e-4).traces
    assert trace.noise.source == "case"
    assert trace.noise.correlation_time == 0.0
    assert read(drifting).traces[0].noise.level == pytest.approx(1e-4, rel=0.2)


def test_what_a_sensor_reads_at_rest_is_subtracted_as_in_a_calibration() -> None:
    """An offset of 0.3 mm passed for a part of the response, and for a fault of the sensor."""
    clean = measured(WHITE)
    shifted = replace(clean, channels={"middle": clean.channels["middle"] + 3e-4})
    expected = Expected(UNITS, 0.0, 2e-3, 0.0, {"middle": 1e-4})
    record = read_record(shifted, expected)
    (trace,), (channel,) = record.traces, observed(shifted, expected).channels
    assert trace.values == pytest.approx(channel.values)
    assert np.mean(trace.values - clean.channels["middle"][TIME >= 0.0]) == pytest.approx(0.0, abs=2e-5)
    assert sum("before contact" in line and "its zero is taken from there" in line for line in record.warnings) == 1
    own = 1e-8 * np.eye(len(trace.values))
    assert trace.covariance() - own == pytest.approx(np.full(own.shape, 1e-8 / 120), rel=0.3)


def test_a_drift_is_left_for_the_diagnosis_to_find_less_what_it_reads_at_the_record_s_zero() -> None:
    clean = measured(WHITE)
    drifting = replace(clean, channels={"middle": clean.channels["middle"] + 3e-4 + 0.3 * TIME})  # m/s
    record = read(drifting, middle=1e-4)
    (trace,) = record.traces
    left = trace.values - clean.channels["middle"][TIME >= 0.0]
    assert left == pytest.approx(0.3 * TIME[TIME >= 0.0], abs=6e-5)
    assert np.ptp(left - 0.3 * TIME[TIME >= 0.0]) < 1e-12
    assert sum("its zero is taken from there" in line for line in record.warnings) == 1
    force = replace(drifting, channels={"middle": 1e6 * drifting.channels["middle"]}, units={"middle": "N"})
    (gone,) = read_record(force, Expected({"middle": "N"}, 0.0, 2e-3, 0.0, {"middle": 100.0})).traces
    assert 1e-6 * gone.values == pytest.approx(clean.channels["middle"][TIME >= 0.0], abs=4e-4)
    uncertain = np.diag(gone.covariance()) - 1e4
    assert uncertain[-1] > 10.0 * uncertain[0] > 0.0  # of a drift that goes on


@pytest.mark.parametrize("hum", [0.0, 50.0])
def test_a_baseline_without_its_drift_is_that_of_the_record_s_zero(hum: float) -> None:
    times = np.linspace(-0.03, -1e-4, 400)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(len(times))
    values = 2e-3 + 0.1 * times + 5e-4 * np.sin(2.0 * np.pi * hum * times) + noise
    whole = baseline_of(times, values, 1e-10, hum)
    assert whole is not None
    kept, later = whole.without_drift(), np.array([0.0, 1e-3, 2e-3])
    slope = whole.coefficients[1]
    assert kept.at(later) == pytest.approx(whole.at(later) - slope * later)
    assert (kept.columns(later[:1]) ** 2).sum() == pytest.approx((whole.columns(later[:1]) ** 2).sum())
    said = kept.sentence("displacement_centre", "m")
    assert ("drift is kept" in said) is (hum == 0.0)
    assert "import --zero" not in said


def test_correlated_noise_is_found_with_its_covariance() -> None:
    rho = 0.6
    noise = np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], WHITE))
    (trace,) = read(measured(noise)).traces
    covariance = trace.covariance()
    assert covariance[0, 1] / covariance[0, 0] == pytest.approx(rho, abs=0.15)


def test_single_outliers_are_left_out_and_told() -> None:
    noise = WHITE.copy()
    noise[[200, 300]] += 30.0
    record = read(measured(noise), middle=1e-4)
    assert len(record.values) == 398
    assert "2 points" in record.warnings[0]
    assert "far off their neighbours" in record.warnings[0]


def test_a_saturated_sensor_is_cut_and_not_taken_for_truth() -> None:
    """The amplifier ends at 4 mm of 5: readings at its end, and those within reach of their noise beside them, are left
    out, and the rest stays as it was."""
    clean = measured(WHITE)
    flat = np.minimum(clean.channels["middle"], 4e-3)
    (trace,) = (record := read(replace(clean, channels={"middle": flat}), middle=1e-4)).traces
    assert trace.values.max() < 4e-3
    assert np.isin(TIME[(TIME >= 0.0) & (SHAPE < 3.2e-3)], trace.times).all(), "8 sigma below the end nothing is cut"
    assert SHAPE[np.isin(TIME, trace.times)].max() < 4e-3 - 3e-4, "nor is anything kept within 3"
    assert any("clipped" in warning for warning in record.warnings)
    kept = np.isin(TIME, trace.times)
    np.testing.assert_array_equal(trace.values, flat[kept])


def test_neighbours_are_averaged_beyond_what_the_fit_can_use() -> None:
    fine = STEP / 8 * np.arange(3200)
    noise = np.random.default_rng(1).standard_normal(3200)
    record = read(Measured(fine, {"middle": 1e-4 * noise}, {}, UNITS), middle=1e-4)
    (trace,) = record.traces
    assert (trace.block, len(trace.values)) == (8, 400)
    assert np.sqrt(np.diag(trace.covariance())) == pytest.approx(1e-4 / np.sqrt(8.0))
    assert np.std(trace.values) == pytest.approx(1e-4 / np.sqrt(8.0), rel=0.1)


def test_correlated_noise_is_averaged_as_it_is_correlated() -> None:
    rho, block, count = 0.8, 6, 400
    times = STEP * np.arange(count * block)
    noise = Noise(np.linspace(1.0, 2.0, count * block), -STEP / np.log(rho), "case")
    raw = noise.covariance(times)
    assert raw[0, 1] == pytest.approx(rho * noise.sigma[0] * noise.sigma[1])
    means = np.repeat(np.eye(count), block, axis=1) / block
    assert noise.covariance(times, block) == pytest.approx(means @ raw @ means.T, rel=1e-9)


def test_an_unknown_channel_and_an_empty_window_are_named() -> None:
    with pytest.raises(MeasuredError, match="no sensor of the case"):
        read_record(measured(WHITE), Expected({"other": "m"}, 0.0, 2e-3, 0.0))
    with pytest.raises(MeasuredError, match="0 points"):
        read_record(measured(WHITE), Expected(UNITS, 5e-3, 6e-3, 0.0))
