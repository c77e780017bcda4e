"""Draws of everything that the new shot depends on: explanation, parameters, magnitudes, tolerances.

Rows of the stored posteriors are taken by a scrambled Sobol sequence through their standardised coordinates, so that a
few dozen of them fill the posterior evenly; what is drawn anew, and the tolerances, follow the same sequence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, qmc

from birdstrike.data.errors import UnitError, UserError
from birdstrike.data.histories import Array
from birdstrike.data.units import to_si
from birdstrike.inversion.prediction.carry_over import ANEW, DROPPED, Carried
from birdstrike.inversion.prediction.learnt import Explanation, Learnt
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.nuisances import case_nuisances
from birdstrike.solver.case.sections import quantity_at

FEWEST = 3  # simulations of an explanation, however unlikely: its effect must be seen to be weighed
EACH = 4  # simulations for each explanation
WIDEST = 3.0  # standard deviations of what is drawn anew, and of a tolerance
EFFECT = "effects."
EFFECT_OF = {
    "impact.speed": "impact_speed",
    "impact.angle": "impact_angle",
    "bird.mass": "bird_mass",
    "bird.density": "bird_mass",
    "plate.thickness": "plate_thickness",
}
"""Key -> the effect on the same quantity: where that is drawn anew, a stated tolerance takes its place."""
SECTIONS = ("bird", "impact", "plate", "target")
"""Of a case, whose quantities may have a tolerance."""


@dataclass(frozen=True)
class Tolerance:
    """A quantity of the new shot that is known within one standard deviation, SI.

    quantity: the effect on it, or its key where there is none: mass and density of a bird of one size are one quantity.
    """

    key: str
    value: float
    sigma: float
    unit: str
    quantity: str


@dataclass(frozen=True)
class Sample:
    """n draws.

    explanation: (n,) number of each; row: (n,) of its stored posterior; values: dotted key, or effects.NAME -> (n,) SI,
    NaN where the explanation has no such parameter; faults: label of an instrument's error -> (n,) SI; weights: (n,),
    of sum 1.
    """

    explanation: NDArray[np.int64]
    row: NDArray[np.int64]
    values: Mapping[str, Array]
    faults: Mapping[str, Array]
    weights: Array

    def __len__(self) -> int:
        return len(self.row)

    def column(self, key: str) -> Array:
        """(n,) values under a key; an effect that no draw holds is 0."""
        return self.values.get(key, _absent(key, len(self)))

    def at(self, i: int) -> dict[str, float]:
        """Values of one draw that its explanation has."""
        return {key: float(column[i]) for key, column in self.values.items() if np.isfinite(column[i])}

    def take(self, chosen: NDArray[np.int64]) -> Sample:
        """Some of the draws, equally weighted."""
        return Sample(
            self.explanation[chosen],
            self.row[chosen],
            {key: column[chosen] for key, column in self.values.items()},
            {key: column[chosen] for key, column in self.faults.items()},
            np.full(len(chosen), 1.0 / len(chosen)),
        )

    def fixed(self, values: Mapping[str, float]) -> Sample:
        """With some columns at one value each."""
        held = {key: np.full(len(self), value) for key, value in values.items()}
        return replace(self, values={**self.values, **held})


def tolerances_of(case: Case, given: Mapping[str, str], learnt: Learnt) -> dict[str, Tolerance]:
    """Those stated, over those of the case's `inversion.nuisance`; raises UserError with every one that is wrong."""
    stated = (Tolerance(n.key, n.value, n.sigma, _unit(n.key), _quantity(case, n.key)) for n in case_nuisances(case))
    declared = {one.quantity: one for one in stated}
    found, errors = dict[str, Tolerance](), list[str]()
    sought = {_quantity(case, name) for one in learnt.explanations for name in one.names}
    for key, text in given.items():
        mark, value, quantity = quantity_at(key), _value(case, key), _quantity(case, key)
        if (section := key.split(".")[0]) not in SECTIONS:
            errors.append(
                f"--tolerance {key}: {section} has no tolerance, only quantities of {', '.join(SECTIONS)} have; write "
                'impact.speed="1 m/s"'
            )
            continue
        if mark is None or value is None:
            errors.append(f'--tolerance {key}: it is no quantity that {case.name} states; write impact.speed="1 m/s"')
            continue
        try:
            sigma = to_si(text, mark.unit)
        except UnitError as error:
            errors.append(f'--tolerance {key}="{text}": {error}')
            continue
        if sigma < 0.0 or (value and sigma >= abs(value)):
            errors.append(
                f"--tolerance {key}: one standard deviation of {text} is below 0 or as large as the value itself; "
                "state it as a difference, not as the value"
            )
        if quantity in sought:
            errors.append(f"--tolerance {key}: {learnt.folder} has calibrated it, its posterior holds; leave it out")
        if quantity in found:
            errors.append(
                f"--tolerance {key} and {found[quantity].key} are one quantity ({quantity}); state one of them"
            )
        found[quantity] = Tolerance(key, value, sigma, mark.unit, quantity)
    if errors:
        raise UserError(errors)
    held = (one for name, one in (declared | found).items() if one.sigma > 0.0 and name not in sought)
    return {one.key: one for one in held}


def _quantity(case: Case, key: str) -> str:
    """The effect on the quantity under a dotted key, else the key itself."""
    if case.target is not None and key == f"target.parts.{case.target.struck_name}.thickness":
        return EFFECT_OF["plate.thickness"]
    if key == "bird.density" and None not in (case.bird.mass, case.bird.density):  # from both the size follows
        return key
    return EFFECT_OF.get(key, key)


def _unit(key: str) -> str:
    mark = quantity_at(key)
    return mark.unit if mark is not None else ""


def _value(case: Case, key: str) -> float | None:
    """What a case states under a dotted key, SI."""
    if key == "bird.mass":
        return case.bird.actual_mass
    if key == "bird.density":
        return case.bird.actual_density
    place: object = case
    for part in key.split("."):
        place = place.get(part) if isinstance(place, Mapping) else getattr(place, part, None)
    return float(place) if isinstance(place, int | float) and not isinstance(place, bool) else None


def shares_of(explanations: Sequence[Explanation], count: int, fewest: int = 0) -> list[int]:
    """Draws of each explanation: `fewest`, and the rest of `count` by its probability."""
    rest = max(count - fewest * len(explanations), 0)
    wanted = np.array([one.probability for one in explanations]) * rest
    found = np.floor(wanted).astype(int)
    for i in np.argsort(found - wanted)[: max(rest - int(found.sum()), 0)]:
        found[i] += 1
    return [int(n) + fewest for n in found]


def affordable(learnt: Learnt, budget: int) -> Learnt:
    """What was learnt, of the likeliest explanations for which the simulations suffice, four of them for each.

    The probability of the others is shared out, and the user told.
    """
    likely = sorted((one for one in learnt.explanations if one.probability > 0.0), key=lambda one: -one.probability)
    kept, rest = likely[: max(budget // EACH, 1)], likely[max(budget // EACH, 1) :]
    whole = sum(one.probability for one in kept)
    scaled = tuple(replace(one, probability=one.probability / whole) for one in kept)
    lost = sum(one.probability for one in rest)
    if not rest:
        return replace(learnt, explanations=scaled)
    alone = f"the likeliest {len(kept)}" if len(kept) > 1 else "the likeliest"
    text = (
        f"the bands rest on {alone} of {len(likely)} explanations; the others, with {100.0 * lost:.2g} % of the "
        f"probability, need more simulations than were allowed: --budget {EACH * len(likely)} takes all"
    )
    return replace(learnt, explanations=scaled, warnings=(*learnt.warnings, text))


def draw(
    learnt: Learnt,
    carried: Mapping[str, Carried],
    tolerances: Mapping[str, Tolerance],
    counts: Sequence[int],
    seed: int,
) -> Sample:
    """So many draws of each explanation, weighted by its probability."""
    parts = [
        _of_one(one, i, carried, tolerances, n, seed + i)
        for i, (one, n) in enumerate(zip(learnt.explanations, counts, strict=True))
        if n
    ]
    weights = [learnt.explanations[int(p.explanation[0])].probability / len(p) * np.ones(len(p)) for p in parts]
    keys = dict.fromkeys(key for part in parts for key in part.values)
    labels = dict.fromkeys(label for part in parts for label in part.faults)
    whole = np.concatenate(weights)
    return Sample(
        np.concatenate([part.explanation for part in parts]),
        np.concatenate([part.row for part in parts]),
        {key: np.concatenate([part.values.get(key, _absent(key, len(part))) for part in parts]) for key in keys},
        {name: np.concatenate([part.faults.get(name, np.zeros(len(part))) for part in parts]) for name in labels},
        whole / whole.sum(),
    )


def _absent(key: str, n: int) -> Array:
    """An effect that an explanation does not hold is 0; a parameter that it does not have is none."""
    return np.full(n, 0.0 if key.startswith(EFFECT) else np.nan)


def _of_one(
    one: Explanation,
    number: int,
    carried: Mapping[str, Carried],
    tolerances: Mapping[str, Tolerance],
    n: int,
    seed: int,
) -> Sample:
    coordinates = _standardised(np.hstack([one.parameters, one.magnitudes]))
    anew = [label for label in one.members if carried[label].how == ANEW]
    stated = {tolerance.quantity for tolerance in tolerances.values()}
    normals = _normals(n, coordinates.shape[1] + len(anew) + len(tolerances), seed)
    rows = _rows(coordinates, normals[:, : coordinates.shape[1]])
    rest = iter(normals[:, coordinates.shape[1] :].T)
    values: dict[str, Array] = {name: one.parameters[rows, j] for j, name in enumerate(one.names)}
    faults: dict[str, Array] = {}
    for j, label in enumerate(one.members):
        own = carried[label]
        size = one.magnitudes[rows, j]
        if own.how == ANEW:
            size = own.size * next(rest)
            size = np.abs(size) if own.one_sided else size
        if own.how == DROPPED or (own.how == ANEW and own.name in stated):
            continue
        if own.sensors:
            faults[label] = size
        else:
            values[EFFECT + own.name] = values.get(EFFECT + own.name, np.zeros(n)) + size
    for key, tolerance in tolerances.items():
        values[key] = _reflected(key, tolerance.value + tolerance.sigma * next(rest))
    return Sample(np.full(n, number), rows, values, faults, np.full(n, 1.0 / n))


def _reflected(key: str, values: Array) -> Array:
    """Values beyond an end of a quantity's range mirrored at it: 91 deg from the plate are 89 deg."""
    mark = quantity_at(key)
    if mark is None:
        return values
    low, high = mark.bounds
    return np.where(values > high, 2.0 * high - values, np.where(values < low, 2.0 * low - values, values))


def _standardised(columns: Array) -> Array:
    """Coordinates of unit variance, uncorrelated: those of no spread are left out."""
    centred = columns - columns.mean(axis=0)
    sd = centred.std(axis=0)
    scaled = centred[:, sd > 0.0] / sd[sd > 0.0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return u[:, s > 1e-6 * s[0]] * np.sqrt(len(columns))


def _normals(n: int, dimensions: int, seed: int) -> Array:
    """(n, dimensions) of a scrambled Sobol sequence through normal distributions, cut at three standard deviations."""
    if not dimensions:
        return np.zeros((n, 0))
    unit = qmc.Sobol(dimensions, rng=seed).random_base2(int(np.ceil(np.log2(max(n, 2)))))[:n]
    return np.clip(norm.ppf(np.clip(unit, 1e-6, 1.0 - 1e-6)), -WIDEST, WIDEST)


def _rows(coordinates: Array, wanted: Array) -> NDArray[np.int64]:
    """Rows nearest to the wanted points, each taken once before any is taken again."""
    if not coordinates.shape[1]:
        return np.arange(len(wanted)) % len(coordinates)
    found, free = np.zeros(len(wanted), dtype=np.int64), np.ones(len(coordinates), dtype=bool)
    for i, point in enumerate(wanted):
        if not free.any():
            free[:] = True
        left = np.flatnonzero(free)
        found[i] = left[((coordinates[left] - point) ** 2).sum(axis=1).argmin()]
        free[found[i]] = False
    return found
