"""The noise of one channel: from the file, the case, the record before contact, or a stated tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from birdstrike.data.histories import Array
from birdstrike.inversion.formatting import plain, quantity

FEWEST_BEFORE = 20  # points before contact that can tell a noise level
REJECT = 0.05  # level at which a stated noise is given up for the one before contact
LINE = 2  # degrees of freedom that the line through the record before contact takes
ROUNDING = 1e-12  # of the largest value: less is no noise but the line's own rounding
CORRELATED = 2.6  # lag-1 correlation times sqrt(n): beyond it the noise is not white (0.5 % of white records)


@dataclass(frozen=True)
class Noise:
    """sigma: (n,) SI of every point; correlation: exp(-dt/time) between neighbours [s], 0: white.

    source: where the level comes from; freedom: degrees of freedom behind it, inf where it was stated; known: False
    where it is a tolerance that nobody measured; inferred: True where not even that was stated, so that the fit itself
    must tell the level; before: level and count of the record before contact, if any.
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


def noise_of(
    name: str,
    unit: str,
    times: Array,
    values: Array,
    sigma: Array | None,
    stated: float | None,
    quiet: float,
    tolerance: float | None,
) -> tuple[Noise, list[str]]:
    """Noise of every point of a channel, and what the user should know of it."""
    early = times < quiet
    enough = early.sum() >= FEWEST_BEFORE
    before = _without_line(times[early], values[early]) if enough else values[early]
    told = enough and float(np.std(before)) > ROUNDING * float(np.abs(values).max())
    level = float(np.sqrt(before @ before / (len(before) - LINE))) if told else None
    if sigma is None and not stated and level is None:
        share = 0.01 if tolerance is None else tolerance
        size = np.full(len(values), share * float(np.abs(values).max()))
        source = f"tolerance of {100 * share:g} % of the peak"
        return Noise(size, 0.0, source, known=False, inferred=tolerance is None), []
    noise, said = _stated(name, unit, len(values), sigma, stated, before, level)
    if told:
        noise = replace(noise, before=(level or 0.0, len(before)))
        noise, more = _correlated(name, noise, times[early], before)
        said += more
    return noise, said


def _without_line(times: Array, values: Array) -> Array:
    """The record before contact less its straight line: offset and drift of a sensor are no noise."""
    line = np.stack([np.ones(len(times)), times / np.ptp(times)], axis=1)
    return values - line @ np.linalg.lstsq(line, values, rcond=None)[0]


def _stated(
    name: str, unit: str, count: int, sigma: Array | None, stated: float | None, before: Array, level: float | None
) -> tuple[Noise, list[str]]:
    """The stated level unless the record before contact rejects it."""
    measured = Noise(np.full(count, level), 0.0, "record before contact", float(len(before) - LINE)) if level else None
    if sigma is not None:
        noise = Noise(sigma, 0.0, "sigma column")
    elif stated:
        noise = Noise(np.full(count, stated), 0.0, "case")
    else:
        assert measured is not None
        return measured, []
    if measured is None or _agrees(noise.level, before, level or 0.0):
        return noise, []
    text = (
        f"{plain(name)}: the noise stated ({quantity(noise.level, unit, 2)}, {noise.source}) is not that of the record "
        f"before contact ({quantity(level or 0.0, unit, 2)} over {len(before)} points), which is used instead"
    )
    return measured, [text]


def _agrees(stated: float, before: Array, level: float) -> bool:
    """Two-sided chi-square test of the variance before contact."""
    n = len(before) - LINE
    lower = float(chi2.cdf(n * (level / stated) ** 2, n))
    return 0.5 * REJECT < lower < 1.0 - 0.5 * REJECT


def _correlated(name: str, noise: Noise, times: Array, before: Array) -> tuple[Noise, list[str]]:
    """The noise with the correlation of the record before contact, where that is clear."""
    rho = float(before[1:] @ before[:-1] / (before @ before))
    if rho * np.sqrt(len(before)) < CORRELATED:
        return noise, []
    correlation_time = -float(np.median(np.diff(times))) / np.log(min(rho, 0.99))
    text = f"{plain(name)}: the noise before contact is correlated ({rho:.2f} between neighbours) and taken so"
    return replace(noise, correlation_time=correlation_time), [text]
