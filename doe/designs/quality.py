"""Quality of a design: rank, condition and correlation of its columns, and how evenly it fills the parameter space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
from scipy.spatial import KDTree
from scipy.stats import qmc

from birdstrike.data.formatting import key_labels
from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace

RANK_TOLERANCE = 1e-3
"""A direction counts when its singular value is above this share of the largest.

Columns are fractions of the ranges. Rounding in a table moves a singular value by 1e-4 or less of the largest, while
a design that varies a parameter over a hundredth of its range still counts as varying it.
"""

RANDOM_DESIGNS, RANKED_RUNS = 400, 300
"""Designs among which a percentile is taken, and the most runs for which that is worth its time (about 2 s there)."""

MEASURED_RUNS = 10_000
"""The most runs of which a discrepancy is taken: its cost grows with their square, some seconds there."""

RANDOM_SEED = 0
"""Of these designs: the same for every call, so that percentiles can be compared."""


@dataclass(frozen=True)
class Quality:
    """Quality of a design of `runs` runs in `parameters` parameters.

    singular_values: (min(n, k),) of the centred matrix, columns in fractions of the ranges, descending; rank: how many
    exceed RANK_TOLERANCE of the largest; condition: largest over smallest, inf where the rank is deficient;
    max_correlation: largest absolute correlation of two columns that vary; discrepancy, wraparound: squared centred and
    wrap-around L2 discrepancy, None where runs lie outside the box or are more than MEASURED_RUNS; percentile,
    wraparound_percentile: share in % of random designs (independent runs, uniform in the box) that are lower, None
    where not asked; min_distance: smallest distance of two runs in the unit box; sentence: the finding in words.
    """

    runs: int
    parameters: int
    rank: int
    condition: float
    max_correlation: float
    discrepancy: float | None
    singular_values: Array
    sentence: str
    wraparound: float | None = None
    percentile: float | None = None
    wraparound_percentile: float | None = None
    min_distance: float = 0.0

    @property
    def deficient(self) -> bool:
        """Some combination of the parameters does not vary: they cannot be estimated separately."""
        return self.rank < self.parameters

    def as_json(self) -> dict[str, Any]:
        """For `summary.json`: null where a figure does not exist."""
        return {
            "rank": self.rank,
            "parameters": self.parameters,
            "condition": self.condition if np.isfinite(self.condition) else None,
            "max_correlation": self.max_correlation,
            "discrepancy": self.discrepancy,
            "discrepancy_percentile": self.percentile,
            "wraparound_discrepancy": self.wraparound,
            "wraparound_percentile": self.wraparound_percentile,
            "min_distance": self.min_distance,
            "singular_values": [float(s) for s in self.singular_values],
            "deficient": self.deficient,
            "sentence": self.sentence,
        }


def design_quality(unit: Array, names: Sequence[str] | None = None, ranked: bool = False) -> Quality:
    """Quality of a design (n, k) in fractions of the ranges; `names` (k) are for the sentence.

    ranked: with the percentiles among random designs, for designs of at most RANKED_RUNS.
    """
    n, k = unit.shape
    _, singular, directions = np.linalg.svd(unit - unit.mean(axis=0), full_matrices=False)
    centred, wrapped = _discrepancy(unit, "CD"), _discrepancy(unit, "WD")
    ranked = ranked and n <= RANKED_RUNS
    rank = int(np.sum(singular > RANK_TOLERANCE * singular[0])) if singular[0] > 1e-12 else 0
    return Quality(
        runs=n,
        parameters=k,
        rank=rank,
        condition=float(singular[0] / singular[-1]) if rank == k else float("inf"),
        max_correlation=_largest_correlation(unit),
        discrepancy=centred,
        singular_values=singular,
        wraparound=wrapped,
        percentile=_percentile(centred, (n, k), "CD") if ranked else None,
        wraparound_percentile=_percentile(wrapped, (n, k), "WD") if ranked else None,
        min_distance=float(KDTree(unit).query(unit, k=2)[0][:, 1].min()) if n > 1 else 0.0,
        sentence=_sentence(n, rank, directions[:rank], names or [f"parameter {j + 1}" for j in range(k)]),
    )


def weakest_quality(unit: Array, space: ParameterSpace, ranked: bool = False) -> tuple[Quality, ParameterSpace]:
    """Quality of a design (n, k) in fractions of the ranges in their scales, and the space of that quality.

    A line of runs carries its parameters no more separately where it is straight in linear fractions of a logarithmic
    range: the scale in which the rank is lower counts.
    """
    found = [(design_quality(unit, space.names, ranked), space)]
    if space.logarithmic.any():
        linear = replace(space, scales=())
        found.append((design_quality(linear.to_unit(space.to_physical(unit)), space.names, ranked), linear))
    return min(found, key=lambda one: one[0].rank)


def cd2(unit: Array) -> float:
    """Squared centred L2 discrepancy of points (n, k) in 0..1."""
    return float(qmc.discrepancy(unit, method="CD"))


def _largest_correlation(unit: Array) -> float:
    """Largest absolute correlation between two columns; a constant column has none."""
    varying = unit[:, np.ptp(unit, axis=0) > 1e-12]
    if varying.shape[1] < 2:
        return 0.0
    correlation = np.abs(np.corrcoef(varying, rowvar=False))
    return float(min(correlation[np.triu_indices_from(correlation, k=1)].max(), 1.0))


def _discrepancy(unit: Array, method: Literal["CD", "WD"]) -> float | None:
    """Squared discrepancy as scipy defines it; None where a run lies outside the box, or of too many runs."""
    if len(unit) > MEASURED_RUNS or np.any((unit < -1e-9) | (unit > 1.0 + 1e-9)):
        return None
    return float(qmc.discrepancy(np.clip(unit, 0.0, 1.0), method=method))


def _percentile(value: float | None, shape: tuple[int, int], method: Literal["CD", "WD"]) -> float | None:
    """Share [%] of random designs of that shape whose discrepancy is lower."""
    return None if value is None else float(100.0 * np.mean(_random_discrepancies(shape, method) < value))


@cache
def _random_discrepancies(shape: tuple[int, int], method: Literal["CD", "WD"]) -> Array:
    """Of RANDOM_DESIGNS designs, always the same."""
    rng = np.random.default_rng(RANDOM_SEED)
    return np.array([qmc.discrepancy(rng.random(shape), method=method) for _ in range(RANDOM_DESIGNS)])


def _sentence(runs: int, rank: int, directions: Array, names: Sequence[str]) -> str:
    k = len(names)
    if rank == k:
        return f"the {runs} runs carry {'the one parameter' if k == 1 else f'all {k} parameters'} separately"
    if rank == 0:
        return f"rank 0 of {k}: the runs do not differ, so that nothing can be estimated from them"
    carried = "; ".join(_direction(row, names) for row in directions)
    plural = "direction" if rank == 1 else "directions"
    return (
        f"rank {rank} of {k}: the {runs} runs vary along {rank} {plural} only ({carried}; in fractions of the ranges), "
        f"so that {k} separate estimates cannot come from them; use --design uniform with at least {k + 1} runs "
        "that are smooth (keep nearly all of the bird)"
    )


def _direction(direction: Array, names: Sequence[str]) -> str:
    """The parts of a unit vector that matter, the largest made positive: "+0.71 viscosity -0.71 tension_erosion"."""
    signed = direction * np.sign(direction[np.argmax(np.abs(direction))])
    labels = key_labels(names)
    return " ".join(f"{c:+.2f} {labels[name]}" for c, name in zip(signed, names, strict=True) if abs(c) >= 0.05)
