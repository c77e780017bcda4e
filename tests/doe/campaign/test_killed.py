"""A campaign that is killed again and again, at moments that nobody chose, ends as if nothing had happened."""

from __future__ import annotations

import multiprocessing
import multiprocessing.context
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from tests.doe.stand_in import VERSION, attempts, design, reference, strike

RUNS, KILLS, IN_FLIGHT = 40, 20, 4
"""IN_FLIGHT: strikes that two workers have been handed: two run, two wait or have ended and are not written yet."""


def life(out: Path, diary: Path | None = None, seconds: float = 0.0) -> None:
    """One call of the campaign, from its claim on the folder to its curves."""
    with ThreadPoolExecutor(2) as executor:
        run_campaign(
            reference(),
            design(RUNS),
            out,
            workers=2,
            simulate=partial(strike, diary=diary, seconds=seconds),
            solver_version=VERSION,
            executor=executor,
            say=lambda _: None,
        )


def whole_runs(out: Path) -> set[str]:
    """Runs in the store, each of which must be readable."""
    store = RunStore(out / "runs")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a damaged file would warn
        keys = store.keys()
        return {key for key in keys if store.load(key) is not None}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """curves.csv of the campaign that nobody stops."""
    out = tmp_path_factory.mktemp("undisturbed")
    life(out)
    return (out / "curves.csv").read_bytes()


@pytest.fixture(scope="module")
def processes() -> multiprocessing.context.ForkServerContext:
    """Processes that have loaded everything: a fresh interpreter for each life would be too slow."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.doe.campaign.test_killed"])
    return context


pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there is no fork server")


def test_two_processes_on_one_folder_end_alike_and_share_the_strikes(
    tmp_path: Path, undisturbed: bytes, processes: multiprocessing.context.ForkServerContext
) -> None:
    out, diary = tmp_path / "out", tmp_path / "diary"
    both = [processes.Process(target=life, args=(out, diary, seconds)) for seconds in (0.2, 0.01)]
    for process in both:
        process.start()
    for process in both:
        process.join()
    assert [process.exitcode for process in both] == [0, 0]
    assert (out / "curves.csv").read_bytes() == undisturbed
    assert len(whole_runs(out)) == RUNS
    assert len(attempts(diary)) < 2 * RUNS  # what one has ended the other does not begin


def test_twenty_kills_at_random_moments_change_no_byte_and_lose_only_runs_in_flight(
    tmp_path: Path, undisturbed: bytes, processes: multiprocessing.context.ForkServerContext
) -> None:
    out, diary = tmp_path / "out", tmp_path / "diary"
    began = time.monotonic()
    first = processes.Process(target=life, args=(tmp_path / "timed", None, 0.01))
    first.start()
    first.join()
    longest = min(time.monotonic() - began, 1.0) / 3.0
    kept: set[str] = set()
    for moment in np.random.default_rng(0).uniform(0.0, longest, KILLS):
        process = processes.Process(target=life, args=(out, diary, 0.01))
        process.start()
        time.sleep(float(moment))
        process.kill()
        process.join()
        survived = whole_runs(out)
        assert kept <= survived  # what was written stays written
        kept = survived
    life(out, diary)
    assert (out / "curves.csv").read_bytes() == undisturbed
    assert len(attempts(diary)) <= RUNS + KILLS * IN_FLIGHT
    assert len(whole_runs(out)) == RUNS
