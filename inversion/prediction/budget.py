"""Where the width of a prediction comes from, and which measurement would narrow it most.

Of the variance of a sensor's largest reading: `effect` is the variance between the explanations' means, `parameters`
the mean variance within them (of the bird's constants and of the magnitudes), which together are that of the model with
tolerances at their values and the model error that the records let expect of each draw (law of total variance): what
the records correct is no width. `tolerances`, `discrepancy`, `mesh` and `emulator` each let one source alone vary about
the median curve, the tolerances about the draw of the likeliest model that is nearest to it. The shares are of the sum
of these six.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.formatting import listing, plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.labels import in_words
from birdstrike.inversion.prediction.curves import PARTS, SensorDraws
from birdstrike.inversion.prediction.learnt import Learnt
from birdstrike.inversion.prediction.sample import EFFECT

SOURCES = ("parameters", "effect", "discrepancy", "mesh", "tolerances", "emulator")
ROUNDING = 1e-12  # share of the variance up to which equal draws differ by their last digits alone
WORTH = 0.1  # share of the variance from which on a remedy is given


def variances(draws: SensorDraws) -> dict[str, float]:
    """Variance of the largest reading by source, SI squared."""
    between, within = _total_variance(draws.nominal, draws.sample.explanation, draws.sample.weights)
    middle = np.median(draws.model + draws.learnt, axis=0)
    alone = {part: float(draws.tops(middle + draws.parts[part]).var()) for part in PARTS}
    return {"parameters": within, "effect": between, **alone, "tolerances": float(draws.loose.var())}


def shares(draws: SensorDraws) -> dict[str, float]:
    """Shares of the variance of the largest reading."""
    found = variances(draws)
    whole = sum(found.values()) or 1.0
    parts = {source: found[source] / whole for source in SOURCES}
    return {source: share if share > ROUNDING else 0.0 for source, share in parts.items()}


def _total_variance(values: Array, groups: NDArray[np.int64], weights: Array) -> tuple[float, float]:
    """Variance between the groups' means, and mean variance within them."""
    mean, between, within = float(weights @ values), 0.0, 0.0
    for group in np.unique(groups):
        of = groups == group
        share = float(weights[of].sum())
        own = float(weights[of] @ values[of]) / share
        between += share * (own - mean) ** 2
        within += float(weights[of] @ (values[of] - own) ** 2)
    return between, within


def narrowing(
    found: Mapping[str, SensorDraws], learnt: Learnt, tolerances: Sequence[str], first: str
) -> tuple[dict[str, str | float], ...]:
    """What to measure or compute, the most useful first: source, share, width that would be left (SI), sentence.

    first: the sensor that counts, that of the first limit.
    """
    draws = found[first]
    low, high = np.quantile(draws.tops(draws.values), [0.025, 0.975])
    width = float(high - low)
    rows: list[dict[str, str | float]] = []
    for source, share in sorted(shares(draws).items(), key=lambda entry: -entry[1]):
        if share < WORTH:
            continue
        left = width * float(np.sqrt(1.0 - share))
        text = _remedy(source, draws, learnt, tolerances, first)
        sentence = (
            f"{text} ({source}: {100.0 * share:.0f} % of the variance of the largest {plain(first)}; without it the "
            f"95 % interval would be {reading(left, draws.unit)} wide, now {reading(width, draws.unit)})"
        )
        rows.append({"source": source, "share": share, "width_left": left, "sentence": sentence})
    return tuple(rows)


def _remedy(source: str, draws: SensorDraws, learnt: Learnt, tolerances: Sequence[str], first: str) -> str:
    if source == "parameters":
        return (
            f"determine {_dominant(draws)} better: a further shot at the learnt rig, inverted together with the first"
        )
    if source == "effect" and learnt.source == "calibrate-models":
        return "decide between the bird models: fire a shot at another speed and calibrate again"
    if source == "effect":
        if learnt.next_measurement:
            return f"decide between the explanations: {learnt.next_measurement}"
        return "decide between the explanations: repeat the learnt shot with a further sensor and diagnose both"
    if source == "tolerances":
        named = listing([_named(key, tolerances) for key in tolerances]) or "what differs from shot to shot"
        return f"measure {named} of the new shot"
    if source == "mesh":
        return "simulate the new case on a finer mesh"
    if source == "emulator":
        return "raise --budget, so that the emulator errs less"
    return (
        f"fire a shot between the learnt conditions and the new ones, with {plain(first)}: it shows the model's error "
        "there"
    )


def _dominant(draws: SensorDraws) -> str:
    """The parameter or magnitude that moves the largest reading most, by a linear regression."""
    columns = {
        key: column for key, column in draws.sample.values.items() if np.isfinite(column).all() and np.ptp(column) > 0.0
    }
    if not columns:
        return "the bird"
    x = np.stack([(c - c.mean()) / c.std() for c in columns.values()], axis=1)
    slopes = np.linalg.lstsq(x, draws.nominal - draws.nominal.mean(), rcond=None)[0]
    return _named(list(columns)[int(np.abs(slopes).argmax())], columns)


def _named(key: str, among: Iterable[str]) -> str:
    """A column of the draws, a parameter's or an effect's, in words."""
    if key.startswith(EFFECT):
        return in_words(key.removeprefix(EFFECT))
    return plain(key, (one for one in among if not one.startswith(EFFECT)))
