"""What kind of shot a case is, by which a prediction says how far it goes, and whether two are of one structure."""

from __future__ import annotations

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
