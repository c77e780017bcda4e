"""Noise of a measured channel: standard deviation and correlation.

From the file, the case, the record before contact, or the scatter of neighbouring points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.high_frequency import ROUNDED, digitiser_step

REJECT = 0.05  # level of the test of a stated noise against the record before contact
DIGITISER = "digitiser's step"  # source of a noise that is mostly rounding
ASSUMED = 0.01  # of the channel's peak, where nothing is known of the noise
SURE = 0.005  # level of the test of a stated noise against the scatter of neighbouring points
LARGER = 1.2  # times what is stated: less is no contradiction
GROWS = 1.3  # times the scatter before contact, from which neighbouring points show more noise in the response
BEFORE, NEIGHBOURS = "record before contact", "scatter of neighbouring points"


@dataclass(frozen=True)
class Noise:
    """Noise of every point of a channel.

    sigma: (n,) standard deviation, SI; correlation_time: of exp(-dt/time) between points [s], 0 where white; source:
    where the level comes from; freedom: degrees of freedom behind it, inf where it was stated; known: False where it is
    a tolerance that nobody measured; before: level, number of points and their typical distance [s] of the record
    before contact, where there are enough.
    """

    sigma: Array
    correlation_time: float
    source: str
    freedom: float = np.inf
    known: bool = True
    before: tuple[float, int, float] | None = None

    @property
    def level(self) -> float:
        """Typical standard deviation, SI."""
        return rms(self.sigma)

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

    def level_like(self, own: Noise) -> float:
        """Root mean square of what is stated where another noise was taken: before contact, or of the points used."""
        noise = self.noise
        return self.at_rest if own.source == BEFORE or noise is None else noise.level

    @property
    def at_rest(self) -> float:
        """Root mean square of what is stated before contact, SI."""
        return rms(self.column[self.early]) if self.column is not None else self.case or 0.0


def channel_noise(
    name: str,
    unit: str,
    peak: float,
    before: BeforeContact,
    stated: Stated,
    white: tuple[float, float] | None = None,
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
    white : tuple, optional
        Scatter of neighbouring points in the response, SI, and its degrees of freedom; see `high_frequency`.

    Returns
    -------
    tuple
        The noise: the stated one unless the record contradicts it (chi-square: before contact 5 %; scatter of
        neighbouring points 0.5 %, and only where it is larger), else that of the record, else 1 % of the peak; and a
        sentence for each thing that the user should know.
    """
    noise, remarks = stated.noise, ()
    own = _of_the_record(before, stated, white)
    if noise is None and own is None:
        assumed = stated.uniform(ASSUMED * peak, f"tolerance of {100 * ASSUMED:g} % of the peak")
        return replace(assumed, known=False), ()
    if noise is None or (own is not None and _contradicted(noise, own, before, stated)):
        assert own is not None
        remarks = (_overruled(name, unit, stated.level_like(own), noise, own, before),) if noise is not None else ()
        noise = own
    elif own is not None and before.tests and not _agrees(stated.at_rest, before):
        remarks = (_kept(name, unit, stated.at_rest, noise, before),)
    if before.level is not None:
        typical = float(np.median(np.diff(before.times)))
        noise = replace(noise, before=(before.level, len(before.times), typical))
    if before.tests:
        noise, more = _correlated(name, noise, before)
        remarks += more
    return noise, remarks


def with_digitiser(name: str, unit: str, noise: Noise, times: Array, values: Array) -> tuple[Noise, tuple[str, ...]]:
    """The noise with the rounding of a coarse digitiser, where that is larger, and a sentence that says so.

    The error of rounding changes as slowly as the readings go from one step to the next.
    """
    rounding = digitiser_step(values) / ROUNDED
    if not rounding > LARGER * noise.level:
        return noise, ()
    dwell = float(np.ptp(times)) / max(int(np.count_nonzero(np.diff(values))), 1)
    correlation = dwell / 3.0 if dwell > 2.0 * float(np.median(np.diff(times))) else 0.0
    text = (
        f"{plain(name)}: the readings are multiples of {reading(rounding * ROUNDED, unit, 2)}, whose rounding "
        f"({reading(rounding, unit, 2)}) is more than the noise ({reading(noise.level, unit, 2)}, {noise.source}) "
        "and is taken for it; give the sensor a smaller range, or export more digits"
    )
    sigma = np.hypot(noise.sigma, rounding)
    time = max(noise.correlation_time, correlation)
    return replace(noise, sigma=sigma, correlation_time=time, source=DIGITISER), (text,)


def _of_the_record(before: BeforeContact, stated: Stated, white: tuple[float, float] | None) -> Noise | None:
    """The larger of the estimates before contact and from neighbouring points; None where neither exists."""
    if white is not None and white[0] > _most_by_chance(before, white[1]):
        return replace(stated.uniform(white[0], NEIGHBOURS), freedom=white[1])
    if before.level is None:
        return None
    return replace(stated.uniform(before.level, BEFORE), freedom=float(before.freedom))


def _most_by_chance(before: BeforeContact, freedom: float) -> float:
    """The largest scatter between neighbours that the noise before contact explains, SI; 0 with few points."""
    if before.level is None or not before.tests:
        return 0.0
    ratio = float(f_distribution.ppf(1.0 - SURE, freedom, before.freedom))
    return max(GROWS, np.sqrt(ratio)) * before.level


def _contradicted(noise: Noise, own: Noise, before: BeforeContact, stated: Stated) -> bool:
    """Whether the record's own noise takes the place of what is stated.

    A larger one always does. A smaller one only before contact, and only where that may overrule what is stated: who
    states more may know of errors that a sensor at rest does not show.
    """
    if own.source == BEFORE and before.tests and not _agrees(stated.at_rest, before):
        return stated.tested or own.level > stated.at_rest
    limit = float(chi2.ppf(1.0 - SURE, own.freedom)) / own.freedom
    return own.source == NEIGHBOURS and own.level > max(LARGER, np.sqrt(limit)) * noise.level


def _overruled(name: str, unit: str, stated: float, noise: Noise, own: Noise, before: BeforeContact) -> str:
    """That the record contradicts the stated noise."""
    level = reading(own.level, unit, 2)
    found = f"is less than the scatter of neighbouring points ({level})"
    if own.source == BEFORE:
        found = f"is not that of the record before contact ({level} over {len(before.times)} points)"
    return (
        f"{plain(name)}: the noise stated ({reading(stated, unit, 2)}, {noise.source}) {found}, which is used "
        f"instead; correct what is stated (sensors.{name.partition('@')[0]}.noise of its case, or birdstrike import "
        "--sigma)"
    )


def _kept(name: str, unit: str, stated: float, noise: Noise, before: BeforeContact) -> str:
    """That the record is quieter than is stated, and that this stands."""
    found = f"{reading(before.level or 0.0, unit, 2)} over {len(before.times)} points"
    return (
        f"{plain(name)}: the noise stated ({reading(stated, unit, 2)}, {noise.source}) is more than that of the "
        f"record before contact ({found}) and is kept: the intervals are wider than the record alone would make them; "
        "leave the noise out of the case to use the record's"
    )


def _agrees(stated: float, before: BeforeContact) -> bool:
    """Two-sided chi-square test of the variance before contact."""
    n = before.freedom
    lower = float(chi2.cdf(n * ((before.level or 0.0) / stated) ** 2, n))
    return 0.5 * REJECT < lower < 1.0 - 0.5 * REJECT


def _correlated(name: str, noise: Noise, before: BeforeContact) -> tuple[Noise, tuple[str, ...]]:
    """The noise with the correlation of the record before contact, where that is clear."""
    correlation = before.correlation
    correlation_time = correlation.time(float(np.median(np.diff(before.times))))
    if not correlation_time:
        return noise, ()
    text = (
        f"{plain(name)}: the noise before contact is correlated ({correlation.neighbours:.2f} between neighbours): "
        "averages gain less from their number of points, and intervals are wider than with white noise; look for hum "
        "or a filter in the measuring chain"
    )
    return replace(noise, correlation_time=correlation_time), (text,)
