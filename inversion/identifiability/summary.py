"""What `inversion.json` says of the posterior and of identifiability, and the draws as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from birdstrike.data.histories import Array
from birdstrike.data.storage.files import write_atomically
from birdstrike.inversion.estimation.answers.proposal import Calibration
from birdstrike.inversion.estimation.coordinates import Coordinates
from birdstrike.inversion.estimation.posterior import Posterior
from birdstrike.inversion.identifiability.directions import directions
from birdstrike.inversion.identifiability.profile import profiles
from birdstrike.inversion.identifiability.sobol import sobol_indices
from birdstrike.inversion.misfit import finite
from birdstrike.inversion.results.identifiability import (
    IdentifiabilityFigures,
    PosteriorFigures,
    ProfileFigures,
    SobolFigures,
)

DRAWS_FILE = "posterior.csv"
MOST_DRAWS = 2000
TIME = "time_offset"


def posterior_figures(posterior: Posterior, coordinates: Coordinates) -> PosteriorFigures:
    """Moments, intervals and the chains' agreement; a coordinate is a parameter."""
    names = (*coordinates.names, TIME) if posterior.t0.any() else coordinates.names
    rows = np.column_stack([posterior.theta, posterior.t0])[:, : len(names)]
    low, high = np.quantile(rows, [0.025, 0.975], axis=0)
    contraction = 1.0 - (posterior.z.std(axis=0) / coordinates.prior.truncated_sd()) ** 2
    best = np.append(posterior.mode.theta, posterior.mode.t0)[: len(names)]
    correlation = posterior.correlation()[: len(names), : len(names)]
    return PosteriorFigures(
        names=names,
        most_probable=_named(names, best),
        mean=_named(names, rows.mean(axis=0)),
        sd=_named(names, rows.std(axis=0)),
        interval_95={n: (float(a), float(b)) for n, a, b in zip(names, low, high, strict=True)},
        contraction=_named(coordinates.names, contraction),
        correlation=tuple(tuple(map(float, row)) for row in correlation),
        rhat={n: finite(v) for n, v in zip(coordinates.names, posterior.rhat, strict=True)},
        effective=_named(coordinates.names, posterior.ess),
        acceptance=posterior.acceptance,
        steps=posterior.steps,
        converged=posterior.converged,
        draws=DRAWS_FILE,
    )


def write_draws(path: Path, posterior: Posterior, names: tuple[str, ...]) -> None:
    """At most 2000 draws, evenly taken from the chains: a column for each dotted key and time_offset, SI."""
    rows = np.column_stack([posterior.theta, posterior.t0])
    kept = rows[np.linspace(0, len(rows) - 1, min(MOST_DRAWS, len(rows))).round().astype(int)]
    table = pd.DataFrame(kept, columns=[*names, TIME])
    write_atomically(path, table.to_csv(index=False, lineterminator="\n", float_format="%.9g"))


def identifiability_figures(calibration: Calibration, seed: int) -> IdentifiabilityFigures:
    """Directions, profiles and Sobol indices at the best fit; profiles need a coordinate for each parameter.

    Directions and profiles are of the noise that the intervals have, raised where the best fit leaves more than noise.
    """
    calibrator, emulator = calibration.raised, calibration.raised.model.emulator
    found = () if calibration.design.deficient else profiles(calibrator, calibration.modes)
    shown = {
        p.name: ProfileFigures(tuple(map(float, p.values)), tuple(map(float, p.rise)), p.at_bound, p.sentence)
        for p in found
    }
    sobol: dict[str, SobolFigures] = {}
    for channel in calibrator.model.observations.channels:
        indices = sobol_indices(emulator, channel.name, seed=seed)
        first, total = (_indices(emulator.names, table) for table in (indices.first, indices.total))
        times, sd = tuple(map(float, indices.times)), tuple(map(float, indices.sd))
        sobol[channel.name] = SobolFigures(times, sd, first, total)
    return IdentifiabilityFigures(directions(calibrator, calibration.modes[0]), shown, sobol)


def _indices(names: tuple[str, ...], table: Array) -> dict[str, tuple[float | None, ...]]:
    return {name: tuple(finite(value) for value in row) for name, row in zip(names, table, strict=True)}


def _named(names: tuple[str, ...], values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=True)}
