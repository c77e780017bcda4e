"""Where a model fits the shots best: parameters and magnitudes, by Gauss-Newton on the emulator.

The whole covariance, and the posterior of its amplitudes, belongs to every step.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.stats.qmc import Sobol

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.bird_scatter import BIRDS_APART
from birdstrike.inversion.diagnosis.inference.evidence import MAGNITUDE_SCALE, Evidence, ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING, CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.system import Options, System, build, changes, with_fault
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes, Shape
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.results.diagnosis import SOMETHING_ELSE

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

    apart: how far the birds may lie apart (`bird_scatter.BIRDS`); begin: where fits begin, sought by default.
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
        k = len(self.shots[0].setup.lows)
        bare = replace(self, found=())
        places = [
            Places({s.name: s.setup.lows + unit * (s.setup.highs - s.setup.lows) for s in self.shots}, {})
            for unit in [np.full(k, 0.5), *Sobol(k, rng=0).random(STARTS)]
        ]
        fits = each(lambda place: bare.refit(NOTHING, place, FIRST_STEPS), places)
        return max(fits, key=lambda fit: fit.joint).places

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
