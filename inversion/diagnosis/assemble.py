"""From ranked models to the figures of an answer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.answer import EffectFigures, State
from birdstrike.inversion.diagnosis.before_and_after import Held, error_sd, predicted
from birdstrike.inversion.diagnosis.hypotheses import NONE, SOMETHING_ELSE, Hypothesis
from birdstrike.inversion.diagnosis.power import absorbed, collinear
from birdstrike.inversion.diagnosis.ranking import Ranking
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.inversion.diagnosis.before_and_after import SolverRun, errors
from birdstrike.inversion.diagnosis.system import PRIOR_SD
from birdstrike.solver.effects.registry import effects

NINETY_FIVE = float(norm.ppf(0.975))
REFUTED = 1e-4  # smallest p-value that is told


def effect_figures(ranking: Ranking, required: Mapping[str, float | None]) -> tuple[EffectFigures, ...]:
    """none, singles and something else, the likeliest first."""
    alike, share = collinear(ranking), absorbed(ranking)
    base = ranking.evidence[NONE].log_evidence
    best = max(one.log_evidence for one in ranking.evidence.values())
    found = []
    for label, model in ranking.models.items():
        if len(model.members) > 1:
            continue
        evidence = ranking.evidence[label]
        magnitude, interval, at_limit, unit, size = None, None, False, "", None
        meaning = {NONE: "nothing", SOMETHING_ELSE: "something that no effect of the library describes"}.get(label, "")
        if model.members:
            one = model.members[0]
            magnitude, interval, at_limit = magnitude_of(ranking, label)
            unit, size, meaning = one.unit, one.size, _meaning(label, one.name)
        found.append(
            EffectFigures(
                label, model.family, meaning, ranking.shares[label], model.prior, magnitude, unit, interval, at_limit,
                consistency(evidence.log_evidence, best), evidence.log_evidence - base, required.get(label),
                alike.get(label, {}), share.get(label), size,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda one: -one.probability))


def _meaning(label: str, name: str) -> str:
    text = effects()[name].meaning
    if "." in label:
        return f"{text}: {label.split('.', 1)[1].replace('_', ' ')} alone"
    return f"{text}, in shot {label.split('@', 1)[1]} alone" if "@" in label else text


def consistency(log_evidence: float, best: float) -> float:
    """p-value of a likelihood ratio against the best model, one degree of freedom."""
    return float(max(2.0 * norm.sf(np.sqrt(max(2.0 * (best - log_evidence), 0.0))), REFUTED))


def magnitude_of(ranking: Ranking, label: str) -> tuple[float, tuple[float, float], bool]:
    """SI magnitude, 95 % interval, whether a limit of what was looked at holds it."""
    evidence, one = ranking.evidence[label], ranking.models[label].members[0]
    low, high = one.limits
    h, sd = float(evidence.h[0]), float(np.sqrt(evidence.h_cov[0, 0]))
    ends = [one.magnitude(float(np.clip(h + s * NINETY_FIVE * sd, low, high))) for s in (-1.0, 1.0)]
    at_limit = h + NINETY_FIVE * sd >= high or (not one.one_sided and h - NINETY_FIVE * sd <= low)
    return one.magnitude(float(np.clip(h, low, high))), (min(ends), max(ends)), bool(at_limit and abs(h) > 0.9 * high)


def state(
    ranking: Ranking, label: str, shot: Shot, held: list[Held], run: SolverRun | None
) -> State:
    """The model in one shot at its fit."""
    fit, model = ranking.fits[label], ranking.models[label]
    curve = curve_at(ranking, label, shot)
    residual = shot.record.values - curve
    sd = error_sd(shot, ranking.problem, fit)
    noise = np.sqrt(np.diag(shot.record.covariance()))
    solver = None
    if run is not None:
        off = shot.record.values - run.curve
        solver = {
            "rmse": errors(shot, run.curve),
            "weighted": float(np.sqrt(np.mean((off / sd) ** 2))),
            "raw": float(np.sqrt(np.mean((off / noise) ** 2))),
        }
    return State(
        label,
        errors(shot, curve),
        float(np.sqrt(np.mean((residual / sd) ** 2))),
        float(np.sqrt(np.mean((residual / noise) ** 2))),
        in_short(held),
        parameters(fit, shot, model),
        solver,
    )


def in_short(held: list[Held]) -> dict[str, float | None]:
    """time_block, the worst channel, the worst shot."""
    found: dict[str, float | None] = {"time_block": None, "channel": None, "shot": None}
    for one in held:
        key = one.name.split(" ")[0]
        found[key] = one.error if found.get(key) is None else max(found[key] or 0.0, one.error)
    return found


def curve_at(ranking: Ranking, label: str, shot: Shot) -> Array:
    """(n,) a fitted model on a shot's points."""
    fit, model = ranking.fits[label], ranking.models[label]
    return predicted(shot, model, fit.places.z[shot.group], dict(fit.places.h))


def parameters(fit: Fit, shot: Shot, _model: Hypothesis) -> dict[str, dict[str, Any]]:
    """Dotted key -> value, interval_95, unit, identified; SI."""
    space = shot.setup.plan.space
    k = len(space.names)
    mean, sd = fit.interval(shot.group, k)
    ends = [space.to_physical(np.clip(mean + s * NINETY_FIVE * sd, 0.0, 1.0)[None])[0] for s in (-1, 0, 1)]
    return {
        name: {
            "value": float(ends[1][i]),
            "interval_95": (float(ends[0][i]), float(ends[2][i])),
            "unit": space.units[i],
            "identified": bool(sd[i] < 0.5 * PRIOR_SD),
        }
        for i, name in enumerate(space.names)
    }


def curves(ranking: Ranking, shot: Shot, after: str | None, runs: Mapping[str, SolverRun]) -> dict[str, Any]:
    """channel -> columns of diagnosis.csv."""
    fit = ranking.fits[after or NONE]
    sd, noise = error_sd(shot, ranking.problem, fit), np.sqrt(np.diag(shot.record.covariance()))
    fitted = {"before": curve_at(ranking, NONE, shot)}
    if after:
        fitted["after"] = curve_at(ranking, after, shot)
    found: dict[str, Any] = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        blank = np.full(int(of.sum()), np.nan)
        found[trace.name] = {
            "unit": trace.unit,
            "time": trace.middle,
            "measured": trace.values,
            "sigma": noise[of],
            "error": sd[of],
            "before": fitted["before"][of],
            "after": fitted["after"][of] if after else blank,
            "before_solver": runs["before"].curve[of] if "before" in runs else blank,
            "after_solver": runs["after"].curve[of] if "after" in runs else blank,
        }
    return found


def noise_figures(shot: Shot, ranking: Ranking) -> dict[str, Any]:
    """Noise of every sensor, its source, and the share of numerical error and discrepancy in the whole."""
    sd = error_sd(shot, ranking.problem, ranking.fits[NONE])
    sensors = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        numerical = float(np.mean(ranking.fits[NONE].system.numerical_variance(shot.name)[of]))
        sensors[trace.name] = {
            "sigma": trace.noise.level,
            "unit": trace.unit,
            "source": trace.noise.source,
            "points": int(of.sum()),
            "numerical_share": numerical / float(np.mean(sd[of] ** 2)),
            "peak": trace.peak,
        }
    return {"sensors": sensors}


def pair_figures(ranking: Ranking) -> tuple[dict[str, Any], ...]:
    """Pairs of the credible set."""
    kept = [name for name in ranking.confidence_set if len(ranking.models[name].members) == 2]
    return tuple(
        {
            "effects": [one.label for one in ranking.models[name].members],
            "probability": ranking.shares[name],
            "p_consistent": consistency(
                ranking.evidence[name].log_evidence, max(one.log_evidence for one in ranking.evidence.values())
            ),
            "magnitudes": [
                one.magnitude(float(np.clip(h, *one.limits)))
                for one, h in zip(ranking.models[name].members, ranking.evidence[name].h, strict=True)
            ],
        }
        for name in kept
    )
