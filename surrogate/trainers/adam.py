"""Adam training of the same network, in torch and float64: the modern default beside Levenberg-Marquardt.

Kingma and Ba, "Adam: a method for stochastic optimization", 2014; all samples in every step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.network import Shape
from birdstrike.surrogate.trainers.training import Samples, Training, one_torch_thread

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True)
class Settings:
    """Stopping rules and step size."""

    epochs: int = 2000
    goal: float = 1e-3  # mean squared error of the scaled outputs
    learning_rate: float = 0.01


@one_torch_thread()
def train(
    shape: Shape,
    start: Array,
    samples: Samples,
    settings: Settings | None = None,
    progress: Progress = silent,
) -> Training:
    """Train from the weights `start`; Adam may go uphill, so the best weights are kept. Nothing is drawn at random."""
    import torch

    rules = settings or Settings()
    weights = torch.tensor(start, dtype=torch.float64, requires_grad=True)
    x, t = torch.as_tensor(samples.x), torch.as_tensor(samples.t)
    optimiser = torch.optim.Adam([weights], lr=rules.learning_rate)
    history: list[tuple[float, float]] = []
    best_mse, best = float("inf"), np.array(start, dtype=np.float64)
    while len(history) <= rules.epochs and best_mse > rules.goal:
        optimiser.zero_grad()
        loss = torch.mean((torch_forward(shape, weights, x) - t) ** 2)
        loss.backward()
        now = weights.detach().numpy().copy()
        history.append((float(loss.detach()), samples.test_mse(shape, now)))
        if history[-1][0] < best_mse:
            best_mse, best = history[-1][0], now
        optimiser.step()
        progress(min(1.0, len(history) / rules.epochs))
    mse, test_mse = np.array(history).T
    return Training("adam", best, mse, test_mse, np.full(len(mse), np.nan), _status(rules, len(mse) - 1, best_mse))


def torch_forward(shape: Shape, weights: Tensor, x: Tensor) -> Tensor:
    """`network.forward` on torch tensors: weights (shape.weights,), x (n, inputs) -> (n, outputs)."""
    end1, end2, end3 = shape.ends
    w1 = weights[:end1].view(shape.hidden, shape.inputs)
    w2 = weights[end2:end3].view(shape.outputs, shape.hidden)
    return (x @ w1.T + weights[end1:end2]).tanh() @ w2.T + weights[end3:]


def _status(rules: Settings, epochs: int, best_mse: float) -> str:
    if best_mse <= rules.goal:
        return f"goal reached at epoch {epochs} of {rules.epochs}: MSE {best_mse:.2e} <= {rules.goal:.0e}"
    return f"all {rules.epochs} epochs used, goal {rules.goal:.0e} not reached: best MSE {best_mse:.2e}"
