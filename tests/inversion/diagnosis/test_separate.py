"""The next measurement, on analytic derivatives: which candidate is proposed, and the chance that theory gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.groundwork import CENTRE, Groundwork
from birdstrike.inversion.diagnosis.record import Record, Trace
from birdstrike.inversion.diagnosis.rivals import Shot, chance
from birdstrike.inversion.diagnosis.sensitivities import Sensitivities, sensitivities
from birdstrike.inversion.diagnosis.separate import Bench, propose, rank
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.observations.noise import Noise
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.displacement import Displacement
from tests.inversion.diagnosis import toy_study

CLOCK = np.linspace(0.0, 1.0, 801)
TIMES = CLOCK[::8]
"""The record has an eighth of the clock's instants."""
NOISE, SMALL = 0.2, 0.05
SINE, COSINE = np.sin(2.0 * np.pi * CLOCK), np.cos(2.0 * np.pi * CLOCK)
SIZES = {"a": 1.0, "b": 1.0}
Toy = Mapping[str, tuple[Array, Array]]
SENSORS = {name: Displacement() for name in ("own", "telling", "deaf")}
TWINS: Toy = {"own": (SINE, SINE), "telling": (SMALL * SINE, SMALL * COSINE)}


def found(toy: Toy, more: Mapping[str, Mapping[str, Array]] | None = None) -> Sensitivities:
    """Derivatives of effects a and b per channel; more: of further effects, zero where not given."""
    effects = {name: np.stack([pair[i] for pair in toy.values()]) for i, name in enumerate("ab")}
    for name, own in (more or {}).items():
        effects[name] = np.stack([own.get(c, 0.0 * CLOCK) for c in toy])
    curves = np.ones((len(toy), len(CLOCK)))
    doubts = {name: 0.0 * y for name, y in effects.items()}
    return Sensitivities(CLOCK, tuple(toy), curves, np.zeros((0, len(toy), len(CLOCK))), effects, doubts)


def record(correlation_time: float = 0.0) -> Record:
    noise = Noise(np.full(len(TIMES), NOISE), correlation_time, "stated")
    return Record((Trace("own", "m", TIMES, 1, 0.0 * TIMES, noise, 1.0),), ())


def bench(here: Sensitivities, **other: Any) -> Bench:
    def exact(r: Record) -> Array:
        return np.zeros((len(r.values), len(r.values)))

    parts: dict[str, Any] = {"numerical": exact, "nuisances": {}, "sizes": SIZES, "sensors": SENSORS}
    return Bench(**{"record": record(), "here": here, **parts, **other})


def stands(noncentrality: float, alpha: float = 0.05) -> float:
    """Chance that a chi-square test with one degree of freedom does not reject."""
    return float(ncx2.cdf(chi2.isf(alpha, 1), 1, noncentrality))


def power(*curves: Array) -> list[float]:
    """|g|^2 of curves on the record's points in units of the noise."""
    return [float((curve[::8] ** 2).sum()) / NOISE**2 for curve in curves]


def orthogonal_given_common() -> float:
    """|P_b g_a|^2 of twins on one channel, S, that are orthogonal and of one size, U, on another."""
    s, u, v, cross = *power(SINE, SMALL * SINE, SMALL * COSINE), float((SMALL**2 * SINE * COSINE)[::8].sum()) / NOISE**2
    return s + u - (s + cross) ** 2 / (s + v)


@pytest.mark.parametrize("alpha", [0.05, 0.2])
def test_the_channel_on_which_twins_differ_is_proposed_with_the_chance_of_theory(alpha: float) -> None:
    toy = {**TWINS, "deaf": (0.0 * CLOCK, 0.0 * CLOCK)}
    best = rank(bench(found(toy), alpha=alpha))
    assert best is not None
    assert best.channel == "telling"
    assert best.worthwhile
    assert best.ambiguous_now == pytest.approx(1.0 - alpha)
    assert best.ambiguous == pytest.approx(stands(orthogonal_given_common(), alpha), rel=0.02)
    assert 0.05 < best.ambiguous < 0.9
    assert [one["channel"] for one in best.candidates] == ["telling", "deaf"]
    assert best.candidates[1]["ambiguous"] == pytest.approx(1.0 - alpha)


def test_a_channel_too_noisy_to_help_is_not_proposed() -> None:
    toy = {**TWINS, "deaf": (10.0 * SINE, 10.0 * COSINE)}
    noisy = {**SENSORS, "deaf": SENSORS["deaf"].model_copy(update={"noise": 1e3 * NOISE})}
    best = rank(bench(found(toy), sensors=noisy))
    assert best is not None
    assert best.channel == "telling"
    alone = rank(bench(found({"own": toy["own"], "deaf": toy["deaf"]}), sensors=noisy))
    assert alone is not None
    assert not alone.worthwhile
    assert alone.sentence.startswith("none of those tried would tell a, b apart")


def test_a_nuisance_that_looks_like_the_difference_takes_the_benefit_away() -> None:
    """With N(0, 1) in sigmas, what is left of |P_b g_a|^2 = D is D / (1 + sigma^2 D)."""
    here = found(TWINS, {"bird_mass": {"telling": SMALL * (SINE - COSINE)}})
    left = orthogonal_given_common()
    for sigma in (0.5, 100.0):
        best = rank(bench(here, nuisances={"bird_mass": sigma}))
        assert best is not None
        assert best.ambiguous == pytest.approx(stands(left / (1.0 + sigma**2 * left)), rel=0.02)
        assert best.worthwhile == (sigma < 1.0)


def test_a_numerical_error_that_looks_like_the_difference_takes_the_benefit_away() -> None:
    def bias(r: Record) -> Array:
        d = np.concatenate([0.0 * TIMES, 10.0 * (SINE - COSINE)[::8]])[: len(r.values)]
        return np.outer(d, d)

    best = rank(bench(found(TWINS), numerical=bias))
    assert best is not None
    assert best.ambiguous == pytest.approx(0.95, abs=1e-3)


@pytest.mark.parametrize(("name", "shared"), [("impact_speed", False), ("plate_thickness", True)])
def test_a_second_shot_draws_the_speed_anew_but_not_the_thickness(name: str, shared: bool) -> None:
    """Rivals orthogonal; the nuisance looks like a: D in one shot, 2 D / (1 + D sigma^2) or 2 D / (1 + 2 D sigma^2)."""
    here = found({"own": (SMALL * SINE, 3.0 * COSINE)}, {name: {"own": SMALL * SINE}})
    best = rank(bench(here, nuisances={name: 0.4}, theres={80.0: here}))
    assert best is not None
    (d,) = power(SMALL * SINE)
    left = 2.0 * d / (1.0 + (2.0 if shared else 1.0) * d * 0.4**2)
    assert best.speed == 80.0
    assert best.ambiguous == pytest.approx(0.5 * stands(left), rel=0.02)  # b, 30 times as large, is never taken for a
    assert best.ambiguous_now == pytest.approx(0.5 * stands(d / (1.0 + d * 0.4**2)), rel=0.02)


def test_correlated_noise_lowers_the_benefit_by_the_factor_of_theory() -> None:
    """A constant in AR(1) noise weighs 1^T R^-1 1 = (n - (n - 2) rho) / (1 + rho) points instead of n."""
    toy = {"own": (0.0 * CLOCK, 50.0 * SINE), "telling": (0.05 + 0.0 * CLOCK, 0.0 * CLOCK)}
    n, rho = len(TIMES), 0.6
    tau = -float(TIMES[1]) / np.log(rho)
    white, correlated = rank(bench(found(toy))), rank(bench(found(toy), record=record(tau)))
    assert white is not None
    assert correlated is not None
    assert white.ambiguous == pytest.approx(0.5 * stands((0.05 / NOISE) ** 2 * n))
    points = (n - (n - 2) * rho) / (1.0 + rho)
    assert correlated.ambiguous == pytest.approx(0.5 * stands((0.05 / NOISE) ** 2 * points))
    assert correlated.ambiguous > 1.5 * white.ambiguous


def test_a_sensor_that_tells_nothing_is_no_reason_for_a_proposal() -> None:
    assert rank(bench(found({"own": TWINS["own"]}))) is None


def test_scatter_of_the_strikes_is_not_taken_for_a_difference() -> None:
    rng = np.random.default_rng(0)
    n, size = 800, 0.1
    g, errors, again = 0.6 * np.ones(n), size * rng.standard_normal((2, n)), size * rng.standard_normal((2, n))
    effects = {name: g + e for name, e in zip("ab", errors, strict=True)}
    blind = Shot(np.zeros((0, n)), {}, effects, dict.fromkeys("ab", 0.0 * g))
    aware = replace(blind, doubts=dict(zip("ab", again, strict=True)))
    assert chance([blind], SIZES, 0.05) < 0.1
    assert chance([aware], SIZES, 0.05) > 0.8


class Linear:
    """Strikes of a toy whose curves are linear in two parameters and grow with the speed; it counts them."""

    def __init__(self) -> None:
        self.paid = 0

    def run(self, cases: Mapping[str, Case]) -> dict[str, Histories]:
        self.paid += len(cases)
        return {name: strike(case) for name, case in cases.items()}


def strike(case: Case) -> Histories:
    values = np.array([[case.bird.material.viscosity, cast(Any, case.bird.material.eos).c0]])
    unit = (values - toy_study.LOWS) / (toy_study.HIGHS - toy_study.LOWS)
    curves = [case.impact.speed / 60.0 * y[0] for y in toy_study.curves(unit, 2)]
    return Histories(toy_study.TIME, dict(zip(case.sensors, curves, strict=True)), dict.fromkeys(case.sensors, "m"))


@pytest.fixture(scope="module")
def ground(tmp_path_factory: pytest.TempPathFactory) -> Groundwork:
    made = toy_study.groundwork(tmp_path_factory.mktemp("ground"))
    return replace(made, runs={CENTRE: strike(made.probed.with_values(made.theta))})


def test_derivatives_of_a_linear_strike_are_exact_and_effects_cost_nothing_at_its_speed(ground: Groundwork) -> None:
    strikes = Linear()
    here = sensitivities(ground, ground.known, cast(Strikes, strikes))
    assert here is not None
    assert strikes.paid == 4
    curves = np.array(toy_study.curves(np.array([[0.5, 0.5], [1.0, 0.5], [0.5, 1.0]]), 2))
    np.testing.assert_allclose(here.theta, 2.0 * (curves[:, 1:] - curves[:, :1]).swapaxes(0, 1), atol=1e-15)
    gain = next(known for known in ground.known if known.name == "sensor_gain")
    np.testing.assert_allclose(here.effects["sensor_gain"], gain.size * curves[:, 0])
    faster = sensitivities(ground, ground.known, cast(Strikes, strikes), 72.0)
    assert faster is not None
    assert strikes.paid == 4 + 5
    np.testing.assert_allclose(faster.curves, 1.2 * here.curves)


def test_members_of_an_ambiguous_verdict_get_a_proposal_and_the_list_of_what_was_tried(ground: Groundwork) -> None:
    (values,) = toy_study.curves(np.array([[0.5, 0.5]]))
    judge = toy_study.judge(ground, [values[0] * 1.03], 2e-5)
    members = [model for name, model in judge.models().items() if name in ("sensor_gain", "sensor_drift")]
    best = propose(judge, members, cast(Strikes, Linear()))
    assert best is not None
    assert set(best.separates) == {"sensor_gain", "sensor_drift"}
    assert sorted(one["channel"] for one in best.candidates) == ["gauge", "second shot", "second shot"]
    speeds = sorted(one["speed"] for one in best.candidates if one["speed"])
    assert speeds == pytest.approx([48.0, 72.0])
    chances = [one["ambiguous"] for one in best.candidates]
    assert chances == sorted(chances)
    assert best.ambiguous == chances[0] <= best.ambiguous_now + 1e-9
