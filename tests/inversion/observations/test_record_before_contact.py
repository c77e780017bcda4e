"""What the record before contact gives: correlation, level and zero, under filters, mains hum and coarse digitisers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.shots import averaged
from birdstrike.inversion.diagnosis.preparation.shots import read_record as read_for_diagnosis
from birdstrike.inversion.observations.autocorrelation import Autocorrelation
from birdstrike.inversion.observations.baseline import Baseline, hum_of
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.noise import Noise, with_digitiser
from birdstrike.inversion.observations.reader import ChannelRecord, read_record
from birdstrike.solver.case.case import load_case
from tests.inversion.stand_in import CHANNEL, START, pulse, truth

SIGMA = 2e-5
END = 2.6e-3
EXPECTED = Expected({CHANNEL: "m"}, 0.0, END, START)


def instants(before: float, rate: float) -> Array:
    return np.arange(-round(before * rate), round(END * rate)) / rate


def first_order(rho: float, n: int, seed: int) -> Array:
    white = np.random.default_rng(seed).normal(size=n + 1000)
    return np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white))[1000:]


def filtered(n: int, rate: float, corner: float, seed: int) -> Array:
    """Noise of standard deviation SIGMA behind a Butterworth filter of two poles."""
    stages = butter(2, corner, fs=rate, output="sos")
    long = sosfilt(stages, np.random.default_rng(99).normal(size=200000))
    own = sosfilt(stages, np.random.default_rng(seed).normal(size=n + 5000))
    return SIGMA / float(np.std(long)) * np.asarray(own)[5000:]


def shot(clock: Array, added: Array | float) -> Measured:
    """The pulse and what an instrument has added [m]."""
    return Measured(clock, {CHANNEL: pulse(truth(0.5), clock) + added}, {}, {CHANNEL: "m"})


def read(measured: Measured, expected: Expected = EXPECTED, zero: bool = True) -> ChannelRecord:
    return read_record(measured, expected, test_stated=False, zero=zero)[0]


def zero_of(record: ChannelRecord) -> Baseline:
    assert record.baseline is not None
    return record.baseline


@pytest.mark.parametrize("rho", [0.6, 0.95, 0.995])
def test_a_first_order_process_gives_back_its_correlation_time(rho: float) -> None:
    found = [Autocorrelation.of(first_order(rho, 20000, seed)) for seed in range(8)]
    assert np.mean([one.time(1e-6) for one in found]) == pytest.approx(-1e-6 / np.log(rho), rel=0.1)
    assert np.mean([one.of_mean for one in found]) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.1)
    assert np.mean([one.of_variance for one in found]) == pytest.approx((1.0 + rho**2) / (1.0 - rho**2), rel=0.15)


@pytest.mark.parametrize(("rho", "points"), [(0.7, 80), (0.9, 400), (0.95, 400), (0.97, 2000)])
def test_the_correlation_of_a_short_rest_is_not_too_small(rho: float, points: int) -> None:
    """(1 + rho) / (1 - rho) about a straight line: medians of 0.57 to 0.8 of it, whose intervals were too narrow."""
    rows, found = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, points), 1), []
    for seed in range(200):
        noise = first_order(rho, points, seed)
        residual = noise - rows @ np.linalg.lstsq(rows, noise, rcond=None)[0]
        found.append(Autocorrelation.of(residual, 2).of_mean)
    assert np.median(found) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.12)


def test_the_correlation_of_smoothed_noise_is_that_of_its_averages() -> None:
    """A mean of nine readings: 9, and not the 17 of a process whose neighbours are as alike."""
    found = []
    for seed in range(100):
        noise = np.convolve(np.random.default_rng(seed).normal(size=408), np.ones(9) / 3.0, "valid")
        found.append(Autocorrelation.of(noise - noise.mean(), 1).of_mean)
    assert np.median(found) == pytest.approx(9.0, rel=0.12)


def test_white_noise_on_a_slow_bend_keeps_the_correlation_of_its_neighbours() -> None:
    """Half the variance is white: a long correlation time would leave no room for it."""
    clock = np.linspace(-1.0, 1.0, 2000)
    bend = (clock**2 - 1.0 / 3.0) / np.sqrt(4.0 / 45.0)
    found = Autocorrelation.of(bend + np.random.default_rng(0).normal(size=2000))
    assert found.r == found.neighbours == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize(("rate", "corner"), [(1e6, 20e3), (1e6, 50e3), (2e5, 20e3)])
def test_oversampled_noise_of_a_filter_fits_the_covariance_of_a_diagnosis(rate: float, corner: float) -> None:
    """Chi-square a point of noise alone, 1 where the covariance is right: by the neighbours' correlation 1.8 to 4.1."""
    found, clock = [], instants(3e-3, rate)
    for seed in range(4):
        noise = filtered(len(clock), rate, corner, seed)
        (trace,) = read_for_diagnosis(shot(clock, noise), EXPECTED).traces
        points = averaged(noise[np.isin(clock, trace.times)], trace.block)
        found.append(points @ np.linalg.solve(trace.covariance(), points) / len(points))
    assert 0.6 < np.mean(found) < 1.45


def test_a_right_noise_stands_although_a_filter_has_made_few_points_independent() -> None:
    """20 kHz noise at 1 MHz, 300 points before contact: by all its points the test rejected 18 of 24 right levels."""
    clock, stated = instants(0.0, 1e6), replace(EXPECTED, noise={CHANNEL: SIGMA})
    found = [read_record(shot(clock, filtered(len(clock), 1e6, 20e3, seed)), stated)[0].noise for seed in range(24)]
    assert [noise.source for noise in found].count("case") >= 21
    own = [read(shot(clock, filtered(len(clock), 1e6, 20e3, seed))).noise.level for seed in range(24)]
    assert np.mean(own) == pytest.approx(SIGMA, rel=0.08)  # without what the straight line takes it is 0.91


def test_the_zero_of_correlated_noise_is_as_uncertain_as_it_says() -> None:
    """Of 60 sensors that read 0.2 mm: error over its standard deviation."""
    clock = instants(8e-3, 2e5)
    apart = []
    for seed in range(60):
        zero = zero_of(read(shot(clock, 2e-4 + SIGMA * first_order(0.9, len(clock), seed))))
        apart.append((zero.at(np.array([zero.middle]))[0] - 2e-4) / np.sqrt(zero.covariance[0, 0]))
    assert 0.8 < np.sqrt(np.mean(np.square(apart))) < 1.3


@pytest.mark.parametrize("before", [13.5e-3, 14e-3, 15.5e-3])
def test_a_hum_of_50_hz_that_is_not_spanned_does_not_pass_for_one_of_60_hz(before: float) -> None:
    """At 0.3 mm what was carried on was off by 33 to 47 of its standard deviations."""
    clock = instants(before, 2e5)
    carried = 0
    for seed in range(16):
        wave = 1e-4 * np.sin(2.0 * np.pi * 50.0 * clock + seed * np.pi / 8.0)
        found = read(shot(clock, wave + SIGMA * np.random.default_rng(seed).normal(size=len(clock))))
        if found.baseline is None:
            assert any("bends before contact as a mains hum" in text for text in found.remarks)
            assert found.noise.level == pytest.approx(SIGMA, rel=0.1)
            continue
        carried += 1
        assert "hum" not in found.baseline.kind
        left = np.interp(found.times, clock, wave) - found.baseline.at(found.times)
        assert np.abs(left / np.sqrt((found.baseline.columns(found.times) ** 2).sum(axis=1))).max() < 4.0
    assert carried >= 2


@pytest.mark.parametrize("frequency", [50.0, 60.0])
@pytest.mark.parametrize(("periods", "there"), [(0.6, False), (0.9, True)])
def test_a_hum_is_fitted_from_four_fifths_of_its_period_on(frequency: float, periods: float, there: bool) -> None:
    clock = np.arange(0.0, periods / frequency, 5e-6)
    wave = 3e-4 * np.sin(2.0 * np.pi * frequency * clock)
    noise = SIGMA * np.random.default_rng(0).normal(size=len(clock))
    assert hum_of(clock, wave + noise) == (frequency if there else 0.0)


@pytest.mark.parametrize("step", [1e-4, 5e-5])
def test_a_coarse_converter_that_always_reads_the_same_before_contact_has_an_offset(step: float) -> None:
    """0.3 mm, of which not a word was said: known to a step over the square root of 12."""
    clock = instants(1e-3, 2e5)
    coarse = shot(clock, 3e-4)
    coarse = replace(coarse, channels={CHANNEL: step * np.round(coarse.channels[CHANNEL] / step)})
    found = read(coarse)
    zero = zero_of(found)
    assert zero.coefficients == pytest.approx(np.array([3e-4]))
    assert zero.covariance[0, 0] == pytest.approx(step**2 / 12.0)
    assert found.values[0] == pytest.approx(0.0, abs=1e-12)
    assert any("reads 0.3 mm (95 %: 0.2" in text for text in found.remarks)
    (said,) = read(coarse, zero=False).remarks
    assert "reads 0.3 mm at every point before contact" in said
    assert "birdstrike import --zero" in said


@pytest.mark.parametrize("share", [0.0, 0.1, 0.2, 0.3, 0.5])
def test_the_zero_of_a_coarse_converter_is_as_uncertain_as_its_noise_leaves_it(share: float) -> None:
    """Offsets anywhere between two steps, and noise of a share of a step, which averages the rounding out or not."""
    step, times, apart = 1e-4, 5e-6 * np.arange(400), []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        offset = step * rng.uniform(5.0, 6.0)
        read_as = step * np.round((offset + share * step * rng.normal(size=400)) / step)
        zero = BeforeContact.of(times, read_as, 5e-3, step=step).baseline
        assert zero is not None
        error = zero.at(np.array([zero.middle]))[0] - offset
        apart.append(error / np.sqrt((zero.columns(np.array([zero.middle])) ** 2).sum()))
    assert 0.3 < np.sqrt(np.mean(np.square(apart))) < 1.25


def test_a_sensor_that_reads_zero_at_every_point_has_no_offset() -> None:
    clock = instants(1e-3, 2e5)
    found = read(shot(clock, 0.0))
    assert found.baseline is None
    assert not found.remarks


@pytest.mark.parametrize(("share", "there"), [(0.5, True), (0.1, False)])
def test_a_zero_is_taken_from_a_quarter_of_the_noise_on(share: float, there: bool) -> None:
    """4000 points find either."""
    clock = instants(20e-3, 2e5)
    noise = SIGMA * np.random.default_rng(0).normal(size=len(clock))
    assert (read(shot(clock, share * SIGMA + noise)).baseline is not None) == there


@pytest.mark.parametrize(("share", "moves"), [(0.2, False), (0.45, True)])
def test_a_drift_that_would_carry_the_record_off_by_a_third_of_its_peak_is_none(share: float, moves: bool) -> None:
    times = 5e-6 * np.arange(400)
    values = share * 5e-3 / END * times + SIGMA * np.random.default_rng(0).normal(size=400)
    assert BeforeContact.of(times, values, 5e-3, END).moves == moves


def test_the_longer_correlation_of_noise_and_rounding_stands() -> None:
    values = 5e-4 * np.round(10.0 * np.sin(np.linspace(0.0, 3.0, 600)))
    times = 5e-6 * np.arange(600)
    for own in (0.0, 1e-3):
        noise, _ = with_digitiser(CHANNEL, "m", Noise(np.full(600, 1e-6), own, "case"), times, values)
        dwell = float(np.ptp(times)) / np.count_nonzero(np.diff(values))
        assert noise.correlation_time == pytest.approx(max(own, dwell / 3.0))


@pytest.mark.parametrize(("own", "level"), [(0.63, 0.777), (0.84, None)])
def test_the_scatter_of_the_runs_is_taken_out_unless_it_is_most_of_the_record_s(
    own: float, level: float | None
) -> None:
    """Shares 0.4 and 0.7 of the variance between neighbours."""
    clock = np.arange(0.0, END, 1e-6)
    rng = np.random.default_rng(0)
    runs = own * SIGMA * rng.normal(size=(3, len(clock)))
    expected = replace(EXPECTED, rest_until=0.0, runs=(clock, {CHANNEL: runs}))
    noise = read(shot(clock, SIGMA * rng.normal(size=len(clock))), expected).noise
    assert noise.known == (level is not None)
    if level is not None:
        assert noise.level == pytest.approx(level * SIGMA, rel=0.08)


@pytest.mark.parametrize(("rho", "points"), [(0.9, 400), (0.97, 400), (0.99, 2000)])
def test_correlated_noise_at_rest_neither_moves_nor_hums(rho: float, points: int) -> None:
    """7 to 45 % were said to move, whose noise was then that between neighbours, 0.13 to 0.25 of it; 20 % to hum."""
    times, found = 1e-5 * np.arange(points), []
    for seed in range(100):
        found.append(BeforeContact.of(times, 3e-4 * first_order(rho, points, seed), 1e-2, 4e-3))
    assert sum(one.moves or bool(one.bent) for one in found) <= 4
    assert sum(bool(one.hum) for one in found) <= 2
    assert sum(one.baseline is not None for one in found) <= 2
    assert np.median([one.level or 0.0 for one in found]) == pytest.approx(3e-4, rel=0.1)


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("ahead", [1e-3, 2e-3, 4e-3])
def test_a_response_before_its_time_moves_and_its_noise_is_that_of_the_record(rho: float, ahead: float) -> None:
    """A clock that is ahead: white noise is seen between neighbours, correlated noise in the first half of the rest."""
    clock, levels = 1e-5 * np.arange(-400, 400), []
    for seed in range(10):
        noise = 5e-5 * first_order(rho, len(clock), seed)
        values = 1e-2 * np.sin(np.pi * np.clip(clock + ahead, 0.0, None) / 10e-3) + noise
        found = read(Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}), Expected({CHANNEL: "m"}, 0.0, 4e-3, 0.0))
        assert any("moves before contact" in text for text in found.remarks)
        assert found.baseline is None
        levels.append(found.noise.level / 5e-5)
    assert np.median(levels) == pytest.approx(1.0, abs=0.15)


def test_a_hum_is_found_beside_correlated_noise() -> None:
    times, found = 1e-5 * np.arange(2500), []
    for seed in range(30):
        noise = 3e-4 * first_order(0.9, len(times), seed)
        record = BeforeContact.of(times, 5e-4 * np.sin(2.0 * np.pi * 50.0 * times + seed) + noise, 3e-2, 4e-3)
        found.append(record.hum == 50.0 and record.baseline is not None and record.baseline.frequency == 50.0)
    assert np.mean(found) > 0.9


@pytest.mark.parametrize(("before", "most"), [(8e-3, 2e-5), (15e-3, 5e-6), (20e-3, 3e-6), (50e-3, 3e-6)])
def test_a_rest_says_how_little_a_drift_bends(before: float, most: float) -> None:
    """A drift of 0.05 mm/ms left a zero uncertain by 0.4 mm after 8 ms of rest, by 1 mm after 15 ms."""
    clock = instants(before, 5e4)
    drift = 0.05 * clock + 1e-4 + SIGMA / 2.0 * np.random.default_rng(0).normal(size=len(clock))
    baseline = zero_of(read(shot(clock, drift)))
    assert baseline.drifts
    spread = np.sqrt((baseline.columns(np.array([0.0, END])) ** 2).sum(axis=1))
    assert spread.max() < most
    apart = baseline.at(np.array([0.0, END])) - 1e-4 - 0.05 * np.array([0.0, END])
    assert np.abs(apart / spread).max() < 3.0


@pytest.mark.parametrize("frequency", [50.0, 60.0])
@pytest.mark.parametrize("before", [2e-3, 6e-3, 10e-3])
def test_a_drift_that_is_the_beginning_of_a_hum_is_as_uncertain_as_it_says(frequency: float, before: float) -> None:
    """At phases where the rest shows a drift; one that shows an offset alone may be any hum about its turn."""
    times, after, off = np.arange(-before, 0.0, 2e-5), np.linspace(0.0, END, 9), []
    for seed in range(16):
        wave = 1e-4 * np.sin(2.0 * np.pi * frequency * np.append(times, after) + seed * np.pi / 8.0)
        noise = SIGMA * np.random.default_rng(seed).normal(size=len(times))
        found = BeforeContact.of(times, wave[: len(times)] + noise, 5e-3, END).baseline
        if found is not None and found.drifts:
            spread = np.sqrt((found.columns(after) ** 2).sum(axis=1))
            off.append(((found.at(after) - wave[len(times) :]) / spread)[-1])
    assert len(off) >= 4
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.7


def test_a_moving_record_whose_beginning_stands_on_one_step_gives_neither_zero_nor_noise() -> None:
    """Its first half was taken for a zero that was said not to be taken, and the rounding of a cubic for noise."""
    times = np.linspace(-2e-3, 0.0, 100)
    values = 1e-5 + 1e-3 * np.maximum((times + 0.9e-3) / 0.9e-3, 0.0) ** 2
    before = BeforeContact.of(times, values, peak=5e-3, length=END)
    assert before.moves
    assert before.level is None
    assert before.baseline is None
    assert not before.beyond_noise


def test_a_drift_that_a_diagnosis_keeps_is_no_zero_to_be_subtracted() -> None:
    """Of a drift through the record's zero its mean was said to be part of the response, and import --zero to help."""
    clock = instants(20e-3, 5e4)
    drift = 0.05 * clock + 1e-6 * np.random.default_rng(0).normal(size=len(clock))
    record = read_for_diagnosis(shot(clock, drift), EXPECTED)
    assert record.traces[0].rest is None
    assert not any("before contact" in text for text in record.warnings)


def test_import_zero_is_no_remedy_of_a_drift() -> None:
    """It subtracts a mean alone."""
    clock = instants(20e-3, 5e4)
    noise = SIGMA * np.random.default_rng(0).normal(size=len(clock))
    for added, remedied in ((3e-4, True), (3e-4 + 0.05 * clock, False)):
        (said,) = (text for text in read(shot(clock, added + noise)).remarks if "its zero is taken" in text)
        assert ("import --zero" in said) == remedied


def test_a_drift_that_the_case_declares_is_not_taken_off_the_record_alone() -> None:
    """The runs have it as well: the fit then missed the record by that drift. What is beyond it is subtracted."""
    clock = instants(20e-3, 2e5)
    noise = SIGMA * np.random.default_rng(0).normal(size=len(clock))
    declared = replace(EXPECTED, drifts={CHANNEL: 0.2})
    alone = read(shot(clock, 0.2 * clock + noise), declared)
    assert not alone.zeroed
    assert not alone.remarks
    found = read(shot(clock, 0.25 * clock + 3e-4 + noise), declared)
    assert found.values - pulse(truth(0.5), found.times) == pytest.approx(0.2 * found.times, abs=6.0 * SIGMA)


def test_the_drifts_of_a_case_are_those_of_its_instruments_and_effects(dataset: Dataset) -> None:
    case = load_case("demo")
    sensor = next(iter(case.sensors))
    drifting = case.overlaid({"instrument": {sensor: {"drift": "0.1 m/s"}}})
    assert Expected.of_case(drifting, 3e-3).drifts == pytest.approx({sensor: 0.1})
    assert set(Expected.of_case(case.with_effects({"sensor_drift": 0.1}), 3e-3).drifts.values()) == {0.1}
    assert Expected.of_campaign(replace(dataset, drifts={CHANNEL: 0.2}), {}).drifts == {CHANNEL: 0.2}
