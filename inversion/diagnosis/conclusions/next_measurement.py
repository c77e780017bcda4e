"""The next measurement: the sensor, or the baseline, with the highest expected posterior probability of the truth.

For each model that may be true and each other, the squared distance of their curves with parameters and the other's
magnitude free (Box & Hill, Technometrics 9 (1967) 57). The record's curves are whitened by all of its errors, those of
a sensor that it lacks by noise, model error and the error of a quadratic fit to the campaign. A further sensor adds
information to every distance, so that it can never make the expected answer worse. No missing effect is one of the
models. Where the baselines are of another bird, which keeps every name from being attributed, a baseline of the shot's
own comes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.diagnosis.preparation.discrepancy import repeatability, shape_of, started
from birdstrike.inversion.diagnosis.preparation.plan import PREFIX
from birdstrike.inversion.diagnosis.preparation.setup import stack
from birdstrike.inversion.diagnosis.preparation.shots import Shot, responses_of
from birdstrike.inversion.labels import in_words, label_parts
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.sensor import Placed, Sensor

MOST, LEAST = 6, 0.01  # models compared; posterior probability below which a model is left out
NOISE = 0.005  # of its peak: noise of a sensor that nobody has bought yet
BASELINE = "baseline"  # candidate's name of a clean shot
CLEAN_SHOT = "a shot at the same rig in which nothing is changed, passed with --baseline"
OWN_BIRD = "a shot at the same rig with a bird of the record's own recipe, nothing changed, passed with --baseline"
LITTLE = 0.02  # of expected probability: a measurement that brings less is no advice
SURE = 0.95
"""Expected probability of the truth from which on sensors decide between models. Where they do not, all of these are
doubtful: expected is what a record would tell if one of them were the truth."""
POINTS = 60  # instants of a candidate
ALONE = 1e-6  # one minus the leverage of a run that alone determines a coefficient: no other run shows its error


@dataclass(frozen=True)
class Proposal:
    """channel: candidate's name; what: in words; expected, now: probability of the truth; candidates: best first.

    needed: why nothing is attributed without it; empty of a measurement that only tells more. likeliest: share of the
    likeliest of those compared, as the record has it.
    """

    channel: str
    separates: tuple[str, ...]
    expected: float
    now: float
    what: str
    candidates: tuple[Mapping[str, Any], ...] = field(default=())
    needed: str = ""
    likeliest: float = 1.0

    @property
    def sentence(self) -> str:
        """For the user."""
        if self.needed:
            return f"add {self.what}: {self.needed}"
        if self.expected - self.now < LITTLE and self.likeliest < SURE <= self.now:
            return (
                "no sensor that was compared would add much: if one of the likeliest models were right, these sensors "
                f"would tell which (expected probability {self.now:.2f}), and they do not; what is missing may be none "
                "of them, or simulations err by more than is taken: repeat with more particles and another --seed, and "
                "look for what the case does not describe"
            )
        if self.expected - self.now < LITTLE:
            return (
                f"no measurement that was compared would add much; the best, {self.what}, raises the expected "
                f"probability of the right model from {self.now:.2f} to {self.expected:.2f}"
            )
        models = "; ".join("no missing effect" if label == NONE else in_words(label) for label in self.separates)
        return (
            f"add {self.what}. Of the measurements compared it raises most the expected probability of the right model "
            f"(from {self.now:.2f} to {self.expected:.2f}) among: {models}"
        )


def propose(ranking: Ranking, shot: Shot, other_bird: bool = False) -> Proposal | None:
    """The best candidate; None where there are no two models or nothing to add.

    other_bird: whether the baselines' bird keeps every name from being attributed.
    """
    likely = sorted((n for n in (*ranking.seen, NONE) if ranking.shares[n] >= LEAST), key=lambda n: -ranking.shares[n])
    separates = tuple(likely[:MOST])
    compared = [label for label in separates if label != NONE]
    if not compared or (len(separates) < 2 and not other_bird):
        return None
    gram, columns = record_information(ranking.fits[NONE].tester, compared, _likeliest(ranking, compared))
    sizes = np.array([float(ranking.evidence[label].h[0]) for label in compared])
    weights = np.array([ranking.shares[label] for label in compared])
    none = ranking.shares[NONE] if NONE in separates else 0.0

    def chance(information: Array, r: int) -> float:
        return expected(information, r, sizes, weights, none)

    now = chance(gram, columns)
    sensors = _further_sensors(ranking, shot, compared)
    found = [(chance(gram + more, columns), name, what) for name, what, more in sensors]
    if not any(one.baseline for one in ranking.problem.shots):
        found.append((chance(*_beside_clean_shot(ranking, compared)), BASELINE, CLEAN_SHOT))
    found.sort(reverse=True)
    needed = ""
    if other_bird:
        found.insert(0, (max(chance(*_beside_own_bird(ranking, compared)), now), BASELINE, OWN_BIRD))
        needed = "beside a shot of another bird nothing is attributed, because model error changes with the bird"
    if not found:
        return None
    best, name, what = found[0]
    return Proposal(
        channel=name,
        separates=separates,
        expected=best,
        now=now,
        what=what,
        candidates=tuple({"channel": n, "expected_probability": p, "what": w} for p, n, w in found),
        needed=needed,
        likeliest=max(none, float(weights.max())) / (none + float(weights.sum())),
    )


def _further_sensors(ranking: Ranking, shot: Shot, compared: list[str]) -> Iterator[tuple[str, str, Array]]:
    """Sensors of the plan that no record has: name, in words, and their information in all shots together."""
    measured = ranking.problem.measured
    there = {name for one in measured for name in (*one.channels, *one.setup.unpredictable)}
    where = "one more sensor in every shot" if len(measured) > 1 else "one more sensor"
    for name, sensor in shot.setup.plan.coarse.sensors.items():
        if name in there or sensor.kind == "contact_force":
            continue
        own = [one for one in measured if name in one.setup.plan.coarse.sensors]
        more = [one for one in (sensor_information(ranking, s, name, compared) for s in own) if one is not None]
        if more:
            yield name, f"{where}, {described(name, sensor, shot.setup.plan.case)}", np.sum(more, axis=0)


def _likeliest(ranking: Ranking, compared: list[str]) -> int:
    """The combination of amplitudes that the likeliest of them has."""
    return int(ranking.evidence[compared[0]].weights.argmax())


def _beside_own_bird(ranking: Ranking, compared: list[str]) -> tuple[Array, int]:
    """As `record_information`, of the measured shots where a baseline shows all of the model error that they share."""
    problem, fit = ranking.problem, ranking.fits[NONE]
    known = replace(problem.known, fixed={**problem.known.fixed, **dict.fromkeys(problem.known.learnt, 0.0)})
    found = replace(problem, shots=problem.measured, known=known).tested(NOTHING, Places(fit.places.z, {}))
    return record_information(found.tester, compared, int(found.evidence.weights.argmax()))


def _beside_clean_shot(ranking: Ranking, compared: list[str]) -> tuple[Array, int]:
    """As `record_information`, beside a clean shot: the model error that it leaves is the scatter of repeated shots."""
    fit = ranking.fits[NONE]
    node = _likeliest(ranking, compared)
    now = fit.tester.combinations[node]
    left = np.minimum(now, [repeatability(kind) for kind in fit.tester.kinds])
    own = (float(fit.tester.unnamed[node]),)
    apart = (float(fit.tester.apart[node]),)
    tester = ModelTester(fit.system, ranking.problem.known, fit.tester.places, fit.tester.scale, left[None], own, apart)
    return record_information(tester, compared, 0)


def record_information(tester: ModelTester, compared: list[str], node: int) -> tuple[Array, int]:
    """(r + q, r + q) information of the record on parameters (prior included) and effects; r."""
    free, sizes = tester.free, tester.sizes(np.array([node]))[0]
    index = np.concatenate([free, [tester.system.at[label].start for label in compared]])
    scale = np.concatenate([sizes, np.ones(len(compared))])
    gram = scale[:, None] * tester.grams.node(node)[np.ix_(index, index)] * scale
    gram[: len(free), : len(free)] += np.eye(len(free))
    return gram, len(free)


def expected(gram: Array, r: int, sizes: Array, weights: Array, none: float = 0.0) -> float:
    """Expected posterior probability of the truth among those compared; weights, none: as likely as each is now.

    Where no effect is missing every effect explains the record as well; it loses by what it could have done (Occam
    factor: MacKay, Neural Comput. 4 (1992) 415) with a prior of one plausible size.
    """
    unlike = [_unexplained(gram, r, i, None) for i in range(len(sizes))]
    total = none / (1.0 + sum(1.0 / np.sqrt(1.0 + own) for own in unlike))
    for i, size in enumerate(sizes):
        left = [_unexplained(gram, r, i, j) for j in range(len(sizes)) if j != i] + ([unlike[i]] if none else [])
        total += weights[i] / (1.0 + sum(np.exp(-0.5 * own * size**2) for own in left))
    return float(total / (weights.sum() + none))


def _unexplained(gram: Array, r: int, i: int, other: int | None) -> float:
    """Information on effect i that parameters, and the other effect where there is one, cannot take up."""
    free = np.array([*range(r), *([] if other is None else [r + other])])
    cross = gram[r + i, free]
    inner = gram[np.ix_(free, free)] + 1e-9 * np.eye(len(free))
    return max(float(gram[r + i, r + i] - cross @ np.linalg.solve(inner, cross)), 0.0)


@dataclass(frozen=True)
class Candidate:
    """A sensor that a shot's record lacks, as the campaign shows it about the fit, SI.

    t: (m,) [s]; curve: (m,) at the fit; jacobian: (k, m) by fractions of the ranges; errors: (runs, m) of the fit to
    the campaign, each at a run that was left out of it; peak: of all runs.
    """

    shot: Shot
    name: str
    t: Array
    curve: Array
    jacobian: Array
    errors: Array
    peak: float

    @property
    def sensor(self) -> Sensor:
        """As the plan declares it."""
        return self.shot.setup.plan.coarse.sensors[self.name]


def candidate(ranking: Ranking, shot: Shot, name: str) -> Candidate:
    """A sensor in the runs of a shot's campaign, about the fit without an effect."""
    setup, z = shot.setup, ranking.fits[NONE].places.z[shot.name]
    done, t = setup.plan.finished(setup.runs), np.linspace(0.0, float(setup.time[-1]), POINTS)
    curves = np.array([stack(setup.runs[f"coarse {i}"], t, [name]) for i in done])
    return Candidate(shot, name, t, *quadratic(setup.plan.unit[done] - z, curves), peak=float(np.abs(curves).max()))


def quadratic(u: Array, curves: Array) -> tuple[Array, Array, Array]:
    """Second-order polynomial in u (n, k) through curves (n, m); first-order where that has as many terms as runs.

    Value (m,) and slopes (k, m) at u = 0, and the errors (n, m) at each run of a fit to the others: residual over one
    minus leverage (Allen, Technometrics 16 (1974) 125).
    """
    n, k = u.shape
    linear = [np.ones(n), *u.T]
    squares = [u[:, i] * u[:, j] for i in range(k) for j in range(i, k)]
    basis = np.column_stack([*linear, *(squares if n > len(linear) + len(squares) else [])])
    inverse = np.linalg.pinv(basis)
    coefficients, leverage = inverse @ curves, np.einsum("np,pn->n", basis, inverse)
    errors = (curves - basis @ coefficients) / np.maximum(1.0 - leverage, ALONE)[:, None]
    return coefficients[0], coefficients[1 : 1 + k], errors


def sensor_information(ranking: Ranking, shot: Shot, name: str, compared: list[str]) -> Array | None:
    """(r + q, r + q) that one more sensor in the shot adds; None where its curves are zero."""
    one, tester, node = candidate(ranking, shot, name), ranking.fits[NONE].tester, _likeliest(ranking, compared)
    if not one.peak:
        return None
    k, signatures = len(one.jacobian), slopes(shot, name, one.t)
    J = np.zeros((POINTS, len(tester.rotation)))
    at = tester.system.names.index(shot.name) * k
    J[:, at : at + k] = shot.setup.plan.prior.sd * one.jacobian.T
    J = J @ tester.rotation.T * tester.sizes(np.array([node]))[0, : J.shape[1]]
    G = [_response(ranking, one, label, signatures) for label in compared]
    X = np.column_stack([J, _unnamed(ranking, signatures, node), *G])
    amplitudes = dict(zip(tester.kinds, map(float, tester.combinations[node]), strict=True))
    return X.T @ np.linalg.solve(_error(one, amplitudes), X)


def _unnamed(ranking: Ranking, signatures: Mapping[str, Array], node: int) -> Array:
    """(t, q) unnamed errors and nuisances at a candidate, in the order of the system's columns.

    0 for other sensors' errors; the nuisances, whose size is stated, are taken as known there.
    """
    tester = ranking.fits[NONE].tester
    first, last = tester.system.at["unnamed"].start, tester.system.at["nuisance"].stop
    names = responses_of(ranking.problem.shots)
    own = np.array([signatures.get(name, np.zeros(POINTS)) for name in names]).reshape(len(names), POINTS).T
    return tester.unnamed[node] * np.hstack([own, np.zeros((POINTS, last - first - own.shape[1]))])


def _response(ranking: Ranking, at: Candidate, label: str, signatures: Mapping[str, Array]) -> Array:
    """(t,) a model's signature at the candidate for h = 1: instrument faults of the record's sensors leave it alone."""
    one, none = ranking.models[label].members[0], np.zeros(len(at.t))
    if at.shot.name not in one.shots:
        return none
    if one.response is None:
        clock = label_parts(label)[:2] == ("time_offset", "")
        return -one.size * np.gradient(at.curve, at.t) if clock else none
    return signatures.get(one.name, none)


def slopes(shot: Shot, name: str, t: Array) -> Mapping[str, Array]:
    """Effect -> (t,) signature at a sensor, one plausible size of each of the plan's effects; see `learn_responses`."""
    plan, runs = shot.setup.plan, shot.setup.runs
    found: dict[str, Array] = {}
    for block in plan.blocks:
        names, pairs = [known.name for known in block.known], block.finished(runs)
        if len(pairs) < len(names):
            found |= dict.fromkeys(names, np.zeros(len(t)))
            continue
        half = block.halves(pairs, lambda label: stack(runs[label], t, [name]))
        found |= dict(zip(names, np.linalg.lstsq(block.codes(pairs), half, rcond=None)[0], strict=True))
    return found


def _error(at: Candidate, amplitudes: Mapping[str, float]) -> Array:
    """(t, t) covariance of a candidate: noise, model error, and the error of the fit to the campaign.

    amplitudes: kind of the record's sensors -> likeliest amplitude of the discrepancy. The candidate's is as large, but
    not below what a baseline would leave.
    """
    setup, sensor, t = at.shot.setup, at.sensor, at.t
    fine = [i for i in setup.plan.fine_points() if f"fine {i}" in setup.runs and f"coarse {i}" in setup.runs]
    draws = np.array(
        [stack(setup.runs[f"fine {i}"], t, [at.name]) - stack(setup.runs[f"coarse {i}"], t, [at.name]) for i in fine]
    )
    shape = shape_of(draws, at.curve, t)
    size = max(repeatability(sensor.kind), amplitudes.get(sensor.kind, 0.0)) * at.peak * shape.growth
    kernel = started(t, t, at.shot.onset, shape.length)
    level = sensor.noise or NOISE * at.peak
    spacing = float(t[1] - t[0]) / max(float(np.median(np.diff(at.shot.record.traces[0].times))), 1e-12)
    emulator = at.errors.T @ at.errors / len(at.errors)
    return np.outer(size, size) * kernel + np.eye(len(t)) * level**2 / max(spacing, 1.0) + emulator


def described(name: str, sensor: Sensor, case: Case) -> str:
    """A sensor in words: its kind and place, and its name where the case declares it."""
    place = None if sensor.place is None else [1e3 * x for x in sensor.place]
    about = "the plate's centre" if case.mesh_file is None else "target.origin"
    where = "" if place is None else f" at {place[0]:.3g} mm along and {place[1]:.3g} mm across from {about}"
    if isinstance(sensor, Placed) and sensor.point is not None:
        where = f" at ({', '.join(f'{round(1e3 * x, 3) + 0.0:.3g}' for x in sensor.point)}) mm from {about}"
    declared = "" if name.startswith(PREFIX) else f" (the case's {name})"
    return f"{sensor.noun}{where}{declared}"
