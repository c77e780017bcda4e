"""Bayesian regularisation, as MATLAB's `trainbr`: small weights are rewarded as far as the data allow.

F = beta sum e^2 + alpha sum w^2 is minimised by Levenberg-Marquardt; after each step, with H = beta J^T J + alpha I,
gamma = p - alpha tr H^-1 (the effective number of weights), alpha = gamma / (2 sum w^2), beta = (m - gamma) / (2
sum e^2). Foresee and Hagan, "Gauss-Newton approximation to Bayesian learning", IJCNN 1997; MacKay, Neural Comput. 4
(1992) 415.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.surrogate.network import Shape, jacobian
from birdstrike.surrogate.trainers.training import Samples, Training

STEADY = 1e-5  # relative change of the mean squared error and of gamma below which nothing more is learnt
STEADY_FOR = 20  # epochs
NOISE = 0.01  # of the scaled outputs' 0..1, root mean square: the outputs are not taken to be known better than this
INTERPOLATES = 0.9  # effective weights, as a share of the residuals, from which none are left to check the fit by


@dataclass(frozen=True)
class Settings:
    """Stopping rules and damping, trainbr's own; there is no error goal, because F knows when to stop."""

    epochs: int = 2000
    mu: float = 5e-3
    mu_decrease: float = 0.1
    mu_increase: float = 10.0
    mu_max: float = 1e10
    min_gradient: float = 1e-7


@dataclass(frozen=True)
class Weighing:
    """How data and smallness weigh against each other; gamma: effective number of weights."""

    alpha: float
    beta: float
    gamma: float

    @classmethod
    def of(cls, gamma: float, squares: float, error: float, residuals: int) -> Weighing:
        """From gamma, sum w^2, sum e^2 and the number of residuals; 1 where beta would not be positive.

        With more weights than residuals F has a minimum at sum e^2 = 0, gamma = m, where beta is 0/0: the squares count
        as no smaller than NOISE gives, so that the weights stay small.
        """
        beta = (residuals - gamma) / (2.0 * max(error, residuals * NOISE**2))
        return cls(gamma / (2.0 * max(squares, 1e-300)), beta if beta > 0.0 else 1.0, gamma)

    def cost(self, error: float, squares: float) -> float:
        """F."""
        return self.beta * error + self.alpha * squares


@threadpool_limits.wrap(limits=1, user_api="blas")
def train(
    shape: Shape,
    start: Array,
    samples: Samples,
    settings: Settings | None = None,
    progress: Progress = silent,
) -> Training:
    """Train from the weights `start`; the status says how many weights were effective."""
    rules, weights = settings or Settings(), np.array(start, dtype=np.float64)
    residuals, mu, steady = samples.t.size, rules.mu, 0
    error = samples.mse(shape, weights) * residuals
    weighing = Weighing.of(float(shape.weights), float(weights @ weights), error, residuals)
    history = [(error / residuals, samples.test_mse(shape, weights), mu)]
    why = f"all {rules.epochs} epochs used"
    here = _Curvature.at(shape, weights, samples)
    while len(history) <= rules.epochs:
        gradient = weighing.beta * here.rows.T @ here.error + weighing.alpha * weights
        if 2.0 * float(np.linalg.norm(gradient)) < rules.min_gradient:
            why = f"gradient below {rules.min_gradient:.0e}"
            break
        found = _lower(here, shape, weights, samples, weighing, gradient, mu, rules)
        if found is None:
            why = "no step lowers the regularised error"
            break
        weights, error, mu = found
        before, was = weighing.gamma, history[-1][0]
        here = _Curvature.at(shape, weights, samples)
        gamma = here.effective(weighing)
        weighing = Weighing.of(gamma, float(weights @ weights), error, residuals)
        history.append((error / residuals, samples.test_mse(shape, weights), mu))
        still = abs(gamma - before) < STEADY * gamma and abs(history[-1][0] - was) < STEADY * was
        steady = steady + 1 if still else 0
        if steady >= STEADY_FOR:
            why = "error and effective number of weights are steady"
            break
        progress(len(history) / rules.epochs)
    mse, test_mse, damping = np.array(history).T
    status = (
        f"stopped at epoch {len(mse) - 1}, MSE {mse[-1]:.2e}: {why}; {weighing.gamma:.1f} of {shape.weights} weights "
        "are effective"
    )
    return Training("br", weights, mse, test_mse, damping, status, effective_weights=weighing.gamma)


def warning(training: Training, residuals: int) -> str:
    """What a user must know of a network with nearly as many effective weights as training values; else nothing.

    residuals: training values, those of noisy copies included: a network that averages over copies interpolates none.
    """
    gamma = training.effective_weights
    if gamma is None or gamma <= INTERPOLATES * residuals:
        return ""
    return (
        f"the network's {gamma:.1f} effective weights nearly equal the {residuals} values it was trained on: it "
        "interpolates them, and its training error says nothing; add runs"
    )


def _lower(
    here: _Curvature,
    shape: Shape,
    weights: Array,
    samples: Samples,
    weighing: Weighing,
    gradient: Array,
    mu: float,
    rules: Settings,
) -> tuple[Array, float, float] | None:
    """Raise mu until a step lowers F: weights, sum e^2, the next mu; None beyond mu_max."""
    now = weighing.cost(float(here.error @ here.error), float(weights @ weights))
    while mu <= rules.mu_max:
        trial = weights - here.solve(gradient, weighing.beta, weighing.alpha + mu)
        error = samples.mse(shape, trial) * samples.t.size
        if weighing.cost(error, float(trial @ trial)) < now:
            return trial, error, max(mu * rules.mu_decrease, 1e-20)
        mu *= rules.mu_increase
    return None


@dataclass(frozen=True)
class _Curvature:
    """J (m, p) and e (m,) at some weights, with the eigenvalues (m,) and vectors of J J^T, or of J^T J if smaller."""

    rows: Array
    error: Array
    values: Array
    vectors: Array

    @classmethod
    def at(cls, shape: Shape, weights: Array, samples: Samples) -> _Curvature:
        y, rows = jacobian(shape, weights, samples.x)
        dual = len(rows) < shape.weights
        values, vectors = np.linalg.eigh(rows @ rows.T if dual else rows.T @ rows)
        values = np.maximum(values, 0.0)
        if dual:  # right singular vectors of J, those of value 0 left out: nothing is needed of them
            kept = values > 1e-14 * values[-1]
            values, vectors = values[kept], rows.T @ vectors[:, kept] / np.sqrt(values[kept])
        return cls(rows, (y - samples.t).ravel(), values, vectors)

    def solve(self, right: Array, beta: float, damping: float) -> Array:
        """(beta J^T J + damping I)^-1 right."""
        along = self.vectors.T @ right
        return right / damping + self.vectors @ (along * (1.0 / (beta * self.values + damping) - 1.0 / damping))

    def effective(self, weighing: Weighing) -> float:
        """gamma = sum of beta v / (beta v + alpha) over the eigenvalues v of J^T J."""
        scaled = weighing.beta * self.values
        return float((scaled / (scaled + weighing.alpha)).sum())
