"""All methods on one case whose truth is known: parameter errors, curve errors, verified errors, runs, seconds.

The record is the solver's own, of the case's own values, with noise of known size; the model is the same solver. So the
table says what each method makes of the data, and nothing of how right the solver is.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import many
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.known_errors import stacked
from birdstrike.inversion.estimation.posterior import sample
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.identifiability.information import bound
from birdstrike.inversion.misfit import rmse
from birdstrike.inversion.models.optimisers import from_the_middle
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.features import covered
from birdstrike.surrogate.holdout import input_times
from birdstrike.surrogate.inverse_network import fit_network, usual_copies

TRAINERS = {"network LM": "lm", "network Adam": "adam", "network trainbr": "br", "ensemble of 50": "ensemble"}
NOISES = (0.0, 0.02e-3, 0.05e-3)  # [m], of a displacement; other channels in proportion to their peaks
POINTS = (12, 200)
NOISELESS = 1e-3  # of NOISES[1]: what a record without noise is taken to have, since no fit can weigh by nothing
FIRST = 0.1  # of the record: before it nothing moves

ALLOWED = "allowed by noise and prior (1 sd)"
ABOVE = (
    f'The line "{ALLOWED}" is the standard deviation that the noise and the prior allow at this truth, linearised. '
    "The errors are those of one draw of the noise: a single one may lie below it."
)

LOOPS = 6  # iterations of the optimiser with the solver in its loop, each k + 1 runs


@dataclass(frozen=True)
class Condition:
    """noise: [m]; points of each channel; channels: sensors' names."""

    noise: float
    points: int
    channels: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.noise * 1e3:g} mm, {self.points} points, {many(len(self.channels), 'channel')}"


@dataclass(frozen=True)
class MethodScore:
    """One method under one condition.

    errors: name -> |value - truth| as a share of the range, in its scale; predicted, verified: RMS of the curve over
    the noise-free truth's, whitened by 0.02 mm and its like, by the emulator and by the solver; runs: of the solver,
    the campaign's included; bounds: name -> what `ALLOWED` names, share of the range, None without noise.
    """

    condition: str
    method: str
    errors: dict[str, float]
    predicted: float | None
    verified: float
    runs: int
    seconds: float
    bounds: dict[str, float] | None


@dataclass(frozen=True)
class KnownCase:
    """What the methods are given: campaign, forward model, the truth and its histories."""

    dataset: Dataset
    forward: Forward
    truth: Mapping[str, float]
    histories: Histories
    emulators: Mapping[tuple[str, ...], Emulator]

    @classmethod
    def of(cls, dataset: Dataset, forward: Forward, truth: Mapping[str, float], channels: tuple[str, ...]) -> KnownCase:
        """Run the truth and fit the emulators, for one channel and for all."""
        sets = ((channels[0],), channels)
        return cls(dataset, forward, truth, forward(truth), {own: fit_emulator(dataset, own) for own in sets})

    def record(self, condition: Condition, seed: int = 0) -> Observations:
        """The truth with the condition's noise; without any, weighed as if it had a thousandth of 0.02 mm."""
        end = self.dataset.time[-1]
        times = np.linspace(FIRST * end, end, condition.points)
        rng = np.random.default_rng(seed)
        channels, sigma, units = {}, {}, {}
        for name in condition.channels:
            size = self.size(name)
            weight = size * (condition.noise or NOISELESS * NOISES[1])
            channels[name] = self.histories.at(name, times) + size * condition.noise * rng.normal(size=len(times))
            sigma[name], units[name] = np.full(len(times), weight), self.histories.units[name]
        measured = Measured(times, channels, sigma, units, ("SIMULATED by birdstrike",), "method comparison")
        return observe(measured, self.dataset, {})

    def size(self, channel: str) -> float:
        """Noise of a channel for 1 m of noise in the first: in proportion to the peaks."""
        first = next(iter(self.emulators))[0]
        peaks = [np.abs(self.histories.channels[name]).max() for name in (channel, first)]
        return float(peaks[0] / peaks[1])


def conditions(channels: tuple[str, ...]) -> list[Condition]:
    """Noise 0, 0.02 and 0.05 mm; 12 and 200 points; the first channel and all, where there are more."""
    sets = dict.fromkeys(((channels[0],), channels))
    return [Condition(noise, points, own) for own in sets for points in POINTS for noise in NOISES]


def score_methods(bench: KnownCase, channels: tuple[str, ...], progress: Progress = silent) -> Iterator[MethodScore]:
    """Every method under every condition, each answer verified by the solver."""
    chosen = conditions(channels)
    for i, condition in enumerate(chosen):
        record = bench.record(condition)
        known = _bounds(bench, condition, record)
        for method, solve in _methods(bench, condition, record).items():
            begun = time.perf_counter()
            theta, extra = solve()
            seconds = time.perf_counter() - begun
            yield _row(bench, condition, record, method, theta, extra, seconds, known)
            progress((i + 0.9) / len(chosen))


Solve = Callable[[], tuple[Array, int]]


def _methods(bench: KnownCase, condition: Condition, record: Observations) -> dict[str, Solve]:
    """Name -> parameters (k,) SI, and the solver's runs beyond the campaign (negative: without the campaign)."""
    emulator = bench.emulators[condition.channels]
    coordinates = parameter_coordinates(bench.dataset, emulator.regions)
    calibrator = Calibrator(CurveModel(emulator, record), coordinates, 0.0)
    networks = {name: lambda t=trainer: (_network(bench, record, t), 0) for name, trainer in TRAINERS.items()}
    return {
        **networks,
        "emulator MAP": lambda: (calibrator.fit()[0].theta, 0),
        "emulator posterior mean": lambda: (sample(calibrator, calibrator.fit()).theta.mean(axis=0), 0),
        "least squares, solver in the loop": lambda: _solver_in_the_loop(bench, record),
    }


def _network(bench: KnownCase, record: Observations, trainer: str) -> Array:
    """The network's answer with the outputs and noisy copies that `train-and-invert` has by default."""
    read = input_times({c.name: c.times for c in record.channels}, bench.dataset)
    chosen = np.concatenate([np.isin(c.times, read[c.name]) for c in record.channels])
    copies = usual_copies(trainer, "bounded")
    fit = fit_network(bench.dataset, read, trainer, noise=record.noise[chosen], copies=copies, outputs="bounded")
    found = fit.network.predict(record.values[chosen][None])[0]
    return np.clip(found, bench.dataset.lows, bench.dataset.highs)


def _solver_in_the_loop(bench: KnownCase, record: Observations) -> tuple[Array, int]:
    """Trust-region least squares from the middle of the ranges; runs counted, the campaign not among them."""
    space, runs = ParameterSpace.of_dataset(bench.dataset), 0

    def residual(z: Array) -> Array:
        nonlocal runs
        runs += 1
        theta = bench.dataset.named(space.to_physical(z))
        return (stacked(bench.forward(theta), record, 0.0) - record.values) / record.noise

    found = from_the_middle(residual, len(space.names), LOOPS)
    return space.to_physical(found.x), runs - len(bench.dataset.runs)


def _row(
    bench: KnownCase,
    condition: Condition,
    record: Observations,
    method: str,
    theta: Array,
    extra: int,
    seconds: float,
    bounds: dict[str, float] | None,
) -> MethodScore:
    names, space = bench.dataset.names, ParameterSpace.of_dataset(bench.dataset)
    truth = np.array([bench.truth[name] for name in names])
    errors = bench.dataset.named(np.abs(space.to_unit(theta) - space.to_unit(truth)))
    unit = np.concatenate([np.full(len(c.times), NOISES[1] * bench.size(c.name)) for c in record.channels])
    clean = stacked(bench.histories, record, 0.0) / unit
    model = CurveModel(bench.emulators[condition.channels], record)
    stands = bool(covered(model.emulator.regions, theta[None])[0])
    predicted = rmse(model.curve(theta, 0.0) / unit, clean) if stands else None
    run = bench.forward(bench.dataset.named(theta))
    verified = rmse(stacked(run, record, 0.0) / unit, clean)
    return MethodScore(
        condition=str(condition),
        method=method,
        errors=errors,
        predicted=predicted,
        verified=verified,
        runs=len(bench.dataset.runs) + extra,
        seconds=seconds,
        bounds=bounds,
    )


def _bounds(bench: KnownCase, condition: Condition, record: Observations) -> dict[str, float] | None:
    """Standard deviation that noise and prior allow at this truth, share of the range, None without noise.

    (F + P)^-1/2 of `identifiability.information`, with the emulator linearised at the truth. It bounds no single
    error, of which this comparison has one a condition: that of one draw of the noise may lie below it.
    """
    if not condition.noise:
        return None
    emulator = bench.emulators[condition.channels]
    coordinates = parameter_coordinates(bench.dataset, emulator.regions)
    calibrator = Calibrator(CurveModel(emulator, record), coordinates, 0.0)
    truth = np.array([bench.truth[name] for name in bench.dataset.names])
    return bench.dataset.named(bound(calibrator, coordinates.nearest(truth)[None]))
