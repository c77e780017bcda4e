"""A folder of run-doe: the emulator of its runs, and no record yet; one can be dropped on the page."""

from __future__ import annotations

from pathlib import Path

from birdstrike.doe.campaign.folder import CampaignFolder, stored_case
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import View, channel, parameter, preset, runs
from birdstrike.surrogate.emulator import fit_emulator
from birdstrike.surrogate.weights import emulator_table


def holds(folder: Path) -> bool:
    """Whether run-doe has finished here."""
    return (folder / "curves.csv").is_file() and (folder / "design.csv").is_file()


def read(folder: Path) -> tuple[View]:
    """Fit the emulator of the finished runs; raises UserError where they are too few."""
    dataset, case = load_dataset(folder), stored_case(folder)
    names = tuple(dataset.curves)
    emulator = fit_emulator(dataset, names)
    space = ParameterSpace.of_dataset(dataset)
    ranges = zip(space.names, space.units, space.lows, space.highs, space.logarithmic, strict=True)
    parameters = [
        parameter(name, si, float(low), float(high), logarithmic=bool(log), among=dataset.names)
        for name, si, low, high, log in ranges
    ]
    sensors = [channel(n, dataset.channel_units[n], case.sensors[n].noise or None) for n in names]
    view = View(
        title=f"Campaign of {len(dataset.runs)} runs",
        headline="No record has been compared yet.",
        parameters=parameters,
        systems=[emulator_table(emulator)],
        shots=[{"name": CampaignFolder(folder).read_summary()["case_name"], "system": 0, "channels": sensors}],
        answers=[],
        presets=[preset("middle of the ranges", space.middle.tolist())],
        runs=runs(dataset.parameters, dataset.time, dataset.curves),
        case=str(folder / "case.toml"),
    )
    return (view,)


KIND = Kind("run-doe", holds, read)
