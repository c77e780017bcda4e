"""Which effects are simulated anew, in which case and at which magnitude."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.conclusions.solver_update import _farther, _wanted, wanted_effects
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.linearisation import Linearisation, Places
from birdstrike.inversion.diagnosis.inference.system import learnt_error
from birdstrike.inversion.diagnosis.preparation.responses import LINEAR, Uncertainty
from birdstrike.inversion.results.diagnosis import NONE
from tests.inversion.diagnosis.inference.linear_system import models, singles
from tests.inversion.diagnosis.preparation.test_responses import response


def test_simulations_go_to_the_effects_that_could_be_likeliest() -> None:
    """An effect that has been simulated leads; another one, which its learnt signature holds back, comes first."""
    every: dict[str, Any] = dict(models())
    for m in every.values():
        for one in m.members:
            one.response = object()
            one.shots = ("shot",)
    best = {"e0": -100.0, "e1": -95.0, "e2": -103.0, "e3": -150.0, "e4": -99.0}
    ranking: Any = SimpleNamespace(
        models=every,
        singles=singles(every),
        shares={NONE: 0.01} | dict.fromkeys(best, 0.1),
        assessments={label: SimpleNamespace(at_best=value) for label, value in best.items()},
        evidence={
            NONE: SimpleNamespace(log_evidence=-130.0),
            **{label: SimpleNamespace(h=np.ones(1)) for label in best},
        },
        problem=SimpleNamespace(shots=[SimpleNamespace(name="shot", setup=SimpleNamespace(responses=best))]),
    )
    assert [label for label, _ in wanted_effects(ranking)] == ["e1", "e4", "e0", "e2"]


@pytest.mark.parametrize(("h", "wanted"), [(-1.0, ["speed@a", "speed@b"]), (1.0, ["speed@a"])])
def test_a_faster_bird_in_one_shot_and_a_slower_one_in_the_other_are_both_simulated(
    h: float, wanted: list[str]
) -> None:
    """The sense that was simulated led by 5.6 nats, which named the shot: -0.2 where it was the other one."""
    setup = SimpleNamespace(responses={"speed": object()})
    candidates = [
        CandidateEffect(f"speed@{shot}", "speed", "impact", (shot,), response=setup.responses["speed"])  # pyright: ignore[reportArgumentType]
        for shot in "ab"
    ]
    every = {one.label: Hypothesis(one.label, (one,), 0.1, "impact") for one in candidates}
    ranking: Any = SimpleNamespace(
        models=every,
        singles={label: one.members[0] for label, one in every.items()},
        shares={NONE: 0.01} | dict.fromkeys(every, 0.4),
        assessments={label: SimpleNamespace(at_best=-100.0) for label in every},
        evidence={
            NONE: SimpleNamespace(log_evidence=-130.0),
            "speed@a": SimpleNamespace(h=np.array([1.0])),
            "speed@b": SimpleNamespace(h=np.array([h])),
        },
        problem=SimpleNamespace(shots=[SimpleNamespace(name=shot, setup=setup) for shot in "ab"]),
    )
    assert [label for label, _ in wanted_effects(ranking)] == wanted
    ranking.problem.shots[1].setup = SimpleNamespace(responses=setup.responses)
    assert [label for label, _ in wanted_effects(ranking)] == ["speed@a", "speed@b"], "in another case it is anew"


def test_an_effect_of_the_rig_is_simulated_in_every_case_of_its_shots() -> None:
    """A clamp that bends the response was brought up to date in the first shot's case alone."""
    slow, fast = (SimpleNamespace(responses={"clamp": object()}) for _ in range(2))
    shots = [SimpleNamespace(name=name, setup=own) for name, own in (("a", slow), ("b", slow), ("c", fast))]
    clamp = CandidateEffect("clamp", "clamp", "support", ("a", "b", "c"), response=slow.responses["clamp"])  # pyright: ignore[reportArgumentType]
    every = {"clamp": Hypothesis("clamp", (clamp,), 0.1, "support")}
    ranking: Any = SimpleNamespace(
        models=every,
        singles={"clamp": clamp},
        shares={NONE: 0.01, "clamp": 0.9},
        assessments={"clamp": SimpleNamespace(at_best=-100.0)},
        evidence={NONE: SimpleNamespace(log_evidence=-130.0), "clamp": SimpleNamespace(h=np.ones(1))},
        problem=SimpleNamespace(shots=shots),
    )
    assert [(label, shot.name) for label, shot in wanted_effects(ranking)] == [("clamp", "a"), ("clamp", "c")]


def in_two_cases() -> tuple[CandidateEffect, list[Any]]:
    """A clamp with a shot of each of two cases: at 2 plausible sizes one answers with 1.5, the other with 0.5."""
    effect = SimpleNamespace(level=2.0)
    known: Any = SimpleNamespace(effect=effect, one_sided=True, least=0.0, name="clamp", size=1.0)
    first, other = (
        replace(
            response(k * np.ones(4), knots=((-5.0, -5.0), (0.0, 0.0), (2.0, h), (5.0, 2.0 * h))),
            known=known,
            simulated=(2.0,),
        )
        for k, h in ((1.0, 1.5), (3.0, 0.5))
    )
    setups = [SimpleNamespace(responses={"clamp": own}, lows=np.zeros(1), highs=np.ones(1)) for own in (first, other)]
    shots: list[Any] = [
        SimpleNamespace(name=name, setup=setup, sample=lambda rows: rows)
        for name, setup in zip("ab", setups, strict=True)
    ]
    return CandidateEffect("clamp", "clamp", "support", ("a", "b"), response=first), shots


def test_in_another_case_an_effect_has_the_size_that_its_response_there_has() -> None:
    one, shots = in_two_cases()
    changes = [1.5 * one.change_in(shot, np.zeros(1), 1.5) for shot in shots]
    np.testing.assert_allclose(changes[0], 1.5)
    np.testing.assert_allclose(changes[1], 0.5 * 3.0)


def test_where_an_effect_is_not_it_has_in_another_case_the_size_of_a_small_one() -> None:
    """It had that of the first case there: a model that is judged about the fit without it was another than its own."""
    one, shots = in_two_cases()
    assert [one.response_in(shot, 0.0)[1] for shot in shots] == pytest.approx([1.0, 0.5 / 1.5])


@pytest.mark.parametrize(("h", "b"), [(0.9, 2.0), (1.5, 4.0), (1.8, 8.0)])
def test_an_effect_is_simulated_in_another_case_at_the_magnitude_of_the_fit(h: float, b: float) -> None:
    """The size in the first case was read off the other one's response: 8 and 20 plausible sizes for 2 and 4."""
    one, shots = in_two_cases()
    places = SimpleNamespace(z={shot.name: np.full(1, 0.5) for shot in shots})
    ranking: Any = SimpleNamespace(
        models={"clamp": Hypothesis("clamp", (one,), 0.1, "support")},
        evidence={"clamp": SimpleNamespace(h=np.array([h]))},
        fits={NONE: SimpleNamespace(places=places)},
    )
    assert [_wanted(ranking, "clamp", shot).b for shot in shots] == [b, b]


def test_responses_of_two_cases_are_learnt_apart_and_those_of_one_case_together() -> None:
    """Errors were paired by their number: runs' scatter in one case was shared with an error of the other's."""
    one, (first, other) = in_two_cases()
    own, scattered = one.response, np.array([[0.2, 0.0], [0.0, 0.0]])[:, :, None] ** 2
    assert own is not None
    beside = Uncertainty(np.array([[0.3, -0.3, 0.3, -0.3]]), own.uncertainties[0].spread)
    wider = replace(own, uncertainties=(*own.uncertainties, beside), scatter=scattered)
    record = SimpleNamespace(values=np.zeros(4), channel=np.zeros(4, dtype=int))
    for shot, learnt in ((first, replace(own, scatter=scattered)), (other, wider)):
        shot.record, shot.baseline, shot.scatter, shot.channels = record, False, np.eye(4), ("c",)
        shot.setup = SimpleNamespace(responses={"clamp": learnt}, channels=("c",))
    places = Places({"a": np.zeros(1), "b": np.zeros(1)}, {})
    errors = learnt_error(one, Linearisation((first, other), places), np.ones(8))
    assert not (errors[:4] @ errors[4:].T).any()
    other.setup = first.setup
    errors = learnt_error(one, Linearisation((first, other), places), np.ones(8))
    np.testing.assert_allclose(errors[:4] @ errors[4:].T, 0.1**2 + 0.2**2 * np.eye(4))


def test_beyond_a_fit_on_a_response_that_bends_the_next_simulation_shows_how_it_goes_on() -> None:
    old = response(np.ones(4), knots=((-5.0, -5.0), (0.0, 0.0), (2.0, 1.5), (5.0, 3.2)))
    old = replace(old, known=SimpleNamespace(one_sided=False))  # pyright: ignore[reportArgumentType]
    bent, straight = (replace(old, simulated=(2.0,), knots=k) for k in (old.knots, LINEAR))
    assert _farther(bent, 1.5) == pytest.approx(4.0)
    assert _farther(bent, 1.6) == pytest.approx(8.0)
    assert _farther(bent, 1.0) == _farther(straight, 2.0) == _farther(old, 1.5) == 0.0
    mirrored = replace(bent, simulated=(-2.0,), knots=((-5.0, -3.2), (-2.0, -1.5), (0.0, 0.0), (5.0, 5.0)))
    assert [_farther(mirrored, h) for h in (-1.5, -1.6, -1.0, 1.6)] == pytest.approx([-4.0, -8.0, 0.0, 0.0])
