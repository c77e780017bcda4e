"""The coordinates in which an answer is sought: the parameters, or the combinations that a design carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.solver.case.settings import Prior
from birdstrike.surrogate.features import Region


@dataclass(frozen=True)
class Box:
    """Where an answer is sought: z in lows..highs (r,), and the parameters in theta_lows..theta_highs (k,) SI.

    flat: (r,) True where the parameter is off, so that no value changes a curve.
    """

    lows: Array
    highs: Array
    flat: NDArray[np.bool_]
    theta_lows: Array
    theta_highs: Array


@dataclass(frozen=True)
class Coordinates:
    """theta = base + z basis, with z (r,) about 0..1 in boxes, and a normal prior on z truncated to the boxes.

    names: (k) dotted case keys; base: (k,) SI; basis: (r, k) SI; boxes: where z may be; prior: of z (r,); space: where
    base and basis are fractions of its ranges, each in its scale.
    """

    names: tuple[str, ...]
    base: Array
    basis: Array
    boxes: tuple[Box, ...]
    prior: NormalPrior
    space: ParameterSpace | None = None

    def theta(self, z: Array, box: Box) -> Array:
        """Parameters (..., k) SI at z (..., r) of a box, to the last bit inside it: rounding may not cross a limit."""
        return np.clip(self.unlimited(z), box.theta_lows, box.theta_highs)

    def unlimited(self, z: Array) -> Array:
        """Parameters (..., k) SI at z (..., r), of a box or of none."""
        place = self.base + z @ self.basis
        return place if self.space is None else self.space.to_physical(place)

    def nearest(self, theta: Array) -> Array:
        """(r,) coordinates nearest to parameters (k,) SI."""
        place = theta if self.space is None else self.space.to_unit(theta)
        return np.asarray(np.linalg.lstsq(self.basis.T, place - self.base, rcond=None)[0], dtype=np.float64)

    def values(self, i: int, z: Array) -> Array:
        """(n,) SI values of parameter i at its coordinate z (n,), where each parameter has one."""
        place = np.zeros((len(z), len(self.basis)))
        place[:, i] = z
        return np.asarray(self.unlimited(place)[:, i])

    def changes(self) -> Array:
        """(r, k) SI, what each coordinate does to the parameters from 0 to 1, the others at 0."""
        return self.unlimited(np.eye(len(self.basis))) - self.unlimited(np.zeros(len(self.basis)))


def parameter_coordinates(
    dataset: Dataset, regions: tuple[Region, ...], stated: Mapping[str, Prior] | None = None
) -> Coordinates:
    """One coordinate a parameter, 0..1 over its range in the scale of that; stated: priors of a case by dotted key.

    The prior is normal in that scale, so that a parameter that spans decades is treated as its logarithm, as it is in a
    diagnosis and in a calibration of models.
    """
    space = ParameterSpace.of_dataset(dataset)
    boxes = tuple(Box(space.to_unit(r.lows), space.to_unit(r.highs), r.flat, r.lows, r.highs) for r in regions)
    prior, k = NormalPrior.of(stated or {}, space), len(dataset.names)
    if space.logarithmic.any():
        return Coordinates(dataset.names, np.zeros(k), np.eye(k), boxes, prior, space)
    return Coordinates(dataset.names, dataset.lows, np.diag(dataset.highs - dataset.lows), boxes, prior)


def carried_coordinates(dataset: Dataset, rank: int, space: ParameterSpace) -> Coordinates:
    """The `rank` combinations that a rank-deficient design varies, each 0..1 over the smooth runs.

    The singular directions of the centred design in fractions of the space's ranges; every z in the box is a blend of
    runs, so no range is left.
    """
    unit = space.to_unit(dataset.parameters[dataset.smooth])
    centre = unit.mean(axis=0)
    directions = np.linalg.svd(unit - centre, full_matrices=False)[2][:rank]
    directions *= np.sign(directions[np.arange(rank), np.abs(directions).argmax(axis=1)])[:, None]
    place = (unit - centre) @ directions.T
    low, high = place.min(axis=0), place.max(axis=0)
    box = Box(np.zeros(rank), np.ones(rank), np.zeros(rank, dtype=bool), dataset.lows, dataset.highs)
    base, basis = centre + low @ directions, (high - low)[:, None] * directions
    return Coordinates(dataset.names, base, basis, (box,), NormalPrior.of_ranges(rank), space)
