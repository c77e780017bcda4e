"""Whether a campaign's design can tell the parameters apart at all, asked before anything is fitted."""

from __future__ import annotations

from dataclasses import dataclass

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.doe.designs.quality import design_quality


class DesignError(UserError):
    """A design that varies fewer independent directions than there are parameters."""


@dataclass(frozen=True)
class DesignFigures:
    """What a design can tell apart.

    rank: independent directions of the centred, scaled design; discrepancy: squared centred L2; max_correlation:
    largest of two columns; parameters: how many are sought; finding: the directions in words.
    """

    rank: int
    discrepancy: float | None
    max_correlation: float | None
    parameters: int
    finding: str

    @property
    def deficient(self) -> bool:
        """True when separate estimates of all parameters cannot be had."""
        return self.rank < self.parameters

    @property
    def sentence(self) -> str:
        """What a deficient design carries."""
        directions = "1 direction" if self.rank == 1 else f"{self.rank} directions"
        return f"the design carries {directions}, not {self.parameters}"


def design_figures(dataset: Dataset) -> DesignFigures:
    """Quality of the runs that finished and stayed smooth, those that the emulator rests on."""
    found = design_quality(dataset.scaled()[dataset.smooth], dataset.names)
    return DesignFigures(found.rank, found.discrepancy, found.max_correlation, found.parameters, found.sentence)


def refuse_deficient(design: DesignFigures, allowed: bool) -> None:
    """Raise DesignError where separate values would be invented; `allowed`: what the design carries will do."""
    if not design.deficient or (allowed and design.rank > 0):
        return
    remedy = "" if design.rank == 0 else "; --allow-rank-deficient gives the combination that is carried instead"
    raise DesignError(f"{design.sentence}: {design.finding}{remedy}")
