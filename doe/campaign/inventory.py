"""What a campaign's folder holds: its own runs, damaged files, and runs of other solver versions or designs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.folder import CampaignFolder, campaign_within, stored_case
from birdstrike.doe.campaign.run import PlannedRun, plan
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.solvers import solver_for

UNKNOWN, DUE = "unknown", ""


@dataclass(frozen=True)
class Inventory:
    """Run numbers finished, failed (with the reason) and due under the present solver version; and, by file name:

    damaged: runs that cannot be read, those set aside included; other_versions: solver version -> runs that are kept
    but not used; elsewhere: runs of the present version that belong to another case or design. own: key of each run of
    this campaign -> why it failed, None where it finished. altered: a line for each of design.csv and curves.csv that
    was edited.
    """

    state: str
    version: str
    finished: list[int] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    due: list[int] = field(default_factory=list)
    damaged: list[str] = field(default_factory=list)
    other_versions: dict[str, list[str]] = field(default_factory=dict)
    elsewhere: list[str] = field(default_factory=list)
    own: dict[str, str | None] = field(default_factory=dict)
    altered: list[str] = field(default_factory=list)


def inventory(path: str | Path, progress: Progress = silent) -> Inventory:
    """Read every file of the campaign in `path`, changing none; raises UserError where there is no campaign.

    And where design.csv was edited so that no runs follow from it.
    """
    folder = CampaignFolder(Path(path))
    if not folder.design.exists() or not (folder.path / "case.toml").exists():
        instead = campaign_within(folder.path) or "; make one with: birdstrike run-doe"
        raise UserError(f"{path} holds no campaign (case.toml, design.csv){instead}")
    altered = folder.altered()
    try:
        runs, version = _planned(folder)
    except CaseError:
        raise
    except UserError as error:
        raise UserError(altered or error.errors) from error
    found = Inventory(str(folder.read_summary().get("state", "unknown")), version, altered=altered)
    store, own = RunStore(folder.runs), {key for run in runs for key in run.keys.values()}
    found.damaged.extend(_set_aside(folder.runs, store))
    finished, failed = store.keys(), store.failed_keys()
    keys = [*((key, True) for key in finished), *((key, False) for key in failed)]
    for i, (key, whole) in enumerate(keys):
        progress(i / len(keys))
        _file(found, store, key, whole, own)
    for run in runs:
        _count(found, run)
    return found


def _set_aside(runs: Path, store: RunStore) -> list[str]:
    """Names of the damaged files that were set aside and whose run has not been made again since."""
    names = sorted(file.name for file in runs.glob("*.corrupt"))
    keys = {name: name.partition(".")[0] for name in names}
    return [name for name in names if not any(f(keys[name]).exists() for f in (store.path, store.failure_path))]


def _planned(folder: CampaignFolder) -> tuple[list[PlannedRun], str]:
    """The folder's runs under the present version of the solver, and that version."""
    case = stored_case(folder.path)
    solver, space = solver_for(case), ParameterSpace.of(case.parameters())
    numbers, values = folder.every_row()
    return plan(case, Design("file", None, space, numbers, values, space.to_unit(values)), solver), solver.version


def _file(found: Inventory, store: RunStore, key: str, finished: bool, own: set[str]) -> None:
    """Enter one file of the store where it belongs."""
    name = (store.path(key) if finished else store.failure_path(key)).name
    meta = _meta(store, key, finished)
    if meta is None:
        found.damaged.append(name)
    elif key in own:
        found.own[key] = None if finished else str(meta["reason"])
    else:
        version = str(meta.get("solver_version", UNKNOWN))
        kept = found.elsewhere if version == found.version else found.other_versions.setdefault(version, [])
        kept.append(name)


def _meta(store: RunStore, key: str, finished: bool) -> Mapping[str, Any] | None:
    """What was saved beside a run or a failure; None for a damaged file."""
    if not finished:
        with suppress(ValueError, KeyError, TypeError):
            return store.failure_record(key)
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the inventory itself says which are damaged
        return None if store.look_up(key) is None else store.meta(key)


def _count(found: Inventory, run: PlannedRun) -> None:
    """Enter a run under finished, failed or due; what is damaged counts as not there."""
    reasons = [found.own.get(key, DUE) for key in run.keys.values()]
    if None in reasons:
        found.finished.append(run.number)
    elif DUE in reasons:
        found.due.append(run.number)
    else:
        found.failed[run.number] = str(reasons[-1])
