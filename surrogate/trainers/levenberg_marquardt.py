"""Levenberg-Marquardt training of the network, with the damping and stopping rules of MATLAB's `trainlm`.

Step: (J^T J + mu I) d = -J^T e with residuals e = y - t of the scaled outputs and J = dy/dweights. A step that lowers
the error is taken and mu x 0.1; otherwise mu x 10 and the same J is solved again. Hagan and Menhaj, "Training
feedforward networks with the Marquardt algorithm", IEEE Trans. Neural Networks 5 (1994) 989.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import get_lapack_funcs
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.network import Shape, jacobian
from birdstrike.surrogate.trainers.training import Samples, Training

_posv: Any = get_lapack_funcs("posv", dtype=np.float64)  # Cholesky and solve in one call, without cho_factor's checks

FALL = 0.01


@dataclass(frozen=True)
class Settings:
    """Stopping rules and damping; epochs and goal are those of the bird-strike network, the rest trainlm's own."""

    epochs: int = 2000
    goal: float = 1e-3  # mean squared error of the scaled outputs
    mu: float = 1e-3
    mu_decrease: float = 0.1
    mu_increase: float = 10.0
    mu_max: float = 1e10
    mu_min: float = 1e-20  # damping that underflows to 0 could never rise again
    min_gradient: float = 1e-7  # norm of the gradient of the mean squared error
    max_fail: int = 6  # epochs in a row on which the validation error may rise, where there is a validation set
    stalled: int | None = None  # epochs in which the error must fall by 1 %, none: they may be as slow as they are


@dataclass(frozen=True)
class Linearised:
    """The network at its present weights: J (m, p), e (m,), and the smaller of J^T J and J J^T."""

    rows: Array
    error: Array
    gram: Array

    @classmethod
    def at(cls, shape: Shape, weights: Array, samples: Samples, workspace: Array) -> Linearised:
        """Residuals and derivatives on the training samples; `workspace` (n, outputs, p) is overwritten."""
        y, rows = jacobian(shape, weights, samples.x, workspace)
        gram = rows @ rows.T if len(rows) < shape.weights else rows.T @ rows
        return cls(rows, (y - samples.t).ravel(), gram)

    @property
    def gradient(self) -> float:
        """Norm of the gradient of the mean squared error, |2 J^T e / m|."""
        return float(np.linalg.norm(self.rows.T @ self.error)) * 2.0 / self.error.size

    def step(self, mu: float) -> Array:
        """d (p,) of (J^T J + mu I) d = -J^T e.

        With fewer residuals than weights the same d is -J^T (J J^T + mu I)^-1 e: 76 unknowns instead of 157. Cholesky;
        where mu is too small for it (J of deficient rank), least squares of the damped rows.
        """
        dual = len(self.gram) == len(self.rows)
        damped = self.gram.copy()
        damped.flat[:: len(damped) + 1] += mu
        _, solution, failed = _posv(damped, self.error if dual else self.rows.T @ self.error)
        if failed:
            return self._step_by_least_squares(mu)
        return -(self.rows.T @ solution) if dual else -solution

    def _step_by_least_squares(self, mu: float) -> Array:
        weights = self.rows.shape[1]
        stacked = np.vstack([self.rows, np.sqrt(mu) * np.eye(weights)])
        solution = np.linalg.lstsq(stacked, np.concatenate([self.error, np.zeros(weights)]), rcond=None)[0]
        return -np.asarray(solution, dtype=np.float64)


# Matrices of this size lose more to waking threads than they gain.
@threadpool_limits.wrap(limits=1, user_api="blas")
def train(
    shape: Shape,
    start: Array,
    samples: Samples,
    settings: Settings | None = None,
    progress: Progress = silent,
) -> Training:
    """Train from the weights `start`; every step lowers the training error, so the last weights are the best.

    With a validation set in the samples, those with its smallest error are.
    """
    rules = settings or Settings()
    weights, mu = np.array(start, dtype=np.float64), max(rules.mu, rules.mu_min)
    workspace = np.zeros((len(samples.x), shape.outputs, shape.weights))
    history = [(samples.mse(shape, weights), samples.test_mse(shape, weights), mu)]
    watch = _Watch(samples.stop_mse(shape, weights), weights)
    while not (status := _finished(rules, len(history) - 1, history[-1][0])):
        here = Linearised.at(shape, weights, samples, workspace)
        if here.gradient < rules.min_gradient:
            status = f"{_stopped(history)}: gradient {here.gradient:.1e} below {rules.min_gradient:.0e}"
            break
        weights, mse, mu = _lower(here, shape, weights, samples, history[-1][0], mu, rules)
        if mu > rules.mu_max:
            status = f"{_stopped(history)}: no step lowers it, damping beyond {rules.mu_max:.0e}"
            break
        history.append((mse, samples.test_mse(shape, weights), mu))
        watch = watch.seen(samples.stop_mse(shape, weights), weights)
        if rules.stalled and _falls_no_more([mse for mse, _, _ in history[-rules.stalled - 1 :]], rules.stalled):
            status = f"{_stopped(history)}: it fell by less than {FALL:.0%} in {rules.stalled} epochs"
            break
        if watch.fails >= rules.max_fail:
            status = f"{_stopped(history)}: the validation error rose {watch.fails} times in a row"
            break
        progress((len(history) - 1) / rules.epochs)
    mse, test_mse, damping = np.array(history).T
    if np.isfinite(watch.least):
        weights = watch.best
    return Training("lm", weights, mse, test_mse, damping, status)


def _falls_no_more(recent: Sequence[float], epochs: int) -> bool:
    return len(recent) > epochs and recent[-1] > (1.0 - FALL) * recent[0]


@dataclass(frozen=True)
class _Watch:
    """The validation set's smallest error (NaN: there is none), the weights that had it, and rises in a row since."""

    least: float
    best: Array
    fails: int = 0

    def seen(self, mse: float, weights: Array) -> _Watch:
        """After one more epoch."""
        if not mse >= self.least:
            return _Watch(mse, weights)
        return _Watch(self.least, self.best, self.fails + 1)


def _lower(
    here: Linearised, shape: Shape, weights: Array, samples: Samples, mse: float, mu: float, rules: Settings
) -> tuple[Array, float, float]:
    """Raise mu until a step lowers the error: weights, their error, the next mu (beyond mu_max: no such step)."""
    while mu <= rules.mu_max:
        trial = weights + here.step(mu)
        trial_mse = samples.mse(shape, trial)
        if trial_mse < mse:
            return trial, trial_mse, max(mu * rules.mu_decrease, rules.mu_min)
        mu *= rules.mu_increase
    return weights, mse, mu


def _finished(rules: Settings, epoch: int, mse: float) -> str:
    """The sentence that says why training ends here, or nothing."""
    if mse <= rules.goal:
        return f"goal reached at epoch {epoch} of {rules.epochs}: MSE {mse:.2e} <= {rules.goal:.0e}"
    if epoch >= rules.epochs:
        return f"all {rules.epochs} epochs used, goal {rules.goal:.0e} not reached: MSE {mse:.2e}"
    return ""


def _stopped(history: list[tuple[float, float, float]]) -> str:
    return f"stopped at epoch {len(history) - 1}, MSE {history[-1][0]:.2e}"
