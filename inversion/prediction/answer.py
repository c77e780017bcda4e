"""A prediction: bands, largest readings, limits, where the width comes from; its JSON and CSV are a contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from birdstrike.data.arguments import as_path
from birdstrike.data.curves import read_histories
from birdstrike.data.display import Displayed, draw_curves, own_axes, shown_channel
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain, reading, span
from birdstrike.data.histories import Array, Histories
from birdstrike.data.storage.files import file_in, read_json, write_atomically, write_json
from birdstrike.data.units import of_reading
from birdstrike.inversion.prediction.distance import Reach

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

RESULT, TABLE = "prediction.json", "prediction.csv"
QUANTILES = {"q025": 0.025, "q25": 0.25, "q50": 0.5, "q75": 0.75, "q975": 0.975}
SETTLED_FROM = 0.85  # of the record: the residual deflection is taken from the rest


@dataclass(frozen=True)
class Band:
    """One sensor over time: quantile's name -> (m,) SI."""

    unit: str
    kind: str
    time: Array
    quantiles: Mapping[str, Array]


@dataclass(frozen=True)
class Limit:
    """A limit of a sensor's reading, SI; probability that it is exceeded; interval_95: what the draws leave open."""

    value: float
    unit: str
    probability: float
    interval_95: tuple[float, float]


@dataclass(frozen=True)
class AveragedExplanation:
    """One explanation: its probability here, and what became of its effects: label -> carried, drawn anew, ..."""

    name: str
    probability: float
    effects: Mapping[str, str]


@dataclass(frozen=True, repr=False)
class Prediction(Displayed):
    """What the new shot will read.

    extrapolation: sentences about what lies outside the learnt range, none where nothing does; reach: condition ->
    value, learnt range; bands, peaks, residual (displacements at the record's end): by sensor; limits: by sensor;
    perforation: probability that the plate tears, with its interval and the simulations behind it; sources: sensor ->
    shares of the variance of the largest reading; narrowing: what to measure, the most useful first; explanations: what
    was averaged over; posterior: what was used of the folder; campaign: simulations, methods and Q2 by sensor.
    """

    case: str
    source: str
    extrapolation: tuple[str, ...]
    reach: Mapping[str, Reach]
    correlation: float
    growth: float
    limits: Mapping[str, Limit]
    peaks: Mapping[str, Mapping[str, Any]]
    residual: Mapping[str, Mapping[str, Any]]
    perforation: Mapping[str, Any]
    sources: Mapping[str, Mapping[str, float]]
    narrowing: tuple[Mapping[str, Any], ...]
    explanations: tuple[AveragedExplanation, ...]
    posterior: tuple[str, ...]
    tolerances: Mapping[str, Mapping[str, Any]]
    campaign: Mapping[str, Any]
    seed: int
    warnings: tuple[str, ...]
    bands: Mapping[str, Band] = field(default_factory=dict)
    draws: Mapping[str, Array] = field(default_factory=dict)

    def figures(self) -> dict[str, Any]:
        """The content of prediction.json, without the schema's version; what lies outside the learnt range first."""
        own = {key: value for key, value in vars(self).items() if key not in ("bands", "draws")}
        return {
            "extrapolation": list(self.extrapolation),
            **own,
            "reach": {name: asdict(one) for name, one in self.reach.items()},
            "limits": {name: asdict(one) for name, one in self.limits.items()},
            "explanations": [asdict(one) for one in self.explanations],
        }

    def save(self, folder: str | Path) -> None:
        """Write prediction.csv and, last, prediction.json."""
        table, folder = self.to_dataframe(), as_path("folder", folder)
        write_atomically(folder / TABLE, table.to_csv(index=False, lineterminator="\n", float_format="%.9g"))
        write_json(folder / RESULT, self.figures())

    @classmethod
    def load(cls, path: str | Path) -> Prediction:
        """From prediction.json or its folder, with the bands of prediction.csv beside it and without the draws.

        Raises UserError for files that are missing, damaged or of another version.
        """
        file = file_in(path, RESULT)
        content = read_json(file)
        content.pop("schema_version", None)
        try:
            table = read_histories(file.with_name(TABLE))
            content |= {
                "reach": {name: Reach(**one) for name, one in content["reach"].items()},
                "limits": {name: Limit(**one) for name, one in content["limits"].items()},
                "explanations": tuple(AveragedExplanation(**one) for one in content["explanations"]),
                "bands": {name: _band(table, name, one["unit"], content) for name, one in content["peaks"].items()},
            }
            values: dict[str, Any] = {
                name: tuple(one) if isinstance(one, list) else one for name, one in content.items()
            }
            return cls(**values)
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise UserError(
                f"{file}, or {TABLE} beside it, is missing, damaged or of another version; repeat birdstrike predict"
            ) from error

    def to_dataframe(self) -> pd.DataFrame:
        """A row an instant: time_s, then each column of histories.csv with the quantiles' suffixes."""
        import pandas as pd

        time = next(iter(self.bands.values())).time
        columns = {
            _column(name, band.unit, suffix): values
            for name, band in self.bands.items()
            for suffix, values in band.quantiles.items()
        }
        return pd.DataFrame({"time_s": time, **columns})

    def brief(self) -> pd.DataFrame:
        """A row a sensor: quantiles of its largest reading, SI."""
        import pandas as pd

        return pd.DataFrame([{"sensor": name, **one} for name, one in self.peaks.items()])

    @property
    def headline(self) -> str:
        """What is outside the learnt range, then the limits, or the first sensor's largest reading."""
        outside = f"Outside what was learnt: {self.extrapolation[0]}. " if self.extrapolation else ""
        if self.limits:
            return outside + "; ".join(limit_words(name, one) for name, one in self.limits.items())
        name, one = next(iter(self.peaks.items()))
        interval = span(one["q025"], one["q975"], of_reading(one["unit"]))
        return f"{outside}largest {plain(name)}: {reading(one['q50'], one['unit'])} (95 %: {interval})"

    def plot(self, channel: str | None = None, axes: Axes | None = None, **look: Any) -> Axes:
        """Median of one sensor with its 50 and 95 % bands (default: the first sensor)."""
        name, on = shown_channel(channel, self.bands), own_axes(axes)
        band = self.bands[name]
        draw_curves(on, band.time, band.quantiles["q50"], name, band.unit, **look)
        scale = 1.0 if not len(on.lines) else _scale(on, band)
        for low, high, alpha in (("q025", "q975", 0.2), ("q25", "q75", 0.35)):
            below, above = scale * band.quantiles[low], scale * band.quantiles[high]
            on.fill_between(np.asarray(on.lines[-1].get_xdata()), below, above, alpha=alpha)
        return on

    def draw(self) -> tuple[Any, ...]:
        """The first sensors."""
        return tuple(partial(self.plot, name) for name in list(self.bands)[:3])


def _column(sensor: str, unit: str, suffix: str) -> str:
    """Head of a quantile's column in prediction.csv."""
    return f"{f'{sensor}_{unit}'.rstrip('_')}_{suffix}"


def _band(table: Histories, sensor: str, unit: str, content: Mapping[str, Any]) -> Band:
    """A sensor's band as prediction.csv has it; of the kinds only a displacement is known, which has a residual."""
    kind = "displacement" if sensor in content["residual"] else ""
    return Band(unit, kind, table.time, {key: table.channels[_column(sensor, unit, key)] for key in QUANTILES})


def _scale(on: Axes, band: Band) -> float:
    """Engineers' units of the curve just drawn over SI."""
    drawn, own = np.asarray(on.lines[-1].get_ydata()), band.quantiles["q50"]
    at = int(np.argmax(np.abs(own)))
    return float(drawn[at] / own[at]) if own[at] else 1.0


def tearing_words(torn: Mapping[str, Any]) -> str:
    """ "the plate tears: probability 0.02 (95 %: 0.001 .. 0.08), from 40 simulations"."""
    if not torn.get("modelled", True):
        return "tearing is not modelled: the case states no failure strain, or another program simulates it"
    low, high = torn["interval_95"]
    share = f"probability {torn['probability']:.2g} (95 %: {low:.2g} .. {high:.2g})"
    return f"the plate tears: {share}, from {torn['simulations']} simulations"


def limit_words(name: str, one: Limit) -> str:
    """ "displacement centre beyond 8 mm: probability 0.12 (95 %: 0.08 .. 0.17)"."""
    low, high = one.interval_95
    value = reading(one.value, one.unit)
    return f"{plain(name)} beyond {value}: probability {one.probability:.3g} (95 %: {low:.2g} .. {high:.2g})"


def quantiles_of(values: Array) -> dict[str, Any]:
    """Of draws (n,) or (n, m), by name."""
    found = np.quantile(values, list(QUANTILES.values()), axis=0)
    return dict(zip(QUANTILES, found, strict=True))


def share_of(hits: NDArray[np.bool_], count: float, weights: Array | None = None) -> tuple[float, tuple[float, float]]:
    """Probability and its 95 % interval, from (weighted) draws of which `count` are independent: Jeffreys' prior.

    Brown, Cai & DasGupta, Stat. Sci. 16 (2001) 101.
    """
    p = float(np.average(hits, weights=weights))
    if hits.all() or not hits.any():
        p = float(hits.all())
    k = p * count
    low = 0.0 if p == 0.0 else float(beta.ppf(0.025, k + 0.5, count - k + 0.5))
    high = 1.0 if p == 1.0 else float(beta.ppf(0.975, k + 0.5, count - k + 0.5))
    return p, (low, high)


def exceeded(values: Array, limit: float) -> NDArray[np.bool_]:
    """(n,) whether a curve (n, m) passes a limit, away from 0."""
    return np.asarray(values.max(axis=1) > limit if limit > 0.0 else values.min(axis=1) < limit)


def settled(values: Array) -> Array:
    """(n,) mean reading over the record's last part."""
    return values[:, int(SETTLED_FROM * values.shape[1]) :].mean(axis=1)
