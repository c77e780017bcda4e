"""Held out: each sensor, a block of time and each shot in turn is predicted by fits to the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis_v2.evidence import Judge
from birdstrike.inversion.diagnosis_v2.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis_v2.record import Record
from birdstrike.inversion.diagnosis_v2.refit import Fit, Problem
from birdstrike.inversion.diagnosis_v2.shots import Shot
from birdstrike.inversion.diagnosis_v2.system import PRIOR_SD, build

BLOCK = (0.45, 0.75)  # of the record: a stretch behind the peak, long beside the discrepancy's correlation time
FEWEST = 5  # points left in a channel


@dataclass(frozen=True)
class Held:
    """One part held out: name (time_block, `channel <name>`, `shot <name>`), whitened RMS of its prediction."""

    name: str
    error: float


def hold_out(problem: Problem, hypothesis: Hypothesis, fit: Fit) -> list[Held]:
    """Every part of the measured shots, predicted by the model refitted (linearly, about its fit) to the rest."""
    found = []
    for name, kept, shot in parts(problem.shots):
        found.append(Held(name, _predicted(problem, hypothesis, fit, kept, shot)))
    return found


def parts(shots: Sequence[Shot]) -> list[tuple[str, tuple[Shot, ...], tuple[Shot, np.ndarray]]]:
    """(name, shots that are fitted, (shot, points that are predicted))."""
    measured = [shot for shot in shots if not shot.baseline]
    found = []
    for shot in measured:
        suffix = f" of {shot.name}" if len(measured) > 1 else ""
        end = float(shot.setup.time[-1])
        inside = (shot.record.middle > BLOCK[0] * end) & (shot.record.middle < BLOCK[1] * end)
        found.append((f"time_block{suffix}", _with(shots, shot, masked(shot, ~inside)), (shot, inside)))
        if len(shot.channels) > 1:
            for i, channel in enumerate(shot.channels):
                of = shot.record.channel == i
                found.append((f"channel {channel}{suffix}", _with(shots, shot, masked(shot, ~of)), (shot, of)))
    if len(measured) > 1:
        for shot in measured:
            rest = tuple(one for one in shots if one is not shot)
            found.append((f"shot {shot.name}", rest, (shot, np.ones(len(shot.record.values), dtype=bool))))
    return found


def _with(shots: Sequence[Shot], old: Shot, new: Shot) -> tuple[Shot, ...]:
    return tuple(new if one is old else one for one in shots)


def masked(shot: Shot, keep: np.ndarray) -> Shot:
    """The shot with some of its points; channels with fewer than a handful left are dropped."""
    traces = []
    for i, trace in enumerate(shot.record.traces):
        own = keep[shot.record.channel == i]
        if own.sum() < FEWEST:
            continue
        raw = np.repeat(own, trace.block)
        traces.append(replace(trace, times=trace.times[raw], values=trace.values[own], noise=trace.noise.at(raw)))
    return replace(shot, record=Record(tuple(traces), shot.record.warnings))


def _predicted(
    problem: Problem, hypothesis: Hypothesis, fit: Fit, kept: tuple[Shot, ...], held: tuple[Shot, np.ndarray]
) -> float:
    """RMS of the held-out residual over noise, numerical error and discrepancy."""
    kinds = {kind for shot in kept for kind in shot.kinds}
    known = problem.known.only(kinds)
    found = problem.found
    members = tuple(one for one in hypothesis.members if any(shot.name in one.shots for shot in kept))
    places = replace(fit.places, h={one.label: fit.places.h.get(one.label, 0.0) for one in members})
    system = build(kept, found, places, known, problem.shapes, problem.options)
    judge = Judge(system, known, places.h, problem.scale)
    model = replace(hypothesis, members=members)
    evidence = judge.model(model, [places.h[one.label] for one in members] if members else None)
    shot, points = held
    k = len(shot.setup.lows)
    at = system.groups.index(shot.group) * k if shot.group in system.groups else None
    z = fit.places.z[shot.group] if at is None else 0.5 + PRIOR_SD * evidence.z[at : at + k]
    z = np.clip(z, shot.setup.lows, shot.setup.highs)
    sizes = {one.label: float(h) for one, h in zip(members, evidence.h, strict=True)}
    residual = shot.record.values - predicted(shot, hypothesis, z, sizes)
    sd = error_sd(shot, problem, fit)
    return float(np.sqrt(np.mean((residual[points] / sd[points]) ** 2)))


def predicted(shot: Shot, hypothesis: Hypothesis, z: Array, sizes: dict[str, float]) -> Array:
    """(n,) the model's curve at z with effects of sizes h."""
    grid = shot.setup.grid(z[None])[0]
    curve = shot.sample(grid[None])[0]
    for one in hypothesis.members:
        h = sizes.get(one.label, 0.0)
        if shot.name not in one.shots or not h:
            continue
        if one.fault is not None:
            curve = curve + h * shot.instrument_signature(one.fault, grid)
        else:
            curve = curve + h * shot.sample(shot.setup.responses[one.name].at(z)[None])[0]
    return curve


def error_sd(shot: Shot, problem: Problem, fit: Fit) -> Array:
    """(n,) standard deviation of noise, numerical error and discrepancy together at the fit's amplitudes, SI."""
    noise = np.diag(shot.record.covariance())
    numerical = fit.judge.system.numerical_variance(shot.name)
    found = np.zeros(len(noise))
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        kind = shot.kinds[i]
        amplitude = np.hypot(fit.evidence.amplitudes.get(kind, 0.0), problem.known.fixed.get(kind, 0.0))
        growth = np.interp(trace.middle, shot.setup.time, problem.shapes[trace.name].growth)
        found[of] = (amplitude * trace.peak * growth) ** 2
    return np.sqrt(noise + numerical + found)
