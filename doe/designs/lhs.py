"""Latin hypercube: each of n equal slices of every range holds one run, at random within it and otherwise."""

from __future__ import annotations

from scipy.stats import qmc

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.design import DesignKind


def latin_hypercube(runs: int, columns: int, seed: int, progress: Progress = silent) -> Array:  # noqa: ARG001
    """(runs, columns) in 0..1 (M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239)."""
    return qmc.LatinHypercube(columns, rng=seed).random(runs)


LHS = DesignKind("lhs", latin_hypercube)
