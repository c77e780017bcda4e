"""Baseline shots: what their residuals tell of the discrepancy, and what is wrong with a baseline that cannot serve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis_v2.discrepancy import Amplitudes, Shape, shape_of
from birdstrike.inversion.diagnosis_v2.evidence import Evidence
from birdstrike.inversion.diagnosis_v2.hypotheses import NONE, Hypothesis
from birdstrike.inversion.diagnosis_v2.refit import Fit, Problem
from birdstrike.inversion.diagnosis_v2.shots import Shot

NOTHING = Hypothesis(NONE, (), 1.0, NONE)


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
        smooth = discrepancy_of(shot, fit)
        grid = shot.split(shot.setup.grid(fit.places.z[shot.group][None])[0])
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


def discrepancy_of(shot: Shot, fit: Fit) -> Array:
    """(n,) posterior mean of the discrepancy of a single calibrated shot, in the record's units."""
    system = fit.system
    best = fit.judge.combinations[int(fit.evidence.weights.argmax())]
    left = fit.judge.columns[:, 0] - fit.judge.columns[:, fit.judge.free] @ fit.evidence.z
    found = np.zeros(len(left))
    for block, a in zip(system.blocks, best, strict=True):
        covariance = block.F + a**2 * block.U
        found[block.rows] = a**2 * block.U @ cho_solve(cho_factor(covariance), left[block.rows])
    return system.noise @ found


def residual_rms(shot: Shot, fit: Fit) -> dict[str, float]:
    """channel -> RMS of a calibrated shot's residual, SI."""
    curve = shot.sample(shot.setup.grid(fit.places.z[shot.group][None]))[0]
    residual = shot.record.values - curve
    return {
        trace.name: float(np.sqrt(np.mean(residual[shot.record.channel == i] ** 2)))
        for i, trace in enumerate(shot.record.traces)
    }


def amplitude_of(evidence: Evidence) -> dict[str, float]:
    """kind -> posterior mean share of the peak."""
    return dict(evidence.amplitudes)
