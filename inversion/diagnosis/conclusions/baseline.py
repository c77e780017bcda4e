"""Baseline shots: what their residuals tell of the discrepancy, and what is wrong with a baseline that cannot serve.

Whether the birds of all shots are of one recipe: what was stated, what the records say, and what follows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, plain
from birdstrike.data.histories import Array
from birdstrike.inversion.conditions import same_structure
from birdstrike.inversion.diagnosis.conclusions.before_and_after import rms_by_channel
from birdstrike.inversion.diagnosis.inference.hypotheses import AUTO, BIRDS, CONTRADICTED, NOTHING
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Problem, Ranking
from birdstrike.inversion.diagnosis.preparation.discrepancy import (
    UNCLEAN,
    Amplitudes,
    Shape,
    shape_of,
    unknown_or_stated,
)
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.diagnosis.preparation.shots import Shot, read_shot
from birdstrike.inversion.results.diagnosis import of_another_bird
from birdstrike.solver.case.case import Case

TRUNCATED = 0.6  # of the simulated time: a shorter baseline says nothing of the rest


@dataclass(frozen=True)
class Baselines:
    """shots: those that serve; fits: their calibrations; warnings: why others do not, and what the user must know."""

    shots: tuple[Shot, ...] = ()
    fits: Mapping[str, tuple[Shot, Fit]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def unfit(record: Measured, case: Case, first: Case, channels: Sequence[str]) -> str:
    """Why a baseline cannot serve the first shot, its channels; empty where it can. Known before any simulation."""
    if not same_structure(case, first):
        return "its case has another plate or target; a baseline must be a shot at the same rig"
    if not any(channel in record.channels for channel in channels):
        own = ", ".join(record.channels)
        lacking = f"it has none of the shot's sensors ({', '.join(channels)}), only {own}"
        return f"{lacking}; rename its columns, or leave it out"
    end = case.time.end
    if float(record.time[-1]) < TRUNCATED * end:
        shown = f"it ends at {1e3 * float(record.time[-1]):.3g} ms, the simulation at {1e3 * end:.3g} ms"
        return f"{shown}; use the whole record"
    return ""


def read_baselines(records: Mapping[str, tuple[Measured, Setup]], channels: Sequence[str]) -> Baselines:
    """The baselines by name, calibrated; what cannot be read is left out with a warning that says why.

    channels: of the measured shots.
    """
    fits: dict[str, tuple[Shot, Fit]] = {}
    warnings: list[str] = []
    for name, (record, setup) in records.items():
        try:
            one = read_shot(name, setup, record, True)
        except UserError as error:
            warnings.append(left_out(name, "; ".join(error.errors)))
            continue
        known = unknown_or_stated(tuple(dict.fromkeys(one.kinds)), {})
        fit = calibrated(one, known, mesh_shapes((one,)))
        fits[name] = (one, fit)
        lacking = [channel for channel in channels if channel not in one.channels]
        if lacking:
            warnings.append(f"{name} has no {listing(list(map(plain, lacking)))}: there the model error stays unknown")
        warnings += unclean(name, fit)
    return Baselines(tuple(shot for shot, _ in fits.values()), fits, tuple(warnings))


def left_out(name: str, reason: str) -> str:
    """The warning about a baseline that is not used."""
    return f"{name} is left out: {reason}"


def unclean(name: str, fit: Fit) -> list[str]:
    """What a baseline far from the calibrated model means for the answer."""
    return [
        f"{name} itself differs from the calibrated model by {100 * amplitude:.0f} % of the peak "
        f"({kind.replace('_', ' ')}): something may be wrong with it, and an effect that it shares with the shot "
        "cannot be found; check it, or repeat without it"
        for kind, amplitude in fit.evidence.amplitudes.items()
        if amplitude > UNCLEAN and kind != "contact_force"
    ]


def mesh_shapes(shots: Sequence[Shot]) -> dict[str, Shape]:
    """channel -> the discrepancy in time, from what meshes differ by."""
    found: dict[str, Shape] = {}
    for shot in shots:
        for channel, shape in shot.shapes.items():
            found.setdefault(channel, shape)
    return found


def calibrated(shot: Shot, known: Amplitudes, shapes: Mapping[str, Shape]) -> Fit:
    """A baseline by itself, without effects; its amplitudes are marginalised."""
    alone = replace(shot, baseline=False)
    return Problem((alone,), (), known, shapes).refit(NOTHING)


def baseline_shapes(fits: Mapping[str, tuple[Shot, Fit]], shapes: Mapping[str, Shape]) -> dict[str, Shape]:
    """The shapes with the growth in time that the baselines' discrepancies show.

    fits: baselines by name with their calibrations.
    """
    draws: dict[str, list[Array]] = {}
    curves: dict[str, Array] = {}
    for shot, fit in fits.values():
        smooth = discrepancy_of(fit)
        grid = shot.setup.split(shot.setup.grid(fit.places.z[shot.name][None])[0])
        for i, trace in enumerate(shot.record.traces):
            own = np.interp(shot.setup.time, trace.middle, smooth[shot.record.channel == i])
            draws.setdefault(trace.name, []).append(own)
            curves[trace.name] = grid[trace.name]
    time = next(iter(fits.values()))[0].setup.time
    found = dict(shapes)
    for channel, rows in draws.items():
        shape = shape_of(np.array(rows), curves[channel], time)
        found[channel] = Shape(shape.growth, shapes[channel].length)
    return found


def larger_shapes(shapes: Mapping[str, Shape], other: Mapping[str, Shape]) -> dict[str, Shape]:
    """At every instant the larger of two growths; each is the least that its draws show beyond chance."""
    return {
        channel: replace(shape, growth=np.maximum(shape.growth, other[channel].growth))
        for channel, shape in shapes.items()
    }


def discrepancy_of(fit: Fit) -> Array:
    """(n,) posterior mean of the discrepancy of a single calibrated shot, in the record's units."""
    system = fit.system
    best = fit.tester.combinations[int(fit.evidence.weights.argmax())]
    left = fit.tester.columns[:, 0] - fit.tester.columns[:, fit.tester.free] @ fit.evidence.z
    found = np.zeros(len(left))
    for block, a in zip(system.blocks, best, strict=True):
        covariance = block.F + a**2 * block.U
        found[block.rows] = a**2 * block.U @ cho_solve(cho_factor(covariance), left[block.rows])
    return system.noise @ found


def residual_rms(shot: Shot, fit: Fit) -> dict[str, float]:
    """channel -> RMS of a calibrated shot's residual, SI."""
    curve = shot.sample(shot.setup.grid(fit.places.z[shot.name][None]))[0]
    residual = shot.record.values - curve
    return rms_by_channel(shot, residual)


@dataclass(frozen=True)
class Birds:
    """What is known of the birds.

    stated: one of `BIRDS`, or `auto`; several: whether there are shots whose birds may differ, baselines included.
    """

    ranking: Ranking
    stated: str
    several: bool

    @property
    def contradicted(self) -> bool:
        """Whether the records make what is stated of the birds unlikely."""
        return self.several and self.stated != AUTO and self.ranking.birds[self.stated] < CONTRADICTED

    @property
    def same(self) -> float | None:
        """Probability that the birds of all shots, baselines included, are one; None of a single shot.

        0 where the records contradict what was stated of them: an answer on a wrong premise attributes nothing.
        """
        if not self.several:
            return None
        return 0.0 if self.contradicted else self.ranking.same_bird

    @property
    def figures(self) -> dict[str, Any]:
        """`baseline.bird` of diagnosis.json."""
        return {"stated": self.stated, "records": self.ranking.birds, "contradicted": self.contradicted}

    @property
    def warnings(self) -> list[str]:
        """Where the birds are not what was stated, or not one, so that nothing is attributed."""
        stated = self.stated
        if not self.several:
            if stated == AUTO:
                return []
            return [
                f"the birds are stated to be alike or not ({stated}), but there is a single shot: the statement has no "
                "effect; pass the record of the clean shot with --baseline"
            ]
        if self.contradicted:
            birds = self.ranking.birds
            likeliest = max(BIRDS, key=lambda name: birds[name])
            return [
                f"the records contradict what was stated of the birds ({stated}: {_probability(birds[stated])}; "
                f"{likeliest}: {birds[likeliest]:.2f}): the effects rest on a wrong premise, so that none is "
                "attributed; check the birds of all shots, or leave --baseline-bird at auto"
            ]
        if not of_another_bird(self.same):
            return []
        known = "as stated" if stated != AUTO else f"{_probability(self.ranking.same_bird)} that they are"
        return [
            f"the birds of the shots and baselines are not of one recipe ({known}): model error changes with the bird "
            "and may be taken for an effect, so that an alarm means little and none is attributed; fire a baseline "
            "with a bird of the shot's own recipe"
        ]


def _probability(value: float) -> str:
    """`probability 0.03`; of what is as good as excluded a limit."""
    return "probability below 0.001" if value < 0.001 else f"probability {value:.2g}"
