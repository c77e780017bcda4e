"""A folder of calibrate-models: a view a bird model, best first, each with its emulator of all shots."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain, signed_ms
from birdstrike.data.histories import Array
from birdstrike.data.storage.out_folder import maker_of, model_of
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.models.results import ModelAnswer, ModelComparison, emulator_notes, read_comparison
from birdstrike.inversion.results.ingredients import SAME_INSTANT, MeasuredFigures
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import Table, View, answer, channel, parameter, preset, record, runs
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
    notes = {name: emulator_notes(folder / name) for name in names}
    missing = [name for name, own in notes.items() if own is None]
    if missing:
        raise UserError(
            f"no emulator of {', '.join(missing)} in {folder}, or one of an earlier version; repeat "
            "calibrate-models with the same --out, whose simulations are stored"
        )
    records = {shot: read_measured(folder / "records" / f"{shot}.csv") for shot in comparison.speeds}
    return tuple(
        _view(folder / name, own, comparison, comparison.models[name], records)
        for name, own in notes.items()
        if own is not None
    )


def _view(
    folder: Path, own: dict[str, Any], comparison: ModelComparison, model: ModelAnswer, records: dict[str, Measured]
) -> View:
    """Of one model; own: its emulator's notes."""
    emulator = load_emulator(folder / "emulator.npz")
    lows, highs = np.array([own["ranges"][key] for key in emulator.names]).T
    units = tuple(own["units"][key] for key in emulator.names)
    space = ParameterSpace(emulator.names, units, lows, highs, emulator.scales)
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
        parameters=[
            parameter(
                key,
                unit,
                float(low),
                float(high),
                estimates.get(key),
                logarithmic=bool(logarithmic),
                among=emulator.names,
            )
            for key, unit, low, high, logarithmic in zip(
                emulator.names, units, lows, highs, space.logarithmic, strict=True
            )
        ],
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
