"""The model of a diagnosis as one file: emulators with their mesh corrections, responses to effects, the fits.

What `explore` draws: curve = emulator + mesh correction + sum of the effects' responses, as the diagnosis computes it
(before_and_after.predicted), in plain arrays (see surrogate.weights).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.diagnosis.conclusions.before_and_after import estimate
from birdstrike.inversion.diagnosis.inference.evidence import draws
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Ranking
from birdstrike.inversion.diagnosis.preparation.responses import Response
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.diagnosis.preparation.shots import Shot, setups_of
from birdstrike.inversion.estimation.mesh_correction import stack
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.surrogate.weights import emulator_table, process_table

DRAWS = 200  # of each model's posterior
LOST = 1e-4  # of the variance of the draws' residuals that is not stored
Table = dict[str, Any]


def model_table(ranking: Ranking, shots: Sequence[Shot], fits: Mapping[str, str]) -> Table:
    """Of the measured shots; fits: `before`, `after` -> label of the model.

    parameters: the sought ones; systems: one a case; shots: name, system and channels, of each the instants [s] of the
    record, of which `block` neighbours are one point (as in `Trace`); effects: with the limits, SI, of what was
    looked at; fits: parameters of the first shot and effects, SI; posterior, discrepancy, conditions, contacts (first
    contact [s] by shot): what `predict` carries to another case.
    """
    setups = setups_of(shots)
    space = shots[0].setup.plan.space
    return {
        "parameters": [
            {"name": name, "unit": unit, "low": float(low), "high": float(high), "log": bool(log)}
            for name, unit, low, high, log in zip(
                space.names, space.units, space.lows, space.highs, space.logarithmic, strict=True
            )
        ],
        "systems": [_system(setup) for setup in setups],
        "shots": [
            {
                "name": shot.name,
                "system": next(i for i, setup in enumerate(setups) if setup is shot.setup),
                "case": shot.setup.plan.case.name,
                "channels": [
                    {"name": trace.name, "unit": trace.unit, "instants": trace.times, "block": trace.block}
                    for trace in shot.record.traces
                ],
            }
            for shot in shots
        ],
        "effects": [_effect(one) for one in ranking.problem.found],
        "fits": {name: _point(ranking, ranking.fits[label], label, shots[0]) for name, label in fits.items()},
        "posterior": _posterior(ranking, shots),
        "discrepancy": _discrepancy(ranking),
        "conditions": [conditions(shot.setup.plan.case) for shot in shots],
        "contacts": [shot.setup.plan.case.first_contact for shot in shots],
    }


def _point(ranking: Ranking, fit: Fit, label: str, shot: Shot) -> Table:
    """Parameters (k,) SI of a shot, and magnitudes SI by the effect's label."""
    z, h = estimate(shot, ranking.models[label], fit)
    sizes = {one.label: one.magnitude(h[one.label]) for one in ranking.models[label].members}
    return {"model": label, "theta": list(shot.setup.plan.values(z).values()), "effects": sizes}


def _posterior(ranking: Ranking, shots: Sequence[Shot]) -> list[Table]:
    """Draws of every model of the credible set, its share of the probability among them, and of none beside them.

    Without the faults of sensors that are left out: no record identifies their size, and what is predicted does not
    hang on such a sensor.

    parameters (n, k) SI of the first shot's bird; magnitudes: (n, members) SI; amplitude: kind of sensor -> (n,) share
    of the peak, of the part of the discrepancy that is marginalised; residuals: of each shot, see `_residuals`.
    """
    kept = [label for label in ranking.confidence_set if all(one.seen for one in ranking.models[label].members)]
    total = sum(ranking.shares[label] for label in kept)
    return [
        {
            "label": label,
            "share": ranking.shares[label] / total if label in kept else 0.0,
            **_drawn(ranking, label, shots),
        }
        for label in dict.fromkeys([*kept, NONE])
    ]


def _drawn(ranking: Ranking, label: str, shots: Sequence[Shot]) -> Table:
    hypothesis, assessment = ranking.models[label], ranking.assessments[label]
    tester = assessment.fit.tester
    parameters, found, nodes = draws(tester, assessment.at_fit, DRAWS, np.random.default_rng(0))
    birds = dict(zip(tester.system.names, np.split(parameters, len(tester.system.names), axis=1), strict=True))
    z = [np.clip(one.setup.plan.prior.place(birds[one.name]), one.setup.lows, one.setup.highs) for one in shots]
    h = np.array([np.clip(column, *one.limits) for one, column in zip(hypothesis.members, found.T, strict=True)])
    magnitudes = [
        [one.magnitude(float(size)) for size in column] for one, column in zip(hypothesis.members, h, strict=True)
    ]
    return {
        "members": [one.label for one in hypothesis.members],
        "names": [one.name for one in hypothesis.members],
        "sizes": [one.size for one in hypothesis.members],
        "parameters": shots[0].setup.plan.space.to_physical(z[0]),
        "magnitudes": np.array(magnitudes).reshape(len(hypothesis.members), DRAWS).T,
        "amplitude": {kind: tester.combinations[nodes, i] for i, kind in enumerate(tester.kinds)},
        "residuals": [
            _residuals(one, hypothesis, own, h.reshape(-1, DRAWS).T) for one, own in zip(shots, z, strict=True)
        ],
    }


def _residuals(shot: Shot, hypothesis: Hypothesis, z: Array, h: Array) -> dict[str, Table]:
    """What a model leaves of a shot's record at draws z (n, k), h (n, members): by channel, mean + scores @ directions.

    mean: (points,) SI of all draws; directions: (r, points) SI and scores (n, r): the principal components that hold
    all but a small share of their variance. A draw's own residual belongs to it: where the curve lies high, the record
    lies below it.
    """
    grids, moved = shot.setup.grid(z), np.zeros((len(z), len(shot.record.values)))
    acting = [(j, one) for j, one in enumerate(hypothesis.members) if shot.name in one.shots]
    for j, one in acting:
        if one.fault is not None:
            moved += [shot.instrument_change(one.fault, *drawn) for drawn in zip(grids, h[:, j], strict=True)]
        else:
            moved += [size * one.change_in(shot, row, size) for row, size in zip(z, h[:, j], strict=True)]
    whole = shot.record.values - shot.sample(grids) - moved
    mean = whole.mean(axis=0)
    found: dict[str, Table] = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        u, s, v = np.linalg.svd((whole - mean)[:, of], full_matrices=False)
        kept = 1 + int(np.searchsorted(np.cumsum(s**2), (1.0 - LOST) * float((s**2).sum())))
        found[trace.name] = {"mean": mean[of], "directions": v[:kept], "scores": u[:, :kept] * s[:kept]}
    return found


def _discrepancy(ranking: Ranking) -> Table:
    """Shape in time by channel on the first setup's clock.

    own_is_free: kinds of sensors; fixed: amplitude by kind of the part that is not free.
    """
    problem, time = ranking.problem, ranking.problem.shots[0].setup.time
    return {
        "own_is_free": sorted(problem.known.learnt),
        "fixed": dict(problem.known.fixed),
        "time": time,
        "growth": {channel: shape.growth for channel, shape in problem.shapes.items()},
        "length": {channel: shape.length for channel, shape in problem.shapes.items()},
    }


def _effect(one: CandidateEffect) -> Table:
    """An effect where it acts; low, high: SI magnitudes that were looked at."""
    low, high = (one.magnitude(h) for h in one.limits)
    fault = one.fault
    return {
        "label": one.label,
        "name": one.name,
        "family": one.family,
        "unit": one.unit,
        "size": one.size,
        "low": low,
        "high": high,
        "shots": list(one.shots),
        "sensors": None if fault is None else list(fault.sensors),
    }


def _system(setup: Setup) -> Table:
    """The emulator of a case, its mesh correction over fractions of the ranges, the responses, the runs."""
    done = setup.plan.finished(setup.runs)
    points = setup.plan.unit[done]
    curves = np.array([stack(setup.runs[f"coarse {i}"], setup.time, setup.channels) for i in done])
    return {
        **emulator_table(setup.emulator),
        "mesh": {
            "mean": setup.split(setup.mesh.mean),
            "directions": setup.split(setup.mesh.directions),
            "processes": [process_table(process) for process in setup.mesh.processes],
        },
        "responses": {name: _response(setup, one) for name, one in setup.responses.items()},
        "runs": {"parameters": setup.plan.space.to_physical(points), "curves": setup.split(curves)},
    }


def _response(setup: Setup, one: Response) -> Table:
    """signature and slopes (k, m) by channel, centre (k,), knots: magnitude in plausible sizes -> size of response.

    negative: signature and slopes of magnitudes below 0, where they are others.
    """
    found = {**_curves(setup, one.sided(1.0)), "centre": one.centre, "knots": np.array(one.knots)}
    return found if one.senses is None else {**found, "negative": _curves(setup, one.sided(-1.0))}


def _curves(setup: Setup, one: Response) -> Table:
    return {"signature": setup.split(one.signature), "slopes": setup.split(one.slopes)}
