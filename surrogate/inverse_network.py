"""The inverse network: sampled curves in, parameters out, trained on a campaign with some runs held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, part_of, silent
from birdstrike.surrogate import hidden_size
from birdstrike.surrogate.holdout import held_out
from birdstrike.surrogate.network import Shape, forward, nguyen_widrow
from birdstrike.surrogate.scaling import OutputScaling, Scaling
from birdstrike.surrogate.trainers import adam, bayesian_regularisation, ensemble, levenberg_marquardt
from birdstrike.surrogate.trainers.training import Samples, Training

HIDDEN = 9  # found best among 7 to 14 by the authors of the bird-strike network
SEARCH = 0.9  # share of the progress that a search for the hidden size takes
ROUNDING = 1e-6  # of a channel's largest value
OUTPUTS = ("bounded", "linear")
"""Outputs that stay inside the ranges, and those of the bird-strike network, which may leave them."""
NOISY_COPIES = 10
"""Copies of every training run with the record's noise, by default.

Without any, bounded outputs err by half the range and their intervals are too narrow on some records; more than 10 cost
time and gain little (docs/models.md)."""
STALLED = 100
"""Epochs after which Levenberg-Marquardt ends where the error of noisy copies falls no more; it cannot reach 0."""
TRAINERS = {
    "lm": levenberg_marquardt.train,
    "adam": adam.train,
    "br": bayesian_regularisation.train,
    "ensemble": ensemble.train,
}


def refuse_unknown(trainer: str, outputs: str = "bounded") -> None:
    """Raise UserError for a trainer or a kind of outputs that there is not."""
    for name, given, known in (("outputs", outputs, OUTPUTS), ("trainer", trainer, tuple(TRAINERS))):
        if given not in known:
            raise UserError(f'{name} = "{given}" is unknown; use one of: {", ".join(known)}')


def usual_copies(trainer: str, outputs: str) -> int:
    """Noisy copies where none are asked for: none of linear outputs, which are the bird-strike network's, nor of an
    ensemble, whose 50 networks would take minutes."""
    return NOISY_COPIES if outputs == "bounded" and trainer != "ensemble" else 0


@dataclass(frozen=True)
class InverseNetwork:
    """A trained network with the scalings that belong to it.

    names: (k) dotted case keys it returns; times: channel -> instants [s] it reads, in the order of its inputs;
    weights: (p,), or (N, p) of an ensemble, whose mean answers; inputs, outputs: scalings of the sampled values (SI)
    and of the parameters (SI), these over the case's ranges in their scales.
    """

    names: tuple[str, ...]
    times: Mapping[str, Array]
    shape: Shape
    weights: Array
    inputs: Scaling
    outputs: OutputScaling

    def predict(self, values: Array) -> Array:
        """Parameters (n, k) SI from sampled values (n, inputs) SI, channel after channel; linear outputs may leave
        the ranges."""
        ranges = self.outputs
        found = ranges.to_physical(self.fractions(values))
        return np.clip(found, ranges.lows, ranges.highs) if ranges.bounded else found  # rounding leaves no range

    def fractions(self, values: Array) -> Array:
        """The same as fractions (n, k) of the ranges, each in its scale."""
        x, members = self.inputs.to_unit(values), np.atleast_2d(self.weights)
        return self.outputs.fractions(np.mean([forward(self.shape, w, x) for w in members], axis=0))


@dataclass(frozen=True)
class NetworkFit:
    """A network, how it was trained, and how it does on the runs it never saw.

    held_out: (h,) positions of the test runs among the campaign's; errors: (h, k) predicted minus true parameters, in
    fractions of the ranges, each in its scale; seen: (2, inputs) lowest and highest scaled inputs that it was trained
    on, noisy copies included;
    notes: sentences a user should read; tried: numbers of hidden neurons with their errors, where they were searched.
    """

    network: InverseNetwork
    training: Training
    held_out: NDArray[np.int64]
    errors: Array
    seen: Array
    notes: tuple[str, ...]
    tried: tuple[hidden_size.HiddenSize, ...] = ()


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
    hidden: int | None = HIDDEN,
    seed: int = 0,
    progress: Progress = silent,
    noise: Array | None = None,
    copies: int = 0,
    outputs: str = "bounded",
    nuisances: Array | None = None,
) -> NetworkFit:
    """Train on all runs but the held-out ones; inputs and outputs scaled to 0..1 over what it is trained on.

    A run that repeats another is neither: it would test the network by what it was trained on. Outputs over the case's
    ranges. trainer: "lm" (Levenberg-Marquardt), "adam", "br" (Bayesian regularisation) or "ensemble" (50 networks by
    Levenberg-Marquardt); hidden: None searches 7 to 14 by cross-validation among the training runs; copies: of every
    training run with noise (inputs,) SI on its inputs, and with nuisances (inputs, s) SI, the change of the inputs for
    one standard deviation of each. outputs: "bounded" or "linear".
    Raises UserError for an unknown trainer or kind of outputs, and for a search among fewer than 3 training runs.
    """
    refuse_unknown(trainer, outputs)
    values, theta = sampled(dataset, times), dataset.parameters
    own = np.flatnonzero(dataset.distinct)
    test = own[held_out(len(own))]
    train = np.setdiff1d(own, test)
    inputs = Scaling.over(values[train], _least(dataset, times))
    ranges = OutputScaling(dataset.lows, dataset.highs, dataset.scales, outputs == "bounded")
    x, t = inputs.to_unit(values), ranges.targets(theta)
    notes, tried = _notes(inputs), ()
    if hidden is None:
        tried = hidden_size.search(
            x[train], t[train], seed=seed, progress=part_of(progress, 0.0, SEARCH), fractions=ranges.fractions
        )
        progress = part_of(progress, SEARCH, 1.0)
        hidden, notes = hidden_size.best(tried).hidden, (*notes, _tried(tried))
    shape = Shape(values.shape[1], hidden, theta.shape[1])
    learnt = _augmented(inputs, values[train], noise, copies, seed, nuisances)
    samples = Samples(learnt, np.tile(t[train], (copies + 1, 1)), x[test], t[test])
    start = ensemble.starts(shape, ensemble.MEMBERS, seed) if trainer == "ensemble" else nguyen_widrow(shape, seed)
    rules = {"settings": levenberg_marquardt.Settings(stalled=STALLED)} if copies and trainer == "lm" else {}
    training = TRAINERS[trainer](shape, start, samples, progress=progress, **rules)
    if warned := bayesian_regularisation.warning(training, samples.t.size):
        notes = (*notes, warned)
    network = InverseNetwork(dataset.names, dict(times), shape, training.weights, inputs, ranges)
    seen = np.stack([learnt.min(axis=0), learnt.max(axis=0)])
    errors = network.fractions(values[test]) - dataset.to_unit(theta[test])
    return NetworkFit(network, training, test, errors, seen, notes, tried)


def _augmented(
    inputs: Scaling, values: Array, noise: Array | None, copies: int, seed: int, nuisances: Array | None = None
) -> Array:
    """Scaled inputs of the training runs (n, inputs), then their noisy copies: ((copies + 1) n, inputs)."""
    if not copies:
        return inputs.to_unit(values)
    if noise is None:
        raise UserError("copies with noise need the noise of every input")
    rng = np.random.default_rng(seed)
    draws = rng.normal(size=(copies, *values.shape)) * noise
    if nuisances is not None and nuisances.size:
        draws += rng.normal(size=(copies, len(values), nuisances.shape[1])) @ nuisances.T
    return inputs.to_unit(np.vstack([values, *(values + draw for draw in draws)]))


def _tried(sizes: Sequence[hidden_size.HiddenSize]) -> str:
    """The search in words."""
    shown = ", ".join(f"{s.hidden}: {100 * s.mean:.0f} ({100 * s.spread:.0f})" for s in sizes)
    chosen = hidden_size.best(sizes).hidden
    return (
        f"{chosen} hidden neurons have the smallest cross-validated error of {hidden_size.STARTS} starts each; in % of "
        f"the ranges, with the starts' spread: {shown}"
    )


def _least(dataset: Dataset, times: Mapping[str, Array]) -> Array:
    """Span (inputs,) SI up to which an input is constant: before first motion the runs differ by rounding only."""
    peaks = [np.full(len(t), np.abs(dataset.curves[channel]).max()) for channel, t in times.items()]
    return ROUNDING * np.concatenate(peaks)


def _notes(inputs: Scaling) -> tuple[str, ...]:
    constant = int(inputs.constant.sum())
    if not constant:
        return ()
    many = f"{constant} of the network's {len(inputs.constant)} inputs"
    return (f"{many} are the same in all training runs and carry no information",)
