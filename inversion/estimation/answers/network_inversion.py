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

    raw: (k,) SI as it says it, theta: (k,) inside the ranges; noise_error: (k,) standard deviation that `sources` give
    to raw, the measurement's noise first, in fractions of the ranges, each in its scale; warnings: sentences for the
    user.
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
    moves = fit.network.fractions(draws) - fit.network.fractions(values[None])
    noise_error = np.sqrt(np.mean(moves**2, axis=0))
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

    A parameter that is not identified has its whole range: the network knows no prior that a case states. Errors and
    intervals are of the fraction of the range in its scale, so that of a logarithmic range they are factors.
    """
    limits = list(zip(dataset.lows.tolist(), dataset.highs.tolist(), strict=True))
    places = dataset.to_unit(answer.raw)
    found = [_interval(dataset, fit, answer, places, i) if inside else (None, OUTSIDE) for i in range(len(limits))]
    ends = np.array([interval or (0.0, 1.0) for interval, _ in found]).T
    narrow = identified(np.diff(ends, axis=0)[0], NormalPrior.of_ranges(len(limits)).width())
    low, high = np.clip(dataset.to_physical(ends), dataset.lows, dataset.highs)
    estimates: dict[str, Estimate] = {}
    for i, (name, (interval, why)) in enumerate(zip(dataset.names, found, strict=True)):
        value, known = float(answer.theta[i]), bool(interval is not None and narrow[i])
        given = reported(value, (float(low[i]), float(high[i])), limits[i], known) if interval is not None else None
        estimates[name] = Estimate(value, given, dataset.units[i], known, why)
    return estimates


def _interval(
    dataset: Dataset, fit: NetworkFit, answer: NetworkAnswer, places: Array, i: int
) -> tuple[tuple[float, float] | None, str]:
    """Fraction of the range +- Student's t times held-out error and noise (root sum square), inside 0..1; and why.

    places: (k,) fractions at which the network's raw answer stands.
    """
    errors, place = fit.errors[:, i], float(places[i])
    if len(errors) < FEWEST_HELD_OUT:
        return None, f"only {many(len(errors), 'held-out sample')}: too few for an interval"
    error, noise = rms(errors), float(answer.noise_error[i])
    spread = float(student.ppf(0.975, len(errors)) * np.hypot(error, noise))
    if not 0.0 <= place <= 1.0:
        raw = quantity(float(answer.raw[i]), dataset.units[i])
        return None, f"the network's answer, {raw}, is outside the range: it never saw such a curve"
    if fit.network.outputs.bounded and min(place, 1.0 - place) < SATURATED:
        end = "lower" if place < 0.5 else "upper"
        return None, f"the network's bounded output stands at the {end} end of the range: it may mean any value beyond"
    moved = " and ".join(answer.sources) + (", which moves" if len(answer.sources) == 1 else ", which move")
    why = (
        f"interval from the {len(errors)} held-out samples, on which the network errs by {_size(dataset, i, error)} "
        f"({100 * error:.0f} % of the range), and the {moved} it by {_size(dataset, i, noise)}"
    )
    return (max(place - spread, 0.0), min(place + spread, 1.0)), why


def _size(dataset: Dataset, i: int, fraction: float) -> str:
    """A change of parameter i by a fraction of its range: in its unit, or as the factor of a logarithmic range."""
    low, high = float(dataset.lows[i]), float(dataset.highs[i])
    if not dataset.logarithmic[i]:
        return quantity(fraction * (high - low), dataset.units[i])
    decades = abs(np.log10(high / low))
    return f"a factor of {10.0 ** (fraction * decades):.3g}"


def _clipped(dataset: Dataset, i: int, raw: float) -> str:
    limit = float(np.clip(raw, dataset.lows[i], dataset.highs[i]))
    said, kept = (quantity(value, dataset.units[i], 4) for value in (raw, limit))
    return f"the network gives {plain(dataset.names[i], dataset.names)} {said}, outside its range; {kept} is used"
