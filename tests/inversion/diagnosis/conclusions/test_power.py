"""What could have been detected, on data simulated from the linear model itself."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis.conclusions.alarm import (
    absorbed,
    biases,
    collinear,
    gain,
    minimum_detectable,
    scatter_of_sizes,
)
from birdstrike.inversion.diagnosis.conclusions.next_measurement import expected
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester
from birdstrike.inversion.diagnosis.inference.system import System
from birdstrike.inversion.estimation.prior import UNIFORM_SD
from birdstrike.inversion.results.diagnosis import NONE
from tests.inversion.diagnosis.inference.linear_system import POINTS, Stub, known, models, system
from tests.inversion.diagnosis.inference.test_evidence import two_birds


@pytest.mark.parametrize("lattice_size", [0.0, 0.5])
def test_an_estimated_size_scatters_as_stated(lattice_size: float) -> None:
    """Generalised least squares of records without the effect, on lattices of their own: the sizes' scatter."""
    rng, s, draws = np.random.default_rng(3), system(0), 2000
    signature = s.columns[:, s.at["e1"].start]
    near = np.column_stack([s.columns[:, s.at["J"]], signature])
    lattice = lattice_size * near @ rng.standard_normal((3, 4)) / 2.0
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    tester = ModelTester(
        replace(s, columns=np.column_stack([s.columns, lattice]), at=at), known(np.array([1e-3])), unnamed=(1e-6,)
    )
    fit: Any = SimpleNamespace(system=tester.system, tester=tester, evidence=tester.model(models()[NONE]))
    (stated,) = scatter_of_sizes(fit, ["e1"])
    free = np.column_stack([s.columns[:, s.at["J"]], s.columns[:, s.at["nuisance"]]])
    C = np.eye(POINTS) + free @ free.T
    y = (
        free @ rng.standard_normal((free.shape[1], draws))
        + lattice @ rng.standard_normal((4, draws))
        + rng.standard_normal((POINTS, draws))
    )
    weight = np.linalg.solve(C, signature)
    assert np.std(weight @ y / (weight @ signature)) == pytest.approx(stated, rel=0.05)


def ranking_of(tester: ModelTester, labels: tuple[str, ...], **more: Any) -> Any:
    """What power and next measurement read of a ranking: the model without an effect on a system, and its effects."""
    none = tester.model(models()[NONE])
    fit = SimpleNamespace(system=tester.system, tester=tester, evidence=none, **more)
    singles = {label: Measurable(label) for label in labels}
    return SimpleNamespace(fits={NONE: fit}, singles=singles, seen=list(labels))


class Measurable(Stub):
    """Of 2 SI units a plausible size."""

    def magnitude(self, h: float) -> float:
        return 2.0 * h


ALIKE = 0.998  # cosine of two effects
IMITATED = 0.8  # cosine of an effect with a parameter's signature


def planes() -> System:
    """Signatures on orthogonal axes: e0 and e1 at an angle, e2 as a parameter, e3 partly so, e4 as e0.

    Every effect is an unnamed error too, as in a diagnosis.
    """
    s = system(0)
    axes = np.linalg.qr(np.random.default_rng(4).standard_normal((POINTS, 6)))[0].T
    G = np.array(
        [
            5.0 * axes[2],
            5.0 * (ALIKE * axes[2] + np.sqrt(1.0 - ALIKE**2) * axes[3]),
            5.0 * axes[0],
            5.0 * (IMITATED * axes[0] + np.sqrt(1.0 - IMITATED**2) * axes[4]),
            10.0 * axes[2],
        ]
    )
    columns = np.column_stack([np.zeros(POINTS), 10.0 * axes[:2].T, G.T, axes[5], G.T])
    at = {"y": slice(0, 1), "J": slice(1, 3), "unnamed": slice(3, 8), "nuisance": slice(8, 9)}
    at |= {f"e{i}": slice(9 + i, 10 + i) for i in range(5)}
    return replace(s, columns=columns, at={**at, "lattice": slice(14, 14)})


LABELS = tuple(f"e{i}" for i in range(5))


@pytest.mark.parametrize("unnamed", [1e-6, 0.03, 0.3, 1.0])
def test_parameters_alone_imitate_an_effect_however_large_unnamed_errors_are(unnamed: float) -> None:
    """Of a signature g along a parameter's j: |g|^2 (1 - cos^2 |j|^2 / (1 + |j|^2)) is left; nothing is lost across it.

    With unnamed errors free, e0 and e1 had 0.998 absorbed and a cosine of 0.6.
    """
    ranking = ranking_of(ModelTester(planes(), known(np.array([1e-6])), unnamed=(unnamed,)), LABELS)
    share = 100.0 / 101.0
    expected = {"e0": 0.0, "e1": 0.0, "e2": share, "e3": IMITATED**2 * share, "e4": 0.0}
    assert absorbed(ranking) == pytest.approx(expected, abs=1e-6)
    alike = collinear(ranking)
    assert alike["e0"]["e1"] == alike["e1"]["e0"] == pytest.approx(ALIKE, abs=1e-6)
    assert alike["e0"]["e4"] == pytest.approx(1.0, abs=1e-6)
    across = (1.0 - share) * IMITATED / np.sqrt((1.0 - share) * (1.0 - share * IMITATED**2))
    assert alike["e2"]["e3"] == pytest.approx(across, abs=1e-6)


@pytest.mark.parametrize(("amplitude", "unnamed"), [(0.05, 0.03), (0.05, 0.3), (0.05, 1.0), (1e-4, 0.03)])
def test_a_bias_is_what_the_fit_without_the_effect_makes_of_its_signature(amplitude: float, unnamed: float) -> None:
    s = system(0)
    space = ParameterSpace(("a", "b"), ("", ""), np.zeros(2), np.array([10.0, 20.0]), ("", ""))
    plan = SimpleNamespace(space=space, prior=s.priors["shots"])
    shot = SimpleNamespace(name="shots", setup=SimpleNamespace(plan=plan))
    places = SimpleNamespace(z={"shots": np.array([0.5, 0.5])})

    def tester(y: np.ndarray) -> ModelTester:
        columns = np.column_stack([y, s.columns[:, 1:]])
        return ModelTester(replace(s, columns=columns), known(np.array([amplitude])), unnamed=(unnamed,))

    ranking = ranking_of(tester(np.zeros(POINTS)), ("e1", "e3"), places=places)
    ranking.problem = SimpleNamespace(shots=(shot,))
    for label, bias in biases(ranking).items():
        z = tester(s.columns[:, s.at[label].start]).model(models()[NONE]).z[:2]
        expected = UNIFORM_SD * z * [10.0, 20.0]
        assert [bias["a"], bias["b"]] == pytest.approx(expected.tolist(), rel=1e-6)


def test_a_bias_of_a_shot_beside_another_bird_is_of_its_own_parameters() -> None:
    """Signature of a shot's own parameter: with two birds of whatever distance the posterior means of both."""
    s = two_birds(0.0)
    g = 0.5 * s.columns[:, 1]
    at = {**s.at, "e1": slice(3, 4), "lattice": slice(4, 4)}

    def tester(y: np.ndarray) -> ModelTester:
        columns = np.column_stack([y, s.columns[:, 1:], g])
        return ModelTester(replace(s, columns=columns, at=at), known(np.array([0.01])), unnamed=(0.1,), apart=(0.1,))

    space = ParameterSpace(("a",), ("",), np.zeros(1), np.ones(1), ("",))
    shot = SimpleNamespace(
        name="shots", setup=SimpleNamespace(plan=SimpleNamespace(space=space, prior=s.priors["shots"]))
    )
    places = SimpleNamespace(z={"shots": np.array([0.5])})
    ranking = ranking_of(tester(np.zeros(2 * POINTS)), ("e1",), places=places)
    ranking.problem = SimpleNamespace(shots=(shot,))
    C = (1.0 + 0.01**2) * np.eye(2 * POINTS)
    J, prior = s.columns[:, 1:3], np.array([[1.0, 0.99], [0.99, 1.0]])
    z = prior @ J.T @ np.linalg.solve(C + J @ prior @ J.T, g)
    assert biases(ranking)["e1"]["a"] == pytest.approx(UNIFORM_SD * z[0], rel=1e-6)


@pytest.mark.parametrize(("alpha", "signal"), [(0.05, 1.95996 + 0.84162), (0.01, 2.57583 + 0.84162)])
def test_the_least_detectable_size_is_that_of_a_two_sided_test_of_power_four_fifths(
    alpha: float, signal: float
) -> None:
    """An effect of which noise alone hides a size of 1/5, at 2 SI units a plausible size."""
    s = planes()
    few = replace(s, at={**s.at, "unnamed": slice(3, 3), "nuisance": slice(3, 3)})
    found = minimum_detectable(ranking_of(ModelTester(few, known(np.array([1e-6]))), LABELS), alpha)
    assert found["e0"] == pytest.approx(2.0 * signal / 5.0, rel=1e-4)
    assert found["e4"] == pytest.approx(2.0 * signal / 10.0, rel=1e-4)
    assert found["e2"] is None  # a hundredth of its information is left, which asks for more than 5 plausible sizes
    left = 25.0 * (1.0 - IMITATED**2 * 100.0 / 101.0)
    assert found["e3"] == pytest.approx(2.0 * signal / np.sqrt(left), rel=1e-4)
    faint = replace(few, columns=0.1 * few.columns)
    assert minimum_detectable(ranking_of(ModelTester(faint, known(np.array([1e-6]))), LABELS), alpha)["e0"] is None


def test_a_baseline_s_gain_counts_effects_that_are_detectable_only_beside_it() -> None:
    """Sizes that noise hides shrink by 2, by 50 from beyond what is looked for, by 1, and one stays beyond: the median
    is 2. Without the second it was 1.5."""
    s = planes()
    axes = np.linalg.qr(np.random.default_rng(6).standard_normal((POINTS, 5)))[0].T

    def ranking(sizes: tuple[float, ...]) -> Any:
        columns = np.column_stack([np.zeros((POINTS, 3)), (np.array(sizes)[:, None] * axes[: len(sizes)]).T])
        at = {"y": slice(0, 1), "J": slice(1, 3), "unnamed": slice(3, 3), "nuisance": slice(3, 3)}
        at |= {f"e{i}": slice(3 + i, 4 + i) for i in range(4)} | {"lattice": slice(7, 7)}
        return ranking_of(ModelTester(replace(s, columns=columns, at=at), known(np.array([1e-6]))), LABELS[:4])

    beside, alone = ranking((10.0, 5.0, 1.0, 1e-3)), ranking((5.0, 0.1, 1.0, 1e-5))
    assert minimum_detectable(alone, 0.05)["e1"] is None
    assert gain(beside, alone, 0.05) == pytest.approx(2.0, rel=1e-4)
    assert gain(ranking((1e-3,) * 4), ranking((1e-4,) * 4), 0.05) is None


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_sensor_that_would_tell_an_effect_from_none_is_worth_what_it_adds(size: float) -> None:
    """No effect loses nothing to one beside it, which has the Occam factor; an effect loses to none by its distance."""
    told = []
    for distance in (0.1, 1.0, 10.0, 100.0):
        found = expected(np.array([[1.0, 0.0], [0.0, distance]]), 1, np.array([size]), np.array([0.3]), none=0.6)
        absent = 1.0 / (1.0 + 1.0 / np.sqrt(1.0 + distance))
        there = 1.0 / (1.0 + np.exp(-0.5 * distance * size**2))
        assert found == pytest.approx((0.6 * absent + 0.3 * there) / 0.9)
        told.append(found)
    assert told == sorted(told)


def test_a_model_without_a_share_takes_no_part() -> None:
    gram = np.diag([1.0, 4.0, 9.0])
    sizes, weights = np.array([1.0, 1.0]), np.array([0.5, 0.5])
    apart = 0.5 / (1.0 + np.exp(-2.0)) + 0.5 / (1.0 + np.exp(-4.5))
    assert expected(gram, 1, sizes, weights) == pytest.approx(apart)
