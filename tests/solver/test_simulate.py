"""A simulation leaves the process as it found it."""

from __future__ import annotations

import runpy
from importlib.util import find_spec

import numba
import pytest
from numba.core import config

from birdstrike import load_case, simulate
from birdstrike.data.errors import RunFailed

TINY = {"bird.particles": "120", "plate.elements": "[6, 6]", "time.end": "0.05 ms", "time.snapshots": "[]"}
MOST: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]
SEVERAL = pytest.mark.skipif(MOST < 2, reason="one thread is all there is")


@pytest.fixture
def two_threads():
    before = numba.get_num_threads()
    numba.set_num_threads(2)
    yield
    numba.set_num_threads(before)


@SEVERAL
def test_a_late_import_does_not_take_a_lowered_thread_count_for_all_there_are():
    numba.set_num_threads(1)
    try:
        late = runpy.run_path(find_spec("birdstrike.solver.threads").origin)  # pyright: ignore[reportOptionalMemberAccess, reportArgumentType]
    finally:
        numba.set_num_threads(MOST)
    assert late["MOST_THREADS"] == MOST


@SEVERAL
@pytest.mark.usefixtures("two_threads")
def test_a_run_on_one_thread_leaves_the_thread_count_of_the_process():
    simulate(load_case("reference_strike_156mm", TINY), threads=1)
    assert numba.get_num_threads() == 2


@SEVERAL
@pytest.mark.usefixtures("two_threads")
def test_a_run_that_fails_leaves_the_thread_count_of_the_process():
    case = load_case("reference_strike_156mm", TINY | {"time.end": "0.3 ms", "impact.standoff": "1 mm"})
    with pytest.raises(RunFailed):
        simulate(case, step_factor=8.0, threads=1)
    assert numba.get_num_threads() == 2
