"""Data that selection and refit have not seen: a block in time, a channel, another shot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inversion.diagnosis.covariance import Whitener
from inversion.diagnosis.judge import Judge, Judged, near
from inversion.diagnosis.record import Record
from inversion.diagnosis.verdict import NONE, confidence_set, verdict

BLOCK = (0.45, 0.7)  # of the strike's part of the record: before, at and after the peak stay for training
GUARD = 3.0  # correlation times on either side


@dataclass(frozen=True)
class HeldOut:
    """Whitened RMS (1 = noise) on data not used: of the model without effects and of the one that was chosen.

    raw: the same RMS with the measurement noise alone as unit; chosen: the model that the training part chose; verdict:
    the training part's.
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


def channel(judge: Judge, number: int) -> tuple[np.ndarray, np.ndarray]:
    """(n,) points of all other channels, and of the one held out."""
    held = judge.record.channel == number
    return ~held, held


def hold_out(
    judge: Judge, trained: np.ndarray, held: np.ndarray, alpha: float, progress: Callable[[float], None]
) -> HeldOut:
    """Selection and refit on the training part by emulator and learnt responses; error on the part held out."""
    models = judge.only(trained).models(progress)
    allowed = confidence_set({name: one.p for name, one in models.items()}, alpha)
    chosen = _chosen(models, allowed)
    before, raw_before = errors(judge, models[NONE], held)
    after, raw_after = errors(judge, chosen, held) if chosen else (None, None)
    return HeldOut(
        before,
        after,
        raw_before,
        raw_after,
        chosen.name if chosen else None,
        verdict(allowed, judge.record.noise_inferred),
    )


def _chosen(models: dict[str, Judged], allowed: tuple[str, ...]) -> Judged | None:
    """The model that would be used: none where it suffices, else the likeliest of the confidence set."""
    if NONE in allowed or not allowed:
        return None
    return min((models[name] for name in allowed), key=lambda one: one.fit.cost)


def errors(judge: Judge, judged: Judged, held: np.ndarray) -> tuple[float, float]:
    """Whitened RMS of a model's miss on points: with the whole covariance, and with the measurement noise alone."""
    miss = judge.record.values - judged.fit.curve
    whole = Whitener.of(judge.measurement + judge.numerical, held).apply(miss)
    raw = Whitener.of(judge.measurement, held).apply(miss)
    return float(np.sqrt(np.mean(whole**2))), float(np.sqrt(np.mean(raw**2)))


def other_shot(judge: Judge, judged: Judged, shot: Record) -> tuple[float, float]:
    """The same of another record of the same case, at the fit to this one."""
    from dataclasses import replace

    other = Judge.of(judge.groundwork, shot, judge.seed)
    model = replace(judged.fit.problem.model, record=shot)
    miss = shot.values - model.points(judged.fit.place, judged.fit.box)[0]
    whole = Whitener.of(other.measurement + other.numerical).apply(miss)
    raw = Whitener.of(other.measurement).apply(miss)
    return float(np.sqrt(np.mean(whole**2))), float(np.sqrt(np.mean(raw**2)))


__all__ = ["HeldOut", "channel", "errors", "hold_out", "near", "other_shot", "time_block"]
