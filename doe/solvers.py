"""The solver that a case asks for: ours, compiled and embedded, or somebody else's, run as a command."""

from __future__ import annotations

from typing import NamedTuple

from birdstrike.doe.campaign.attempt import Simulate
from birdstrike.solver.case.case import Case

STEP_FACTORS = (1.0, 0.5)
"""A strike that fails is tried once more with half the time step."""


class Solver(NamedTuple):
    """simulate; version: what makes its results another solver's; step_factors: of the attempts at a strike."""

    simulate: Simulate
    version: str
    step_factors: tuple[float, ...] = STEP_FACTORS


def solver_for(case: Case, embedded: Simulate | None = None) -> Solver:
    """The solver of the case's `solver`; embedded: what stands in our own solver's place.

    Raises CaseError for an external solver whose template does not fit the case.
    """
    if case.solver.name == "external":
        from birdstrike.doe.external.external import external_solver

        return external_solver(case)
    if embedded is None:
        from birdstrike.solver.simulate import simulate as embedded  # late: it brings the compiled kernels
    from birdstrike.solver.version import SOLVER_VERSION

    return Solver(embedded, SOLVER_VERSION)
