"""The inverse network: sampled curves in, parameters out, trained on a campaign with some runs held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data.dataset import Dataset
from data.errors import UserError
from data.histories import Array
from surrogate import adam, levenberg_marquardt
from surrogate.holdout import held_out
from surrogate.network import Shape, forward, nguyen_widrow
from surrogate.scaling import Scaling
from surrogate.training import Samples, Training

HIDDEN = 9  # found best among 7 to 14 by the authors of the bird-strike network
ROUNDING = 1e-6  # of a channel's largest value
TRAINERS = {"lm": levenberg_marquardt.train, "adam": adam.train}


@dataclass(frozen=True)
class InverseNetwork:
    """A trained network with the scalings that belong to it.

    names: (k) dotted case keys it returns; times: channel -> instants [s] it reads, in the order of its inputs;
    inputs, outputs: scalings of the sampled values (SI) and of the parameters (SI).
    """

    names: tuple[str, ...]
    times: Mapping[str, Array]
    shape: Shape
    weights: Array
    inputs: Scaling
    outputs: Scaling

    def predict(self, values: Array) -> Array:
        """Parameters (n, k) SI from sampled values (n, inputs) SI, channel after channel; not clipped to any range."""
        return self.outputs.from_unit(forward(self.shape, self.weights, self.inputs.to_unit(values)))


@dataclass(frozen=True)
class NetworkFit:
    """A network, how it was trained, and how it does on the runs it never saw.

    held_out: (h,) positions of the test runs among the campaign's; errors: (h, k) predicted minus true parameters, SI;
    notes: sentences a user should read.
    """

    network: InverseNetwork
    training: Training
    held_out: NDArray[np.int64]
    errors: Array
    notes: tuple[str, ...]


def sampled(dataset: Dataset, times: Mapping[str, Array]) -> Array:
    """Curves of every run at the given instants [s], (n, inputs); before the record the plate is at rest.

    Raises UserError for an instant after the end of the record.
    """
    end = dataset.time[-1]
    ends = {channel: np.where(np.isclose(t, end, rtol=1e-9, atol=0.0), end, t) for channel, t in times.items()}
    at_rest = {channel: np.maximum(t, dataset.time[0]) for channel, t in ends.items()}
    values = np.concatenate([dataset.sampled(channel, t) for channel, t in at_rest.items()], axis=1)
    if not np.isfinite(values).all():
        raise UserError(f"the network reads instants after the simulated record's end at {end:.6g} s; raise time.end")
    return values


def fit_network(
    dataset: Dataset,
    times: Mapping[str, Array],
    trainer: str = "lm",
    hidden: int = HIDDEN,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> NetworkFit:
    """Train on all runs but the held-out ones; inputs and outputs scaled to 0..1 over what it is trained on.

    Outputs over the case's ranges. trainer: "lm" (Levenberg-Marquardt) or "adam".
    """
    if trainer not in TRAINERS:
        raise UserError(f'trainer = "{trainer}" is unknown; use one of: {", ".join(TRAINERS)}')
    values, theta = sampled(dataset, times), dataset.parameters
    test = held_out(len(theta))
    train = np.setdiff1d(np.arange(len(theta)), test)
    inputs, outputs = Scaling.over(values[train], _least(dataset, times)), Scaling(dataset.lows, dataset.highs)
    x, t = inputs.to_unit(values), outputs.to_unit(theta)
    shape = Shape(values.shape[1], hidden, theta.shape[1])
    samples = Samples(x[train], t[train], x[test], t[test])
    training = TRAINERS[trainer](shape, nguyen_widrow(shape, seed), samples, progress=progress)
    network = InverseNetwork(dataset.names, dict(times), shape, training.weights, inputs, outputs)
    return NetworkFit(network, training, test, network.predict(values[test]) - theta[test], _notes(inputs))


def _least(dataset: Dataset, times: Mapping[str, Array]) -> Array:
    """Span (inputs,) SI up to which an input is constant: before first motion the runs differ by rounding only."""
    peaks = [np.full(len(t), np.abs(dataset.curves[channel]).max()) for channel, t in times.items()]
    return ROUNDING * np.concatenate(peaks)


def _notes(inputs: Scaling) -> tuple[str, ...]:
    constant = int(inputs.constant.sum())
    if not constant:
        return ()
    many = f"{constant} of the network's {len(inputs.constant)} inputs"
    return (f"{many} are the same in all training runs and tell it nothing",)
