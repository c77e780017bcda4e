"""Levenberg-Marquardt: the step, the damping schedule and the stopping rules of `trainlm`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.surrogate.network import nguyen_widrow
from birdstrike.surrogate.trainers.levenberg_marquardt import Linearised, Settings, _lower, train
from birdstrike.surrogate.trainers.training import Samples
from tests.surrogate.surface import SHAPE, smooth_surface


@pytest.mark.parametrize("runs", [8, 60], ids=["dual: fewer residuals than weights", "primal: more"])
def test_step_solves_the_damped_normal_equations(runs: int) -> None:
    samples, start, mu = smooth_surface(runs), nguyen_widrow(SHAPE, 0), 0.01
    here = Linearised.at(SHAPE, start, samples, np.zeros((runs, 1, SHAPE.weights)))
    assert len(here.gram) == min(runs, SHAPE.weights)
    hessian = here.rows.T @ here.rows + mu * np.eye(SHAPE.weights)
    np.testing.assert_allclose(
        here.step(mu), np.linalg.solve(hessian, -here.rows.T @ here.error), rtol=1e-7, atol=1e-10
    )


def test_step_survives_a_singular_system() -> None:
    rows = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]])
    error = np.array([1.0, 1.0])
    step = Linearised(rows, error, rows @ rows.T).step(0.0)
    np.testing.assert_allclose(step, -np.linalg.pinv(rows) @ error, atol=1e-12)


def test_a_known_surface_is_learnt_to_the_goal() -> None:
    samples = smooth_surface(80)
    result = train(SHAPE, nguyen_widrow(SHAPE, 1), samples, Settings(goal=1e-6))
    assert result.mse[-1] <= 1e-6
    assert result.status.startswith(f"goal reached at epoch {result.epochs} of 2000")
    assert result.test_mse[-1] < 1e-5  # learnt, not memorised: 31 weights, 80 samples
    assert samples.mse(SHAPE, result.weights) == pytest.approx(result.mse[-1], rel=1e-12)


def test_every_accepted_step_lowers_the_error() -> None:
    result = train(SHAPE, nguyen_widrow(SHAPE, 2), smooth_surface(40), Settings(goal=0.0, epochs=200))
    assert np.all(np.diff(result.mse) < 0.0)


def test_damping_falls_tenfold_on_success_and_rises_tenfold_on_failure() -> None:
    result = train(SHAPE, nguyen_widrow(SHAPE, 2), smooth_surface(40), Settings(goal=0.0, epochs=200))
    failures = np.round(np.log10(result.damping[1:] / result.damping[:-1])) + 1.0
    np.testing.assert_allclose(result.damping[1:], result.damping[:-1] * 10.0 ** (failures - 1.0), rtol=1e-9)
    assert result.damping[0] == 1e-3
    assert failures.min() == 0.0
    assert failures.max() >= 1.0, "no step failed: the rise is not tested"


def test_a_failed_step_is_solved_again_with_the_same_jacobian(monkeypatch: pytest.MonkeyPatch) -> None:
    linearised: list[int] = []
    solved: list[float] = []
    at, step = Linearised.at, Linearised.step
    monkeypatch.setattr(Linearised, "at", lambda *args: (linearised.append(1), at(*args))[1])
    monkeypatch.setattr(Linearised, "step", lambda self, mu: (solved.append(mu), step(self, mu))[1])
    result = train(SHAPE, nguyen_widrow(SHAPE, 2), smooth_surface(40), Settings(goal=0.0, epochs=50))
    assert len(linearised) == result.epochs == 50
    failures = np.round(np.log10(result.damping[1:] / result.damping[:-1])) + 1.0
    assert len(solved) == 50 + failures.sum() > 50


def test_same_seed_same_bits() -> None:
    first, second = (train(SHAPE, nguyen_widrow(SHAPE, 4), smooth_surface(30)) for _ in range(2))
    np.testing.assert_array_equal(first.weights, second.weights)
    np.testing.assert_array_equal(first.mse, second.mse)


def test_stops_when_no_step_helps() -> None:
    """Two samples with one input and different targets: nothing below their mean can be reached."""
    samples = Samples(np.zeros((2, 2)), np.array([[0.0], [1.0]]), np.empty((0, 2)), np.empty((0, 1)))
    result = train(SHAPE, nguyen_widrow(SHAPE, 0), samples, Settings(min_gradient=0.0))
    assert result.mse[-1] == pytest.approx(0.25)
    assert "no step lowers it, damping beyond 1e+10" in result.status
    assert np.isnan(result.test_mse).all()


def test_stops_at_a_flat_place() -> None:
    samples = Samples(np.zeros((2, 2)), np.array([[0.0], [1.0]]), np.empty((0, 2)), np.empty((0, 1)))
    assert "gradient" in train(SHAPE, nguyen_widrow(SHAPE, 0), samples).status


def test_stops_after_the_epochs_asked_for() -> None:
    result = train(SHAPE, nguyen_widrow(SHAPE, 0), smooth_surface(40), Settings(epochs=3, goal=0.0))
    assert result.epochs == 3
    assert len(result.mse) == len(result.test_mse) == len(result.damping) == 4
    assert result.status.startswith("all 3 epochs used, goal 0e+00 not reached")


def test_noisy_targets_end_the_training_where_their_error_falls_no_more() -> None:
    exact, rng = smooth_surface(200), np.random.default_rng(0)
    noisy = replace(exact, t=exact.t + 0.1 * rng.standard_normal(exact.t.shape))
    long = train(SHAPE, nguyen_widrow(SHAPE, 0), noisy, Settings())
    short = train(SHAPE, nguyen_widrow(SHAPE, 0), noisy, Settings(stalled=100))
    assert short.epochs < 0.6 * long.epochs
    assert "fell by less than 1% in 100 epochs" in short.status
    assert short.mse[-1] < 1.05 * long.mse[-1]


def test_convergence_curve_is_written_with_gaps_where_nothing_was_tested(tmp_path) -> None:
    samples = smooth_surface(10)
    train(SHAPE, nguyen_widrow(SHAPE, 0), samples, Settings(epochs=2, goal=0.0)).write(tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "epoch,mse,test_mse"
    untested = Samples(samples.x, samples.t, np.empty((0, 2)), np.empty((0, 1)))
    train(SHAPE, nguyen_widrow(SHAPE, 0), untested, Settings(epochs=2, goal=0.0)).write(tmp_path / "b.csv")
    assert all(line.endswith(",") for line in (tmp_path / "b.csv").read_text().splitlines()[1:])


def test_damping_that_underflows_can_still_rise() -> None:
    """Success after success brings mu to its floor, never to 0, where x 10 could not raise it again."""
    result = train(SHAPE, nguyen_widrow(SHAPE, 2), smooth_surface(40), Settings(goal=0.0, epochs=5, mu=1e-19))
    assert result.damping[1:].min() >= 1e-20
    flat = Samples(np.zeros((2, 2)), np.array([[0.0], [1.0]]), np.empty((0, 2)), np.empty((0, 1)))
    ended = train(SHAPE, nguyen_widrow(SHAPE, 0), flat, Settings(min_gradient=0.0, mu=0.0))
    assert "damping beyond 1e+10" in ended.status


def test_damping_stops_falling_at_its_floor() -> None:
    samples, start, rules = smooth_surface(40), nguyen_widrow(SHAPE, 2), Settings(mu_min=1e-2)
    here = Linearised.at(SHAPE, start, samples, np.zeros((40, 1, SHAPE.weights)))
    _, mse, mu = _lower(here, SHAPE, start, samples, samples.mse(SHAPE, start), 0.05, rules)
    assert mse < samples.mse(SHAPE, start)
    assert mu >= 1e-2
