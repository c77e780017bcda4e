"""A sensor's drift that the record before contact does not show: tried where the residual of the best fit is not noise.

A drift as slow as the response is taken in part for the parameters, and no widening of the noise covers that. Where the
residual of a measured record hangs together and nothing before contact rules a drift out, the fit is repeated with an
offset and a drift of the channel as nuisances, normal about zero; it is kept where its residual no longer hangs
together, or no more than noise behind a filter does. What a drift does not explain (a missing effect, an amplifier that
droops) is judged as it was without one, and a record whose residual is noise is not touched.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import chi2

from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.observations.autocorrelation import neighbour_correlation, uncorrelated
from birdstrike.inversion.observations.baseline import FALSE_POSITIVES
from birdstrike.inversion.observations.observations import Channel
from birdstrike.inversion.results.fit import ResidualCorrelation

SHARE = 0.05  # of the channel's peak by which a sensor drifts over the record (1 sigma), and by which it may be off
FEWEST = 3  # points of a channel: through fewer a straight line always passes

BestFits = tuple[Mode, tuple[Mode, ...], ResidualCorrelation]


def with_drift(calibrator: Calibrator, found: BestFits, seed: int) -> tuple[Calibrator, BestFits, tuple[str, ...]]:
    """The calibration with the drift of every channel whose residual asks for it, and a sentence that says so.

    Parameters
    ----------
    calibrator : Calibrator
        As it stands without a drift.
    found : tuple
        Its best fits.
    seed : int
        Of the search.

    Returns
    -------
    tuple
        Calibrator, best fits and warnings; the first two as they were where no drift is tried, or none is found.
    """
    channels, widened = calibrator.model.observations.channels, found[2].widened
    blocks = [drift_columns(c) if widened[c.name] > 1.0 else np.zeros((len(c.times), 0)) for c in channels]
    columns = np.asarray(block_diag(*blocks), dtype=np.float64)
    if not columns.shape[1]:
        return calibrator, found, ()
    drifting = calibrator.with_known(columns)
    again = drifting.best_fits(seed)
    if found[0].cost - again[0].cost < by_chance(columns.shape[1]) or again[2].correlated:
        return calibrator, found, ()
    drifts = calibrator.model.observations.split(_estimates(drifting, again[0], columns))
    tried = (c for c, block in zip(channels, blocks, strict=True) if block.shape[1])
    return drifting, again, tuple(_sentence(c, drifts[c.name]) for c in tried)


def by_chance(columns: int) -> float:
    """Gain in cost that so many nuisances in vain reach once in a thousand records: chi-square, a degree each."""
    return float(chi2.isf(FALSE_POSITIVES, columns))


def drift_columns(channel: Channel) -> Array:
    """(n, 2) SI: offset and drift of a channel, two columns for one standard deviation each of what is unknown in them.

    What the readings before the simulated record leave of both is normal: the wide prior and a straight line through
    these readings. (n, 0) where a drift was found in them and subtracted: it carries its own uncertainty; and of a
    channel with fewer than three points. Of an offset alone the readings may be too few to show the drift beside it.
    """
    record = channel.record
    if record is None or record.drift_subtracted or len(channel.times) < FEWEST:
        return np.zeros((len(channel.times), 0))
    size, early = SHARE * channel.peak, record.early
    rho = neighbour_correlation(early, channel.correlation_time)
    seen = uncorrelated(_line(channel, early).T * size / record.noise.level, rho).T
    values, vectors = np.linalg.eigh(np.eye(2) + seen.T @ seen)
    return size * _line(channel, channel.times) @ (vectors / np.sqrt(values))


def _line(channel: Channel, times: Array) -> Array:
    """(n, 2) of 1 and the share of the channel's record that has gone by at `times`."""
    first, last = channel.times[0], channel.times[-1]
    return np.stack([np.ones(len(times)), (times - first) / (last - first)], axis=1)


def _estimates(calibrator: Calibrator, mode: Mode, columns: Array) -> Array:
    """(n,) SI: offset and drift of all channels at a best fit."""
    return columns @ (calibrator.whitening(mode).apply(columns.T) @ mode.residual)


def _sentence(channel: Channel, drift: Array) -> str:
    """What was found of a channel, what it means and what to do; drift: (n,) SI, a straight line."""
    begin, rate = float(drift[0]), float((drift[-1] - drift[0]) / np.ptp(channel.times))
    found = f"about {reading(1e-3 * rate, channel.unit, 2)}/ms"
    if channel.record is not None and abs(begin) > channel.record.noise.level:
        found += f" from {reading(begin, channel.unit, 2)} at its start"
    return (
        f"{plain(channel.name)}: the residual is not noise unless the sensor drifts: {found} accounts for it and is "
        "carried by the fit; too few readings before contact, or none, show whether the sensor does, or whether the "
        "model lacks something: begin the next record some milliseconds before contact"
    )
