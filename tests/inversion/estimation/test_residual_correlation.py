"""Misfits that hang together: found where they are, not where they are not, and the intervals stay honest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.time_origin import clock_drift, time_origin
from birdstrike.inversion.estimation.whitening import Whitening, autocorrelation_time, residual_correlation
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.filtered_records import filtered_record
from birdstrike.inversion.observations.filters import zero_phase
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.estimation.test_calibration import calibrator
from tests.inversion.stand_in import CHANNEL, START, TIMES, forward, pulse, record, truth

NOISE = 5e-5
DENSE = np.linspace(0.4e-3, 2.6e-3, 600)


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_autocorrelation_time_of_a_first_order_process(rho: float) -> None:
    """(1 + rho) / (1 - rho)."""
    process = lfilter([1.0], [1.0, -rho], np.random.default_rng(0).normal(size=200_000))
    assert autocorrelation_time(np.asarray(process)) == pytest.approx((1.0 + rho) / (1.0 - rho), rel=0.15)


@pytest.mark.parametrize("n", [12, 20, 60, 600])
def test_white_noise_has_one_point(n: int) -> None:
    rng = np.random.default_rng(n)
    assert sum(autocorrelation_time(rng.normal(size=n)) > 1.0 for _ in range(500)) <= 3


def test_too_few_points_and_no_residual_have_no_correlation() -> None:
    assert autocorrelation_time(np.ones(19)) == 1.0
    assert autocorrelation_time(np.ones(20)) > 5.0
    assert autocorrelation_time(np.zeros(100)) == 1.0


def test_misfit_below_the_stated_noise_widens_nothing(dataset: Dataset, emulator: Emulator) -> None:
    """Smooth as it is, it is covered: fit^2 tau < 1."""
    observations = calibrator(dataset, emulator, record(truth(0.5), DENSE), NOISE).model.observations
    found = residual_correlation(observations, 0.01 * np.sin(np.linspace(0.0, 20.0, 600)))
    assert found.tau[CHANNEL] > 10.0
    assert found.white
    assert found.warnings == ()


def judged(
    dataset: Dataset, emulator: Emulator, truths: int, periods: float, amplitude: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(truths, k) each: hits before and after widening, and the ratio of the widths.

    A sine over the record of RMS `amplitude` times the noise is added.
    """
    rng, rows = np.random.default_rng(11), []
    sine = amplitude * NOISE * np.sqrt(2.0) * np.sin(2.0 * np.pi * periods * np.linspace(0.0, 1.0, len(DENSE)))
    for seed in range(truths):
        z = 0.05 + 0.9 * rng.random(4)
        measured = record(truth(z), DENSE, NOISE, seed=seed)
        measured = replace(measured, channels={CHANNEL: measured.channels[CHANNEL] + sine})
        problem = calibrator(dataset, emulator, measured, NOISE)
        narrow, wide = intervals(problem.fit()), intervals(problem.best_fits()[1])
        hits = [(span[:, 0] <= z) & (z <= span[:, 1]) for span in (narrow, wide)]
        rows.append([*hits, np.ptp(wide, axis=1) / np.ptp(narrow, axis=1)])
    before, after, ratio = np.array(rows, dtype=np.float64).transpose(1, 0, 2)
    return before, after, ratio


def test_dense_record_of_white_noise_keeps_its_narrow_intervals(dataset: Dataset, emulator: Emulator) -> None:
    _, after, ratio = judged(dataset, emulator, 20, 1.0, 0.0)
    assert after.mean() >= 0.85
    assert (ratio.mean(axis=0) < 1.15).all()


@pytest.mark.parametrize("periods", [3.0, 5.0])
def test_intervals_hold_the_truth_beside_a_misfit_as_large_as_the_noise(
    dataset: Dataset, emulator: Emulator, periods: float
) -> None:
    before, after, _ = judged(dataset, emulator, 20, periods, 1.0)
    assert before.mean() < 0.8, "the misfit does not matter: nothing is tested"
    assert after.mean() >= 0.85


def test_a_misfit_that_hangs_together_is_said_and_recorded(dataset: Dataset, emulator: Emulator) -> None:
    sine = NOISE * np.sqrt(2.0) * np.sin(2.0 * np.pi * 3.0 * np.linspace(0.0, 1.0, len(DENSE)))
    measured = record(truth(0.5), DENSE, NOISE)
    options = InversionOptions(sampling=None, analyse=False, method="emulator", noise={CHANNEL: NOISE})
    clean = invert(dataset, measured, forward, options, emulator=emulator).inversion
    assert clean.residual is not None
    assert clean.residual.white
    assert not any("not noise" in text for text in clean.warnings)
    measured = replace(measured, channels={CHANNEL: measured.channels[CHANNEL] + sine})
    found = invert(dataset, measured, forward, options, emulator=emulator).inversion
    assert found.residual is not None
    assert found.prior_predictive.inside
    assert found.residual.tau[CHANNEL] > 10.0
    assert found.residual.widened[CHANNEL] == pytest.approx(
        found.residual.fit[CHANNEL] * np.sqrt(found.residual.tau[CHANNEL])
    )
    (said,) = (text for text in found.warnings if "not noise" in text)
    assert "the intervals were widened by a factor" in said


def fitted_noise(observations: Observations, reading: np.ndarray) -> np.ndarray:
    """Whitened residual (n,) of a reading less the straight line that is fitted to it."""
    (channel,) = observations.channels
    white = Whitening.of(channel.noise, np.zeros((len(reading), 0)), channel.correlation)
    rows = white.apply(np.stack([np.ones(len(reading)), channel.times - channel.times.mean()])).T
    residual = white.apply(reading)
    return residual - rows @ np.linalg.lstsq(rows, residual, rcond=None)[0]


def read_as(clock: np.ndarray, reading: np.ndarray, dataset: Dataset) -> Observations:
    """A pulse under the reading, which the fit knows."""
    values = np.where(clock < START, 0.0, pulse(truth(0.5), clock)) + reading
    return observe(Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}, (), "shot.csv"), dataset, {})


@pytest.mark.parametrize(("slow", "least", "most"), [(0.0, 0.0, 0.05), (0.5, 0.9, 1.0)])
def test_white_noise_behind_a_filter_is_no_misfit_and_a_slow_error_beside_it_is(
    dataset: Dataset, slow: float, least: float, most: float
) -> None:
    """80 records behind CFC1000: 19 of noise alone were said to be no noise."""
    clock, passed = 5e-6 * np.arange(-400, 1001), []
    for seed in range(80):
        noise = NOISE * np.random.default_rng(seed).normal(size=len(clock))
        noise += slow * NOISE * np.sin(2.0 * np.pi * clock / 1.5e-3)
        found = filtered_record(
            Measured(
                clock, {CHANNEL: np.where(clock < START, 0.0, pulse(truth(0.5), clock)) + noise}, {}, {CHANNEL: "m"}
            ),
            "CFC1000",
            dataset,
            {CHANNEL: NOISE},
        )
        observations = observe(found.measured, dataset, {CHANNEL: NOISE})
        (channel,) = observations.channels
        reading = np.interp(channel.times, clock, zero_phase(noise, 5e-6, "CFC1000"))
        passed.append(bool(residual_correlation(observations, fitted_noise(observations, reading)).warnings))
    assert least <= np.mean(passed) <= most


def test_noise_behind_a_filter_is_as_well_known_where_the_rest_is_a_part_of_the_simulated_record(
    dataset: Dataset,
) -> None:
    """Without a reading before the simulation its factor by chance was 8e17: no misfit was one."""
    clock, limits = 2e-6 * np.arange(0, 1500), []
    for slow in (0.0, 3.0):
        white = np.random.default_rng(1).normal(size=len(clock) + 100)
        reading = NOISE * np.asarray(lfilter([0.6], [1.0, -0.8], white))[100:]
        reading = reading + slow * NOISE * np.sin(2.0 * np.pi * clock / 1.5e-3) * (clock > START)
        values = np.where(clock < START, 0.0, pulse(truth(0.5), clock)) + reading
        shot, noise = Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}), {CHANNEL: NOISE}
        observations = observe(filtered_record(shot, "CFC1000", dataset, noise).measured, dataset, noise)
        (channel,) = observations.channels
        assert channel.correlation_time > 0.0
        assert channel.record is not None
        assert not len(channel.record.early)
        passed = np.interp(channel.times, clock, zero_phase(reading, 2e-6, "CFC1000"))
        found = residual_correlation(observations, fitted_noise(observations, passed))
        limits.append(found.by_chance[CHANNEL])
        assert bool(found.warnings) == bool(slow)
    assert max(limits) < 8.0


def test_a_correlation_known_from_a_short_rest_makes_no_misfit_of_noise(dataset: Dataset) -> None:
    """60 points before contact: 70 % of 95 records were said to be no noise, of a correlation estimated too short."""
    clock, said = START + 6e-6 * np.arange(-60, 400), []
    for seed in range(100):
        noise = NOISE * np.asarray(lfilter([0.6], [1.0, -0.8], np.random.default_rng(seed).normal(size=560)))[100:]
        observations = read_as(clock, noise, dataset)
        (channel,) = observations.channels
        if channel.correlation_time:
            reading = noise[np.isin(clock, channel.times)]
            said.append(bool(residual_correlation(observations, fitted_noise(observations, reading)).warnings))
    assert len(said) > 80
    assert np.mean(said) < 0.08


def test_drift_is_the_slope_of_the_curve_times_the_clocks_uncertainty(dataset: Dataset, emulator: Emulator) -> None:
    problem = calibrator(dataset, emulator, record(truth(0.5), TIMES, NOISE, t0=5e-5), NOISE, sigma=1e-4)
    modes = problem.fit()
    origin, _ = time_origin(problem, modes)
    sd = float(np.sqrt(modes[0].covariance[-1, -1]))
    scores = problem.model.scores(modes[0].theta[None])
    slope = (problem.model.curves(scores, origin.value + 1e-5) - problem.model.curves(scores, origin.value - 1e-5))[0]
    np.testing.assert_allclose(clock_drift(problem, modes[0], origin), slope / 2e-5 * sd, rtol=0.1, atol=2e-5)
    known = calibrator(dataset, emulator, record(truth(0.5)), NOISE)
    best = known.fit()
    assert not clock_drift(known, best[0], time_origin(known, best)[0]).any()


def test_network_is_less_sure_where_the_clock_is(dataset: Dataset, emulator: Emulator) -> None:
    """Of a network that was trained without copies of the runs at other clocks, which make it read the clock less."""
    measured, widths, reasons = record(truth(0.5), TIMES, 3e-5), [], []
    for offset in (0.0, 0.1e-3):
        options = InversionOptions(
            sampling=None, analyse=False, method="network", noise={CHANNEL: 3e-5}, time_offset=offset, copies=0
        )
        estimate = invert(dataset, measured, forward, options, emulator=emulator).inversion.methods["network"]
        period = estimate.parameters["pulse.period"]
        assert period.interval_95 is not None
        widths.append(period.interval_95[1] - period.interval_95[0])
        reasons.append(period.reason)
    assert widths[1] > widths[0]
    assert "uncertain time origin" in reasons[1]
    assert "time origin" not in reasons[0]


def test_a_correlation_that_a_short_rest_may_have_missed_makes_no_misfit_of_noise(dataset: Dataset) -> None:
    """30 points before contact do not show 0.45 between neighbours: 8 in 10 records were said to be no noise."""
    clock, said, widened = START + 6e-6 * np.arange(-30, 400), [], []
    for seed in range(60):
        noise = NOISE * np.asarray(lfilter([0.893], [1.0, -0.45], np.random.default_rng(seed).normal(size=530)))[100:]
        observations = read_as(clock, noise, dataset)
        (channel,) = observations.channels
        if not channel.correlation_time:
            found = residual_correlation(observations, fitted_noise(observations, noise[np.isin(clock, channel.times)]))
            said.append(bool(found.warnings))
            widened.append(found.widened[CHANNEL] > 1.0)
    assert len(said) > 30
    assert np.mean(widened) > 0.9
    assert np.mean(said) < 0.08
