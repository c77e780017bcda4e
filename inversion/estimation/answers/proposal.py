"""A method's parameters before they are verified: by network or emulator, or what a deficient design carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import plain, quantity
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.answers.estimates import (
    COARSE,
    OUTSIDE,
    emulator_estimates,
    intervals,
    no_separate_values,
)
from birdstrike.inversion.estimation.answers.network_inversion import NetworkAnswer, network_estimates
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import Coordinates
from birdstrike.inversion.estimation.posterior import Posterior
from birdstrike.inversion.results.estimates import Combination, Estimate
from birdstrike.inversion.results.ingredients import DesignFigures
from birdstrike.surrogate.inverse_network import NetworkFit


@dataclass(frozen=True)
class Proposal:
    """theta: (k,) SI, where the verification runs; combination: of a deficient design, whose estimates are empty."""

    theta: Array
    estimates: Mapping[str, Estimate]
    combination: Combination | None


@dataclass(frozen=True)
class Calibration:
    """What both methods stand on: the runs, their design, the calibration, and whether the model can make the curve.

    calibrator: the fitting problem with the noise of the record; raised: the same with the noise as the residual of its
    best fit shows, of which the modes are, and with them all that is said of how well the record determines the
    parameters; posterior: drawn about the modes, None where the design is deficient or it was not asked for.
    """

    dataset: Dataset
    design: DesignFigures
    calibrator: Calibrator
    raised: Calibrator
    modes: tuple[Mode, ...]
    inside: bool
    posterior: Posterior | None = None

    @property
    def coordinates(self) -> Coordinates:
        """Parameters, or the combinations that the design carries."""
        return self.calibrator.coordinates


def by_emulator(calibration: Calibration) -> Proposal:
    """The best fit of the emulator."""
    if calibration.design.deficient:
        return _carried(calibration, calibration.modes[0].z, intervals(calibration.modes))
    estimates = emulator_estimates(
        calibration.dataset, calibration.calibrator, calibration.modes, calibration.inside, calibration.posterior
    )
    return Proposal(calibration.modes[0].theta, estimates, None)


def by_network(calibration: Calibration, fit: NetworkFit, answer: NetworkAnswer) -> Proposal:
    """The network's answer; on a rank-deficient design its nearest point on what the design carries."""
    if calibration.design.deficient:
        return _carried(calibration, np.clip(calibration.coordinates.nearest(answer.theta), 0.0, 1.0), None)
    estimates = network_estimates(calibration.dataset, fit, answer, calibration.inside)
    return Proposal(answer.theta, estimates, None)


def not_identified(proposal: Proposal, dataset: Dataset, coarse: bool) -> Proposal:
    """The same where nothing is identified; coarse: because the emulator cannot follow the record, not the model."""
    if proposal.combination is not None:
        return proposal
    if not coarse:
        unknown = {
            name: replace(estimate, interval_95=None, identified=False, reason=OUTSIDE)
            for name, estimate in proposal.estimates.items()
        }
        return replace(proposal, estimates=unknown)
    limits = dataset.ranges
    known = {
        name: replace(estimate, interval_95=limits[name], identified=False, reason=COARSE)
        for name, estimate in proposal.estimates.items()
    }
    return replace(proposal, estimates=known)


def _carried(calibration: Calibration, z: Array, span: Array | None) -> Proposal:
    """No separate values, and the carried combination in their place."""
    dataset, coordinates = calibration.dataset, calibration.coordinates
    theta = coordinates.theta(z, coordinates.boxes[0])
    point = dataset.named(theta)
    directions = tuple(map(dataset.named, coordinates.changes()))
    known = tuple((float(low), float(high)) for low, high in span) if span is not None else (None,) * len(z)
    combination = Combination(directions, tuple(map(float, z)), known, point, _sentence(calibration, theta, z, known))
    return Proposal(theta, no_separate_values(dataset, calibration.design), combination)


def _sentence(calibration: Calibration, theta: Array, z: Array, span: tuple[tuple[float, float] | None, ...]) -> str:
    """The combination in words: where on each direction, and which values of the parameters that means together."""
    places = ", ".join(
        f"{place:.2f}" + (f" (95 %: {known[0]:.2f} .. {known[1]:.2f})" if known else "")
        for place, known in zip(z, span, strict=True)
    )
    values = ", ".join(
        f"{plain(name, calibration.dataset.names)} {quantity(value, unit)}"
        for name, unit, value in zip(calibration.dataset.names, calibration.dataset.units, theta, strict=True)
    )
    return f"{calibration.design.sentence}; at {places} of the way through the runs, that is together {values}"
