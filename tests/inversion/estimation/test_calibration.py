"""Calibration on the emulator: known parameters and a known time origin are recovered, intervals cover the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, multivariate_normal

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.time_origin import time_origin
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator
from birdstrike.surrogate.features import Region
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, TIMES, campaign, record, spread, truth


def calibrator(
    dataset: Dataset, emulator: Emulator, measured: Measured, noise: float, sigma: float = 0.0
) -> Calibrator:
    observations = observe(measured, dataset, {CHANNEL: noise})
    return Calibrator(CurveModel(emulator, observations), parameter_coordinates(dataset, emulator.regions), sigma)


@pytest.mark.parametrize("share", [(0.5, 0.5, 0.5, 0.5), (0.2, 0.8, 0.3, 0.6), (0.85, 0.3, 0.75, 0.25)])
def test_parameters_are_recovered_from_clean_data(
    dataset: Dataset, emulator: Emulator, share: tuple[float, ...]
) -> None:
    modes = calibrator(dataset, emulator, record(truth(share)), 5e-6).fit()
    np.testing.assert_allclose(modes[0].z, share, atol=0.02)  # of the ranges


@pytest.mark.parametrize("t0", [-0.08e-3, 0.0, 0.15e-3])
def test_time_origin_is_recovered_with_the_parameters(dataset: Dataset, emulator: Emulator, t0: float) -> None:
    share = (0.4, 0.6, 0.5, 0.5)
    problem = calibrator(dataset, emulator, record(truth(share), TIMES, t0=t0), 5e-6, sigma=0.1e-3)
    modes = problem.fit()
    origin, warnings = time_origin(problem, modes)
    assert origin.value == pytest.approx(t0, abs=2e-6)
    assert origin.interval_95 is not None
    assert origin.interval_95[0] < t0 < origin.interval_95[1]
    assert not warnings
    np.testing.assert_allclose(modes[0].z, share, atol=0.03)


def test_interval_of_the_time_origin_is_196_of_its_standard_deviations(dataset: Dataset, emulator: Emulator) -> None:
    """By slopes and covariance in full: +- 1.96 of the root of the last element of the inverse information."""
    problem = calibrator(dataset, emulator, record(truth(0.4), noise=5e-5), 5e-5, sigma=0.1e-3)
    modes, model, step = problem.fit(), problem.model, 1e-3
    assert len(modes) == 1
    place, box = np.append(modes[0].z, modes[0].t0 / 0.1e-3), modes[0].box

    def curve(at: np.ndarray) -> np.ndarray:
        return model.curve(problem.coordinates.theta(at[:-1], box), at[-1] * 0.1e-3)

    slopes = np.array([curve(place + step * one) - curve(place - step * one) for one in np.eye(5)]) / (2.0 * step)
    factor = model.error_factor(modes[0].theta, modes[0].t0)
    covariance = np.diag(model.noise_at(modes[0].t0) ** 2) + factor @ factor.T
    information = slopes @ np.linalg.solve(covariance, slopes.T) + np.diag([12.0, 12.0, 12.0, 12.0, 1.0])
    sd = 0.1e-3 * np.sqrt(np.linalg.inv(information)[-1, -1])
    origin, _ = time_origin(problem, modes)
    assert origin.interval_95 == pytest.approx((origin.value - 1.96 * sd, origin.value + 1.96 * sd), abs=0.01 * sd)


def test_known_clock_has_no_offset(dataset: Dataset, emulator: Emulator) -> None:
    problem = calibrator(dataset, emulator, record(truth(0.5)), 1e-5)
    origin, _ = time_origin(problem, problem.fit())
    assert (origin.value, origin.sigma, origin.interval_95) == (0.0, None, None)


def test_record_that_outlasts_the_simulation_holds_the_time_origin(dataset: Dataset, emulator: Emulator) -> None:
    """The last instant stands at the simulated end, so a record that runs ahead cannot be followed."""
    times = np.linspace(0.4e-3, 3.0e-3, 12)
    problem = calibrator(dataset, emulator, record(truth(0.5), times, t0=-0.2e-3), 5e-6, sigma=0.1e-3)
    origin, warnings = time_origin(problem, problem.fit())
    assert origin.value == pytest.approx(0.0, abs=1e-6)
    assert len(warnings) == 1
    assert "raise time.end" in warnings[0]


@pytest.mark.parametrize("t0", [-0.3e-3, 0.3e-3])
def test_a_far_trigger_is_named_as_what_holds_the_time_origin(dataset: Dataset, emulator: Emulator, t0: float) -> None:
    """Beyond four sigmas the search stops: no interval is claimed, and the remedy is the nuisance, not time.end."""
    problem = calibrator(dataset, emulator, record(truth(0.5), TIMES, t0=t0), 5e-6, sigma=0.04e-3)
    origin, warnings = time_origin(problem, problem.fit())
    assert abs(origin.value) == pytest.approx(0.16e-3, rel=0.01)
    assert origin.interval_95 is None
    assert len(warnings) == 1
    assert "raise it" in warnings[0]
    assert "time.end" not in warnings[0]


def test_a_record_cut_where_the_clock_needs_it_is_never_held_by_the_simulations_end(
    dataset: Dataset, emulator: Emulator
) -> None:
    """The last point at end - 4 sigma, rounded either way: what holds an early clock is the nuisance."""
    for sigma in (0.04e-3, 0.07e-3, 0.0371e-3):
        times = np.linspace(0.3e-3, 3.0e-3 - 4.0 * sigma, 12)
        problem = calibrator(dataset, emulator, record(truth(0.5), times, t0=-6.0 * sigma), 5e-6, sigma=sigma)
        _, warnings = time_origin(problem, problem.fit())
        assert "raise it" in warnings[0]
        assert "time.end" not in warnings[0]


def covers(mode_sets: list[tuple[tuple[Mode, ...], np.ndarray]]) -> np.ndarray:
    """(truths, k) whether each interval holds its truth."""
    return np.array([(intervals(m)[:, 0] <= z) & (z <= intervals(m)[:, 1]) for m, z in mode_sets])


@pytest.mark.parametrize("sigma", [0.0, 0.1e-3], ids=["known clock", "unknown clock"])
def test_intervals_cover_the_truth(dataset: Dataset, emulator: Emulator, sigma: float) -> None:
    """50 truths, 0.05 mm noise: no fewer hits than 95 % intervals have but once in a thousand such tests."""
    rng = np.random.default_rng(11)
    found: list[tuple[tuple[Mode, ...], np.ndarray]] = []
    for seed in range(50):
        z, t0 = rng.random(4), sigma * rng.normal()
        measured = record(truth(z), TIMES, noise=5e-5, t0=t0, seed=seed)
        found.append((calibrator(dataset, emulator, measured, 5e-5, sigma).fit(), z))
    hits = covers(found).sum(axis=0)
    assert (hits >= binom.ppf(0.001, 50, 0.95)).all(), f"{hits} of 50 intervals hold the truth"
    widths = np.mean([intervals(m)[:, 1] - intervals(m)[:, 0] for m, _ in found], axis=0)
    assert (widths[:3] < 0.3).all()  # they cover because they are right, not because they are wide


def test_costs_of_fits_with_different_errors_differ_by_their_posterior_densities(
    dataset: Dataset, emulator: Emulator
) -> None:
    """Minus twice the log density less one number for all: of two places, with and without an error known besides."""
    left = []
    for share in (0.2, 0.8):
        for size in (0.0, 2e-4):
            problem = calibrator(dataset, emulator, record(truth(share)), 5e-6, sigma=0.1e-3)
            problem = problem.with_known(size * np.linspace(0.1, 1.0, len(TIMES))[:, None])
            best = problem.fit()[0]
            mode = problem.held(best, problem.whitening(best), 0, float(best.z[0]))
            factor = problem.model.error_factor(best.theta, best.t0)
            covariance = np.diag(problem.model.noise_at(best.t0) ** 2) + factor @ factor.T
            curve = problem.model.curve(mode.theta, mode.t0)
            density = multivariate_normal.logpdf(problem.model.observations.values, curve, covariance)  # pyright: ignore[reportArgumentType]
            prior = problem.coordinates.prior.deviations(mode.z) ** 2
            left.append(mode.cost + 2.0 * density - prior.sum() - problem.tau(mode) ** 2)
    assert left == pytest.approx(np.full(4, left[0]), abs=1e-4)


@pytest.mark.parametrize("sigma", [0.0, 0.1e-3], ids=["known clock", "unknown clock"])
def test_information_is_what_an_unknown_clock_leaves_of_the_parameters(
    dataset: Dataset, emulator: Emulator, sigma: float
) -> None:
    """Inverse of the parameters' block of the inverse of the joint information, by slopes and covariance in full."""
    problem = calibrator(dataset, emulator, record(truth(0.4), noise=5e-5), 5e-5, sigma)
    mode, model, step = problem.fit()[0], problem.model, 1e-3

    def curve(at: np.ndarray) -> np.ndarray:
        theta = problem.coordinates.theta(at[:-1], mode.box)
        return model.curve(theta, at[-1] * sigma)

    place = np.append(mode.z, problem.tau(mode))
    slopes = np.array([curve(place + step * one) - curve(place - step * one) for one in np.eye(5)]) / (2.0 * step)
    factor = model.error_factor(mode.theta, mode.t0)
    covariance = np.diag(model.noise_at(mode.t0) ** 2) + factor @ factor.T
    joint = slopes @ np.linalg.solve(covariance, slopes.T) + np.diag([0.0, 0.0, 0.0, 0.0, 1.0])
    expected = np.linalg.inv(np.linalg.inv(joint)[:4, :4])
    found = problem.information(mode)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-3 * np.abs(expected).max())
    lost = (joint[:4, :4] - expected).max() / np.abs(expected).max()
    assert (lost > 0.05) == (sigma > 0.0)  # else nothing is tested


def test_same_seed_same_answer(dataset: Dataset, emulator: Emulator) -> None:
    problem = calibrator(dataset, emulator, record(truth(0.3), noise=5e-5), 5e-5, sigma=0.1e-3)
    first, second = problem.fit(seed=3)[0], problem.fit(seed=3)[0]
    np.testing.assert_array_equal(first.z, second.z)
    assert first.t0 == second.t0


def test_theta_and_ranges_belong_together(dataset: Dataset, emulator: Emulator) -> None:
    coordinates = parameter_coordinates(dataset, emulator.regions)
    np.testing.assert_allclose(coordinates.theta(np.zeros(4), coordinates.boxes[0]), LOWS)
    np.testing.assert_allclose(coordinates.theta(np.ones(4), coordinates.boxes[0]), HIGHS)


def test_rounding_does_not_carry_an_answer_across_an_activity_limit() -> None:
    """1 + 1e-16 would let tension erosion act on all that expands."""
    lows, highs = np.array([0.05]), np.array([1.25])
    off = Region(lows, np.array([1.0]), np.array([True]))
    runs = dataset_with("bird.material.tension_erosion", lows, highs)
    coordinates = parameter_coordinates(runs, (off,))
    (box,) = coordinates.boxes
    for z in box.highs + np.array([[0.0], [1e-16], [1e-9]]):
        assert coordinates.theta(z, box)[0] <= 1.0


def dataset_with(name: str, lows: np.ndarray, highs: np.ndarray) -> Dataset:
    """A campaign of one parameter whose curves do not matter."""
    one = campaign(spread(6))
    return replace(one, names=(name,), units=("",), lows=lows, highs=highs, parameters=np.linspace(lows, highs, 6))


def test_prior_width_is_that_of_draws_kept_inside_the_range(dataset: Dataset, emulator: Emulator) -> None:
    draws = np.random.default_rng(0).normal(0.5, np.sqrt(1.0 / 12.0), 400_000)
    low, high = np.quantile(draws[(draws > 0.0) & (draws < 1.0)], [0.025, 0.975])
    assert parameter_coordinates(dataset, emulator.regions).prior.width() == pytest.approx(high - low, abs=3e-3)
