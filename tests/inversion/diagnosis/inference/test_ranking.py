"""Models compared where they lie best; what a ranking says of effects and birds."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.inference.evidence import Evidence
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.ranking import Assessment, Fit, Ranking, refit_pairs
from birdstrike.inversion.results.diagnosis import NONE
from tests.inversion.diagnosis.inference.linear_system import Stub


class Refits:
    """A problem in which a refit changes the evidence of pairs: label -> gain; `asked`: in which order."""

    def __init__(self, gains: dict[str, float], before: dict[str, Evidence]) -> None:
        self.gains, self.before, self.asked = gains, before, list[str]()

    def refit(self, model: Hypothesis, start: Places, steps: int) -> Fit:
        assert steps > 0
        self.asked.append(model.label)
        one = self.before[model.label]
        return Fit(start, None, None, replace(one, log_evidence=one.log_evidence + self.gains[model.label]))  # pyright: ignore[reportArgumentType]


def test_the_likeliest_pair_is_compared_where_it_lies_best_itself() -> None:
    """Refitted, the first of three pairs loses 6 nats; the second, which then leads, gains 1; the third is far off."""
    members = {name: Stub(name) for name in ("a", "b", "c", "d")}
    pairs = {"a+b": 10.0, "a+c": 9.0, "a+d": 1.0}
    tried = {label: Hypothesis(label, tuple(members[m] for m in label.split("+")), 0.01, "pairs") for label in pairs}  # pyright: ignore[reportArgumentType]
    singles = {name: Hypothesis(name, (one,), 0.5, "f") for name, one in members.items()}  # pyright: ignore[reportArgumentType]
    none = np.zeros(0)
    blank = Evidence(singles["a"], 5.0, np.zeros(2), np.eye(2), np.eye(2), none, none, none, {}, 1.0)
    fit = Fit(Places({"shots": np.zeros(1)}, {}), None, None, blank)  # pyright: ignore[reportArgumentType]
    found = {name: Assessment(replace(blank, hypothesis=one, log_evidence=0.0), fit) for name, one in singles.items()}
    found["a"] = Assessment.refitted(fit)
    found |= {n: Assessment(replace(blank, hypothesis=tried[n], log_evidence=pairs[n]), fit) for n in pairs}
    problem = Refits({"a+b": -6.0, "a+c": 1.0, "a+d": 50.0}, {n: one.evidence for n, one in found.items()})
    refitted = refit_pairs(problem, list(tried.values()), found)  # pyright: ignore[reportArgumentType]
    assert problem.asked == ["a+b", "a+c"]
    assert {name: one.evidence.log_evidence for name, one in refitted.items()} == {"a+b": 4.0, "a+c": 10.0}
    assert all(one.own and one.fit.evidence is one.evidence for one in refitted.values())


SCORES = {"speed": 11.0, "speed+gain": 12.0, "mass": 4.0, "gain": 6.0, "clock": 9.0, "mass+gain": 8.0}


@pytest.mark.parametrize(("label", "ahead"), [("speed", 3.0), ("gain", -1.0)])
def test_lead_over_other_effects_counts_models_that_hang_on_simulations(label: str, ahead: float) -> None:
    """The clock's exact signature is no rival of the gain's, but one of the speed's."""
    effects = {
        name: SimpleNamespace(label=name, response=name in ("speed", "mass")) for name in SCORES if "+" not in name
    }
    scores = SCORES | ({"speed": 13.0} if label == "gain" else {})
    models: Any = {name: SimpleNamespace(members=[effects[one] for one in name.split("+")]) for name in scores}
    assessments: Any = {name: SimpleNamespace(score=score) for name, score in scores.items()}
    problem: Any = None
    assert Ranking(problem, models, assessments).ahead(label) == ahead


def test_an_effect_is_there_alone_or_in_any_pair() -> None:
    """Four models that explain the record alike have their priors' shares: 0.25 alone and 0.2 in a pair are 0.45."""
    priors = {NONE: 0.45, "speed": 0.25, "gain": 0.1, "speed+gain": 0.2}
    models: Any = {
        name: SimpleNamespace(prior=prior, members=[Stub(one) for one in name.split("+") if one != NONE])
        for name, prior in priors.items()
    }
    assessments: Any = {
        name: SimpleNamespace(evidence=SimpleNamespace(log_evidence=3.0, hypothesis=model))
        for name, model in models.items()
    }
    nothing: Any = None
    assert Ranking(nothing, models, assessments).presence == pytest.approx({NONE: 0.45, "speed": 0.45, "gain": 0.3})


@pytest.mark.parametrize(("gained", "same"), [(0.0, 2.0 / 1002.0), (400.0, 2.0 / (2.0 + 1000.0**0.2))])
def test_beside_an_effect_that_explains_very_much_the_birds_are_less_sure(gained: float, same: float) -> None:
    """Three equal shares, another bird a thousand times likelier: an effect of 400 nats leaves a fifth of the log."""
    found = {NONE: -gained, "speed": 0.0} if gained else {NONE: 0.0}
    evidence = {n: SimpleNamespace(log_evidence=e, hypothesis=SimpleNamespace(prior=0.5)) for n, e in found.items()}
    birds = np.array([0.0, 0.0, np.log(1000.0)])
    assessments: Any = {n: SimpleNamespace(evidence=one, by_bird=birds) for n, one in evidence.items()}
    nothing: Any = None
    assert Ranking(nothing, nothing, assessments).same_bird == pytest.approx(same)
