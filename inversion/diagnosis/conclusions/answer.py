"""The answer of a diagnosis from the ranking of its models: the verdict, and the figures of `results.diagnosis`.

Warnings of an answer: what is wrong with its input, its fits or its attribution, what follows, and what to do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import norm, truncnorm

from birdstrike.data.formatting import plain, quantity, span
from birdstrike.data.histories import Array
from birdstrike.data.units import rounded
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.doe.solvers import simulated_by
from birdstrike.inversion.diagnosis.conclusions.alarm import absorbed, biases, collinear
from birdstrike.inversion.diagnosis.conclusions.before_and_after import (
    Held,
    SolverRun,
    estimate,
    expected_residual,
    misfit,
    predicted,
    predicts_better,
    rms_by_channel,
)
from birdstrike.inversion.diagnosis.inference.evidence import quantiles
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Ranking, coarseness
from birdstrike.inversion.diagnosis.preparation.discrepancy import STATED
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.diagnosis.preparation.shots import Shot, setups_of, unpredicted
from birdstrike.inversion.estimation.answers.estimates import reported
from birdstrike.inversion.estimation.mesh_correction import shells_of_a_file, unrefined_file
from birdstrike.inversion.estimation.prior import conflicts, identified
from birdstrike.inversion.labels import in_words, label_parts
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
from birdstrike.solver.case.case import Case
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


MISFIT_ATTRIBUTED = 3.0
"""Times all errors: largest misfit in a shot with which an effect is attributed. A right model leaves more in at most
0.27 % of the shots, however its errors hang together: of the weighted means of squares of standard normal variables
that of a single one is above 9 most often (Szekely & Bakirov, Probab. Theory Relat. Fields 126 (2003) 184, for any
level below 21 %), and a fit only takes from it. Little power is claimed: edges that were free to turn, beyond the
linear range of the response, left 2.2."""


def too_close(ranking: Ranking, chosen: str | None, ahead: float) -> list[str]:
    """A warning where the likeliest effect is not attributed because other simulations could turn its name."""
    if chosen is None or ranking.presence[chosen] < LEVEL or ahead >= SIMULATION_SCATTER:
        return []
    return [
        f"{in_words(chosen)} is likeliest, but only by {ahead:.1f} in log evidence, which other simulations of the "
        f"same effects could move by {SIMULATION_SCATTER:g}: nothing is attributed; diagnose again with another "
        "--seed, add a shot or a sensor, and trust the name that stays"
    ]


def at_search_limit(ranking: Ranking, effect: str) -> list[str]:
    """A warning where the search for an effect's magnitude ended at the largest looked at."""
    if not magnitude_of(ranking, effect)[2]:
        return []
    if is_fault(ranking, effect):
        return [
            f"{in_words(effect)}: the magnitude reaches the largest that was looked at, which is more than a sound "
            "instrument does, so that it is not attributed: a sensor that died, or something that is not in the "
            "library, looks like it; check the sensor, or leave it out (--channels)"
        ]
    return [
        f"{in_words(effect)}: the magnitude reaches the largest that was looked at: the true one may be larger, and "
        "only the end of its interval towards 0 is known; or something that is not in the library looks like it; "
        "measure this quantity at the rig"
    ]


def is_fault(ranking: Ranking, effect: str) -> bool:
    """Whether an effect is one of the instruments."""
    return ranking.models[effect].members[0].fault is not None


def not_explained(ranking: Ranking, effect: str, shots: Sequence[Shot]) -> list[str]:
    """A warning where the likeliest effect leaves much more of a record than all errors together."""
    problem, model, fit = ranking.problem, ranking.models[effect], ranking.fits[effect]
    left = max(misfit(shot, curve_at(ranking, effect, shot), problem, model, fit) for shot in shots)
    if left <= MISFIT_ATTRIBUTED:
        return []
    return [
        f"{in_words(effect)} is likeliest, but with it the residual is still {rounded(left, 2)} times all errors "
        "together: nothing is attributed; look at the curves for what it leaves"
    ]


LEAST_HILL = 0.05
"""Probability of a second place from which on it is said: with less, the 95 % intervals of the first hold."""


def fits_elsewhere(ranking: Ranking, label: str) -> list[str]:
    """A warning where the records leave a model a second place, of which the intervals about the first hold nothing."""
    fit, problem = ranking.fits[label], ranking.problem
    other = problem.elsewhere(fit)
    if other is None:
        return []
    share = float(expit(coarseness(ranking.evidence) * (other.hill - fit.hill)))
    if share < LEAST_HILL:
        return []
    places = []
    for shot in problem.measured:
        space = shot.setup.plan.space
        at, first = (space.to_physical(one.interval(shot.name, len(space.names))[0][None])[0] for one in (other, fit))
        places += [
            f"{plain(space.names[i], space.names)} {quantity(float(at[i]), space.units[i])} in place of "
            f"{quantity(float(first[i]), space.units[i])} in {shot.name}"
            for i in np.flatnonzero(problem.apart_in(shot, other, fit))
        ]
    model = "the model without an effect" if label == NONE else in_words(label)
    return [
        f"{model} fits at a second place too, which has {share:.2f} of the probability of both "
        f"({'; '.join(places)}): its parameters, magnitude and intervals, and the probabilities of effects, are those "
        "about the first place alone; add a shot or a sensor, or state what is known of the parameter (prior)"
    ]


def predicts_no_better(ranking: Ranking, effect: str, held: Mapping[str, Sequence[Held]]) -> list[str]:
    """A warning where the effect predicts what was held out no better than the model without it."""
    if predicts_better(ranking.models[effect].members[0], held[NONE], held[effect]):
        return []
    return [
        f"{in_words(effect)} is likeliest, but it predicts what it was not fitted to (parts of the record, each "
        "sensor) no better than the model without it: nothing is attributed; add a shot, a sensor, or a baseline with "
        "the shot's own bird"
    ]


def held_out_record_is_worse(effect: str, held: Mapping[str, Sequence[Held]]) -> list[str]:
    """A warning where the effect predicts the record that the user held out worse; it is the last part.

    An effect that one of several shots has for itself is not the held-out record's: only its bird is another with it.
    """
    before, after = held[NONE][-1], held[effect][-1]
    if after.score >= before.score:
        return []
    wrong = "the effect is not what it is taken for"
    reason = wrong if label_parts(effect)[2] else f"that shot has not the effect, or {wrong}"
    return [
        f"with {in_words(effect)} the held-out record is predicted worse than without it (its residual is "
        f"{after.error:.2f} and {before.error:.2f} times the errors that each model expects, its log density lower by "
        f"{before.score - after.score:.2g} a point): {reason}"
    ]


def input_warnings(ranking: Ranking, shots: Sequence[Shot], baselines: Sequence[Shot], model: str) -> list[str]:
    """On sensors, nuisances, ranges, meshes and records of shots that were measured, under a model's fit."""
    sentences: list[str] = []
    if lacking := dict.fromkeys(name for shot in shots for name in _not_carried(shot)):
        sentences.append(
            f"inversion.nuisance of {', '.join(lacking)} is not carried: the case seeks or states the same "
            "quantity as a parameter or an effect, or its simulations failed; the answer takes the declared value "
            "as exact"
        )
    for shot in shots:
        sentences += _prior_conflicts(shot, ranking, model)
        sentences += outside_ranges(shot, ranking, model)
    sentences += shells_of_a_file(unrefined_file(shot.setup.plan.case) for shot in shots)
    sentences += _lattices_lacking((*shots, *baselines))
    for shot in shots:
        sentences += [f"{shot.name}: {line}" for line in shot.record.warnings]
    return sentences


def without_baseline(ranking: Ranking, case: Case) -> list[str]:
    """What the want of a baseline means for the answer; case: that of the first shot."""
    sentences: list[str] = []
    if ranking.problem.known.source != STATED:
        sentences.append(
            "no baseline and no stated model error: it is taken as unknown, between 0.2 and 10 % of the peak, so "
            "that only effects larger than the model error can be named; fire a shot in which nothing is changed "
            "and pass it with --baseline"
        )
    if case.solver.name == "external":
        sentences.append(
            f"{simulated_by(case)} is run on the declared mesh alone: its discretisation error is not measured and "
            "may be taken for an effect; compare with a finer mesh by hand, or pass a shot in which nothing is "
            "changed with --baseline, which shows it"
        )
    return sentences


def _not_carried(shot: Shot) -> list[str]:
    """Uncertain quantities that the shot's case states, and the answer does not carry."""
    stated = {name for name, sigma in shot.setup.plan.case.inversion.nuisance.items() if sigma > 0.0}
    return sorted(stated - set(shot.nuisances))


def _prior_conflicts(shot: Shot, ranking: Ranking, model: str) -> list[str]:
    """Warnings where a shot's parameters under a model contradict what its case states of them."""
    space, prior = shot.setup.plan.space, shot.setup.plan.prior
    if not prior.stated.any():
        return []

    def shown(i: int, z: float) -> str:
        return quantity(float(space.to_physical(np.full((1, len(space.names)), z))[0, i]), space.units[i])

    fit, k = ranking.fits[model], len(space.names)
    return conflicts(prior, space.names, fit.interval(shot.name, k)[0], fit.narrowed(shot.name, k), shown)


def outside_ranges(shot: Shot, ranking: Ranking, model: str) -> list[str]:
    """A warning for each of a shot's parameters that a model has outside its range."""
    space = shot.setup.plan.space
    mean, _ = ranking.fits[model].interval(shot.name, len(space.names))
    value = space.to_physical(mean[None])[0]
    return [
        f"{shot.name}: {plain(space.names[i], space.names)} of {quantity(float(value[i]), space.units[i])} would fit "
        f"best, outside its range ({span(float(space.lows[i]), float(space.highs[i]), space.units[i])}): it is not "
        "identified; widen the range if the material allows it, else look for what the case does not describe"
        for i in np.flatnonzero(outside_range(mean))
    ]


def sensors_left_out(setups: Sequence[Setup]) -> list[str]:
    """A warning about sensors that are not used, once for all cases of which it says the same."""
    cases: dict[str, list[str]] = {}
    for one in setups:
        if one.left_out:
            cases.setdefault(unpredicted(one, one.left_out), []).append(one.plan.case.name)
    return [f"{', '.join(names)}: {text}" for text, names in cases.items()]


def _lattices_lacking(shots: Sequence[Shot]) -> list[str]:
    """A warning for every case whose simulations on another lattice did not all finish."""
    counts = [(one.plan.case.name, len(one.lattice_moves), len(one.plan.lattices())) for one in setups_of(shots)]
    return [
        f"{name}: {finished} of {wanted} simulations on another lattice finished; the intervals of parameters and "
        "magnitudes hold too little of what the choice of a lattice moves"
        for name, finished, wanted in counts
        if finished < wanted
    ]
