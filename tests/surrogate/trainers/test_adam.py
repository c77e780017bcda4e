"""Adam on the same network."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from birdstrike.surrogate.network import forward, nguyen_widrow
from birdstrike.surrogate.trainers.adam import Settings, torch_forward, train
from tests.surrogate.surface import SHAPE, smooth_surface


def test_torch_and_numpy_networks_agree() -> None:
    weights, x = nguyen_widrow(SHAPE, 0), np.random.default_rng(0).random((5, 2))
    found = torch_forward(SHAPE, torch.as_tensor(weights), torch.as_tensor(x)).numpy()
    np.testing.assert_allclose(found, forward(SHAPE, weights, x), rtol=1e-13)


def test_error_falls() -> None:
    samples = smooth_surface(40)
    result = train(SHAPE, nguyen_widrow(SHAPE, 0), samples, Settings(epochs=300, goal=0.0))
    assert result.mse.min() < 0.05 * result.mse[0]
    assert samples.mse(SHAPE, result.weights) == pytest.approx(result.mse.min(), rel=1e-12)
    assert result.test_mse[-1] < result.test_mse[0]
    assert result.epochs == 300
    assert result.status.startswith("all 300 epochs used")


def test_best_weights_are_kept_when_the_last_are_worse() -> None:
    samples = smooth_surface(40)
    result = train(SHAPE, nguyen_widrow(SHAPE, 0), samples, Settings(epochs=60, goal=0.0, learning_rate=0.5))
    assert result.mse.min() < 0.9 * result.mse[-1], "the last weights are the best: nothing is tested"
    assert samples.mse(SHAPE, result.weights) == pytest.approx(result.mse.min(), rel=1e-12)


def test_stops_at_the_goal_and_repeats_to_the_bit() -> None:
    first, second = (train(SHAPE, nguyen_widrow(SHAPE, 0), smooth_surface(40), Settings(goal=1e-2)) for _ in range(2))
    assert first.mse[-1] <= 1e-2 < first.mse[-2]
    assert first.status.startswith("goal reached")
    np.testing.assert_array_equal(first.weights, second.weights)
