"""How surely one or more shots tell rival effects apart: the expected chance of an ambiguous verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.linear import RANK, Linear
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.sensitivities import Sensitivities, sampled

SHARED = ("plate_thickness",)
"""Nuisances that shots have in common; every other is drawn anew in each."""
PRIOR = np.sqrt(12.0)  # of a parameter in units of its range: 1 / standard deviation


@dataclass(frozen=True)
class Shot:
    """One shot's derivatives on its n points, whitened by its own covariance.

    theta: (r, n) per range; nuisances: name -> (n,) for one sigma; effects: name -> (n,) per plausible size; doubts:
    name -> (n,) an error such as each of these may have.
    """

    theta: Array
    nuisances: Mapping[str, Array]
    effects: Mapping[str, Array]
    doubts: Mapping[str, Array]

    @classmethod
    def of(cls, found: Sensitivities, record: Record, covariance: Array, nuisances: Mapping[str, float]) -> Shot:
        """On a record's points; covariance: (n, n) of all its channels; nuisances: effect -> sigma in its sizes."""
        whitener, here = Whitener.of(covariance), found.of([trace.name for trace in record.traces])

        def rows(curves: Array) -> Array:
            return whitener.apply(sampled(record, here.time, curves))

        effects, doubts = (
            dict(zip(by, rows(np.stack(list(by.values()))), strict=True)) for by in (here.effects, here.doubts)
        )
        return cls(
            rows(here.theta), {name: sigma * effects[name] for name, sigma in nuisances.items()}, effects, doubts
        )


def chance(shots: Sequence[Shot], sizes: Mapping[str, float], alpha: float) -> float:
    """Mean over ordered pairs (i, j) of the chance that rival j still stands at level alpha when i is true.

    sizes: rival -> magnitude b in plausible sizes, the same in every shot. Under j, what i leaves is P_j g_i b_i; the
    directed test along it is chi-square with one degree of freedom and noncentrality |P_j g_i b_i|^2. P_j takes out
    what the parameters (common to the shots, with their priors), the nuisances (N(0, 1) in sigmas) and g_j can imitate.
    The speed, mass, angle and trigger of another shot are drawn anew, because another bird is fired and measured:
    columns of its own. The plate's thickness is common: its sigma is that of the batch from which the plates come.
    What the strikes' own scatter adds to |P_j g_i b_i|^2 is taken off it, or rough channels would seem to tell most.
    """
    names, shared = tuple(sizes), _shared(shots)
    g = _stacked([shot.effects for shot in shots], names, len(shared))
    doubts = _stacked([shot.doubts for shot in shots], names, len(shared))
    b, limit = np.array([sizes[name] for name in names]), float(norm.isf(0.5 * alpha))
    far = np.stack([_distances(shared, g, doubts, b, j) for j in range(len(names))])
    stands = norm.cdf(limit - far) - norm.cdf(-limit - far)
    return float(stands[~np.eye(len(names), dtype=bool)].mean())


def _stacked(shots: Sequence[Mapping[str, Array]], names: Sequence[str], rows: int) -> Array:
    """(rows, m) columns by name over all shots, zero in the rows of the priors."""
    data = np.stack([np.concatenate([shot[name] for shot in shots]) for name in names], axis=1)
    return np.pad(data, ((0, rows - len(data)), (0, 0)))


def _distances(shared: Array, g: Array, doubts: Array, b: Array, j: int) -> Array:
    """(m,) |P_j g_i b_i|, less what scatter in g_i, and in g_j where it imitates that, is expected to put there."""
    flat = np.zeros(len(g))
    design = np.column_stack([shared, g[:, j]])
    model = Linear(tuple(map(str, range(len(b)))), flat, design, g, np.zeros(len(b), bool))
    imitating = np.linalg.lstsq(design, g * b, rcond=RANK)[0][-1]
    noise = (model.project(doubts) ** 2).sum(axis=0)
    return np.sqrt(np.maximum((b * model.sizes) ** 2 - b**2 * noise - imitating**2 * noise[j], 0.0))


def _shared(shots: Sequence[Shot]) -> Array:
    """(rows, q) design of what every model carries: parameters, nuisances; below the data, the rows of their priors."""
    theta = np.hstack([shot.theta for shot in shots]).T
    nuisances = [_columns(name, [shot.nuisances[name] for shot in shots]) for name in shots[0].nuisances]
    data = np.hstack([theta, *nuisances])
    prior = np.ones(data.shape[1])
    prior[: theta.shape[1]] = PRIOR
    return np.vstack([data, np.diag(prior)])


def _columns(name: str, parts: Sequence[Array]) -> Array:
    """One column over all shots, or one for each."""
    if name in SHARED:
        return np.concatenate(parts)[:, None]
    return np.asarray(block_diag(*(part[:, None] for part in parts)))
