"""Noise that the record before contact shows to be correlated: whitened as such, so that intervals hold the truth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student_t

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.known_errors import noise_columns
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.whitening import Whitening, residual_correlation
from birdstrike.inversion.observations.autocorrelation import neighbour_correlation
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.observations import Channel, Observations, observe
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, START, pulse, truth

NOISE = 1e-4
OPTIONS = InversionOptions(sampling=None, method="emulator")
WINDOW = np.ones(9) / 3.0  # a mean of nine, scaled to the variance of one


def noise(kind: str, points: int, seed: int) -> np.ndarray:
    """(points,) of variance 1: "white", "first-order" with correlation 0.6 of neighbours, or "smoothed" by WINDOW."""
    white = np.random.default_rng(seed).normal(size=points + 100)
    if kind == "first-order":
        return np.asarray(lfilter([0.8], [1.0, -0.6], white))[100:]
    return (np.convolve(white, WINDOW, "same") if kind == "smoothed" else white)[:points]


def shot(z: np.ndarray, kind: str, before: int, after: int, seed: int = 0) -> Measured:
    """A record of so many points before and after contact."""
    times = START + 2.4e-3 / after * np.arange(-before, after)
    values = pulse(truth(z), times) + NOISE * noise(kind, len(times), seed)
    return Measured(times, {CHANNEL: values}, {}, {CHANNEL: "m"}, (), "shot.csv")


@pytest.mark.parametrize(("kind", "neighbours"), [("first-order", 0.6), ("smoothed", 0.8), ("white", 0.0)])
def test_correlation_is_that_of_averages_over_many_points(dataset: Dataset, kind: str, neighbours: float) -> None:
    """1 + 2 sum rho_k is (1 + rho) / (1 - rho) of a first-order process and nine of a mean of nine, that of rho 0.8."""
    observations = observe(shot(np.full(4, 0.5), kind, 6000, 60), dataset, {})
    (channel,) = observations.channels
    assert observations.correlation[1:] == pytest.approx(np.full(len(channel.times) - 1, neighbours), abs=0.03)
    assert observations.correlation[0] == 0.0


def test_rounding_of_a_digitiser_is_no_first_order_process(dataset: Dataset) -> None:
    """It is as slow as the readings where they turn: the calibration leaves it to the residual."""
    times = START + 1.2e-5 * np.arange(-200, 200)
    steps = 5e-4 * np.round((pulse(truth(0.5), times) + 2e-5 * noise("white", 400, 0)) / 5e-4)
    (channel,) = observe(Measured(times, {CHANNEL: steps}, {}, {CHANNEL: "m"}, (), "shot.csv"), dataset, {}).channels
    assert channel.record is not None
    assert channel.record.noise.correlation_time > 0.0
    assert channel.correlation_time == 0.0
    assert channel.noise == pytest.approx(np.full(len(channel.times), 5e-4 / np.sqrt(12.0)), rel=0.06)


def test_intervals_are_those_of_the_correlated_covariance_in_full(dataset: Dataset, emulator: Emulator) -> None:
    """Inverse of S^T C^-1 S + 12 with C_ij = s_i s_j exp(-|t_i - t_j| / time) + F F^T."""
    found = locate(dataset, shot(np.full(4, 0.5), "first-order", 400, 60), OPTIONS, emulator)
    problem, mode = found.calibration.calibrator, found.calibration.modes[0]
    assert found.residual.white
    model, (channel,) = problem.model, found.observations.channels
    sd, factor = model.noise_at(0.0), model.error_factor(mode.theta, 0.0)
    apart = np.abs(channel.times[:, None] - channel.times)
    covariance = np.outer(sd, sd) * np.exp(-apart / channel.correlation_time) + factor @ factor.T
    step = 1e-3 * np.eye(4)
    slopes = np.array([model.curve(truth(mode.z + s), 0.0) - model.curve(truth(mode.z - s), 0.0) for s in step]) / 2e-3
    expected = np.linalg.inv(slopes @ np.linalg.solve(covariance, slopes.T) + 12.0 * np.eye(4))
    np.testing.assert_allclose(mode.covariance[:4, :4], expected, rtol=0.0, atol=0.01 * np.abs(expected).max())


def inverted(dataset: Dataset, emulator: Emulator, kind: str, seed: int) -> tuple[np.ndarray, Located]:
    z = 0.1 + 0.8 * np.random.default_rng(1000 + seed).random(4)
    return z, locate(dataset, shot(z, kind, 200, 200, seed), OPTIONS, emulator)


@pytest.mark.parametrize("kind", ["first-order", "smoothed"])
def test_intervals_hold_the_truth_and_are_no_wider_than_that_needs(
    dataset: Dataset, emulator: Emulator, kind: str
) -> None:
    """50 records: 95 % of the intervals, and errors as large as their standard deviations."""
    hits, errors = [], []
    for seed in range(50):
        z, found = inverted(dataset, emulator, kind, seed)
        mode, ends = found.calibration.modes[0], intervals(found.calibration.modes)
        hits.append((ends[:, 0] <= z) & (z <= ends[:, 1]))
        errors.append((mode.z - z) / np.sqrt(np.diag(mode.covariance)[:4]))
    assert np.mean(hits) >= 0.92
    assert 0.8 < np.sqrt(np.mean(np.square(errors))) < 1.2


def test_residual_is_widened_by_its_excess_over_the_noise_s_correlation(dataset: Dataset) -> None:
    """Slower than the noise by the ratio of (1 + rho) / (1 - rho), and twice as large."""
    observations = observe(shot(np.full(4, 0.5), "first-order", 6000, 60_000), dataset, {})
    rho = float(observations.correlation[1])
    n = len(observations.values)
    errors = 2.0 * np.asarray(lfilter([0.6], [1.0, -0.8], np.random.default_rng(1).normal(size=n)))
    white = np.append(errors[0], (errors[1:] - rho * errors[:-1]) / np.sqrt(1.0 - rho**2))
    found = residual_correlation(observations, white)
    assert found.fit[CHANNEL] == pytest.approx(2.0, rel=0.03)
    assert found.tau[CHANNEL] == pytest.approx(9.0, rel=0.15)
    assert found.widened[CHANNEL] == pytest.approx(2.0 * np.sqrt(9.0 * (1.0 - rho) / (1.0 + rho)), rel=0.08)


def test_intervals_of_strongly_correlated_noise_hold_a_slow_parameter() -> None:
    """200 records of correlation 0.9, a line fitted beside a half sine, 400 points at rest: 84 % held its size."""
    times, sine = 6e-6 * np.arange(-400, 400), np.sin(np.pi * np.arange(400) / 500.0)
    shapes = np.stack([sine, sine * np.arange(400) / 400.0])
    held = []
    for seed in range(200):
        white = np.random.default_rng(seed).normal(size=1200)
        noise = NOISE * np.asarray(lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], white))[400:]
        before = BeforeContact.of(times[:400], noise[:400], 1e-2, 2.4e-3)
        assert before.level is not None
        correlation = neighbour_correlation(times[400:], before.correlation.time(6e-6))
        whitening = Whitening.of(np.full(400, before.level), np.zeros((400, 0)), correlation)
        rows, residual = whitening.apply(shapes), whitening.apply(noise[400:])
        covariance = np.linalg.inv(rows @ rows.T)
        held.append(abs((covariance @ rows @ residual)[0]) < 1.96 * np.sqrt(covariance[0, 0]))
    assert np.mean(held) > 0.89


@pytest.mark.parametrize(
    ("before", "rho", "freedom", "rest"),
    [(400, 0.9, 400 / 39.0, 6e-6), (80, 0.7, 80 / (37.0 / 3.0), 6e-6), (100, 0.9, 400 / 39.0, 24e-6)],
)
def test_a_slow_error_of_correlated_noise_is_student_s_a_fast_one_is_normal(
    before: int, rho: float, freedom: float, rest: float
) -> None:
    """n / (1 + 2 tau) degrees of freedom at frequency 0, whatever the rate of the rest. Of one slow parameter 86 to
    94 % of the intervals held."""
    times = 6e-6 * np.arange(400)
    time, known = -6e-6 / np.log(rho), SimpleNamespace(before=(NOISE, before, rest))
    record: Any = SimpleNamespace(noise=known, read_before=None)
    channel = Channel(CHANNEL, "m", times, times, np.full(400, NOISE), "", record, time)
    factor = noise_columns(Observations((channel,)))
    own = NOISE**2 * np.exp(-np.abs(times[:, None] - times) / time)
    slow, fast = np.ones(400) * np.hanning(400), np.hanning(400) * np.cos(0.8 * np.pi * np.arange(400))
    raised = [float(x @ (own + factor @ factor.T) @ x / (x @ own @ x)) for x in (slow, fast)]
    assert raised[0] == pytest.approx((student_t.ppf(0.975, freedom) / 1.96) ** 2, rel=0.03)
    assert raised[1] == pytest.approx(1.0, abs=0.02)
    white = replace(channel, correlation_time=0.0)
    assert noise_columns(Observations((white,))).shape == (400, 0)
