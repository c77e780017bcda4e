"""The linear-Gaussian core against closed forms, and on data simulated from the model itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp, softmax
from scipy.stats import binom, multivariate_normal, norm
from sklearn.gaussian_process.kernels import Matern

from birdstrike.data.errors import UserError
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis.conclusions.alarm import SHARES, alarm, required_discrepancy
from birdstrike.inversion.diagnosis.conclusions.answer import verdict_of
from birdstrike.inversion.diagnosis.conclusions.baseline import Baselines
from birdstrike.inversion.diagnosis.conclusions.before_and_after import Held, predicts_better
from birdstrike.inversion.diagnosis.conclusions.solver_update import _farther, _wanted, wanted_effects
from birdstrike.inversion.diagnosis.inference.evidence import (
    BIRDS,
    SIZES,
    UNNAMED,
    Evidence,
    ModelTester,
    birds_apart,
    credible_set,
    probabilities,
)
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis, Suspect
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Ranking, Standing, refit_pairs
from birdstrike.inversion.diagnosis.inference.system import (
    IN_COMMON,
    SHARE,
    TRENDS,
    Block,
    Linearisation,
    Places,
    System,
    _learnt_error,
    _trends,
    lattice_columns,
)
from birdstrike.inversion.diagnosis.model_file import _response
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions, Pipeline
from birdstrike.inversion.diagnosis.preparation.discrepancy import (
    STATED,
    Amplitudes,
    alike,
    beside_baselines,
    matern52,
    shape_of,
    started,
    unknown_or_stated,
)
from birdstrike.inversion.diagnosis.preparation.responses import (
    LINEAR,
    Change,
    Response,
    Uncertainty,
    scatter,
    up_to_date,
    updated,
)
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
from birdstrike.solver.case.case import load_case
from birdstrike.surrogate.run_scatter import common_factors
from tests.solver.target.test_mesh_file import table_with, written

POINTS, EFFECTS = 40, 5


class Stub:
    """A suspect as the evidence reads it."""

    def __init__(self, label: str, one_sided: bool = False) -> None:
        self.label, self.name, self.one_sided, self.limits = label, label, one_sided, (-5.0, 5.0)
        self.shots = ("shot",)


def system(seed: int, y: np.ndarray | None = None, size: float = 6.0) -> System:
    """A made-up shot of one kind of sensor: two parameters, an unnamed error, a nuisance, five effects, discrepancy."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, POINTS)
    waves = np.array(
        [np.sin((k + 1) * 2.0 * t + p) for k, p in zip(range(EFFECTS + 4), rng.uniform(0, 6, EFFECTS + 4), strict=True)]
    ).T
    U = 400.0 * np.exp(-0.5 * ((t[:, None] - t) / 0.15) ** 2)
    F = np.eye(POINTS)
    J, P, N, G = 10.0 * waves[:, :2], 5.0 * waves[:, 2:3], 3.0 * waves[:, -1:], size * waves[:, 3:-1]
    values = np.zeros(POINTS) if y is None else y
    columns = np.column_stack([values, J, P, N, G])
    at = {"y": slice(0, 1), "J": slice(1, 3), "unnamed": slice(3, 4), "nuisance": slice(4, 5)}
    at |= {f"e{i}": slice(5 + i, 6 + i) for i in range(EFFECTS)}
    at["lattice"] = slice(5 + EFFECTS, 5 + EFFECTS)
    block = Block.of("displacement", np.arange(POINTS), F, U)
    smooth = {"displacement": 50.0 * np.exp(-np.abs(t[:, None] - t) / 0.05)}
    priors = {"shots": NormalPrior.of_ranges(2)}
    return System((block,), smooth, columns, at, np.zeros(2), priors, np.eye(POINTS), {}, np.ones(2), {})


def log_density(y: np.ndarray, C: np.ndarray) -> float:
    mean: Any = np.zeros(len(y))
    spread: Any = C
    return float(multivariate_normal.logpdf(y, mean, spread))


def known(nodes: np.ndarray) -> Amplitudes:
    weights = np.full(len(nodes), -np.log(len(nodes)))
    return Amplitudes({"displacement": nodes}, {"displacement": weights}, {"displacement": 0.0}, "test")


def models(one_sided: bool = False) -> dict[str, Hypothesis]:
    found = {NONE: Hypothesis(NONE, (), 0.5, NONE)}
    for i in range(EFFECTS):
        found[f"e{i}"] = Hypothesis(f"e{i}", (Stub(f"e{i}", one_sided),), 0.5 / EFFECTS, f"f{i % 2}")  # pyright: ignore[reportArgumentType]
    return found


def covariance(s: System, a: float, unnamed: float, label: str | None = None, size: float = 1.0) -> np.ndarray:
    J, P = s.columns[:, s.at["J"]], unnamed * s.columns[:, s.at["unnamed"]]
    N = s.columns[:, s.at["nuisance"]]
    C = s.blocks[0].F + a**2 * s.blocks[0].U + J @ J.T + P @ P.T + N @ N.T
    return C if label is None else C + size**2 * s.columns[:, s.at[label]] @ s.columns[:, s.at[label]].T


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


def test_thinned_amplitudes_are_every_other_one_of_each_kind() -> None:
    nodes = {"displacement": np.arange(4.0), "strain": np.array([9.0]), "contact_force": np.arange(3.0)}
    found = Amplitudes(nodes, {kind: 0.0 * own for kind, own in nodes.items()}, {}, "test").thinned()
    assert found.combinations().tolist() == [[1.0, 9.0, 1.0], [3.0, 9.0, 1.0]]
    assert len(found.log_weights()) == 2


def test_of_some_kinds_the_kept_combinations_are_what_the_kept_ones_have_of_these_kinds() -> None:
    """A sensor held out of four kinds of which few combinations are kept: no other amplitudes, and none twice."""
    kinds = ("displacement", "strain", "contact_force", "acceleration")
    every = unknown_or_stated(kinds, {})
    kept = (0, 7, 300, 301, 1295)
    few = replace(every, kept=kept)
    for left in (("displacement", "strain", "acceleration"), ("contact_force",), kinds):
        own = few.only(set(left))
        expected = {tuple(row[[kinds.index(kind) for kind in left]]) for row in every.combinations()[list(kept)]}
        found = [tuple(row) for row in own.combinations()]
        assert len(found) == len(expected)
        assert set(found) == expected
        assert own.log_weights() == pytest.approx(np.full(len(found), -len(left) * np.log(6.0)))
    assert len(every.only({"strain"}).combinations()) == 6


def singles(every: Mapping[str, Hypothesis]) -> dict[str, Suspect]:
    """As `Ranking.singles`."""
    return {label: one.members[0] for label, one in every.items() if len(one.members) == 1}


def alarm_of(y: np.ndarray, nodes: np.ndarray) -> float:
    """p-value of none for a record of the made-up shot."""
    every = models() | {SOMETHING_ELSE: Hypothesis(SOMETHING_ELSE, (), 0.05, SOMETHING_ELSE)}
    tester = ModelTester(system(0, y), known(nodes))
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


def test_intervals_hold_what_another_lattice_moves() -> None:
    """Truths from the priors on lattices of their own: 95 % intervals hold parameters and magnitude, and did not."""
    rng, s, label = np.random.default_rng(5), system(0), "e1"
    signature = s.columns[:, s.at[label].start]
    near = 0.3 * np.column_stack([s.columns[:, s.at["J"]], signature])  # what a lattice moves looks like other values
    lattice = near @ rng.standard_normal((3, 4)) / 2.0
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    amplitudes, draws, held = known(np.array([1e-3])), 150, {False: 0.0, True: 0.0}
    for _ in range(draws):
        z, h = rng.standard_normal(2), rng.standard_normal()
        modelled = np.column_stack([s.columns[:, s.at["J"]], s.columns[:, s.at["nuisance"]], signature])
        y = modelled @ [*z, rng.standard_normal(), h] + lattice @ rng.standard_normal(4) + rng.standard_normal(POINTS)
        columns = np.column_stack([y, s.columns[:, 1:], lattice])
        for moved in held:
            places = at if moved else s.at
            tester = ModelTester(replace(s, columns=columns, at=places), amplitudes, unnamed=(1e-6,))
            found = tester.model(models()[label])
            errors = np.append(found.z[:2] - z, found.h - h)
            spread = np.sqrt(np.append(np.diag(found.z_cov), found.h_cov[0, 0]))
            held[moved] += (np.abs(errors) < 1.96 * spread).mean() / draws
    assert held[False] < 0.8
    assert 0.9 < held[True] < 0.99


@pytest.mark.parametrize("one_sided", [False, True])
def test_an_interval_holds_an_effect_whose_signature_is_hardly_known(one_sided: bool) -> None:
    """Truths from the priors: signature as learnt off by its stated error, which is as large as the signature.

    The size's posterior is not Gaussian, because the error grows with the size.
    """
    rng, s, label, draws = np.random.default_rng(8), system(0, size=1.0), "e1", 300
    model = models(one_sided)[label]
    (one,) = model.members
    learnt = s.columns[:, s.at[label].start]
    errors = np.array([np.sin(f * np.linspace(0.0, 1.0, POINTS) + 1.0) for f in (3.0, 9.0, 17.0)]).T
    first = s.columns.shape[1]
    at = {**s.at, f"error of {label}": slice(first, first + 3)}
    amplitudes, held = known(np.array([1e-3])), 0.0
    for _ in range(draws):
        h = np.inf
        while abs(h) > one.limits[1]:
            h = rng.choice(SIZES) * rng.standard_normal()
        h = abs(h) if one_sided else h
        true = learnt + errors @ rng.standard_normal(3)
        z = rng.standard_normal(2)
        y = s.columns[:, s.at["J"]] @ z + s.columns[:, s.at["nuisance"]][:, 0] * rng.standard_normal() + h * true
        columns = np.column_stack([y + rng.standard_normal(POINTS), s.columns[:, 1:], errors])
        tester = ModelTester(replace(s, columns=columns, at=at), amplitudes, unnamed=(1e-6,))
        low, _, high = tester.quantiles(tester.model(model))
        held += (low <= h <= high) / draws
    assert held == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("channels", [1, 16])
def test_what_other_models_answer_is_not_averaged_away_by_many_sensors(channels: int) -> None:
    """The size of a signature as all channels see it together; over time and channels its variance is SHARE squared."""
    t = np.linspace(0.0, 1.0, 200)
    record = SimpleNamespace(
        values=np.zeros(200 * channels),
        middle=np.tile(t, channels),
        channel=np.repeat(np.arange(channels), 200),
        traces=[SimpleNamespace(name=str(i)) for i in range(channels)],
    )
    shot: Any = SimpleNamespace(record=record, setup=SimpleNamespace(time=t))
    signature = np.ones(200 * channels)
    (parts,) = _trends(Linearisation([shot], Places({}, {})), signature, SHARE)
    errors = np.hstack([*parts.values()])
    assert (errors**2).sum(axis=1).mean() == pytest.approx(SHARE**2, rel=0.02)
    seen = float(((signature @ errors) ** 2).sum()) / len(signature) ** 2
    assert seen == pytest.approx(SHARE**2 / TRENDS * (IN_COMMON + (1.0 - IN_COMMON) / channels), rel=0.02)


def test_a_sharp_interval_is_that_of_the_gaussian() -> None:
    s = system(0)
    s = system(0, 2.0 * s.columns[:, s.at["e1"].start])
    tester = ModelTester(s, known(np.array([0.01])))
    found = tester.model(models()["e1"])
    low, _, high = tester.quantiles(found)
    sd = float(np.sqrt(found.h_cov[0, 0]))
    assert (low, high) == pytest.approx((found.h[0] - 1.96 * sd, found.h[0] + 1.96 * sd), abs=0.05 * sd)


def test_draws_scatter_as_the_intervals_say_without_the_lattice() -> None:
    s, rng = system(0), np.random.default_rng(2)
    lattice = 0.3 * s.columns[:, s.at["J"]] @ rng.standard_normal((2, 4))
    y = s.columns[:, s.at["e1"].start] + rng.standard_normal(POINTS)
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    moved = replace(s, columns=np.column_stack([y, s.columns[:, 1:], lattice]), at=at)
    tester, model = ModelTester(moved, known(np.array([1e-3])), unnamed=(1e-6,)), models()["e1"]
    found = ModelTester(replace(moved, at=s.at), known(np.array([1e-3])), unnamed=(1e-6,)).model(model)
    assert (np.diag(found.z_cov) < np.diag(tester.model(model).z_cov)).all()
    z, h, _ = tester.draws(found, 4000, rng)
    assert np.cov(z.T) == pytest.approx(found.z_cov, abs=0.1 * float(found.z_cov.max()))
    assert h.std() == pytest.approx(float(np.sqrt(found.h_cov[0, 0])), rel=0.1)


def test_shots_share_the_mean_of_what_another_lattice_moves() -> None:
    rng = np.random.default_rng(4)
    one, other = 1.0 + rng.standard_normal((4, 6)), 1.0 + rng.standard_normal((3, 5))
    columns = lattice_columns([one, other, np.zeros((0, 2))])
    covariance = columns @ columns.T
    np.testing.assert_allclose(covariance[:6, :6], one.T @ one / 4.0)
    np.testing.assert_allclose(covariance[6:11, 6:11], other.T @ other / 3.0)
    np.testing.assert_allclose(covariance[:6, 6:11], np.outer(one.mean(axis=0), other.mean(axis=0)))
    assert not covariance[11:].any()


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


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("true", [(0.0, 0.3), (-0.1, -0.1), (0.1, -0.05)])
def test_beside_a_one_sided_magnitude_the_other_of_a_pair_is_its_mean_too(
    true: tuple[float, float], both: bool
) -> None:
    """Exact by quadrature where one is one-sided; of two, which are cut off one after the other, within a tenth."""
    rng, first = np.random.default_rng(2), system(0)
    G = first.columns[:, [first.at["e1"].start, first.at["e2"].start]]
    y = G @ true + rng.standard_normal(POINTS)
    tester = ModelTester(system(0, y), known(np.array([0.01])), unnamed=(0.1,))
    pair: Any = (Stub("e1", True), Stub("e2", both))
    found = tester.model(Hypothesis("e1+e2", pair, 0.1, "pairs"))
    C = covariance(first, 0.01, 0.1)
    S, b = G.T @ np.linalg.solve(C, G), G.T @ np.linalg.solve(C, y)
    axes = np.linspace(0.0, 1.0, 2001), np.linspace(0.0 if both else -1.0, 1.0, 2001)
    A, B = np.meshgrid(*axes, indexing="ij")
    logs = A * b[0] + B * b[1] - 0.5 * (S[0, 0] * A**2 + 2.0 * S[0, 1] * A * B + S[1, 1] * B**2)
    logs += np.logaddexp.reduce([norm.logpdf(A, scale=sd) + norm.logpdf(B, scale=sd) for sd in SIZES], axis=0)
    density = np.exp(logs - logs.max())

    def integral(values: np.ndarray) -> float:
        return float(np.trapezoid(np.trapezoid(values * density, axes[1]), axes[0]))

    expected = np.array([integral(A), integral(B)]) / integral(np.ones_like(A))
    assert found.h == pytest.approx(expected, rel=0.1 if both else 2e-3, abs=1e-4)


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
        standings={label: SimpleNamespace(at_best=value) for label, value in best.items()},
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
    suspects = [
        Suspect(f"speed@{shot}", "speed", "impact", (shot,), response=setup.responses["speed"])  # pyright: ignore[reportArgumentType]
        for shot in "ab"
    ]
    every = {one.label: Hypothesis(one.label, (one,), 0.1, "impact") for one in suspects}
    ranking: Any = SimpleNamespace(
        models=every,
        singles={label: one.members[0] for label, one in every.items()},
        shares={NONE: 0.01} | dict.fromkeys(every, 0.4),
        standings={label: SimpleNamespace(at_best=-100.0) for label in every},
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
    clamp = Suspect("clamp", "clamp", "support", ("a", "b", "c"), response=slow.responses["clamp"])  # pyright: ignore[reportArgumentType]
    every = {"clamp": Hypothesis("clamp", (clamp,), 0.1, "support")}
    ranking: Any = SimpleNamespace(
        models=every,
        singles={"clamp": clamp},
        shares={NONE: 0.01, "clamp": 0.9},
        standings={"clamp": SimpleNamespace(at_best=-100.0)},
        evidence={NONE: SimpleNamespace(log_evidence=-130.0), "clamp": SimpleNamespace(h=np.ones(1))},
        problem=SimpleNamespace(shots=shots),
    )
    assert [(label, shot.name) for label, shot in wanted_effects(ranking)] == [("clamp", "a"), ("clamp", "c")]


def test_baselines_tell_of_the_sensors_that_they_show() -> None:
    """A kind that errs by more than 5 % in the baseline, or is not in it, stays as unknown as in a lone record."""
    kinds = ("displacement", "strain", "reaction_force")
    found = beside_baselines(kinds, {"displacement": 0.004, "strain": 0.08}, 1, {"reaction_force": 0.02})
    lone = unknown_or_stated(kinds, {"reaction_force": 0.02}, several=True)
    assert found.learnt == {"displacement"}
    assert found.fixed["displacement"] == pytest.approx(2.0 * np.sqrt(0.5) * 0.004)
    for kind in kinds[1:]:
        np.testing.assert_array_equal(found.nodes[kind], lone.nodes[kind])
        assert found.fixed[kind] == lone.fixed[kind]
    assert found.nodes["reaction_force"].tolist() == [0.02]
    for weights in found.log_prior.values():
        assert np.exp(weights).sum() == pytest.approx(1.0)
    assert "; strain unknown" in found.source
    assert "; reaction force stated in the case" in found.source


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


def test_discrepancy_starts_at_contact() -> None:
    t = np.linspace(0.0, 1e-3, 30)
    K = started(t, t, 1e-4, 2e-4)
    assert np.allclose(K[t <= 1e-4], 0.0)
    assert K[-1, -1] == pytest.approx(1.0, abs=1e-3)
    assert np.linalg.eigvalsh(K).min() > -1e-9


@pytest.mark.parametrize("length", [0.08, 0.2])
def test_a_process_gives_back_its_correlation_time(length: float) -> None:
    """300 draws of a Matern 5/2 process over a second; its length is known from their slopes to a tenth."""
    time: np.ndarray = np.linspace(0.0, 1.0, 401)
    covariance = Matern(length, nu=2.5)(time[:, None])
    draws = np.random.default_rng(0).multivariate_normal(np.zeros(401), covariance, 300, method="eigh")
    assert shape_of(draws, np.sin(np.pi * time), time).length == pytest.approx(length, rel=0.1)


def test_shots_with_the_same_identified_parameters_share_their_discrepancy() -> None:
    weight = np.array([0.0, 3.0])
    assert alike(np.array([0.0, 0.3]), np.array([1.0, 0.3]), weight) == pytest.approx(1.0)
    assert alike(np.array([0.0, 0.0]), np.array([0.0, 1.0]), weight) == pytest.approx(float(matern52(np.array(3.0))))


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
    found = {name: Standing(replace(blank, hypothesis=one, log_evidence=0.0), fit) for name, one in singles.items()}
    found["a"] = Standing.refitted(fit)
    found |= {n: Standing(replace(blank, hypothesis=tried[n], log_evidence=pairs[n]), fit) for n in pairs}
    problem = Refits({"a+b": -6.0, "a+c": 1.0, "a+d": 50.0}, {n: one.evidence for n, one in found.items()})
    refitted = refit_pairs(problem, list(tried.values()), found)  # pyright: ignore[reportArgumentType]
    assert problem.asked == ["a+b", "a+c"]
    assert {name: one.evidence.log_evidence for name, one in refitted.items()} == {"a+b": 4.0, "a+c": 10.0}
    assert all(one.own and one.fit.evidence is one.evidence for one in refitted.values())


def response(signature: np.ndarray, **more: Any) -> Response:
    """Of one parameter and one channel; its signature does not change with the parameter."""
    q, slopes = len(signature), np.zeros((1, len(signature)))
    error = Uncertainty(0.1 * np.ones((1, q)), np.diag([1.0, 0.0])[:, :, None])
    scatter = np.zeros_like(error.spread)
    return Response(None, signature, slopes, np.zeros(1), (error,), scatter, **more)  # pyright: ignore[reportArgumentType]


def simulated(old: Response, b: float, pairs: np.ndarray, z: np.ndarray | None = None) -> Response:
    """The response after these pairs alone."""
    return updated(old, Change("a", b, np.zeros(1) if z is None else z, pairs))


def test_a_response_that_bends_and_its_inverse() -> None:
    bent = response(np.ones(4), knots=((-5.0, -2.0), (0.0, 0.0), (1.0, 1.6), (3.0, 3.0)))
    assert bent.h(1.0) == pytest.approx(1.6)
    assert bent.h(2.0) == pytest.approx(2.3)
    assert bent.b(bent.h(2.3)) == pytest.approx(2.3)


def test_simulations_where_an_effect_matters_bend_its_response_to_them() -> None:
    """Two plausible sizes change the curves by three times the signature: the response is steeper than learnt."""
    old = response(np.ones(10))
    changes = 3.0 + 0.01 * np.random.default_rng(0).standard_normal((4, 10))
    new = simulated(old, 2.0, changes)
    assert new.h(2.0) == pytest.approx(3.0, abs=0.05)
    assert np.allclose(new.h(2.0) * new.signature, changes.mean(axis=0))
    assert new.h(-1.0) == old.h(-1.0)


def test_each_sense_of_an_effect_is_what_its_own_simulations_show() -> None:
    """A bird as much slower as another is faster moves the curves in another shape: one signature served both."""
    rng, t = np.random.default_rng(0), np.linspace(0.0, 1.0, 30)
    learnt = replace(response(1.0 + t), known=SimpleNamespace(one_sided=False))  # pyright: ignore[reportArgumentType]
    faster, slower = (
        Change("a", b, np.zeros(1), b * shape + 0.01 * rng.standard_normal((8, 30)))
        for b, shape in ((2.0, 1.0 + 1.5 * t), (-2.0, 1.0 + 0.5 * t))
    )
    alone = up_to_date(learnt, [faster])
    np.testing.assert_array_equal(alone.sided(-1.0).signature, learnt.signature)
    both = up_to_date(learnt, [faster, slower])
    for change in (faster, slower):
        own = both.sided(change.b)
        np.testing.assert_allclose(both.h(change.b) * own.at(np.zeros(1)), change.pairs.mean(axis=0), atol=0.02)
    np.testing.assert_array_equal(both.sided(1.0).signature, alone.sided(1.0).signature)
    assert both.sided(0.0) is both
    assert both.simulated == (2.0, -2.0)
    setup: Any = SimpleNamespace(split=lambda rows: {"a": rows})
    stored = _response(setup, both)
    np.testing.assert_array_equal(stored["signature"]["a"], both.sided(1.0).signature)
    np.testing.assert_array_equal(stored["negative"]["signature"]["a"], both.sided(-1.0).signature)
    assert "negative" not in _response(setup, learnt)


def in_two_cases() -> tuple[Suspect, list[Any]]:
    """A clamp with a shot of each of two cases: at 2 plausible sizes one answers with 1.5, the other with 0.5."""
    known: Any = SimpleNamespace(one_sided=True, least=0.0, name="clamp", size=1.0)
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
    return Suspect("clamp", "clamp", "support", ("a", "b"), response=first), shots


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
    errors = _learnt_error(one, Linearisation((first, other), places), np.ones(8))
    assert not (errors[:4] @ errors[4:].T).any()
    other.setup = first.setup
    errors = _learnt_error(one, Linearisation((first, other), places), np.ones(8))
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


def test_simulations_that_contradict_a_signature_leave_it_as_it_was() -> None:
    old = response(np.ones(10))
    assert simulated(old, 2.0, -3.0 * np.ones((4, 10))) is old


def test_the_scatter_of_simulations_does_not_pass_for_bending() -> None:
    """A noisy signature explains a change only in part; the rest is noise, and the magnitude stays what it is."""
    rng = np.random.default_rng(0)
    old = response(np.ones(200) + 0.1 * rng.standard_normal(200))
    new = simulated(old, 2.0, 2.0 * np.ones(200) + 0.4 * rng.standard_normal((3, 200)))
    assert new.h(2.0) == pytest.approx(2.0)
    assert new.simulated == (2.0,)


def test_simulations_at_one_place_leave_what_is_known_of_the_change_with_the_parameters() -> None:
    """The posterior is that of a Gaussian conditioned on the sum of signature and slope at that place."""
    prior = np.array([[0.04, 0.01], [0.01, 0.09]])
    first = response(np.ones(50))
    error = Uncertainty(np.ones((1, 50)), prior[:, :, None])
    old = replace(first, slopes=np.full((1, 50), 0.5), uncertainties=(error,))
    changes = np.array([1.9, 2.0, 2.1])[:, None] * np.ones(50)
    z, far = np.array([0.4]), np.array([-0.5])
    new = simulated(old, 1.5, changes, z)
    assert new.h(1.5) == pytest.approx(1.5)
    a, noise = np.array([1.0, 0.4]), 0.1**2 / 3.0 / 1.5**2
    gain = prior @ a / (a @ prior @ a + noise)
    mean = np.array([1.0, 0.5]) + gain * (2.0 / 1.5 - a @ [1.0, 0.5])
    left = prior - np.outer(gain, a @ prior)
    for place in (z, far):
        b = np.array([1.0, place[0]])
        assert np.allclose(new.at(place), b @ mean)
        variance = (new.error_at(place) ** 2).sum(axis=0) + new.scatter_at(place) ** 2
        assert np.allclose(variance, b @ left @ b)


def test_the_error_of_a_mean_of_few_pairs_is_known_from_the_pairs_of_all_effects() -> None:
    """Scatter that is half smooth in time, half not. Beside a record's own noise, the error of eight pairs' mean is
    what the pairs of eight effects say to a third, shrunk as a shot shrinks them; its own pairs say a tenth of it."""
    rng, t, record = np.random.default_rng(4), np.linspace(0.0, 1.0, 100), 0.2
    L = np.linalg.cholesky(matern52(np.abs(t[:, None] - t) / 0.1) + np.eye(100))

    def change() -> Change:
        return Change("a", 1.0, np.zeros(1), rng.standard_normal((8, 100)) @ L.T)

    changes = [change() for _ in range(8)]
    errors = np.array([change().pairs.mean(axis=0) for _ in range(100)])

    def weighed(covariance: np.ndarray) -> float:
        """Mean square of the errors, in the metric that they have beside the record's noise, to what was stated."""
        inverse = np.linalg.inv(record**2 * np.eye(100) + covariance)
        return float(np.einsum("ni,ij,nj->n", errors, inverse, errors).mean() / np.trace(inverse @ covariance))

    size = float((np.array([one.apart for one in changes]) ** 2).mean() * 8.0 / 7.0 / 8.0)
    rows = common_factors([scatter(changes, 1)])[0]
    own = scatter(changes[:1], 1)
    assert (scatter(changes, 1) ** 2).mean() == pytest.approx(1.0)
    assert weighed(size * rows.T @ rows) == pytest.approx(1.0, rel=0.33)
    assert weighed(size * own.T @ own / 8.0) > 10.0


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


@pytest.mark.parametrize(("stated", "expected"), [("same", True), ("other", False), ("auto", False)])
def test_records_contradict_a_stated_bird_that_they_make_unlikely(stated: str, expected: bool) -> None:
    shot: Any = SimpleNamespace(name="baseline clean")
    own, options = SimpleNamespace(name="shot"), DiagnosisOptions(baseline_bird=stated)
    pipeline: Any = Pipeline((own,), Baselines((shot,)), options, None)  # pyright: ignore[reportArgumentType]
    ranking: Any = SimpleNamespace(birds={"same": 0.001, "recipe": 0.049, "other": 0.95}, same_bird=1.0)
    assert pipeline.contradicted(ranking) is expected
    assert pipeline._same_bird(ranking) == (0.0 if expected else 1.0)  # 0: nothing is attributed


def test_a_diagnosis_says_that_shells_of_a_file_are_not_refined(tmp_path: Path) -> None:
    case = load_case(table_with(written(tmp_path / "panel.inp")))
    space = ParameterSpace(("MU",), ("Pa s",), np.array([0.0]), np.array([1.0]), ("",))
    plan = SimpleNamespace(case=case, lattices=dict, space=space, prior=NormalPrior.of_ranges(1))
    setup = SimpleNamespace(plan=plan, left_out=(), lattice_moves={}, channels=(), learnt={})
    shot: Any = SimpleNamespace(name="a", setup=setup, nuisances={}, record=SimpleNamespace(warnings=()))
    pipeline: Any = Pipeline((shot,), Baselines(()), DiagnosisOptions(), None)  # pyright: ignore[reportArgumentType]
    fit = SimpleNamespace(interval=lambda *_: (np.array([0.5]), np.array([0.1])))
    problem = SimpleNamespace(known=SimpleNamespace(source=STATED))
    ranking: Any = SimpleNamespace(problem=problem, same_bird=None, fits={NONE: fit})
    decision: Any = SimpleNamespace(ranking=ranking, chosen=None, failed={}, fit_warnings=())
    (line,) = pipeline._warnings(decision)
    assert line.startswith("target.mesh = panel.inp: shells from a file are not refined")


def test_an_unknown_bird_is_refused() -> None:
    with pytest.raises(UserError, match="available: auto, same, recipe, other"):
        birds_apart("twin")


@pytest.mark.parametrize(("same_bird", "verdict"), [(None, "attributed"), (0.9, "attributed"), (0.1, "ambiguous")])
def test_beside_a_baseline_of_another_bird_nothing_is_attributed(same_bird: float | None, verdict: str) -> None:
    presence = {NONE: 0.01, "e0": 0.97, "e1": 0.02}
    assert verdict_of(presence, 0.001, 0.05, ("e0",), same_bird) == verdict


@pytest.mark.parametrize(("other", "verdict"), [(0.66, "attributed"), (0.97, "ambiguous")])
def test_an_effect_that_every_likely_model_holds_is_attributed_whatever_may_be_beside_it(
    other: float, verdict: str
) -> None:
    presence = {NONE: 0.0, "e0": 1.0, "e1": other}
    assert verdict_of(presence, 0.001, 0.05, ("e0+e1", "e0")) == verdict


@pytest.mark.parametrize(("ahead", "verdict"), [(6.0, "attributed"), (4.0, "ambiguous")])
def test_what_other_simulations_could_turn_is_not_attributed(ahead: float, verdict: str) -> None:
    assert verdict_of({NONE: 0.0, "e0": 0.99, "e1": 0.01}, 0.001, 0.05, ("e0",), None, ahead) == verdict


SCORES = {"speed": 11.0, "speed+gain": 12.0, "mass": 4.0, "gain": 6.0, "clock": 9.0, "mass+gain": 8.0}


@pytest.mark.parametrize(("label", "ahead"), [("speed", 3.0), ("gain", -1.0)])
def test_lead_over_other_effects_counts_models_that_hang_on_simulations(label: str, ahead: float) -> None:
    """The clock's exact signature is no rival of the gain's, but one of the speed's."""
    effects = {
        name: SimpleNamespace(label=name, response=name in ("speed", "mass")) for name in SCORES if "+" not in name
    }
    scores = SCORES | ({"speed": 13.0} if label == "gain" else {})
    models: Any = {name: SimpleNamespace(members=[effects[one] for one in name.split("+")]) for name in scores}
    standings: Any = {name: SimpleNamespace(score=score) for name, score in scores.items()}
    problem: Any = None
    assert Ranking(problem, models, standings).ahead(label) == ahead


def test_an_effect_is_there_alone_or_in_any_pair() -> None:
    """Four models that explain the record alike have their priors' shares: 0.25 alone and 0.2 in a pair are 0.45."""
    priors = {NONE: 0.45, "speed": 0.25, "gain": 0.1, "speed+gain": 0.2}
    models: Any = {
        name: SimpleNamespace(prior=prior, members=[Stub(one) for one in name.split("+") if one != NONE])
        for name, prior in priors.items()
    }
    standings: Any = {
        name: SimpleNamespace(evidence=SimpleNamespace(log_evidence=3.0, hypothesis=model))
        for name, model in models.items()
    }
    nothing: Any = None
    assert Ranking(nothing, models, standings).presence == pytest.approx({NONE: 0.45, "speed": 0.45, "gain": 0.3})


@pytest.mark.parametrize(("gained", "same"), [(0.0, 2.0 / 1002.0), (400.0, 2.0 / (2.0 + 1000.0**0.2))])
def test_beside_an_effect_that_explains_very_much_the_birds_are_less_sure(gained: float, same: float) -> None:
    """Three equal shares, another bird a thousand times likelier: an effect of 400 nats leaves a fifth of the log."""
    found = {NONE: -gained, "speed": 0.0} if gained else {NONE: 0.0}
    evidence = {n: SimpleNamespace(log_evidence=e, hypothesis=SimpleNamespace(prior=0.5)) for n, e in found.items()}
    birds = np.array([0.0, 0.0, np.log(1000.0)])
    standings: Any = {n: SimpleNamespace(evidence=one, by_bird=birds) for n, one in evidence.items()}
    nothing: Any = None
    assert Ranking(nothing, nothing, standings).same_bird == pytest.approx(same)


def test_a_part_that_holds_all_that_an_effect_acts_on_does_not_judge_it() -> None:
    """A fault of one sensor cannot be told from the others, nor an effect of one shot from the other shots."""
    parts = ("time_block", "channel a", "channel b", "shot one")
    before = [Held.of(name, np.ones(9), np.ones(9), "one") for name in parts]
    after = [
        Held.of(name, np.full(9, off), np.ones(9), "one") for name, off in zip(parts, (0.9, 9, 0.9, 9), strict=True)
    ]
    fault: Any = SimpleNamespace(shots=("one",), fault=SimpleNamespace(sensors=("a",)))
    of_all: Any = SimpleNamespace(shots=("one", "two"), fault=None)
    of_one_sensor: Any = SimpleNamespace(shots=("one", "two"), fault=SimpleNamespace(sensors=("a",)))
    assert predicts_better(fault, before, after)
    assert not predicts_better(of_all, before, after)
    assert not predicts_better(of_one_sensor, before, after)  # shot one's own record could tell
    assert predicts_better(of_all, before[:1], after[:1])
    assert predicts_better(of_all, [], [])  # nothing was held out


def test_a_model_that_overstates_its_errors_is_not_the_better_for_it() -> None:
    """Residuals of 0.3 beside stated errors of 2 are likelier under stated errors of 0.3."""
    residual = 0.3 * np.random.default_rng(0).standard_normal(500)
    before, after = (Held.of("time_block", residual, np.full(500, sd), "one") for sd in (2.0, 0.3))
    assert before.error < 0.2 < 0.9 < after.error
    of_all: Any = SimpleNamespace(shots=("one", "two"), fault=None)
    assert predicts_better(of_all, [before], [after])
    assert not predicts_better(of_all, [after], [before])
