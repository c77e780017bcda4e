"""The design of a campaign's folder: the one it holds, that one with runs added, or a fresh one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.arguments import as_path
from birdstrike.data.errors import refuse_not_whole
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.campaign.folder import CampaignFolder, design_rows, rows_digest, space_json
from birdstrike.doe.designs.completion import completed
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.registry import KINDS, make_design
from birdstrike.doe.designs.space import ParameterSpace


def planned_design(
    kind: str | Path,
    space: ParameterSpace,
    runs: int,
    seed: int,
    out: str | Path,
    progress: Progress = silent,
) -> Design:
    """`make_design`, but of a campaign in `out` of the same kind, seed and ranges its runs stay, bit for bit.

    More runs than it holds are added where they fill the box best; a nested kind (Sobol) goes on instead.
    Raises UserError.
    """
    refuse_not_whole("--runs", runs, "a design needs at least two runs")
    held = _held(str(kind), space, seed, CampaignFolder(as_path("out", out)))
    if held is None or runs < len(held[0]) or (KINDS[str(kind)].nested and runs > len(held[0])):
        return make_design(kind, space, runs, seed, progress)
    numbers, values = held
    design = Design(str(kind), seed, space, numbers, values, space.to_unit(values))
    return design if runs == len(numbers) else _extended(design, runs, progress)


def _extended(design: Design, runs: int, progress: Progress) -> Design:
    n, space, seed = len(design.numbers), design.space, design.seed or 0
    unit = completed(design.unit, runs, seed, progress)
    said = f"the {n} runs of the {design.kind} design stay; {runs - n} are added where they fill the box best"
    if lost := KINDS[design.kind].extended:
        said += f": {lost.format(runs=n)}"
    numbers = np.concatenate([design.numbers, design.numbers.max() + np.arange(1, runs - n + 1)])
    values = np.vstack([design.values, space.to_physical(unit[n:])])
    return replace(design, numbers=numbers, values=values, unit=unit, warnings=(said,))


def _held(
    kind: str, space: ParameterSpace, seed: int, folder: CampaignFolder
) -> tuple[NDArray[np.int64], Array] | None:
    """Run numbers and values of the folder's design where its summary vouches for kind, seed, ranges and every row."""
    summary = folder.read_summary()
    design = summary.get("design", {})
    same = (design.get("kind"), design.get("seed"), summary.get("space")) == (kind, seed, space_json(space))
    if kind not in KINDS or not same or not folder.design.exists():
        return None
    rows = folder.design.read_text(encoding="utf-8").splitlines()[: design["runs"] + 1]
    if rows_digest(rows) != design.get("digest"):
        return None
    return design_rows(folder.design, rows)
