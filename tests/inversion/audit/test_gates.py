"""Rates over curves with two intervals, and the gates judged by the wider."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.inversion.audit.gates import at_least, clopper_pearson, contains, figures_of, rate


def test_rates_are_bootstrapped_over_whole_curves() -> None:
    same = rate([np.ones(200), np.zeros(200)] * 5)
    assert same.value == 0.5
    assert same.interval_95 is not None
    assert same.interval_95[1] - same.interval_95[0] > 0.5  # ten curves, not two thousand draws
    assert contains("x", same, 0.5).met
    assert not at_least("x", same, 0.6).met
    assert rate([]).value is None
    assert contains("x", rate([]), 0.05).met is None


def test_seven_curves_without_an_alarm_cannot_exclude_five_per_cent() -> None:
    """The bootstrap has no width; Clopper and Pearson's upper end is 1 - 0.025^(1/7)."""
    silent = rate([np.zeros(200)] * 7)
    assert silent.interval_95 == (0.0, 0.0)
    assert silent.exact_95 == pytest.approx((0.0, 1.0 - 0.025 ** (1.0 / 7.0)))
    assert contains("x", silent, 0.05).met


def test_the_wider_interval_judges() -> None:
    split = rate([np.ones(50)] * 3 + [np.zeros(50)] * 97)
    assert split.exact_95 == clopper_pearson(0.03, 100)
    assert split.interval_95 is not None
    assert split.exact_95 is not None
    assert split.wider == max((split.interval_95, split.exact_95), key=lambda ends: ends[1] - ends[0])
    assert not contains("x", split, 0.10).met


def test_a_figure_that_is_no_rate_has_no_exact_interval() -> None:
    median = figures_of([np.array([0.2]), np.array([0.4]), np.array([3.0])], middle=np.median)
    assert median.value == 0.4
    assert median.exact_95 is None
