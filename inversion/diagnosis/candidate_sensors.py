"""Sensors that a next measurement could have: places on the plate, strain gauges, the frame's force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from birdstrike.inversion.diagnosis.shots import Record, Trace
from birdstrike.inversion.observations.noise import Noise
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.sensor import Sensor

PREFIX = "probe_"
PLACES = {"centre": (0.0, 0.0), "fore": (0.25, 0.0), "aft": (-0.25, 0.0), "side": (0.0, 0.25), "corner": (0.25, 0.25)}
"""Place's name -> shares of length and width from the plate's centre."""
SHARE = 0.01  # of its peak: noise of a sensor of a kind that the record does not have


def with_probes(case: Case) -> Case:
    """The case with every candidate sensor that it does not have; the strike itself is not touched.

    An external solver writes what its deck asks for, and nothing more.
    """
    if case.solver.name == "external":
        return case
    return case.with_sensors(candidates(case))


def candidates(case: Case) -> dict[str, Any]:
    """Tables of the candidate sensors."""
    found: dict[str, Any] = {}
    taken = {(sensor.kind, tuple(round(x, 4) for x in sensor.place or ())) for sensor in case.sensors.values()}
    for name, (along, across) in PLACES.items():
        place = (along * case.plate.length, across * case.plate.width)
        at = [f"{1e3 * x:.6g} mm" for x in place]
        if ("displacement", (round(place[0], 4), round(place[1], 4))) not in taken and not case.plate.rigid:
            found[f"{PREFIX}displacement_{name}"] = {"kind": "displacement", "at": at}
    for name in ("centre", "fore", "side") if not case.plate.rigid else ():
        place = (PLACES[name][0] * case.plate.length, PLACES[name][1] * case.plate.width)
        at = [f"{1e3 * x:.6g} mm" for x in place]
        if ("strain", (round(place[0], 4), round(place[1], 4))) not in taken:
            found[f"{PREFIX}strain_{name}"] = {"kind": "strain", "at": at}
    kinds = {sensor.kind for sensor in case.sensors.values()}
    if "reaction_force" not in kinds:
        found[f"{PREFIX}reaction_force"] = {"kind": "reaction_force"}
    return found


def described(name: str, sensor: Sensor) -> str:
    """A sensor in words: its kind and place, and its name where the case declares it."""
    place = None if sensor.place is None else [1e3 * x for x in sensor.place]
    where = "" if place is None else f" at {place[0]:.3g} mm along and {place[1]:.3g} mm across from the plate's centre"
    declared = "" if name.startswith(PREFIX) else f" (the case's {name})"
    return f"{sensor.noun}{where}{declared}"


def planned(record: Record, name: str, sensors: Mapping[str, Sensor], peak: float) -> Trace:
    """A new sensor's trace, before it is measured: sampled as the record's first one.

    peak: the largest magnitude that it is expected to read, SI. Its noise: what the case states of it, else that of the
    record's sensor of its kind, else 1 % of its peak; correlated in time as the record's sensor of its kind,
    white where the record has none.
    """
    first, sensor = record.traces[0], sensors[name]
    like = next((trace.noise for trace in record.traces if sensors[trace.name].kind == sensor.kind), None)
    level = sensor.noise or (like.level if like else SHARE * peak)
    noise = Noise(np.full(len(first.times), level), like.correlation_time if like else 0.0, "expected")
    return Trace(name, sensor.unit, first.times, first.block, np.zeros(len(first.values)), noise, peak)
