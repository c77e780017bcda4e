"""The information bound: how well any estimator can do on average over the truths of the prior (van Trees).

E[(estimate - truth)^2] >= diag (E[F] + P)^-1 with Fisher information F of the data, averaged over the truths, and P
that of the prior. Van Trees, "Detection, estimation, and modulation theory I", 1968, sect. 2.4; Gill and Levit,
Bernoulli 1 (1995) 59. The normal prior is taken whole: cutting it off at the ends of the range can only help an
estimator there.
"""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.whitening import Whitening


def fisher(calibrator: Calibrator, z: Array, emulator_error: bool = False) -> Array:
    """(r, r) information of the data on z (r,), the time origin marginalised; with or without the emulator's error."""
    model, coordinates = calibrator.model, calibrator.coordinates
    box = next(b for b in coordinates.boxes if ((z >= b.lows) & (z <= b.highs)).all())
    theta = coordinates.theta(z, box)
    factor = model.error_factor(theta, 0.0)
    if emulator_error:
        return calibrator.data_information(z, 0.0, model.whitening(0.0, factor), box)
    measured = model.observations
    return calibrator.data_information(z, 0.0, Whitening.of(measured.noise, 0.0 * factor, measured.correlation), box)


def bound(calibrator: Calibrator, truths: Array, emulator_error: bool = False) -> Array:
    """(r,) root mean square error of z over the truths (t, r) that van Trees' inequality allows.

    That of a normal prior. Truths of one that is cut off at the ends of the ranges lie closer: where the data say
    little, the prior's mean alone errs less, and this is no bound.
    """
    mean = np.mean([fisher(calibrator, z, emulator_error) for z in truths], axis=0)
    return np.sqrt(np.diag(np.linalg.inv(mean + np.diag(calibrator.coordinates.prior.sd**-2.0))))
