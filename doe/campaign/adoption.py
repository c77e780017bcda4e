"""A finished campaign that another flow takes over: whether it fits, and what differs where it does not."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import read_json
from birdstrike.doe.campaign.folder import CampaignFolder, other_ranges, refusal_of_other_case
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.solvers import solver_for
from birdstrike.solver.case.case import Case


def adopted_design(case: Case, doe: str | Path) -> Design:
    """The design of a finished campaign that was run for this case; raises UserError with all that does not fit.

    Compared are the digests of design.csv and curves.csv, the case, the sought parameters with their ranges, and the
    version of the solver. The columns stand in the order in which the case has its parameters.
    """
    folder, space = CampaignFolder(Path(doe)), ParameterSpace.of_case(case)
    if folder.path.is_file() or not folder.path.is_dir():
        raise UserError(f"--doe {doe} is no folder; make a campaign with: birdstrike run-doe CASE --out {doe}")
    load_dataset(folder.path)  # finished, and as the campaign wrote it
    summary = folder.read_summary()
    if errors := list(_differences(folder, summary, case, space)):
        raise UserError(errors, f"the campaign in {doe} does not fit")
    numbers, values = folder.every_row()
    values = values[:, [summary["space"]["names"].index(name) for name in space.names]]
    held = summary["design"]
    return Design(held["kind"], held["seed"], space, numbers, values, space.to_unit(values), held.get("source"))


def _differences(folder: CampaignFolder, summary: dict[str, Any], case: Case, space: ParameterSpace) -> Iterator[str]:
    """One line for each thing in which the campaign is another's."""
    other = refusal_of_other_case(read_json(folder.path / "case.json"), case)
    if other:
        yield f"{other}; give the campaign's own case, or run one of this case: birdstrike run-doe"
    if other := other_ranges(summary["space"], space):
        yield other
    version = solver_for(case).version
    if summary["solver_version"] != version:
        yield (
            f"its runs were made by solver version {summary['solver_version']}, this is {version}: repeat birdstrike "
            f"run-doe with --out {folder.path}, which makes them anew beside the old ones"
        )
