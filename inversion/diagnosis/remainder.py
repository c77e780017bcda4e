"""What no effect of the library explains: pairs of effects, and else what the remainder looks like."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.signal import periodogram
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.refit import fit_effect
from birdstrike.inversion.diagnosis.verdict import NONE

PAIRS = 12  # most promising pairs that are refitted


@dataclass(frozen=True)
class Remainder:
    """The part of the record that no model explains; unattributed.

    channel: where it is largest; start, end [s]: between which it lies; rms: SI; period [s] of its main oscillation,
    None where it has none; decay [1/s] of its envelope; curve: smoothed, on the points of that channel.
    """

    channel: str
    start: float
    end: float
    rms: float
    period: float | None
    decay: float | None
    times: Array
    curve: Array

    @property
    def sentence(self) -> str:
        """What it looks like, in words."""
        span = f"{1e3 * self.start:.2f} .. {1e3 * self.end:.2f} ms"
        shape = f"swings with a period of {1e3 * self.period:.2f} ms" if self.period else "does not swing"
        fades = f", its envelope {'decays' if (self.decay or 0) > 0 else 'grows'} by {abs(self.decay or 0):.0f} 1/s"
        return f"unattributed remainder in {self.channel}, {span}: {shape}{fades if self.decay else ''}"

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        found = asdict(self)
        return {
            **found,
            "times": list(map(float, self.times)),
            "curve": list(map(float, self.curve)),
            "sentence": self.sentence,
        }


def pairs(judge: Judge, models: dict[str, Judged], alpha: float, progress: Callable[[float], None]) -> list[Judged]:
    """Pairs of effects that the data allow, at a stricter level: 2 alpha, because many pairs are tried.

    The pairs are those whose two signatures together explain most of the remainder of the model without effects.
    """
    base = models[NONE]
    linear = base.fit.linear
    scores = {pair: _explained(linear.projected[:, list(pair)], linear.remainder) for pair in _pairs(linear.seen)}
    best = sorted(scores, key=lambda pair: -scores[pair])[:PAIRS]
    found: list[Judged] = []
    names = base.fit.problem.names
    for i, pair in enumerate(best):
        judged = judge.judged(" + ".join(names[j] for j in pair), fit_effect(base.fit.problem, pair, [base.fit]))
        if judged.p >= 2.0 * alpha:
            found.append(judged)
        progress((i + 1) / len(best))
    return sorted(found, key=lambda one: one.fit.cost)


def _pairs(seen: np.ndarray) -> list[tuple[int, int]]:
    return list(combinations(map(int, np.flatnonzero(seen)), 2))


def _explained(signatures: Array, remainder: Array) -> float:
    basis, s, _ = np.linalg.svd(signatures, full_matrices=False)
    return float(((basis[:, s > 1e-6 * s.max()].T @ remainder) ** 2).sum())


def remainder(judge: Judge, judged: Judged) -> Remainder:
    """The miss of the best model as a smooth curve (Gaussian process), orthogonal to what the model can imitate."""
    record, miss = judge.record, judge.record.values - judged.fit.curve
    whole = judge.measurement + judge.numerical
    shares = [
        np.mean((miss[record.channel == i] ** 2) / np.diag(whole)[record.channel == i])
        for i in range(len(record.traces))
    ]
    number = int(np.argmax(shares))
    here = record.channel == number
    times, values, trace = record.middle[here], miss[here], record.traces[number]
    curve = _smooth(times, values, trace.level)
    strong = np.abs(curve) > 0.3 * np.abs(curve).max()
    start, end = times[strong][0], times[strong][-1]
    period = _period(times, curve)
    return Remainder(
        trace.name,
        float(start),
        float(end),
        float(np.sqrt(np.mean(curve**2))),
        period,
        _decay(times, curve, period),
        times,
        curve,
    )


def _smooth(times: Array, values: Array, noise: float) -> Array:
    """Posterior mean of a Matern process on the miss, its length and size by maximum likelihood."""
    unit, scale = (times - times[0]) / (times[-1] - times[0]), float(np.std(values)) or 1.0
    level = (noise / scale) ** 2
    kernel: Any = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(0.1, (0.02, 2.0), nu=2.5) + WhiteKernel(
        level, (0.3 * level, 3 * level)
    )
    thin = slice(None, None, max(1, len(unit) // 200))
    process = GaussianProcessRegressor(kernel, random_state=0).fit(unit[thin, None], values[thin] / scale)
    return np.asarray(process.predict(unit[:, None]), dtype=np.float64) * scale


def _period(times: Array, curve: Array) -> float | None:
    """Of the strongest oscillation that fits into the record at least one and a half times."""
    step = float(np.median(np.diff(times)))
    frequency, power = periodogram(curve, 1.0 / step, window="hann", nfft=8 * len(curve), detrend="linear")
    fits = frequency > 1.5 / (times[-1] - times[0])
    if not fits.any() or power[fits].max() < 0.3 * power.max():
        return None
    return float(1.0 / frequency[fits][power[fits].argmax()])


def _decay(times: Array, curve: Array, period: float | None) -> float | None:
    """Rate of the envelope's exponential decay, by its maxima."""
    if period is None:
        return None
    size = np.abs(curve)
    peaks = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    peaks = peaks[size[peaks] > 0.05 * size.max()]
    return float(-np.polyfit(times[peaks], np.log(size[peaks]), 1)[0]) if len(peaks) >= 3 else None
