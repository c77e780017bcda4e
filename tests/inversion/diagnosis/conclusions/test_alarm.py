"""The alarm's statistic and the model error that a record requires, against Gaussians written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from birdstrike.inversion.diagnosis.conclusions.alarm import SHARES, odds, smallest

POINTS = 6


def log_density(samples: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(q,) of residuals (q, POINTS) about zero."""
    return multivariate_normal(np.zeros(POINTS), covariance).logpdf(samples)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("effects", [1, 3])
def test_odds_are_the_weighted_bayes_factors_of_gaussians(effects: int) -> None:
    """N(0, 1 + g g^T) of every effect and N(0, 1 + S) of something else against N(0, 1), at five residuals."""
    rng = np.random.default_rng(0)
    samples, signatures = 2.0 * rng.standard_normal((5, POINTS)), 1.5 * rng.standard_normal((POINTS, effects))
    root = rng.standard_normal((POINTS, POINTS))
    smooth = root @ root.T
    priors, other = np.linspace(0.1, 0.4, effects), 0.05
    none = log_density(samples, np.eye(POINTS))
    models = [
        np.log(prior) + log_density(samples, np.eye(POINTS) + np.outer(g, g))
        for prior, g in zip(priors, signatures.T, strict=True)
    ]
    models.append(np.log(other) + log_density(samples, np.eye(POINTS) + smooth))
    found = odds(samples, signatures, priors, *np.linalg.eigh(smooth), other)
    assert found == pytest.approx(logsumexp(models, axis=0) - none)


@pytest.mark.parametrize("width", [0.5, 1.0, 2.0])
def test_the_required_model_error_is_the_one_sided_limit_of_a_parabola(width: float) -> None:
    """Of a share known to a factor: 1.645 standard deviations below the likeliest, to one step of the table."""
    limit = 0.1 * np.exp(-norm.ppf(0.95) * width)
    found = smallest(-0.5 * (np.log(SHARES / 0.1) / width) ** 2)
    assert found is not None
    assert limit <= found * 1.002  # 1.35 for 1.353
    assert found < limit * SHARES[1] / SHARES[0]


def test_no_share_is_enough_where_the_likelihood_rises_to_the_last() -> None:
    assert smallest(np.log(SHARES)) is None
