"""The clock of a record: its last digit, and how far its instants lie from equally spaced ones."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array

DIGITS = 10.0 ** np.arange(-2, -11, -1)  # [s], from the coarsest
NO_FRACTION = 1e-3  # of a digit: what the conversion of a unit leaves
LARGEST_SHARE = 0.2  # of a step, by which rounding may have moved an instant


def last_digit(times: Array) -> float:
    """The power of ten [s] of which instants (n,) are multiples from the first on; 0 where none from 0.1 ns on is."""
    since = times - times[0]
    for digit in DIGITS:
        multiples = since / digit
        if np.abs(multiples - np.round(multiples)).max() < NO_FRACTION:
            return float(digit)
    return 0.0


def off_grid(windows: Array) -> Array:
    """(...,) largest distance [s] of instants (..., n) from the equally spaced ones nearest by least squares."""
    n = windows.shape[-1]
    line = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n), 1))[0]
    apart = windows - windows[..., :1]
    return np.asarray(np.abs(apart - (apart @ line) @ line.T).max(axis=-1))


def rounding_tolerance(times: Array, exact: float) -> float:
    """Distance [s] from equally spaced instants that rounding gives a clock (n,), at least the share `exact` of a step.

    A digit: an instant is off by up to half of one, and the line through them by nearly as much. Of a digit as long as
    a fifth of a step nothing says whether the clock was rounded or is uneven.
    """
    step = float(np.median(np.diff(times)))
    return max(exact * step, min(last_digit(times), LARGEST_SHARE * step))


def grid_step(times: Array) -> float:
    """Step [s] of the equally spaced instants nearest to (n,)."""
    places = np.arange(len(times)) - (len(times) - 1) / 2.0
    return float(places @ (times - times[0]) / (places @ places))
