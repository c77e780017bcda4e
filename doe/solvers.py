"""The solver that a case asks for: ours, compiled and embedded, or somebody else's, run as a command."""

from __future__ import annotations

from typing import Any

from birdstrike.doe.attempt import Simulate, Solver
from birdstrike.solver.case.case import Case


def simulated_by(case: Case) -> str:
    """The program that computes the case's curves, for provenance: birdstrike, or the external solver's `version`."""
    return case.external.version if case.solver.name == "external" and case.external is not None else "birdstrike"


def refuse_unbuildable(case: Case) -> None:
    """Raise UserError where our solver could not begin with the case's bird; another solver's is not looked at."""
    if case.solver.name != "external":
        from birdstrike.solver.coupling import bird_and_step  # late: it brings the compiled kernels

        bird_and_step(case)


def solver_for(case: Case, embedded: Simulate | None = None) -> Solver:
    """The solver of the case's `solver`; embedded: what stands in our own solver's place.

    Raises CaseError for an external solver whose template does not fit the case.
    """
    if case.solver.name == "external":
        from birdstrike.doe.external.external import external_solver  # late: jinja2 and pandas, for start-up time

        return external_solver(case)
    if embedded is None:
        from birdstrike.solver.simulate import simulate as embedded  # late: it brings the compiled kernels
    from birdstrike.solver.version import SOLVER_VERSION  # late: it reads every source of the solver

    return Solver(embedded, SOLVER_VERSION)


def content_of(case: Case, embedded: Simulate | None = None) -> dict[str, Any]:
    """All that a result can take from a case, as JSON has it: what it declares and resolves to, orders, its solver.

    embedded: as of `solver_for`. Raises what that raises.
    """
    declared = case.model_dump(mode="json")
    del declared["solver"]["threads"]
    return {
        "declared": declared,
        "canonical": case.canonical(),
        "order": [list(case.inversion.parameters), list(case.sensors)],  # of designs and of channels
        "solver": solver_for(case, embedded).version,
    }
