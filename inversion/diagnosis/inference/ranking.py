"""Every model fitted and ranked: all on linear systems about a few fits, then those that matter about their own.

A fit is where a model lies best, parameters and magnitudes, by Gauss-Newton on the emulator with the whole covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import softmax

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.inversion.diagnosis.inference.bird_scatter import BIRDS, BIRDS_APART
from birdstrike.inversion.diagnosis.inference.evidence import Evidence, ModelTester
from birdstrike.inversion.diagnosis.inference.fit import Fit, Problem, each
from birdstrike.inversion.diagnosis.inference.gaussians import Indices
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, Hypothesis, by_family, hypotheses
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.probabilities import coarseness, credible_set, probabilities
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE

MATTERS = 5.0  # nats below the best single: beyond, a refit will not bring it back
ASTRAY = 0.1  # of what the best single gains on none: by so much a model's evidence may err before its own refit
MOST_REFITS = 5
MOST_PAIRS = 2  # pairs that are refitted
PAIR_STEPS = 6  # of each: what is left to go is little, but two magnitudes and two birds move together
PAIRS_TRIED = 30  # by a bound without the signatures' errors
CLOSE_PAIRS = 8.0  # nats below the best pair by that bound: beyond, the signatures' errors will not bring it back
LIKELY = 0.01  # probability of a model that is asked for what it says of the birds
NODES_KEPT = 0.01  # of a single's posterior: amplitudes at which pairs are evaluated


@dataclass(frozen=True)
class Assessment:
    """A model as judged. fit: about which its evidence was computed; own: whether that is the model's own refit."""

    evidence: Evidence
    fit: Fit
    own: bool = False

    @classmethod
    def refitted(cls, fit: Fit) -> Assessment:
        """A model at its own refit."""
        return cls(fit.evidence, fit, True)

    @property
    def at_fit(self) -> Evidence:
        """Of the fit; not what the model is ranked by, where `Ranking.refitted` has made a fit for its figures."""
        return self.fit.evidence if self.own else self.evidence

    @property
    def at_best(self) -> float:
        """Log evidence with the likeliest signatures that simulations leave possible (`ModelTester.at_best`)."""
        return self.fit.tester.at_best(self.evidence)

    @cached_property
    def by_bird(self) -> Array:
        """(3,) log marginal likelihood under each of `bird_scatter.BIRDS`, with the tester of the fit."""
        return self.fit.tester.by_bird(self.evidence.hypothesis, self.at_fit.h)

    @property
    def score(self) -> float:
        """Log of evidence times prior."""
        return self.evidence.log_evidence + float(np.log(self.evidence.hypothesis.prior))


Assessments = Mapping[str, Assessment]


@dataclass(frozen=True)
class Ranking:
    """models, assessments: by label."""

    problem: Problem
    models: Mapping[str, Hypothesis]
    assessments: Assessments

    @cached_property
    def evidence(self) -> dict[str, Evidence]:
        """Every model's."""
        return {label: one.evidence for label, one in self.assessments.items()}

    @cached_property
    def fits(self) -> dict[str, Fit]:
        """Of the models that were refitted."""
        return {label: one.fit for label, one in self.assessments.items() if one.own}

    @cached_property
    def shares(self) -> dict[str, float]:
        """Posterior probabilities."""
        return probabilities(self.evidence)

    @property
    def singles(self) -> dict[str, CandidateEffect]:
        """Label -> the effect of every model of one effect."""
        return {label: one.members[0] for label, one in self.models.items() if len(one.members) == 1}

    @property
    def seen(self) -> list[str]:
        """Single effects that a sensor can show."""
        return [label for label, one in self.singles.items() if one.seen]

    def refitted(self, label: str) -> Ranking:
        """The same answer with a refit of one of its models."""
        if self.assessments[label].own:
            return self
        model = self.models[label]
        fit = self.problem.refit(model, _start(self.fits[NONE], model, self.evidence[label]), steps=2)
        again = replace(self.assessments[label], fit=fit, own=True)
        return replace(self, assessments={**self.assessments, label: again})

    @property
    def confidence_set(self) -> tuple[str, ...]:
        """The 95 % credible set."""
        return credible_set(self.shares)

    @cached_property
    def presence(self) -> dict[str, float]:
        """Probability of none, of something else, and that each effect is there, alone or in a pair.

        Sum over the models that hold it (posterior inclusion probability: Hoeting et al., Stat. Sci. 14 (1999) 382).
        """
        found = {label: share for label, share in self.shares.items() if len(self.models[label].members) < 2}
        for label, share in self.shares.items():
            if len(self.models[label].members) == 2:
                for one in self.models[label].members:
                    found[one.label] += share
        return found

    def ahead(self, label: str) -> float:
        """Nats by which an effect's best model is ahead of the best one of other effects alone; inf without such.

        Beside an effect of the instrument only models with an effect of the solver count: signatures of the instrument
        are exact, and evidence about them does not hang on simulations.
        """
        single = self.models[label].members[0]
        own, others = [], [-np.inf]
        for name, one in self.assessments.items():
            members = self.models[name].members
            if label in (member.label for member in members):
                own.append(one.score)
            elif any(single.response or member.response for member in members):
                others.append(one.score)
        return max(own) - max(others)

    @cached_property
    def same_bird(self) -> float:
        """Probability that the birds of all shots, baselines included, are of one recipe; 0 of a single shot."""
        power, own = coarseness(self.evidence), np.array(BIRDS_APART) < max(BIRDS_APART)
        least = min(LIKELY, max(self.shares.values()))
        likely = {label: share for label, share in self.shares.items() if share >= least}
        logs = [self.assessments[label].by_bird for label in likely]
        return float(np.average([softmax(power * one)[own].sum() for one in logs], weights=list(likely.values())))

    @cached_property
    def birds(self) -> dict[str, float]:
        """Probability of each of `BIRDS` by the records, each as likely beforehand, whatever the user has stated.

        From the refitted models alone, at their fits.
        """
        power, logs = coarseness(self.evidence), []
        for label, fit in self.fits.items():
            if label == SOMETHING_ELSE:
                continue
            if self.problem.apart == BIRDS_APART:
                own = self.assessments[label].by_bird
            else:
                tester = ModelTester(fit.system, self.problem.known, fit.places.h, self.problem.scale)
                own = tester.by_bird(self.models[label], fit.evidence.h)
            logs.append(power * own + np.log(self.models[label].prior))
        shares = softmax(np.logaddexp.reduce(np.array(logs)))
        return dict(zip(BIRDS, map(float, shares), strict=True))

    @property
    def families(self) -> dict[str, float]:
        """Probabilities by family."""
        return by_family(self.shares, tuple(self.models.values()))


def rank(problem: Problem, progress: Progress = silent) -> Ranking:
    """All models of the library over the problem's shots."""
    models = {one.label: one for one in hypotheses(problem.found)}
    singles, pairs = ([one for one in models.values() if len(one.members) == count] for count in (1, 2))
    none = problem.refit(models[NONE])
    other = problem.refit(models[SOMETHING_ELSE], none.places, steps=3)
    found = {NONE: Assessment.refitted(none), SOMETHING_ELSE: Assessment.refitted(other)}
    fits = [none, other, *_as_baseline(problem, models[NONE], none)]
    found |= _assessed(lambda one: _least_astray(problem, one, fits), singles)
    progress(0.4)
    found |= _refit_best(problem, singles, found)
    progress(0.6)
    found |= _refit_at_best(problem, models, found)
    progress(0.8)
    found |= _judge_pairs(singles, pairs, found)
    found |= refit_pairs(problem, pairs, found)
    progress(1.0)
    return Ranking(problem, models, found)


def _assessed(judge: Callable[[Hypothesis], Assessment], models: Sequence[Hypothesis]) -> dict[str, Assessment]:
    """Models as judged, by label."""
    return dict(zip((one.label for one in models), each(judge, models), strict=True))


def _least_astray(problem: Problem, one: Hypothesis, fits: Sequence[Fit]) -> Assessment:
    """A model about that fit from which its own parameters lie least far."""
    if one.members[0].bends and one.members[0].seen:
        sized = [fit if fit.places.h else problem.sized(one, fit) for fit in fits]
        tried = [Assessment(fit.evidence, fit) for fit in sized]
    else:
        tried = [Assessment(fit.tester.model(one), fit) for fit in fits]
    return min(tried, key=lambda assessment: _astray(assessment.evidence, assessment.fit))


def _astray(evidence: Evidence, fit: Fit) -> float:
    """How far the model's parameters lie from where the system was linearised, in ranges: its errors belong there."""
    step = 0.0
    for i, (name, prior) in enumerate(fit.system.priors.items()):
        z = fit.places.z[name]
        mean = prior.place(evidence.z[i * len(z) : (i + 1) * len(z)])
        inside = np.clip(mean, 0.0, 1.0)
        step = max(step, float(np.abs(fit.system.roughness * (inside - z)).max()))
    return step


def _as_baseline(problem: Problem, none: Hypothesis, fit: Fit) -> list[Fit]:
    """The system where the shots' parameters are a baseline's: a fit without the missing effect is led away from it."""
    baselines = [shot.name for shot in problem.shots if shot.baseline]
    if not baselines:
        return []
    z = {shot.name: fit.places.z[shot.name if shot.baseline else baselines[0]] for shot in problem.shots}
    return [problem.refit(none, Places(z, {}), steps=0)]


def _refit_best(problem: Problem, singles: Sequence[Hypothesis], found: Assessments) -> dict[str, Assessment]:
    """The singles within reach of the best, refitted, the likeliest first."""
    score = {one.label: found[one.label].score for one in singles}
    refitted: dict[str, Assessment] = {}
    for one in sorted(singles, key=lambda one: -score[one.label])[:MOST_REFITS]:
        best = max(score.values())
        if score[one.label] < best - within(best, found[NONE].evidence.log_evidence):
            break
        begin = found[one.label]
        start = _start(begin.fit, one, begin.evidence)
        refitted[one.label] = Assessment.refitted(problem.refit(one, start, steps=3))
        score[one.label] = refitted[one.label].score
    return refitted


def _refit_at_best(problem: Problem, models: Mapping[str, Hypothesis], found: Assessments) -> dict[str, Assessment]:
    """None and the singles that were refitted, from the place of the best of them too: all compared at one maximum.

    Where none lies better there, the singles that were judged about it are judged about it anew.
    """
    own = {n: one for n, one in found.items() if one.own and n != SOMETHING_ELSE}
    best = max(own, key=lambda label: own[label].score)
    others = [label for label in own if label != best]
    begin = own[best].fit.places.z
    fits = each(
        lambda label: problem.refit(models[label], Places(dict(begin), own[label].fit.places.h), steps=3), others
    )
    again = {
        label: Assessment.refitted(fit)
        for label, fit in zip(others, fits, strict=True)
        if fit.joint > own[label].fit.joint
    }
    if NONE in again:
        rest = [one for one in models.values() if len(one.members) == 1 and not found[one.label].own]
        again |= _assessed(lambda one: _least_astray(problem, one, [again[NONE].fit, found[one.label].fit]), rest)
    return again


def within(best: float, none: float) -> float:
    """Nats below the best model within which another one may still turn out to be better."""
    return max(MATTERS, ASTRAY * (best - none))


def _start(begin: Fit, hypothesis: Hypothesis, evidence: Evidence) -> Places:
    """Where the linear system puts the model."""
    return Places(
        dict(begin.places.z),
        {one.label: float(np.clip(h, *one.limits)) for one, h in zip(hypothesis.members, evidence.h, strict=True)},
    )


def _judge_pairs(
    singles: Sequence[Hypothesis], pairs: Sequence[Hypothesis], found: Assessments
) -> dict[str, Assessment]:
    """The pairs, each about the fit of its likelier member; those that could matter with their signatures' errors.

    The likeliest node of the best single alone tells which; the others stay at the better of their singles, which a
    pair's extra magnitude can only lower by its Occam factor. Nodes: those that the best single or a member keeps.
    """
    if not pairs:
        return {}
    best = max((one.label for one in singles), key=lambda label: found[label].score)
    base = best if found[best].own else NONE
    first = found[base].fit
    quick = _quick_pairs(first.tester, pairs, int(first.evidence.weights.argmax()))
    order = np.argsort(-quick)
    near = [int(i) for i in order[:PAIRS_TRIED] if quick[i] > quick[order[0]] - CLOSE_PAIRS]
    otherwise = NONE if any(one.bends for one in first.evidence.hypothesis.members) else base
    likelier = {pairs[i].label: _likeliest_member(pairs[i], found, otherwise) for i in near}
    about = list(dict.fromkeys(likelier.values()))
    gained = each(lambda label: found[label].evidence.log_evidence - _at_own_fit(found[label].fit), about)
    offsets = dict(zip(about, gained, strict=True))

    def judged(one: Hypothesis) -> Assessment:
        label = likelier[one.label]
        kept = _kept(found[name].evidence for name in (label, best, *(m.label for m in one.members)))
        full = found[label].fit.tester.model(one, only=kept)
        return Assessment(replace(full, log_evidence=full.log_evidence + offsets[label]), found[label].fit)

    bounds = {one.label: _as_better_single(one, found) for one in pairs}
    return bounds | _assessed(judged, [pairs[i] for i in near])


def _likeliest_member(pair: Hypothesis, found: Assessments, otherwise: str) -> str:
    """The likelier of the members that were refitted, or `otherwise` where neither was."""
    own = [one.label for one in pair.members if found[one.label].own]
    return max(own, key=lambda label: found[label].evidence.log_evidence, default=otherwise)


def _at_own_fit(fit: Fit) -> float:
    """Log evidence of a fit's model as a pair about it is judged: at the sizes that the system there gives."""
    model = fit.evidence.hypothesis
    return (fit.tester.model(model) if model.members else fit.evidence).log_evidence


def _kept(models: Iterable[Evidence]) -> Indices:
    """Nodes that are likely in one of the models."""
    return np.flatnonzero(np.any([one.weights > NODES_KEPT * one.weights.max() for one in models], axis=0))


def refit_pairs(problem: Problem, pairs: Sequence[Hypothesis], found: Assessments) -> dict[str, Assessment]:
    """The likeliest pair refitted until it stays the likeliest, where it is within reach of the best model.

    A single has been refitted where it lies best; a pair that has not been would be compared at another's place.
    """
    refitted: dict[str, Assessment] = {}
    score = {label: one.score for label, one in found.items()}
    while pairs and len(refitted) < MOST_PAIRS:
        one = max(pairs, key=lambda one: score[one.label])
        if one.label in refitted or score[one.label] < max(score.values()) - MATTERS:
            break
        about = found[_likeliest_member(one, found, NONE)].fit
        fit = problem.refit(one, _start(about, one, found[one.label].evidence), steps=PAIR_STEPS)
        refitted[one.label] = Assessment.refitted(fit)
        score[one.label] = refitted[one.label].score
    return refitted


def _quick_pairs(tester: ModelTester, pairs: Sequence[Hypothesis], node: int) -> Array:
    """(pairs,) log evidence at one node, without the signatures' errors."""
    index, quick = tester.singles
    gram, pull = quick.S[node], quick.S[node][:, 0]
    variances = tester.deviations[:, None, None] ** 2
    found = np.empty(len(pairs))
    for j, pair in enumerate(pairs):
        at = [index[m.label] for m in pair.members]
        inner = np.eye(2) + variances * gram[np.ix_(at, at)]
        gained = variances[:, 0, 0] * (np.linalg.solve(inner, pull[at][None, :, None])[..., 0] @ pull[at])
        found[j] = np.log(pair.prior) + np.logaddexp.reduce(0.5 * (gained - np.linalg.slogdet(inner)[1]))
    return found


def _as_better_single(pair: Hypothesis, found: Assessments) -> Assessment:
    """A pair as its better single, the other magnitude 0, with the Occam factor of a magnitude that tells nothing."""
    better = max((found[one.label] for one in pair.members), key=lambda one: one.evidence.log_evidence)
    single = better.evidence
    own = np.array([one.label == single.hypothesis.members[0].label for one in pair.members], dtype=float)
    evidence = replace(
        single,
        hypothesis=pair,
        log_evidence=single.log_evidence - 1.0,
        h=own * single.h[0],
        h_cov=np.diag(own) * single.h_cov[0, 0],
        h_lattice=np.diag(own) * single.h_lattice[0, 0],
    )
    return Assessment(evidence, better.fit)
