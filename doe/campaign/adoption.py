"""A finished campaign that another flow takes over: whether it fits, and what differs where it does not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import span
from birdstrike.data.storage.files import read_json
from birdstrike.doe.campaign.folder import CampaignFolder, refusal_of_other_case, space_json
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.solvers import solver_for
from birdstrike.solver.case.case import Case

RANGE_DIGITS = 6
"""Of the ends of a parameter's range, which a user wrote."""


def adopted_design(case: Case, doe: str | Path) -> Design:
    """The design of a finished campaign that was run for this case; raises UserError with all that does not fit.

    Compared are the digests of design.csv and curves.csv, the case, the sought parameters with their ranges, and the
    version of the solver.
    """
    folder, space = CampaignFolder(Path(doe)), ParameterSpace.of_case(case)
    if folder.path.is_file() or not folder.path.is_dir():
        raise UserError(f"--doe {doe} is no folder; make a campaign with: birdstrike run-doe CASE --out {doe}")
    load_dataset(folder.path)  # finished, and as the campaign wrote it
    summary = folder.read_summary()
    if errors := list(_differences(folder, summary, case, space)):
        raise UserError(errors, f"the campaign in {doe} does not fit")
    numbers, values = folder.every_row()
    held = summary["design"]
    return Design(held["kind"], held["seed"], space, numbers, values, space.to_unit(values), held.get("source"))


def _differences(folder: CampaignFolder, summary: dict[str, Any], case: Case, space: ParameterSpace) -> Iterator[str]:
    """One line for each thing in which the campaign is another's."""
    other = refusal_of_other_case(read_json(folder.path / "case.json"), case)
    if other:
        yield f"{other}; give the campaign's own case, or run one of this case: birdstrike run-doe"
    there, here = _ranges(summary["space"]), _ranges(space_json(space))
    if there != here:
        parts = [f"{name} {text}" for name, text in there.items() if here.get(name) != text]
        own = [f"{name} {text}" for name, text in here.items() if there.get(name) != text]
        yield (
            f"inversion.parameters differ: the campaign varied {', '.join(parts) or 'fewer of them'}, the case seeks "
            f"{', '.join(own) or 'fewer of them'}"
        )
    version = solver_for(case).version
    if summary["solver_version"] != version:
        yield (
            f"its runs were made by solver version {summary['solver_version']}, this is {version}: repeat birdstrike "
            f"run-doe with --out {folder.path}, which makes them anew beside the old ones"
        )


def _ranges(space: dict[str, list[Any]]) -> dict[str, str]:
    """Parameter -> its range in words."""
    columns = zip(space["names"], space["units"], space["lows"], space["highs"], space["scales"], strict=True)
    return {
        name: span(low, high, unit, RANGE_DIGITS) + ("" if scale == "linear" else " (logarithmic)")
        for name, unit, low, high, scale in columns
    }
