"""Fractions of ranges in their scales, and the nearest run in them."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.dataset import fraction
from tests.inversion.stand_in import campaign, over_decades, spread


def test_a_value_stands_on_its_range_in_the_scale_of_that() -> None:
    assert fraction(1.0, 0.01, 100.0, True) == pytest.approx(0.5)
    assert fraction(-0.1, -10.0, -1e-3, True) == pytest.approx(0.5)
    assert fraction(3.0, 1.0, 5.0, False) == pytest.approx(0.5)


def test_the_nearest_run_is_near_in_the_scales_of_the_ranges() -> None:
    """Linearly all runs of the lower two of three decades were equally near, and the others decided."""
    unit = spread(20)
    wide = over_decades(campaign(unit))
    place = np.full(4, 0.2)
    assert wide.nearest(wide.to_physical(place)) == int(((unit - place) ** 2).sum(axis=1).argmin())
