"""A folder of train-and-invert: its emulator, the record, the answer with its intervals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import file_names
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array
from birdstrike.data.units import rounded
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.results.estimates import Answer, Estimate
from birdstrike.inversion.results.fit import TimeOrigin
from birdstrike.inversion.results.ingredients import SAME_INSTANT
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.reports.explore.kinds.kind import Kind
from birdstrike.reports.explore.view import Table, View, answer, channel, parameter, preset, record, runs, unit_of
from birdstrike.reports.results.reading import read_verification
from birdstrike.surrogate.files import load_emulator, read_runs
from birdstrike.surrogate.weights import emulator_table

FARTHEST_CLOCK = 3.0  # standard deviations of the time origin that its slider reaches beyond the answer


def holds(folder: Path) -> bool:
    """Whether train-and-invert has finished here."""
    return (folder / "inversion.json").is_file()


def read(folder: Path) -> tuple[View]:
    """The emulator that the answer rests on; raises UserError for a folder that is not whole."""
    return (view_of(folder, folder / "case.toml"),)


def view_of(folder: Path, case: Path) -> View:
    """The view of an inversion whose case lies at `case`."""
    inversion = _loaded(folder)
    emulator = load_emulator(folder / "emulator.npz")
    theta, curves = read_runs(folder / "emulator.npz")
    best = inversion.best_answer
    estimates = best.parameters
    lows, highs = np.array([inversion.ranges[name] for name in emulator.names]).T
    units = tuple(estimates[name].unit for name in emulator.names)
    space = ParameterSpace(emulator.names, units, lows, highs, emulator.scales)
    time, measured, _ = read_verification(folder / "verification.csv", best)
    return View(
        title="Calibration",
        headline=_headline(inversion, best),
        parameters=[
            parameter(
                name,
                estimates[name].unit,
                *inversion.ranges[name],
                vars(estimates[name]),
                logarithmic=bool(logarithmic),
                among=emulator.names,
            )
            for name, logarithmic in zip(emulator.names, space.logarithmic, strict=True)
        ],
        systems=[emulator_table(emulator)],
        shots=[
            {
                "name": ", ".join(_record_names(inversion).values()),
                "system": 0,
                "channels": [
                    _sensor(inversion, name, best.channels[name].unit, time, values, emulator.channels[name].time)
                    for name, values in measured.items()
                ],
            }
        ],
        answers=[answer(name, estimates[name].unit, vars(estimates[name]), emulator.names) for name in emulator.names],
        presets=[preset("calibrated", _point(space, estimates), {}, inversion.time_offset.value)],
        runs=runs(theta, next(iter(emulator.channels.values())).time, curves),
        clock=_clock(inversion.time_offset),
        warnings=inversion.warnings,
        case=str(case),
    )


def _loaded(folder: Path) -> Inversion:
    missing = [name for name in ("emulator.npz", "verification.csv") if not (folder / name).is_file()]
    if missing:
        raise UserError(f"no {' and no '.join(missing)} in {folder}; repeat birdstrike train-and-invert")
    return Inversion.load(folder / "inversion.json")


def _headline(inversion: Inversion, best: Answer) -> str:
    """How well the solver confirms the answer, and which combination a deficient design carries."""
    carried = f" {best.combination.sentence}." if best.combination else ""
    if best.verified_relative is None:
        return f"No verification run finished.{carried}"
    said = f"By the {inversion.best}: the solver at this answer differs from the record by "
    return f"{said}{rounded(100 * best.verified_relative, 2)} % of the peaks (RMS).{carried}"


def _sensor(inversion: Inversion, name: str, unit: str, time: Array, values: Array, clock: Array) -> Table:
    """A channel with its record over the simulations' `clock` (m,) [s]; one of several shots says of which."""
    noise, (sensor, sign, number) = inversion.measured.noise[name], name.partition("@")
    source = _record_names(inversion)[sign + number]
    label = f"{plain(sensor)}, {source}" if len(inversion.shots) > 1 else plain(sensor)
    seen = (time >= clock[0] - SAME_INSTANT) & (time <= clock[-1] + SAME_INSTANT)
    used = inversion.measured.used(name, time, values)[seen]
    own = record(time[seen], values[seen], np.full(len(used), noise), source, used)
    return channel(name, unit, noise, own, label)


def _record_names(inversion: Inversion) -> dict[str, str]:
    """Suffix of a shot's channels -> its record: of a single one its file, of several a name of its own."""
    if len(inversion.shots) < 2:
        return {"": Path(inversion.records[0]).name}
    return dict(zip((shot.suffix for shot in inversion.shots), file_names(inversion.records), strict=True))


def _point(space: ParameterSpace, estimates: Mapping[str, Estimate]) -> list[float]:
    """Where the answer stands: its values, and for a parameter without one the middle of its range, in its scale."""
    middle = dict(zip(space.names, space.middle, strict=True))
    return [float(middle[name] if one.value is None else one.value) for name, one in estimates.items()]


def _clock(origin: TimeOrigin) -> dict[str, Any] | None:
    """The slider of the time origin, where the record does not share the simulation's clock."""
    if origin.sigma is None:
        return None
    ends = [origin.value - FARTHEST_CLOCK * origin.sigma, origin.value + FARTHEST_CLOCK * origin.sigma, 0.0]
    shown = {"value": origin.value, "interval": origin.interval_95}
    return {"label": "time origin of the record", "low": min(ends), "high": max(ends), **unit_of("s"), **shown}


KIND = Kind("train-and-invert", holds, read)
