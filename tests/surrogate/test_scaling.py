"""Scaling to 0..1."""

from __future__ import annotations

import numpy as np

from birdstrike.surrogate.scaling import Scaling


def test_columns_span_zero_to_one() -> None:
    values = np.array([[1.0, -5.0], [3.0, 5.0], [2.0, 0.0]])
    scaling = Scaling.over(values)
    np.testing.assert_allclose(scaling.to_unit(values), [[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]])
    np.testing.assert_allclose(scaling.to_unit(np.array([4.0, -10.0])), [1.5, -0.5])


def test_constant_column_says_nothing() -> None:
    values = np.array([[0.1 + 0.2, 1.0], [0.3, 2.0]])  # the first differs by rounding only
    scaling = Scaling.over(values)
    assert scaling.constant.tolist() == [True, False]
    np.testing.assert_array_equal(scaling.to_unit(np.array([7.0, 1.5])), [0.0, 0.5])
