"""Random settings, one and two at a time: each ends in histories, or in a sentence that the user can act on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.setup_warnings import setup_warnings
from birdstrike.solver.simulate import simulate
from tests.fuzz import fuzzed
from tests.solver.case.random_fields import Table
from tests.solver.case.random_keys import TINY, settings_of

WORK = 3e6
"""Particle and shell steps of a simulation that the test waits for."""
PIECES = 2000
"""Particles and shells of a case that is built at all."""


@pytest.mark.parametrize("count", [1, 2])
@given(data=st.data())
@fuzzed
def test_random_settings_end_in_histories_or_in_a_sentence(count: int, data: st.DataObject) -> None:
    settings = data.draw(settings_of(count))
    ended = outcome(settings)
    event(ended[0].split()[0] if ended else "simulated")
    assert all(line.strip() and len(line) < 3000 for line in ended)


def outcome(settings: Table) -> list[str]:
    """Nothing where the case was simulated, else why not; any exception but those a user may see goes through."""
    try:
        case = load_case(TINY, settings)
        case_hash(case)
        if case.solver.name == "external":
            return ["external"]
        if case.bird.particles + case.plate.elements[0] * case.plate.elements[1] > PIECES:
            return ["large"]
        return (setup_warnings(case) and []) or simulated(case)
    except UserError as error:
        return error.errors
    except RunFailed as error:
        return [error.reason, error.remedy]


def simulated(case: Case) -> list[str]:
    """Simulate a case that does not take long, and look at its histories."""
    coupling: Any = Coupling(case)
    if coupling.steps * (coupling.bird.n + len(coupling.plate.quads)) > WORK or len(case.time.instants) > 1e5:
        return ["long"]
    histories = simulate(case, threads=1)
    assert all(np.all(np.isfinite(values)) for values in histories.channels.values())
    assert len(histories.time) >= 3
    return []
