"""The reading of a sensor at rest: offset, drift and mains hum, from the record before contact, with their uncertainty.

reading(t) = model(t) + baseline(t) + noise. The baseline is fitted before contact by least squares and carried on over
the response; what is uncertain in it are columns of the model's error, as for any linear nuisance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import t as student

from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.autocorrelation import Autocorrelation, counting_points, density_freedom
from birdstrike.surrogate.gaussian_process import NORMAL_95

LINE, WITH_HUM = 2, 4  # terms, each a degree of freedom, of the straight line before contact, and with the mains' hum
CLEAR = 4.0  # standard deviations from which a term is there
FALSE_POSITIVES = 1e-3  # share of the records without a term of the baseline in which chance alone shows one
SEEN = 2.0  # standard deviations from which a bend counts as possible
MAINS = (50.0, 60.0)  # [Hz]
WHOLE_PERIODS = 0.8  # of the mains that the record before contact must span for its hum to be fitted
EXPLAINED = 0.3  # share of the variance before contact that a hum must explain
SHIFTED = "offset"
DRIFTED = "offset and drift"


@dataclass(frozen=True)
class Baseline:
    """offset + drift (t - middle) + hum, SI; middle [s]: of the record before contact.

    kind: in words; frequency: of the hum [Hz], 0 without; coefficients: (k,) SI; covariance: (k, k); hums: of a drift,
    frequency of the mains [Hz] -> (4, q) changes of offset, drift and hum, one standard deviation each, where the drift
    is the beginning of a hum; points: before contact; drift_kept: whether the sensor drifts besides, which is left in
    the record.
    """

    kind: str
    middle: float
    frequency: float
    coefficients: Array
    covariance: Array
    hums: Mapping[float, Array]
    points: int
    drift_kept: bool = False

    @property
    def drifts(self) -> bool:
        """Whether it has a drift, with the uncertainty of that."""
        return self.kind != SHIFTED

    def at(self, times: Array) -> Array:
        """(n,) the reading at rest."""
        return self._terms(times) @ self.coefficients

    def columns(self, times: Array) -> Array:
        """(n, s) changes of the reading at rest for one standard deviation of what is uncertain in it."""
        if self.hums:
            return np.hstack([terms(times, WITH_HUM, f, self.middle) @ root for f, root in self.hums.items()])
        values, vectors = np.linalg.eigh(self.covariance)
        return self._terms(times) @ (vectors * np.sqrt(np.maximum(values, 0.0)))

    def interval(self, time: float) -> tuple[float, float]:
        """95 % interval of the reading at rest at an instant [s]."""
        at = np.array([time])
        spread = NORMAL_95 * float(np.sqrt((self.columns(at) ** 2).sum()))
        return float(self.at(at)[0]) - spread, float(self.at(at)[0]) + spread

    def without_drift(self) -> Baseline:
        """What is left of it at the record's zero, to which a drift runs and from which it goes on: offset and hum.

        The offset's uncertainty is that of the whole at the record's zero.
        """
        keep = np.eye(len(self.coefficients))
        if len(keep) > 1:
            keep[0, 1], keep[1, 1] = -self.middle, 0.0
        covariance = keep @ self.covariance @ keep.T
        if self.hums:
            covariance[0, 0] = (self.columns(np.zeros(1)) ** 2).sum()
        kept = len(keep) if self.frequency else 1
        return replace(
            self,
            kind=self.kind if self.frequency else SHIFTED,
            coefficients=(keep @ self.coefficients)[:kept],
            covariance=covariance[:kept, :kept],
            hums={},
            drift_kept=self.kind == DRIFTED,
        )

    def sentence(self, name: str, unit: str) -> str:
        """What the sensor reads at rest, what is made of it, and what to do."""
        low, high = self.interval(self.middle)
        interval = f"{reading(low, unit, 4)} .. {reading(high, unit, 4)}"
        reads = f"{reading((low + high) / 2.0, unit)} (95 %: {interval})"
        kind = "" if self.kind == SHIFTED else f" and has a {self.kind.removeprefix('offset and ')}"
        remedy = "" if kind or self.drift_kept else "; birdstrike import --zero takes it out of the record"
        remedy += "; its drift is kept, as a diagnosis looks for drifts" if self.drift_kept else ""
        return (
            f"{plain(name)} reads {reads}{kind} before contact, over {self.points} points: its zero is taken "
            f"from there and the uncertainty of this is carried by the fit{remedy}"
        )

    def _terms(self, times: Array) -> Array:
        """(n, k)."""
        return terms(times, len(self.coefficients), self.frequency, self.middle)


def terms(times: Array, count: int, frequency: float, middle: float) -> Array:
    """(n, count) of 1, t - middle, sin and cos."""
    apart = times - middle
    phase = 2.0 * np.pi * frequency * apart
    return np.stack([np.ones(len(times)), apart, np.sin(phase), np.cos(phase)][:count], axis=1)


def hum_of(times: Array, values: Array) -> float:
    """Frequency of the mains hum in the record before contact [Hz]; 0 where there is none, or it is too short.

    The frequencies compete also where only the higher is spanned, which must then be clearly better: a hum of 50 Hz
    would pass for one of 60 Hz. It must also be clear beside the noise that is left, whose spectrum may rise there.
    """
    spanned = {f: float(np.ptp(times)) * f >= WHOLE_PERIODS for f in MAINS}
    if not any(spanned.values()):
        return 0.0
    line, found = _squares(_left(times, values, 0.0)), {f: _squares(_left(times, values, f)) for f in MAINS}
    best, other = sorted(MAINS, key=lambda f: found[f])
    clear = spanned[other] or found[other] - found[best] > CLEAR**2 * found[best] / len(times)
    explained = spanned[best] and clear and found[best] < (1.0 - EXPLAINED) * line
    return best if explained and _beside_noise(times, values, best, line - found[best]) else 0.0


def best_hum(times: Array, values: Array) -> float:
    """Frequency of the mains whose hum leaves least of the readings [Hz]."""
    return min(MAINS, key=lambda f: _squares(_left(times, values, f)))


def _beside_noise(times: Array, values: Array, frequency: float, gain: float) -> bool:
    """Whether a hum takes more from the sum of squares than noise of the spectrum that is left does (F-test).

    S(f) = sigma^2 (1 - r^2) / (1 - 2 r cos(2 pi f dt) + r^2) of a first-order process; two terms of a hum take 2 S.
    """
    residual = _left(times, values, frequency)
    if not residual.any():
        return True
    noise, n = Autocorrelation.of(residual, WITH_HUM), len(times)
    phase = 2.0 * np.pi * frequency * float(np.median(np.diff(times)))
    shape = (1.0 - noise.r**2) / (1.0 - 2.0 * noise.r * np.cos(phase) + noise.r**2)
    density = shape * _squares(residual) / counting_points(n, WITH_HUM, noise)
    return gain > 2.0 * density * float(f_distribution.isf(FALSE_POSITIVES, 2, density_freedom(n, noise.of_mean)))


def _left(times: Array, values: Array, frequency: float) -> Array:
    """(n,) readings about offset, drift and hum."""
    rows = terms(times, WITH_HUM if frequency else LINE, frequency, float(times.mean()))
    return values - rows @ np.linalg.lstsq(rows, values, rcond=None)[0]


def _squares(residual: Array) -> float:
    return float(residual @ residual)


def constant_baseline(times: Array, reading: float, rounding: float) -> Baseline:
    """The baseline of readings that are all the same; rounding: standard deviation of the digitiser's rounding, SI."""
    return Baseline(
        kind=SHIFTED,
        middle=float(times.mean()),
        frequency=0.0,
        coefficients=np.array([reading]),
        covariance=np.array([[rounding**2]]),
        hums={},
        points=len(times),
    )


def baseline_of(
    times: Array, values: Array, worth: float, hum: float, rounding: float = 0.0, freedom: float = np.inf
) -> Baseline | None:
    """The baseline of a record before contact, None where nothing but noise shows.

    times, values: (n,) before contact; worth: variance of the noise, times n over the number of independent points, SI;
    hum: frequency of the mains [Hz], 0 without; rounding: standard deviation of a digitiser's rounding that the noise
    does not average out, SI; freedom: degrees of freedom behind `worth` where it is that of correlated noise.
    """
    limit = max(CLEAR, float(student.isf(FALSE_POSITIVES / 2.0, freedom)))
    for count in (4, 2, 1) if hum else (2, 1):
        middle = float(times.mean())
        rows = terms(times, count, hum if count == 4 else 0.0, middle)
        inverse = np.linalg.inv(rows.T @ rows)
        found = inverse @ rows.T @ values
        size = np.abs(found) / np.sqrt(worth * np.diag(inverse))
        bend = _Bend.of(times, values, worth) if count == 2 else None
        if max(size[count // 2 :].max(), bend.clear if bend else 0.0) > limit:
            kind = {1: SHIFTED, 2: DRIFTED, 4: f"offset and hum of {hum:g} Hz"}[count]
            frequency = hum if count == 4 else 0.0
            covariance = worth * inverse
            covariance[0, 0] += rounding**2
            return Baseline(
                kind=kind,
                middle=middle,
                frequency=frequency,
                coefficients=found,
                covariance=covariance,
                hums=_possible_hums(times, values, worth, rounding, found, bend) if bend else {},
                points=len(times),
            )
    return None


@dataclass(frozen=True)
class _Bend:
    """Coefficient of (t - middle)^2 before contact, SI, and its standard deviation."""

    coefficient: float
    deviation: float

    @classmethod
    def of(cls, times: Array, values: Array, worth: float) -> _Bend:
        """By least squares, with offset and drift."""
        apart, length = times - times.mean(), float(np.ptp(times))
        rows = np.stack([np.ones(len(times)), apart, apart**2], axis=1) / np.array([1.0, length, length**2])
        inverse = np.linalg.inv(rows.T @ rows)
        coefficient = float((inverse @ rows.T @ values)[2])
        return cls(coefficient / length**2, float(np.sqrt(worth * inverse[2, 2])) / length**2)

    @property
    def clear(self) -> float:
        """Its size in standard deviations."""
        return abs(self.coefficient) / self.deviation

    @property
    def seen(self) -> float:
        """The coefficient where it counts as possible, else 0."""
        return self.coefficient if self.clear > SEEN else 0.0


def _possible_hums(
    times: Array, values: Array, worth: float, rounding: float, line: Array, bend: _Bend
) -> dict[float, Array]:
    """`Baseline.hums` of a drift, of each frequency of the mains, which are as likely.

    A sin(w (t - middle) + phase) has the rate A w cos(phase) and the bend -A w^2 sin(phase) / 2 at the middle, so that
    both together give its amplitude. That is the prior standard deviation of sine and cosine, and the record says how
    much of a hum it leaves possible: of a short rest nearly all, of half a period next to nothing (linear regression
    with a normal prior: O'Hagan & Forster, Bayesian Inference, 2004, ch. 11). The straight line stays what is
    subtracted; how far the regression lies off it is one more change.
    """
    middle, length, found = float(times.mean()), float(np.ptp(times)), dict[float, Array]()
    for frequency in MAINS:
        w = 2.0 * np.pi * frequency
        size = float(np.hypot(line[1] / w, 2.0 * bend.seen / w**2))
        scales = np.array([1.0, 1.0 / length, size, size])
        data = terms(times, WITH_HUM, frequency, middle) * scales / np.sqrt(worth)
        prior = np.eye(WITH_HUM)[LINE:]
        u, s, v = np.linalg.svd(np.vstack([data, prior]), full_matrices=False)
        mean = v.T @ (u.T @ np.append(values / np.sqrt(worth), np.zeros(len(prior))) / s)
        off = scales * mean - np.append(line, np.zeros(len(prior)))
        changes = np.column_stack([scales[:, None] * v.T / s, off, rounding * np.eye(WITH_HUM)[0]])
        found[frequency] = changes / np.sqrt(len(MAINS))
    return found
