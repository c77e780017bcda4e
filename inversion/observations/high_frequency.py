"""Noise from a record's own high frequencies, where it has no stretch at rest: differences of neighbouring points.

Differences of order k remove a polynomial of degree k - 1; of white noise every order, scaled, has the same scatter.
Where orders 6 and 8 disagree, what is left is the response itself, or noise that a filter has smoothed, and the
differences say nothing of the noise (Hall, Kay and Titterington, Biometrika 77 (1990) 521).
"""

from __future__ import annotations

from math import comb

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.observations.clock import off_grid, rounding_tolerance

LOW_ORDER, HIGH_ORDER = 6, 8
FEWEST = 40  # differences
AGREE = 1.25  # ratio of the two orders, either way: 98.5 % of records of white noise with 42 differences keep within it
UNEVEN = 0.01  # of a step: differences are taken among equally spaced instants only, but for the clock's rounding
MEDIAN_TO_SIGMA = 1.4826
WORTH = 0.12
"""Degrees of freedom a difference: neighbouring ones share points, and a median uses about a third.

By the variance it is 0.17, but the scatter of few differences is skewed: white noise of 42 to 394 differences passes
the 99.5 % limit of a chi-square of 0.119 to 0.146 degrees of freedom a difference as often (20 000 records of each
length).
"""
ROUNDED = np.sqrt(12.0)


def white_scatter(times: Array, values: Array) -> tuple[float, float] | None:
    """Standard deviation of a record's white noise, in the unit of the values, and the degrees of freedom behind it.

    times, values: (n,). None where the points are too few, unevenly spaced, or where no white noise shows. Readings
    that a digitiser has rounded scatter by at least its step over the square root of 12.
    """
    low, count = _scatter(times, values, LOW_ORDER)
    high, _ = _scatter(times, values, HIGH_ORDER)
    if count < FEWEST or not low or not high or not 1.0 / AGREE < high / low < AGREE:
        return None
    return max(low, digitiser_step(values) / ROUNDED), WORTH * count


def digitiser_step(values: Array) -> float:
    """The step that readings (n,) are multiples of, 0 where they are not."""
    steps = np.diff(np.unique(values))
    if len(steps) < 2:
        return 0.0
    step = float(steps.min())
    multiples = steps / step
    return step if np.abs(multiples - np.round(multiples)).max() < 1e-3 * multiples.max() else 0.0


def _scatter(times: Array, values: Array, order: int) -> tuple[float, int]:
    """Robust standard deviation of white noise by differences of an order, and how many there are."""
    if len(values) <= order:
        return 0.0, 0
    instants = np.lib.stride_tricks.sliding_window_view(times, order + 1)
    even = off_grid(instants) <= rounding_tolerance(times, UNEVEN)
    differences = np.diff(values, order)[even]
    if not len(differences):
        return 0.0, 0
    scale = np.sqrt(comb(2 * order, order))
    return MEDIAN_TO_SIGMA * float(np.median(np.abs(differences))) / scale, len(differences)
