"""A Gaussian process over scaled features whose stated error is that of its own leave-one-out predictions nearby.

The variance that such a process states by itself is small wherever a run is near, whether or not it can follow the
curve there. What it has missed is known: run i, left out, is missed by e_i. The variance of the error at u is the
average of e_i^2 over the runs, each weighted by how much it resembles u (Lei et al., J. Am. Stat. Assoc. 113 (2018)
1094, sect. 5.2, weigh conformal intervals so), times what Student's t needs for so few: (t_nu / t_infinity)^2 at
97.5 %, with the effective number of runs nu = (sum w)^2 / sum w^2 (Kish, Survey Sampling, 1965, sect. 8.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from scipy.special import stdtrit
from scipy.stats import t as student
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Kernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.surrogate.hyperparameters import LENGTHS, SCATTER, hyperparameters, matern
from birdstrike.surrogate.validation import leave_one_out, q2

LOCALITIES = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)
"""Powers of the correlation between u and a run that may be its weight: 0 counts all runs alike."""
VARIANCES = (1e-3, 1e3)
FEWEST = 2.0  # effective runs: with one, Student's t has no variance that could be widened to
LEAST_WEIGHT = 1e-150  # of a run, however far: its square must not underflow
NORMAL_95 = 1.959964  # standard deviations from a Gaussian's mean to the ends of its 95 % interval


@dataclass(frozen=True)
class LocalVariance:
    """Variance of an error at u (., d), from what was missed at the runs.

    lengths: (d,) of the features; points: (n, d) features of the runs over them; squares: (n,) of the errors there;
    locality: power of the Matern correlation by which a run counts.
    """

    lengths: Array
    points: Array
    squares: Array
    locality: float

    @classmethod
    def of(cls, lengths: Array, points: Array, squares: Array) -> LocalVariance:
        """With the locality under which the runs' errors are likeliest."""
        return cls(lengths, points, squares, _locality(matern(cdist(points, points)), squares))

    def at(self, u: Array) -> Array:
        """(q,) at u (q, d), enlarged as Student's t asks for the effective number of runs."""
        mean, effective = _local(self.correlations(u) ** self.locality, self.squares[:, None])
        return (mean * _inflation(effective))[:, 0]

    def correlations(self, u: Array) -> Array:
        """(q, n) Matern correlation of u (q, d) with the runs."""
        return matern(cdist(u / self.lengths, self.points))

    @cached_property
    def least(self) -> float:
        """The smallest that it is at any run."""
        return float(self.at(self.points * self.lengths).min())

    @property
    def left_out(self) -> Array:
        """(n,) at each run, by the others, not enlarged."""
        weights = matern(cdist(self.points, self.points)) ** self.locality
        np.fill_diagonal(weights, 0.0)
        return _local(weights, self.squares[:, None])[0][:, 0]


@dataclass(frozen=True)
class GaussianProcess:
    """One zero-mean process y(u) for scaled features u (., d).

    model: regressor on y in units of `scale`, kernel: with its hyperparameters; loo: (n,) leave-one-out
    predictions of y; errors: (n,) of them; missed: the variance that they show.
    """

    model: GaussianProcessRegressor
    kernel: Kernel
    scale: float
    loo: Array
    q2: float
    errors: Array
    missed: LocalVariance

    @classmethod
    def fit(cls, u: Array, y: Array, seed: int) -> GaussianProcess:
        """Anisotropic Matern 5/2 plus white noise at the hyperparameters' posterior mean; u (n, d), y (n,)."""
        size = float(np.sqrt(np.mean(y * y))) or 1.0
        with threadpool_limits(limits=1, user_api="blas"):
            variance, lengths, scatter = (
                hyperparameters(u, y / size, seed) if y.any() else (1.0, np.ones(u.shape[1]), 1.0)
            )
        theta = np.log([np.clip(variance, *VARIANCES), *lengths, np.clip(scatter, *SCATTER)])
        return cls.with_kernel(u, y, kernel_of(u.shape[1], theta))

    @classmethod
    def with_kernel(cls, u: Array, y: Array, kernel: Kernel) -> GaussianProcess:
        """The process with hyperparameters already known."""
        fixed: Any = None  # no optimiser
        model = GaussianProcessRegressor(kernel, optimizer=fixed)
        scale = float(np.sqrt(np.mean(y * y))) or 1.0
        # Matrices of a few dozen rows lose more to waking threads than they gain.
        with threadpool_limits(limits=1, user_api="blas"):
            model.fit(u, y / scale)
        fitted: Any = model.kernel_
        loo = leave_one_out(fitted(u), y / scale)
        errors = (y / scale - loo) * scale
        lengths = np.asarray(fitted.k1.k2.length_scale)
        missed = LocalVariance.of(lengths, u / lengths, errors**2)
        return cls(model, fitted, scale, loo * scale, q2(y, loo * scale), errors, missed)

    @property
    def nugget(self) -> float:
        """Variance of a run about what is smooth, in the prediction's."""
        return self.scale**2 * float(self.kernel.k2.noise_level)  # pyright: ignore[reportAttributeAccessIssue]

    @cached_property
    def standardised(self) -> Array:
        """(n,) leave-one-out errors over the standard deviations that the other runs' errors give there."""
        mean = self.missed.left_out
        return np.divide(self.errors, np.sqrt(mean), out=np.zeros_like(self.errors), where=mean > 0.0)

    def predict(self, u: Array) -> tuple[Array, Array]:
        """Mean and variance (q,) at u (q, d): of a new run, its scatter included."""
        return self.mean(u), self.variance(u)

    def variance(self, u: Array) -> Array:
        """(q,) of a new run about the mean at u (q, d)."""
        return self.missed.at(u)

    def distance_variance(self, u: Array) -> Array:
        """(q,) that the process states by itself, without scatter: large where no run is near, whatever was missed."""
        white = self.missed.correlations(u) @ self._inverse.T * self.size
        return np.maximum(self.size - (white**2).sum(axis=1), 0.0) * self.scale**2

    def mean(self, u: Array) -> Array:
        """Mean (q,) at u (q, d): k(u, runs) alpha, without scikit-learn's checks, which cost more than the product."""
        return self.size * self.missed.correlations(u) @ self.model.alpha_ * self.scale

    @cached_property
    def size(self) -> float:
        """Variance of the kernel, in units of `scale` squared."""
        kernel: Any = self.kernel
        return float(kernel.k1.k1.constant_value)

    @cached_property
    def _inverse(self) -> Array:
        """Inverse Cholesky factor of the runs' covariance."""
        return np.asarray(solve_triangular(self.model.L_, np.eye(len(self.model.L_)), lower=True))


class ProcessStack:
    """What `GaussianProcess.predict` gives for several processes over the same runs, by one product for all of them.

    For the many small batches of a sampler, in which the calls would cost more than the arithmetic.
    """

    def __init__(self, processes: Sequence[GaussianProcess]) -> None:
        self.runs = np.asarray(processes[0].model.X_train_)
        lengths = np.array([np.broadcast_to(process.missed.lengths, self.runs.shape[1]) for process in processes])
        self._nearness = lengths**-2.0
        sizes = np.array([process.size * process.scale for process in processes])
        self._alpha = sizes[:, None, None] * np.array([process.model.alpha_ for process in processes])[..., None]
        self._locality = np.array([process.missed.locality for process in processes])[:, None, None]
        self._squares = np.array([process.missed.squares for process in processes])[..., None]

    @classmethod
    def groups(cls, processes: Sequence[GaussianProcess]) -> list[tuple[list[int], ProcessStack]]:
        """Stacks of the processes that share their runs, with the places of these processes in the sequence."""
        places: dict[bytes, list[int]] = {}
        for i, process in enumerate(processes):
            places.setdefault(np.asarray(process.model.X_train_).tobytes(), []).append(i)
        return [(group, cls([processes[i] for i in group])) for group in places.values()]

    def predict(self, u: Array) -> tuple[Array, Array]:
        """Mean and variance (q, processes) at u (q, d): of a new run, its scatter included."""
        apart = (u.T[:, :, None] - self.runs.T[:, None, :]) ** 2
        squares = self._nearness @ apart.reshape(len(apart), -1)
        correlation = matern(np.sqrt(squares)).reshape(-1, *apart.shape[1:])  # (processes, q, n)
        mean, effective = _local(correlation**self._locality, self._squares)
        return (correlation @ self._alpha)[..., 0].T, (mean * _inflation(effective))[..., 0].T


def _inflation(effective: Array) -> Array:
    """`student_inflation`, to 1e-6: a quantile of Student's t costs as much as a hundred exponentials."""
    return np.interp(1.0 / effective, *_inflations())


@cache
def _inflations() -> tuple[Array, Array]:
    """1/nu and the factor; the factor is smooth in 1/nu."""
    inverse = np.linspace(1e-6, 1.0 / FEWEST, 2001)
    return inverse, (stdtrit(1.0 / inverse, 0.975) / NORMAL_95) ** 2


def student_inflation(freedom: float) -> float:
    """Factor on a variance estimated with so many degrees of freedom that makes a normal 95 % interval hold."""
    return float((student.ppf(0.975, freedom) / NORMAL_95) ** 2)


def _local(weights: Array, squares: Array) -> tuple[Array, Array]:
    """Weighted mean of squares (..., n, 1), and the effective number of runs in it; weights (..., q, n)."""
    shares = weights + LEAST_WEIGHT + 1e-12 * weights.max(axis=-1, keepdims=True)
    total = shares.sum(axis=-1, keepdims=True)
    return shares @ squares / total, np.maximum(total**2 / (shares**2).sum(axis=-1, keepdims=True), FEWEST)


def _locality(correlation: Array, squares: Array) -> float:
    """The power under which the runs' errors are likeliest, each by Student's t with the others' variance.

    Likelihood cross-validation: Duin, IEEE Trans. Computers C-25 (1976) 1175.
    """
    best, chosen = -np.inf, 0.0
    for power in LOCALITIES:
        weights = correlation**power
        np.fill_diagonal(weights, 0.0)
        mean, effective = (column[:, 0] for column in _local(weights, squares[:, None]))
        if not (mean > 0.0).all():
            continue
        score = float(student.logpdf(np.sqrt(squares), effective, scale=np.sqrt(mean)).sum())
        if score > best:
            best, chosen = score, power
    return chosen


def kernel_of(features: int, theta: Array | None = None) -> Kernel:
    """Constant x Matern 5/2 with a length for each feature + white noise; at hyperparameters theta (logs), if given."""
    lengths: Any = np.ones(features)
    kernel: Any = ConstantKernel(1.0, VARIANCES) * Matern(lengths, LENGTHS, nu=2.5) + WhiteKernel(1e-3, SCATTER)
    return kernel if theta is None else kernel.clone_with_theta(theta)
