"""A Gaussian process over scaled features with a nugget for the solver's scatter, checked by leave-one-out."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.spatial.distance import cdist
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Kernel, Matern, WhiteKernel
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.surrogate.validation import leave_one_out, q2

RESTARTS = 2


@dataclass(frozen=True)
class GaussianProcess:
    """One zero-mean process y(u) for scaled features u (., d).

    model: regressor on y in units of `scale`, kernel: with its fitted hyperparameters; loo, loo_sd: (n,) leave-one-out
    predictions of y and their standard deviations; inflation: factor on the variance that makes the squared
    standardised leave-one-out errors average 1 at most: hyperparameters from a few dozen runs are overconfident.
    """

    model: GaussianProcessRegressor
    kernel: Kernel
    scale: float
    loo: Array
    loo_sd: Array
    q2: float
    inflation: float

    @classmethod
    def fit(cls, u: Array, y: Array, seed: int) -> GaussianProcess:
        """Anisotropic Matern 5/2 plus white noise by maximum likelihood; u (n, d), y (n,)."""
        model = GaussianProcessRegressor(kernel_of(u.shape[1]), n_restarts_optimizer=RESTARTS, random_state=seed)
        return cls._checked(model, u, y)

    @classmethod
    def with_kernel(cls, u: Array, y: Array, kernel: Kernel) -> GaussianProcess:
        """The process with hyperparameters already known."""
        fixed: Any = None  # no optimiser
        return cls._checked(GaussianProcessRegressor(kernel, optimizer=fixed), u, y)

    @classmethod
    def _checked(cls, model: GaussianProcessRegressor, u: Array, y: Array) -> GaussianProcess:
        scale = float(np.sqrt(np.mean(y * y))) or 1.0
        # A feature without influence drives its length scale to the bound, which is the wanted answer; and matrices of
        # a few dozen rows lose more to waking threads than they gain.
        with warnings.catch_warnings(), threadpool_limits(limits=1, user_api="blas"):
            warnings.simplefilter("ignore", ConvergenceWarning)
            model.fit(u, y / scale)
        fitted: Any = model.kernel_
        loo, loo_sd = leave_one_out(fitted(u), y / scale)
        inflation = max(1.0, float(np.mean(((y / scale - loo) / loo_sd) ** 2)))
        return cls(model, fitted, scale, loo * scale, loo_sd * scale, q2(y, loo * scale), inflation)

    @property
    def nugget(self) -> float:
        """Variance of a run about what is smooth, in the prediction's."""
        return self.inflation * self.scale**2 * float(self.kernel.k2.noise_level)  # pyright: ignore[reportAttributeAccessIssue]

    def predict(self, u: Array) -> tuple[Array, Array]:
        """Mean and variance (q,) at u (q, d): of a new run, nugget included."""
        mean, sd = (np.asarray(part, dtype=np.float64) for part in self.model.predict(u, return_std=True))
        return mean * self.scale, self.inflation * (sd * self.scale) ** 2

    def quick(self, u: Array) -> tuple[Array, Array]:
        """What `predict` gives, without scikit-learn's checks: for the many small batches of a sampler."""
        size, lengths, nugget, runs, inverse = self._plain
        r = np.sqrt(5.0) * cdist(u / lengths, runs)
        k = size * (1.0 + r * (1.0 + r / 3.0)) * np.exp(-r)
        white = k @ inverse.T
        variance = np.maximum(size + nugget - (white**2).sum(axis=1), 0.0)
        return k @ self.model.alpha_ * self.scale, self.inflation * variance * self.scale**2

    @cached_property
    def _plain(self) -> tuple[float, Array, float, Array, Array]:
        """Of the kernel: size, lengths (d,), nugget; the runs over the lengths; inverse Cholesky factor of the runs."""
        kernel: Any = self.kernel
        lengths = np.asarray(kernel.k1.k2.length_scale)
        inverse = np.asarray(solve_triangular(self.model.L_, np.eye(len(self.model.L_)), lower=True))
        return kernel.k1.k1.constant_value, lengths, kernel.k2.noise_level, self.model.X_train_ / lengths, inverse

    def mean(self, u: Array) -> Array:
        """Mean (q,) at u (q, d): k(u, runs) alpha, without scikit-learn's checks, which cost more than the product."""
        kernel: Any = self.kernel
        return kernel(u, self.model.X_train_) @ self.model.alpha_ * self.scale


def kernel_of(features: int, theta: Array | None = None) -> Kernel:
    """Constant x Matern 5/2 with a length for each feature + white noise; at hyperparameters theta (logs), if given."""
    # A few dozen runs in several dimensions lie about half a range apart: they cannot show anything shorter than 0.2.
    lengths: Any = np.ones(features)
    kernel: Any = ConstantKernel(1.0, (1e-3, 1e3)) * Matern(lengths, (0.2, 1e2), nu=2.5) + WhiteKernel(
        1e-3, (1e-6, 2.0)
    )
    return kernel if theta is None else kernel.clone_with_theta(theta)
