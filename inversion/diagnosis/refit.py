"""Refits: where a model fits best, parameters and magnitudes, by Gauss-Newton on the emulator with the whole covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.discrepancy import Amplitudes, Shape
from birdstrike.inversion.diagnosis.evidence import MAGNITUDE_SD, Evidence, Judge
from birdstrike.inversion.diagnosis.hypotheses import Hypothesis, Suspect
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.inversion.diagnosis.system import PRIOR_SD, Options, Places, System, build

STEPS = 6
CLOSE = 0.02  # of a range: change of a parameter at which a refit has settled


@dataclass(frozen=True)
class Fit:
    """A model where it fits: system about there, its judge, its evidence there."""

    places: Places
    system: System
    judge: Judge
    evidence: Evidence

    def interval(self, group: str, k: int) -> tuple[Array, Array]:
        """(k,) mean and standard deviation of a group's parameters, fractions of the ranges."""
        at = self.system.groups.index(group) * k
        mean = 0.5 + PRIOR_SD * self.evidence.z[at : at + k]
        return mean, PRIOR_SD * np.sqrt(np.diag(self.evidence.z_cov)[at : at + k])


@dataclass(frozen=True)
class Problem:
    """What every refit needs."""

    shots: tuple[Shot, ...]
    found: tuple[Suspect, ...]
    known: Amplitudes
    shapes: Mapping[str, Shape]
    options: Options = Options()
    scale: float = MAGNITUDE_SD

    def start(self) -> Places:
        """The middle of the ranges, no effect."""
        return Places({shot.group: np.full(len(shot.setup.lows), 0.5) for shot in self.shots}, {})

    def refit(self, hypothesis: Hypothesis, start: Places | None = None, steps: int = STEPS) -> Fit:
        """Gauss-Newton with the amplitudes' posterior, halved steps where the emulator bends."""
        places = start or self.start()
        members = hypothesis.members
        fit = self._judged(hypothesis, places, members)
        for _ in range(steps):
            following = self._moved(fit, hypothesis)
            moved = max(float(np.abs(following.z[g] - places.z[g]).max()) for g in places.z)
            places = following
            fit = self._judged(hypothesis, places, members)
            if moved < CLOSE:
                break
        return fit

    def _judged(self, hypothesis: Hypothesis, places: Places, members: Sequence[Suspect]) -> Fit:
        system = build(self.shots, self.found, places, self.known, self.shapes, self.options)
        judge = Judge(system, self.known, places.h, self.scale)
        sizes = [places.h[one.label] for one in members] if places.h else None
        return Fit(places, system, judge, judge.model(hypothesis, sizes))

    def _moved(self, fit: Fit, hypothesis: Hypothesis) -> Places:
        """The posterior mean, inside the emulator's box and the effects' limits."""
        z: dict[str, Array] = {}
        for shot in self.shots:
            k = len(shot.setup.lows)
            mean, _ = fit.interval(shot.group, k)
            step = np.clip(mean - fit.places.z[shot.group], -0.35, 0.35)
            z[shot.group] = np.clip(fit.places.z[shot.group] + step, shot.setup.lows, shot.setup.highs)
        h = {
            one.label: float(np.clip(size, *one.limits))
            for one, size in zip(hypothesis.members, fit.evidence.h, strict=True)
        }
        return Places(z, h)
