"""From judged models to the figures of a diagnosis."""

from __future__ import annotations

from typing import Any

import numpy as np

from data.histories import Array
from inversion.diagnosis.detectable import absorbed, minimum_detectable
from inversion.diagnosis.diagnosis import EffectFigures, State
from inversion.diagnosis.evidence import biases, log_evidence, magnitude, parameter_intervals, twins
from inversion.diagnosis.heldout import errors
from inversion.diagnosis.judge import Judge, Judged
from inversion.diagnosis.model import NUISANCE_EFFECT
from inversion.diagnosis.verdict import NONE

INFLATED = 10.0
WHITE = 4.0


def effect_figures(judge: Judge, models: dict[str, Judged]) -> tuple[EffectFigures, ...]:
    """Every model, the likeliest first."""
    base = models[NONE]
    lost, shifts = absorbed(base.fit.linear), biases(base.fit)
    reference = log_evidence(base.fit)
    names = judge.groundwork.dataset.names
    spans = judge.groundwork.dataset.highs - judge.groundwork.dataset.lows
    found: list[EffectFigures] = []
    for name, one in models.items():
        if name == NONE:
            found.append(
                EffectFigures(NONE, None, "", None, one.p, 0.0, {}, False, None, {}, None, "no effect", one.confirmed)
            )
            continue
        index = one.fit.own[0]
        known = one.fit.problem.model.known[index]
        value, interval = magnitude(one)
        bias = (
            {n: float(shifts[index, i] * spans[i]) for i, n in enumerate(names)}
            if shifts.shape[1] == len(names)
            else {}
        )
        own_bound = bool(one.fit.at_bound[-1])
        figures = (value, known.effect.unit, interval, one.p, log_evidence(one.fit) - reference, twins(one), own_bound)
        share = float(lost[index]) if np.any(base.fit.linear.effects[:, index]) else None
        found.append(EffectFigures(name, *figures, share, bias, known.size, known.effect.meaning, one.confirmed))
    return tuple(sorted(found, key=lambda one: -one.log_evidence))


def state(judge: Judge, judged: Judged, heldout: dict[str, float | None]) -> State:
    """A model's errors on the data used, and its parameters."""
    record, miss = judge.record, judge.record.values - judged.fit.curve
    rmse = {t.name: float(np.sqrt(np.mean(miss[record.channel == i] ** 2))) for i, t in enumerate(record.traces)}
    weighted, raw = errors(judge, judged, judge.used)
    units = dict(zip(judge.groundwork.dataset.names, judge.groundwork.dataset.units, strict=True))
    parameters = {
        name: {"value": value, "interval_95": interval, "unit": units[name]}
        for name, (value, interval) in parameter_intervals(judged.fit).items()
    }
    return State(judged.name, rmse, weighted, raw, heldout, parameters)


def detectable(models: dict[str, Judged], alpha: float) -> dict[str, float | None]:
    """Minimum detectable magnitude of every effect, SI; None where no magnitude is."""
    base = models[NONE]
    least = minimum_detectable(base.reference, alpha)
    known = base.fit.problem.model.known
    return {k.name: float(b * k.size) if np.isfinite(b) else None for k, b in zip(known, least, strict=True)}


def noise_figures(judge: Judge) -> dict[str, Any]:
    """Where the noise comes from, its size, and the share that numerical error has in the whole."""
    record, numerical = judge.record, np.diag(judge.numerical)
    whole = np.diag(judge.measurement) + numerical
    sensors = {
        trace.name: {
            "unit": trace.unit,
            "source": trace.noise.source,
            "sigma": trace.noise.level,
            "correlation_time": trace.noise.correlation_time,
            "before_contact": {"sigma": trace.noise.before[0], "points": trace.noise.before[1]}
            if trace.noise.before
            else None,
            "points": len(trace.values),
            "averaged_over": trace.block,
            "numerical_share": _share(numerical, whole, record.channel == i),
        }
        for i, trace in enumerate(record.traces)
    }
    return {"sensors": sensors, "numerical": numerical_figures(judge), "numerical_share": _share(numerical, whole)}


def _share(part: Array, whole: Array, here: np.ndarray | slice = slice(None)) -> float:
    """Of the variance, as a share of standard deviations."""
    return float(np.sqrt(part[here].mean() / whole[here].mean()))


def numerical_figures(judge: Judge) -> dict[str, float]:
    """RMS of every bias direction in units of the measurement noise."""
    model = judge.groundwork.model(judge.record)
    sigma = np.sqrt(np.diag(judge.measurement))
    directions = judge.groundwork.numerical.directions
    return {n: float(np.sqrt(np.mean((model.sample(d[None])[0] / sigma) ** 2))) for n, d in directions.items()}


def nuisance_figures(judge: Judge, judged: Judged) -> dict[str, dict[str, float]]:
    """Every nuisance: what was known beforehand and the fitted value, SI."""
    fit, known = judged.fit, judged.fit.problem.model.known
    names = {effect: name for name, effect in NUISANCE_EFFECT.items()}
    return {
        names[known[index].name]: {"sigma": sigma * known[index].size, "value": float(v) * sigma * known[index].size}
        for (index, sigma), v in zip(judge.groundwork.nuisances(), fit.v, strict=True)
    }


def doubts(judge: Judge, judged: Judged, base: Judged) -> list[str]:
    """Why a fit should not be believed: bounds, inflated variances, a residual that is not the assumed noise."""
    found: list[str] = []
    names = [name.rsplit(".", 1)[-1] for name in judge.groundwork.coordinates.names]
    for name, hit, flat in zip(names, judged.fit.at_bound, judged.fit.box.flat, strict=False):
        if hit and not flat:
            found.append(f"model {judged.name}: {name} is held by an end of its range")
    if judged.fit.own and judged.fit.at_bound[-1] and judged.fit.magnitudes[-1]:
        found.append(f"model {judged.name}: its magnitude is held by the largest that was looked at")
    if judged.name != NONE:
        ratio = _inflation(judged, base)
        worst = int(np.argmax(ratio)) if len(ratio) else 0
        if len(ratio) and ratio[worst] > INFLATED:
            found.append(
                f"model {judged.name}: the effect inflates the variance of {names[worst]} {ratio[worst]:.0f} times; "
                "the two can hardly be told apart"
            )
    return found + _residual_noise(judge, judged)


def _inflation(judged: Judged, base: Judged) -> Array:
    """Variance of each parameter with the effect free over that without."""
    r = len(judged.fit.z)
    with_effect, without = np.diag(judged.fit.covariance())[:r], np.diag(base.fit.covariance())[:r]
    return np.where(without > 0.0, with_effect / np.where(without > 0.0, without, 1.0), 1.0)


def _residual_noise(judge: Judge, judged: Judged) -> list[str]:
    """The whitened residual of a model in the confidence set should be white and of size 1."""
    n = int(judge.used.sum())
    residual = judged.fit.linear.residual[:n]
    channel = judge.record.channel[judge.used]
    found: list[str] = []
    for i, trace in enumerate(judge.record.traces):
        part = residual[channel == i]
        if len(part) < 20:
            continue
        rho = float(part[1:] @ part[:-1] / (part @ part)) * np.sqrt(len(part))
        size = float((part @ part - len(part)) / np.sqrt(2.0 * len(part)))
        if abs(rho) > WHITE or abs(size) > WHITE:
            rms = np.sqrt(np.mean(part**2))
            found.append(
                f"model {judged.name}: the whitened residual of {trace.name} is not the noise that was assumed (RMS "
                f"{rms:.2f}, 1 expected; correlation of neighbours {rho / np.sqrt(len(part)):.2f}); p-values lean on it"
            )
    return found
