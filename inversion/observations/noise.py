"""Noise of a measured channel: standard deviation and correlation, from the file, the case, or before contact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, median_abs_deviation

from birdstrike.data.histories import Array
from birdstrike.inversion.formatting import plain, quantity

FEWEST_FOR_LEVEL = 8  # points before contact from which a noise level is taken where none is stated
FEWEST_FOR_TEST = 20  # points before contact that can overrule a stated level, or show a correlation
REJECT = 0.05  # level of the test of a stated noise against the record before contact
LINE = 2  # degrees of freedom that the straight line before contact takes
SPIKE = 8.0  # robust standard deviations about the straight line before contact
ROUNDING = 1e-12  # of the largest value: less is the rounding of the line, not noise
CORRELATED = 2.6  # lag-1 correlation times sqrt(n): beyond it the noise is not white (0.5 % of white records)
ASSUMED = 0.01  # of the channel's peak, where nothing is known of the noise


@dataclass(frozen=True)
class Noise:
    """Noise of every point of a channel.

    sigma: (n,) standard deviation, SI; correlation_time: of exp(-dt/time) between points [s], 0 where white; source:
    where the level comes from; freedom: degrees of freedom behind it, inf where it was stated; known: False where it is
    a tolerance that nobody measured; inferred: True where not even that was stated, so that the fit itself must give
    the level; before: level and number of points of the record before contact, where there are enough.
    """

    sigma: Array
    correlation_time: float
    source: str
    freedom: float = np.inf
    known: bool = True
    inferred: bool = False
    before: tuple[float, int] | None = None

    @property
    def level(self) -> float:
        """Typical standard deviation, SI."""
        return float(np.sqrt(np.mean(self.sigma**2)))

    def at(self, kept: np.ndarray) -> Noise:
        """Of some of the points."""
        return replace(self, sigma=self.sigma[kept])

    def covariance(self, times: Array, block: int = 1) -> Array:
        """(n, n) of the means over `block` neighbours, from the noise at raw instants `times` (n block,): B C B^T.

        White noise shrinks by averaging; where it is correlated, exponentially in the distance of instants, less.
        """
        sigma, t = self.sigma.reshape(-1, block), times.reshape(-1, block)
        if not self.correlation_time:
            return np.diag((sigma**2).mean(axis=1) / block)
        tau = self.correlation_time
        # Of exp(-(t_j - t_i)/tau) between two blocks each has a factor of its own, to its end and from its start.
        to_end = (sigma * np.exp((t - t[:, -1:]) / tau)).mean(axis=1)
        from_start = (sigma * np.exp((t[:, :1] - t) / tau)).mean(axis=1)
        later = np.triu(np.outer(to_end, from_start) * np.exp(-np.maximum(t[:, 0] - t[:, -1:], 0.0) / tau), 1)
        inside = np.exp(-np.abs(t[:, :, None] - t[:, None]) / tau)
        return later + later.T + np.diag(np.einsum("ni,nij,nj->n", sigma, inside, sigma) / block**2)


@dataclass(frozen=True)
class BeforeContact:
    """The record while the plate is at rest: times [s], residual about its straight line, offset and level, SI.

    offset: mean reading, which should be 0; level: standard deviation about the line, None where the points are too few
    or all on the line.
    """

    times: Array
    residual: Array
    offset: float
    level: float | None

    @classmethod
    def of(cls, times: Array, values: Array, peak: float) -> BeforeContact:
        """From the points before contact; offset and drift of a sensor are no noise, nor are single spikes."""
        if len(times) < FEWEST_FOR_LEVEL:
            return cls(times, values, 0.0, None)
        spiked = _spikes(times, values)
        times, values = times[~spiked], values[~spiked]
        line = np.stack([np.ones(len(times)), times / np.ptp(times)], axis=1)
        residual = values - line @ np.linalg.lstsq(line, values, rcond=None)[0]
        noisy = float(np.std(residual)) > ROUNDING * peak
        level = float(np.sqrt(residual @ residual / (len(residual) - LINE))) if noisy else None
        return cls(times, residual, float(values.mean()), level)

    @property
    def tests(self) -> bool:
        """Whether the points are enough to overrule a stated noise."""
        return self.level is not None and len(self.times) >= FEWEST_FOR_TEST


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


@dataclass(frozen=True)
class Stated:
    """The noise that is stated of a channel.

    case: standard deviation by the case, SI; column: (raw,) by the file; used: indices of the points that are used;
    early: (raw,) True before contact; tested: whether the record before contact may overrule it.
    """

    case: float | None
    column: Array | None
    used: NDArray[np.intp]
    early: NDArray[np.bool_]
    tested: bool = True

    @property
    def noise(self) -> Noise | None:
        """Of the points that are used: the file's, else the case's."""
        if self.column is not None:
            return Noise(self.column[self.used], 0.0, "sigma column")
        return self.uniform(self.case, "case") if self.case else None

    def uniform(self, sigma: float, source: str) -> Noise:
        """The same standard deviation at every point."""
        return Noise(np.full(len(self.used), sigma), 0.0, source)

    @property
    def at_rest(self) -> float:
        """Root mean square of what is stated before contact, SI."""
        return float(np.sqrt(np.mean(self.column[self.early] ** 2))) if self.column is not None else self.case or 0.0


def channel_noise(
    name: str, unit: str, peak: float, before: BeforeContact, stated: Stated, tolerance: float | None
) -> tuple[Noise, tuple[str, ...]]:
    """Noise of a channel's points, and what the user should know of it.

    Parameters
    ----------
    name, unit : str
        Of the channel.
    peak : float
        Largest magnitude of the channel, SI.
    before : BeforeContact
        The record while the plate is at rest.
    stated : Stated
        By the file or the case.
    tolerance : float or None
        Share of the peak to take where nothing is known; None: 1 %, and the fit must give the level.

    Returns
    -------
    tuple
        The noise: the stated one unless the record before contact rejects it (chi-square, 5 %), else that of the
        record before contact, else the tolerance; and a sentence for each thing that the user should know.
    """
    noise, remarks = stated.noise, ()
    if noise is None and before.level is None:
        share = ASSUMED if tolerance is None else tolerance
        assumed = stated.uniform(share * peak, f"tolerance of {100 * share:g} % of the peak")
        return replace(assumed, known=False, inferred=tolerance is None), ()
    if noise is None or (stated.tested and before.tests and not _agrees(stated.at_rest, before)):
        measured = replace(
            stated.uniform(before.level or 0.0, "record before contact"), freedom=float(len(before.times) - LINE)
        )
        remarks = (_overruled(name, unit, stated.at_rest, noise, before),) if noise is not None else ()
        noise = measured
    if before.level is not None:
        noise = replace(noise, before=(before.level, len(before.times)))
    if before.tests:
        noise, more = _correlated(name, noise, before)
        remarks += more
    return noise, remarks


def _overruled(name: str, unit: str, stated: float, noise: Noise, before: BeforeContact) -> str:
    """That the record before contact rejects the stated noise."""
    return (
        f"{plain(name)}: the noise stated ({quantity(stated, unit, 2)}, {noise.source}) is not that of the record "
        f"before contact ({quantity(before.level or 0.0, unit, 2)} over {len(before.times)} points), which is used "
        "instead"
    )


def _agrees(stated: float, before: BeforeContact) -> bool:
    """Two-sided chi-square test of the variance before contact."""
    n = len(before.times) - LINE
    lower = float(chi2.cdf(n * ((before.level or 0.0) / stated) ** 2, n))
    return 0.5 * REJECT < lower < 1.0 - 0.5 * REJECT


def _correlated(name: str, noise: Noise, before: BeforeContact) -> tuple[Noise, tuple[str, ...]]:
    """The noise with the correlation of the record before contact, where that is clear."""
    residual = before.residual
    rho = float(residual[1:] @ residual[:-1] / (residual @ residual))
    if rho * np.sqrt(len(residual)) < CORRELATED:
        return noise, ()
    correlation_time = -float(np.median(np.diff(before.times))) / np.log(min(rho, 0.99))
    text = (
        f"{plain(name)}: the noise before contact is correlated ({rho:.2f} between neighbours): averages gain less "
        "from their number of points, and intervals are wider than with white noise; look for hum or a filter in the "
        "measuring chain"
    )
    return replace(noise, correlation_time=correlation_time), (text,)
