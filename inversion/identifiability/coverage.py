"""Do the intervals hold what they promise? Many synthetic truths, each inverted; hits, errors and the bound.

Truths are drawn from the prior. A record is made by the emulator, with an error drawn from the emulator's own and noise
(fast, and exactly what the posterior assumes), or by the solver (few, and what counts).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import Box
from birdstrike.inversion.estimation.known_errors import stacked
from birdstrike.inversion.estimation.posterior import sample
from birdstrike.inversion.estimation.prior import identified
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.identifiability.information import bound
from birdstrike.inversion.observations.autocorrelation import correlated
from birdstrike.inversion.observations.observations import Observations


@dataclass(frozen=True)
class Coverage:
    """Over `truths` truths: name -> figure.

    identified: share of the truths at which the parameter was called identified; hits: share of the 95 % intervals that
    held the truth, where it was (None where it never was); hits_all: at all truths; error: root mean square of
    posterior mean minus truth, share of the range; bound, bound_with_emulator: van Trees, of the noise alone and with
    the emulator's error; made_by: who made the records.
    """

    made_by: str
    truths: int
    identified: dict[str, float]
    hits: dict[str, float | None]
    hits_all: dict[str, float]
    error: dict[str, float]
    bound: dict[str, float]
    bound_with_emulator: dict[str, float]
    unsettled: int


def coverage(
    calibrator: Calibrator,
    truths: int,
    seed: int = 0,
    forward: Forward | None = None,
    progress: Progress = silent,
) -> Coverage:
    """Invert records of truths drawn from the prior; forward: who makes them, the emulator by default.

    The instants and the noise are those of the calibrator's observations. The intervals are those that an inversion
    gives: where a best fit leaves more than noise, of the noise raised for that.
    """
    rng = np.random.default_rng(seed)
    z = draw_truths(calibrator, truths, rng)
    found: list[tuple[Array, Array, bool]] = []
    for i, place in enumerate(z):
        problem = _recorded(calibrator, place, rng, forward)
        _, modes, residual = problem.best_fits(i)
        drawn = sample(problem.raised(residual), modes, seed + i)
        found.append((drawn.z.mean(axis=0), drawn.interval(), drawn.converged))
        progress((i + 1) / truths)
    means, spans = np.stack([f[0] for f in found]), np.stack([f[1] for f in found])
    held = (spans[..., 0] <= z) & (z <= spans[..., 1])
    narrow = identified(spans[..., 1] - spans[..., 0], calibrator.coordinates.prior.width())
    return Coverage(
        made_by="emulator" if forward is None else "solver",
        truths=truths,
        identified=_named(calibrator, narrow.mean(axis=0)),
        hits={
            name: float(held[narrow[:, j], j].mean()) if narrow[:, j].any() else None
            for j, name in enumerate(calibrator.coordinates.names)
        },
        hits_all=_named(calibrator, held.mean(axis=0)),
        error=_named(calibrator, np.sqrt(((means - z) ** 2).mean(axis=0))),
        bound=_named(calibrator, bound(calibrator, z)),
        bound_with_emulator=_named(calibrator, bound(calibrator, z, emulator_error=True)),
        unsettled=sum(not f[2] for f in found),
    )


def draw_truths(calibrator: Calibrator, many: int, rng: np.random.Generator) -> Array:
    """(many, r) draws from the truncated normal prior, where runs stand behind the emulator."""
    prior, whole = calibrator.coordinates.prior, np.array([[0.0], [1.0]])
    found: list[Array] = []
    while len(found) < many:
        z = prior.draw(rng, whole, prior.mean.shape)
        if _box(calibrator, z) is not None:
            found.append(z)
    return np.stack(found)


def _recorded(calibrator: Calibrator, z: Array, rng: np.random.Generator, forward: Forward | None) -> Calibrator:
    """The same fitting problem with the record of another truth, its clock off by the time origin's sigma."""
    model, box = calibrator.model, _box(calibrator, z)
    assert box is not None
    theta = calibrator.coordinates.theta(z, box)
    t0 = float(np.clip(rng.normal(), *calibrator.offsets)) * calibrator.sigma
    if forward is None:
        factor = model.error_factor(theta, t0)
        values = model.curve(theta, t0) + factor @ rng.normal(size=factor.shape[1])
    else:
        names = calibrator.coordinates.names
        values = stacked(forward(dict(zip(names, map(float, theta), strict=True))), model.observations, t0)
    noise = model.noise_at(t0) if forward is None else model.observations.noise
    values = values + noise * correlated(rng.normal(size=len(values)), model.observations.correlation)
    return replace(calibrator, model=replace(model, observations=_with_values(model.observations, values)))


def _with_values(observations: Observations, values: Array) -> Observations:
    parts = observations.split(values)
    return replace(observations, channels=tuple(replace(c, values=parts[c.name]) for c in observations.channels))


def _box(calibrator: Calibrator, z: Array) -> Box | None:
    return next((b for b in calibrator.coordinates.boxes if ((z >= b.lows) & (z <= b.highs)).all()), None)


def _named(calibrator: Calibrator, values: Array) -> dict[str, float]:
    return {name: float(value) for name, value in zip(calibrator.coordinates.names, values, strict=True)}
