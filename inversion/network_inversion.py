"""Inversion by the network: measured values in, parameters out, as the bird-strike literature does it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from data.dataset import Dataset
from data.histories import Array
from inversion.coordinates import Coordinates
from inversion.emulator_inversion import OUTSIDE
from inversion.identifiability import NEWS
from inversion.inversion import Estimate
from inversion.observations import Observations
from inversion.words import plain, quantity
from surrogate.inverse_network import NetworkFit

FEWEST_HELD_OUT = 3


@dataclass(frozen=True)
class NetworkAnswer:
    """What the network says: theta (k,) SI inside the ranges, and sentences for the user."""

    theta: Array
    warnings: tuple[str, ...]


def network_answer(
    dataset: Dataset, fit: NetworkFit, observations: Observations, read: Mapping[str, Array]
) -> NetworkAnswer:
    """The network's parameters for the measured values, clipped to the ranges.

    read: channel -> measured instants [s] at which the network reads, on the record's clock.
    """
    values = np.concatenate([c.values[np.isin(c.times, read[c.name])] for c in observations.channels])
    raw = fit.network.predict(values[None])[0]
    theta = np.clip(raw, dataset.lows, dataset.highs)
    scaled = fit.network.inputs.to_unit(values)
    strange = int(((scaled < 0.0) | (scaled > 1.0)).sum())
    warnings = [_clipped(dataset, i, raw[i]) for i in range(len(raw)) if theta[i] != raw[i]]
    if strange:
        warnings.append(f"{strange} of the network's {len(values)} inputs lie outside what it was trained on")
    return NetworkAnswer(theta, (*fit.notes, *warnings))


def network_estimates(
    dataset: Dataset, fit: NetworkFit, answer: NetworkAnswer, coordinates: Coordinates, inside_cloud: bool
) -> dict[str, Estimate]:
    """Values with intervals from the errors on the held-out samples; none where those are fewer than three."""
    prior = coordinates.prior_width() * (dataset.highs - dataset.lows)
    estimates: dict[str, Estimate] = {}
    for i, name in enumerate(dataset.names):
        interval, why = _interval(dataset, fit.errors[:, i], float(answer.theta[i]), i)
        identified = inside_cloud and interval is not None and interval[1] - interval[0] < NEWS * prior[i]
        why = why if inside_cloud else OUTSIDE
        estimates[name] = Estimate(float(answer.theta[i]), interval, dataset.units[i], bool(identified), why)
    return estimates


def _interval(dataset: Dataset, errors: Array, value: float, i: int) -> tuple[tuple[float, float] | None, str]:
    """value +- Student's t times the root mean square error of the held-out samples, inside the range."""
    if len(errors) < FEWEST_HELD_OUT:
        return None, f"only {len(errors)} held-out samples: too few for an interval"
    size = float(np.sqrt(np.mean(errors**2)))
    spread = float(student.ppf(0.975, len(errors))) * size
    low, high = float(dataset.lows[i]), float(dataset.highs[i])
    typical = f"{quantity(size, dataset.units[i])} ({size / (high - low):.0%} of the range)"
    why = f"interval from the {len(errors)} held-out samples, on which the network errs by {typical}"
    return (max(value - spread, low), min(value + spread, high)), why


def _clipped(dataset: Dataset, i: int, raw: float) -> str:
    limit = float(np.clip(raw, dataset.lows[i], dataset.highs[i]))
    said, kept = (quantity(value, dataset.units[i], 4) for value in (float(raw), limit))
    return f"the network gives {plain(dataset.names[i])} {said}, outside its range; {kept} is used"
