"""The likelihood of many parameter points at once, on the few combinations of the points that a model can move.

log L = -1/2 d^T C^-1 d - 1/2 log det C with d = y - f(theta, t0), C = C0 + emulator error(theta), C0 = noise, known
errors and what no process predicts of a run's curves, as they stand at the best fit's time origin, the last as large
as at the fit where it is largest. Whitened by C0, all curves of the model lie in a space of a few dozen dimensions:
outside it d and C are the same for every point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import Box
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.surrogate.gaussian_process import GaussianProcess, ProcessStack

NODES = 33  # time origins at which the model is tabulated
FELT = 0.01  # in standard deviations of the noise: combinations that move less over the campaign are left out
FARTHEST = 8.0  # standard deviations of the time origin about its best values, beyond which nothing is looked for


@dataclass(frozen=True)
class Likelihood:
    """Log posterior density of p = (z, tau), tau the time origin in its sigmas.

    taus: (t,) at which the table stands, one where the clocks are the same; data: (r,) the whitened record; table:
    (t, r, 1 + kept), mean curve and the predicted components of all channels, whitened; mixing: (kept, q) rows whose
    products are the correlations of their errors.
    """

    calibrator: Calibrator
    taus: Array
    data: Array
    table: Array
    mixing: Array

    @classmethod
    def of(cls, calibrator: Calibrator, modes: tuple[Mode, ...]) -> Likelihood:
        """Tabulate the model of a calibration about the time origins of its best fits."""
        model = calibrator.model
        taus = _taus(calibrator, modes)
        left = _left_out(model, modes)
        common = left if model.known is None else np.hstack([left, model.known])
        whitening = model.whitening(modes[0].t0, common)
        columns = [whitening.apply(np.hstack(_columns(model, tau * calibrator.sigma)).T).T for tau in taus]
        size = np.array([1.0, *(process.scale for _, process in _processes(model))])
        moved = columns[:: max(1, len(columns) // 8)]
        u, s, _ = np.linalg.svd(np.hstack([part * size for part in moved]), full_matrices=False)
        basis = u[:, s > FELT * np.sqrt(len(moved))]
        data = basis.T @ whitening.apply(model.observations.values)
        mixing = np.vstack([model.emulator.channels[c.name].mixing for c in model.observations.channels])
        return cls(calibrator, taus, data, np.stack([basis.T @ part for part in columns]), mixing)

    def log_posterior(self, p: Array) -> Array:
        """(q,) up to a constant, at p (q, r + 1); minus infinity outside the boxes and the allowed time origins."""
        p = np.atleast_2d(p)
        z, tau = p[:, :-1], p[:, -1]
        allowed = self.allowed(z, tau)
        density = np.full(len(p), -np.inf)
        if allowed.any():
            z, tau = z[allowed], tau[allowed]
            prior = self.calibrator.coordinates.prior.deviations(z) ** 2
            density[allowed] = self._log_likelihood(z, tau) - 0.5 * (prior.sum(axis=1) + tau**2)
        return density

    def allowed(self, z: Array, tau: Array) -> NDArray[np.bool_]:
        """(q,) whether runs stand behind each point."""
        inside = np.any([_within(box, z) for box in self.calibrator.coordinates.boxes], axis=0)
        return np.asarray(inside & (tau >= self.taus[0]) & (tau <= self.taus[-1]))

    def theta(self, z: Array) -> Array:
        """Parameters (q, k) SI; points in no box are taken as they are."""
        theta = self.calibrator.coordinates.unlimited(z)
        for box in self.calibrator.coordinates.boxes:
            inside = _within(box, z)
            theta[inside] = self.calibrator.coordinates.theta(z[inside], box)
        return theta

    def _log_likelihood(self, z: Array, tau: Array) -> Array:
        scores, variances = self._scores(self.theta(z))
        table = self._at(tau)
        components = table[..., 1:]
        factor = (components * np.sqrt(variances)[:, None, :]) @ self.mixing
        covariance = factor @ factor.transpose(0, 2, 1) + np.eye(len(self.data))
        d = self.data - table[..., 0] - (components @ scores[..., None])[..., 0]
        root = np.linalg.cholesky(covariance)
        square = (d * np.linalg.solve(covariance, d[..., None])[..., 0]).sum(axis=1)
        return -0.5 * square - np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)

    def _at(self, tau: Array) -> Array:
        """The table (q, r, 1 + kept) at each tau (q,), cubic between four nodes."""
        if len(self.taus) == 1:
            return np.broadcast_to(self.table[0], (len(tau), *self.table[0].shape))
        place = (tau - self.taus[0]) / (self.taus[1] - self.taus[0])
        i = np.clip(place.astype(int), 1, len(self.taus) - 3)
        w = (place - i)[:, None, None]
        before, here, after, beyond = (self.table[i + k] for k in (-1, 0, 1, 2))
        return (
            -w * (w - 1) * (w - 2) / 6 * before
            + (w + 1) * (w - 1) * (w - 2) / 2 * here
            - (w + 1) * w * (w - 2) / 2 * after
            + (w + 1) * w * (w - 1) / 6 * beyond
        )

    def _scores(self, theta: Array) -> tuple[Array, Array]:
        """Mean and variance (q, kept) of the predicted components of all channels."""
        u = self.calibrator.model.emulator.inputs(theta)
        mean, variance = np.zeros((2, len(u), len(self.mixing)))
        for places, stack in self._stacks:
            mean[:, places], variance[:, places] = stack.predict(u)
        return mean, variance

    @cached_property
    def _stacks(self) -> list[tuple[list[int], ProcessStack]]:
        return ProcessStack.groups([process for _, process in _processes(self.calibrator.model)])


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


def _columns(model: CurveModel, t0: float) -> tuple[Array, Array]:
    """Mean curve (n, 1) and predicted components (n, kept), SI."""
    means, kept = [], []
    for c in model.observations.channels:
        emulator = model.emulator.channels[c.name]
        mean, basis = emulator.at(c.times - t0)
        many = len(emulator.processes)
        means.append(mean)
        kept.append(basis[:many].T)
    return np.concatenate(means)[:, None], np.asarray(block_diag(*kept), dtype=np.float64)


def _left_out(model: CurveModel, modes: tuple[Mode, ...]) -> Array:
    """(n, r) SI factor of what the components leave out, for each channel at the best fit where it is largest."""
    u = model.emulator.inputs(np.stack([mode.theta for mode in modes]))
    parts = []
    for c in model.observations.channels:
        emulator = model.emulator.channels[c.name]
        parts.append(np.sqrt(emulator.nearby.at(u).max()) * emulator.remainder_at(c.times - modes[0].t0))
    return np.vstack(parts)


def _within(box: Box, z: Array) -> NDArray[np.bool_]:
    return np.asarray(((z >= box.lows) & (z <= box.highs)).all(axis=1))
