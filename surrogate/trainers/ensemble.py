"""Many networks at once: Levenberg-Marquardt in one batch, each network with its own weights and damping.

The rules of `levenberg_marquardt`, on (N, ...) tensors: a network whose step fails keeps its Jacobian and raises its
mu, one that has reached a stopping rule leaves the batch. Nothing of one network touches another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.network import Shape, nguyen_widrow
from birdstrike.surrogate.trainers.levenberg_marquardt import Settings
from birdstrike.surrogate.trainers.training import Samples, Training, one_torch_thread

if TYPE_CHECKING:
    from torch import Tensor

MEMBERS = 50


@one_torch_thread()
def train(
    shape: Shape,
    start: Array,
    samples: Samples,
    settings: Settings | None = None,
    progress: Progress = silent,
) -> Training:
    """Train from the starting weights `start` (N, p); weights (N, p) and mean errors over the members come back."""
    import torch  # takes seconds to load, so only who trains many networks waits for it

    rules = settings or Settings()
    batch = _Batch(shape, torch.as_tensor(start), samples, rules)
    history = [batch.errors()]
    while len(batch.active):
        batch.step()
        history.append(batch.errors())
        progress(float(batch.epochs.max()) / rules.epochs)
    mse, test_mse = np.array(history).T
    return Training("ensemble", batch.weights.numpy(), mse, test_mse, np.full(len(mse), np.nan), batch.status())


def starts(shape: Shape, members: int, seed: int) -> Array:
    """(members, p) Nguyen-Widrow weights from consecutive seeds."""
    return np.stack([nguyen_widrow(shape, seed + i) for i in range(members)])


@dataclass
class _Batch:
    """All networks; active: (a,) those still in training, whose residuals and Gram matrices are at hand."""

    shape: Shape
    weights: Tensor
    samples: Samples
    rules: Settings

    def __post_init__(self) -> None:
        import torch

        self.torch: Any = torch
        self.weights = self.weights.clone()
        many = len(self.weights)
        self.x, self.t = torch.as_tensor(self.samples.x), torch.as_tensor(self.samples.t)
        self.mu = torch.full((many,), self.rules.mu, dtype=torch.float64)
        self.epochs = torch.zeros(many, dtype=torch.int64)
        self.mse = ((forward(self.shape, self.weights, self.x) - self.t) ** 2).mean(dim=(1, 2))
        self.active = torch.arange(many)
        self.dual = len(self.samples.t) * self.shape.outputs < self.shape.weights
        self.rows, self.error, self.gram = self._linearised(self.active)
        self._retire()

    def _linearised(self, who: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """J (a, m, p), e (a, m) and the smaller of J J^T and J^T J."""
        y, rows = jacobian(self.shape, self.weights[who], self.x)
        error = (y - self.t).reshape(len(who), -1)
        gram = rows @ rows.transpose(1, 2) if self.dual else rows.transpose(1, 2) @ rows
        return rows, error, gram

    def step(self) -> None:
        """One attempt of every active network; those that went down get a new Jacobian."""
        torch = self.torch
        who = self.active
        trial = self.weights[who] + self._directions(self.mu[who])
        mse = ((forward(self.shape, trial, self.x) - self.t) ** 2).mean(dim=(1, 2))
        down = mse < self.mse[who]
        took = who[down]
        self.weights[took], self.mse[took] = trial[down], mse[down]
        self.epochs[took] += 1
        self.mu[took] = torch.clamp(self.mu[took] * self.rules.mu_decrease, min=self.rules.mu_min)
        self.mu[who[~down]] *= self.rules.mu_increase
        if down.any():
            self.rows[down], self.error[down], self.gram[down] = self._linearised(took)
        self._retire()

    def _directions(self, mu: Tensor) -> Tensor:
        """d (a, p) of (J^T J + mu I) d = -J^T e, by Cholesky; where that fails no step, so that mu rises."""
        damped = self.gram + mu[:, None, None] * self.torch.eye(self.gram.shape[1], dtype=self.torch.float64)
        factor, failed = self.torch.linalg.cholesky_ex(damped)
        gradient = self.rows.transpose(1, 2) @ self.error[..., None]
        solved = self.torch.cholesky_solve(self.error[..., None] if self.dual else gradient, factor)
        steps = (self.rows.transpose(1, 2) @ solved if self.dual else solved)[..., 0]
        return self.torch.where((failed == 0)[:, None], -steps, self.torch.zeros_like(steps))

    def _retire(self) -> None:
        """Leave out those that reached a rule."""
        who, rules = self.active, self.rules
        gradient = (self.rows.transpose(1, 2) @ self.error[..., None])[..., 0].norm(dim=1) * 2.0 / self.error.shape[1]
        going = (self.mse[who] > rules.goal) & (self.epochs[who] < rules.epochs) & (self.mu[who] <= rules.mu_max)
        going &= gradient >= rules.min_gradient
        if not going.all():
            self.active = who[going]
            self.rows, self.error, self.gram = self.rows[going], self.error[going], self.gram[going]

    def errors(self) -> tuple[float, float]:
        """Mean over the networks of their training and test errors; NaN where there is no test set."""
        if not len(self.samples.x_test):
            return float(self.mse.mean()), float("nan")
        x, t = self.torch.as_tensor(self.samples.x_test), self.torch.as_tensor(self.samples.t_test)
        return float(self.mse.mean()), float(((forward(self.shape, self.weights, x) - t) ** 2).mean())

    def status(self) -> str:
        """How many reached the goal, and after how many epochs."""
        reached = int((self.mse <= self.rules.goal).sum())
        epochs = f"{int(self.epochs.min())} to {int(self.epochs.max())} epochs"
        return f"{reached} of {len(self.mse)} networks reached the goal {self.rules.goal:.0e}, after {epochs}"


def forward(shape: Shape, weights: Tensor, x: Tensor) -> Tensor:
    """Outputs (N, n, outputs) of weights (N, p) for shared inputs x (n, inputs)."""
    w1, b1, w2, b2 = _parts(shape, weights)
    return (x @ w1.transpose(1, 2) + b1[:, None]).tanh() @ w2.transpose(1, 2) + b2[:, None]


def jacobian(shape: Shape, weights: Tensor, x: Tensor) -> tuple[Tensor, Tensor]:
    """Outputs (N, n, outputs) and their derivatives (N, n * outputs, p), rows sample by sample; see `network`."""
    w1, b1, w2, b2 = _parts(shape, weights)
    a = (x @ w1.transpose(1, 2) + b1[:, None]).tanh()
    slope = (1.0 - a * a)[:, :, None, :] * w2[:, None]  # (N, n, outputs, hidden)
    rows = weights.new_zeros(len(weights), len(x), shape.outputs, shape.weights)
    end1, end2, end3 = shape.ends
    rows[..., :end1] = (slope[..., None] * x[:, None, None, :]).flatten(-2)
    rows[..., end1:end2] = slope
    for o in range(shape.outputs):
        rows[:, :, o, end2 + o * shape.hidden : end2 + (o + 1) * shape.hidden] = a
        rows[:, :, o, end3 + o] = 1.0
    return a @ w2.transpose(1, 2) + b2[:, None], rows.flatten(1, 2)


def _parts(shape: Shape, weights: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    end1, end2, end3 = shape.ends
    many = len(weights)
    w1 = weights[:, :end1].view(many, shape.hidden, shape.inputs)
    w2 = weights[:, end2:end3].view(many, shape.outputs, shape.hidden)
    return w1, weights[:, end1:end2], w2, weights[:, end3:]
