"""What an experimentalist takes out of a record before fitting: clipped stretches and single outliers, both named."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

FEWEST = 20  # points below which a table is taken as it is
CLIPPED_RUN = 4  # equal readings in a row
CLIPPED_SHARE = 0.5  # of the peak: a record at rest repeats itself without being clipped
OUTLIER = 8.0  # robust standard deviations
UNEVEN = 0.5  # of a step
MAD_TO_SIGMA = 1.4826
NEIGHBOURS_SIGMA = 1.39  # of a point minus the cubic through four neighbours, for white noise of 1


def clipped(values: Array) -> NDArray[np.bool_]:
    """(n,) True where the amplifier stood at its end: four or more readings in a row equal to the extreme one.

    Single readings at an end that was reached so are clipped too.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    peak = np.abs(values).max()
    for end in (values.max(), values.min()):
        if abs(end) < CLIPPED_SHARE * peak:
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], values == end, [False]]).astype(int)))
        if (edges[1::2] - edges[::2]).max() >= CLIPPED_RUN:
            marked |= values == end
    return marked


def outliers(times: Array, values: Array, noise: Array) -> NDArray[np.bool_]:
    """(n,) True at single points far off the cubic through their four neighbours.

    Far: more than 8 of the record's own robust scatter about such cubics, and of the noise (n,). Only among five
    instants (n,) that are equally spaced: across a gap the cubic says nothing.
    """
    marked = np.zeros(len(values), dtype=bool)
    if len(values) < FEWEST:
        return marked
    y = values
    middle = (-y[:-4] + 4.0 * y[1:-3] + 4.0 * y[3:-1] - y[4:]) / 6.0
    apart = np.abs(y[2:-2] - middle)
    own = MAD_TO_SIGMA * float(np.median(apart))
    far = apart > OUTLIER * np.maximum(own, NEIGHBOURS_SIGMA * noise[2:-2])
    around = np.lib.stride_tricks.sliding_window_view(np.pad(apart, 2), 5).max(axis=1)
    steps = np.lib.stride_tricks.sliding_window_view(np.diff(times), 4)
    even = np.ptp(steps, axis=1) <= UNEVEN * np.median(steps, axis=1)
    marked[2:-2] = far & even & (apart == around)
    return marked
