"""Fits without a part of the data, and the solver's error there: each shot from the others, or thirds of one record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.progress import silent
from birdstrike.inversion.estimation.locate import locate
from birdstrike.inversion.estimation.shots import Shot, joined, suffix
from birdstrike.inversion.models.campaigns import ModelRuns
from birdstrike.inversion.models.error_terms import Discrepancy, with_discrepancy
from birdstrike.inversion.models.points import residuals_of, yardstick
from birdstrike.surrogate.emulator import Emulator

BLOCKS = 3  # time blocks of a single record, each left out once

Residuals = Mapping[str, tuple[float, ...]]
"""Channel -> residuals over their noise."""


@dataclass(frozen=True)
class HeldOutFits:
    """The joint fit, repeated without a part.

    dataset, emulator: of all shots; origins: (time origin [s], whether it is known) by shot; share: of the peaks, the
    size of the discrepancy that the joint fit chose.
    """

    runs: ModelRuns
    dataset: Dataset
    shots: Sequence[Shot]
    origins: Sequence[tuple[float, bool]]
    emulator: Emulator
    discrepancy: Discrepancy
    share: float

    def answers(self) -> dict[str, tuple[dict[str, float], Residuals]]:
        """Shot -> what the rest gave (as the estimation sees it), and the solver's residuals there over their noise."""
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
            found = locate(joint.dataset, joint.measured, joint.options, own, silent, columns)
            thetas.append(self.dataset.named(found.calibration.modes[0].theta))
        self.runs.simulated(zip(self.runs.cases, thetas, strict=True))
        answers = {}
        for setup, shot, theta, (t0, _) in zip(self.runs.setups, self.shots, thetas, self.origins, strict=True):
            answers[setup.name] = (theta, residuals_of(shot, shot.verified_by(theta), t0))
        return answers

    def _time_blocks(self) -> dict[str, tuple[dict[str, float], Residuals]]:
        """Of a single record: each third in time from the other two."""
        (shot,), ((t0, _),) = self.shots, self.origins
        record, case = shot.measured, self.runs.cases[0]
        begin, end = case.first_contact + t0, yardstick(shot).last
        edges = np.linspace(begin, end * (1.0 + 1e-9), BLOCKS + 1)
        columns = with_discrepancy(shot.columns, self.discrepancy, self.share)
        thetas = []
        for low, high in pairwise(edges):
            inside = (record.time >= low) & (record.time < high)
            left = {name: np.where(inside, np.nan, values) for name, values in record.channels.items()}
            found = locate(self.dataset, replace(record, channels=left), shot.options, self.emulator, silent, columns)
            thetas.append(self.dataset.named(found.calibration.modes[0].theta))
        self.runs.simulated([(case, theta) for theta in thetas])
        together: dict[str, tuple[float, ...]] = {}
        for theta, low, high in zip(thetas, edges[:-1], edges[1:], strict=True):
            for name, own in residuals_of(shot, shot.verified_by(theta), t0, (low, high)).items():
                together[name] = together.get(name, ()) + own
        return {self.runs.setups[0].name: (thetas[0], together)}


def _part(dataset: Dataset, shot: Shot, number: int) -> Shot:
    """A shot with its part of the joint runs, those near the answer included."""
    own = {name: dataset.curves[name + suffix(number)] for name in shot.dataset.curves}
    units = {name: dataset.channel_units[name + suffix(number)] for name in shot.dataset.curves}
    return replace(shot, dataset=replace(dataset, curves=own, channel_units=units))
