"""An audit made by the emulator itself: truths from emulator and learnt responses, noise from the whole covariance.

Circular: the diagnosis is tried on the very model that it believes, so that this shows that its arithmetic holds (rates
of error, refits, intervals), and nothing about emulator, responses or mesh. No strike is run.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.model import Place
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.verdict import NONE

from birdstrike.data.histories import Array
from birdstrike.inversion.audit.carried import covariance_of
from birdstrike.inversion.audit.coverage import covered
from birdstrike.inversion.audit.draws import answer
from birdstrike.inversion.audit.planted import CLEAN, LARGEST, SINGLE, SMALLEST
from birdstrike.inversion.audit.power import Power, along, shown, signal
from birdstrike.inversion.audit.score import STATED, Blind, Score, lone
from birdstrike.inversion.diagnosis.diagnose import Study
from birdstrike.inversion.diagnosis.responses import Known
from birdstrike.inversion.estimation.coordinates import Box

EVERY = 4  # one curve in so many is clean
DRAWS = 20
ASKED = (4.0, 5.0)  # signals
ROUNDS, NEARLY = 5, 0.05  # by which a size is sought that makes them


def emulator_made(study: Study, template: Record, number: int) -> Score:
    """The score of one truth on a record's points; `number` is its seed."""
    rng = np.random.default_rng((study.choice.seed, number))
    judge = Judge.of(study.ground, template, study.choice.seed)
    model, alpha = study.ground.model(template), study.choice.alpha
    box = model.coordinates.boxes[int(rng.integers(len(model.coordinates.boxes)))]
    z = box.lows + rng.uniform(0.05, 0.95, len(box.lows)) * (box.highs - box.lows)
    index = int(rng.integers(len(model.known)))
    planted, b = model.known[index], np.zeros(len(model.known))
    if number % EVERY:
        b[index] = _magnitude(planted, rng)
    own = _with_values(judge, model.points(Place(z[None], b[None]), box)[0])
    models = own.models()
    noise = rng.standard_normal((DRAWS, len(own.record.values))) @ _root(models[NONE]).T
    draws = answer(own, models, noise, alpha)
    theta = model.coordinates.theta(z, box)
    parameters = {name: float(value) for name, value in zip(model.coordinates.names, theta, strict=True)}
    channels = tuple(trace.name for trace in template.traces)
    choice = Choice.of(models, alpha)
    known = models[planted.name if b.any() else NONE]
    found = Score(
        f"emulator_{number:03d}",
        channels,
        SINGLE if b.any() else CLEAN,
        "",
        {planted.name: planted.magnitude(float(b[index]))} if b.any() else {},
        Blind(choice.verdict, choice.allowed),
        {STATED: draws},
        shown=shown(models[NONE].fit),
        covered=covered(own, known, draws, parameters, float(b[index])),
    )
    if not b.any():
        return found
    return replace(
        found,
        signals={planted.name: signal(models[NONE].fit, planted.name, float(b[index]))},
        lone=lone(models[NONE], planted.name),
        power=tuple(_powers(judge, z, box, index, float(b[index]), alpha, rng)),
    )


def _magnitude(planted: Known, rng: np.random.Generator) -> float:
    """Size and sign at random, inside the bounds, in plausible sizes."""
    sign = 1.0 if planted.one_sided else float(rng.choice([-1.0, 1.0]))
    return float(np.clip(sign * rng.uniform(SMALLEST, LARGEST), planted.least, planted.most))


def _with_values(judge: Judge, values: Array) -> Judge:
    """The judge of another record on the same points."""
    parts = np.split(values, np.cumsum([len(trace.values) for trace in judge.record.traces])[:-1])
    pairs = zip(judge.record.traces, parts, strict=True)
    return replace(judge, record=replace(judge.record, traces=tuple(replace(t, values=v) for t, v in pairs)))


def _root(one: Judged) -> Array:
    """(n, n) L with L L^T the whole covariance of a model's miss."""
    return np.linalg.cholesky(covariance_of(one.fit.problem.whitener))


def _powers(
    judge: Judge, z: Array, box: Box, index: int, b: float, alpha: float, rng: np.random.Generator
) -> Iterator[Power]:
    """Power at the wanted signals, reached by the size of the effect; those beyond its bounds are left out."""
    model = judge.groundwork.model(judge.record)
    planted, size = model.known[index], b
    for wanted in ASKED:
        for _ in range(ROUNDS):
            acting = size * np.eye(len(model.known))[index : index + 1]
            own = _with_values(judge, model.points(Place(z[None], acting), box)[0])
            base = own.judged(NONE, own.start()[0])
            standing = signal(base.fit, planted.name, size)
            if abs(standing - wanted) < NEARLY * wanted:
                noise = rng.standard_normal((DRAWS, len(own.record.values))) @ _root(base).T
                rejected = 1.0 - answer(own, {NONE: base}, noise, alpha).holds(NONE)
                yield Power(wanted, 1.0, shown(base.fit), along(base), rejected)
                break
            size = float(np.clip(size * wanted / max(standing, 1e-3), planted.least, planted.most))
