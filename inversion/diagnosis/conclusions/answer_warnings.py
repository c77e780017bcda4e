"""Warnings of an answer: what is wrong with its input, its fits or its attribution, what follows, and what to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from birdstrike.data.formatting import plain, quantity, span
from birdstrike.doe.solvers import simulated_by
from birdstrike.inversion.diagnosis.conclusions.answer import SIMULATION_SCATTER, curve_at, magnitude_of, outside_range
from birdstrike.inversion.diagnosis.conclusions.before_and_after import Held, misfit, predicts_better
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.diagnosis.preparation.discrepancy import STATED
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.diagnosis.preparation.shots import Shot, setups_of, unpredicted
from birdstrike.inversion.estimation.mesh_correction import shells_of_a_file, unrefined_file
from birdstrike.inversion.estimation.prior import conflicts
from birdstrike.inversion.labels import label_parts
from birdstrike.inversion.results.diagnosis import LEVEL, NONE
from birdstrike.solver.case.case import Case

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
        f"{chosen} is likeliest, but only by {ahead:.1f} in log evidence, which other simulations of the same "
        f"effects could move by {SIMULATION_SCATTER:g}: nothing is attributed; diagnose again with another "
        "--seed, add a shot or a sensor, and trust the name that stays"
    ]


def at_search_limit(ranking: Ranking, effect: str) -> list[str]:
    """A warning where the search for an effect's magnitude ended at the largest looked at."""
    if not magnitude_of(ranking, effect)[2]:
        return []
    if is_fault(ranking, effect):
        return [
            f"{effect}: the magnitude reaches the largest that was looked at, which is more than a sound instrument "
            "does, so that it is not attributed: a sensor that died, or something that is not in the library, looks "
            "like it; check the sensor, or leave it out (--channels)"
        ]
    return [
        f"{effect}: the magnitude reaches the largest that was looked at: the true one may be larger, and only the end "
        "of its interval towards 0 is known; or something that is not in the library looks like it; measure this "
        "quantity at the rig"
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
        f"{effect} is likeliest, but with it the residual is still {left:.2g} times all errors together: nothing is "
        "attributed; look at the curves for what it leaves"
    ]


def predicts_no_better(ranking: Ranking, effect: str, held: Mapping[str, Sequence[Held]]) -> list[str]:
    """A warning where the effect predicts what was held out no better than the model without it."""
    if predicts_better(ranking.models[effect].members[0], held[NONE], held[effect]):
        return []
    return [
        f"{effect} is likeliest, but it predicts what it was not fitted to (parts of the record, each sensor) no "
        "better than the model without it: nothing is attributed; add a shot, a sensor, or a baseline with the shot's "
        "own bird"
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
        f"with {effect} the held-out record is predicted worse than without it (its residual is {after.error:.2f} and "
        f"{before.error:.2f} times the errors that each model expects, its log density lower by "
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
