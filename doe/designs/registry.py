"""The kinds of design by name, and the design that `--design` asks for: one of them, or a user's own file.

A kind is added by a file of its own, which gives a DesignKind, and one line in KINDS.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.design import Design, DesignKind
from birdstrike.doe.designs.design_file import file_design
from birdstrike.doe.designs.lhs import LHS
from birdstrike.doe.designs.orthogonal import ORTHOGONAL
from birdstrike.doe.designs.sobol import SOBOL
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.designs.uniform import UNIFORM

KINDS: dict[str, DesignKind] = {kind.name: kind for kind in (UNIFORM, ORTHOGONAL, LHS, SOBOL)}


def refuse_seed(seed: int) -> None:
    """Raise UserError for a seed that no random generator takes."""
    refuse_not_whole("--seed", seed, "use 0, 1, 2, ...")
    if seed < 0:
        raise UserError(f"--seed = {seed} is below 0; use 0, 1, 2, ...")


def make_design(
    kind: str | Path, space: ParameterSpace, runs: int = 25, seed: int = 0, progress: Progress = silent
) -> Design:
    """The design `kind` of `runs` runs (the same for the same seed), or all rows of the CSV file `kind`.

    Raises UserError: an unknown kind, a count of runs for which no such design exists, every error of a file.
    """
    chosen = KINDS.get(str(kind)) if isinstance(kind, str) else None
    if chosen is None:
        if not isinstance(kind, str | PathLike) or not Path(kind).is_file():
            raise UserError(f"--design = {kind} is neither a file nor one of {', '.join(KINDS)}")
        return file_design(kind, space)
    refuse_not_whole("--runs", runs, "a design needs at least two runs")
    if runs < 2:
        raise UserError(f"--runs = {runs} is below 2; a design needs at least two runs")
    refuse_seed(seed)
    unit, note = chosen.generate(runs, len(space.names), seed, progress), chosen.note(runs)
    numbers, warnings = np.arange(1, runs + 1), (note,) if note else ()
    return Design(chosen.name, seed, space, numbers, space.to_physical(unit), unit, warnings=warnings)
