"""Inversion by the forward emulator: the most probable values, their 95 % intervals, and what is not identified."""

from __future__ import annotations

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.posterior import Posterior
from birdstrike.inversion.identifiability.design_gate import DesignFigures
from birdstrike.inversion.identifiability.identifiability import NEWS, intervals, reason, reported
from birdstrike.inversion.inversion import Estimate


def emulator_estimates(
    dataset: Dataset,
    calibrator: Calibrator,
    modes: tuple[Mode, ...],
    inside_cloud: bool,
    posterior: Posterior | None = None,
) -> dict[str, Estimate]:
    """One estimate a parameter from a calibration in parameter coordinates; nothing is identified outside the cloud.

    The most probable value with the posterior's central interval (linearised where none was drawn), widened to hold
    it; a parameter that is not identified has its whole range.
    """
    coordinates = calibrator.coordinates
    span, prior = posterior.interval() if posterior else intervals(modes), coordinates.prior_width()
    theta = modes[0].theta
    estimates: dict[str, Estimate] = {}
    for i, name in enumerate(dataset.names):
        if not inside_cloud:
            estimates[name] = Estimate(float(theta[i]), None, dataset.units[i], False, OUTSIDE)
            continue
        width = float(span[i, 1] - span[i, 0]) / float(prior[i])
        identified = width < NEWS
        why = reason(calibrator, modes, i, width, identified)
        low, high = float(dataset.lows[i]), float(dataset.highs[i])
        told = (low + float(span[i, 0]) * (high - low), low + float(span[i, 1]) * (high - low))
        interval = reported(float(theta[i]), told, (low, high), identified)
        estimates[name] = Estimate(float(theta[i]), interval, dataset.units[i], identified, why)
    return estimates


OUTSIDE = "the model cannot produce the record, so its best fit does not tell this parameter"
COARSE = "the emulator is too coarse to follow the record, so its best fit does not tell this parameter: add runs"


def no_separate_values(dataset: Dataset, design: DesignFigures) -> dict[str, Estimate]:
    """Estimates from a rank-deficient design: none, and why."""
    why = f"{design.sentence}: this parameter changed only together with others"
    pairs = zip(dataset.names, dataset.units, strict=True)
    return {name: Estimate(None, None, unit, False, why) for name, unit in pairs}
