"""Before and after: residuals of the model, by its fits, by data held out of them, and by the solver at the fits.

Held out: each sensor, a block of time and each shot in turn is predicted by fits to the rest. The solver runs the case
as declared, with the fitted parameters and effects written into it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import CaseError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.units import quantity_text
from birdstrike.doe.campaign.simulations import Simulations
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.ranking import Fit, Problem, each
from birdstrike.inversion.diagnosis.inference.system import build
from birdstrike.inversion.diagnosis.preparation.setup import stack
from birdstrike.inversion.diagnosis.preparation.shots import LATEST_SHIFT, Record, Shot, beside_declared, with_faults
from birdstrike.inversion.labels import label_parts
from birdstrike.inversion.misfit import rms
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.registry import effect_named

BLOCK = (0.45, 0.75)  # of the record: a stretch behind the peak, long beside the discrepancy's correlation time
FEWEST = 5  # points left in a channel


@dataclass(frozen=True)
class Held:
    """One part held out: name (time_block, `channel <name>`, `shot <name>`), whitened RMS of its prediction.

    score: mean logarithm of a point's predictive density, but for a constant; error: 1 where the model errs as much as
    it says. shot: of which it is a part; a further record (`--heldout`) counts to the first shot, whose case it has.
    """

    name: str
    error: float
    score: float
    shot: str = ""

    @classmethod
    def of(cls, name: str, residual: Array, sd: Array, shot: str) -> Held:
        """From residuals (n,) and the standard deviations (n,) that the model gives them."""
        squared = (residual / sd) ** 2
        return cls(name, float(np.sqrt(squared.mean())), -float(np.mean(0.5 * squared + np.log(sd))), shot)


def hold_out(problem: Problem, hypothesis: Hypothesis, fit: Fit, alike: bool) -> list[Held]:
    """Every part of the measured shots, predicted by the model refitted (linearly, about its fit) to the rest.

    Beside it stands what the other shots' residuals tell of the shot's; it is of the whole fit, once for all parts.

    alike: whether the birds are; where they are not, no shot tells of the bird of another, and none is held out whole.
    """

    def predicted_part(part: tuple[str, tuple[Shot, ...], tuple[Shot, np.ndarray]]) -> Held:
        name, kept, (shot, points) = part
        mean, sd = expected[shot.name]
        residual = _residual(problem, hypothesis, fit, kept, shot) - mean
        return Held.of(name, residual[points], sd[points], shot.name)

    expected = {
        shot.name: expected_residual(shot, problem, hypothesis, fit, [one for one in problem.shots if one is not shot])
        for shot in problem.shots
        if not shot.baseline
    }
    return each(predicted_part, parts(problem.shots, alike))


def parts(shots: Sequence[Shot], alike: bool) -> list[tuple[str, tuple[Shot, ...], tuple[Shot, np.ndarray]]]:
    """(name, shots that are fitted, (shot, points that are predicted)); alike: of `hold_out`."""
    measured = [shot for shot in shots if not shot.baseline]
    found = []
    for shot in measured:
        suffix = f" of {shot.name}" if len(measured) > 1 else ""
        inside = _block(shot)
        if inside.sum() >= FEWEST:
            found.append((f"time_block{suffix}", _with(shots, shot, masked(shot, ~inside)), (shot, inside)))
        if len(shot.channels) > 1:
            for i, channel in enumerate(shot.channels):
                of = shot.record.channel == i
                found.append((f"channel {channel}{suffix}", _with(shots, shot, masked(shot, ~of)), (shot, of)))
    if len(measured) > 1 and alike:
        for shot in measured:
            rest = tuple(one for one in shots if one is not shot)
            found.append((f"shot {shot.name}", rest, (shot, np.ones(len(shot.record.values), dtype=bool))))
    return found


def _block(shot: Shot) -> np.ndarray:
    """(n,) which points lie in the stretch of time that is held out; of a record that ends in it, of its own time."""
    end, last = float(shot.setup.time[-1]), max(float(trace.times[-1]) for trace in shot.record.traces)
    end = last if last < BLOCK[1] * end else end
    return (shot.record.middle > BLOCK[0] * end) & (shot.record.middle < BLOCK[1] * end)


def _with(shots: Sequence[Shot], old: Shot, new: Shot) -> tuple[Shot, ...]:
    return tuple(new if one is old else one for one in shots)


def masked(shot: Shot, keep: np.ndarray) -> Shot:
    """The shot with some of its points; channels with fewer than a handful left are dropped."""
    traces = []
    for i, trace in enumerate(shot.record.traces):
        own = keep[shot.record.channel == i]
        if own.sum() < FEWEST:
            continue
        raw = np.repeat(own, trace.block)
        traces.append(replace(trace, times=trace.times[raw], values=trace.values[own], noise=trace.noise.at(raw)))
    return replace(shot, record=Record(tuple(traces), shot.record.warnings))


def _residual(problem: Problem, hypothesis: Hypothesis, fit: Fit, kept: tuple[Shot, ...], shot: Shot) -> Array:
    """(n,) residual of a shot by the fit to what is kept; a shot that is not among that has the others' mean bird."""
    kinds = {kind for shot in kept for kind in shot.kinds}
    known = problem.known.only(kinds)
    found = problem.found
    members = tuple(one for one in hypothesis.members if any(shot.name in one.shots for shot in kept))
    places = replace(fit.places, h={one.label: fit.places.h.get(one.label, 0.0) for one in members})
    system = build(kept, found, places, known, problem.shapes, problem.options)
    tester = ModelTester(system, known, places.h, problem.scale, apart=problem.apart)
    model = replace(hypothesis, members=members)
    evidence = tester.model(model, [places.h[one.label] for one in members] if members else None)
    k = len(shot.setup.lows)
    birds = {one.name: evidence.z[system.names.index(one.name) * k :][:k] for one in kept if not one.baseline}
    bird = birds[shot.name] if shot.name in birds else np.mean(list(birds.values()), axis=0)
    z = np.clip(shot.setup.plan.prior.place(bird), shot.setup.lows, shot.setup.highs)
    sizes = {one.label: float(h) for one, h in zip(members, evidence.h, strict=True)}
    return shot.record.values - predicted(shot, hypothesis, z, sizes)


def unpredicted_parts(effect: CandidateEffect) -> set[str]:
    """Held-out parts that hold all that an effect acts on, the sensor of a fault or the shot of an effect of one shot.

    The rest does not determine its magnitude, so that a model with it predicts nothing there.
    """
    found = {f"shot {effect.shots[0]}"} if len(effect.shots) == 1 else set[str]()
    if effect.fault is not None and len(effect.fault.sensors) == 1:
        found.add(f"channel {effect.fault.sensors[0]}")
    return found


def predicted_parts(effect: CandidateEffect, held: Sequence[Held]) -> list[Held]:
    """The held-out parts that an effect's model predicts."""
    unpredicted = unpredicted_parts(effect)
    return [one for one in held if one.name.removesuffix(f" of {one.shot}") not in unpredicted]


def predicts_better(effect: CandidateEffect, before: Sequence[Held], after: Sequence[Held]) -> bool:
    """Whether an effect makes what was held out likelier, over the parts that its model predicts.

    Evidence is of the data that were fitted, and depends on the model error about each fit; a real effect predicts what
    it has not seen (cross-validation: Stone, J. R. Statist. Soc. B 36 (1974) 111). By the logarithmic score, which is
    proper (Gneiting & Raftery, J. Am. Stat. Assoc. 102 (2007) 359): a model that overstates its errors has small ones
    by its own measure.
    """
    pairs = list(zip(predicted_parts(effect, before), predicted_parts(effect, after), strict=True))
    return sum(a.score for _, a in pairs) > sum(b.score for b, _ in pairs) or not pairs


def estimate(shot: Shot, hypothesis: Hypothesis, fit: Fit) -> tuple[Array, dict[str, float]]:
    """(k,) fractions of the ranges and size h by label, as the answer states them: the posterior means, inside the
    emulator's box and the effects' limits; the place about which the fit is linear may lie a step beside.
    """
    mean, _ = fit.interval(shot.name, len(shot.setup.lows))
    sizes = zip(hypothesis.members, fit.evidence.h, strict=True)
    return np.clip(mean, shot.setup.lows, shot.setup.highs), {
        one.label: float(np.clip(h, *one.limits)) for one, h in sizes
    }


def predicted(shot: Shot, hypothesis: Hypothesis, z: Array, sizes: dict[str, float]) -> Array:
    """(n,) the model's curve at z with effects of sizes h."""
    grid = shot.setup.grid(z[None])[0]
    curve = shot.sample(grid[None])[0]
    for one in hypothesis.members:
        h = sizes.get(one.label, 0.0)
        if shot.name not in one.shots or not h:
            continue
        if one.fault is not None:
            curve = curve + shot.instrument_change(one.fault, grid, h)
        else:
            curve = curve + h * one.change_in(shot, z, h)
    return curve


def misfit(shot: Shot, curve: Array, problem: Problem, model: Hypothesis, fit: Fit) -> float:
    """RMS of what a model's curve (n,) leaves of a shot's record, less what is expected, over all errors."""
    mean, sd = expected_residual(shot, problem, model, fit)
    return rms((shot.record.values - curve - mean) / sd)


def expected_residual(
    shot: Shot, problem: Problem, model: Hypothesis, fit: Fit, others: Sequence[Shot] | None = None
) -> tuple[Array, Array]:
    """(n,) mean and standard deviation of a measured shot's residual where the model is right, SI.

    Noise, numerical error and discrepancy at the likeliest amplitudes; what the residuals of others, by default of the
    baselines, tell of the shot's is its mean, and no part of its spread (conditional normal distribution).
    """
    system, evidence, columns = fit.system, fit.evidence, fit.tester.columns
    node = int(evidence.weights.argmax())
    J, unnamed = columns[:, system.at["J"]], fit.tester.unnamed[node] * columns[:, system.at["unnamed"]]
    stated = columns[:, system.at["nuisance"]]
    left = columns[:, 0] - J @ fit.tester.rotation @ evidence.z[: J.shape[1]]
    for one, size in zip(model.members, evidence.h, strict=True):
        left = left - size * columns[:, system.at[one.label].start]
    whole = unnamed @ unnamed.T + stated @ stated.T
    amplitudes = fit.tester.combinations[node]
    for block, amplitude in zip(system.blocks, amplitudes, strict=True):
        whole[np.ix_(block.rows, block.rows)] += block.F + amplitude**2 * block.U
    seen = [one for one in problem.shots if one.baseline] if others is None else others
    known, own = _rows(problem.shots, [one.name for one in seen]), _rows(problem.shots, [shot.name])
    gain = np.linalg.solve(whole[np.ix_(known, known)], whole[np.ix_(known, own)])
    covariance = whole[np.ix_(own, own)] - whole[np.ix_(own, known)] @ gain
    noise = system.noise[np.ix_(own, own)]
    return noise @ (gain.T @ left[known]), np.sqrt(np.einsum("ij,jk,ik->i", noise, covariance, noise))


def _rows(shots: Sequence[Shot], names: Sequence[str]) -> NDArray[np.intp]:
    """Numbers of the points of some shots among those of all."""
    return np.flatnonzero(np.repeat([one.name in names for one in shots], [len(one.record.values) for one in shots]))


@dataclass(frozen=True)
class SolverRun:
    """One run at a fit. case: what was run; curve: (n,) SI on the record's points."""

    case: Case
    curve: Array


def case_at(shot: Shot, fit: Fit, hypothesis: Hypothesis) -> Case:
    """The declared case with the parameters and effects that the answer states."""
    plan, (z, sizes) = shot.setup.plan, estimate(shot, hypothesis, fit)
    acting = [(one, one.magnitude(sizes[one.label])) for one in hypothesis.members if shot.name in one.shots]
    return case_with(plan.case.with_values(plan.values(z)), acting)


def case_with(case: Case, acting: Sequence[tuple[CandidateEffect, float]]) -> Case:
    """The case with effects of magnitudes [SI] beside those that it declares; what is not finite is left out.

    None is smaller than the least that means anything, which a fit at that limit may miss by rounding.
    """
    faults, common = list[tuple[str, str, float]](), dict[str, float]()
    for one, found in acting:
        value = found if one.fault is None else max(found, one.fault.least * one.fault.size)
        if one.fault is not None and one.label.split("@")[0] != one.name:
            faults.append((one.fault.sensors[0], one.name, value))
        elif np.isfinite(value) and value:
            common[one.name] = max(beside_declared(case, one.name, value), effect_named(one.name).least(case))
    acted = with_faults(case.with_effects({**case.effects, **common}) if common else case, faults)
    return _long_enough(acted, _earliest(case))


def _long_enough(case: Case, declared: float) -> Case:
    """The case simulated until what its earliest instrument reads at the record's end.

    The record ends `LATEST_SHIFT` before the simulation; an instrument that is earlier than that, and than the declared
    one, would repeat its last reading there, where the fitted curve goes on.
    """
    earliest = _earliest(case)
    if earliest >= min(declared, -LATEST_SHIFT):
        return case
    return case.overlaid({"time": {"end": quantity_text(case.time.end - earliest - LATEST_SHIFT, "s")}})


def _earliest(case: Case) -> float:
    """Least offset of the case's instruments [s], 0 where none is early."""
    return min((own.time_offset for own in case.instrument.values()), default=0.0)


def run_at(
    wanted: Mapping[str, tuple[Shot, Fit, Hypothesis]], simulations: Simulations
) -> tuple[dict[str, SolverRun], dict[str, str]]:
    """Runs by label, and why the others failed: their simulation, or a fit that no case can state."""
    cases, failed = dict[str, Case](), dict[str, str]()
    for label, one in wanted.items():
        try:
            cases[label] = case_at(*one)
        except CaseError as error:
            failed[label] = "; ".join(error.errors)
    runs = simulations.run(cases)
    found = {label: SolverRun(cases[label], carried(wanted[label][0], histories)) for label, histories in runs.items()}
    return found, failed | {label: simulations.failures[label] for label in cases if label not in runs}


def carried(shot: Shot, histories: Histories) -> Array:
    """(n,) a run's curve on the record's points."""
    return shot.sample(stack(histories, shot.setup.time, shot.setup.channels)[None])[0]


def rms_by_channel(shot: Shot, residual: Array) -> dict[str, float]:
    """channel -> RMS of a residual (n,), SI."""
    return {trace.name: rms(residual[shot.record.channel == i]) for i, trace in enumerate(shot.record.traces)}


def other_record(problem: Problem, model: Hypothesis, fit: Fit, heldout: Shot, first: Shot) -> Held:
    """A record of the first shot's case that nothing was fitted to, predicted with the first shot's parameters.

    It has the effects of the rig and its instruments that the first shot has, and none that a single one of several
    shots has for itself. The first shot's setup is its own, with the responses that were simulated at the fits.
    """
    heldout = replace(heldout, setup=first.setup)
    members = tuple(
        replace(one, shots=(heldout.name,) if first.name in one.shots and not label_parts(one.label)[2] else ())
        for one in model.members
    )
    curve = predicted(heldout, replace(model, members=members), *estimate(first, model, fit))
    mean, model_variance = _at_points_of(heldout, first, *_model_error(first, problem, model, fit))
    sd = np.sqrt(model_variance + np.diag(heldout.record.covariance()))
    return Held.of("shot", heldout.record.values - curve - mean, sd, first.name)


def _model_error(first: Shot, problem: Problem, model: Hypothesis, fit: Fit) -> tuple[Array, Array]:
    """(n,) mean and variance of a shot's residual less the noise of its own record, which no other one has."""
    mean, sd = expected_residual(first, problem, model, fit)
    return mean, np.maximum(sd**2 - np.diag(first.record.covariance()), 0.0)


def _at_points_of(heldout: Shot, first: Shot, *columns: Array) -> list[Array]:
    """Columns (n,) over the points of a shot's record, linear between them, at those of another record."""
    found: list[Array] = [np.empty(len(heldout.record.values)) for _ in columns]
    for i, trace in enumerate(heldout.record.traces):
        of, own = first.record.channel == first.channels.index(trace.name), heldout.record.channel == i
        for column, values in zip(found, columns, strict=True):
            column[own] = np.interp(trace.middle, first.record.middle[of], values[of])
    return found
