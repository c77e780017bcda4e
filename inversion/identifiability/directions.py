"""Singular directions of the data: how far they narrow the prior along each direction of the parameters."""

from __future__ import annotations

import numpy as np

from birdstrike.data.formatting import plain
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.results.identifiability import Direction

PART = 0.3  # of a direction: parameters with less in it are not named


def directions(calibrator: Calibrator, mode: Mode) -> tuple[Direction, ...]:
    """All directions at a fit, the best determined first; the time origin and known errors are marginalised."""
    coordinates = calibrator.coordinates
    scaled = calibrator.information(mode) * np.outer(coordinates.prior.sd, coordinates.prior.sd)
    squares, vectors = np.linalg.eigh(scaled)
    names = _names(calibrator)
    return tuple(
        Direction(
            float(np.sqrt(max(square, 0.0))),
            {name: float(part) for name, part in zip(names, vector * _sign(vector), strict=True)},
            _words(names, vector * _sign(vector)),
        )
        for square, vector in zip(squares[::-1], vectors.T[::-1], strict=True)
    )


def _names(calibrator: Calibrator) -> tuple[str, ...]:
    """Dotted keys, or the numbers of the combinations that a deficient design carries."""
    coordinates = calibrator.coordinates
    if len(coordinates.basis) == len(coordinates.names):
        return coordinates.names
    return tuple(f"combination {i + 1}" for i in range(len(coordinates.basis)))


def _sign(vector: np.ndarray) -> float:
    return float(np.sign(vector[np.abs(vector).argmax()])) or 1.0


def _words(names: tuple[str, ...], vector: np.ndarray) -> str:
    """ "viscosity with less pressure cutoff" """
    order = [i for i in np.argsort(-np.abs(vector)) if abs(vector[i]) >= PART]
    text = plain(names[order[0]], names)
    for i in order[1:]:
        text += f" with {'more' if vector[i] > 0.0 else 'less'} {plain(names[i], names)}"
    return text
