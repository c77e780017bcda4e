"""Responses to effects: learnt together and one by one, bent where simulations bend them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.model_file import _response
from birdstrike.inversion.diagnosis.preparation.discrepancy import matern52
from birdstrike.inversion.diagnosis.preparation.responses import (
    Change,
    Response,
    Uncertainty,
    scatter,
    up_to_date,
    updated,
)
from birdstrike.surrogate.run_scatter import common_factors


def response(signature: np.ndarray, **more: Any) -> Response:
    """Of one parameter and one channel; its signature does not change with the parameter."""
    q, slopes = len(signature), np.zeros((1, len(signature)))
    error = Uncertainty(0.1 * np.ones((1, q)), np.diag([1.0, 0.0])[:, :, None])
    scatter = np.zeros_like(error.spread)
    return Response(None, signature, slopes, np.zeros(1), (error,), scatter, **more)  # pyright: ignore[reportArgumentType]


def simulated(old: Response, b: float, pairs: np.ndarray, z: np.ndarray | None = None) -> Response:
    """The response after these pairs alone."""
    return updated(old, Change("a", b, np.zeros(1) if z is None else z, pairs))


def test_a_response_that_bends_and_its_inverse() -> None:
    bent = response(np.ones(4), knots=((-5.0, -2.0), (0.0, 0.0), (1.0, 1.6), (3.0, 3.0)))
    assert bent.h(1.0) == pytest.approx(1.6)
    assert bent.h(2.0) == pytest.approx(2.3)
    assert bent.b(bent.h(2.3)) == pytest.approx(2.3)


def test_simulations_where_an_effect_matters_bend_its_response_to_them() -> None:
    """Two plausible sizes change the curves by three times the signature: the response is steeper than learnt."""
    old = response(np.ones(10))
    changes = 3.0 + 0.01 * np.random.default_rng(0).standard_normal((4, 10))
    new = simulated(old, 2.0, changes)
    assert new.h(2.0) == pytest.approx(3.0, abs=0.05)
    assert np.allclose(new.h(2.0) * new.signature, changes.mean(axis=0))
    assert new.h(-1.0) == old.h(-1.0)


def test_each_sense_of_an_effect_is_what_its_own_simulations_show() -> None:
    """A bird as much slower as another is faster moves the curves in another shape: one signature served both."""
    rng, t = np.random.default_rng(0), np.linspace(0.0, 1.0, 30)
    learnt = replace(response(1.0 + t), known=SimpleNamespace(one_sided=False))  # pyright: ignore[reportArgumentType]
    faster, slower = (
        Change("a", b, np.zeros(1), b * shape + 0.01 * rng.standard_normal((8, 30)))
        for b, shape in ((2.0, 1.0 + 1.5 * t), (-2.0, 1.0 + 0.5 * t))
    )
    alone = up_to_date(learnt, [faster])
    np.testing.assert_array_equal(alone.sided(-1.0).signature, learnt.signature)
    both = up_to_date(learnt, [faster, slower])
    for change in (faster, slower):
        own = both.sided(change.b)
        np.testing.assert_allclose(both.h(change.b) * own.at(np.zeros(1)), change.pairs.mean(axis=0), atol=0.02)
    np.testing.assert_array_equal(both.sided(1.0).signature, alone.sided(1.0).signature)
    assert both.sided(0.0) is both
    assert both.simulated == (2.0, -2.0)
    setup: Any = SimpleNamespace(split=lambda rows: {"a": rows})
    stored = _response(setup, both)
    np.testing.assert_array_equal(stored["signature"]["a"], both.sided(1.0).signature)
    np.testing.assert_array_equal(stored["negative"]["signature"]["a"], both.sided(-1.0).signature)
    assert "negative" not in _response(setup, learnt)


def test_simulations_that_contradict_a_signature_leave_it_as_it_was() -> None:
    old = response(np.ones(10))
    assert simulated(old, 2.0, -3.0 * np.ones((4, 10))) is old


def test_the_scatter_of_simulations_does_not_pass_for_bending() -> None:
    """A noisy signature explains a change only in part; the rest is noise, and the magnitude stays what it is."""
    rng = np.random.default_rng(0)
    old = response(np.ones(200) + 0.1 * rng.standard_normal(200))
    new = simulated(old, 2.0, 2.0 * np.ones(200) + 0.4 * rng.standard_normal((3, 200)))
    assert new.h(2.0) == pytest.approx(2.0)
    assert new.simulated == (2.0,)


def test_simulations_at_one_place_leave_what_is_known_of_the_change_with_the_parameters() -> None:
    """The posterior is that of a Gaussian conditioned on the sum of signature and slope at that place."""
    prior = np.array([[0.04, 0.01], [0.01, 0.09]])
    first = response(np.ones(50))
    error = Uncertainty(np.ones((1, 50)), prior[:, :, None])
    old = replace(first, slopes=np.full((1, 50), 0.5), uncertainties=(error,))
    changes = np.array([1.9, 2.0, 2.1])[:, None] * np.ones(50)
    z, far = np.array([0.4]), np.array([-0.5])
    new = simulated(old, 1.5, changes, z)
    assert new.h(1.5) == pytest.approx(1.5)
    a, noise = np.array([1.0, 0.4]), 0.1**2 / 3.0 / 1.5**2
    gain = prior @ a / (a @ prior @ a + noise)
    mean = np.array([1.0, 0.5]) + gain * (2.0 / 1.5 - a @ [1.0, 0.5])
    left = prior - np.outer(gain, a @ prior)
    for place in (z, far):
        b = np.array([1.0, place[0]])
        assert np.allclose(new.at(place), b @ mean)
        variance = (new.error_at(place) ** 2).sum(axis=0) + new.scatter_at(place) ** 2
        assert np.allclose(variance, b @ left @ b)


def test_the_error_of_a_mean_of_few_pairs_is_known_from_the_pairs_of_all_effects() -> None:
    """Scatter that is half smooth in time, half not. Beside a record's own noise, the error of eight pairs' mean is
    what the pairs of eight effects say to a third, shrunk as a shot shrinks them; its own pairs say a tenth of it."""
    rng, t, record = np.random.default_rng(4), np.linspace(0.0, 1.0, 100), 0.2
    L = np.linalg.cholesky(matern52(np.abs(t[:, None] - t) / 0.1) + np.eye(100))

    def change() -> Change:
        return Change("a", 1.0, np.zeros(1), rng.standard_normal((8, 100)) @ L.T)

    changes = [change() for _ in range(8)]
    errors = np.array([change().pairs.mean(axis=0) for _ in range(100)])

    def weighed(covariance: np.ndarray) -> float:
        """Mean square of the errors, in the metric that they have beside the record's noise, to what was stated."""
        inverse = np.linalg.inv(record**2 * np.eye(100) + covariance)
        return float(np.einsum("ni,ij,nj->n", errors, inverse, errors).mean() / np.trace(inverse @ covariance))

    size = float((np.array([one.apart for one in changes]) ** 2).mean() * 8.0 / 7.0 / 8.0)
    rows = common_factors([scatter(changes, 1)])[0]
    own = scatter(changes[:1], 1)
    assert (scatter(changes, 1) ** 2).mean() == pytest.approx(1.0)
    assert weighed(size * rows.T @ rows) == pytest.approx(1.0, rel=0.33)
    assert weighed(size * own.T @ own / 8.0) > 10.0
