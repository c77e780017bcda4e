"""Candidate sensors: places on the target at which no sensor stands, simulated beside the case's own.

What an effect would change there tells which sensor to add (`conclusions.next_measurement`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.build import Outline, outline_of, rest_mesh
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.registry import effect_named
from birdstrike.solver.sensors.displacement import Displacement
from birdstrike.solver.sensors.places import point_at
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import Placed, Sensor

PREFIX = "probe_"
PLACES = {"centre": (0.0, 0.0), "fore": (0.25, 0.0), "aft": (-0.25, 0.0), "side": (0.0, 0.25), "corner": (0.25, 0.25)}
"""Place's name -> shares of length and width from the middle of what is struck."""
STRAINS = ("centre", "fore", "side")
TOO_NEAR = 0.02  # of length and width: a sensor that near to one of its kind shows nothing new


def with_candidate_sensors(case: Case) -> Case:
    """The case with every candidate sensor that it does not have; the strike itself is not touched.

    An external solver writes what its deck asks for, and nothing more.
    """
    if case.solver.name == "external":
        return case
    return _with_own_instruments(case).with_sensors(candidate_sensors(case))


def _with_own_instruments(case: Case) -> Case:
    """The case with what its effects make of its sensors' instruments written there, so that they stay these sensors'.

    The effects act on displacements where there are any, so that a case of strains would lose them to the
    candidates. The clock is that of all sensors.
    """
    faults = {name: effect_named(name).fault for name in case.effects}
    own = {name: case.effects[name] for name, fault in faults.items() if fault is not None and not fault.common}
    if not own:
        return case
    rest = case.with_effects({name: x for name, x in case.effects.items() if name not in own})
    table: dict[str, dict[str, Any]] = {}
    for name, x in own.items():
        for sensor, settings in effect_named(name).change(rest, x).get("instrument", {}).items():
            table.setdefault(sensor, {}).update(settings)
    return rest.overlaid({"instrument": table})


def _has(case: Case, kind: str, place: Array, outline: Outline) -> bool:
    """Whether the case has a sensor of that kind at a place, or so near that another one would be the same again."""
    own = [_seen(case, sensor, outline) for sensor in case.sensors.values() if sensor.kind == kind]
    return any(one is not None and bool((np.abs(one - place) <= TOO_NEAR * outline.sides).all()) for one in own)


def _seen(case: Case, sensor: Sensor, outline: Outline) -> Array | None:
    """Where a sensor sits in the outline's axes, (2,) [m]; None for one that has no place."""
    if outline.plane is None or not isinstance(sensor, Placed):
        return None if sensor.place is None else np.array(sensor.place[:2])
    mesh = rest_mesh(case)
    return outline.seen(point_at(mesh, *sensor.on(mesh)))[:2]


def candidate_sensors(case: Case) -> dict[str, Any]:
    """Tables of the candidate sensors, those left out whose place is on no shell of a mesh from a file.

    The places are shares of the outline; where the struck plane lies aslant they are points in space of the shells that
    are met there against its normal, and gauges lie along its length.
    """
    found: dict[str, Any] = {}
    outline = outline_of(case)
    for kind, names in (("displacement", PLACES), ("strain", STRAINS)) if not case.plate.rigid else ():
        for name in names:
            place = outline.middle + np.array(PLACES[name]) * outline.sides
            table = _table(case, place, outline)
            if table is not None and not _has(case, kind, place, outline):
                along = {} if kind != "strain" or outline.plane is None else {"along": outline.plane.axes[0].tolist()}
                found[f"{PREFIX}{kind}_{name}"] = {"kind": kind} | table | along
    if not any(isinstance(sensor, ReactionForce) and sensor.along is None for sensor in case.sensors.values()):
        found[f"{PREFIX}reaction_force"] = {"kind": "reaction_force"}
    return found


def _table(case: Case, place: Array, outline: Outline) -> dict[str, Any] | None:
    """What a sensor at a place (2,) [m] of the outline says of it; None where there is no shell.

    A mesh from a file may have any outline, and holes.
    """
    sensor = {"at": [f"{1e3 * x:.6g} mm" for x in place]}
    if case.mesh_file is None:
        return sensor
    mesh = rest_mesh(case)
    nodes = outline.seen(mesh.nodes)
    laid, there = replace(mesh, nodes=nodes, surface=nodes[:, :2]), Displacement.model_validate(sensor)
    if list(there.misplaced("", laid)):
        return None
    if outline.plane is None:
        return sensor
    facet, xi, eta = there.on(laid)
    point = [f"{x:.6g} mm" for x in (1e3 * point_at(mesh, facet, xi, eta)).round(6) + 0.0]
    return {"point": point, "part": mesh.part_of(facet)}
