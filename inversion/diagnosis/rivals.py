"""How surely one or more shots tell rival effects apart: the expected chance of an ambiguous verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import norm

from data.histories import Array
from inversion.diagnosis.covariance import Whitener
from inversion.diagnosis.linear import Linear
from inversion.diagnosis.record import Record
from inversion.diagnosis.sensitivities import Sensitivities, sampled

SHARED = ("plate_thickness",)
"""Nuisances that shots have in common; every other is drawn anew in each."""
PRIOR = np.sqrt(12.0)  # of a parameter in units of its range: 1 / standard deviation


@dataclass(frozen=True)
class Shot:
    """One shot's derivatives on its n points, whitened by its own covariance.

    theta: (r, n) per range; nuisances: name -> (n,) for one sigma; effects: name -> (n,) per plausible size.
    """

    theta: Array
    nuisances: Mapping[str, Array]
    effects: Mapping[str, Array]

    @classmethod
    def of(cls, found: Sensitivities, record: Record, covariance: Array, nuisances: Mapping[str, float]) -> Shot:
        """On a record's points; covariance: (n, n) of all its channels; nuisances: effect -> sigma in its sizes."""
        whitener, here = Whitener.of(covariance), found.of([trace.name for trace in record.traces])
        theta = whitener.apply(sampled(record, here.time, here.theta))
        rows = whitener.apply(sampled(record, here.time, np.stack(list(here.effects.values()))))
        effects = dict(zip(here.effects, rows, strict=True))
        return cls(theta, {name: sigma * effects[name] for name, sigma in nuisances.items()}, effects)


def chance(shots: Sequence[Shot], sizes: Mapping[str, float], alpha: float) -> float:
    """Mean over ordered pairs (i, j) of the chance that rival j still stands at level alpha when i is true.

    sizes: rival -> magnitude b in plausible sizes, the same in every shot. Under j, what i leaves is P_j g_i b_i; the
    directed test along it is chi-square with one degree of freedom and noncentrality |P_j g_i b_i|^2. P_j takes out
    what the parameters (common to the shots, with their priors), the nuisances (N(0, 1) in sigmas) and g_j can imitate.
    The speed, mass, angle and trigger of another shot are drawn anew, because another bird is fired and measured:
    columns of its own. The plate's thickness is common: its sigma is that of the batch from which the plates come.
    """
    names, shared = tuple(sizes), _shared(shots)
    g = np.stack([np.concatenate([shot.effects[name] for shot in shots]) for name in names], axis=1)
    g = np.vstack([g, np.zeros((len(shared) - len(g), len(names)))])
    b, limit = np.abs(np.array([sizes[name] for name in names])), float(norm.isf(0.5 * alpha))
    stands = np.stack([_stands(shared, g, j, b, limit) for j in range(len(names))])
    others = ~np.eye(len(names), dtype=bool)
    return float(stands[others].mean())


def _stands(shared: Array, g: Array, j: int, b: Array, limit: float) -> Array:
    """(m,) chance that model j is not rejected when rival i of magnitude b_i is true."""
    names = tuple(map(str, range(g.shape[1])))
    model = Linear(names, np.zeros(len(g)), np.column_stack([shared, g[:, j]]), g, np.zeros(len(names), bool))
    far = b * model.sizes
    return norm.cdf(limit - far) - norm.cdf(-limit - far)


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
