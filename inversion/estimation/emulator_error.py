"""The error of a channel that the emulator predicts poorly, as its left-out runs show it.

Where the leave-one-out Q2 of a channel is low, the curves jitter in ways that no process explains, and the processes'
own variances are too small. The channel then carries the covariance of its leave-one-out residuals besides, so that it
counts for what it is worth beside the channels that are predicted well. The covariance of a few dozen residuals is
tapered in time (Gaspari and Cohn, Q. J. R. Meteorol. Soc. 125 (1999) 723, sect. 4): far instants correlate by chance.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.observations import Channel, Observations
from birdstrike.inversion.observations.prior_predictive import POOR_Q2
from birdstrike.surrogate.emulator import CurveEmulator, Emulator

TAPER = 0.2  # of the simulated record: correlation length of the taper
KEPT = 1e-6  # share of the variance below which a column is dropped


def poor(emulator: CurveEmulator) -> bool:
    """Whether a channel's left-out runs are predicted too poorly for the processes' own variances to be believed."""
    return bool(emulator.validation.q2 < POOR_Q2)


def error_columns(emulator: Emulator, dataset: Dataset, observations: Observations) -> Array:
    """(n, s) SI: a column for one standard deviation of each part of the poor channels' error."""
    used = np.isin(dataset.runs, emulator.runs)
    blocks = [_channel(emulator.channels[c.name], dataset.curves[c.name][used], c) for c in observations.channels]
    return np.asarray(block_diag(*blocks), dtype=np.float64)


def _channel(emulator: CurveEmulator, curves: Array, channel: Channel) -> Array:
    """Of one channel; none where it is predicted well."""
    if not poor(emulator):
        return np.zeros((len(channel.times), 0))
    residual = curves - left_out(emulator, curves)
    rows = np.stack([np.interp(channel.times, emulator.time, row) for row in residual])
    apart = (channel.times[:, None] - channel.times) / (TAPER * float(np.ptp(emulator.time)))
    covariance = rows.T @ rows / len(rows) * np.exp(-0.5 * apart**2)
    values, vectors = np.linalg.eigh(covariance)
    kept = values > KEPT * values.sum()
    return vectors[:, kept] * np.sqrt(values[kept])


def left_out(emulator: CurveEmulator, curves: Array) -> Array:
    """(runs, m) every run as the others predict it."""
    if not emulator.processes:
        return np.broadcast_to(emulator.mean, curves.shape)
    scores = np.stack([process.loo for process in emulator.processes], axis=1)
    return emulator.mean + scores @ emulator.basis[: len(emulator.processes)]
