"""What is reported of each parameter: value, interval, whether the record identifies it, and why, in one line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import plain, reading, span
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import Coordinates
from birdstrike.inversion.estimation.posterior import Posterior
from birdstrike.inversion.estimation.prior import identified
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.inversion.results.ingredients import DesignFigures
from birdstrike.surrogate.gaussian_process import NORMAL_95

LOOKS_ALIKE = 0.8  # correlation from which another parameter is named
GRID = 21
NEAR_BOUND = 0.02  # of a range


@dataclass(frozen=True)
class Sensitivity:
    """Largest change of the curve over one coordinate's whole range, in the channel where it stands out most, SI."""

    channel: str
    unit: str
    change: float
    noise: float

    @property
    def sentence(self) -> str:
        """The change against the noise, in the engineers' unit."""
        change, noise = reading(self.change, self.unit, 2), reading(self.noise, self.unit, 2)
        against = f"less than the noise ({noise})" if self.change < self.noise else f"noise {noise}"
        return f"the {plain(self.channel)} changes by at most {change} over its whole range, {against}"


def intervals(modes: tuple[Mode, ...], stated: NDArray[np.bool_] | None = None) -> Array:
    """(r, 2) the 95 % intervals of z: each mode's linearised one inside its box, and the hull of all modes.

    Where a parameter is off the whole box is possible, unless the case states a prior of it.
    stated: (r,) where it does.
    """
    low, high = [], []
    for mode in modes:
        spread = NORMAL_95 * np.sqrt(np.diag(mode.covariance)[:-1])
        whole = mode.box.flat & ~(np.zeros_like(mode.box.flat) if stated is None else stated)
        low.append(np.where(whole, mode.box.lows, np.maximum(mode.z - spread, mode.box.lows)))
        high.append(np.where(whole, mode.box.highs, np.minimum(mode.z + spread, mode.box.highs)))
    return np.stack([np.min(low, axis=0), np.max(high, axis=0)], axis=1)


def sensitivity(calibrator: Calibrator, mode: Mode, i: int) -> Sensitivity:
    """How much the emulated curve moves when coordinate i runs through every box, the others held at the fit."""
    others = np.arange(len(mode.z)) != i
    rows: list[Array] = []
    for box in calibrator.coordinates.boxes:
        if np.all((mode.z >= box.lows - 1e-6) & (mode.z <= box.highs + 1e-6) | ~others):
            z = np.tile(mode.z, (GRID, 1))
            z[:, i] = np.linspace(box.lows[i], box.highs[i], GRID)
            rows.append(calibrator.coordinates.theta(z, box))
    model = calibrator.model
    curves = model.curves(model.scores(np.vstack(rows)), mode.t0)
    spans = model.observations.split(np.ptp(curves, axis=0))
    found = [Sensitivity(c.name, c.unit, float(spans[c.name].max()), rms(c.noise)) for c in model.observations.channels]
    return max(found, key=lambda s: s.change / s.noise)


def reason(calibrator: Calibrator, modes: tuple[Mode, ...], i: int, width: float, known: bool) -> str:
    """Why coordinate i is identified (known) or not; width: of its interval, as a share of the prior's."""
    felt = sensitivity(calibrator, modes[0], i)
    if felt.change < felt.noise:
        return felt.sentence
    wide = f"{100 * width:.0f} % as wide as the prior's" if width < 1.0 else "no narrower than the prior's"
    share = f"the interval is {wide}; {felt.sentence}"
    if known:
        return share + _at_bound(modes[0], i)
    fit_as_well = len({(mode.box.lows[i], mode.box.highs[i]) for mode in modes}) > 1
    if modes[0].box.flat[i]:
        also = "; where it acts, some values fit as well" if fit_as_well else "; no value at which it acts fits"
        return f"it is off at the best fit, where no value changes the curve{also}"
    also = "; where it is off, the curve fits as well" if fit_as_well else ""
    return share + _look_alike(calibrator, modes[0], i) + also


def _stated_prior(dataset: Dataset, coordinates: Coordinates, i: int) -> str:
    """What a prior that the case states of parameter i adds to the reason; empty where it states none."""
    prior = coordinates.prior
    if not prior.stated[i]:
        return ""
    low, high = (float(coordinates.unlimited(prior.place(np.full(len(prior.mean), side)))[i]) for side in (-1.0, 1.0))
    return f"; the case states {span(low, high, dataset.units[i])} beforehand, one standard deviation to each side"


def _look_alike(calibrator: Calibrator, mode: Mode, i: int) -> str:
    """The other unknown that makes up for this one, if one does."""
    sd = np.sqrt(np.diag(mode.covariance))
    known = sd > 0.0
    correlation = np.where(known, mode.covariance[i] / (sd[i] * np.where(known, sd, 1.0)), 0.0)
    correlation[i] = 0.0
    j = int(np.argmax(np.abs(correlation)))
    if abs(correlation[j]) < LOOKS_ALIKE:
        return ""
    names = calibrator.coordinates.names
    other = "the time origin" if j == len(mode.z) else plain(names[j], names)
    return f", but {other} can make up for it (correlation {correlation[j]:+.2f})"


def _at_bound(mode: Mode, i: int) -> str:
    if min(mode.z[i], 1.0 - mode.z[i]) > NEAR_BOUND:
        return ""
    return f"; the best fit is at the {'lower' if mode.z[i] < 0.5 else 'upper'} end of the range"


def reported(
    value: float, interval: tuple[float, float], limits: tuple[float, float], known: bool
) -> tuple[float, float]:
    """The 95 % interval that is reported with a value, one rule for every method, SI.

    The `limits` of a parameter that is not known (identified), its whole range; else the `interval`, widened to the
    value where this lies outside: the most probable value of a skew posterior may stand in a tail, most often at an end
    of the range.
    """
    if not known:
        return limits
    return min(interval[0], value), max(interval[1], value)


def emulator_estimates(
    dataset: Dataset,
    calibrator: Calibrator,
    modes: tuple[Mode, ...],
    inside: bool,
    posterior: Posterior | None = None,
) -> dict[str, Estimate]:
    """One estimate a parameter from a calibration in parameter coordinates; where the model cannot
    produce the record nothing is identified.

    The most probable value with the posterior's central interval (linearised where none was drawn), widened to hold
    it; a parameter that is not identified has its whole range, unless the case states a prior, which the posterior has.
    """
    coordinates = calibrator.coordinates
    stated, prior = coordinates.prior.stated, coordinates.prior.width()
    ends = posterior.interval() if posterior else intervals(modes, stated)
    theta = modes[0].theta
    estimates: dict[str, Estimate] = {}
    for i, name in enumerate(dataset.names):
        if not inside:
            estimates[name] = Estimate(float(theta[i]), None, dataset.units[i], False, OUTSIDE)
            continue
        width = float(ends[i, 1] - ends[i, 0]) / float(prior[i])
        found = bool(identified(width, 1.0))
        why = reason(calibrator, modes, i, width, found) + _stated_prior(dataset, coordinates, i)
        low, high = float(dataset.lows[i]), float(dataset.highs[i])
        begin, end = map(float, coordinates.values(i, ends[i]))
        interval = reported(float(theta[i]), (begin, end), (low, high), found or bool(stated[i]))
        estimates[name] = Estimate(float(theta[i]), interval, dataset.units[i], found, why)
    return estimates


OUTSIDE = "the model cannot produce the record, so its best fit does not identify this parameter"
COARSE = "the emulator is too coarse to follow the record, so its best fit does not identify this parameter: add runs"


def no_separate_values(dataset: Dataset, design: DesignFigures) -> dict[str, Estimate]:
    """Estimates from a rank-deficient design: none, and why."""
    why = f"{design.sentence}: this parameter changed only together with others"
    pairs = zip(dataset.names, dataset.units, strict=True)
    return {name: Estimate(None, None, unit, False, why) for name, unit in pairs}
