"""What kind of shot a case is, which records are its own, and whether two cases are of one structure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.solver.case.case import Case


def conditions(case: Case) -> dict[str, float]:
    """SI values: normal speed, its kinetic energy 1/2 m v^2, stagnation pressure 1/2 rho v^2, thickness that is struck.

    The stagnation pressure is that of a steady incompressible jet (Wilbeck, AFML-TR-77-134, 1978, sect. 2.3).
    """
    v, bird = case.normal_speed, case.bird
    return {
        "speed": v,
        "energy": 0.5 * bird.actual_mass * v**2,
        "pressure": 0.5 * bird.actual_density * v**2,
        "thickness": case.plate.thickness,
    }


def same_structure(case: Case, other: Case) -> bool:
    """Whether both strike one plate or one target; of a mesh from a file its content counts, not where it stands."""
    own, others = (None if one.target is None else one.target.content for one in (case, other))
    return case.plate == other.plate and own == others


def case_of_each(records: Sequence[Measured], cases: Sequence[Case]) -> list[Case]:
    """Each record's case, in order; a single case serves all. Raises UserError where their numbers do not fit."""
    if len(cases) not in (1, len(records)):
        raise UserError(
            f"{many(len(records), 'record')} and {many(len(cases), 'case')}: give one case for all records, or one for "
            "each in their order, of which CASE is the first"
        )
    return [*cases] * (len(records) if len(cases) == 1 else 1)


def parts_of_one_shot(records: Sequence[Measured], cases: Sequence[Case]) -> Iterator[str]:
    """A warning for every two records of one case that share no sensor: files of one shot would count as two birds."""
    for (first, case), (second, other) in combinations(zip(records, cases, strict=True), 2):
        if case == other and not set(first.channels) & set(second.channels):
            yield (
                f"{first.path} and {second.path} are of one case and share no sensor: they count as two shots; if they "
                f"are files of one, join them by birdstrike import {second.path} --beside {first.path}"
            )
