"""Objective rating of a simulated curve against a record after ISO/TS 18571:2014: corridor, phase, magnitude, slope.

0.4 corridor + 0.2 phase + 0.2 magnitude + 0.2 slope, each 0..1; above 0.94 the standard says excellent, above 0.80
good, above 0.58 fair, else poor. The standard is written for signals of 10 kHz; none of the four depends on the
sampling interval itself, only on the number of samples, so that a record of milliseconds is rated on SAMPLES points.
Checked against objective_rating_metrics 1.3 (VSI TU Graz); that package brings nine others along and is not used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

SAMPLES = 401
CORRIDORS, CORRIDOR_POWER = (0.05, 0.5), 2  # of the record's largest magnitude: inside the first 1, outside the last 0
FARTHEST_SHIFT = 0.2  # of the interval
WORST_MAGNITUDE, WARPING = 0.5, 0.1
WORST_SLOPE, SMOOTHING = 2.0, 9  # samples
WEIGHTS = (0.4, 0.2, 0.2, 0.2)
GRADES = ((0.94, "excellent"), (0.80, "good"), (0.58, "fair"))


@dataclass(frozen=True)
class Rating:
    """The four scores and their weighted sum, 0..1."""

    corridor: float
    phase: float
    magnitude: float
    slope: float

    @property
    def overall(self) -> float:
        """The standard's score."""
        scores = (self.corridor, self.phase, self.magnitude, self.slope)
        return float(np.dot(WEIGHTS, scores))

    @property
    def grade(self) -> str:
        """The standard's word for the score."""
        return next((word for limit, word in GRADES if self.overall > limit), "poor")


def rate(record: Array, simulated: Array) -> Rating:
    """Rating of `simulated` (n,) against `record` (n,) at the same equally spaced instants, n >= 20, no gaps."""
    shift, left, right = aligned(record, simulated)
    farthest = FARTHEST_SHIFT * len(record)
    return Rating(
        corridor_score(record, simulated),
        max(0.0, (farthest - shift) / farthest),
        magnitude_score(left, right),
        slope_score(left, right),
    )


def corridor_score(record: Array, simulated: Array) -> float:
    """Mean over the samples of 1 within the inner corridor, falling with the square to 0 at the outer one."""
    inner, outer = (share * float(np.abs(record).max()) for share in CORRIDORS)
    distance = np.abs(record - simulated)
    return float(np.mean(np.clip((outer - distance) / (outer - inner), 0.0, 1.0) ** CORRIDOR_POWER))


def aligned(record: Array, simulated: Array) -> tuple[int, Array, Array]:
    """Samples of the shift with the largest correlation, and record and curve cut to where they then overlap.

    Of equal correlations the smallest shift counts, and the one that moves the simulated curve to the left.
    """
    n = len(record)
    best = (correlation(record, simulated), 0, record, simulated)
    for shift in range(1, int(np.floor(n * FARTHEST_SHIFT)) + 1):
        for left, right in ((record[:-shift], simulated[shift:]), (record[shift:], simulated[:-shift])):
            rho = correlation(left, right)
            if rho > best[0]:
                best = (rho, shift, left, right)
    return best[1:]


def correlation(left: Array, right: Array) -> float:
    """Pearson's coefficient; 0 where a curve is constant."""
    a, b = left - left.mean(), right - right.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else 0.0


def magnitude_score(record: Array, simulated: Array) -> float:
    """1 - error / 0.5, the error in the 1-norm along the warping path that costs least."""
    rows, columns = warping_path(simulated, record)
    return _score(np.abs(simulated[rows] - record[columns]), np.abs(record[columns]), WORST_MAGNITUDE)


def warping_path(x: Array, y: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Index pairs of dynamic time warping, squared distance, within WARPING of the diagonal (steps of 0 or 1)."""
    n, band = len(x), int(np.ceil(WARPING * len(x)))
    costs = (x[:, None] - y[None, :]) ** 2
    total = np.full((n + 1, n + 1), np.inf)
    total[0, 0] = 0.0
    for i in range(1, n + 1):
        low, high = max(1, i - band + 1), min(n, i + band - 1)
        for j in range(low, high + 1):
            total[i, j] = costs[i - 1, j - 1] + min(total[i - 1, j], total[i, j - 1], total[i - 1, j - 1])
    steps, i, j = [(n - 1, n - 1)], n, n
    while (i, j) != (1, 1):
        i, j = min(((i - 1, j), (i, j - 1), (i - 1, j - 1)), key=lambda place: total[place])
        steps.append((i - 1, j - 1))
    rows, columns = np.array(steps[::-1]).T
    return rows, columns


def slope_score(record: Array, simulated: Array) -> float:
    """1 - error / 2, the error in the 1-norm of the derivatives, each averaged over nine samples."""
    left, right = smoothed(np.gradient(record)), smoothed(np.gradient(simulated))
    return _score(np.abs(right - left), np.abs(left), WORST_SLOPE)


def _score(errors: Array, sizes: Array, worst: float) -> float:
    """1 - error / worst, the error relative to the record; where that is 0 throughout, 1 without error and else 0."""
    error, size = float(errors.sum()), float(sizes.sum())
    if size == 0.0:
        return float(error == 0.0)
    return float(np.clip(1.0 - error / size / worst, 0.0, 1.0))


def smoothed(values: Array) -> Array:
    """Running mean of nine samples; towards the ends of 7, 5, 3 and 1, all that a symmetric window finds."""
    half, result = SMOOTHING // 2, values.copy()
    result[half:-half] = np.convolve(values, np.full(SMOOTHING, 1.0 / SMOOTHING), mode="valid")
    for i in range(1, half):
        result[i] = values[: 2 * i + 1].mean()
        result[-1 - i] = values[-2 * i - 1 :].mean()
    return result
