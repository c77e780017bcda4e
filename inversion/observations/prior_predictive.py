"""Is the measured curve one that the campaign's model can produce?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.formatting import plain, quantity
from birdstrike.inversion.misfit import rmse
from birdstrike.inversion.observations.observations import Observations
from birdstrike.surrogate.inverse_network import sampled

REJECT = 1e-3
NOISE_MAY_BE_WRONG_BY = 1.5
ENVELOPE_SIGMAS = 3.0
POOR_Q2 = 0.9


@dataclass(frozen=True)
class Cloud:
    """Where the measurement stands relative to the runs, at the estimated time origin.

    inside: False when the best fit of any channel misses by more than noise and emulator error allow (chi-square at
    0.1 % over all channels, and by more than 1.5 of their standard deviations, since a stated noise is rarely better
    known), when most points lie outside the runs' envelope, or when the emulator has been found too coarse;
    fit: root mean square of the best fit's whitened residual (1 = noise and the emulator's error) in its worst channel;
    outside_envelope: share of points beyond the envelope by more than 3 standard deviations of the noise;
    coarse: why it may be the emulator that cannot follow the record, not the model; nearest_run: run number;
    nearest_distance: channel -> its RMS distance from the measurement, SI.
    """

    inside: bool
    fit: float
    outside_envelope: float
    nearest_run: int
    nearest_distance: dict[str, float]
    coarse: str = ""


def cloud(dataset: Dataset, observations: Observations, best: Mode) -> Cloud:
    """Judge the measurement against the best fit of the emulator and against the runs themselves."""
    runs = sampled(dataset, {c.name: c.times - best.t0 for c in observations.channels})
    values, noise = observations.values, observations.noise
    margin = ENVELOPE_SIGMAS * noise
    beyond = (values < runs.min(axis=0) - margin) | (values > runs.max(axis=0) + margin)
    nearest = int(np.argmin((((runs - values) / noise) ** 2).sum(axis=1)))
    model, measured = observations.split(runs[nearest]), observations.split(values)
    distance = {channel: rmse(model[channel], measured[channel]) for channel in measured}
    residuals = observations.split(best.residual)
    missed = any(_misses(residual, REJECT / len(residuals)) for residual in residuals.values())
    fit = max(_rms(residual) for residual in residuals.values())
    inside = not missed and float(beyond.mean()) <= 0.5
    return Cloud(bool(inside), fit, float(beyond.mean()), int(dataset.runs[nearest]), distance)


def _misses(residual: Array, level: float) -> bool:
    """Whether a channel's whitened residual (n,) is larger than chance and a badly known noise explain."""
    return bool(chi2.sf(residual @ residual, len(residual)) < level and _rms(residual) > NOISE_MAY_BE_WRONG_BY)


def _rms(residual: Array) -> float:
    return float(np.sqrt(np.mean(residual**2)))


def whose_fault(found: Cloud, verified: float | None, q2: Mapping[str, float | None]) -> Cloud:
    """The judgement once the solver has run; verified: its whitened RMS error at an answer, q2: of the emulator.

    A solver's run within noise shows that the model can produce the record; a poor emulator shows nothing: the error
    that it admits makes every curve a good fit, so where the solver then misses the record no fit tells a parameter.
    """
    poor = [f"{plain(name)} (Q2 {value:.2f})" for name, value in q2.items() if value is not None and value < POOR_Q2]
    poorly = f"the emulator predicts {', '.join(poor)} poorly"
    if found.inside:
        if not poor or verified is None or verified <= NOISE_MAY_BE_WRONG_BY:
            return found
        text = f"the solver's run at its answer misses by {verified:.1f} times the noise, and {poorly}"
        return replace(found, inside=False, coarse=text)
    if verified is not None and verified <= NOISE_MAY_BE_WRONG_BY:
        text = (
            f"the solver's run at an answer misses by {verified:.1f} times the noise only, so the model can produce it"
        )
        return replace(found, coarse=text)
    return replace(found, coarse=poorly) if poor else found


def warning(found: Cloud, observations: Observations) -> str:
    """What a user must know about a measurement outside the cloud."""
    if found.coarse:
        return (
            f"the emulator is too coarse for this curve: its best fit misses by {found.fit:.1f} times noise and its "
            f"own error; {found.coarse}. No parameter is identified: add runs (--refine N), or leave that channel out"
        )
    units = {c.name: c.unit for c in observations.channels}
    near = found.nearest_distance.items()
    where = ", ".join(f"{quantity(value, units[name])} RMS in {plain(name)}" for name, value in near)
    share = found.outside_envelope
    points = (
        f"{share:.0%} of its points lie outside all runs"
        if share
        else "though each point by itself lies among the runs"
    )
    return (
        f"the model cannot produce this curve: nearest is run {found.nearest_run} at {where}; the best fit misses by "
        f"{found.fit:.1f} times noise and emulator error, {points}. No parameter is identified: something else than "
        "these parameters differs"
    )
