"""Prior predictive check: can the model of the campaign produce the measured curve?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.misfit import rms, rmse
from birdstrike.inversion.observations.autocorrelation import correlated
from birdstrike.inversion.observations.observations import Channel, Observations
from birdstrike.inversion.results.fit import PriorPredictive
from birdstrike.surrogate.inverse_network import sampled

REJECT = 1e-3
NOISE_MAY_BE_WRONG_BY = 1.5
ENVELOPE_SIGMAS = 3.0
POOR_Q2 = 0.9


def prior_predictive(dataset: Dataset, observations: Observations, residual: Array, t0: float) -> PriorPredictive:
    """Compare the measurement with the best fit of the emulator and with the runs themselves.

    Parameters
    ----------
    dataset : Dataset
        Runs of the campaign.
    observations : Observations
        Points of the measurement.
    residual : (n,) array
        Residual of the emulator's best fit, whitened (1 = noise and emulator error).
    t0 : float
        Time origin of the record on the model's clock [s].

    Returns
    -------
    PriorPredictive
        Whether the runs span the record, and which run is nearest to it.
    """
    runs = sampled(dataset, {c.name: c.times - t0 for c in observations.channels})
    values, noise = observations.values, observations.noise
    margin = ENVELOPE_SIGMAS * noise
    beyond = (values < runs.min(axis=0) - margin) | (values > runs.max(axis=0) + margin)
    nearest = int(np.argmin((((runs - values) / noise) ** 2).sum(axis=1)))
    model, measured = observations.split(runs[nearest]), observations.split(values)
    distance = {channel: rmse(model[channel], measured[channel]) for channel in measured}
    residuals = observations.split(residual)
    sizes = {c.name: _size(residuals[c.name], c) for c in observations.channels}
    rejected = any(_too_large(size, worth, REJECT / len(sizes)) for size, worth in sizes.values())
    fit = max(size for size, _ in sizes.values())
    inside = not rejected and float(beyond.mean()) <= 0.5
    return PriorPredictive(bool(inside), fit, float(beyond.mean()), int(dataset.runs[nearest]), distance)


def _size(white: Array, channel: Channel) -> tuple[float, float]:
    """Size of a channel's residual, whitened (n,), in units of its errors, and the number of points that it is worth.

    Where the noise is known to be correlated, of the errors as they are: whitened, those of a noise that is less
    correlated than it was before contact are too large.
    """
    return rms(correlated(white, channel.correlation)), len(white) / channel.tau


def _too_large(size: float, worth: float, level: float) -> bool:
    """Whether a residual of so many independent points is larger than chance and a badly known noise explain."""
    return bool(chi2.sf(worth * size**2, worth) < level and size > NOISE_MAY_BE_WRONG_BY)


def emulator_or_model(
    found: PriorPredictive, verified: float | None, q2: Mapping[str, float | None]
) -> PriorPredictive:
    """The check once the solver has run; verified: its RMS error at an answer in units of the noise, of a channel that
    is predicted poorly in units of noise and left-out error; q2: of the emulator.

    A solver's run within noise shows that the model can produce the record; a poor emulator shows nothing: the error
    that it admits makes every curve a good fit, so where the solver then differs from the record no fit identifies a
    parameter.
    """
    poor = [f"{plain(name)} (Q2 {value:.2f})" for name, value in q2.items() if value is not None and value < POOR_Q2]
    poorly = f"the emulator predicts {', '.join(poor)} poorly"
    if found.inside:
        if not poor or verified is None or verified <= NOISE_MAY_BE_WRONG_BY:
            return found
        text = (
            f"the residual of the solver's run at its answer is {verified:.1f} times noise and left-out error, and "
            f"{poorly}"
        )
        return replace(found, inside=False, coarse=text)
    if verified is not None and verified <= NOISE_MAY_BE_WRONG_BY:
        text = (
            f"the residual of the solver's run at an answer is only {verified:.1f} times the noise, so the model can "
            "produce it"
        )
        return replace(found, coarse=text)
    return replace(found, coarse=poorly) if poor else found


def prior_predictive_warning(found: PriorPredictive, observations: Observations, more_runs: str = "--refine N") -> str:
    """What a user must know about a measurement outside the prior predictive; more_runs: the option that adds some."""
    if found.coarse:
        return (
            f"the emulator is too coarse for this curve: the residual of its best fit is {found.fit:.1f} times "
            f"noise and its own error; {found.coarse}. No parameter is identified: add runs ({more_runs}), or leave "
            "that channel out (--channels)"
        )
    units = {c.name: c.unit for c in observations.channels}
    near = found.nearest_distance.items()
    where = ", ".join(f"{reading(value, units[name])} RMS in {plain(name)}" for name, value in near)
    share = found.outside_envelope
    points = (
        f"{share:.0%} of its points lie outside all runs"
        if share
        else "though each point by itself lies among the runs"
    )
    return (
        f"the model cannot produce this curve: nearest is run {found.nearest_run} at {where}; the residual of the "
        f"best fit is {found.fit:.1f} times noise and emulator error, {points}. No parameter is identified: something "
        "else than these parameters differs"
    )
