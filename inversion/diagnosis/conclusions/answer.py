"""The answer of a diagnosis from the ranking of its models: the verdict, and the figures of `results.diagnosis`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, truncnorm

from birdstrike.data.histories import Array
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.conclusions.before_and_after import (
    Held,
    SolverRun,
    estimate,
    expected_residual,
    predicted,
    rms_by_channel,
)
from birdstrike.inversion.diagnosis.conclusions.power import absorbed, biases, collinear
from birdstrike.inversion.diagnosis.inference.fit import Fit
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.posterior import quantiles
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.estimation.answers.estimates import reported
from birdstrike.inversion.estimation.prior import identified
from birdstrike.inversion.labels import label_parts
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.results.diagnosis import (
    AMBIGUOUS,
    ATTRIBUTED,
    LEVEL,
    NO_RESIDUAL,
    NONE,
    NOT_EFFECTS,
    SOMETHING_ELSE,
    UNEXPLAINED,
    EffectFigures,
    State,
    of_another_bird,
)
from birdstrike.solver.effects.registry import effects, kind_of

SIMULATION_SCATTER = 5.0
"""Nats by which one effect may gain on another where their responses are simulated anew. On two shots of another code,
five sets of 8 to 24 pairs moved one lead by 1.3 (standard deviation); another was 15 to 21 by four sets at 2.5
plausible sizes, and 8 by a set at 1.6: more of a smaller change is scatter, hence `solver_update.LEAST_SIZE`."""


def verdict_of(
    presence: Mapping[str, float],
    alarm: float,
    alpha: float,
    credible: tuple[str, ...],
    same_bird: float | None = None,
    ahead: float = float("inf"),
) -> str:
    """attributed: the alarm was raised, one effect is there with 95 %, no other is, and other simulations would say so.

    presence: none, something else, and each effect -> probability that it is there. unexplained: something else holds
    most. same_bird: probability that the birds of all shots and baselines are one, None of a single shot: beside
    another bird nothing is attributed, because model error changes with the bird by as much as there is of it. ahead:
    nats by which the likeliest effect is ahead of the models without it.
    """
    if alarm >= alpha:
        return NO_RESIDUAL if presence.get(NONE, 0.0) >= 0.5 or NONE in credible else AMBIGUOUS
    if presence.get(SOMETHING_ELSE, 0.0) >= 0.5:
        return UNEXPLAINED
    first, second = ([*sorted((p for name, p in presence.items() if name != NONE), reverse=True), 0.0, 0.0])[:2]
    sure = first >= LEVEL > second and ahead >= SIMULATION_SCATTER and not of_another_bird(same_bird)
    return ATTRIBUTED if sure else AMBIGUOUS


REFUTED = 1e-4  # smallest `p_consistent` that is given
REPORTED = 0.05  # probability of something else from which on it is reported
GROWN = 3.0  # growth of the model error beyond which a curve is uninformative


def effect_figures(
    ranking: Ranking, required: Mapping[str, float | None], confirmed: str | None = None
) -> tuple[EffectFigures, ...]:
    """none, singles and something else, the likeliest first; confirmed: the effect that the solver was run with."""
    found = [_figures(ranking, label, required) for label, model in ranking.models.items() if len(model.members) < 2]
    alike, share, shifts = collinear(ranking), absorbed(ranking), biases(ranking)
    figures = [
        replace(
            one,
            twins=alike.get(one.name, {}),
            absorbed=share.get(one.name),
            bias=shifts.get(one.name, {}),
            confirmed=one.name == confirmed,
        )
        for one in found
    ]
    return tuple(sorted(figures, key=lambda one: -one.probability))


def _figures(ranking: Ranking, label: str, required: Mapping[str, float | None]) -> EffectFigures:
    """One model by itself."""
    model, evidence = ranking.models[label], ranking.evidence[label].log_evidence
    best = max(one.log_evidence for one in ranking.evidence.values())
    figures = EffectFigures(
        name=label,
        family=model.family,
        meaning=NOT_EFFECTS.get(label, ""),
        probability=ranking.presence[label],
        prior=model.prior,
        magnitude=None,
        unit="",
        interval_95=None,
        at_bound=False,
        p_consistent=consistency(evidence, best),
        log_evidence=evidence - ranking.evidence[NONE].log_evidence,
        required_discrepancy=required.get(label),
        twins={},
        absorbed=None,
        bias={},
        plausible_size=None,
        confirmed=False,
    )
    if not model.members:
        return figures
    one = model.members[0]
    magnitude, interval, at_bound = magnitude_of(ranking, label)
    named = replace(figures, meaning=_meaning(label, one.name), unit=one.unit, plausible_size=one.size)
    return replace(named, magnitude=magnitude, interval_95=interval, at_bound=at_bound)


def _meaning(label: str, name: str) -> str:
    text = effects()[kind_of(name)].meaning
    _, place, shot = label_parts(label)
    if place:
        text = text.replace("displacement transducer", "sensor")  # all transducers together, but any sensor alone
        return f"{text}: {place.replace('_', ' ')} alone"
    return f"{text}, in shot {shot} alone" if shot else text


def consistency(log_evidence: float, best: float) -> float:
    """How far a model lies behind the best: 2 Phi(-sqrt(2 d)), d [nats] the difference of their log evidences.

    A monotone transform of the evidence onto 1e-4 .. 1, and no p-value: marginal likelihoods of models that are not
    nested have no chi-square distribution, so that no frequency belongs to it. What is believed is the probability.
    """
    return float(max(2.0 * norm.sf(np.sqrt(max(2.0 * (best - log_evidence), 0.0))), REFUTED))


def magnitude_of(ranking: Ranking, label: str) -> tuple[float, tuple[float, float], bool]:
    """SI magnitude, 95 % interval, whether a limit of what was looked at holds it.

    The magnitude is the posterior mean with what is not known of the signature as it is at the fit. About another
    model's fit that can lie outside the interval, which knows it at every size: then it is the median of the latter.
    The interval holds both.
    """
    assessment, one = ranking.assessments[label], ranking.models[label].members[0]
    low, high = one.limits
    evidence = assessment.at_fit
    mean = float(np.clip(evidence.h[0], low, high))
    begin, middle, end = quantiles(assessment.fit.tester, evidence)
    h = mean if assessment.own or begin < mean < end else middle
    ends = [one.magnitude(x) for x in (min(begin, mean), max(end, mean))]
    return one.magnitude(h), (min(ends), max(ends)), reaches_limit(h, (begin, end), one.search_limits)


def reaches_limit(h: float, interval: tuple[float, float], limits: tuple[float, float]) -> bool:
    """Whether a size of response, and the end of its interval on that side, are those of the largest looked at.

    limits: of a response that bends not alike on both sides; the lower is infinite where nothing lies beyond it, such
    as springs that are rigid, or 0 of an effect that cannot be negative.
    """
    (begin, end), (low, high) = interval, limits
    return (h > 0.9 * high and end > 0.95 * high) or (h < 0.9 * low < 0.0 and begin < 0.95 * low)


def state(
    ranking: Ranking, label: str, shot: Shot, held: list[Held], run: SolverRun | None, errors_of: str | None = None
) -> State:
    """The model in one shot at its fit.

    errors_of: the model whose errors are the unit of the misfits, by default its own; of two states that are compared
    it is one, since a model that explains less takes its errors to be larger.
    """
    fit, curve = ranking.fits[label], curve_at(ranking, label, shot)
    residual, unit = shot.record.values - curve, errors_of or label
    mean, sd = expected_residual(shot, ranking.problem, ranking.models[unit], ranking.fits[unit])
    noise = np.sqrt(np.diag(shot.record.covariance()))
    beside = any(one.baseline for one in ranking.problem.shots)
    solver = None
    if run is not None:
        off = shot.record.values - run.curve
        solver = {
            "rmse": rms_by_channel(shot, off),
            "weighted": rms((off - mean) / sd),
            "raw": rms(off / noise),
            "off": rms((run.curve - curve) / sd),
            "rmse_less_baseline": None,
        }
    return State(
        model=label,
        rmse=rms_by_channel(shot, residual),
        weighted=rms((residual - mean) / sd),
        raw=rms(residual / noise),
        heldout=in_short(held),
        parameters=parameters(fit, shot, ranking.models[label]),
        solver=solver,
        rmse_less_baseline=rms_by_channel(shot, residual - mean) if beside else None,
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
    return predicted(shot, model, *estimate(shot, model, fit))


TAILS = (0.025, 0.975)  # of a 95 % interval


def parameters(fit: Fit, shot: Shot, model: Hypothesis) -> dict[str, dict[str, Any]]:
    """Dotted key -> value, interval_95, unit, identified; SI.

    The interval is that of the posterior cut off at the ends of the range, as the prior is, and reported by the rule of
    the calibration (`estimates.reported`). What lies outside its range is not identified.
    """
    plan, space = shot.setup.plan, shot.setup.plan.space
    mean, sd = fit.interval(shot.name, len(space.names))
    low, high = (mean + sd * truncnorm.ppf(tail, -mean / sd, (1.0 - mean) / sd) for tail in TAILS)
    ends = np.clip([low, high], 0.0, 1.0)
    known = identified(ends[1] - ends[0], plan.prior.width()) & ~outside_range(mean)
    value, *interval = (space.to_physical(z[None])[0] for z in (estimate(shot, model, fit)[0], *ends))
    found: dict[str, dict[str, Any]] = {}
    for i, name in enumerate(space.names):
        own, limits = (float(interval[0][i]), float(interval[1][i])), (float(space.lows[i]), float(space.highs[i]))
        kept = bool(known[i] or plan.prior.stated[i])
        found[name] = {
            "value": float(value[i]),
            "interval_95": reported(float(value[i]), own, limits, kept),
            "unit": space.units[i],
            "identified": bool(known[i]),
        }
    return found


def outside_range(mean: Array) -> NDArray[np.bool_]:
    """Whether posterior means, fractions of the ranges, lie outside these."""
    return (mean < 0.0) | (mean > 1.0)


def curves(ranking: Ranking, shot: Shot, after: str | None, runs: Mapping[str, SolverRun]) -> dict[str, Any]:
    """channel -> columns of diagnosis.csv."""
    label = after or NONE
    mean, sd = expected_residual(shot, ranking.problem, ranking.models[label], ranking.fits[label])
    noise = np.sqrt(np.diag(shot.record.covariance()))
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
            "baseline": mean[of],
            "before": fitted["before"][of],
            "after": fitted["after"][of] if after else blank,
            "before_solver": runs["before"].curve[of] if "before" in runs else blank,
            "after_solver": runs["after"].curve[of] if "after" in runs else blank,
        }
    return found


def noise_figures(shots: Sequence[Shot], ranking: Ranking) -> dict[str, Any]:
    """Noise of every sensor in the first shot that has it, its source, and the share of emulator and mesh in the whole.

    numerical_share: of standard deviations, beside the sensors that of the first shot; `numerical` and
    `numerical_enlarged` of earlier versions stay empty.
    """
    found = [_noise_in(shot, ranking) for shot in shots]
    sensors = {name: one for own, _ in found[::-1] for name, one in own.items()}
    order = dict.fromkeys(name for own, _ in found for name in own)
    return {
        "sensors": {name: sensors[name] for name in order},
        "numerical": {},
        "numerical_share": found[0][1],
        "numerical_enlarged": 1.0,
    }


def _noise_in(shot: Shot, ranking: Ranking) -> tuple[dict[str, dict[str, Any]], float]:
    """Of the sensors of one shot, and the numerical share of all of them in the whole error, baselines or none."""
    whole = expected_residual(shot, ranking.problem, ranking.models[NONE], ranking.fits[NONE], others=())[1] ** 2
    numerical = ranking.fits[NONE].system.numerical_variance[shot.name]
    sensors = {}
    for i, trace in enumerate(shot.record.traces):
        of = shot.record.channel == i
        sensors[trace.name] = {
            "unit": trace.unit,
            "source": trace.noise.source,
            "sigma": trace.noise.level,
            "correlation_time": trace.noise.correlation_time,
            "before_contact": {"sigma": trace.noise.before[0], "points": trace.noise.before[1]}
            if trace.noise.before
            else None,
            "points": len(trace.values),
            "averaged_over": trace.block,
            "numerical_share": float(np.sqrt(numerical[of].mean() / whole[of].mean())),
            "peak": trace.peak,
        }
    return sensors, float(np.sqrt(numerical.mean() / whole.mean()))


def simulation_counts(
    ranking: Ranking, simulations: Simulations, shot: Shot, runs: Mapping[str, SolverRun], chosen: str | None
) -> dict[str, Any]:
    """Simulations run and found stored, and by how much the solver leaves the fits, by channel, SI."""
    labels = {"before": NONE, "after": chosen}
    off = {
        label: rms_by_channel(shot, runs[key].curve - curve_at(ranking, label, shot))
        for state_name, label in labels.items()
        if label is not None and (key := f"{shot.name} {state_name}") in runs
    }
    campaign = sum(label.startswith("coarse ") for label in shot.setup.runs)
    counts = {"campaign": campaign, "paid": simulations.paid, "reused": simulations.reused}
    return {**counts, "emulator_error": off, "failed": dict(simulations.failures)}


def something_else_figures(ranking: Ranking) -> dict[str, Any] | None:
    """What something else has of the probability; None where that is little."""
    share = ranking.shares.get(SOMETHING_ELSE, 0.0)
    if share < REPORTED:
        return None
    sentence = f"something that the library does not hold has a probability of {share:.2f}"
    return {"probability": share, "sentence": sentence}


def discrepancy_figures(ranking: Ranking, chosen: str | None) -> dict[str, Any]:
    """Amplitudes by kind of sensor, and when on the curve tells nothing because the model error has grown."""
    fit, known = ranking.fits[chosen or NONE], ranking.problem.known
    time = ranking.problem.shots[0].setup.time
    growth = {}
    for channel, shape in ranking.problem.shapes.items():
        late = np.flatnonzero(shape.growth > GROWN)
        since = float(time[late[0]]) if len(late) else None
        growth[channel] = {"largest": float(shape.growth.max()), "uninformative_from": since}
    amplitude = dict(fit.evidence.amplitudes)
    return {"source": known.source, "amplitude": amplitude, "fixed": dict(known.fixed), "growth": growth}


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


def held_out_figures(held: Mapping[str, list[Held]], chosen: str | None) -> dict[str, dict[str, float | None]]:
    """Part held out -> whitened RMS before and after, and the gain in log density a point."""
    after = {one.name: one for one in held.get(chosen or "", [])}
    found = {one.name: (one, after.get(one.name)) for one in held[NONE]}
    return {
        name: {
            "before": old.error,
            "after": new.error if new else None,
            "gain": new.score - old.score if new else None,
        }
        for name, (old, new) in found.items()
    }
