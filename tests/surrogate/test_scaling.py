"""Scaling to 0..1 and back."""

from __future__ import annotations

import numpy as np

from birdstrike.surrogate.scaling import Scaling


def test_columns_span_zero_to_one_and_come_back() -> None:
    values = np.array([[1.0, -5.0], [3.0, 5.0], [2.0, 0.0]])
    scaling = Scaling.over(values)
    unit = scaling.to_unit(values)
    np.testing.assert_allclose(unit, [[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]])
    np.testing.assert_allclose(scaling.from_unit(unit), values)
    np.testing.assert_allclose(scaling.to_unit(np.array([4.0, -10.0])), [1.5, -0.5])


def test_constant_column_says_nothing_and_keeps_its_value() -> None:
    values = np.array([[0.1 + 0.2, 1.0], [0.3, 2.0]])  # the first differs by rounding only
    scaling = Scaling.over(values)
    assert scaling.constant.tolist() == [True, False]
    np.testing.assert_array_equal(scaling.to_unit(np.array([7.0, 1.5])), [0.0, 0.5])
    assert scaling.from_unit(np.array([9.0, 0.5]))[0] == 0.3
