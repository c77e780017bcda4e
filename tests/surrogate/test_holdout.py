"""Hold-out and input rules."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.surrogate.holdout import describe, describe_times, held_out, input_times
from tests.inversion.stand_in import CHANNEL, START, campaign, spread


def test_25_runs_hold_out_the_samples_of_the_paper() -> None:
    assert (held_out(25) + 1).tolist() == [1, 5, 10, 15, 20, 25]
    assert describe(25).endswith("of 25 runs, samples 1, 5, 10, 15, 20, 25")


@pytest.mark.parametrize("runs", range(3, 80))
def test_at_least_one_and_never_more_than_a_third(runs: int) -> None:
    numbers = held_out(runs)
    assert 1 <= len(numbers) <= runs / 3
    assert len(set(numbers)) == len(numbers)
    assert 0 <= numbers.min() <= numbers.max() < runs


def test_small_campaigns_follow_the_words() -> None:
    assert [(held_out(n) + 1).tolist() for n in (4, 7, 9, 11, 12)] == [[4], [5], [1, 5, 9], [5, 10], [1, 5, 10, 12]]


def test_two_runs_cannot_be_split() -> None:
    with pytest.raises(ValueError, match="at least 3"):
        held_out(2)


def test_few_instants_are_all_read_and_many_are_thinned_from_the_first_motion_on() -> None:
    dataset = campaign(spread(8))
    few, many = np.linspace(0.0, 2.5e-3, 7), np.linspace(0.0, 2.9e-3, 291)
    np.testing.assert_array_equal(input_times({CHANNEL: few}, dataset)[CHANNEL], few)
    chosen = input_times({CHANNEL: many}, dataset)[CHANNEL]
    assert len(chosen) == 12
    assert np.isin(chosen, many).all()
    assert START <= chosen[0] < START + 0.05e-3
    assert chosen[-1] == many[-1]
    assert np.ptp(np.diff(chosen)) <= 1.01e-5  # equally spaced but for the record's own grid of 0.01 ms
    assert "12 of displacement_centre" in describe_times({CHANNEL: chosen})


def test_first_motion_moves_with_the_time_origin() -> None:
    many = np.linspace(0.0, 2.9e-3, 291)
    early, late = (input_times({CHANNEL: many}, campaign(spread(8)), t0)[CHANNEL][0] for t0 in (0.0, 0.2e-3))
    assert late - early == pytest.approx(0.2e-3, abs=1e-9)
