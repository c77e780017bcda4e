"""The sampled posterior against the Gaussian written out in full, and against the linearised one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.likelihood import Likelihood
from birdstrike.inversion.estimation.posterior import CONVERGED_RHAT, Posterior, Sampling, _agreement, sample
from birdstrike.inversion.identifiability.summary import posterior_figures
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator
from birdstrike.surrogate.gaussian_process import GaussianProcess, ProcessStack
from tests.inversion.stand_in import CHANNEL, NAMES, TIMES, record, truth

NOISE = 5e-5


def calibrator(dataset: Dataset, emulator: Emulator, sigma: float = 0.0, known: np.ndarray | None = None) -> Calibrator:
    observations = observe(record(truth(0.45), TIMES, noise=NOISE, t0=0.3 * sigma), dataset, {CHANNEL: NOISE})
    return Calibrator(
        CurveModel(emulator, observations, known), parameter_coordinates(dataset, emulator.regions), sigma
    )


@pytest.mark.parametrize("sigma", [0.0, 0.05e-3], ids=["known clock", "unknown clock"])
def test_density_is_that_of_the_full_gaussian(dataset: Dataset, emulator: Emulator, sigma: float) -> None:
    """Differences of the log posterior between points, clocks included, with a known error common to all instants."""
    problem = calibrator(dataset, emulator, sigma, known=np.linspace(2e-5, 8e-5, 12)[:, None])
    modes, rng = problem.fit(), np.random.default_rng(0)
    tau = modes[0].t0 / sigma if sigma else 0.0
    spread = 0.5 * np.sqrt(np.diag(modes[0].covariance)[:-1])
    taus = tau + (0.2 * np.arange(-3, 3) if sigma else np.zeros(6))
    points = np.column_stack([modes[0].z + spread * rng.normal(size=(6, 4)), taus])
    found = Likelihood.of(problem, modes).log_posterior(points)
    model, box = problem.model, problem.coordinates.boxes[0]
    expected = []
    for p in points:
        theta = problem.coordinates.theta(p[:-1], box)
        factor = model.error_factor(theta, p[-1] * sigma)
        covariance = np.diag(model.noise_at(modes[0].t0) ** 2) + factor @ factor.T
        curve = model.curves(model.scores(theta[None]), p[-1] * sigma)[0]
        likelihood = multivariate_normal.logpdf(model.observations.values, curve, covariance)  # pyright: ignore[reportArgumentType]
        prior = problem.coordinates.prior.deviations(p[:-1]) ** 2
        expected.append(likelihood - 0.5 * (prior.sum() + p[-1] ** 2))
    np.testing.assert_allclose(found - found[0], np.array(expected) - expected[0], atol=2e-2)


def test_where_the_emulator_errs_more_the_density_has_the_larger_determinant(
    dataset: Dataset, emulator: Emulator
) -> None:
    """Two places, in halves of a range where the runs were missed by as much as the noise and by ten times as much."""
    curves = emulator.channels[CHANNEL]
    processes = []
    for one in curves.processes:
        above = one.missed.points[:, 0] * one.missed.lengths[0] > 0.5
        size = 5e-5 / np.abs(curves.basis[0]).max()
        missed = replace(one.missed, squares=np.where(above, 10.0 * size, size) ** 2, locality=128.0)
        processes.append(replace(one, missed=missed))
    even = replace(curves, processes=tuple(processes), nearby=replace(curves.nearby, locality=0.0))
    problem = calibrator(dataset, replace(emulator, channels={CHANNEL: even}))
    points = np.array([[0.2, 0.5, 0.5, 0.5, 0.0], [0.8, 0.5, 0.5, 0.5, 0.0]])
    model, expected, determinants = problem.model, [], []
    for z in points[:, :4]:
        theta = problem.coordinates.theta(z, problem.coordinates.boxes[0])
        factor = model.error_factor(theta, 0.0)
        covariance = np.diag(model.noise_at(0.0) ** 2) + factor @ factor.T
        likelihood = multivariate_normal.logpdf(model.observations.values, model.curve(theta, 0.0), covariance)  # pyright: ignore[reportArgumentType]
        expected.append(likelihood - 0.5 * (problem.coordinates.prior.deviations(z) ** 2).sum())
        determinants.append(np.linalg.slogdet(covariance)[1])
    found = Likelihood.of(problem, problem.fit()).log_posterior(points)
    assert determinants[1] - determinants[0] > 3.0  # else nothing is tested
    assert found[1] - found[0] == pytest.approx(expected[1] - expected[0], abs=1e-2)


def test_draws_agree_with_the_linearised_posterior_where_the_data_are_good(
    dataset: Dataset, emulator: Emulator
) -> None:
    problem = calibrator(dataset, emulator, 0.05e-3)
    modes = problem.fit()
    drawn = sample(problem, modes)
    assert drawn.converged
    assert not drawn.warnings
    linear = intervals(modes)
    width = linear[:, 1] - linear[:, 0]
    np.testing.assert_allclose(drawn.interval(), linear, atol=0.15 * width.max())
    figures = posterior_figures(drawn, problem.coordinates)
    assert figures.names == (*NAMES, "time_offset")
    assert all(0.5 < figures.contraction[name] <= 1.0 for name in NAMES[:3])
    np.testing.assert_allclose(np.diag(figures.correlation), 1.0)


def test_draws_half_as_wide_as_the_prior_leave_a_quarter_of_its_variance(dataset: Dataset, emulator: Emulator) -> None:
    coordinates = calibrator(dataset, emulator).coordinates
    before = np.random.default_rng(0).normal(0.5, np.sqrt(1.0 / 12.0), (400_000, 4))
    z = 0.5 + 0.5 * (before[((before > 0.0) & (before < 1.0)).all(axis=1)] - 0.5)
    theta, rest = truth(z), np.zeros(4)
    mode = Mode(z[0], theta[0], 0.0, np.eye(5), 0.0, np.zeros(0), coordinates.boxes[0])
    figures = posterior_figures(Posterior(z, theta, np.zeros(len(z)), rest, rest, 0.5, 1, mode), coordinates)
    assert list(figures.contraction.values()) == pytest.approx([0.75] * 4, abs=5e-3)


def test_same_seed_same_draws_and_unsettled_chains_are_said(dataset: Dataset, emulator: Emulator) -> None:
    problem = calibrator(dataset, emulator)
    modes, short = problem.fit(), Sampling(walkers=16, chunk=20, most=20)
    first, second = (sample(problem, modes, 3, short) for _ in range(2))
    np.testing.assert_array_equal(first.z, second.z)
    assert not first.converged
    assert "have not settled after 20 steps" in first.warnings[0]


def test_no_draw_leaves_the_boxes(dataset: Dataset, emulator: Emulator) -> None:
    problem = calibrator(dataset, emulator)
    half = tuple(replace(b, highs=np.full(4, 0.5), theta_highs=truth(0.5)) for b in problem.coordinates.boxes)
    problem = replace(problem, coordinates=replace(problem.coordinates, boxes=half))
    drawn = sample(problem, problem.fit(), 0, Sampling(walkers=16, chunk=40, most=40))
    assert (drawn.z <= 0.5).all()
    assert drawn.theta.max(axis=0) == pytest.approx(truth(0.5), rel=0.05)


def test_processes_together_predict_what_each_predicts_alone() -> None:
    rng = np.random.default_rng(0)
    places = rng.random((9, 3))
    runs = [rng.random((25, 3))] * 2 + [rng.random((12, 3))]
    processes = [
        GaussianProcess.fit(u, np.sin((3.0 + i) * u[:, i]) + 0.05 * rng.normal(size=len(u)), seed=0)
        for i, u in enumerate(runs)
    ]
    groups = ProcessStack.groups(processes)
    assert [places for places, _ in groups] == [[0, 1], [2]]
    for group, stack in groups:
        for column, i in enumerate(group):
            for together, alone in zip(stack.predict(places), processes[i].predict(places), strict=True):
                np.testing.assert_allclose(together[:, column], alone, rtol=1e-9, atol=1e-13)


def test_the_stated_variance_has_student_s_inflation() -> None:
    """Of 25 runs that count alike: (t_0.975(25) / 1.96)^2 with 2.0595 from the tables."""
    rng = np.random.default_rng(0)
    u = rng.random((25, 3))
    fitted = GaussianProcess.fit(u, np.sin(3.0 * u[:, 0]), seed=0)
    process = replace(fitted, missed=replace(fitted.missed, squares=np.ones(25), locality=0.0))
    assert process.variance(u[:1]) == pytest.approx([1.1042], abs=1e-4)


def test_chains_that_still_drift_do_not_agree() -> None:
    """All walkers of all ensembles drift by one standard deviation: split R-hat compares halves in time."""
    settled = np.random.default_rng(0).normal(size=(2, 48, 75, 1))
    drifting = settled + np.linspace(-0.5, 0.5, 75)[:, None]
    assert _agreement(settled)[0][0] < CONVERGED_RHAT < _agreement(drifting)[0][0]
