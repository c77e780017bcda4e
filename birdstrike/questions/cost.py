"""What a loop will cost before it is begun: how many simulations of which size, in seconds of one core."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from birdstrike.inversion.diagnosis.conclusions.solver_update import MOST, REPLICATES
from birdstrike.inversion.diagnosis.pipeline import UPDATES
from birdstrike.inversion.diagnosis.preparation.plan import make_plan
from birdstrike.solver.case.case import Case
from birdstrike.solver.estimate import estimate

STANDARD_BIRDS, VERIFICATIONS, FITS = 4, 2, 2
OTHER_S = 60.0
"""Compilation where it is due, training, posterior, page: by docs/performance.md some 50 s of the demo."""


@dataclass(frozen=True)
class Part:
    """Simulations of one size: how many, and seconds of one core for each."""

    what: str
    runs: int
    each: float

    @property
    def seconds(self) -> float:
        """All of them."""
        return self.runs * self.each


def parts(case: Case, runs: int, diagnosis: bool) -> tuple[Part, ...]:
    """Campaign, verification, bird models of the report and diagnosis, each by the estimate of `birdstrike check`."""
    own = _seconds(case)
    found = [
        Part("campaign", runs, own),
        Part("verification of both answers", VERIFICATIONS, own),
        Part("bird models of the report", STANDARD_BIRDS, own),
    ]
    if diagnosis:
        plan = make_plan(case)
        found += [
            Part("diagnosis: campaign", len(plan.campaign()), _seconds(plan.coarse)),
            Part("diagnosis: finer meshes", len(plan.meshes()) + len(plan.lattices()), _seconds(plan.fine)),
            *(
                Part(f"diagnosis: effects, {one.base.bird.particles} particles", 2 * len(one.signs), _seconds(one.base))
                for one in plan.blocks
            ),
            Part("diagnosis: before and after", FITS, own),
        ]
    return tuple(found)


def at_the_fits(case: Case) -> tuple[int, int, float]:
    """Least and most simulations that a diagnosis adds at its fits where an effect is likely, and seconds of each."""
    pairs = 2 * REPLICATES
    return pairs, UPDATES * MOST * pairs, max(_seconds(one.base) for one in make_plan(case).blocks)


def minutes(found: Iterable[Part], workers: int) -> float:
    """Minutes of wall time on so many idle cores, what is no simulation included."""
    return (sum(part.seconds for part in found) / workers + OTHER_S) / 60.0


def _seconds(case: Case) -> float:
    return float(estimate(case)["estimated_wall_s"] or 0.0)
