"""The likelihood of many parameter points at once, on the few combinations of the measured points that a model can move.

log L = -1/2 d^T C^-1 d - 1/2 log det C with d = y - f(theta, t0) and C = noise + emulator error + known errors. In units
of the noise, all model curves, whatever theta and t0, lie in a space of a few dozen dimensions: outside it d and C are
the same for every point, so that part is a constant and is dropped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from data.histories import Array
from inversion.calibration import Calibrator, Mode
from inversion.coordinates import Box
from inversion.curve_model import CurveModel
from surrogate.gaussian_process import GaussianProcess

NODES = 33  # time origins at which the model is tabulated
FELT = 0.01  # in standard deviations of the noise: combinations that move less over the campaign are left out
FARTHEST = 8.0  # standard deviations of the time origin about its best values, beyond which nothing is looked for


@dataclass(frozen=True)
class Likelihood:
    """Log posterior density of p = (z, tau), tau the time origin in its sigmas.

    taus: (t,) at which the tables stand, one where the clocks are the same; data: (r,) the record; table: (t, r, 1 +
    kept), mean curve and the predicted components of all channels; rest: (t, r, r), unit noise, unpredicted components
    and known errors.
    """

    calibrator: Calibrator
    taus: Array
    data: Array
    table: Array
    rest: Array

    @classmethod
    def of(cls, calibrator: Calibrator, modes: tuple[Mode, ...]) -> Likelihood:
        """Tabulate the model of a calibration about the time origins of its best fits."""
        model, noise = calibrator.model, calibrator.model.observations.noise
        taus = _taus(calibrator, modes)
        columns = [[part / noise[:, None] for part in _columns(model, tau * calibrator.sigma)] for tau in taus]
        known = np.zeros((len(noise), 0)) if model.known is None else model.known / noise[:, None]
        size = np.array([process.scale for _, process in _processes(model)])
        moved = [np.hstack([mean, kept * size, left]) for mean, kept, left in columns[:: max(1, len(columns) // 8)]]
        u, s, _ = np.linalg.svd(np.hstack([*moved, known]), full_matrices=False)
        basis = u[:, s > FELT * np.sqrt(len(moved))]
        table = np.stack([basis.T @ np.hstack([mean, kept]) for mean, kept, _ in columns])
        rest = np.stack([_covariance(basis.T @ left, basis.T @ known) for _, _, left in columns])
        return cls(calibrator, taus, basis.T @ (model.observations.values / noise), table, rest)

    def log_posterior(self, p: Array) -> Array:
        """(q,) up to a constant, at p (q, r + 1); minus infinity outside the boxes and the allowed time origins."""
        p = np.atleast_2d(p)
        z, tau = p[:, :-1], p[:, -1]
        allowed = self.allowed(z, tau)
        density = np.full(len(p), -np.inf)
        if allowed.any():
            z, tau = z[allowed], tau[allowed]
            prior = ((z - self.calibrator.coordinates.mean) / self.calibrator.coordinates.sd) ** 2
            density[allowed] = self._log_likelihood(z, tau) - 0.5 * (prior.sum(axis=1) + tau**2)
        return density

    def allowed(self, z: Array, tau: Array) -> Array:
        """(q,) whether runs stand behind each point."""
        inside = np.any([_within(box, z) for box in self.calibrator.coordinates.boxes], axis=0)
        return inside & (tau >= self.taus[0]) & (tau <= self.taus[-1])

    def theta(self, z: Array) -> Array:
        """Parameters (q, k) SI; points in no box are taken as they are."""
        theta = self.calibrator.coordinates.base + z @ self.calibrator.coordinates.basis
        for box in self.calibrator.coordinates.boxes:
            inside = _within(box, z)
            theta[inside] = self.calibrator.coordinates.theta(z[inside], box)
        return theta

    def _log_likelihood(self, z: Array, tau: Array) -> Array:
        scores, variances = self._scores(self.theta(z))
        table, rest = self._at(tau)
        covariance = rest + (table[..., 1:] * variances[:, None, :]) @ table[..., 1:].transpose(0, 2, 1)
        d = self.data - table[..., 0] - (table[..., 1:] @ scores[..., None])[..., 0]
        factor = np.linalg.cholesky(covariance)
        square = (d * np.linalg.solve(covariance, d[..., None])[..., 0]).sum(axis=1)
        return -0.5 * square - np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)

    def _at(self, tau: Array) -> tuple[Array, Array]:
        """Tables at each tau (q,): cubic between four nodes for the curves, linear for the covariance."""
        if len(self.taus) == 1:
            return tuple(np.broadcast_to(t[0], (len(tau), *t[0].shape)) for t in (self.table, self.rest))  # pyright: ignore[reportReturnType]
        place = (tau - self.taus[0]) / (self.taus[1] - self.taus[0])
        i = np.clip(place.astype(int), 1, len(self.taus) - 3)
        w = (place - i)[:, None, None]
        before, here, after, beyond = (self.table[i + k] for k in (-1, 0, 1, 2))
        curves = (
            -w * (w - 1) * (w - 2) / 6 * before
            + (w + 1) * (w - 1) * (w - 2) / 2 * here
            - (w + 1) * w * (w - 2) / 2 * after
            + (w + 1) * w * (w - 1) / 6 * beyond
        )
        near = np.clip(np.round(place).astype(int), 0, len(self.taus) - 1)
        return curves, self.rest[near]

    def _scores(self, theta: Array) -> tuple[Array, Array]:
        """Mean and variance (q, kept) of the predicted components of all channels."""
        u = self.calibrator.model.emulator.inputs(theta)
        found = [process.quick(u) for _, process in _processes(self.calibrator.model)]
        if not found:
            return np.zeros((len(u), 0)), np.zeros((len(u), 0))
        mean, variance = zip(*found, strict=True)
        return np.stack(mean, axis=1), np.stack(variance, axis=1)


def _taus(calibrator: Calibrator, modes: tuple[Mode, ...]) -> Array:
    """Nodes that span every best fit's time origin, in its sigmas."""
    if not calibrator.sigma:
        return np.zeros(1)
    spread = [FARTHEST * float(np.sqrt(mode.covariance[-1, -1])) for mode in modes]
    low = min(mode.t0 - far for mode, far in zip(modes, spread, strict=True)) / calibrator.sigma
    high = max(mode.t0 + far for mode, far in zip(modes, spread, strict=True)) / calibrator.sigma
    first, last = calibrator.offsets
    return np.linspace(max(low, first), min(high, last), NODES)


def _processes(model: CurveModel) -> list[tuple[str, GaussianProcess]]:
    """Every predicted component, channel by channel."""
    return [(c.name, p) for c in model.observations.channels for p in model.emulator.channels[c.name].processes]


def _columns(model: CurveModel, t0: float) -> tuple[Array, Array, Array]:
    """Mean curve (n, 1), predicted components (n, kept), and factor (n, left) of those that are not, SI."""
    means, kept, left = [], [], []
    for c in model.observations.channels:
        emulator = model.emulator.channels[c.name]
        mean, basis = emulator.at(c.times - t0)
        many = len(emulator.processes)
        means.append(mean)
        kept.append(basis[:many].T)
        left.append(basis[many:].T * np.sqrt(emulator.unpredicted[many:]))
    parts = np.concatenate(means)[:, None], block_diag(*kept), block_diag(*left)
    return tuple(np.asarray(part, dtype=np.float64) for part in parts)  # pyright: ignore[reportReturnType]


def _covariance(left: Array, known: Array) -> Array:
    return np.eye(len(left)) + left @ left.T + known @ known.T


def _within(box: Box, z: Array) -> Array:
    return ((z >= box.lows) & (z <= box.highs)).all(axis=1)
