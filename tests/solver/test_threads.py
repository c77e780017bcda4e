"""A simulation leaves the cores that other programs take, and comes back to them."""

from __future__ import annotations

import numba
import pytest

from birdstrike.solver.threads import MOST_THREADS, PATIENCE, Team


@pytest.fixture(autouse=True)
def restored():
    before = numba.get_num_threads()
    yield
    numba.set_num_threads(before)


def periods(team: Team, disturbed: list[bool]) -> list[int]:
    """Threads after each period."""
    threads = []
    for one in disturbed:
        team.threads = team.after(one)
        threads.append(team.threads)
    return threads


@pytest.mark.skipif(MOST_THREADS < 2, reason="one thread is all there is")
def test_a_disturbed_team_gives_up_one_thread_and_tries_it_again_after_a_calm_time():
    wait = 2 * PATIENCE[0]
    assert periods(Team(2), [False, True] + wait * [False]) == [2, 1] + (wait - 1) * [1] + [2]


@pytest.mark.skipif(MOST_THREADS < 2, reason="one thread is all there is")
def test_attempts_grow_rare_while_a_core_stays_taken():
    team, threads = Team(2), []
    for _ in range(1000):
        threads += periods(team, [team.threads == 2])
    attempts = threads.count(2)
    assert 1000 // (PATIENCE[1] + 1) <= attempts <= 1000 // PATIENCE[1] + 5


def test_one_thread_stays_one():
    assert periods(Team(1), [True, False, True] + 100 * [False]) == 103 * [1]


@pytest.mark.skipif(MOST_THREADS < 2, reason="one thread is all there is")
def test_a_thread_that_slept_through_its_period_was_disturbed():
    team = Team(2)
    team.clock -= 1.0  # a second has passed in which this thread did nothing
    team.follow_load()
    assert (team.threads, numba.get_num_threads()) == (1, 1)
