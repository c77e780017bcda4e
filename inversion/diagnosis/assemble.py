"""From judged models to the figures of a diagnosis."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.detectable import absorbed, minimum_detectable
from birdstrike.inversion.diagnosis.diagnosis import EffectFigures, State
from birdstrike.inversion.diagnosis.evidence import biases, log_evidence, magnitude, parameter_intervals, twins
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.miss import by_channel, errors, rms
from birdstrike.inversion.diagnosis.model import NUISANCE_EFFECT
from birdstrike.inversion.diagnosis.restrike import Struck
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.verdict import NONE


def effect_figures(judge: Judge, models: dict[str, Judged], allowed: Collection[str]) -> tuple[EffectFigures, ...]:
    """Every model, those allowed before the others, the likeliest of either first."""
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
    return tuple(sorted(found, key=lambda one: (one.name not in allowed, -one.log_evidence)))


def state(judge: Judge, judged: Judged, heldout: dict[str, float | None], struck: Struck | None = None) -> State:
    """A model's errors on the data used, fitted and by one strike, and its parameters."""
    miss = judge.record.values - judged.fit.curve
    weighted, raw = errors(judge, miss, judge.allowance(judged.fit), judge.used)
    units = dict(zip(judge.groundwork.dataset.names, judge.groundwork.dataset.units, strict=True))
    parameters = {
        name: {"value": value, "interval_95": interval, "unit": units[name]}
        for name, (value, interval) in parameter_intervals(judged.fit).items()
    }
    solver = struck.figures() if struck else None
    return State(judged.name, by_channel(judge, miss), weighted, raw, heldout, parameters, solver)


def detectable(models: dict[str, Judged], alpha: float) -> dict[str, float | None]:
    """Minimum detectable magnitude of every effect, SI; None where no magnitude is."""
    base = models[NONE]
    least = minimum_detectable(base.reference, alpha)
    known = base.fit.problem.model.known
    return {k.name: float(b * k.size) if np.isfinite(b) else None for k, b in zip(known, least, strict=True)}


def noise_figures(judge: Judge) -> dict[str, Any]:
    """Where the noise comes from, its size, and the share that numerical error has in the whole.

    numerical_enlarged: by how much, in variance, draws of the numerical error were multiplied to predict one another.
    """
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
    return {
        "sensors": sensors,
        "numerical": numerical_figures(judge),
        "numerical_share": _share(numerical, whole),
        "numerical_enlarged": judge.size,
    }


def _share(part: Array, whole: Array, here: np.ndarray | slice = slice(None)) -> float:
    """Of the variance, as a share of standard deviations."""
    return float(np.sqrt(part[here].mean() / whole[here].mean()))


def numerical_figures(judge: Judge) -> dict[str, float]:
    """RMS of every bias direction in units of the measurement noise."""
    model = judge.groundwork.model(judge.record)
    sigma = np.sqrt(np.diag(judge.measurement))
    directions = judge.groundwork.numerical.sizes
    return {n: float(np.sqrt(np.mean((model.sample(d[None])[0] / sigma) ** 2))) for n, d in directions.items()}


def nuisance_figures(judge: Judge, judged: Judged) -> dict[str, dict[str, float]]:
    """Every nuisance: what was known beforehand and the fitted value, SI."""
    fit, known = judged.fit, judged.fit.problem.model.known
    names = {effect: name for name, effect in NUISANCE_EFFECT.items()}
    return {
        names[known[index].name]: {"sigma": sigma * known[index].size, "value": float(v) * sigma * known[index].size}
        for (index, sigma), v in zip(judge.groundwork.nuisances(), fit.v, strict=True)
    }


def pair_figures(judge: Judge, judged: Judged) -> dict[str, Any]:
    """A pair of effects that the data allow; magnitudes in SI."""
    known = judged.fit.problem.model.known
    own = [known[i] for i in judged.fit.own]
    miss = judge.record.values - judged.fit.curve
    return {
        "effects": [one.name for one in own],
        "magnitudes": [one.magnitude(float(b)) for one, b in zip(own, judged.fit.magnitudes, strict=True)],
        "p_consistent": judged.p,
        "weighted": errors(judge, miss, judge.allowance(judged.fit), judge.used)[0],
    }


def strike_figures(judge: Judge, models: dict[str, Judged], strikes: Strikes) -> dict[str, Any]:
    """Strikes paid and reused, and the emulator's error where the solver was asked."""
    off: dict[str, dict[str, float]] = {}
    for name, one in models.items():
        correction = one.fit.problem.model.correction
        if np.ndim(correction):
            parts = np.split(np.asarray(correction), len(judge.record.traces))
            off[name] = {trace.name: rms(part) for trace, part in zip(judge.record.traces, parts, strict=True)}
    return {
        "campaign": len(judge.groundwork.dataset.runs),
        "paid": strikes.paid,
        "reused": strikes.reused,
        "emulator_error": off,
        "failed": dict(strikes.failures),
    }


def curves(judge: Judge, fits: dict[str, Judged | None], struck: dict[str, Struck]) -> dict[str, Any]:
    """Record and curves on the record's points, per channel: fitted, and the solver's own where there is a strike."""
    record = judge.record
    columns = {
        "time": record.middle,
        "measured": record.values,
        "sigma": np.sqrt(np.diag(judge.measurement)),
        "error": np.sqrt(np.diag(judge.measurement + judge.numerical)),
    }
    for label, one in fits.items():
        fitted = one.fit.curve if one else np.full(len(record.values), np.nan)
        columns[label] = struck[label].curve if label in struck else fitted
        columns[f"{label}_fitted"] = fitted
    return {
        trace.name: {"unit": trace.unit} | {key: values[record.channel == i] for key, values in columns.items()}
        for i, trace in enumerate(record.traces)
    }
