"""Random valid cases: each ends in histories whose energies balance, or in a sentence that says what to change.

25 cases by default; `make fuzz` draws more.
"""

from __future__ import annotations

import numpy as np
from hypothesis import event, given

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import case_from_table
from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.checks import BALANCE_LIMIT
from birdstrike.solver.simulate import simulate
from tests.fuzz import fuzzed
from tests.solver.case.random_cases import tables
from tests.solver.case.random_fields import Table

SETTINGS = ("solver.courant", "bird.particles", "plate.elements", "time.end")


@given(table=tables())
@fuzzed
def test_a_random_case_ends_in_sound_histories_or_in_a_remedy(table: Table) -> None:
    ended = struck(table)
    if isinstance(ended, str):
        event(" ".join(ended.split()[:5]))
        assert names_a_field(ended), f"no field to change in: {ended}"
    else:
        event("finished")
        assert_sound(ended)


def struck(table: Table) -> Histories | str:
    """Histories, or why there are none; any exception but the two that a user may see goes through."""
    try:
        return simulate(case_from_table(table), threads=1)
    except (RunFailed, UserError) as failure:
        return str(failure)


def assert_sound(histories: Histories) -> None:
    """Finite histories, energies and momentum balanced within their limits."""
    for name, values in histories.channels.items():
        assert np.all(np.isfinite(values)), name
    summary = histories.summary
    assert summary["worst_energy_error"] <= BALANCE_LIMIT
    assert summary["momentum_error"] < 1e-10
    assert summary["angular_momentum_error"] < 0.01
    assert all(np.isfinite(value) for value in summary["energies_J"].values())


def names_a_field(sentence: str) -> bool:
    """Whether a dotted case key stands in the sentence, one that the user can set."""
    words = [word.strip(".,;:()") for word in sentence.split()]
    return any(word in SETTINGS or quantity_at(word) is not None for word in words if "." in word)
