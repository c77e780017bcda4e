"""The backpropagation network: one tanh hidden layer, linear output, all weights in one flat vector.

y = W2 tanh(W1 x + b1) + b2. With 12 displacements, 9 hidden neurons and 4 parameters it has 157 weights.
Layout of the vector: W1 (hidden, inputs) row by row, b1 (hidden), W2 (outputs, hidden) row by row, b2 (outputs).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array

# tanh is close to straight for |net input| < 2 and flat outside; the start spreads each neuron over that stretch.
ACTIVE_NET_INPUT = 2.0


@dataclass(frozen=True)
class Shape:
    """Numbers of inputs, hidden neurons and outputs."""

    inputs: int
    hidden: int
    outputs: int

    @property
    def weights(self) -> int:
        """Length of the weight vector."""
        return self.hidden * (self.inputs + 1) + self.outputs * (self.hidden + 1)

    @property
    def ends(self) -> tuple[int, int, int]:
        """Where W1, b1 and W2 end in the weight vector."""
        end1 = self.hidden * self.inputs
        return end1, end1 + self.hidden, end1 + self.hidden + self.outputs * self.hidden

    def __str__(self) -> str:
        return f"{self.inputs}-{self.hidden}-{self.outputs}"


def unpack(shape: Shape, weights: Array) -> tuple[Array, Array, Array, Array]:
    """Views W1 (hidden, inputs), b1 (hidden,), W2 (outputs, hidden), b2 (outputs,) of the flat vector."""
    end1, end2, end3 = shape.ends
    w1 = weights[:end1].reshape(shape.hidden, shape.inputs)
    w2 = weights[end2:end3].reshape(shape.outputs, shape.hidden)
    return w1, weights[end1:end2], w2, weights[end3:]


def forward(shape: Shape, weights: Array, x: Array) -> Array:
    """Outputs (n, outputs) for scaled inputs x (n, inputs)."""
    w1, b1, w2, b2 = unpack(shape, weights)
    return np.tanh(x @ w1.T + b1) @ w2.T + b2


def jacobian(shape: Shape, weights: Array, x: Array, out: Array | None = None) -> tuple[Array, Array]:
    """Outputs (n, outputs) and their derivatives d y / d weights (n * outputs, weights), rows sample by sample.

    With a = tanh(W1 x + b1): dy_o/dW2_oh = a_h, dy_o/db2_o = 1, dy_o/db1_h = W2_oh (1 - a_h^2) and
    dy_o/dW1_hi = dy_o/db1_h x_i. `out` (n, outputs, weights), zeros outside these places, is filled in place if given.
    """
    w1, b1, w2, b2 = unpack(shape, weights)
    a = np.tanh(x @ w1.T + b1)
    slope = (1.0 - a * a)[:, None, :] * w2
    rows = np.zeros((len(x), shape.outputs, shape.weights)) if out is None else out
    end1, end2, end3 = shape.ends
    rows[..., :end1] = (slope[..., None] * x[:, None, None, :]).reshape(len(x), shape.outputs, end1)
    rows[..., end1:end2] = slope
    for o in range(shape.outputs):
        rows[:, o, end2 + o * shape.hidden : end2 + (o + 1) * shape.hidden] = a
        rows[:, o, end3 + o] = 1.0
    return a @ w2.T + b2, rows.reshape(-1, shape.weights)


def nguyen_widrow(shape: Shape, seed: int) -> Array:
    """Starting weights that tile the input cube 0..1 with the active stretches of the hidden neurons.

    Each hidden neuron gets a random direction of length 0.7 hidden^(1/inputs) over inputs -1..1 and a bias on an even
    grid, so that the neurons' steep regions cover the cube; then inputs are moved from -1..1 to 0..1 and net inputs to
    -2..2, where tanh works. Output weights and biases: uniform in -1..1.
    Nguyen and Widrow, "Improving the learning speed of 2-layer neural networks", IJCNN 1990.
    """
    rng = np.random.default_rng(seed)
    length = 0.7 * shape.hidden ** (1.0 / shape.inputs)
    direction = rng.uniform(-1.0, 1.0, (shape.hidden, shape.inputs))
    w = ACTIVE_NET_INPUT * length * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    grid = np.linspace(-1.0, 1.0, shape.hidden) if shape.hidden > 1 else np.zeros(1)
    b = ACTIVE_NET_INPUT * length * grid * np.sign(direction[:, 0])
    output = rng.uniform(-1.0, 1.0, shape.outputs * (shape.hidden + 1))
    return np.concatenate([(2.0 * w).ravel(), b - w.sum(axis=1), output])
