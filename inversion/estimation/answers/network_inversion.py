"""Inversion by the network: measured values in, parameters out, as the bird-strike literature does it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import listing, many, plain, quantity
from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.answers.estimates import OUTSIDE, reported
from birdstrike.inversion.estimation.prior import NormalPrior, identified
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.observations.autocorrelation import correlated, neighbour_correlation
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.surrogate.inverse_network import NetworkFit

FEWEST_HELD_OUT = 3
NOISE_DRAWS = 200
MOST_NAMED = 5  # inputs
CLOCK, CARRIED = "the uncertain time origin", "the errors that the model carries"
SATURATED = 0.02  # of a range: a bounded output nearer to an end has lost its slope


@dataclass(frozen=True)
class NetworkAnswer:
    """What the network says of the measured values.

    raw: (k,) SI as it says it, theta: (k,) inside the ranges; noise_error: (k,) SI standard deviation that `sources`
    give to raw, the measurement's noise first; warnings: sentences for the user.
    """

    raw: Array
    theta: Array
    noise_error: Array
    sources: tuple[str, ...]
    warnings: tuple[str, ...]


def network_answer(
    dataset: Dataset,
    fit: NetworkFit,
    observations: Observations,
    read: Mapping[str, Array],
    drift: Array,
    seed: int = 0,
) -> NetworkAnswer:
    """The network's parameters for the measured values, clipped to the ranges.

    read: channel -> measured instants [s] at which the network reads, on the record's clock; drift: (n,) or (n, s),
    change of the stacked curve for one standard deviation of the time origin, then of every other error that the model
    carries.
    """
    chosen = np.concatenate([np.isin(c.times, read[c.name]) for c in observations.channels])
    values, noise = observations.values[chosen], observations.noise[chosen]
    times = {c.name: c.times[np.isin(c.times, read[c.name])] for c in observations.channels}
    own = [neighbour_correlation(times[c.name], c.correlation_time) for c in observations.channels]
    correlation = np.concatenate(own)
    raw = fit.network.predict(values[None])[0]
    rng = np.random.default_rng(seed)
    moved = drift[chosen].reshape(len(values), -1)
    draws = (
        values
        + noise * correlated(rng.normal(size=(NOISE_DRAWS, len(values))), correlation)
        + rng.normal(size=(NOISE_DRAWS, moved.shape[1])) @ moved.T
    )
    noise_error = np.sqrt(np.mean((fit.network.predict(draws) - raw) ** 2, axis=0))
    theta = np.clip(raw, dataset.lows, dataset.highs)
    warnings = [_clipped(dataset, i, float(raw[i])) for i in range(len(raw)) if theta[i] != raw[i]]
    scaled = fit.network.inputs.to_unit(values)
    if (strange := (scaled < fit.seen[0]) | (scaled > fit.seen[1])).any():
        warnings.append(_strange(strange, read))
    sources = [name for name, columns in ((CLOCK, moved[:, :1]), (CARRIED, moved[:, 1:])) if columns.any()]
    return NetworkAnswer(raw, theta, noise_error, ("noise", *sources), (*fit.notes, *warnings))


def _strange(outside: NDArray[np.bool_], read: Mapping[str, Array]) -> str:
    """Which inputs lie outside what the network was trained on; outside: (inputs,) bool."""
    places = [(channel, time) for channel, times in read.items() for time in times]
    named = [f"{plain(c)} at {1e3 * t:.3g} ms" for (c, t), one in zip(places, outside, strict=True) if one]
    shown = listing(named, MOST_NAMED)
    lie = "lies" if len(named) == 1 else "lie"
    return (
        f"{len(named)} of the network's {many(len(outside), 'input')} {lie} outside what it was trained on ({shown}): "
        "it extrapolates there, and its verification run alone says what its answer is worth; widen the campaign's "
        "ranges"
    )


def network_estimates(dataset: Dataset, fit: NetworkFit, answer: NetworkAnswer, inside: bool) -> dict[str, Estimate]:
    """Values, with intervals from the errors on the held-out samples and the noise where there is ground for them.

    A parameter that is not identified has its whole range: the network knows no prior that a case states. How narrow an
    interval is counts in the scale of the range.
    """
    limits = list(zip(dataset.lows.tolist(), dataset.highs.tolist(), strict=True))
    found = [_interval(dataset, fit, answer, i) if inside else (None, OUTSIDE) for i in range(len(limits))]
    ends = np.array([interval or whole for (interval, _), whole in zip(found, limits, strict=True)])
    width = np.diff(ParameterSpace.of_dataset(dataset).to_unit(ends.T), axis=0)[0]
    narrow = identified(width, NormalPrior.of_ranges(len(limits)).width())
    estimates: dict[str, Estimate] = {}
    for i, (name, (interval, why)) in enumerate(zip(dataset.names, found, strict=True)):
        value, known = float(answer.theta[i]), bool(interval is not None and narrow[i])
        given = reported(value, interval, limits[i], known) if interval is not None else None
        estimates[name] = Estimate(value, given, dataset.units[i], known, why)
    return estimates


def _interval(
    dataset: Dataset, fit: NetworkFit, answer: NetworkAnswer, i: int
) -> tuple[tuple[float, float] | None, str]:
    """raw +- Student's t times held-out error and noise (root sum square), inside the range; and the reason."""
    errors = fit.errors[:, i]
    if len(errors) < FEWEST_HELD_OUT:
        return None, f"only {many(len(errors), 'held-out sample')}: too few for an interval"
    low, high, unit = float(dataset.lows[i]), float(dataset.highs[i]), dataset.units[i]
    error, noise, raw = rms(errors), float(answer.noise_error[i]), float(answer.raw[i])
    spread = float(student.ppf(0.975, len(errors)) * np.hypot(error, noise))
    if not low <= raw <= high:
        return None, f"the network's answer, {quantity(raw, unit)}, is outside the range: it never saw such a curve"
    if fit.network.outputs.bounded and min(raw - low, high - raw) < SATURATED * (high - low):
        end = "lower" if raw - low < high - raw else "upper"
        return None, f"the network's bounded output stands at the {end} end of the range: it may mean any value beyond"
    moved = " and ".join(answer.sources) + (", which moves" if len(answer.sources) == 1 else ", which move")
    why = (
        f"interval from the {len(errors)} held-out samples, on which the network errs by {quantity(error, unit)} "
        f"({100 * error / (high - low):.0f} % of the range), and the {moved} it by {quantity(noise, unit)}"
    )
    return (max(raw - spread, low), min(raw + spread, high)), why


def _clipped(dataset: Dataset, i: int, raw: float) -> str:
    limit = float(np.clip(raw, dataset.lows[i], dataset.highs[i]))
    said, kept = (quantity(value, dataset.units[i], 4) for value in (raw, limit))
    return f"the network gives {plain(dataset.names[i], dataset.names)} {said}, outside its range; {kept} is used"
