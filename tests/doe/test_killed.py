"""A campaign that is killed again and again, at moments that nobody chose, ends as if nothing had happened."""

from __future__ import annotations

import multiprocessing
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from data.store import RunStore
from doe.campaign import run_campaign
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
        return {key for key in store.keys() if store.load(key) is not None}


@pytest.mark.skipif(sys.platform == "win32", reason="a fork server is needed: a fresh interpreter per life is too slow")
def test_twenty_kills_at_random_moments_change_no_byte_and_lose_only_strikes_in_flight(tmp_path: Path) -> None:
    out, diary, undisturbed = tmp_path / "out", tmp_path / "diary", tmp_path / "undisturbed"
    life(undisturbed)
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.doe.test_killed"])
    began = time.monotonic()
    first = context.Process(target=life, args=(tmp_path / "timed", None, 0.01))
    first.start()
    first.join()
    span = time.monotonic() - began  # with the start of the fork server: longer than any later life
    moments = np.random.default_rng().uniform(0.0, min(span, 1.0) / 3.0, KILLS)
    kept: set[str] = set()
    for moment in moments:
        process = context.Process(target=life, args=(out, diary, 0.01))
        process.start()
        time.sleep(float(moment))
        process.kill()
        process.join()
        survived = whole_runs(out)
        assert kept <= survived  # what was written stays written
        kept = survived
    life(out, diary)
    assert (out / "curves.csv").read_bytes() == (undisturbed / "curves.csv").read_bytes()
    assert len(attempts(diary)) <= RUNS + KILLS * IN_FLIGHT
    assert len(whole_runs(out)) == RUNS
