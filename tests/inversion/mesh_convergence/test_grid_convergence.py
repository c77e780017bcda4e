"""The grid convergence index against closed forms and the worked example of Celik et al. (2008)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birdstrike.inversion.mesh_convergence.grid_convergence import (
    curve_convergence,
    grid_convergence,
    observed_order,
    order_and_safety,
)

EVEN, UNEVEN = (1.0, 1.3, 1.69), (1.0, 1.17, 1.71)


def power_law(spacings, exact: float, slope: float, order: float) -> list[float]:
    return [exact + slope * h**order for h in spacings]


@pytest.mark.parametrize(
    ("spacings", "values", "order", "extrapolated", "index"),
    [
        ((1.0, 1.5, 2.0), (6.063, 5.972, 5.863), 1.53, 6.1685, 0.022),
        ((1.0, 2.0, 2.0 * 2.143), (10.7880, 10.7250, 10.6050), 0.75, 10.8801, 0.011),
    ],
)
def test_celik_table_1(spacings, values, order, extrapolated, index):
    """Its two monotonic columns as printed: 18000, 8000, 4500 cells, and 18000, 4500, 980.

    The paper's factor of safety is 1.25 whatever the order; here it is 3, for neither order is near 2.
    """
    found = grid_convergence(spacings, values)
    assert found.order == pytest.approx(order, abs=0.005)
    assert found.extrapolated == pytest.approx(extrapolated, abs=5e-5)
    assert found.index(0) == pytest.approx(index * 3.0 / 1.25, abs=0.0005 * 3.0 / 1.25)


def test_celik_table_1_third_column_is_oscillating_and_has_no_order():
    """The paper puts an order of 1.51 to it; here the spread stands instead."""
    found = grid_convergence((1.0, 2.0, 2.0 * 2.143), (6.0042, 5.9624, 6.0909))
    assert (found.behaviour, found.order, found.extrapolated) == ("oscillating", None, None)
    assert found.uncertainties == pytest.approx([6.0909 - 5.9624] * 3)


@pytest.mark.parametrize("spacings", [EVEN, UNEVEN])
@pytest.mark.parametrize("slope", [0.4, -0.4])
def test_a_second_order_function_gives_order_2_and_the_exact_value(spacings, slope):
    found = grid_convergence(spacings, power_law(spacings, 5.0, slope, 2.0))
    assert found.order == pytest.approx(2.0, rel=1e-9)
    assert found.extrapolated == pytest.approx(5.0, rel=1e-9)
    assert found.uncertainties == pytest.approx([1.25 * 0.4 * h**2 for h in spacings])


@given(order=st.floats(0.05, 6.0), first=st.floats(1.05, 2.5), second=st.floats(1.05, 2.5))
def test_the_order_of_any_power_law_is_found(order, first, second):
    spacings = (1.0, first, first * second)
    assert observed_order(spacings, power_law(spacings, 3.0, 1.0, order)) == pytest.approx(order, rel=1e-5)


def test_the_order_solves_the_published_fixed_point_equation():
    values = power_law(UNEVEN, 5.0, 0.3, 1.4)
    r21, r32, p = 1.17, 1.71 / 1.17, observed_order(UNEVEN, values)
    q = np.log((r21**p - 1.0) / (r32**p - 1.0))
    assert p == pytest.approx(abs(np.log((values[2] - values[1]) / (values[1] - values[0])) + q) / np.log(r21))


def test_an_order_above_the_schemes_own_does_not_shrink_the_uncertainty():
    found = grid_convergence(EVEN, power_law(EVEN, 5.0, 0.4, 4.0))
    assert found.order == pytest.approx(4.0)
    assert (found.order_used, found.safety) == (2.0, 3.0)
    change = found.values[1] - found.values[0]
    assert found.uncertainties[0] == pytest.approx(3.0 * change / (1.3**2 - 1.0))


def test_two_meshes_that_agree_by_chance_leave_the_spread_of_all():
    """An order of 25 would give an index of 0.5 % to values that span 12 %."""
    found = grid_convergence((15.1, 19.0, 23.1), (1.479, 1.478, 1.302))
    assert found.behaviour == "convergent"
    assert found.order == pytest.approx(25.0, abs=2.0)
    assert found.spread_taken
    assert min(found.uncertainties) == pytest.approx(1.479 - 1.302)
    assert not grid_convergence(EVEN, power_law(EVEN, 5.0, 0.4, 4.0)).spread_taken
    curve = curve_convergence((15.1, 19.0, 23.1), np.array([[1.479], [1.478], [1.302]]))
    assert curve.bands.min() == pytest.approx(1.479 - 1.302)


def test_an_order_near_zero_does_not_extrapolate_beyond_one_half():
    found = grid_convergence(EVEN, power_law(EVEN, 5.0, 0.4, 0.1))
    assert (found.order_used, found.safety) == (0.5, 3.0)
    assert found.uncertainties[0] == pytest.approx(3.0 * (found.values[1] - found.values[0]) / (1.3**0.5 - 1.0))


@pytest.mark.parametrize(
    ("observed", "used", "safety"),
    [(1.81, 2.0, 1.25), (2.19, 2.0, 1.25), (1.79, 1.79, 3.0), (2.21, 2.0, 3.0), (1.0, 1.0, 3.0), (0.1, 0.5, 3.0)],
)
def test_only_an_order_within_a_tenth_of_the_formal_one_earns_the_small_factor(observed, used, safety):
    """W. Oberkampf and C. Roy (2010), section 8.7."""
    assert order_and_safety(np.array([observed])) == pytest.approx((used, safety))
    found = grid_convergence(EVEN, power_law(EVEN, 5.0, 0.4, observed))
    assert (found.order_used, found.safety) == pytest.approx((used, safety))
    assert found.uncertainties == pytest.approx([safety * abs(v - (found.extrapolated or 0.0)) for v in found.values])


def test_orders_that_scatter_about_the_formal_one_do_not_earn_it():
    """Their mean is 2, yet no point of the curve is in the asymptotic range."""
    assert order_and_safety(np.array([1.0, 3.0])) == (1.5, 3.0)


@pytest.mark.parametrize(
    ("values", "behaviour"),
    [
        ((1.0, 1.1, 1.05), "oscillating"),
        ((1.0, 1.0, 1.05), "oscillating"),  # no ratio of changes, hence no order
        ((1.0, 1.2, 1.3), "diverging"),
        ((1.0, 1.1, 1.2), "diverging"),  # equal changes on equal ratios: order 0
        ((1.0, 1.1, 1.25), "convergent"),
        ((1.0, 1.0, 1.0), "unchanged"),
        ((0.0, 0.0, 0.0), "unchanged"),
    ],
)
def test_behaviour_is_said_and_without_convergence_the_spread_is_the_uncertainty(values, behaviour):
    found = grid_convergence(EVEN, values)
    assert found.behaviour == behaviour
    if behaviour != "convergent":
        assert (found.order, found.extrapolated) == (None, None)
        assert found.uncertainties == pytest.approx([max(values) - min(values)] * 3)


def test_a_value_of_zero_has_no_relative_index():
    assert grid_convergence(EVEN, (0.0, 1.0, 3.0)).index(0) is None


def test_spacings_must_rise():
    with pytest.raises(ValueError, match="must rise"):
        grid_convergence((1.0, 1.0, 2.0), (1.0, 2.0, 3.0))


def test_the_band_of_a_converging_curve_covers_the_exact_one():
    """A pulse whose mesh error is of second order at every instant: the band is 1.25 times that error."""
    t = np.linspace(0.0, 1.0, 101)[1:-1]
    error = 0.1 * np.cos(3.0 * t)
    curves = np.array([np.sin(np.pi * t) + error * h**2 for h in UNEVEN])
    found = curve_convergence(UNEVEN, curves)
    assert found.order == pytest.approx(2.0)
    assert found.shares["convergent"] == 1.0
    np.testing.assert_allclose(found.bands, 1.25 * np.abs(error) * np.square(UNEVEN)[:, None], rtol=1e-6)


def test_points_that_oscillate_have_the_spread_as_band():
    t = np.linspace(0.0, 1.0, 50)
    curves = np.array([t, t + 0.1, t + 0.05])
    found = curve_convergence(EVEN, curves)
    assert found.order is None
    assert found.shares["oscillating"] == 1.0
    np.testing.assert_allclose(found.bands, 0.1)
