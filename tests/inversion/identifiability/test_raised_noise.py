"""Where a best fit leaves more than noise: directions, profiles and added runs have the noise of the intervals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.signal import lfilter

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.refinement import refine
from birdstrike.inversion.identifiability.summary import identifiability_figures
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, NAMES, forward, pulse, truth

NOISE = 1e-4
TIMES = np.linspace(0.4e-3, 2.6e-3, 120)
OPTIONS = InversionOptions(sampling=None, method="emulator", noise={CHANNEL: NOISE})
SHARE = np.array([0.5, 0.5, 0.5, 0.35])


def correlated() -> Measured:
    """White noise as stated, and as much again that is correlated over several points."""
    rng = np.random.default_rng(3)
    slow = np.asarray(lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], rng.normal(size=220)))[100:]
    values = pulse(truth(SHARE), TIMES) + NOISE * (rng.normal(size=120) + slow)
    return Measured(TIMES, {CHANNEL: values}, {}, {CHANNEL: "m"}, ("SIMULATED by a formula",), "stand_in.csv")


@pytest.fixture(scope="module")
def located(dataset: Dataset, emulator: Emulator) -> Located:
    found = locate(dataset, correlated(), OPTIONS, emulator)
    assert found.residual.widened[CHANNEL] > 1.3  # else nothing is tested
    return found


def covariance(located: Located, theta: np.ndarray) -> np.ndarray:
    """(n, n) of the raised noise and the emulator's error at theta, in full."""
    model = located.calibration.calibrator.model
    white = (located.residual.widened[CHANNEL] * NOISE) ** 2 + model.noise_at(0.0) ** 2 - NOISE**2
    factor = model.error_factor(theta, 0.0)
    return np.diag(white) + factor @ factor.T


def slopes(located: Located, z: np.ndarray) -> np.ndarray:
    """(4, n) change of the curve by fractions of the ranges."""
    model = located.calibration.calibrator.model
    return np.array([model.curve(truth(z + s), 0.0) - model.curve(truth(z - s), 0.0) for s in 1e-3 * np.eye(4)]) / 2e-3


def test_strengths_are_those_of_the_raised_noise(located: Located) -> None:
    """Roots of the eigenvalues of S^T C^-1 S / 12."""
    mode = located.calibration.modes[0]
    rows = slopes(located, mode.z)
    information = rows @ np.linalg.solve(covariance(located, mode.theta), rows.T)
    found = [one.strength for one in identifiability_figures(located.calibration, 0).directions]
    np.testing.assert_allclose(found, np.sqrt(np.linalg.eigvalsh(information / 12.0))[::-1], rtol=0.01)


def test_profile_rises_from_the_best_fit_by_the_raised_noise(located: Located) -> None:
    """By least cost over the other parameters with the covariance in full; 0 at the best fit itself."""
    model, best = located.calibration.calibrator.model, located.calibration.modes[0]
    inverse = np.linalg.inv(covariance(located, best.theta))

    def cost(z: np.ndarray) -> float:
        residual = model.observations.values - model.curve(truth(z), 0.0)
        return float(residual @ inverse @ residual + 12.0 * ((z - 0.5) ** 2).sum())

    def least(i: int, value: float) -> float:
        others = np.arange(4) != i
        start = np.where(others, best.z, value)
        bounds = [(0.0, 1.0) if free else (value, value) for free in others]
        return float(minimize(cost, start, bounds=bounds, method="L-BFGS-B").fun)

    figures = identifiability_figures(located.calibration, 0).profiles
    lowest = cost(best.z)
    for i in (0, 3):
        profile = figures[NAMES[i]]
        z = (np.array(profile.values) - truth(0.0)[i]) / (truth(1.0) - truth(0.0))[i]
        assert min(profile.rise) == 0.0
        expected = [least(i, float(value)) - lowest for value in z]
        np.testing.assert_allclose(profile.rise, expected, rtol=0.02, atol=0.05)


def test_runs_are_added_by_what_the_emulator_adds_to_the_widened_intervals(dataset: Dataset, located: Located) -> None:
    """Variances with and without the emulator's error beyond the runs' scatter; its error itself is in stated noise."""
    mode, model = located.calibration.modes[0], located.calibration.calibrator.model
    rows, whole = slopes(located, mode.z), covariance(located, mode.theta)
    error, scatter = model.error_factor(mode.theta, 0.0), model.scatter_factor(mode.theta, 0.0)
    least = whole - error @ error.T + scatter @ scatter.T
    sizes = [np.diag(np.linalg.inv(rows @ np.linalg.solve(c, rows.T) + 12.0 * np.eye(4))) for c in (whole, least)]
    _, found = refine(dataset, correlated(), forward, OPTIONS, 0)
    assert found.added_variance[0] == pytest.approx((sizes[0] / sizes[1]).max() - 1.0, rel=0.02)
    own = (error**2).sum() + (model.noise_at(0.0) ** 2 - NOISE**2).sum()
    assert found.error[0] == pytest.approx(np.sqrt(own / len(TIMES)) / NOISE, rel=0.01)
