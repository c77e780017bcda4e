"""Fits without a part of the data, and the solver's error there: each shot from the others, or thirds of one record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.locate import locate
from birdstrike.inversion.estimation.shots import CampaignShot, joined, suffix
from birdstrike.inversion.models.campaigns import ModelRuns
from birdstrike.inversion.models.error_terms import Discrepancy, with_discrepancy
from birdstrike.inversion.models.points import residuals_of, time_blocks
from birdstrike.surrogate.emulator import Emulator

BLOCKS = 3  # time blocks of a single record, each left out once

Residuals = Mapping[str, tuple[float, ...]]
"""Channel -> residuals over their noise."""


class HeldOut(NamedTuple):
    """thetas: part that was left out -> what the rest gave, SI; residuals: shot -> channel ->
    the solver's there, over their noise. A part is a shot, or of a single record "SHOT, third N"."""

    thetas: dict[str, dict[str, float]]
    residuals: dict[str, Residuals]


@dataclass(frozen=True)
class HeldOutFits:
    """The joint fit, repeated without a part.

    dataset, emulator: of all shots; origins: (time origin [s], whether it is known) by shot; share: of the peaks, the
    size of the discrepancy that the joint fit chose.
    """

    runs: ModelRuns
    dataset: Dataset
    shots: Sequence[CampaignShot]
    origins: Sequence[tuple[float, bool]]
    emulator: Emulator
    discrepancy: Discrepancy
    share: float

    def answers(self) -> HeldOut:
        """What the rest gave, and the solver's residuals there."""
        if len(self.shots) == 1:
            return self._time_blocks()
        parts = [_part(self.dataset, shot, i) for i, shot in enumerate(self.shots)]
        thetas = []
        for i in range(len(self.shots)):
            rest = [j for j in range(len(self.shots)) if j != i]
            joint = joined([parts[j] for j in rest], [self.origins[j] for j in rest])
            channels = {
                name + suffix(place): self.emulator.channels[name + suffix(j)]
                for place, j in enumerate(rest)
                for name in self.shots[j].measured.channels
            }
            columns = with_discrepancy(joint.columns, self.discrepancy.only(rest), self.share)
            own = replace(self.emulator, channels=channels)
            found = locate(joint.dataset, joint.measured, joint.options, own, columns)
            thetas.append(self.dataset.named(found.calibration.modes[0].theta))
        self.runs.simulated(zip(self.runs.cases, thetas, strict=True))
        found = HeldOut({}, {})
        for setup, shot, theta, (t0, _) in zip(self.runs.setups, self.shots, thetas, self.origins, strict=True):
            found.thetas[setup.name] = theta
            found.residuals[setup.name] = residuals_of(shot, shot.verified_by(theta), t0)
        return found

    def _time_blocks(self) -> HeldOut:
        """Of a single record: each third in time from the other two."""
        (shot,), ((t0, _),) = self.shots, self.origins
        record, case = shot.measured, self.runs.cases[0]
        edges = time_blocks(shot, BLOCKS)
        columns = with_discrepancy(shot.columns, self.discrepancy, self.share)
        thetas = []
        for low, high in pairwise(edges):
            inside = (record.time >= low) & (record.time < high)
            left = {name: np.where(inside, np.nan, values) for name, values in record.channels.items()}
            found = locate(self.dataset, replace(record, channels=left), shot.options, self.emulator, columns)
            thetas.append(self.dataset.named(found.calibration.modes[0].theta))
        self.runs.simulated([(case, theta) for theta in thetas])
        together: dict[str, tuple[float, ...]] = {}
        for theta, low, high in zip(thetas, edges[:-1], edges[1:], strict=True):
            for name, own in residuals_of(shot, shot.verified_by(theta), t0, (low, high)).items():
                together[name] = together.get(name, ()) + own
        name = self.runs.setups[0].name
        return HeldOut({f"{name}, third {i}": theta for i, theta in enumerate(thetas, 1)}, {name: together})


def _part(dataset: Dataset, shot: CampaignShot, number: int) -> CampaignShot:
    """A shot with its part of the joint runs, those near the answer included."""
    own = {name: dataset.curves[name + suffix(number)] for name in shot.dataset.curves}
    units = {name: dataset.channel_units[name + suffix(number)] for name in shot.dataset.curves}
    return replace(shot, dataset=replace(dataset, curves=own, channel_units=units))
