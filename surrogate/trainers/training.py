"""What a trainer is given and what it leaves behind: samples, weights, convergence curve, why it stopped; threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from birdstrike.data.histories import Array
from birdstrike.data.storage.files import write_atomically
from birdstrike.surrogate.network import Shape, forward


@dataclass(frozen=True)
class Samples:
    """Scaled inputs x (n, inputs) and targets t (n, outputs) to train on, and a test set that only watches.

    x_stop, t_stop: a validation set whose error ends the training early, if given.
    """

    x: Array
    t: Array
    x_test: Array
    t_test: Array
    x_stop: Array | None = None
    t_stop: Array | None = None

    def mse(self, shape: Shape, weights: Array) -> float:
        """Mean squared error of the scaled outputs on the training samples."""
        return mean_square(forward(shape, weights, self.x) - self.t)

    def test_mse(self, shape: Shape, weights: Array) -> float:
        """The same on the test samples; NaN where there are none."""
        return mean_square(forward(shape, weights, self.x_test) - self.t_test)

    def stop_mse(self, shape: Shape, weights: Array) -> float:
        """The same on the validation samples; NaN where there are none."""
        if self.x_stop is None or self.t_stop is None:
            return float("nan")
        return mean_square(forward(shape, weights, self.x_stop) - self.t_stop)


@dataclass(frozen=True)
class Training:
    """One training of one network.

    weights: (shape.weights,) the best on the training samples; mse: (epochs + 1,) mean squared error of the scaled
    outputs on the training samples, the start included; test_mse: (epochs + 1,) on the test samples, NaN where there
    are none; damping: (epochs + 1,) Levenberg-Marquardt's mu after each epoch, NaN for a trainer that has none;
    status: a sentence that says why it stopped; effective_weights: of Bayesian regularisation. Of an ensemble of N,
    weights is (N, shape.weights) and the errors are means over its members.
    """

    trainer: str
    weights: Array
    mse: Array
    test_mse: Array
    damping: Array
    status: str
    effective_weights: float | None = None

    @property
    def epochs(self) -> int:
        """Epochs done."""
        return len(self.mse) - 1

    def write(self, path: Path) -> None:
        """The convergence curve as CSV: epoch, mse, test_mse; an empty cell where there is no test set."""
        table = {"epoch": np.arange(len(self.mse)), "mse": self.mse, "test_mse": self.test_mse}
        write_atomically(path, pd.DataFrame(table).to_csv(index=False, lineterminator="\n"))


def mean_square(error: Array) -> float:
    """Mean of the squares; NaN for no samples."""
    return float(np.vdot(error, error)) / error.size if error.size else float("nan")


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Within the block torch computes on one thread: matrices of these sizes gain nothing from more."""
    import torch  # takes seconds to load, so only who trains with it waits for it

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
