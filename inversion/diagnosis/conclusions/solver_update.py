"""Emulator and signatures brought up to date by the solver, where the records lie.

The emulator by runs of the campaign near the fits, as long as its error counts in an interval. Signatures: the effects
that matter, run at the place and the size where they matter.

A response is learnt in the middle of the ranges at stated sizes; a clamp that has gone altogether bends the plate in
another shape. So the likeliest effects are simulated at their own fits; one that reaches the largest magnitude that was
looked for is simulated beyond it, and the search goes on to there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.distance import cdist

from birdstrike.data.histories import Array
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.conclusions.before_and_after import misfit, predicted
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING, CandidateEffect, candidate_effects
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Problem, Ranking, within
from birdstrike.inversion.diagnosis.preparation.plan import levels
from birdstrike.inversion.diagnosis.preparation.responses import Change, Response
from birdstrike.inversion.diagnosis.preparation.setup import Setup, make_setup, stack
from birdstrike.inversion.diagnosis.preparation.shots import Shot, setups_of
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.solver.case.case import Case

MOST = 4  # effects brought up to date in one round; the next takes those that are within reach then
LEAST_SIZE = 2.0  # plausible sizes, never beyond the design's own: a smaller change drowns in the runs' scatter
FARTHER = 4.0  # times the largest magnitude, where a fit has reached it
BEYOND = 2.0  # times the largest magnitude, where a fit lies near it on a response that bends
BENT = 0.9  # of a linear response
REPLICATES = 8  # pairs of runs, each on a lattice of its own and a little apart: their scatter is independent
APART = 0.005  # of the ranges
PLACE = 0.1  # of the ranges: fits nearer than that share the simulations without their effects
SURE = 0.5  # probability of none beyond which there is nothing to bring up to date
WITHIN = 12.0  # nats of the best single, at least
CANDIDATES = 400  # places near a fit among which the next run of the campaign is chosen
REACH = 2.0  # standard deviations of a fit
MISFIT_WITHOUT_EFFECT = 2.0
"""Times all errors: a shot from which a fit without an effect is farther needs one. A model without one that is right
leaves more in at most 4.6 % of the shots (`answer.MISFIT_ATTRIBUTED`)."""
DIGITS = 3  # of a magnitude and of a place: the last ones of a fit differ from call to call, and each is another run
NEAR = 0.3  # of a magnitude: within it of one that was simulated the response is interpolated


@dataclass(frozen=True)
class Wanted:
    """One effect to be simulated: its label, in a shot's case, its response there so far, magnitude b in plausible
    sizes, parameters z (k,).
    """

    label: str
    shot: Shot
    response: Response
    b: float
    z: Array

    @property
    def name(self) -> str:
        """Of the effect."""
        return self.response.known.name

    @property
    def place(self) -> str:
        """The parameters in words."""
        return " ".join(f"{one:g}" for one in self.z)


@dataclass(frozen=True)
class NearFits:
    """Where runs would help: fit without any effect, shots that it explains, and by how much (share).

    share: largest relative increase of a parameter's variance by the emulator's error, of these shots; linearised at
    the fit, prior included.
    """

    fit: Fit
    shots: tuple[str, ...]
    share: float

    @classmethod
    def of(cls, problem: Problem) -> NearFits:
        """Of the records; where a shot needs an effect, the bird of a fit without it is not the shot's."""
        bare = replace(problem, found=())
        fit = bare.refit(NOTHING, problem.start)
        explained = [s.name for s in problem.shots if s.baseline or _misfit(s, bare, fit) < MISFIT_WITHOUT_EFFECT]
        exact = replace(bare, options=replace(problem.options, emulator=False)).tested(NOTHING, fit.places)
        ratio = np.diag(fit.evidence.z_cov) / np.diag(exact.evidence.z_cov)
        k = len(problem.shots[0].setup.lows)
        own = [ratio[k * fit.system.names.index(name) :][:k].max() for name in explained]
        return cls(fit, tuple(explained), float(max([1.0, *own])) - 1.0)


def _misfit(shot: Shot, problem: Problem, fit: Fit) -> float:
    """What a fit without an effect leaves of a shot, over all errors."""
    return misfit(shot, predicted(shot, NOTHING, fit.places.z[shot.name], {}), problem, NOTHING, fit)


def with_runs(setup: Setup, problem: Problem, near: NearFits, count: int, seed: int, simulations: Simulations) -> Setup:
    """The setup with `count` runs more of its campaign near the fits of its shots; as it was where none finished."""
    own = {shot.name for shot in problem.shots if shot.setup is setup}
    near_own = [name for name in near.shots if name in own]
    if not near_own:
        return setup
    begin, rng = len(setup.plan.unit), np.random.default_rng([seed, len(setup.plan.unit)])
    points = setup.plan.unit
    for i in range(count):
        points = np.vstack([points, _nearby(setup, near.fit, near_own[i % len(near_own)], points, rng)])
    plan = setup.plan.with_points(points[begin:])
    runs = simulations.run({label: case for label, case in plan.campaign().items() if label not in setup.runs})
    if not runs:
        return setup
    return make_setup(plan, setup.measured, {**setup.runs, **runs}, setup.unpredictable)


def _nearby(setup: Setup, fit: Fit, name: str, points: Array, rng: np.random.Generator) -> Array:
    """(k,) of places within two standard deviations of a shot's fit, that which lies farthest from all points (n, k).

    Distances in standard deviations: there a few runs fill the small region of an answer (maximin design: Johnson,
    Moore & Ylvisaker, J. Stat. Plan. Inference 26 (1990) 131).
    """
    k = len(setup.lows)
    mean, _ = fit.interval(name, k)
    at = fit.system.names.index(name) * k
    root = np.linalg.cholesky(fit.evidence.z_cov[at : at + k, at : at + k] + 1e-12 * np.eye(k))
    factor: Array = np.diag(fit.system.priors[name].sd) @ root
    u = rng.standard_normal((CANDIDATES, k))
    u *= REACH * (rng.random((CANDIDATES, 1)) ** (1.0 / k) / np.linalg.norm(u, axis=1, keepdims=True))
    tried = np.round(np.clip(mean + u @ factor.T, setup.lows, setup.highs), DIGITS)
    apart = cdist(np.linalg.solve(factor, tried.T).T, np.linalg.solve(factor, points.T).T).min(axis=1)
    return tried[int(apart.argmax())]


def update(ranking: Ranking, simulations: Simulations) -> Problem:
    """The problem with new signatures; the same one where nothing was to be simulated."""
    problem = ranking.problem
    due = [one for wanted in wanted_effects(ranking) if not _known(one := _wanted(ranking, *wanted))]
    if not due:
        return problem
    first = list(dict.fromkeys(one.label for one in due))[:MOST]
    wanted = [one for one in due if one.label in first]
    runs = simulations.run({label: case for one in wanted for label, case in _cases(one).items()})
    problem = replace(problem, begin=ranking.fits[NONE].places)
    for setup in setups_of([one.shot for one in wanted]):
        changes = list(setup.changes)
        for one in wanted:
            if one.shot.setup is not setup:
                continue
            pairs = [(_there(one, i), _without(one, i)) for i in range(REPLICATES)]
            found = [
                np.subtract(*(stack(runs[label], setup.time, setup.channels) for label in pair))
                for pair in pairs
                if set(pair) <= runs.keys()
            ]
            if found:
                changes.append(Change(one.name, one.b, one.z, np.array(found)))
        problem = _on(problem, setup, replace(setup, changes=tuple(changes)))
    return problem


def _farther(response: Response, h: float) -> float:
    """A much larger magnitude, in plausible sizes, where a fit is at the limit or beyond a response that bends; else 0.

    A support's response tends to that of a free edge: nearby simulations would follow it in small steps. How far the
    magnitude's interval reaches hangs on how the response goes on beyond the fit.
    """
    sense = -1.0 if h < 0.0 else 1.0
    last = max((0.0, *(sense * b for b in response.simulated)))
    if response.known.one_sided and h >= 0.97 * response.limits[1]:
        return FARTHER * max(last, response.knots[-1][0])
    reached = sense * response.h(sense * last)
    if not last or not _bent(response, sense * last) or sense * h < sense * response.h(sense * (1.0 - NEAR) * last):
        return 0.0
    return sense * (FARTHER if sense * h > reached else BEYOND) * last


def _known(one: Wanted) -> bool:
    """Whether the effect was simulated by itself at nearly this magnitude, or at another one without bending.

    Of the same sense: a slope from 0 to a faster bird is not that to a slower one.
    """
    done = [b for b in one.response.simulated if b * one.b > 0.0]
    near = any(abs(b - one.b) <= NEAR * abs(one.b) for b in done)
    return near or (bool(done) and not any(_bent(one.response, b) for b in done))


def _bent(response: Response, b: float) -> bool:
    """Whether the response to b plausible sizes is clearly smaller than a linear one."""
    return abs(response.h(b)) < BENT * abs(b)


def _on(problem: Problem, old: Setup, new: Setup) -> Problem:
    """The problem on another setup in the place of the old one; shots of other setups keep theirs."""
    shots = tuple(replace(shot, setup=new) if shot.setup is old else shot for shot in problem.shots)
    return replace(problem, shots=shots, found=candidate_effects(shots))


def wanted_effects(ranking: Ranking) -> list[tuple[str, Shot]]:
    """Effects of the solver within reach of the best, each with a shot of every case in which it acts.

    Members of the likeliest pairs before, the others by how likely they are at best: an effect whose learnt signature
    is a little wrong looks less likely than it is until it has been simulated, and one that has been would win by that
    alone. An effect counts once in each case and sense.
    """
    if ranking.shares[NONE] > SURE:
        return []
    singles = ranking.singles
    score = {label: ranking.assessments[label].at_best for label, one in singles.items() if one.response}
    top = max(score.values())
    pairs = sorted((n for n, m in ranking.models.items() if len(m.members) == 2), key=lambda n: -ranking.shares[n])[:3]
    named = [one.label for n in pairs if ranking.shares[n] > 0.05 for one in ranking.models[n].members]
    near = max(WITHIN, within(top, ranking.evidence[NONE].log_evidence))
    order = [label for label in sorted(score, key=lambda n: -score[n]) if score[label] > top - near]
    found: dict[tuple[str, int, bool], tuple[str, Shot]] = {}
    for label in [*named, *order]:
        if singles[label].response:
            positive = bool(ranking.evidence[label].h[0] > 0.0)
            for shot in _one_of_each_case(ranking, singles[label]):
                found.setdefault((singles[label].name, id(shot.setup), positive), (label, shot))
    return list(found.values())


def _one_of_each_case(ranking: Ranking, one: CandidateEffect) -> list[Shot]:
    """The first shot of every case in which an effect acts."""
    first: dict[int, Shot] = {}
    for shot in ranking.problem.shots:
        if shot.name in one.shots:
            first.setdefault(id(shot.setup), shot)
    return list(first.values())


def _wanted(ranking: Ranking, label: str, shot: Shot) -> Wanted:
    """Magnitude and parameters at the fit of one effect, in a shot's case."""
    one, evidence = ranking.models[label].members[0], ranking.evidence[label]
    response = shot.setup.responses[one.name]
    fit = ranking.fits.get(label, ranking.fits[NONE])
    h = float(np.clip(evidence.h[0], *one.limits))
    h *= one.response_in(shot, h)[1]
    b = _farther(response, h) or response.b(h)
    low, high = levels(response.known)
    b = min(b, -min(LEAST_SIZE, -low)) if b < 0.0 else max(b, min(LEAST_SIZE, high))
    if not one.one_sided:
        b = max(b, 0.5 * response.known.least)
    return Wanted(label, shot, response, float(f"{b:.{DIGITS}g}"), _near(fit.places.z[shot.name], shot.setup))


def _near(z: Array, setup: Setup) -> Array:
    """The place of a grid over the ranges that is nearest to z (k,), inside the emulator's box."""
    return np.round(np.clip(PLACE * np.round(z / PLACE), setup.lows, setup.highs), DIGITS)


def _there(one: Wanted, replicate: int) -> str:
    """Label of a simulation with the effect."""
    return f"{one.shot.name}: {one.name} {one.b:g} there {replicate}"


def _without(one: Wanted, replicate: int) -> str:
    """Label of a simulation without effects, which those of one shot's case, one place and one mesh share."""
    particles = one.shot.setup.plan.block_of(one.name).base.bird.particles
    return f"{one.shot.name}: {one.place} of {particles} particles without {replicate}"


def _cases(one: Wanted) -> dict[str, Case]:
    """Replicates with the effect and without it, by label."""
    setup = one.shot.setup
    plan, cases, block = setup.plan, dict[str, Case](), setup.plan.block_of(one.name)
    for i in range(REPLICATES):
        z = np.clip(one.z + APART * (i - 0.5 * (REPLICATES - 1)), setup.lows, setup.highs)
        base = plan.on_lattice(block.base.with_values(plan.values(np.round(z, DIGITS))), len(block.signs) + i)
        cases[_without(one, i)] = base
        cases[_there(one, i)] = base.with_effects({**base.effects, one.name: one.b * one.response.known.size})
    return cases
