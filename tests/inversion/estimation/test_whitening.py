"""Whitening and misfits against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.inversion.estimation.whitening import Whitening
from birdstrike.inversion.misfit import relative, rmse, whitened
from birdstrike.inversion.observations.autocorrelation import correlated, neighbour_correlation, uncorrelated
from birdstrike.inversion.observations.noise import Noise


@pytest.mark.parametrize("columns", [6, 20, 50])
def test_whitened_square_is_that_of_the_dense_covariance(columns: int) -> None:
    rng = np.random.default_rng(columns)
    noise, factor, residual = rng.random(20) + 0.1, rng.normal(size=(20, columns)), rng.normal(size=20)
    covariance = np.diag(noise**2) + factor @ factor.T
    found = Whitening.of(noise, factor)
    white = found.apply(residual)
    assert white @ white == pytest.approx(residual @ np.linalg.solve(covariance, residual), rel=1e-10)
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)
    whole = found.apply(np.eye(20)).T
    np.testing.assert_allclose(whole @ covariance @ whole.T, np.eye(20), atol=1e-10)


@pytest.mark.parametrize("columns", [40, 250, 400])
def test_the_whitening_is_the_same_however_many_columns_carry_the_covariance(columns: int) -> None:
    """Few columns by their singular values, many by the products of columns or of rows: all give the symmetric root."""
    rng = np.random.default_rng(1)
    noise, factor, residual = rng.random(300) + 0.1, rng.normal(size=(300, 12)), rng.normal(size=(3, 300))
    turned = factor @ np.linalg.qr(rng.normal(size=(columns, 12)))[0].T
    few, found = Whitening.of(noise, factor), Whitening.of(noise, turned)
    np.testing.assert_allclose(found.apply(residual), few.apply(residual), atol=1e-9)
    assert found.log_determinant == pytest.approx(few.log_determinant, abs=1e-6)
    exact = Whitening.of(1e-9 * noise, turned).log_determinant  # next to no noise: squares would lose its digits
    assert exact == pytest.approx(Whitening.of(1e-9 * noise, factor).log_determinant, abs=1e-6)


def test_noise_of_a_first_order_process_is_whitened_by_its_correlations() -> None:
    """Sigma in full: sd_i sd_j exp(-|t_i - t_j|/time) at uneven instants, plus F F^T."""
    rng = np.random.default_rng(2)
    times, sd, factor = np.cumsum(rng.random(30) + 0.1), rng.random(30) + 0.1, rng.normal(size=(30, 4))
    correlation = np.exp(-np.abs(times[:, None] - times) / 1.7)
    covariance = np.outer(sd, sd) * correlation + factor @ factor.T
    found = Whitening.of(sd, factor, neighbour_correlation(times, 1.7))
    whole = found.apply(np.eye(30)).T
    np.testing.assert_allclose(whole @ covariance @ whole.T, np.eye(30), atol=1e-10)
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)
    np.testing.assert_allclose(Noise(sd, 1.7, "case").covariance(times), np.outer(sd, sd) * correlation, rtol=1e-12)


def test_noise_of_a_first_order_process_is_drawn_by_the_cholesky_factor_of_its_correlations() -> None:
    times, white = np.array([0.0, 0.3, 0.4, 1.5, 1.6]), np.array([1.0, -2.0, 0.5, 1.5, -1.0])
    rho = neighbour_correlation(times, 0.8)
    drawn = correlated(white, rho)
    root = np.linalg.cholesky(np.exp(-np.abs(times[:, None] - times) / 0.8))
    np.testing.assert_allclose(drawn, root @ white, rtol=1e-12)
    np.testing.assert_allclose(uncorrelated(drawn, rho), white, rtol=1e-12)


def test_misfits_skip_what_is_missing() -> None:
    model, measured = np.array([1.0, 2.0, np.nan, 4.0]), np.array([2.0, np.nan, 3.0, 1.0])
    assert rmse(model, measured) == pytest.approx(np.sqrt((1.0 + 9.0) / 2.0))
    assert relative(model, measured) == pytest.approx(rmse(model, measured) / 3.0)
    assert whitened(model, measured, np.full(4, 2.0)) == pytest.approx(rmse(model, measured) / 2.0)
    assert np.isnan(rmse(model, np.full(4, np.nan)))
