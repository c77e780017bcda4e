"""Every model fitted and ranked: all on linear systems about a few fits, then those that matter about their own.

A fit is where a model lies best, parameters and magnitudes, by Gauss-Newton on the emulator; the whole covariance, and
the posterior of its amplitudes, belongs to every step. Evidence and prior give posterior probabilities and the credible
set.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax
from scipy.stats.qmc import Sobol

from birdstrike.data.histories import Array, Indices
from birdstrike.data.progress import Progress, silent
from birdstrike.inversion.diagnosis.inference.evidence import MAGNITUDE_SCALE, Evidence, ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import (
    BIRDS,
    BIRDS_APART,
    NOTHING,
    CandidateEffect,
    Hypothesis,
    by_family,
    hypotheses,
)
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.system import Options, System, build, changes, with_fault
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes, Shape
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
from birdstrike.surrogate.gaussian_process import NORMAL_95

CREDIBLE = 0.95  # of the probability
COARSE = 0.01
"""Of the evidence that an effect gains: by how much it would err if a tenth of its signature were wrong in a way that
nothing here knows of. Other simulations of a clamp that had gone altogether moved it by 1.7 %."""


def coarseness(found: Mapping[str, Evidence]) -> float:
    """Power to which likelihoods are raised before they are compared.

    No signature is exact. What its error costs in evidence grows with what the signature explains: a model that
    explains all but a hundredth of what the best one does is never more than a nat behind it (Miller & Dunson, J. Am.
    Stat. Assoc. 114 (2019) 1113).
    """
    best = max(one.log_evidence for one in found.values())
    return 1.0 / (1.0 + COARSE * (best - found[NONE].log_evidence))


def probabilities(found: Mapping[str, Evidence]) -> dict[str, float]:
    """Posterior probability of every model, from evidence (`coarseness`) and prior."""
    logs = np.array([one.log_evidence for one in found.values()])
    scores = coarseness(found) * logs + np.log([one.hypothesis.prior for one in found.values()])
    return dict(zip(found, map(float, softmax(scores)), strict=True))


def credible_set(shares: Mapping[str, float]) -> tuple[str, ...]:
    """The likeliest models that together hold 95 %."""
    chosen, held = [], 0.0
    for name in sorted(shares, key=lambda n: -shares[n]):
        chosen.append(name)
        held += shares[name]
        if held >= CREDIBLE:
            break
    return tuple(chosen)


STEPS = 12
FIRST_STEPS = 4  # of a fit from each of the starts; the best goes on
STARTS = 4  # points of the ranges, beside the middle, from which the first fits begin
FARTHEST = 0.35  # of a range: one step
SHORTER = 0.9  # of the last step: a longer one swings
SWING = 0.05  # of a range: steps by which a fit goes round its end
SIZES_TRIED = 41  # of a fault that bends, over its limits: every half or quarter of a plausible size
SIZE_STEPS = 2  # Gauss-Newton from the likeliest of them
CLOSE = 0.02  # of a range: change of a parameter at which a refit has settled

A = TypeVar("A")
B = TypeVar("B")


def each(work: Callable[[A], B], tasks: Iterable[A]) -> list[B]:
    """Results in the order of the tasks, on all cores: linear algebra leaves the interpreter to other threads."""
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return list(pool.map(work, tasks))


MOST_COMBINATIONS = 300  # of amplitudes: three kinds of sensors have 216, of which none is dropped
DROPPED = 1e-4  # weight of a combination, of the best one's, below which it is dropped


@dataclass(frozen=True)
class Fit:
    """A model where it fits: system about there, its tester, its evidence there."""

    places: Places
    system: System
    tester: ModelTester
    evidence: Evidence

    @cached_property
    def joint(self) -> float:
        """Log density of the records and of the parameters at the places (`ModelTester.joint`)."""
        model = self.evidence.hypothesis
        return self.tester.joint(model, [self.places.h.get(one.label, 0.0) for one in model.members])

    @cached_property
    def hill(self) -> float:
        """Log of the probability of records and parameters about the places, up to what all fits of a model share.

        By the density there and the covariance about it (Laplace): of a fit that has not ended it is too small.
        """
        return self.joint + 0.5 * float(np.linalg.slogdet(self.evidence.z_cov)[1])

    def interval(self, name: str, k: int) -> tuple[Array, Array]:
        """(k,) mean and standard deviation of a shot's parameters, fractions of the ranges."""
        at, prior = self.system.names.index(name) * k, self.system.priors[name]
        mean = prior.place(self.evidence.z[at : at + k])
        return mean, prior.sd * np.sqrt(np.diag(self.evidence.z_cov)[at : at + k])

    def narrowed(self, name: str, k: int) -> Array:
        """(k,) standard deviations to which the record narrows a shot's parameters where the amplitudes are known.

        A record that contradicts a prior leaves open which amplitude of the model error that comes of: over all of them
        the parameters can then be less certain than beforehand.
        """
        at, prior = self.system.names.index(name) * k, self.system.priors[name]
        return prior.sd * np.sqrt(np.diag(self.evidence.z_cov - self.evidence.z_spread)[at : at + k])


@dataclass(frozen=True)
class Problem:
    """What every refit needs.

    apart: how far the birds may lie apart (`hypotheses.BIRDS`); begin: where fits begin, sought by default.
    """

    shots: tuple[Shot, ...]
    found: tuple[CandidateEffect, ...]
    known: Amplitudes
    shapes: Mapping[str, Shape]
    options: Options = field(default_factory=Options)
    scale: float = MAGNITUDE_SCALE
    apart: tuple[float, ...] = BIRDS_APART
    begin: Places | None = None

    @cached_property
    def start(self) -> Places:
        """No effect; the parameters where the records are likeliest, all shots together.

        The best of fits from points that fill the ranges, each with one bird in all shots: the curves bend, most where
        the bird's viscosity is small, and beside a discrepancy that shots share a fit can end in a local maximum.
        """
        if self.begin is not None:
            return self.begin
        bare = replace(self, found=())
        fits = each(lambda place: bare.refit(NOTHING, place, FIRST_STEPS), self._beginnings({}))
        return max(fits, key=lambda fit: fit.joint).places

    def _beginnings(self, h: Mapping[str, float]) -> list[Places]:
        """Points that fill the ranges, the bird the same in all shots; h: size of each effect."""
        k = len(self.shots[0].setup.lows)
        return [
            Places({s.name: s.setup.lows + unit * (s.setup.highs - s.setup.lows) for s in self.shots}, dict(h))
            for unit in [np.full(k, 0.5), *Sobol(k, rng=0).random(STARTS)]
        ]

    def elsewhere(self, fit: Fit) -> Fit | None:
        """The likeliest fit of a fit's model that begins at other points and ends apart from it; None where none does.

        Apart: a parameter of a measured shot lies beyond the 95 % of both.
        """
        model = fit.evidence.hypothesis
        bare = replace(self, found=model.members)
        fits = each(lambda place: bare.refit(model, place), self._beginnings(fit.places.h))
        others = [one for one in fits if any(self.apart_in(shot, one, fit).any() for shot in self.measured)]
        return max(others, key=lambda one: one.hill, default=None)

    @property
    def measured(self) -> tuple[Shot, ...]:
        """The shots that are no baselines."""
        return tuple(shot for shot in self.shots if not shot.baseline)

    def apart_in(self, shot: Shot, one: Fit, other: Fit) -> NDArray[np.bool_]:
        """(k,) whether a shot's parameter in one of two fits of a model lies beyond the 95 % of both."""
        (mean, sd), (theirs, their_sd) = (fit.interval(shot.name, len(shot.setup.lows)) for fit in (one, other))
        return np.abs(mean - theirs) > np.maximum(NORMAL_95 * np.maximum(sd, their_sd), SWING)

    def manageable(self) -> Problem:
        """With the combinations of amplitudes that count, where there are too many to compute them all in every fit.

        With four kinds of sensors there are a thousand, of which the records leave a few. Dropped are those that are
        negligible for the model without an effect and for all effects at once, between which every model lies. Both
        are judged where the model without an effect fits on every other node.
        """
        if len(self.known.combinations()) <= MOST_COMBINATIONS:
            return self
        place = replace(self, known=self.known.thinned(), found=()).refit(NOTHING).places
        system = build(self.shots, self.found, place, self.known, self.shapes, self.options)
        tester = ModelTester(system, self.known, scale=self.scale, apart=self.apart)
        every = [one.label for one in self.found]
        kept = tester.likely_combinations([], DROPPED) | tester.likely_combinations(every, DROPPED)
        return replace(self, known=replace(self.known, kept=tuple(sorted(kept))), begin=place)

    def refit(self, hypothesis: Hypothesis, start: Places | None = None, steps: int = STEPS) -> Fit:
        """Gauss-Newton with the amplitudes' posterior, to where the posterior mean is the place itself.

        A step that is no shorter than the last is halved: the covariance too hangs on the parameters, and curves bend.
        The numerical error is small beside a fine simulation, so that a fit which goes round its end can lose five nats
        by the place at which it stops: without a baseline the place is taken where records and parameters are likeliest
        together. Beside a baseline the parameters of two birds have no such end on steps of this size.
        """
        bare = self if hypothesis.label == SOMETHING_ELSE else replace(self, found=hypothesis.members)
        fit, whole, last = bare.tested(hypothesis, start or self.start), 1.0, np.inf
        ends, lone = list[Fit](), not any(shot.baseline for shot in self.shots)
        for _ in range(steps):
            following = self._moved(fit, hypothesis, whole)
            moved = max(float(np.abs(following.z[g] - fit.places.z[g]).max()) for g in following.z)
            if moved > SHORTER * last:
                whole *= 0.5
                following = self._moved(fit, hypothesis, whole)
                moved *= 0.5
            if lone and moved < SWING:
                ends.append(fit)
            fit, last = bare.tested(hypothesis, following), moved
            if moved < CLOSE:
                break
        best = max([*ends, fit], key=lambda one: one.joint) if ends else fit
        return best if bare is self else self.tested(hypothesis, best.places)

    def sized(self, hypothesis: Hypothesis, fit: Fit) -> Fit:
        """A fault that bends, as large as it is likeliest, about the parameters of a fit without it.

        What its slope at 0 shows is no use beside a fault that has the same slope: the likeliest of sizes all over its
        limits is taken, and improved by Gauss-Newton.
        """
        (one,) = hypothesis.members
        sizes = np.linspace(*one.limits, SIZES_TRIED)
        at = Places(fit.places.z, {})
        h = fit.tester.likeliest(changes(one, self.shots, at, sizes.tolist(), fit.system.noise), sizes)
        for _ in range(SIZE_STEPS):
            found = self._with_fault(hypothesis, fit, h)
            h = float(np.clip(found.evidence.h[0], *one.limits))
        return self._with_fault(hypothesis, fit, h)

    def _with_fault(self, hypothesis: Hypothesis, fit: Fit, h: float) -> Fit:
        (one,) = hypothesis.members
        places = Places(fit.places.z, {one.label: h})
        return self._on(with_fault(fit.system, one, self.shots, places), hypothesis, places)

    def tested(self, hypothesis: Hypothesis, places: Places) -> Fit:
        """A model as it stands at places."""
        system = build(self.shots, self.found, places, self.known, self.shapes, self.options)
        return self._on(system, hypothesis, places)

    def _on(self, system: System, hypothesis: Hypothesis, places: Places) -> Fit:
        """A model on the system at places."""
        tester = ModelTester(system, self.known, places.h, self.scale, apart=self.apart)
        sizes = [places.h[one.label] for one in hypothesis.members] if places.h else None
        return Fit(places, system, tester, tester.model(hypothesis, sizes))

    def _moved(self, fit: Fit, hypothesis: Hypothesis, whole: float) -> Places:
        """The posterior mean, or a part of the way there, inside the emulator's box and the effects' limits."""
        z: dict[str, Array] = {}
        for shot in self.shots:
            k = len(shot.setup.lows)
            mean, _ = fit.interval(shot.name, k)
            step = whole * np.clip(mean - fit.places.z[shot.name], -FARTHEST, FARTHEST)
            z[shot.name] = np.clip(fit.places.z[shot.name] + step, shot.setup.lows, shot.setup.highs)
        h = {
            one.label: float(np.clip(size, *one.limits))
            for one, size in zip(hypothesis.members, fit.evidence.h, strict=True)
        }
        return Places(z, h)


def likelier(problem: Problem, other: Problem) -> Problem:
    """That of two problems of the same shots under which the records are likelier without any effect.

    Their parameters are fitted in each, from one place; later fits begin there.
    """
    first = problem.refit(NOTHING)
    second = replace(other, begin=first.places).refit(NOTHING)
    if second.joint > first.joint:
        return replace(other, begin=second.places)
    return replace(problem, begin=first.places)


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
        """(3,) log marginal likelihood under each of `hypotheses.BIRDS`, with the tester of the fit."""
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
