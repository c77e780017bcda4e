"""A folder of close-the-loop: its diagnosis first, if it has one, then its calibration; else its campaign alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.inversion.results.same_shot import shot_difference
from birdstrike.reports.explore.kinds import campaign, diagnosis, inversion
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import View


def holds(folder: Path) -> bool:
    """Whether close-the-loop, or the same commands one by one, has begun here; its campaign may lie elsewhere."""
    return campaign.holds(folder / "doe") or inversion.holds(folder / "inversion")


def read(folder: Path) -> tuple[View, ...]:
    """What is there of a loop, the last answer first; each view has the calibrated point among its presets."""
    if not inversion.holds(folder / "inversion"):
        return campaign.read(folder / "doe")
    own, inverted = folder / "doe", folder / "inversion"
    calibrated = inversion.view_of(inverted, (own if campaign.holds(own) else inverted) / "case.toml")
    try:
        found = _diagnosed(inverted, folder / "diagnosis") if diagnosis.holds(folder / "diagnosis") else ()
    except UserError as error:
        note = f"The diagnosis in {folder / 'diagnosis'} is not shown: {'; '.join(error.errors)}"
        return (replace(calibrated, warnings=(note, *calibrated.warnings)),)
    return (*(_with_calibration(view, calibrated) for view in found), calibrated)


def _diagnosed(inverted: Path, diagnosed: Path) -> tuple[View, ...]:
    """The views of a diagnosis; raises UserError for one of another record or case than the inversion's."""
    if differs := shot_difference(inverted, diagnosed):
        raise UserError(f"{differs}; explore that folder by itself, or diagnose this record")
    return diagnosis.read(diagnosed)


def _with_calibration(view: View, calibrated: View) -> View:
    """A diagnosis's view with the point of train-and-invert among its presets, where it varies the same parameters."""
    if [one["key"] for one in view.parameters] != [one["key"] for one in calibrated.parameters]:
        return view
    return replace(view, presets=(*view.presets, *calibrated.presets))


KIND = Kind("close-the-loop", holds, read)
