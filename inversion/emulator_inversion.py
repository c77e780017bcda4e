"""Inversion by the forward emulator: the best fit, linearised 95 % intervals, and what is not identified."""

from __future__ import annotations

from data.dataset import Dataset
from inversion.calibration import Calibrator, Mode
from inversion.design_gate import DesignFigures
from inversion.identifiability import NEWS, intervals, reason
from inversion.inversion import Estimate


def emulator_estimates(
    dataset: Dataset, calibrator: Calibrator, modes: tuple[Mode, ...], inside_cloud: bool
) -> dict[str, Estimate]:
    """One estimate a parameter from a calibration in parameter coordinates; nothing is identified outside the cloud."""
    coordinates = calibrator.coordinates
    span, prior = intervals(modes), coordinates.prior_width()
    theta = modes[0].theta
    estimates: dict[str, Estimate] = {}
    for i, name in enumerate(dataset.names):
        width = float(span[i, 1] - span[i, 0]) / float(prior[i])
        identified = inside_cloud and width < NEWS
        if not inside_cloud:
            estimates[name] = Estimate(float(theta[i]), None, dataset.units[i], False, OUTSIDE)
            continue
        why = reason(calibrator, modes, i, width, identified)
        low, high = (float(dataset.lows[i] + z * (dataset.highs[i] - dataset.lows[i])) for z in span[i])
        estimates[name] = Estimate(float(theta[i]), (low, high), dataset.units[i], identified, why)
    return estimates


OUTSIDE = "the model cannot produce the record, so its best fit does not tell this parameter"


def no_separate_values(dataset: Dataset, design: DesignFigures) -> dict[str, Estimate]:
    """Estimates from a rank-deficient design: none, and why."""
    why = f"{design.sentence}: this parameter changed only together with others"
    pairs = zip(dataset.names, dataset.units, strict=True)
    return {name: Estimate(None, None, unit, False, why) for name, unit in pairs}
