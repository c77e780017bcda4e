"""Campaigns in processes: killed, interrupted, and with any number of workers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.solver.case.case import Case
from tests.doe.stand_in import VERSION, attempts, design, pids, reference, strike

ROOT = Path(__file__).parents[3]
RUNS = 8
ENDS = {signal.SIGKILL: -signal.SIGKILL, signal.SIGINT: 130, signal.SIGTERM: 143}
"""Signal -> how the command ends by it."""


def start(diary: Path, out: Path, seconds: float) -> subprocess.Popen[str]:
    """`birdstrike run-doe` with the stand-in, in a session of its own."""
    options = ["--design", "lhs", "--runs", str(RUNS), "--workers", "2", "--out", str(out)]
    command = [
        sys.executable,
        "-m",
        "tests.doe.campaign_process",
        str(diary),
        str(seconds),
        "run-doe",
        "reference_strike",
    ]
    return subprocess.Popen(
        [*command, *options],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def until(condition: Callable[[], bool], seconds: float = 120.0) -> None:
    """Wait for a condition; fail when it does not come about."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def gone(pid: int) -> bool:
    """Whether a process has ended; one that only waits to be reaped has."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


def finished(out: Path) -> int:
    return len(list((out / "runs").glob("*.h5")))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """curves.csv of the same campaign, run by one worker without a stop."""
    out = tmp_path_factory.mktemp("undisturbed")
    run_campaign(reference(), design(RUNS), out, workers=1, simulate=strike, solver_version=VERSION, say=lambda _: None)
    return (out / "curves.csv").read_bytes()


def test_two_workers_give_the_same_bytes_as_one(tmp_path: Path, undisturbed: bytes) -> None:
    run_campaign(
        reference(), design(RUNS), tmp_path, workers=2, simulate=partial(strike, seconds=0.02), solver_version=VERSION,
        say=lambda _: None,
    )  # fmt: skip
    assert (tmp_path / "curves.csv").read_bytes() == undisturbed


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for left-over processes in /proc")
@pytest.mark.parametrize("how", ENDS)
def test_a_stopped_campaign_loses_only_the_strikes_in_flight(
    tmp_path: Path, undisturbed: bytes, how: signal.Signals
) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    process = start(diary, out, seconds=0.5)
    until(lambda: finished(out) >= 3)
    if how != signal.SIGKILL:
        os.killpg(process.pid, how)  # as a terminal and `timeout` do: to the workers too
    else:
        os.kill(process.pid, how)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == ENDS[how], output
    assert "Traceback" not in output
    assert how == signal.SIGKILL or "leaked" not in output
    until(lambda: all(gone(pid) for pid in pids(diary)))
    kept = finished(out)
    assert 3 <= kept < RUNS
    assert not (out / "curves.csv").exists()
    with pytest.raises(Exception, match="stopped midway: run the same birdstrike run-doe again"):
        load_dataset(out)
    begun = len(attempts(diary))
    assert begun <= kept + 2 + 2  # two in flight, two that may have ended while the campaign was being stopped

    with ThreadPoolExecutor(1) as executor:
        simulate = partial(strike, diary=diary)
        run_campaign(
            reference(), design(RUNS), out, simulate=simulate, solver_version=VERSION, say=lambda _: None,
            executor=executor,
        )  # fmt: skip
    assert len(attempts(diary)) - begun == RUNS - kept
    assert (out / "curves.csv").read_bytes() == undisturbed


def falls_over(case: Case, *, step_factor: float, threads: int, diary: Path) -> Histories:
    """A strike during which the system kills the worker, once two others have ended."""
    if len(attempts(diary, "ended")) >= 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return strike(case, step_factor=step_factor, threads=threads, diary=diary)


def test_a_killed_worker_ends_the_campaign_with_a_remedy_and_keeps_the_rest(tmp_path: Path) -> None:
    out, simulate = tmp_path / "out", partial(falls_over, diary=tmp_path / "diary")
    with pytest.raises(RunFailed, match="worker process ended abruptly") as caught:
        run_campaign(
            reference(), design(RUNS), out, workers=1, simulate=simulate, solver_version=VERSION, say=lambda _: None
        )
    assert "--workers" in caught.value.remedy
    assert len(RunStore(out / "runs").keys()) == 2
