"""The statistics of a diagnosis on models whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from birdstrike.inversion.diagnosis.detectable import minimum_detectable, power
from birdstrike.inversion.diagnosis.linear import Linear
from birdstrike.inversion.diagnosis.statistics import Reference
from birdstrike.inversion.diagnosis.verdict import (
    AMBIGUOUS,
    ATTRIBUTED,
    NO_RESIDUAL,
    NONE,
    UNEXPLAINED,
    confidence_set,
    verdict,
)
from tests.inversion.diagnosis.toys import PARAMETERS, SIGNATURES, T, linear, records

NAMES = ("ringing", "late", "step")
COUNT = 800


def p_values(own: str | None, data: np.ndarray, names: tuple[str, ...] = NAMES) -> np.ndarray:
    """p of one model for many records (count, n)."""
    model = linear(own, data[0], names)
    rows = np.hstack([data, np.zeros((len(data), 2))])
    return Reference.of(model, draws=8000).p_values(model.project(rows.T).T)


def sets(data: np.ndarray, names: tuple[str, ...] = NAMES) -> list[tuple[str, ...]]:
    """Confidence set of every record."""
    p = {name: p_values(None if name == NONE else name, data, names) for name in (NONE, *names)}
    return [confidence_set({name: float(values[i]) for name, values in p.items()}, 0.05) for i in range(len(data))]


def test_false_alarms_come_at_the_stated_rate() -> None:
    clean = records(4000, np.zeros(len(T)))
    prior = np.random.default_rng(1).standard_normal((4000, 2))  # parameters drawn from their prior
    model = linear(None, clean[0])
    remainder = model.project(np.hstack([clean, prior]).T).T
    p = Reference.of(model, draws=20_000).p_values(remainder)
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=3.0 * np.sqrt(0.05 * 0.95 / 4000))
    assert np.mean(p < 0.5) == pytest.approx(0.5, abs=3.0 * np.sqrt(0.25 / 4000))


def test_the_omnibus_statistic_has_chi_square_law_and_its_degrees_of_freedom() -> None:
    reference = Reference.of(linear(None, np.zeros(len(T))), draws=20_000)
    assert reference.linear.freedom == len(T)  # n data and 2 prior rows less 2 parameters
    quantiles = np.quantile(reference.omnibus, [0.1, 0.5, 0.9])
    assert quantiles == pytest.approx(chi2.ppf([0.1, 0.5, 0.9], len(T)), rel=0.01)


def test_a_planted_effect_is_in_the_set_and_alone() -> None:
    model = linear(None, np.zeros(len(T)))
    size = 6.0 / model.sizes[NAMES.index("step")]
    found = sets(records(COUNT, size * SIGNATURES["step"]))
    assert np.mean(["step" in one for one in found]) > 0.93
    assert np.mean([verdict(one) == ATTRIBUTED for one in found]) > 0.8
    assert np.mean([verdict(one) == ATTRIBUTED and one != ("step",) for one in found]) < 0.05


def test_twins_are_ambiguous() -> None:
    names = ("ringing", "late", "echo")
    model = linear(None, np.zeros(len(T)), names)
    assert model.cosines()[0, 2] > 0.99
    found = sets(records(COUNT, 6.0 / model.sizes[0] * SIGNATURES["ringing"]), names)
    assert np.mean([verdict(one) == AMBIGUOUS and {"ringing", "echo"} <= set(one) for one in found]) > 0.85


def test_what_no_effect_explains_is_unexplained() -> None:
    strange = 1.2 * np.where((T > 0.45) & (T < 0.55), np.sin(60.0 * np.pi * T), 0.0) * 4.0
    found = sets(records(200, strange))
    assert np.mean([verdict(one) == UNEXPLAINED for one in found]) > 0.9


def test_nothing_planted_is_no_significant_residual() -> None:
    found = sets(records(COUNT, np.zeros(len(T))))
    assert np.mean([verdict(one) == NO_RESIDUAL for one in found]) == pytest.approx(0.95, abs=0.03)


def test_power_is_eighty_per_cent_at_the_minimum_detectable_magnitude() -> None:
    reference = Reference.of(linear(None, np.zeros(len(T))), draws=20_000)
    least = minimum_detectable(reference, 0.05)
    for j, name in enumerate(NAMES):
        p = p_values(None, records(1500, least[j] * SIGNATURES[name], seed=j))
        assert np.mean(p < 0.05) == pytest.approx(0.8, abs=0.04)
        assert power(reference, j, 4.0, 0.05) > 0.75  # the audit's gate is within reach of this statistic


def test_an_effect_that_the_parameters_imitate_is_skipped() -> None:
    hidden = np.vstack([PARAMETERS @ np.array([[0.4], [1.0]]), np.zeros((2, 1))])
    model = linear(None, np.zeros(len(T)))
    free = Linear(("hidden",), model.residual, np.vstack([PARAMETERS, np.zeros((2, 2))]), hidden, np.zeros(1, bool))
    assert not free.seen[0]
    assert np.isnan(minimum_detectable(Reference.of(free, draws=2000), 0.05)[0])


def test_a_noise_level_from_few_points_is_paid_for() -> None:
    clean = records(3000, np.zeros(len(T)))
    level = np.sqrt(np.random.default_rng(2).chisquare(30, 3000) / 30)[:, None]  # as 31 points would tell it
    model = linear(None, clean[0])
    prior = np.random.default_rng(1).standard_normal((3000, 2))
    remainder = model.project(np.hstack([clean, prior]).T).T / level
    honest = Reference.of(model, 30.0, draws=20_000).p_values(remainder)
    naive = Reference.of(model, draws=20_000).p_values(remainder)
    assert np.mean(honest < 0.05) == pytest.approx(0.05, abs=0.013)
    assert np.mean(naive < 0.05) > 0.1


def test_an_unknown_noise_level_does_not_matter_to_the_relative_statistic() -> None:
    noise = records(1000, np.zeros(len(T)))
    model = linear(None, noise[0])
    remainder = model.project(np.hstack([noise, np.zeros((1000, 2))]).T).T
    reference = Reference.of(model, relative=True, draws=4000)
    assert reference.p_values(3.0 * remainder) == pytest.approx(reference.p_values(remainder))


def test_a_one_sided_effect_held_at_zero_keeps_its_false_alarm_rate() -> None:
    """Of records without effect, those whose best b is negative leave the model with b = 0; its p must be uniform."""
    clean = np.hstack([records(6000, np.zeros(len(T))), np.random.default_rng(1).standard_normal((6000, 2))])
    free = replace(linear(None, clean[0, : len(T)]), one_sided=np.array([False, False, True]), held=2)
    remainder = free.project(clean.T).T
    score = remainder @ free.signatures[:, 2]
    bounded = remainder - np.maximum(score, 0.0)[:, None] * free.signatures[:, 2]
    p = Reference.of(free, draws=20_000).p_values(bounded)
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.01)
