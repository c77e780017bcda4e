"""The linear-Gaussian core against closed forms, and on data simulated from the model itself."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp, softmax
from scipy.stats import binom, kstest, norm

from birdstrike.data.errors import UserError
from birdstrike.inversion.diagnosis.conclusions.alarm import SHARES, alarm, required_discrepancy
from birdstrike.inversion.diagnosis.conclusions.answer import verdict_of
from birdstrike.inversion.diagnosis.inference.evidence import SIZES, UNNAMED, ModelTester, draws
from birdstrike.inversion.diagnosis.inference.hypotheses import BIRDS, Hypothesis, birds_apart
from birdstrike.inversion.diagnosis.inference.ranking import credible_set, probabilities
from birdstrike.inversion.diagnosis.inference.system import Block, System
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
from tests.inversion.diagnosis.inference.linear_system import (
    EFFECTS,
    POINTS,
    Stub,
    covariance,
    known,
    log_density,
    models,
    singles,
    system,
)


@pytest.mark.parametrize("label", [NONE, "e1"])
def test_evidence_is_the_marginal_likelihood_of_a_gaussian(label: str) -> None:
    y = np.random.default_rng(3).standard_normal(POINTS) * 4.0
    s = system(0, y)
    nodes = np.array([0.01, 0.05])
    found = ModelTester(s, known(nodes)).model(models()[label]).log_evidence
    name = None if label == NONE else label
    every = [covariance(s, a, unnamed, name, size) for a in nodes for unnamed in UNNAMED for size in SIZES]
    exact = [np.asarray(log_density(y, C)) for C in every]
    expected = logsumexp(exact) - np.log(len(every)) + 0.5 * POINTS * np.log(2.0 * np.pi)
    assert found == pytest.approx(
        float(expected), abs=1e-3
    )  # amplitudes of less than a thousandth of the weight are left out


@pytest.mark.parametrize("label", [NONE, "e1"])
def test_parameters_have_the_covariance_of_the_mixture_over_all_amplitudes(label: str) -> None:
    """How far the means of the amplitudes lie apart was not in it, and of their places only three."""
    first, nodes = system(0), np.array([0.02, 0.1, 0.5])
    y = 25.0 * np.linspace(0.0, 1.0, POINTS) ** 2 + np.random.default_rng(3).standard_normal(POINTS)
    tester = ModelTester(system(0, y), known(nodes))
    found, name, J = tester.model(models()[label]), None if label == NONE else label, first.columns[:, first.at["J"]]
    every = [covariance(first, a, u, name, size) for a in nodes for u in UNNAMED for size in (SIZES if name else [1.0])]
    w = softmax([log_density(y, C) for C in every])
    gains = [J.T @ np.linalg.inv(C) for C in every]
    means = np.array([gain @ y for gain in gains])
    within = np.einsum("i,ijk->jk", w, [np.eye(2) - gain @ J for gain in gains])
    mean = w @ means
    assert found.z[:2] == pytest.approx(mean, abs=1e-3)
    assert found.z_cov == pytest.approx(within + (w[:, None] * (means - mean)).T @ (means - mean), rel=5e-3)
    z, _, _ = draws(tester, found, 4000, np.random.default_rng(0))
    assert np.cov(z.T) == pytest.approx(found.z_cov, abs=0.1 * float(found.z_cov.max()))


def test_evidence_of_two_birds_is_the_marginal_likelihood_at_every_node() -> None:
    """Parameters of two shots with unit variance, 1 - apart^2 of it in common; `joint` holds them at the places."""
    rng, one = np.random.default_rng(3), system(3, np.random.default_rng(5).standard_normal(POINTS) * 3.0)
    J, dz = one.columns[:, one.at["J"]], rng.standard_normal(4)
    first = np.arange(POINTS)[:, None] < POINTS // 2
    columns = np.column_stack(
        [one.columns[:, :1], np.where(first, J, 0.0), np.where(first, 0.0, J), one.columns[:, 3:]]
    )
    at = {name: slice(own.start + 2, own.stop + 2) for name, own in one.at.items() if name not in ("y", "J")}
    priors = dict.fromkeys("ab", NormalPrior.of_ranges(2))
    two = replace(one, columns=columns, at={"y": slice(0, 1), "J": slice(1, 5), **at}, dz=dz, priors=priors)
    tester, model = ModelTester(two, known(np.array([0.05, 0.2])), unnamed=(0.1, 0.3)), models()[NONE]
    whole, y = columns[:, 1:5], columns[:, 0]
    expected, held = list[float](), list[float]()
    for a, unnamed, apart in zip(tester.combinations[:, 0], tester.unnamed, tester.apart, strict=True):
        shared = np.kron((1.0 - apart**2) * np.ones((2, 2)) + apart**2 * np.eye(2), np.eye(2))
        rest = covariance(one, a, unnamed) - J @ J.T
        expected.append(log_density(y + whole @ dz, rest + whole @ shared @ whole.T))
        held.append(log_density(y, rest) + log_density(dz, shared))
    constant = 0.5 * POINTS * np.log(2.0 * np.pi) - np.log(12)
    assert tester.at_nodes(model, []) == pytest.approx(np.array(expected) + constant, abs=1e-6)
    few = np.array([11, 2, 6])
    assert tester.at_nodes(model, [], few) == pytest.approx(np.array(expected)[few] + constant, abs=1e-6)
    assert tester.joint(model, []) == pytest.approx(float(np.logaddexp.reduce(held)) + constant, abs=1e-6)


def test_amplitudes_that_are_negligible_without_effects_and_with_all_can_be_dropped() -> None:
    """They are for every model between; those that another model needs stay."""
    s = system(0, np.random.default_rng(3).standard_normal(POINTS) * 4.0 + 30.0 * system(0).columns[:, 6])
    every = known(np.geomspace(1e-4, 1.0, 25))
    whole = ModelTester(s, every)
    kept = whole.likely_combinations([], 1e-4) | whole.likely_combinations([f"e{i}" for i in range(EFFECTS)], 1e-4)
    assert 3 < len(kept) < 25
    few = ModelTester(s, replace(every, kept=tuple(sorted(kept))))
    for one in models().values():
        assert few.model(one).log_evidence == pytest.approx(whole.model(one).log_evidence, abs=2e-3)


def alarm_of(y: np.ndarray, nodes: np.ndarray, unnamed: tuple[float, ...] = UNNAMED) -> float:
    """p-value of none for a record of the made-up shot."""
    every = models() | {SOMETHING_ELSE: Hypothesis(SOMETHING_ELSE, (), 0.05, SOMETHING_ELSE)}
    tester = ModelTester(system(0, y), known(nodes), unnamed=unnamed)
    fit: Any = SimpleNamespace(tester=tester, evidence=tester.model(every[NONE]))
    ranking: Any = SimpleNamespace(fits={NONE: fit}, models=every, singles=singles(every))
    return alarm(ranking, 0, 99)


def required(y: np.ndarray) -> dict[str, float | None]:
    """Of the made-up shot, all models about the place of none."""
    every = models()
    tester = ModelTester(system(0, y), known(np.array([0.01])))
    fit: Any = SimpleNamespace(system=tester.system, tester=tester)
    evidence = {label: tester.model(model) for label, model in every.items()}
    ranking: Any = SimpleNamespace(fits={NONE: fit}, models=every, evidence=evidence)
    return required_discrepancy(ranking)


def test_each_model_requires_a_model_error_of_its_own() -> None:
    """Every model was told the share of the residual's rough part, the right one's as much as a wrong one's."""
    s, rng = system(0), np.random.default_rng(4)
    sound = rng.multivariate_normal(np.zeros(POINTS), covariance(s, 0.01, UNNAMED[0]))
    signature = s.columns[:, s.at["e1"].start]
    clean, struck = required(sound), required(sound + 2.0 * signature)
    assert struck["e1"] is not None
    others = {label: share for label, share in struck.items() if label != "e1"}
    least = 2.0 * struck["e1"]
    assert all(share is None or share > least for share in others.values())
    assert clean[NONE] == pytest.approx(struck["e1"], abs=0.02)
    assert all(share is not None and share <= (clean[NONE] or 0.0) for share in clean.values())


def test_a_model_error_stands_in_for_an_effect_where_it_makes_both_as_likely() -> None:
    """The none of a planted effect: at the share told the effect is no likelier by 1.35, one step below it is."""
    s = system(0)
    y = 0.7 * s.columns[:, s.at["e1"].start] + np.random.default_rng(5).standard_normal(POINTS)
    share = required(y)[NONE]
    assert share is not None
    below = SHARES[np.searchsorted(SHARES, share * 0.999) - 1]
    tester = ModelTester(system(0, y), known(np.array([below, share])), unnamed=UNNAMED[:1])
    none, effect = (tester.at_nodes(models()[label], [0.0] * (label != NONE)) for label in (NONE, "e1"))
    gain = effect - none
    assert gain[0] > 1.35 >= gain[1]


def test_the_alarm_keeps_its_rate_and_has_power() -> None:
    """Clean records, amplitudes from their priors: no more alarms than the rate, and some p-values on either side."""
    rng, s, nodes = np.random.default_rng(1), system(0), np.array([0.005, 0.02, 0.1])
    signature = s.columns[:, s.at["e1"].start]

    def clean() -> np.ndarray:
        return rng.multivariate_normal(np.zeros(POINTS), covariance(s, rng.choice(nodes), rng.choice(UNNAMED)))

    p = np.array([alarm_of(clean(), nodes) for _ in range(80)])
    assert binom.sf((p <= 0.05).sum() - 1, len(p), 0.05) > 0.01
    assert p.min() < 0.3 < 0.6 < p.max()
    quiet = covariance(s, nodes[0], UNNAMED[0])
    struck = [alarm_of(rng.multivariate_normal(3.0 * signature, quiet), nodes) for _ in range(5)]
    assert max(struck) <= 0.05


def test_the_alarm_s_p_values_are_uniform_where_the_amplitudes_are_known() -> None:
    rng, C = np.random.default_rng(1), covariance(system(0), 0.1, 0.1)
    clean = rng.multivariate_normal(np.zeros(POINTS), C, 40)
    p = [alarm_of(y, np.array([0.1]), (0.1,)) for y in clean]
    assert kstest(p, "uniform").pvalue > 0.01


def test_a_magnitude_holds_what_an_unnamed_error_of_the_same_signature_has() -> None:
    """An effect of two plausible sizes beside unnamed errors of one: its magnitude is two, with the data's spread."""
    first = system(0)
    columns = first.columns.copy()
    columns[:, first.at["unnamed"]] = columns[:, first.at["e1"]]
    columns[:, 0] = 2.0 * columns[:, first.at["e1"].start]
    s = replace(first, columns=columns)
    tester = ModelTester(s, known(np.array([0.001])), unnamed=(1.0,))
    found = tester.model(models()["e1"])
    C, g = covariance(s, 0.001, 0.0), columns[:, first.at["e1"].start]
    information, score = g @ np.linalg.solve(C, g), g @ np.linalg.solve(C, columns[:, 0])
    variance = 1.0 + SIZES**2  # of unnamed error and magnitude together
    precision = information + 1.0 / variance
    weights = softmax(0.5 * (score**2 / precision - np.log1p(variance * information)))
    mean = weights @ (score / precision)
    assert found.h[0] == pytest.approx(mean, rel=1e-6)
    assert found.h_cov[0, 0] == pytest.approx(weights @ (1.0 / precision + (score / precision - mean) ** 2), rel=1e-5)


def test_a_one_sided_magnitude_doubles_the_evidence_where_it_is_surely_positive() -> None:
    s = system(0)
    y = 5.0 * s.columns[:, s.at["e1"]][:, 0]
    s = system(0, y)
    two, one = (ModelTester(s, known(np.array([0.01]))).model(models(sided)["e1"]) for sided in (False, True))
    assert one.log_evidence - two.log_evidence == pytest.approx(np.log(2.0), abs=1e-3)


@pytest.mark.parametrize("unnamed", [None, 0.03, 1.0])
@pytest.mark.parametrize("true", [-0.3, -0.1, 0.0, 0.3])
def test_a_one_sided_magnitude_is_the_mean_of_what_it_may_be(true: float, unnamed: float | None) -> None:
    """By quadrature, with its variance and the parameters beside it; unnamed: size of one with the same signature."""
    rng, first = np.random.default_rng(1), system(0)
    g, J = first.columns[:, first.at["e1"].start], first.columns[:, first.at["J"]]
    columns = first.columns.copy()
    columns[:, 0] = y = true * g + J @ [0.5, -0.4] + rng.standard_normal(POINTS)
    if unnamed is not None:
        columns[:, first.at["unnamed"]] = g[:, None]
    s, size = replace(first, columns=columns), unnamed or 0.1
    found = ModelTester(s, known(np.array([0.01])), unnamed=(size,)).model(models(True)["e1"])
    C = covariance(s, 0.01, size if unnamed is None else 0.0)
    score, information = g @ np.linalg.solve(C, y), g @ np.linalg.solve(C, g)
    h = np.linspace(0.0, 2.0, 200_001)
    prior = np.hypot(SIZES, unnamed or 0.0)[:, None]
    logs = np.logaddexp.reduce(norm.logpdf(h, scale=prior), axis=0) + h * score - 0.5 * h**2 * information
    density = np.exp(logs - logs.max())
    density /= np.trapezoid(density, h)
    mean: Any = np.trapezoid(h * density, h)
    z = J.T @ np.linalg.solve(C, y - mean * g)
    assert found.h[0] == pytest.approx(mean, rel=2e-3)
    assert found.h_cov[0, 0] == pytest.approx(np.trapezoid((h - mean) ** 2 * density, h), rel=5e-3)
    assert found.z[:2] == pytest.approx(z, abs=1e-4)


@pytest.mark.parametrize(("both", "like"), [(False, 0.0), (True, 0.0), (True, 4.0), (True, -4.0)])
@pytest.mark.parametrize("true", [(0.0, 0.3), (-0.1, -0.1), (0.1, -0.05)])
def test_beside_a_one_sided_magnitude_the_other_of_a_pair_is_its_mean_too(
    true: tuple[float, float], both: bool, like: float
) -> None:
    """Evidence, means and covariance by quadrature; like: parts of one signature that the other has besides its own.

    Of two that look alike the evidence was off by 0.7, a mean by a half, where each was cut off by itself.
    """
    rng, first = np.random.default_rng(2), system(0)
    columns, at = first.columns.copy(), [first.at["e1"].start, first.at["e2"].start]
    columns[:, at[1]] += like * columns[:, at[0]]
    G = columns[:, at]
    columns[:, 0] = y = G @ true + rng.standard_normal(POINTS)
    tester = ModelTester(replace(first, columns=columns), known(np.array([0.01])), unnamed=(0.1,))
    pair: Any = (Stub("e1", True), Stub("e2", both))
    found = tester.model(Hypothesis("e1+e2", pair, 0.1, "pairs"))
    C = covariance(first, 0.01, 0.1)
    S, b = G.T @ np.linalg.solve(C, G), G.T @ np.linalg.solve(C, y)
    far = 12.0 * np.sqrt(np.diag(found.h_cov))
    axes = [
        np.linspace(low, h + wide, 701) for low, h, wide in zip((0.0, 0.0 if both else -1.0), found.h, far, strict=True)
    ]
    A, B = np.meshgrid(*axes, indexing="ij")
    logs = A * b[0] + B * b[1] - 0.5 * (S[0, 0] * A**2 + 2.0 * S[0, 1] * A * B + S[1, 1] * B**2)
    logs += np.logaddexp.reduce([norm.logpdf(A, scale=sd) + norm.logpdf(B, scale=sd) for sd in SIZES], axis=0)
    density = np.exp(logs - logs.max())

    def integral(values: np.ndarray) -> float:
        return float(np.trapezoid(np.trapezoid(values * density, axes[1]), axes[0]))

    whole = integral(np.ones_like(A))
    mean = np.array([integral(A), integral(B)]) / whole
    off = (A - mean[0], B - mean[1])
    assert found.h == pytest.approx(mean, rel=2e-3, abs=1e-4)
    assert found.h_cov == pytest.approx(
        np.array([[integral(x * z) / whole for z in off] for x in off]), rel=0.02, abs=1e-5
    )
    doubled, sizes = (1 + both) * np.log(2.0), np.log(len(SIZES))
    alone = log_density(y, C) + 0.5 * POINTS * np.log(2.0 * np.pi)
    assert found.log_evidence == pytest.approx(np.log(whole) + logs.max() + doubled - sizes + alone, abs=2e-3)


def test_a_large_magnitude_is_not_shrunk_nor_shared_out() -> None:
    """Of four plausible sizes seen with an error of half a size; a normal prior of one size would say 3.2."""
    s = system(0, size=1.0)
    g = s.columns[:, s.at["e1"]][:, 0]
    free = np.linalg.inv(covariance(s, 0.01, 0.0))
    scaled = g * 2.0 / np.sqrt(g @ free @ g)  # an information of 4 on h
    columns = s.columns.copy()
    columns[:, s.at["e1"].start], columns[:, 0] = scaled, 4.0 * scaled
    found = ModelTester(replace(s, columns=columns), known(np.array([0.01])), unnamed=(1e-6,)).model(models()["e1"])
    assert 3.6 < found.h[0] < 4.0


def test_stated_probabilities_are_calibrated_and_the_credible_set_covers() -> None:
    """Truths drawn from the priors themselves: a model told with p is the truth with a frequency of p."""
    rng = np.random.default_rng(1)
    nodes = np.array([0.005, 0.02, 0.08])
    priors = models()
    labels, weights = list(priors), [m.prior for m in priors.values()]
    told, right, covered, count = 0.0, 0.0, 0, 150
    for _ in range(count):
        base = system(7)
        truth = labels[rng.choice(len(labels), p=weights)]
        a = rng.choice(nodes)
        spread = covariance(base, a, rng.choice(UNNAMED), None if truth == NONE else truth, rng.choice(SIZES))
        y = rng.multivariate_normal(np.zeros(POINTS), spread)
        tester = ModelTester(system(7, y), known(nodes))
        shares = probabilities({label: tester.model(m) for label, m in priors.items()})
        best = max(shares, key=lambda name: shares[name])
        told += shares[best]
        right += best == truth
        covered += truth in credible_set(shares)
    assert told / count == pytest.approx(right / count, abs=0.07)
    assert covered / count > 0.92


def test_a_model_that_explains_nearly_as_much_is_not_ruled_out() -> None:
    """Of two effects that explain 1000 and 990 nats neither is certain; of 5 and 0 the evidence counts as it is."""
    every = models()

    def shares(gains: dict[str, float]) -> dict[str, float]:
        found: Any = {
            label: SimpleNamespace(hypothesis=m, log_evidence=gains.get(label, 0.0)) for label, m in every.items()
        }
        return probabilities(found)

    large = shares({"e0": 1000.0, "e1": 990.0})
    assert np.exp(-1.0) < large["e1"] / large["e0"] < 1.0
    assert large[NONE] < 1e-30
    small = shares({"e0": 5.0})
    exact = np.exp(5.0) * every["e0"].prior
    assert small["e0"] == pytest.approx(exact / (exact + 1.0 - every["e0"].prior), abs=0.03)


def test_at_best_a_model_is_as_likely_as_with_the_signature_that_simulations_would_show() -> None:
    """Six directions in which a signature may err: they cost evidence until it is known which of them is right."""
    rng, s, nodes = np.random.default_rng(2), system(0), np.array([0.005])
    g = s.columns[:, s.at["e1"].start]
    errors = 0.15 * np.linalg.norm(g) * np.linalg.qr(rng.standard_normal((POINTS, 6)))[0]
    right = g + errors @ rng.standard_normal(6)
    y = 5.0 * right + rng.standard_normal(POINTS)
    end = s.columns.shape[1]

    def tester(signature: np.ndarray, unknown: np.ndarray) -> ModelTester:
        columns = np.column_stack([y, s.columns[:, 1:], unknown])
        columns[:, s.at["e1"].start] = signature
        at = {**s.at, "error of e1": slice(end, end + unknown.shape[1])}
        return ModelTester(replace(s, columns=columns, at=at), known(nodes))

    learnt, simulated = tester(g, errors), tester(right, errors[:, :0])
    found, exact = learnt.model(models()["e1"]), simulated.model(models()["e1"])
    assert simulated.at_best(exact) == pytest.approx(exact.log_evidence, abs=0.01)
    assert exact.log_evidence - found.log_evidence > 10.0
    assert abs(exact.log_evidence - learnt.at_best(found)) < 0.5 * 6.0  # by how unlikely six errors of one sd are


def test_a_baseline_of_the_same_discrepancy_finds_what_a_lone_shot_cannot() -> None:
    """Two shots share a discrepancy of ten times the effect: their difference shows it."""
    rng = np.random.default_rng(5)
    t = np.linspace(0.0, 1.0, POINTS)
    K = np.exp(-0.5 * ((t[:, None] - t) / 0.15) ** 2)
    d = 60.0 * np.linalg.cholesky(K + 1e-9 * np.eye(POINTS)) @ rng.standard_normal(POINTS)
    g = 6.0 * np.sin(5.0 * t)
    y = np.concatenate([d + g + rng.standard_normal(POINTS), d + rng.standard_normal(POINTS)])
    shared = 60.0**2 * np.block([[K, K], [K, K]])
    own = np.block([[K, 0 * K], [0 * K, K]])
    at = {"y": slice(0, 1), "J": slice(1, 2), "unnamed": slice(2, 2), "nuisance": slice(2, 2), "e0": slice(2, 3)}
    at["lattice"] = slice(3, 3)

    def gain(rows: np.ndarray) -> float:
        block = Block.of(
            "displacement",
            np.arange(len(rows)),
            np.eye(len(rows)) + shared[np.ix_(rows, rows)],
            own[np.ix_(rows, rows)],
        )
        columns = np.column_stack(
            [y, np.concatenate([np.ones(POINTS), np.zeros(POINTS)]), np.concatenate([g, 0.0 * g])]
        )[rows]
        priors = {"shots": NormalPrior.of_ranges(1)}
        s = System((block,), {}, columns, at, np.zeros(1), priors, np.eye(len(rows)), {}, np.ones(1), {})
        tester = ModelTester(s, known(np.array([0.5])))
        return tester.model(models()["e0"]).log_evidence - tester.model(models()[NONE]).log_evidence

    assert gain(np.arange(POINTS)) < 2.0
    assert gain(np.arange(2 * POINTS)) > 10.0


def two_birds(shift: float) -> System:
    """A shot and its baseline, whose one parameter differs by `shift` prior standard deviations."""
    rng, t = np.random.default_rng(2), np.linspace(0.0, 1.0, POINTS)
    wave, blank = 30.0 * np.sin(3.0 * t), np.zeros(POINTS)
    y = np.concatenate([(0.3 + shift) * wave, 0.3 * wave]) + rng.standard_normal(2 * POINTS)
    J = np.column_stack([np.concatenate([wave, blank]), np.concatenate([blank, wave])])
    at = {"y": slice(0, 1), "J": slice(1, 3), "unnamed": slice(3, 3), "nuisance": slice(3, 3)}
    at["lattice"] = slice(3, 3)
    block = Block.of("displacement", np.arange(2 * POINTS), np.eye(2 * POINTS), np.eye(2 * POINTS))
    columns, eye = np.column_stack([y, J]), np.eye(2 * POINTS)
    priors = {name: NormalPrior.of_ranges(1) for name in ("shots", "baseline")}
    return System((block,), {}, columns, at, np.zeros(2), priors, eye, {}, np.ones(1), {})


@pytest.mark.parametrize(("shift", "bird"), [(0.0, "same"), (0.1, "recipe"), (1.0, "other")])
def test_records_tell_how_far_the_birds_of_baseline_and_shot_lie_apart(shift: float, bird: str) -> None:
    tester = ModelTester(two_birds(shift), known(np.array([0.01])))
    logs = tester.by_bird(models()[NONE], ())
    shares = dict(zip(BIRDS, np.exp(logs - np.logaddexp.reduce(logs)), strict=True))
    assert max(shares, key=lambda name: shares[name]) == bird


@pytest.mark.parametrize("stated", BIRDS)
def test_a_stated_bird_is_the_only_one_that_is_weighed(stated: str) -> None:
    """Its marginal likelihood is that of the exact Gaussian with this distance between the birds."""
    s, apart = two_birds(0.1), birds_apart(stated)
    tester = ModelTester(s, known(np.array([0.01])), unnamed=(0.1,), apart=apart)
    found = tester.model(models()[NONE])
    share = 1.0 - apart[0] ** 2
    J = s.columns[:, s.at["J"]]
    C = (1.0 + 0.01**2) * np.eye(2 * POINTS) + J @ np.array([[1.0, share], [share, 1.0]]) @ J.T
    exact = log_density(s.columns[:, 0], C) + POINTS * np.log(2.0 * np.pi)
    assert found.log_evidence == pytest.approx(exact, abs=1e-6)
    by_bird = dict(zip(BIRDS, tester.by_bird(models()[NONE], ()), strict=True))
    assert by_bird == pytest.approx({bird: exact if bird == stated else -np.inf for bird in BIRDS}, abs=1e-6)


def test_an_unknown_bird_is_refused() -> None:
    with pytest.raises(UserError, match="available: auto, same, recipe, other"):
        birds_apart("twin")


@pytest.mark.parametrize(("other", "verdict"), [(0.66, "attributed"), (0.97, "ambiguous")])
def test_an_effect_that_every_likely_model_holds_is_attributed_whatever_may_be_beside_it(
    other: float, verdict: str
) -> None:
    presence = {NONE: 0.0, "e0": 1.0, "e1": other}
    assert verdict_of(presence, 0.001, 0.05, ("e0+e1", "e0")) == verdict


@pytest.mark.parametrize(("ahead", "verdict"), [(6.0, "attributed"), (4.0, "ambiguous")])
def test_what_other_simulations_could_turn_is_not_attributed(ahead: float, verdict: str) -> None:
    assert verdict_of({NONE: 0.0, "e0": 0.99, "e1": 0.01}, 0.001, 0.05, ("e0",), None, ahead) == verdict
