"""The record before contact: straight line, hum, scatter about them, and whether the plate already moves."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution
from scipy.stats import median_abs_deviation
from scipy.stats import t as student

from birdstrike.data.histories import Array
from birdstrike.inversion.observations.autocorrelation import WHITE, Autocorrelation, counting_points, density_freedom
from birdstrike.inversion.observations.baseline import (
    FALSE_POSITIVES,
    LINE,
    WITH_HUM,
    Baseline,
    baseline_of,
    best_hum,
    constant_baseline,
    hum_of,
    terms,
)
from birdstrike.inversion.observations.high_frequency import ROUNDED

FEWEST_FOR_LEVEL = 8  # points before contact from which a noise level is taken where none is stated
FEWEST_FOR_TEST = 20  # points before contact that can overrule a stated level, or show a correlation
CUBIC = 4  # terms
LEAST_BENT = 0.25  # of a period of the mains
UNEXPLAINED = 0.01  # of the bends by a hum, that are taken for a motion
SPIKE = 8.0  # robust standard deviations about the straight line before contact
ROUNDING = 1e-12  # of the largest value: less is the rounding of the line, not noise
RUNS_OFF = 0.3  # of the peak
MOVES = 0.02  # of the peak, by which the end of a record before contact may leave the line through its beginning


@dataclass(frozen=True)
class BeforeContact:
    """The record while the plate is at rest: times [s], residual about its straight line and hum, offset and level, SI.

    offset: mean reading, which should be 0; level: standard deviation about the line, None where the points are too few
    or all on the line; values: the readings without single spikes; hum: frequency of the mains in them [Hz], 0 without;
    bent: frequency of a hum too short to be carried on [Hz], 0 without; moves_until: last instant [s] of a record that
    is not at rest, so that its clock is ahead of the case's: the others are then of its first half, about a cubic;
    fitted: terms that the residual is about, 2 of a line, 4 with a hum; correlation: of the residual;
    rounding: standard deviation of a digitiser's rounding that the mean does not average out, SI.
    """

    times: Array
    residual: Array
    offset: float
    level: float | None
    values: Array = field(default_factory=lambda: np.zeros(0))
    hum: float = 0.0
    bent: float = 0.0
    moves_until: float | None = None
    fitted: int = LINE
    correlation: Autocorrelation = WHITE
    rounding: float = 0.0

    @classmethod
    def of(cls, times: Array, values: Array, peak: float, length: float = 0.0, step: float = 0.0) -> BeforeContact:
        """From the points before contact; offset and drift of a sensor are no noise, nor are single spikes.

        length: of the response [s]: a drift that would carry the record off by a third of its peak is none; step: of
        the channel's digitiser, SI, 0 without.
        """
        if len(times) < FEWEST_FOR_LEVEL:
            return cls(times, values, 0.0, None)
        spiked = _spikes(times, values)
        times, values = times[~spiked], values[~spiked]
        hum = hum_of(times, values)
        rows = terms(times, WITH_HUM if hum else LINE, hum, float(times.mean()))
        found = np.linalg.lstsq(rows, values, rcond=None)[0]
        residual, bent = values - rows @ found, 0.0
        if _runs_off(rows, times, residual, float(found[1]), length, peak) or _moves(times, residual, peak):
            bent = 0.0 if hum else _bent_by_mains(times, values, peak)
            if not bent:
                return cls._moving(times, values, peak)
            rows = terms(times, WITH_HUM, bent, float(times.mean()))
            residual = values - rows @ np.linalg.lstsq(rows, values, rcond=None)[0]
        noisy = float(np.std(residual)) > ROUNDING * peak
        correlation = Autocorrelation.of(residual, rows.shape[1]) if noisy and len(times) >= FEWEST_FOR_TEST else WHITE
        level = (
            float(np.sqrt(residual @ residual / counting_points(len(times), rows.shape[1], correlation)))
            if noisy
            else None
        )
        return cls(
            times=times,
            residual=residual,
            offset=float(values.mean()),
            level=level,
            values=values,
            hum=hum,
            bent=bent,
            fitted=rows.shape[1],
            correlation=correlation,
            rounding=_rounding_of_mean(values, level or 0.0, step),
        )

    @classmethod
    def _moving(cls, times: Array, values: Array, peak: float) -> BeforeContact:
        """Of a record that is not at rest: noise from its first half, if that is correlated.

        White noise shows between neighbouring points of the response, of which no motion is a part.
        """
        half = _first_half(times)
        variance, correlation = (
            _about_cubic(times[half], values[half]) if len(half) >= FEWEST_FOR_TEST else (0.0, WHITE)
        )
        level = float(np.sqrt(variance))
        noisy = bool(correlation.r) and level > ROUNDING * peak
        return cls(
            times=times[half],
            residual=values[half],
            offset=0.0,
            level=level if noisy else None,
            values=values[half],
            moves_until=float(times[-1]),
            fitted=CUBIC,
            correlation=correlation if noisy else WHITE,
        )

    @property
    def moves(self) -> bool:
        """Whether the record is not at rest."""
        return self.moves_until is not None

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the level: points less the terms fitted to them, fewer where they are correlated."""
        return counting_points(len(self.times), self.fitted, self.correlation) / self.correlation.of_variance

    @property
    def tests(self) -> bool:
        """Whether the points are enough to overrule a stated noise."""
        return self.level is not None and len(self.times) >= FEWEST_FOR_TEST

    @property
    def baseline(self) -> Baseline | None:
        """The reading at rest, None where it is zero or the points are too few."""
        if self.constant:
            return constant_baseline(self.times, float(self.values[0]), self.rounding)
        if not self.tests or self.level is None or self.moves or self.bent:
            return None
        worth = self.level**2 * self.correlation.of_mean
        freedom = density_freedom(len(self.times), self.correlation.of_mean) if self.correlation.r else np.inf
        return baseline_of(self.times, self.values, worth, self.hum, self.rounding, freedom)

    @property
    def constant(self) -> bool:
        """Whether every reading at rest is the same and not 0, as those of a coarse digitiser are."""
        if self.moves or len(self.values) < FEWEST_FOR_TEST:
            return False
        return not np.ptp(self.values) and bool(self.values[0])

    @property
    def beyond_noise(self) -> bool:
        """Whether the mean reading is not 0, and by more than the noise."""
        return self.constant or (self.tests and abs(self.offset) > (self.level or 0.0))


def _rounding_of_mean(values: Array, level: float, step: float) -> float:
    """What rounding leaves in the mean of readings (n,), SI; level: their scatter; step: of the digitiser, 0 without.

    step / sqrt(12) where they stand on one step or two, whatever they scatter by; of Gaussian noise of standard
    deviation sigma, which scatters by (sigma^2 + step^2 / 12)^0.5, exp(-2 pi^2 sigma^2 / step^2) of it (Widrow and
    Kollar, Quantization Noise, Cambridge 2008, ch. 4).
    """
    if not step:
        return 0.0
    own = max((level / step) ** 2 - 1.0 / ROUNDED**2, 0.0) if len(np.unique(values)) > 2 else 0.0
    return float(step / ROUNDED * np.exp(-2.0 * np.pi**2 * own))


def _runs_off(rows: Array, times: Array, residual: Array, slope: float, length: float, peak: float) -> bool:
    """Whether a clear drift would carry the record off by a third of its peak."""
    if len(rows) < FEWEST_FOR_TEST or abs(slope) * length <= RUNS_OFF * peak:
        return False
    noise, limit = _density(times, residual)
    return abs(slope) > limit * float(np.sqrt(noise * np.linalg.inv(rows.T @ rows)[1, 1]))


def _moves(times: Array, residual: Array, peak: float) -> bool:
    """Whether the record leaves, in its last quarter before contact, the straight line through its first half.

    By more than 2 % of the peak and than the noise of that half explains: then it is the response that begins.
    """
    if len(residual) < FEWEST_FOR_TEST:
        return False
    half, quarter = _first_half(times), np.array_split(np.arange(len(times)), 4)[-1]
    rows = terms(times, LINE, 0.0, float(times[half].mean()))
    inverse = np.linalg.inv(rows[half].T @ rows[half])
    found = inverse @ rows[half].T @ residual[half]
    ahead = rows[quarter].mean(axis=0)
    noise, limit = _density(times[half], residual[half])
    spread = np.sqrt(noise * (ahead @ inverse @ ahead + 1.0 / len(quarter)))
    apart = abs(float(residual[quarter].mean() - ahead @ found))
    return apart > max(MOVES * peak, limit * spread)


def _first_half(times: Array) -> NDArray[np.intp]:
    return np.array_split(np.arange(len(times)), 2)[0]


def _about_cubic(times: Array, values: Array) -> tuple[float, Autocorrelation]:
    """Variance and correlation of what a cubic leaves of readings (n,), SI: noise, where a motion begins smoothly."""
    rows = np.polynomial.legendre.legvander(2.0 * (times - times[0]) / np.ptp(times) - 1.0, CUBIC - 1)
    residual = values - rows @ np.linalg.lstsq(rows, values, rcond=None)[0]
    if not residual.any():
        return 0.0, WHITE
    correlation = Autocorrelation.of(residual, CUBIC)
    return float(residual @ residual) / counting_points(len(times), CUBIC, correlation), correlation


def _density(times: Array, values: Array) -> tuple[float, float]:
    """Variance that the mean of n readings has by their noise, times n, and standard deviations that are clear.

    8 of white noise, whose variance is then that of one reading. Of correlated noise, whose variance is in itself known
    by few degrees of freedom, those that one record in a thousand exceeds, at most as many.
    """
    variance, correlation = _about_cubic(times, values)
    if not correlation.r:
        return variance, SPIKE
    freedom = density_freedom(len(times), correlation.of_mean)
    return variance * correlation.of_mean, min(SPIKE, float(student.isf(FALSE_POSITIVES / 2.0, freedom)))


def _bent_by_mains(times: Array, values: Array, peak: float) -> float:
    """Frequency of the mains hum [Hz] that explains why a record before contact bends, 0 where none does.

    Behind it no more is left than the noise of the first half, by an F-test at 1 %. Of a response that begins more is,
    unless it has long begun: it then goes on by more than a third of the peak, or within less than a quarter period.
    """
    half, found = _first_half(times), best_hum(times, values)
    rows = terms(times, WITH_HUM, found, float(times.mean()))
    bend = rows @ np.linalg.lstsq(rows, values, rcond=None)[0]
    if np.ptp(bend) > RUNS_OFF * peak or float(np.ptp(times)) * found < LEAST_BENT:
        return 0.0
    residual = values - bend
    noise, correlation = _about_cubic(times[half], values[half])
    own = float(residual @ residual) / (len(times) - WITH_HUM)
    freedom = [max(n / correlation.of_variance, 1.0) for n in (len(times), len(half))]
    explained = own < noise * float(f_distribution.isf(UNEXPLAINED, *freedom))
    return found if explained and not _moves(times, residual, peak) else 0.0


def _spikes(times: Array, values: Array) -> NDArray[np.bool_]:
    """(n,) True at single points far off the straight line through the medians of the record's two halves.

    Far: more than 8 of the robust scatter about that line. A burst of neighbours is noise and stays.
    """
    if len(times) < FEWEST_FOR_TEST:
        return np.zeros(len(times), dtype=bool)
    early, late = np.array_split(np.arange(len(times)), 2)
    rise = np.median(values[late]) - np.median(values[early])
    apart = values - rise / (np.median(times[late]) - np.median(times[early])) * times
    apart -= np.median(apart)
    scatter = float(median_abs_deviation(apart, scale="normal"))  # pyright: ignore[reportArgumentType]
    far = (np.abs(apart) > SPIKE * scatter) & (scatter > 0.0)  # 0: most readings are one step of the digitiser
    beside = np.pad(far, 1)
    return far & ~beside[:-2] & ~beside[2:]
