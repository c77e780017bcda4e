"""Whether the birds of all shots are of one recipe: what was stated, what the records say, and what follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from birdstrike.inversion.diagnosis.inference.bird_scatter import AUTO, BIRDS, CONTRADICTED
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.results.diagnosis import of_another_bird


@dataclass(frozen=True)
class Birds:
    """What is known of the birds.

    stated: one of `BIRDS`, or `auto`; several: whether there are shots whose birds may differ, baselines included.
    """

    ranking: Ranking
    stated: str
    several: bool

    @property
    def contradicted(self) -> bool:
        """Whether the records make what is stated of the birds unlikely."""
        return self.several and self.stated != AUTO and self.ranking.birds[self.stated] < CONTRADICTED

    @property
    def same(self) -> float | None:
        """Probability that the birds of all shots, baselines included, are one; None of a single shot.

        0 where the records contradict what was stated of them: an answer on a wrong premise attributes nothing.
        """
        if not self.several:
            return None
        return 0.0 if self.contradicted else self.ranking.same_bird

    @property
    def figures(self) -> dict[str, Any]:
        """`baseline.bird` of diagnosis.json."""
        return {"stated": self.stated, "records": self.ranking.birds, "contradicted": self.contradicted}

    @property
    def warnings(self) -> list[str]:
        """Where the birds are not what was stated, or not one, so that nothing is attributed."""
        stated = self.stated
        if not self.several:
            if stated == AUTO:
                return []
            return [
                f"the birds are stated to be alike or not ({stated}), but there is a single shot: the statement has no "
                "effect; pass the record of the clean shot with --baseline"
            ]
        if self.contradicted:
            birds = self.ranking.birds
            likeliest = max(BIRDS, key=lambda name: birds[name])
            return [
                f"the records contradict what was stated of the birds ({stated}: probability {birds[stated]:.2g}; "
                f"{likeliest}: {birds[likeliest]:.2f}): the effects rest on a wrong premise, so that none is "
                "attributed; check the birds of all shots, or leave --baseline-bird at auto"
            ]
        if not of_another_bird(self.same):
            return []
        known = "as stated" if stated != AUTO else f"probability that they are: {self.ranking.same_bird:.2g}"
        return [
            f"the birds of the shots and baselines are not of one recipe ({known}): model error changes with the bird "
            "and may be taken for an effect, so that an alarm means little and none is attributed; fire a baseline "
            "with a bird of the shot's own recipe"
        ]
