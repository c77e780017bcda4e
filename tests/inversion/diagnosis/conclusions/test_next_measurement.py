"""What a further sensor or a clean shot would add, against closed forms on made-up curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.conclusions import next_measurement
from birdstrike.inversion.diagnosis.conclusions.next_measurement import (
    POINTS,
    _beside_clean_shot,
    _beside_own_bird,
    _unexplained,
    record_information,
    sensor_information,
    slopes,
)
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.ranking import Problem
from birdstrike.inversion.diagnosis.inference.system import System
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes, repeatability, started
from birdstrike.inversion.estimation.prior import UNIFORM_SD
from birdstrike.inversion.results.diagnosis import NONE
from tests.inversion.diagnosis.inference.linear_system import POINTS as RECORD
from tests.inversion.diagnosis.inference.linear_system import covariance, known, models, system
from tests.inversion.diagnosis.inference.test_evidence import two_birds

T = np.linspace(0.0, 1.0, POINTS)
SIGNATURE = 0.3 * np.sin(5.0 * T)  # of one plausible size of e1, at the candidate
NOISE = 0.02


def distance(information: tuple[Array, int], i: int = 0) -> float:
    """Information on effect i that the free directions leave."""
    gram, r = information
    return _unexplained(gram, r, i, None)


@pytest.mark.parametrize(("amplitude", "unnamed"), [(0.01, 0.1), (0.1, 1.0)])
def test_a_record_s_information_on_an_effect_is_that_of_generalised_least_squares(
    amplitude: float, unnamed: float
) -> None:
    """With parameters, unnamed errors and nuisances in the covariance, each as wide as its prior."""
    s = system(0)
    tester = ModelTester(s, known(np.array([amplitude])), unnamed=(unnamed,))
    C = covariance(s, amplitude, unnamed)
    for i, label in enumerate(("e1", "e3")):
        g = s.columns[:, s.at[label].start]
        exact = g @ np.linalg.solve(C, g)
        assert distance(record_information(tester, ["e1", "e3"], 0), i) == pytest.approx(exact, rel=1e-5)


def with_effect(s: System) -> System:
    """Two shots with an effect that the first alone has."""
    g = np.concatenate([np.sin(7.0 * np.linspace(0.0, 1.0, RECORD)), np.zeros(RECORD)]) + 0.1 * s.columns[:, 1]
    return replace(s, columns=np.column_stack([s.columns, g]), at={**s.at, "e1": slice(3, 4), "lattice": slice(4, 4)})


def left_of(s: System, amplitude: float, apart: float) -> float:
    """Information on that effect, birds of distance `apart`."""
    J, g, share = s.columns[:, 1:3], s.columns[:, 3], 1.0 - apart**2
    C = (1.0 + amplitude**2) * np.eye(2 * RECORD) + J @ np.array([[1.0, share], [share, 1.0]]) @ J.T
    return float(g @ np.linalg.solve(C, g))


@pytest.mark.parametrize("apart", [0.02, 0.1, 1.0])
@pytest.mark.parametrize("amplitude", [0.005, 3.0])
def test_beside_a_clean_shot_the_birds_are_as_far_apart_as_they_are(amplitude: float, apart: float) -> None:
    """The model error is at most the usual remainder: where it is that already, nothing is learnt from a clean shot."""
    s = with_effect(two_birds(0.0))
    tester = ModelTester(s, known(np.array([amplitude])), unnamed=(0.1,), apart=(apart,))
    fit = SimpleNamespace(system=s, tester=tester, evidence=tester.model(models()[NONE]))
    problem = SimpleNamespace(known=tester.known)
    ranking: Any = SimpleNamespace(fits={NONE: fit}, evidence={"e1": fit.evidence}, problem=problem)
    found = distance(_beside_clean_shot(ranking, ["e1"]))
    assert found == pytest.approx(left_of(s, repeatability("displacement"), apart), rel=1e-5)
    now = distance(record_information(tester, ["e1"], 0))
    assert now == pytest.approx(left_of(s, amplitude, apart), rel=1e-5)
    assert (found == pytest.approx(now, rel=1e-9)) is (amplitude == repeatability("displacement"))


@dataclass(frozen=True)
class Shots:
    """A problem as `_beside_own_bird` asks it: the system's model error has the part that baselines show."""

    shots: tuple[Any, ...]
    known: Amplitudes
    measured = Problem.measured

    def tested(self, model: Any, places: Places) -> Any:
        """The model without an effect on what is left of the shots."""
        assert (model, dict(places.h)) == (NOTHING, {})
        assert [one.name for one in self.shots] == ["shot"]
        s = system(0)
        shown = self.known.fixed["displacement"] ** 2 * s.blocks[0].U
        block = type(s.blocks[0]).of("displacement", s.blocks[0].rows, np.eye(RECORD) + shown, s.blocks[0].U)
        tester = ModelTester(replace(s, blocks=(block,)), self.known, unnamed=(0.1,))
        return SimpleNamespace(tester=tester, evidence=tester.model(models()[NONE]))


@pytest.mark.parametrize("learnt", [True, False])
def test_beside_a_shot_of_its_own_bird_what_shots_share_of_the_model_error_is_known(learnt: bool) -> None:
    """The part that baselines show is taken as seen, in the kinds of sensors that they show alone."""
    kinds = frozenset({"displacement"}) if learnt else frozenset[str]()
    amplitudes = replace(known(np.array([0.01])), fixed={"displacement": 0.2}, learnt=kinds)
    shots = SimpleNamespace(name="shot", baseline=False), SimpleNamespace(name="clean", baseline=True)
    fit = SimpleNamespace(places=Places({"shot": np.zeros(2), "clean": np.zeros(2)}, {"e2": 1.0}))
    ranking: Any = SimpleNamespace(problem=Shots(shots, amplitudes), fits={NONE: fit})
    s = system(0)
    g = s.columns[:, s.at["e1"].start]
    C = covariance(s, 0.01 if learnt else float(np.hypot(0.01, 0.2)), 0.1)
    assert distance(_beside_own_bird(ranking, ["e1"])) == pytest.approx(g @ np.linalg.solve(C, g), rel=1e-5)


class Curves(SimpleNamespace):
    """A run of one sensor on its own clock."""

    def __init__(self, curve: Array) -> None:
        super().__init__(time=T, channels={"probe": curve})


@dataclass(frozen=True)
class Pairs:
    """A block of the plan with two effects, four pairs of runs."""

    known: tuple[Any, ...] = (SimpleNamespace(name="e1"), SimpleNamespace(name="e2"))
    sizes = np.array([[2.0, 1.0], [2.0, -1.0], [-2.0, 1.0], [-2.0, -1.0]])

    def finished(self, runs: Any) -> list[int]:
        """Pairs of which both runs are there."""
        return [i for i in range(4) if f"pair {i} +" in runs and f"pair {i} -" in runs]

    def halves(self, pairs: list[int], curve: Any) -> Array:
        """Half the difference of each pair."""
        return np.array([0.5 * (curve(f"pair {i} +") - curve(f"pair {i} -")) for i in pairs])

    def codes(self, pairs: list[int]) -> Array:
        """Plausible sizes of each effect in each pair."""
        return self.sizes[pairs]


CURVE, SLOPES = 1.0 + np.sin(2.0 * T), np.array([np.cos(3.0 * T), T**2])
OTHER = np.cos(11.0 * T)  # of one plausible size of e2


def shot_with(points: Array, more: Array | float = 0.0, stated: float = NOISE) -> Any:
    """A campaign at points (n, 2) that is linear in the parameters but for `more` (n, m), and pairs with effects."""
    z = np.array([0.4, 0.6])
    coarse = CURVE + (points - z) @ SLOPES + more
    runs = {f"coarse {i}": Curves(curve) for i, curve in enumerate(coarse)}
    for i, (first, second) in enumerate(Pairs.sizes):
        moved = first * SIGNATURE + second * OTHER
        runs |= {f"pair {i} +": Curves(CURVE + moved), f"pair {i} -": Curves(CURVE - moved)}
    sensor = SimpleNamespace(kind="displacement", noise=stated)
    plan = SimpleNamespace(
        unit=points,
        prior=system(0).priors["shots"],
        blocks=(Pairs(),),
        coarse=SimpleNamespace(sensors={"probe": sensor}),
        finished=lambda _: list(range(len(points))),
        fine_points=tuple,
    )
    setup = SimpleNamespace(plan=plan, runs=runs, time=T, lows=np.zeros(2), responses={"e1": None, "e2": None})
    record = SimpleNamespace(traces=[SimpleNamespace(times=T)])
    return SimpleNamespace(name="shots", setup=setup, record=record, onset=0.1)


def ranking_with(shot: Any, amplitude: float, unnamed: float) -> Any:
    """The model without an effect on the made-up system, e1 and e2 seen by the candidate too."""
    tester = ModelTester(system(0), known(np.array([amplitude])), unnamed=(unnamed,))
    none = tester.model(models()[NONE])
    fit = SimpleNamespace(system=tester.system, tester=tester, places=Places({"shots": np.array([0.4, 0.6])}, {}))
    effects = {
        label: SimpleNamespace(members=(SimpleNamespace(name=label, shots=("shots",), response=object(), size=1.0),))
        for label in ("e1", "e2")
    }
    problem = SimpleNamespace(shots=(shot,))
    return SimpleNamespace(fits={NONE: fit}, models=effects, evidence={"e1": none, "e2": none}, problem=problem)


def grid(n: int) -> Array:
    """(n, 2) points that fill the ranges."""
    return np.random.default_rng(5).random((n, 2))


def exact_error(amplitude: float, peak: float, noise: float = NOISE) -> Array:
    """Noise, and a discrepancy that begins at contact, of a share of the peak; no simulation shows its shape."""
    return (amplitude * peak) ** 2 * started(T, T, 0.1, 0.1) + noise**2 * np.eye(POINTS)


def columns(unnamed: float) -> Array:
    """Parameters, the unnamed errors of e1 and e2 in the system's two other directions, and e1 itself."""
    J = UNIFORM_SD * SLOPES.T
    return np.column_stack([J, unnamed * SIGNATURE, unnamed * OTHER, SIGNATURE])


@pytest.mark.parametrize("amplitude", [0.001, 0.05])
@pytest.mark.parametrize("unnamed", [0.03, 1.0])
def test_a_sensor_s_information_is_that_of_its_curves_under_its_errors(amplitude: float, unnamed: float) -> None:
    """A campaign that the fit follows exactly; model error as large as the record's, not below the remainder."""
    shot = shot_with(grid(9))
    found = sensor_information(ranking_with(shot, amplitude, unnamed), shot, "probe", ["e1"])
    assert found is not None
    peak = max(float(np.abs(run.channels["probe"]).max()) for n, run in shot.setup.runs.items() if "coarse" in n)
    X = columns(unnamed)
    C = exact_error(max(amplitude, repeatability("displacement")), peak)
    assert found == pytest.approx(X.T @ np.linalg.solve(C, X), rel=1e-6, abs=1e-6)


def test_a_sensor_that_the_campaign_s_fit_does_not_follow_tells_less() -> None:
    """Runs scatter by a pattern, whose size the fits to all runs but one show: that is an error of the sensor."""
    points, rng = grid(12), np.random.default_rng(2)
    pattern = np.sin(5.0 * T + 0.3)
    shot = shot_with(points, np.outer(rng.standard_normal(12), pattern))
    found = sensor_information(ranking_with(shot, 0.001, 0.03), shot, "probe", ["e1"])
    u = points - [0.4, 0.6]
    basis = np.column_stack([np.ones(12), u, u[:, 0] ** 2, u[:, 0] * u[:, 1], u[:, 1] ** 2])
    curves = np.array([shot.setup.runs[f"coarse {i}"].channels["probe"] for i in range(12)])
    errors = []
    for i in range(12):
        rest = np.arange(12) != i
        errors.append(curves[i] - basis[i] @ np.linalg.lstsq(basis[rest], curves[rest], rcond=None)[0])
    whole = np.linalg.lstsq(basis, curves, rcond=None)[0]
    C = exact_error(repeatability("displacement"), float(np.abs(curves).max())) + np.cov(np.array(errors).T, bias=True)
    C += np.outer(np.mean(errors, axis=0), np.mean(errors, axis=0))
    X = columns(0.03)
    X[:, :2] = UNIFORM_SD * whole[1:3].T
    assert found is not None
    assert found == pytest.approx(X.T @ np.linalg.solve(C, X), rel=1e-6, abs=1e-6)
    quiet = exact_error(repeatability("displacement"), float(np.abs(curves).max()))
    assert found[-1, -1] < 0.7 * SIGNATURE @ np.linalg.solve(quiet, SIGNATURE)


def test_few_runs_are_followed_to_first_order_with_an_error() -> None:
    """Six runs, as many as a quadratic of two parameters has terms: none would be left to show an error."""
    points = grid(6)
    _, jacobian, errors = next_measurement.quadratic(points, np.outer(points[:, 0] ** 2, np.ones(3)))
    assert len(jacobian) == 2
    assert np.abs(errors).max() > 0.01
    many = grid(7)
    curve, jacobian, errors = next_measurement.quadratic(many, np.outer(3.0 * many[:, 0] ** 2 + many[:, 1], np.ones(3)))
    assert curve == pytest.approx(np.zeros(3), abs=1e-9)
    assert jacobian == pytest.approx(np.array([[0.0] * 3, [1.0] * 3]), abs=1e-9)
    assert errors == pytest.approx(np.zeros((7, 3)), abs=1e-7)


def test_signatures_at_a_candidate_are_read_from_the_pairs() -> None:
    shot: Any = shot_with(grid(9))
    found = slopes(shot, "probe", T)
    assert found["e1"] == pytest.approx(SIGNATURE, abs=1e-12)
    assert found["e2"] == pytest.approx(OTHER, abs=1e-12)
    for i in range(3):
        del shot.setup.runs[f"pair {i} -"]
    assert not np.any(slopes(shot, "probe", T)["e1"])
