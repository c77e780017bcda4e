"""Many networks in one batch, Bayesian regularisation, early stopping and the search of the hidden size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from birdstrike.data.errors import UserError
from birdstrike.surrogate import hidden_size
from birdstrike.surrogate.inverse_network import fit_network
from birdstrike.surrogate.network import Shape, jacobian, nguyen_widrow
from birdstrike.surrogate.scaling import OutputScaling
from birdstrike.surrogate.trainers import bayesian_regularisation, ensemble, levenberg_marquardt
from birdstrike.surrogate.trainers.levenberg_marquardt import Settings
from birdstrike.surrogate.trainers.training import Samples
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, TIMES, campaign, spread
from tests.surrogate.surface import SHAPE, smooth_surface


@pytest.mark.parametrize("runs", [8, 60], ids=["fewer residuals than weights", "more"])
def test_batch_is_each_network_by_itself(runs: int) -> None:
    samples, rules = smooth_surface(runs), Settings(epochs=30, goal=1e-8)
    starts = ensemble.starts(SHAPE, 5, seed=2)
    together = ensemble.train(SHAPE, starts, samples, rules).weights
    for start, weights in zip(starts, together, strict=True):
        alone = levenberg_marquardt.train(SHAPE, start, samples, rules)
        assert samples.mse(SHAPE, weights) == pytest.approx(alone.mse[-1], rel=1e-4, abs=1e-12)


def test_batched_jacobian_is_the_single_one() -> None:
    starts = ensemble.starts(SHAPE, 3, seed=0)
    x = smooth_surface(7).x
    y, rows = ensemble.jacobian(SHAPE, torch.as_tensor(starts), torch.as_tensor(x))
    for i, start in enumerate(starts):
        expected_y, expected = jacobian(SHAPE, start, x)
        np.testing.assert_allclose(y[i].numpy(), expected_y, atol=1e-14)
        np.testing.assert_allclose(rows[i].numpy(), expected, atol=1e-14)


def test_mean_of_fifty_does_better_than_the_average_of_them() -> None:
    """Convexity: the squared error of the mean is at most the mean squared error."""
    dataset = campaign(spread(25))
    fit = fit_network(dataset, {CHANNEL: TIMES}, "ensemble")
    assert fit.network.weights.shape == (50, 157)
    mean = float(np.mean(fit.errors**2))
    assert mean < fit.training.test_mse[-1]
    assert "of 50 networks reached the goal" in fit.training.status


def test_regularisation_uses_few_weights_and_does_not_follow_the_noise() -> None:
    """40 noisy samples, 25 weights: trained to its end the plain network fits the noise, this one does not."""
    samples = smooth_surface(40)
    noisy = replace(samples, t=samples.t + 0.05 * np.random.default_rng(1).normal(size=samples.t.shape))
    start = nguyen_widrow(SHAPE, 0)
    plain = levenberg_marquardt.train(SHAPE, start, noisy, Settings(goal=0.0, epochs=500))
    regular = bayesian_regularisation.train(SHAPE, start, noisy)
    assert regular.effective_weights is not None
    assert 1.0 < regular.effective_weights < SHAPE.weights
    assert regular.test_mse[-1] < plain.test_mse[-1]
    assert "weights are effective" in regular.status
    assert np.sqrt(regular.mse[-1]) == pytest.approx(0.05, rel=0.35)  # what is left is the noise


def test_regularisation_does_not_interpolate_a_few_samples() -> None:
    """8 runs, 16 values, 137 weights: without a floor of the error MSE 6e-18 is reached with all 16 effective."""
    rng = np.random.default_rng(0)
    t = rng.random((10, 2))
    x = 0.5 * t[:, :1] + 0.5 * np.sin(3.0 * np.linspace(0.0, 1.0, 12) * t[:, 1:])
    shape = Shape(12, 9, 2)
    found = bayesian_regularisation.train(shape, nguyen_widrow(shape, 0), Samples(x[:8], t[:8], x[8:], t[8:]))
    assert found.mse[-1] > 1e-6
    assert found.effective_weights is not None
    assert found.effective_weights < 0.9 * 16
    assert not bayesian_regularisation.warning(found, 16)
    assert "interpolates" in bayesian_regularisation.warning(replace(found, effective_weights=15.9), 16)
    assert not bayesian_regularisation.warning(replace(found, effective_weights=10.0), 16)
    assert not bayesian_regularisation.warning(replace(found, effective_weights=None), 16)


def test_validation_set_stops_the_training_and_its_best_weights_are_kept() -> None:
    samples = smooth_surface(12)
    rng = np.random.default_rng(3)
    noisy = replace(samples, t=samples.t + 0.1 * rng.normal(size=samples.t.shape))
    watched = replace(noisy, x_stop=samples.x_test, t_stop=samples.t_test)
    shape = Shape(2, 12, 1)
    found = levenberg_marquardt.train(shape, nguyen_widrow(shape, 0), watched, Settings(goal=0.0))
    assert "the validation error rose 6 times in a row" in found.status
    assert samples.test_mse(shape, found.weights) == pytest.approx(np.nanmin(found.test_mse))


def test_search_finds_that_one_neuron_is_too_few() -> None:
    samples = smooth_surface(40)
    found = hidden_size.search(samples.x, samples.t, (1, 6), settings=Settings(goal=1e-5, epochs=100))
    assert [size.hidden for size in found] == [1, 6]
    assert hidden_size.best(found).hidden == 6
    assert all(size.spread >= 0.0 for size in found)


def test_noisy_copies_make_the_network_deaf_to_noise() -> None:
    dataset = campaign(spread(40))
    noise = np.full(12, 2e-4)
    rng = np.random.default_rng(0)

    def moved(copies: int) -> float:
        fit = fit_network(dataset, {CHANNEL: TIMES}, "br", noise=noise, copies=copies)
        values = fit.network.inputs.low + 0.5 * (fit.network.inputs.high - fit.network.inputs.low)
        draws = fit.network.predict(values + noise * rng.normal(size=(200, 12)))
        return float((draws.std(axis=0) / (HIGHS - LOWS)).mean())

    assert moved(5) < moved(0)


def test_shared_samples_are_not_changed() -> None:
    samples = smooth_surface(10)
    before = Samples(*(part.copy() for part in (samples.x, samples.t, samples.x_test, samples.t_test)))
    ensemble.train(SHAPE, ensemble.starts(SHAPE, 2, 0), samples, Settings(epochs=3))
    np.testing.assert_array_equal(before.x, samples.x)
    np.testing.assert_array_equal(before.t, samples.t)


def test_errors_of_sizes_are_shares_of_the_ranges_whatever_the_outputs_scale() -> None:
    """Outputs on a scale of their own, of which the search is told, err by the same share."""
    samples = smooth_surface(24)
    rules = Settings(goal=1e-5, epochs=60)
    plain = hidden_size.search(samples.x, samples.t, (3,), settings=rules)[0]
    doubled = hidden_size.search(samples.x, samples.t, (3,), settings=rules, fractions=lambda y: 2.0 * y)[0]
    assert doubled.mean == pytest.approx(2.0 * plain.mean)
    bounded = OutputScaling(np.zeros(1), np.full(1, 3.0))
    values = np.linspace(0.0, 3.0, 7)[:, None]
    np.testing.assert_allclose(bounded.fractions(bounded.targets(values)), values / 3.0, atol=1e-12)


def test_a_search_of_three_runs_leaves_no_fold_empty_and_one_of_two_is_refused() -> None:
    samples = smooth_surface(3)
    (found,) = hidden_size.search(samples.x, samples.t, (2,), settings=Settings(epochs=5))
    assert np.isfinite([found.mean, found.spread]).all()
    with pytest.raises(UserError, match="give a number of neurons, or extend the campaign"):
        hidden_size.search(samples.x[:2], samples.t[:2], (2,))
