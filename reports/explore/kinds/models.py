"""A folder of calibrate-models: a view a bird model, best first, each with its emulator of all shots.

A constant that was sought over decades moves as the fraction of its logarithmic range, as the emulator knows it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain, signed_ms, span
from birdstrike.data.histories import Array
from birdstrike.data.storage.files import read_json
from birdstrike.data.storage.out_folder import maker_of, model_of
from birdstrike.inversion.models.results import ModelAnswer, ModelComparison, read_comparison
from birdstrike.inversion.results.ingredients import SAME_INSTANT, MeasuredFigures
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import Table, View, answer, channel, parameter, preset, record, runs, unit_of
from birdstrike.surrogate.files import load_emulator, read_runs
from birdstrike.surrogate.weights import emulator_table


def holds(folder: Path) -> bool:
    """Whether calibrate-models works or has finished here, or this is the folder of one of its models."""
    return maker_of(folder) == "calibrate-models" or model_of(folder) is not None


def read(folder: Path) -> tuple[View, ...]:
    """One view for every model that has an answer, or for the one whose folder it is; raises UserError for a folder
    that is not whole."""
    folder, model = model_of(folder) or (folder, "")
    comparison = read_comparison(folder, model)
    names = [model] if model else comparison.ranking
    missing = [name for name in names if "clocks" not in read_json(folder / name / "emulator.json")]
    if missing:
        raise UserError(
            f"no emulator of {', '.join(missing)} in {folder}, or one of an earlier version; repeat "
            "calibrate-models with the same --out, whose simulations are stored"
        )
    records = {shot: read_measured(folder / "records" / f"{shot}.csv") for shot in comparison.speeds}
    return tuple(_view(folder / name, comparison, comparison.models[name], records) for name in names)


def _view(folder: Path, comparison: ModelComparison, model: ModelAnswer, records: dict[str, Measured]) -> View:
    own = read_json(folder / "emulator.json")
    emulator = load_emulator(folder / "emulator.npz")
    theta, curves = read_runs(folder / "emulator.npz")
    clock = next(iter(emulator.channels.values())).time
    presets = [preset("calibrated", own["calibrated"])]
    presets += [preset("published", own["published"])] if own["published"] else []
    estimates = {key: vars(one) for key, one in model.parameters.items()}
    said = [answer(key, one["unit"], one, own["units"]) for key, one in estimates.items()]
    combined = "; ".join(one.sentence for one in model.combinations.values() if one.sentence)
    place = f"Place {comparison.ranking.index(model.name) + 1} of {len(comparison.ranking)}"
    return View(
        title=f"Bird model {model.name}",
        headline=f"{place}: held-out error {model.error[0]:.2f} times the noise. {combined}".strip(),
        parameters=[_slider(key, own, estimates.get(key)) for key in emulator.names],
        systems=[emulator_table(emulator)],
        shots=[
            {
                "name": f"{shot}, {comparison.speeds[shot]:g} m/s",
                "system": 0,
                "channels": _sensors(
                    own["channels"][shot], measured, comparison.measured[shot], own["clocks"][shot], clock
                ),
            }
            for shot, measured in records.items()
        ],
        answers=said,
        presets=presets,
        runs=runs(theta, clock, curves),
        warnings=list(model.warnings),
        case=str(folder / next(iter(records)) / "case.toml"),
    )


def _slider(key: str, own: dict[str, Any], estimate: dict[str, Any] | None) -> Table:
    """Of a constant with what is known of it; one sought over decades says between which values its fraction runs.

    decades: those values, SI, with their unit; without them what is copied from the page would be the fraction.
    """
    begin, end = own["ranges"][key]
    if key not in own["logarithmic"]:
        return parameter(key, own["units"][key], begin, end, estimate, among=own["units"])
    low, high, unit = own["logarithmic"][key]

    def share(value: float | None) -> float | None:
        return None if value is None else math.log(value / low) / math.log(high / low)

    if estimate is not None:
        ends = estimate["interval_95"]
        estimate = estimate | {
            "value": share(estimate["value"]),
            "interval_95": ends and [share(one) for one in ends],
        }
    table = parameter(key, own["units"][key], begin, end, estimate)
    table["label"] = f"{plain(key, own['units'])}, share of the decades {span(low, high, unit)}"
    table["decades"] = {"low": low, "high": high, **unit_of(unit)}
    return table


def _sensors(
    channels: Mapping[str, str], measured: Measured, figures: MeasuredFigures, late: float, clock: Array
) -> list[Table]:
    """A shot's sensors with its record above rest, scored at the points by which the models' errors are told.

    channels: name -> that of the emulator; late: time origin of the record [s], by which it is moved onto the clock
    (m,) [s] of the simulations.
    """
    time, above = measured.time - late, figures.above_rest(measured)
    seen = (time >= clock[0] - SAME_INSTANT) & (time <= clock[-1] + SAME_INSTANT)
    moved = f", its time less {signed_ms(late)}" if late else ""
    found = []
    for name, key in channels.items():
        used, noise = figures.used(name, measured.time, above.channels[name]), figures.noise[name]
        shown = seen | used
        sigma = np.full(int(shown.sum()), noise)
        own = record(time[shown], above.channels[name][shown], sigma, f"{measured.path}{moved}", used[shown])
        found.append(channel(key, measured.units[name], noise, own, plain(name)))
    return found


KIND = Kind("calibrate-models", holds, read)
