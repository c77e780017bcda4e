"""Where a fit says that more simulations should stand, draws about it, and errors of a simulation against a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import norm, qmc

from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.estimation.coordinates import Coordinates
from birdstrike.inversion.estimation.known_errors import stacked
from birdstrike.inversion.estimation.locate import Located
from birdstrike.inversion.estimation.refinement import WIDER
from birdstrike.inversion.estimation.shots import CampaignShot
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.models.ranking import shot_error
from birdstrike.inversion.models.results import ShotError
from birdstrike.inversion.observations.expected import FARTHEST_ORIGIN, Expected
from birdstrike.inversion.observations.observations import Observations, observed


def near_answer(located: Located, points: int, seed: int) -> Array:
    """Parameters (points, k) about the best fits: these first, then a spread over their covariance, enlarged."""
    calibration = located.calibration
    modes, coordinates = calibration.modes, calibration.coordinates
    r = len(modes[0].z)
    spread = norm.ppf(np.clip(qmc.Sobol(r, rng=seed).random_base2(points.bit_length()), 1e-3, 1.0 - 1e-3))
    found = []
    for i in range(points):
        mode = modes[i % len(modes)]
        z = mode.z if i < len(modes) else mode.z + WIDER * mode.root @ spread[i]
        found.append(coordinates.theta(np.clip(z, mode.box.lows, mode.box.highs), mode.box))
    return np.array(found)


def prior_draws(coordinates: Coordinates, draws: int, rng: np.random.Generator) -> Array:
    """(draws, k) parameters of the prior in use: what the case states, else normal over the ranges, their ends cut."""
    whole = np.array([[0.0], [1.0]])
    return coordinates.unlimited(coordinates.prior.draw(rng, whole, (draws, len(coordinates.prior.mean))))


def linearised_draws(located: Located, draws: int, rng: np.random.Generator) -> Array:
    """(draws, k) of the linearised posterior, its modes in turn, inside their boxes."""
    calibration = located.calibration
    rows = []
    for i in range(draws):
        mode = calibration.modes[i % len(calibration.modes)]
        z = rng.multivariate_normal(mode.z, mode.covariance[:-1, :-1], method="eigh")
        rows.append(calibration.coordinates.theta(np.clip(z, mode.box.lows, mode.box.highs), mode.box))
    return np.array(rows)


def yardstick(shot: CampaignShot) -> Observations:
    """The record's points with the noise by which the errors of all models are divided.

    By the record and the case alone, when nothing has moved yet and what scatters: the runs of each model have their
    own first motion and scatter.
    """
    expected = Expected.of_campaign(shot.dataset, shot.options.noise, shot.options.time_offset)
    return observed(shot.measured, replace(expected, rest_until=at_rest_until(shot), runs=None))


def at_rest_until(shot: CampaignShot) -> float:
    """Instant [s] of the record before which nothing moves, by the case: contact at the earliest possible clock."""
    assert shot.case is not None, "a comparison of models has its cases"
    return shot.case.first_contact - FARTHEST_ORIGIN * shot.options.time_offset


def time_blocks(shot: CampaignShot, blocks: int) -> Array:
    """(blocks + 1,) instants [s] that cut a record into equal times, the same for every model.

    A model's fitted time origin has no part in it: models would be compared by different points.
    """
    seen = yardstick(shot)
    first = min(float(c.times[0]) for c in seen.channels)
    return np.linspace(max(at_rest_until(shot), first), seen.last * (1.0 + 1e-9), blocks + 1)


def residuals_of(
    shot: CampaignShot, run: Histories, t0: float, window: tuple[float, float] | None = None
) -> dict[str, tuple[float, ...]]:
    """Channel -> (simulation less record) over noise, at the record's points (in a window of its clock)."""
    return _over_noise(yardstick(shot), run, t0, window)


def shot_errors(shot: CampaignShot, run: Histories, t0: float) -> ShotError:
    """Errors of a simulation against a shot's record."""
    observations = yardstick(shot)
    parts = observations.split(stacked(run, observations, t0))
    rmse = {c.name: rms(parts[c.name] - c.values) for c in observations.channels}
    return ShotError(rmse, shot_error(_over_noise(observations, run, t0)))


def _over_noise(
    observations: Observations, run: Histories, t0: float, window: tuple[float, float] | None = None
) -> dict[str, tuple[float, ...]]:
    parts = observations.split(stacked(run, observations, t0))
    found: dict[str, tuple[float, ...]] = {}
    for c in observations.channels:
        kept = np.ones(len(c.times), bool) if window is None else (c.times >= window[0]) & (c.times < window[1])
        if kept.any():
            found[c.name] = tuple(map(float, ((parts[c.name] - c.values) / c.noise)[kept]))
    return found
