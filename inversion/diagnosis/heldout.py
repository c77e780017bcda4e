"""Data that selection and refit have not seen: a block in time, a channel, another shot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.miss import errors
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.diagnosis.verdict import NONE

BLOCK = (0.45, 0.7)  # of the strike's part of the record: before, at and after the peak stay for training
GUARD = 3.0  # correlation times on either side
TIME_BLOCK, CHANNEL, SHOT = "time_block", "channel", "shot"
OF_ONE_SHOT = ("time_offset", "impact_speed", "impact_angle", "bird_mass")
"""Effects behind nuisances that each shot has anew; the plate's thickness is that of the plate."""
NOT_REPEATED = "not repeated"


@dataclass(frozen=True)
class HeldOut:
    """Whitened RMS (1 = noise, numerical and model error) on data not used: without effects and of the chosen model.

    raw: the same RMS with the measurement noise alone as unit; chosen: the model that the training part chose, None
    for the one without effects; verdict: the training part's.
    """

    before: float
    after: float | None
    raw_before: float
    raw_after: float | None
    chosen: str | None
    verdict: str


def time_block(judge: Judge, first_contact: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) points to train on and points held out: a contiguous block with a guard of the noise's correlation."""
    times = judge.record.middle
    span = times.max() - first_contact
    start, end = (first_contact + share * span for share in BLOCK)
    gap = GUARD * max(
        *judge.groundwork.numerical.correlation, *(trace.noise.correlation_time for trace in judge.record.traces)
    )
    gap = min(gap, 0.1 * span)
    held = (times >= start) & (times <= end)
    return (times < start - gap) | (times > end + gap), held


def channels(judge: Judge) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Per channel, where there are several: (n,) points of all others, and its own, held out."""
    number, traces = judge.record.channel, judge.record.traces
    if len(traces) < 2:
        return {}
    return {f"{CHANNEL} {trace.name}": (number != i, number == i) for i, trace in enumerate(traces)}


def hold_out(
    judge: Judge, trained: np.ndarray, held: np.ndarray, alpha: float, progress: Callable[[float], None]
) -> HeldOut:
    """Selection and refit on the training part by emulator and learnt responses; error on the part held out.

    Both states have the nuisances of their fit, which are those of the same shot; the uncertainty that the training
    leaves in the unknowns is not part of the unit, so that a perfect model can lie somewhat above 1.
    """
    models = judge.only(trained).models(progress)
    choice = Choice.of(models, alpha)
    chosen = choice.chosen
    before, raw_before = _errors(judge, models[NONE], held)
    after, raw_after = _errors(judge, chosen, held) if chosen else (None, None)
    return HeldOut(before, after, raw_before, raw_after, chosen.name if chosen else None, choice.verdict)


def _errors(judge: Judge, judged: Judged, held: np.ndarray) -> tuple[float, float]:
    fit = judged.fit
    return errors(judge, judge.record.values - fit.curve, judge.allowance(fit), held)


def other_shot(judge: Judge, before: Judged, after: Judged | None, shot: Record) -> HeldOut:
    """Another record of the same case, at the fits to this one: nothing is fitted to it.

    Parameters, effects and the plate's thickness stay. What each shot has anew (trigger, speed, angle, mass) is at
    what is known of it beforehand, and its uncertainty is part of the unit; that of the parameters is not.
    """
    there = Judge.of(judge.groundwork, shot, judge.seed)
    first, raw_first = _on_other(there, before.fit)
    last, raw_last = _on_other(there, after.fit) if after else (None, None)
    return HeldOut(first, last, raw_first, raw_last, after.name if after else None, NOT_REPEATED)


def _on_other(there: Judge, fit: Fit) -> tuple[float, float]:
    anew, spread = expected(fit, there.record)
    return errors(there, there.record.values - anew.curve, there.allowance(anew) + spread)


def expected(fit: Fit, shot: Record) -> tuple[Fit, Array]:
    """The fit on another shot's points, its own nuisances at 0, and (n, n) the covariance that they have there."""
    problem = replace(fit.problem, model=replace(fit.problem.model, record=shot))
    known, first = problem.model.known, len(fit.box.lows)
    anew = [first + i for i, (index, _) in enumerate(problem.nuisances) if known[index].name in OF_ONE_SHOT]
    x = fit.x.copy()
    x[anew] = 0.0
    moved = replace(fit, problem=problem, x=x)
    spread = np.zeros((len(shot.values),) * 2)
    for i in anew:
        up, down = (replace(moved, x=np.where(np.arange(len(x)) == i, sign, x)).curve for sign in (1.0, -1.0))
        change = 0.5 * (up - down)  # by one standard deviation
        spread += np.outer(change, change)
    return moved, spread


def in_short(held: Mapping[str, HeldOut]) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Whitened RMS before and after by time_block, channel, shot; None where there is none.

    Of several channels that one which is foretold worst with the effect (where the training names none, without).
    """
    several = [one for name, one in held.items() if name.startswith(CHANNEL)]
    worst = max(several, key=lambda one: one.before if one.after is None else one.after, default=None)
    found = {TIME_BLOCK: held.get(TIME_BLOCK), CHANNEL: worst, SHOT: held.get(SHOT)}
    return (
        {name: one.before if one else None for name, one in found.items()},
        {name: one.after if one else None for name, one in found.items()},
    )
