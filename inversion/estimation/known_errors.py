"""What every model carries besides its parameters: uncertain speed, mass, thickness; mesh error; a stated discrepancy;
the error of a channel that the emulator predicts poorly; what is not known of a correlated noise.

Each is a column of the model's error: the change of the stacked curve for one standard deviation. A Gaussian nuisance
whose effect is linear is marginalised exactly by adding column column^T to the covariance.

Where the leave-one-out Q2 of a channel is low, the curves jitter in ways that no process explains, and the processes'
own variances are too small. The channel then carries the covariance of its leave-one-out residuals besides, so that it
counts for what it is worth beside the channels that are predicted well. The covariance of a few dozen residuals is
tapered in time by a Gaussian: far instants correlate by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import t as student_t

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.whitening import INSTANTS, factor_between, factor_of
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.observations.observations import Channel, Observations
from birdstrike.inversion.observations.prior_predictive import POOR_Q2
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.nuisances import Nuisance
from birdstrike.surrogate.emulator import CurveEmulator, Emulator
from birdstrike.surrogate.gaussian_process import NORMAL_95

Columns = Callable[[Observations, Mode], Array]
"""columns(observations, best fit) -> (n, s) SI: errors common to many points, one standard deviation each."""

DISCREPANCY_LENGTH = 0.25  # of the record: correlation time of a stated discrepancy
WORTH_A_COLUMN = 1e-4  # share of a discrepancy's variance
TAPER = 0.2  # of the simulated record: correlation length of the taper
KEPT = 1e-6  # share of the variance below which a column is dropped


class NuisanceRuns:
    """What uncertain quantities of the impact do to a shot, by two simulations each, made once.

    They stand at the parameters at which the columns are first asked for: the first best fit. Later fits of the same
    shot, one after each run that a refinement adds, read them again on their own clock.
    """

    def __init__(self, forward: Forward, nuisances: Sequence[Nuisance]) -> None:
        self.forward, self.nuisances = forward, nuisances
        self.pairs: list[tuple[Histories, Histories]] | None = None

    def columns(self, observations: Observations, theta: Mapping[str, float], t0: float) -> Array:
        """(n, s) change of the stacked curve for one sigma of each, by central differences."""
        if self.pairs is None:
            self.pairs = [(self._moved(theta, own, 1.0), self._moved(theta, own, -1.0)) for own in self.nuisances]
        halves = [(stacked(up, observations, t0) - stacked(down, observations, t0)) / 2.0 for up, down in self.pairs]
        return np.stack(halves, axis=1) if halves else np.zeros((len(observations.values), 0))

    def _moved(self, theta: Mapping[str, float], own: Nuisance, sigmas: float) -> Histories:
        return self.forward({**theta, own.key: own.value + sigmas * own.sigma})


def stacked(histories: Histories, observations: Observations, t0: float) -> Array:
    """(n,) the histories at the measured instants of every channel; at rest before them."""
    first, end = histories.time[0], histories.time[-1]
    return np.concatenate([histories.at(c.name, np.clip(c.times - t0, first, end)) for c in observations.channels])


def mesh_columns(bands: Histories, observations: Observations, t0: float) -> Array:
    """(n, channels) the mesh's uncertainty, from the curves that `birdstrike converge` writes.

    Half of a band is taken as one standard deviation, because a grid convergence index is meant to hold with 95 %,
    which is an empirical claim (`mesh_convergence.grid_convergence`); along a channel it hangs together. Raises
    UserError for a channel without a band.
    """
    columns = np.zeros((len(observations.values), len(observations.channels)))
    begin = 0
    for j, c in enumerate(observations.channels):
        name = f"{c.name}_uncertainty"
        if name not in bands.channels:
            raise UserError(f'the mesh study has no column "{name}"; run birdstrike converge with this sensor')
        times = np.clip(c.times - t0, bands.time[0], bands.time[-1])
        columns[begin : begin + len(times), j] = bands.at(name, times) / 2.0
        begin += len(times)
    return columns


def stated_discrepancy(case: Case, sensors: Iterable[str], given: float | None) -> dict[str, float]:
    """Shares of their peaks by sensor: the one given for all of them, else what the case states; zeros are left out."""
    stated = case.inversion.discrepancy
    shares = {name: stated.get(name, 0.0) if given is None else given for name in sensors}
    return {name: share for name, share in shares.items() if share}


def discrepancy_columns(shares: Mapping[str, float], observations: Observations) -> Array:
    """(n, s) a slow error of the model, a share of the channel's peak (1 sigma) by its name, Gaussian in time.

    Squared-exponential correlation over a quarter of the record; what of it the parameters can imitate widens their
    intervals, which no residual could show. A channel without a share has no such error.
    """
    blocks: list[Array] = []
    for c in observations.channels:
        share = shares.get(c.name, 0.0)
        if not share:
            blocks.append(np.zeros((len(c.times), 0)))
            continue
        length = DISCREPANCY_LENGTH * max(float(np.ptp(c.times)), 1e-300)
        blocks.append(share * c.peak * factor_between(partial(_gaussian, length), c.times, WORTH_A_COLUMN))
    return np.asarray(block_diag(*blocks), dtype=np.float64)


def _gaussian(length: float, times: Array, others: Array) -> Array:
    """(n, m) squared-exponential correlation of instants (n,) and (m,)."""
    return np.exp(-0.5 * ((times[:, None] - others) / length) ** 2)


FREQUENCIES = 4096  # at least, of the noise's density, up to half of the sampling frequency
WORTH_RAISING = 0.01  # of the density: less is within what nobody knows of a noise


def noise_columns(observations: Observations) -> Array:
    """(n, s) SI: what the readings at rest leave unknown of a correlated noise, one standard deviation each.

    The density of a first-order process at a frequency w, S = s^2 / (1 - 2 r cos w + r^2) with s^2 and r from n
    readings, errs by the share 2/n + (1 - r^2)/n (d ln S / d r)^2 in variance, as a chi-square of 2 over that many
    degrees of freedom does: n / (1 + 2 tau) at frequency 0, n where it is fast. An error at that frequency is Student's
    then. The density is raised so that a normal distribution holds 95 % within what Student's does; of frequencies that
    `INSTANTS` can show.
    """
    return np.asarray(block_diag(*(_noise_unknown(c) for c in observations.channels)), dtype=np.float64)


def _noise_unknown(channel: Channel) -> Array:
    """Of one channel; none where its noise is white or well known."""
    times, n = channel.times, len(channel.times)
    r, known = float(np.median(channel.correlation[1:])) if n > 1 else 0.0, channel.points_of_noise
    if not r or not known:
        return np.zeros((n, 0))
    count = max(FREQUENCIES, 2 * n)
    w = (np.arange(count) + 0.5) * np.pi / count
    under = 1.0 - 2.0 * r * np.cos(w) + r**2
    share = (2.0 + (1.0 - r**2) * (2.0 * (np.cos(w) - r) / under) ** 2) / known
    raised = (student_t.ppf(0.975, np.maximum(2.0 / share, 1.0)) / NORMAL_95) ** 2 - 1.0
    seen = (raised > WORTH_RAISING) & (w < np.pi * min(INSTANTS / n, 1.0))
    density = np.where(seen, (1.0 - r**2) / under * raised, 0.0)
    step, lags = float(np.median(np.diff(times))), np.arange(count)
    waves = np.fft.ifft(np.concatenate([density, density[::-1]]))[:count] * np.exp(0.5j * np.pi * lags / count)

    def covariance(some: Array, others: Array) -> Array:
        return np.interp(np.abs(some[:, None] - others) / step, lags, waves.real)

    return (
        channel.noise[:, None] * factor_between(covariance, times, WORTH_A_COLUMN) if seen.any() else np.zeros((n, 0))
    )


def poor(emulator: CurveEmulator) -> bool:
    """Whether a channel's left-out runs are predicted too poorly for the processes' own variances to be believed."""
    return bool(emulator.validation.q2 < POOR_Q2)


def error_columns(emulator: Emulator, dataset: Dataset, observations: Observations, t0: float = 0.0) -> Array:
    """(n, s) SI: a column for one standard deviation of each part of the poor channels' error; t0 [s]: of the clock."""
    used = np.isin(dataset.runs, emulator.runs)
    blocks = [
        _channel(emulator.channels[c.name], dataset.curves[c.name][used], c.times - t0) for c in observations.channels
    ]
    return np.asarray(block_diag(*blocks), dtype=np.float64)


def _channel(emulator: CurveEmulator, curves: Array, times: Array) -> Array:
    """Of one channel; none where it is predicted well."""
    if not poor(emulator):
        return np.zeros((len(times), 0))
    residual = curves - left_out(emulator, curves)
    grid, length = emulator.time, TAPER * float(np.ptp(emulator.time))
    if len(times) <= len(grid):
        rows = np.stack([np.interp(times, grid, row) for row in residual])
        return factor_of(rows.T @ rows / len(rows) * _gaussian(length, times, times), KEPT)
    factor = factor_of(residual.T @ residual / len(residual) * _gaussian(length, grid, grid), KEPT)
    return np.stack([np.interp(times, grid, column) for column in factor.T], axis=1)


def left_out(emulator: CurveEmulator, curves: Array) -> Array:
    """(runs, m) every run as the others predict it."""
    if not emulator.processes:
        return np.broadcast_to(emulator.mean, curves.shape)
    scores = np.stack([process.loo for process in emulator.processes], axis=1)
    return emulator.mean + scores @ emulator.basis[: len(emulator.processes)]
