"""Noise other than stated, as `diagnose` reads it: whole records, with what comes before contact, read anew.

Each drawn record goes through the reading of a diagnosis, which checks the stated noise against the record before
contact, finds correlation and leaves single outliers out; the models are refitted to what was read, with the covariance
that came of it, and judged. No strike is run: the solver's corrections of the blind judgement are carried.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.verdict import ATTRIBUTED, NONE
from scipy.stats import chi2

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.carried import Models, covariance_of, recorded
from birdstrike.inversion.audit.draws import Draws, Noises
from birdstrike.inversion.audit.experiment import Truth
from birdstrike.inversion.diagnosis.diagnose import Study
from birdstrike.inversion.diagnosis.ranking import again, rows_of

HOPELESS = 1e-5  # p of the omnibus statistic alone
LEFT, GAINED = 0.7, 60.0  # of the cost, and in it: what a refit to a few unknowns leaves of it at least


def read_draws(
    study: Study, judge: Judge, models: Models, measured: Measured, truth: Truth, kind: Noises, count: int, seed: int
) -> Draws:
    """Confidence sets of `count` records drawn with noise of a kind.

    judge, models: of the noise-free record; measured: the record of the experiment, whose instants, gaps and statements
    about noise a drawn one has.
    """
    rng = np.random.default_rng(seed)
    level = {trace.name: trace.noise.level for trace in judge.record.traces}
    found = [
        Choice.of(_judged(judge, models, study.read(_drawn(measured, truth, kind, level, rng))), study.choice.alpha)
        for _ in range(count)
    ]
    named = tuple(one.allowed[0] if one.verdict == ATTRIBUTED else "" for one in found)
    return Draws(tuple(one.allowed for one in found), named)


def _drawn(
    measured: Measured, truth: Truth, kind: Noises, level: Mapping[str, float], rng: np.random.Generator
) -> Measured:
    """The truth at the record's instants, with noise; gaps stay gaps."""
    values: dict[str, Array] = {}
    for name, recorded_values in measured.channels.items():
        clean = np.interp(measured.time, truth.time, truth.channels[name])
        noisy = clean + level[name] * kind.raw((1, len(clean)), rng)[0]
        values[name] = np.where(np.isfinite(recorded_values), noisy, np.nan)
    return replace(measured, channels=values)


def _judged(judge: Judge, models: Models, drawn: Record) -> dict[str, Judged]:
    """The models refitted to the drawn record from where they stand, but for those that miss it hopelessly."""
    place = _nearest(judge.record, drawn)
    covariance = drawn.covariance()
    reader = replace(judge, record=drawn, measurement=covariance)
    whiteners: dict[int, Whitener] = {}
    found: dict[str, Judged] = {}
    for name, one in models.items():
        problem = one.fit.problem
        whitener = whiteners.get(id(problem.whitener))
        if whitener is None:
            rest = covariance_of(problem.whitener) - judge.measurement
            whitener = whiteners[id(problem.whitener)] = Whitener.of(rest[np.ix_(place, place)] + covariance)
        anew = replace(recorded(problem, drawn), whitener=whitener)
        cost = float((rows_of(anew, one.fit.own, one.fit.box, one.fit.x[None]) ** 2).sum())
        if name == NONE or not _hopeless(cost, len(drawn.values), drawn.noise_freedom):
            found[name] = reader.judged(name, again(one.fit, anew), one.confirmed, one.doubt)
    return found


def _hopeless(cost: float, points: int, noise_freedom: float) -> bool:
    """Whether a model that misses by so much before its refit is out of every confidence set by its size alone."""
    quiet = 1.0 if np.isinf(noise_freedom) else float(chi2.ppf(1.0 - HOPELESS, noise_freedom)) / noise_freedom
    return (
        float(chi2.sf((LEFT * cost - GAINED) / quiet, points)) < HOPELESS
    )  # the noise may be louder than its level says


def _nearest(whole: Record, drawn: Record) -> np.ndarray:
    """(n,) the point of the whole record that is nearest to each of a drawn one, of which outliers may be missing."""
    far = np.abs(drawn.middle[:, None] - whole.middle) + 1e3 * (drawn.channel[:, None] != whole.channel)
    return far.argmin(axis=1)
