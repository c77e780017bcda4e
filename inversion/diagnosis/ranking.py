"""Every model fitted and ranked: all on linear systems about a few fits, then those that matter about their own.

A fit is where a model lies best, parameters and magnitudes, by Gauss-Newton on the emulator with the whole covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.discrepancy import Amplitudes, Shape
from birdstrike.inversion.diagnosis.evidence import (
    BIRDS,
    BIRDS_APART,
    MAGNITUDE_SCALE,
    Evidence,
    Indices,
    ModelTester,
    credible_set,
    probabilities,
)
from birdstrike.inversion.diagnosis.hypotheses import (
    NONE,
    SOMETHING_ELSE,
    Hypothesis,
    Suspect,
    by_family,
    hypotheses,
)
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.inversion.diagnosis.system import PRIOR_SD, Options, Places, System, build

STEPS = 6
CLOSE = 0.02  # of a range: change of a parameter at which a refit has settled


@dataclass(frozen=True)
class Fit:
    """A model where it fits: system about there, its tester, its evidence there."""

    places: Places
    system: System
    tester: ModelTester
    evidence: Evidence

    def interval(self, group: str, k: int) -> tuple[Array, Array]:
        """(k,) mean and standard deviation of a group's parameters, fractions of the ranges."""
        at = self.system.groups.index(group) * k
        mean = 0.5 + PRIOR_SD * self.evidence.z[at : at + k]
        return mean, PRIOR_SD * np.sqrt(np.diag(self.evidence.z_cov)[at : at + k])


@dataclass(frozen=True)
class Problem:
    """What every refit needs. apart: how far the baselines' birds may lie from the shots' (`evidence.BIRDS`)."""

    shots: tuple[Shot, ...]
    found: tuple[Suspect, ...]
    known: Amplitudes
    shapes: Mapping[str, Shape]
    options: Options = field(default_factory=Options)
    scale: float = MAGNITUDE_SCALE
    apart: tuple[float, ...] = BIRDS_APART

    def start(self) -> Places:
        """The middle of the ranges, no effect."""
        return Places({shot.group: np.full(len(shot.setup.lows), 0.5) for shot in self.shots}, {})

    def refit(self, hypothesis: Hypothesis, start: Places | None = None, steps: int = STEPS) -> Fit:
        """Gauss-Newton with the amplitudes' posterior, halved steps where the emulator bends."""
        places = start or self.start()
        members = hypothesis.members
        fit = self._tested(hypothesis, places, members)
        for _ in range(steps):
            following = self._moved(fit, hypothesis)
            moved = max(float(np.abs(following.z[g] - places.z[g]).max()) for g in places.z)
            places = following
            fit = self._tested(hypothesis, places, members)
            if moved < CLOSE:
                break
        return fit

    def _tested(self, hypothesis: Hypothesis, places: Places, members: Sequence[Suspect]) -> Fit:
        system = build(self.shots, self.found, places, self.known, self.shapes, self.options)
        tester = ModelTester(system, self.known, places.h, self.scale, apart=self.apart)
        sizes = [places.h[one.label] for one in members] if places.h else None
        return Fit(places, system, tester, tester.model(hypothesis, sizes))

    def _moved(self, fit: Fit, hypothesis: Hypothesis) -> Places:
        """The posterior mean, inside the emulator's box and the effects' limits."""
        z: dict[str, Array] = {}
        for shot in self.shots:
            k = len(shot.setup.lows)
            mean, _ = fit.interval(shot.group, k)
            step = np.clip(mean - fit.places.z[shot.group], -0.35, 0.35)
            z[shot.group] = np.clip(fit.places.z[shot.group] + step, shot.setup.lows, shot.setup.highs)
        h = {
            one.label: float(np.clip(size, *one.limits))
            for one, size in zip(hypothesis.members, fit.evidence.h, strict=True)
        }
        return Places(z, h)


MATTERS = 5.0  # nats below the best single: beyond, a refit will not bring it back
ASTRAY = 0.1  # of what the best single gains on none: by so much a model's evidence may err before its own refit
MOST_REFITS = 5
MOST_PAIRS = 2  # pairs that are refitted
PAIRS_TRIED = 30  # by a bound without the doubt of signatures
NODES_KEPT = 0.01  # of a single's posterior: amplitudes at which pairs are evaluated


@dataclass(frozen=True)
class Ranking:
    """fits: refitted models by label; evidence: every model's; shares: posterior probabilities.

    about: fit of each other model at which its evidence stands, by label.
    """

    problem: Problem
    models: Mapping[str, Hypothesis]
    fits: Mapping[str, Fit]
    evidence: Mapping[str, Evidence]
    shares: Mapping[str, float]
    about: Mapping[str, Fit] = field(default_factory=dict)

    def stands_at(self, label: str) -> Fit:
        """The fit at which a model's evidence was computed: its own, or for most pairs that of a member."""
        return self.fits.get(label) or self.about.get(label, self.fits[NONE])

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

    @cached_property
    def same_bird(self) -> float:
        """Probability that the baselines' birds are of the shots' recipe; 0 without baselines."""
        tester = self.fits[NONE].tester
        return sum(self.shares[label] * tester.same_bird(one.weights) for label, one in self.evidence.items())

    @cached_property
    def birds(self) -> dict[str, float]:
        """Probability of each of `BIRDS` by the records, each as likely beforehand, whatever the user has stated.

        Beside a stated bird from the refitted models alone, at their fits.
        """
        logs = []
        for label, one in self.evidence.items():
            tester, evidence = self.fits[NONE].tester, one
            if self.problem.apart != BIRDS_APART:
                fit = self.fits.get(label)
                if fit is None or label == SOMETHING_ELSE:
                    continue
                tester = ModelTester(fit.system, self.problem.known, fit.places.h, self.problem.scale)
                members = self.models[label].members
                evidence = tester.model(self.models[label], [fit.places.h.get(m.label, 0.0) for m in members])
            logs.append(tester.by_bird(evidence) + np.log(self.models[label].prior))
        whole = np.logaddexp.reduce(np.array(logs))
        shares = np.exp(whole - np.logaddexp.reduce(whole))
        return dict(zip(BIRDS, map(float, shares), strict=True))

    @property
    def families(self) -> dict[str, float]:
        """Probabilities by family."""
        return by_family(self.shares, tuple(self.models.values()))


def rank(problem: Problem, progress: Callable[[float], None] = lambda _: None, refits: int = MOST_REFITS) -> Ranking:
    """All models of the library over the problem's shots."""
    models = {one.label: one for one in hypotheses(problem.found)}
    none = problem.refit(models[NONE])
    other = problem.refit(models[SOMETHING_ELSE], none.places, steps=3)
    progress(0.3)
    evidence = {NONE: none.evidence, SOMETHING_ELSE: other.evidence}
    singles = [label for label, one in models.items() if len(one.members) == 1]
    systems = [none, other, *_as_baseline(problem, models[NONE], none)]
    begins: dict[str, Fit] = {}
    for label in singles:
        tried = [(fit.tester.model(models[label]), fit) for fit in systems]
        evidence[label], begins[label] = min(tried, key=lambda one: _astray(*one))
    progress(0.5)
    fits = {NONE: none, SOMETHING_ELSE: other}
    _refit_best(problem, models, singles, evidence, fits, begins, refits)
    progress(0.8)
    best = max(singles, key=lambda label: evidence[label].log_evidence + np.log(models[label].prior))
    about = begins | fits
    evidence |= _pairs(fits, best, models, evidence, about)
    refit_pairs(problem, models, evidence, fits, about)
    progress(1.0)
    return Ranking(problem, models, fits, evidence, probabilities(evidence), about)


def _astray(evidence: Evidence, fit: Fit) -> float:
    """How far the model's parameters lie from where the system was linearised, in ranges: its errors belong there."""
    step = 0.0
    for i, group in enumerate(fit.system.groups):
        z = fit.places.z[group]
        mean = 0.5 + PRIOR_SD * evidence.z[i * len(z) : (i + 1) * len(z)]
        inside = np.clip(mean, 0.0, 1.0)
        step = max(step, float(np.abs(fit.system.roughness * (inside - z)).max()))
    return step


def _as_baseline(problem: Problem, none: Hypothesis, fit: Fit) -> list[Fit]:
    """The system where the shots' parameters are a baseline's: a fit without the missing effect is led away from it."""
    baselines = [shot.group for shot in problem.shots if shot.baseline]
    if not baselines:
        return []
    z = {shot.group: fit.places.z[shot.group if shot.baseline else baselines[0]] for shot in problem.shots}
    return [problem.refit(none, Places(z, {}), steps=0)]


def _refit_best(
    problem: Problem,
    models: Mapping[str, Hypothesis],
    singles: list[str],
    evidence: dict[str, Evidence],
    fits: dict[str, Fit],
    begins: Mapping[str, Fit],
    most: int,
) -> None:
    """Refit the singles within reach of the best, the likeliest first; what a refit finds takes its place."""
    score = {label: evidence[label].log_evidence + float(np.log(models[label].prior)) for label in singles}
    order = sorted(singles, key=lambda label: -score[label])
    for label in order[:most]:
        found = max(score.values())
        if score[label] < found - within(found, evidence[NONE].log_evidence):
            break
        refitted = problem.refit(models[label], _start(begins[label], models[label], evidence[label]), steps=3)
        fits[label] = refitted
        evidence[label] = refitted.evidence
        score[label] = refitted.evidence.log_evidence + float(np.log(models[label].prior))


def within(best: float, none: float) -> float:
    """Nats below the best model within which another one may still turn out to be better."""
    return max(MATTERS, ASTRAY * (best - none))


def _start(begin: Fit, hypothesis: Hypothesis, evidence: Evidence) -> Places:
    """Where the linear system puts the model."""
    return Places(
        dict(begin.places.z),
        {one.label: float(np.clip(h, *one.limits)) for one, h in zip(hypothesis.members, evidence.h, strict=True)},
    )


def _pairs(
    fits: Mapping[str, Fit],
    best: str,
    models: Mapping[str, Hypothesis],
    evidence: Mapping[str, Evidence],
    fit_about: dict[str, Fit],
) -> dict[str, Evidence]:
    """The pairs, each about the fit of its likelier member; those that could matter with the doubt of their signatures.

    The likeliest node of the best single alone tells which; the others stay at the better of their singles, which a
    pair's extra magnitude can only lower by its Occam factor. Nodes: those that the best single or a member keeps.
    fit_about: receives the fit at which each pair's evidence stands.
    """
    pairs = [one for one in models.values() if len(one.members) == 2]
    if not pairs:
        return {}
    first = fits.get(best, fits[NONE])
    quick = _quick_pairs(first.tester, pairs, int(first.evidence.weights.argmax()))
    offsets: dict[str, float] = {}
    found: dict[str, Evidence] = {}
    order = np.argsort(-quick)
    for rank_of, i in enumerate(order):
        one = pairs[int(i)]
        if rank_of < PAIRS_TRIED and quick[i] > quick[order[0]] - 8.0:
            fitted = [m.label for m in one.members if m.label in fits]
            label = max(fitted, key=lambda name: evidence[name].log_evidence, default=best if best in fits else NONE)
            about = fits[label]
            if label not in offsets:
                again = about.tester.model(about.evidence.hypothesis) if label != NONE else about.evidence
                offsets[label] = evidence[label].log_evidence - again.log_evidence
            kept = _kept(evidence[name] for name in (label, best, *(m.label for m in one.members)))
            full = about.tester.model(one, only=kept)
            found[one.label] = replace(full, log_evidence=full.log_evidence + offsets[label])
        else:
            label = _better(one, evidence)
            about, found[one.label] = fit_about[label], _as_single(one, evidence[label])
        fit_about[one.label] = about
    return found


def _kept(models: Iterable[Evidence]) -> Indices:
    """Nodes that are likely in one of the models."""
    return np.flatnonzero(np.any([one.weights > NODES_KEPT * one.weights.max() for one in models], axis=0))


def refit_pairs(
    problem: Problem,
    models: Mapping[str, Hypothesis],
    evidence: dict[str, Evidence],
    fits: Mapping[str, Fit],
    fit_about: dict[str, Fit],
) -> None:
    """Refit the likeliest pair until it stays the likeliest, where it is within reach of the best model.

    A single has been refitted where it lies best; a pair that has not been would be compared at another's place.
    """
    pairs = [label for label, one in models.items() if len(one.members) == 2 and label in evidence]
    score = {label: one.log_evidence + float(np.log(models[label].prior)) for label, one in evidence.items()}
    done: set[str] = set()
    while pairs and len(done) < MOST_PAIRS:
        label = max(pairs, key=lambda name: score[name])
        if label in done or score[label] < max(score.values()) - MATTERS:
            break
        members = [m.label for m in models[label].members if m.label in fits]
        about = fits[max(members, key=lambda name: evidence[name].log_evidence, default=NONE)]
        refitted = problem.refit(models[label], _start(about, models[label], evidence[label]), steps=2)
        evidence[label], fit_about[label] = refitted.evidence, refitted
        score[label] = refitted.evidence.log_evidence + float(np.log(models[label].prior))
        done.add(label)


def _quick_pairs(tester: ModelTester, pairs: list[Hypothesis], node: int) -> Array:
    """(pairs,) log evidence at one node, without the doubt of signatures."""
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


def _better(pair: Hypothesis, evidence: Mapping[str, Evidence]) -> str:
    return max((m.label for m in pair.members), key=lambda label: evidence[label].log_evidence)


def _as_single(pair: Hypothesis, single: Evidence) -> Evidence:
    """A pair as its better single, the other magnitude 0, with the Occam factor of a magnitude that tells nothing."""
    own = np.array([one.label == single.hypothesis.members[0].label for one in pair.members], dtype=float)
    evidence = single.log_evidence - 1.0
    return replace(
        single, hypothesis=pair, log_evidence=evidence, h=own * single.h[0], h_cov=np.diag(own) * single.h_cov[0, 0]
    )
