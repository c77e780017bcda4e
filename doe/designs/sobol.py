"""Scrambled Sobol sequence: a longer design begins with the rows of the shorter one."""

from __future__ import annotations

import warnings

from scipy.stats import qmc

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.design import DesignKind


def sobol_design(runs: int, columns: int, seed: int, progress: Progress = silent) -> Array:  # noqa: ARG001
    """(runs, columns) in 0..1, Owen-scrambled; balanced only when the number of runs is a power of two."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # `unbalanced` says it, with the remedy
        return qmc.Sobol(columns, rng=seed).random(runs)


def unbalanced(runs: int) -> str:
    """What is lost with a number of runs that is no power of two, and the next number that is."""
    if runs & (runs - 1) == 0:
        return ""
    fuller = 1 << runs.bit_length()
    return f"a Sobol design is balanced for powers of two only; {runs} runs are not: {fuller} would be"


SOBOL = DesignKind("sobol", sobol_design, note=unbalanced, nested=True)
