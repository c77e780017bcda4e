"""The network: its size, its derivatives against automatic differentiation, its start."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from birdstrike.surrogate.network import Shape, forward, jacobian, nguyen_widrow, unpack
from birdstrike.surrogate.trainers.adam import torch_forward


def test_twelve_nine_four_has_157_weights() -> None:
    assert Shape(12, 9, 4).weights == 157


@pytest.mark.parametrize("shape", [Shape(12, 9, 4), Shape(3, 1, 2), Shape(1, 5, 1)], ids=str)
def test_jacobian_is_that_of_automatic_differentiation(shape: Shape) -> None:
    rng = np.random.default_rng(0)
    weights, x = rng.normal(size=shape.weights), rng.random((7, shape.inputs))
    y, rows = jacobian(shape, weights, x)
    inputs = torch.as_tensor(x)
    truth = torch.func.jacrev(lambda w: torch_forward(shape, w, inputs))(torch.as_tensor(weights))
    np.testing.assert_allclose(rows, truth.reshape(-1, shape.weights).numpy(), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(y, forward(shape, weights, x), rtol=1e-14)


def test_jacobian_in_a_used_workspace_is_the_same() -> None:
    shape, rng = Shape(4, 3, 2), np.random.default_rng(1)
    workspace = np.zeros((5, 2, shape.weights))
    for _ in range(2):
        weights, x = rng.normal(size=shape.weights), rng.random((5, 4))
        np.testing.assert_array_equal(jacobian(shape, weights, x, workspace)[1], jacobian(shape, weights, x)[1])


def test_nguyen_widrow_puts_every_neuron_to_work_inside_the_cube() -> None:
    shape = Shape(12, 9, 4)
    w1, b1, _, _ = unpack(shape, nguyen_widrow(shape, seed=3))
    steepness = np.linalg.norm(w1, axis=1)
    np.testing.assert_allclose(steepness, 2.0 * 2.0 * 0.7 * 9 ** (1 / 12), rtol=1e-12)
    distance = (w1 @ np.full(12, 0.5) + b1) / (0.5 * steepness)  # of the steep plane from the cube's middle, half edges
    np.testing.assert_allclose(np.sort(np.abs(distance)), np.sort(np.abs(np.linspace(-1.0, 1.0, 9))), atol=1e-12)


def test_start_follows_the_seed() -> None:
    shape = Shape(12, 9, 4)
    np.testing.assert_array_equal(nguyen_widrow(shape, 5), nguyen_widrow(shape, 5))
    assert not np.array_equal(nguyen_widrow(shape, 5), nguyen_widrow(shape, 6))
