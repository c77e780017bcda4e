"""The sentence of the answer: which of two opposites a magnitude means, and what no alarm leaves open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.stats import norm

from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis.conclusions import answer
from birdstrike.inversion.diagnosis.conclusions.answer import (
    _meaning,
    consistency,
    outside_ranges,
    parameters,
    reaches_limit,
)
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.preparation.plan import library
from birdstrike.inversion.diagnosis.preparation.responses import Response
from birdstrike.inversion.diagnosis.preparation.shots import instrument_effects
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.results.diagnosis import AMBIGUOUS, ATTRIBUTED, NO_RESIDUAL, UNEXPLAINED, EffectFigures
from birdstrike.inversion.results.diagnosis_text import OPPOSITES, in_its_sense, magnitude_words, next_step, sentence_of
from birdstrike.reports.sections.diagnosis import magnitude
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.effects.registry import effects
from tests.diagnoses import diagnosis, effect


def _late(case: Case) -> float:
    own = case.instrument.get("displacement_centre")
    return own.time_offset if own else 0.0


FIRST: dict[str, tuple[str, str, Callable[[Case], float]]] = {
    "impact_speed": ("faster", "slower", lambda case: case.impact.speed),
    "plate_thickness": ("thicker", "thinner", lambda case: case.plate.thickness),
    "plate_density": ("heavier", "lighter", lambda case: case.plate.material.density),
    "plate_preload": ("tension", "compression", lambda case: case.plate.preload[0]),
    "bird_mass": ("heavier", "lighter", lambda case: case.bird.actual_mass),
    "bird_length": ("longer", "shorter", lambda case: case.bird.length),
    "time_offset": ("late", "early", _late),
}
"""Effect -> the words for a positive and a negative magnitude, and what of the case grows with it."""


def figures(name: str, interval: tuple[float, float] | None) -> EffectFigures:
    """Of an effect with an interval; the rest does not matter here."""
    middle = None if interval is None else 0.5 * sum(interval)
    return effect(name, middle, meaning=effects()[name].meaning, interval_95=interval)


@pytest.mark.parametrize("name", FIRST)
def test_the_word_for_a_positive_magnitude_is_the_one_that_the_case_then_shows(name: str) -> None:
    more, less, quantity = FIRST[name]
    case = load_case("virtual_strike")
    assert quantity(case.with_effects({name: effects()[name].size(case)}).resolved()) > quantity(case)
    assert more in in_its_sense(figures(name, (0.1, 0.2)))
    assert less not in in_its_sense(figures(name, (0.1, 0.2)))
    assert less in in_its_sense(figures(name, (-0.2, -0.1)))
    assert more not in in_its_sense(figures(name, (-0.2, -0.1)))


def test_an_interval_with_both_signs_names_both_and_one_meaning_stays() -> None:
    assert "faster or slower" in in_its_sense(figures("impact_speed", (-0.1, 0.2)))
    assert in_its_sense(figures("bird_porosity", (0.01, 0.02))) == "air in the bird"


def test_no_other_effect_has_two_opposites_in_its_meaning() -> None:
    found = {name for name, one in effects().items() if OPPOSITES.search(one.meaning)}
    assert found == {*FIRST, "rivet_strength"}


@pytest.mark.parametrize(
    ("interval", "words"),
    [
        ((2e-4, 3e-4), "+0.3 mm or beyond, the largest looked at (95 %: above +0.2 mm)"),
        ((-3e-4, -2e-4), "-0.3 mm or beyond, the largest looked at (95 %: below -0.2 mm)"),
        ((-1e-5, 3e-4), "+0.3 mm or beyond, the largest looked at (95 %: above -0.01 mm)"),
        ((0.0, 3e-4), "+0.3 mm or beyond, the largest looked at (95 %: above 0 mm)"),
    ],
)
def test_at_the_largest_looked_at_that_end_and_the_one_that_is_known_are_told_apart(
    interval: tuple[float, float], words: str
) -> None:
    """ "beyond +0.2 mm", its lower 95 % end, stood beside "at least as large as the largest looked at", 0.3 mm."""
    size = max(interval, key=abs)
    at_bound = replace(figures("plate_thickness", interval), magnitude=size, at_bound=True, unit="m")
    assert magnitude_words(at_bound) == words
    assert magnitude(at_bound) == words


@pytest.mark.parametrize(
    ("h", "interval", "limits", "reached"),
    [
        (-4.12, (-4.12, -3.1), (-4.12, 5.0), True),
        (4.12, (3.1, 4.3), (-4.12, 5.0), False),
        (4.9, (3.1, 5.0), (-4.12, 5.0), True),
        (-4.9, (-5.0, -4.0), (-5.0, 5.0), True),
        (-2.0, (-5.0, -1.0), (-5.0, 5.0), False),
        (0.0, (0.0, 1.0), (0.0, 5.0), False),
        (-1.0, (-1.0, -0.7), (-np.inf, 5.0), False),
        (4.9, (3.1, 5.0), (-np.inf, 5.0), True),
    ],
)
def test_the_largest_looked_at_is_that_of_its_own_side(
    h: float, interval: tuple[float, float], limits: tuple[float, float], reached: bool
) -> None:
    """A bird 8.5 m/s slower, the least looked at, was told with 95 % in -8.5 .. -6.08 m/s; it was 15 m/s slower: its
    response bends, so that -8.5 m/s is of size -4.12 and +8.5 m/s of size 5."""
    assert reaches_limit(h, interval, limits) is reached


def candidate(label: str, case: Case) -> CandidateEffect:
    """An effect of the solver, or a fault of an instrument."""
    for known in library(case, case)[0]:
        if known.name == label:
            none = np.zeros((1, 1))
            response = Response(known, none[0], none, none[0], (), np.zeros((2, 2, 1)))
            return CandidateEffect(label, label, "plate", ("shot",), response)
    fault = next(one for one in instrument_effects(case, tuple(case.sensors)) if one.label == label)
    return CandidateEffect(label, fault.effect.name, "instrument", ("shot",), fault=fault)


@pytest.mark.parametrize(
    ("label", "ends"),
    [
        ("clamp_rotation", True),
        ("bird_friction", True),
        ("plate_thickness", False),
        ("impact_speed", False),
        ("sensor_gain", True),
        ("sensor_bandwidth", True),
        ("time_offset", False),
        ("sensor_drift.displacement_centre", False),
    ],
)
def test_where_nothing_lies_beyond_the_search_has_not_ended_at_its_limit(label: str, ends: bool) -> None:
    """Springs of 75 kN m/rad per m that were rigid were told to be beyond rigid, 40 % of friction as at least that."""
    case = load_case("virtual_strike", {"plate.edges": '{ rotational = "5e5 N m/rad/m" }', "impact.friction": 0.1})
    one = candidate(label, case)
    (low, high), sought = one.limits, one.search_limits
    assert sought == (-np.inf if ends else low, high)
    reached = reaches_limit(low, (low, 0.5 * low), sought)
    assert reached is not (ends or one.one_sided)


def test_a_gain_is_looked_for_from_that_of_a_dead_sensor_to_twice_its_own() -> None:
    """-30 % was the least: a dead sensor left 70 % of its curve, and was attributed all the same."""
    one = candidate("sensor_gain.displacement_centre", load_case("virtual_strike"))
    assert [one.magnitude(h) for h in one.limits] == pytest.approx([-0.99, 1.0])


@pytest.mark.parametrize(("sd", "known"), [(0.10, True), (0.13, False)])
def test_a_parameter_is_identified_by_the_inversions_rule(
    sd: float, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interval 3.92 sd against half of 0.876, the width of the prior of a range with its ends cut off."""
    monkeypatch.setattr(answer, "estimate", lambda *_: (np.array([0.5]), None))
    found = parameters(fitted(0.5, sd), shot_of(NormalPrior.of_ranges(1)), NO_MODEL)["MU"]
    assert found["identified"] is known
    interval = (100.0 + 900.0 * (0.5 - 1.96 * sd), 100.0 + 900.0 * (0.5 + 1.96 * sd))
    assert found["interval_95"] == pytest.approx(interval if known else (100.0, 1000.0), rel=1e-3)


NO_MODEL: Any = None


def shot_of(prior: NormalPrior) -> Any:
    """One parameter between 100 and 1000 Pa s."""
    space = ParameterSpace(("MU",), ("Pa s",), np.array([100.0]), np.array([1000.0]), ("",))
    return SimpleNamespace(name="a", setup=SimpleNamespace(plan=SimpleNamespace(space=space, prior=prior)))


def fitted(mean: float, sd: float) -> Any:
    """A fit with this posterior of the parameter, in fractions of its range."""
    return SimpleNamespace(interval=lambda *_: (np.array([mean]), np.array([sd])))


@pytest.mark.parametrize(("mean", "sd"), [(0.02, 0.05), (0.0, 0.1), (0.95, 0.04), (0.5, 0.02)])
def test_a_parameter_s_interval_is_that_of_the_posterior_cut_off_at_its_range(
    mean: float, sd: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answer, "estimate", lambda *_: (np.array([mean]), None))
    found = parameters(fitted(mean, sd), shot_of(NormalPrior.of_ranges(1)), NO_MODEL)["MU"]
    z = np.linspace(0.0, 1.0, 100_001)
    mass = cumulative_trapezoid(norm.pdf(z, mean, sd), z, initial=0.0)
    low, high = np.interp([0.025, 0.975], mass / mass[-1], z)
    expected = (100.0 + 900.0 * min(low, mean), 100.0 + 900.0 * high)
    assert found["identified"] is True
    assert found["interval_95"] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(("mean", "sd"), [(-0.3, 0.05), (1.2, 0.01), (-40.0, 0.01)])
def test_what_lies_outside_its_range_is_not_identified_and_told(
    mean: float, sd: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was called identified, with a value of 127 Pa s and an interval from 100 to 100."""
    shot = shot_of(NormalPrior.of_ranges(1))
    monkeypatch.setattr(answer, "estimate", lambda *_: (np.array([0.03]), None))
    found = parameters(fitted(mean, sd), shot, NO_MODEL)["MU"]
    assert found["identified"] is False
    assert found["value"] == pytest.approx(127.0)
    assert found["interval_95"] == (100.0, 1000.0)
    ranking: Any = SimpleNamespace(fits={"e": fitted(mean, sd)})
    (line,) = outside_ranges(shot, ranking, "e")
    assert line.startswith("a: MU of ")
    assert "outside its range (100 .. 1000 Pa s): it is not identified" in line
    ranking.fits["e"] = fitted(0.0, 0.1)
    assert not outside_ranges(shot, ranking, "e")


def test_beside_a_stated_prior_what_is_not_identified_keeps_its_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    prior = NormalPrior(np.array([0.5]), np.array([0.1]), np.array([True]))
    monkeypatch.setattr(answer, "estimate", lambda *_: (np.array([0.5]), None))
    found = parameters(fitted(0.5, 0.09), shot_of(prior), NO_MODEL)["MU"]
    assert found["identified"] is False
    assert found["interval_95"] == pytest.approx((550.0 - 900.0 * 0.1764, 550.0 + 900.0 * 0.1764), rel=1e-4)


@pytest.mark.parametrize(("behind", "figure"), [(0.0, 1.0), (2.0, 0.0455), (4.5, 0.0027), (50.0, 1e-4)])
def test_p_consistent_is_the_difference_of_the_log_evidences_and_nothing_else(behind: float, figure: float) -> None:
    """2 Phi(-sqrt(2 d)), as docs/file-formats.md says; the best model has 1."""
    assert consistency(-3.0 - behind, -3.0) == pytest.approx(figure, rel=2e-3)


def test_a_magnitude_has_its_digits_and_none_is_plainly_0() -> None:
    """ "+0 mm" and "+5.48e+03 MPa" were neither."""
    one = replace(figures("plate_modulus", (0.0, 1.096e10)), unit="Pa")
    assert magnitude_words(one) == "+5480 MPa (95 %: 0 .. +11000 MPa)"
    assert magnitude(one) == "+5480 MPa (0 to +11000 MPa)"
    small = replace(figures("sensor_bandwidth", (0.0, 3.28e-8)), unit="s", magnitude=7.7e-10)
    assert magnitude_words(small) == "+7.7e-07 ms (95 %: 0 .. +0.0000328 ms)"


@pytest.mark.parametrize(
    ("label", "words"),
    [("sensor_gain.cell_2", "a sensor with another gain: cell 2 alone"), ("sensor_gain", "a displacement transducer")],
)
def test_a_fault_of_a_force_cell_is_not_one_of_a_displacement_transducer(label: str, words: str) -> None:
    assert _meaning(label, "sensor_gain").startswith(words)


@pytest.mark.parametrize(
    ("verdict", "proposal", "baseline", "begins"),
    [
        (ATTRIBUTED, None, True, "check at the rig: plate thickness; repeat"),
        (AMBIGUOUS, "add one more sensor", True, "add one more sensor"),
        (AMBIGUOUS, None, False, "fire a shot in which nothing is changed"),
        (UNEXPLAINED, None, False, "fire a shot in which nothing is changed"),
        (UNEXPLAINED, None, True, "look for what the case does not describe"),
        (NO_RESIDUAL, "add one more sensor", False, "if an effect is suspected, fire a shot"),
        (NO_RESIDUAL, None, True, "nothing; "),
    ],
)
def test_every_verdict_says_what_to_do(verdict: str, proposal: str | None, baseline: bool, begins: str) -> None:
    measurement = {"sentence": proposal} if proposal else None
    found = diagnosis(
        effect("plate_thickness"), verdict=verdict, next_measurement=measurement, baseline={} if baseline else None
    )
    assert next_step(found).startswith(begins)


@pytest.mark.parametrize(
    ("shares", "baseline", "end"),
    [
        ({"none": 0.6, "plate_thickness": 0.4}, None, "no effect is missing that this record could show"),
        (
            {"plate_thickness": 0.7, "none": 0.3},
            None,
            "if its error is smaller, plate thickness +0.2 mm (95 %: +0.1 .. +0.3 mm) (0.70) is likelier than no "
            "missing effect: a baseline shot would decide",
        ),
        (
            {"bird_mass+bird_length": 0.7, "none": 0.3},
            {},
            "if its error is smaller, bird mass with bird length (0.70) is likelier than no missing effect: "
            "this record cannot decide",
        ),
    ],
)
def test_a_record_without_alarm_names_what_is_likelier_than_none(
    shares: dict[str, float], baseline: dict[str, Any] | None, end: str
) -> None:
    """An unknown model error keeps the alarm silent; the page's bars show the effect, and the sentence does too."""
    found = diagnosis(
        replace(figures("plate_thickness", (1e-4, 3e-4)), unit="m"),
        effect("none"),
        verdict=NO_RESIDUAL,
        alarm=0.41,
        required_discrepancy={"none": 0.02},
        confidence_set=tuple(shares),
        probabilities=shares,
        baseline=baseline,
    )
    start = "The calibrated model explains the record (p = 0.41) with a model error of 2 % of the peak; "
    assert sentence_of(found) == start + end


def test_an_effect_that_all_likely_models_have_is_told_as_such() -> None:
    """A speed that was certain stood as 0.51 beside its pairs, as if the record left its presence open."""
    shares = {"impact_speed": 0.51, "edge_slip+impact_speed": 0.46}
    one = replace(figures("impact_speed", (3.5, 5.6)), probability=0.97)
    found = diagnosis(
        one,
        verdict=AMBIGUOUS,
        alarm=0.0005,
        required_discrepancy={"none": 0.011},
        confidence_set=tuple(shares),
        probabilities=shares,
    )
    assert sentence_of(found).endswith("; together the models with impact speed hold 0.97")
    assert "together" not in sentence_of(replace(found, effects=(replace(one, probability=0.6),)))
    named = replace(
        found,
        confidence_set=("sensor_gain.displacement_centre",),
        effects=(replace(one, name="sensor_gain.displacement_centre"),),
    )
    assert "_" not in sentence_of(named), "names of formats stand in diagnosis.json, words in its sentence"


@pytest.mark.parametrize(("rest", "said"), [(1, "1 further model shares"), (2, "2 further models share")])
def test_models_beyond_the_named_ones_are_counted(rest: int, said: str) -> None:
    others = ("bird_mass", "bird_length", "edge_slip", "plate_density")[: 2 + rest]
    names = ("impact_speed", *(f"impact_speed+{other}" for other in others))
    shares = dict.fromkeys(names, 0.19)
    found = diagnosis(
        replace(figures("impact_speed", (3.5, 5.6)), probability=0.2),
        verdict=AMBIGUOUS,
        alarm=0.0005,
        required_discrepancy={"none": 0.011},
        confidence_set=names,
        probabilities=shares,
    )
    assert sentence_of(found).endswith(f"; {said} the 95 % set")


@pytest.mark.parametrize(
    ("same_bird", "start"),
    [
        (0.9, "The residual is real (p = 0.0005); "),
        (
            0.001,
            "The residual (p = 0.0005) is real, or model error that changes with the bird, since the baseline's is "
            "another one; ",
        ),
    ],
)
def test_beside_another_bird_s_baseline_an_alarm_may_be_model_error(same_bird: float, start: str) -> None:
    """A clean record of another code was called real beside its other clean record, whose bird was another one."""
    shares = {"plate_damping": 0.48, "plate_density+plate_damping": 0.44}
    found = diagnosis(
        replace(figures("plate_damping", (110.0, 280.0)), probability=0.5),
        verdict=AMBIGUOUS,
        alarm=0.0005,
        required_discrepancy={"none": 0.0033},
        confidence_set=tuple(shares),
        probabilities=shares,
        baseline={"shots": ["clean2"], "same_bird": same_bird},
    )
    assert sentence_of(found).startswith(start)
