"""What another code computed for a deck of birdstrike, as histories of the case's sensors: nodout, rcforc, T01, CSV."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from birdstrike.data.decks.sensors import DeckSensor, DeckSensors
from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.nodout import is_nodout, read_nodout
from birdstrike.data.exports.rcforc import is_rcforc, read_rcforc
from birdstrike.data.exports.registry import reader_of
from birdstrike.data.histories import Array, Histories
from birdstrike.data.tables.loose_table import LooseTable, read_loose_table
from birdstrike.data.unit_systems import unit_system

AXES = ("x", "y", "z")
Curves = dict[tuple[str, int, int], tuple[Array, Array]]
"""(displacement, contact or reaction; number; axis 0 to 2) -> times and values in the deck's units."""
_RADIOSS = re.compile(
    r"(?P<group>contact of the bird|displacement sensors|reactions)\s+(?P<number>\d+)\s.*?(?P<var>\w+)"
)
_VARIABLES = {
    **{f"D{a}": ("displacement", i, 1.0) for i, a in enumerate("XYZ")},
    **{f"F{s}{a}": ("contact", i, 1.0) for s in "NT" for i, a in enumerate("XYZ")},
    **{f"REAC{a}": ("reaction", i, 1.0) for i, a in enumerate("XYZ")},
}
_CONVERTED = re.compile(
    r"(?P<group>DATABASE_HISTORY_NODE|TimeHistory1|TH-INTER)\s+(?P<number>\d+)\s(?:.*\s)?"
    r"(?P<var>[DF][NT]?[XYZ]|var ?\d+)"
)
_BINOUT = re.compile(r"(?P<axis>[xyz])_(?P<what>displacement|force) (?P<side>(master|slave) )?(?P<number>\d+)")


KINDS = {"displacement": "displacement", "contact_force": "contact", "reaction_force": "reaction"}
"""Kind of a sensor that is read from a code's files -> of a curve."""
OTHERS = {"strain": "strain gauges", "pressure": "pressures"}
"""Kind of a sensor that is not -> what they are called."""
WHOLE = 0.98
"""Share of the longest sensor's time that the clock of all has to cover."""


def read_deck_results(files: Sequence[str | Path], deck: DeckSensors) -> tuple[Histories, tuple[str, ...]]:
    """Histories of the sensors that the files hold, SI, and what is missing; raises MeasuredError where none is there.

    They stand on the case's clock, at the coarsest instants of those that last longest; NaN where a sensor's own has
    ended. One of several nodes is the sum with their weights. Forces are taken positive in the push, by the sign of
    their impulse: codes differ here.
    """
    curves: Curves = {}
    for file in files:
        curves |= _curves(Path(file), deck)
    system = unit_system(deck.units)
    found: dict[str, Array] = {}
    missing = []
    for name, sensor in deck.sensors.items():
        made = _sensor(sensor, curves)
        if made is None:
            missing.append(_reason(name, sensor.kind))
            continue
        found[name] = np.stack(made)
    if not found:
        listed = ", ".join(map(str, files))
        raise MeasuredError(
            f"{listed}: no output of a sensor of {len(deck.sensors)} is there; are they of this deck, {deck.code}? "
            "Radioss' groups keep their titles of the deck, LS-DYNA's nodes their numbers"
        )
    second, longest = 1.0 / system.value(1.0, "s"), max(times[-1] for times, _ in found.values())
    clock = min((times for times, _ in found.values() if times[-1] >= WHOLE * longest), key=len)
    channels, units = {}, {}
    for name, (times, values) in found.items():
        unit = deck.sensors[name].unit
        channels[name] = np.interp(clock, times, values, left=np.nan, right=np.nan) / system.value(1.0, unit)
        units[name] = unit
    return Histories(deck.begin + clock * second, channels, units), tuple(missing)


def _reason(name: str, kind: str) -> str:
    """Why a sensor has no curve of the other code."""
    if kind in KINDS:
        return f"{name} ({kind.replace('_', ' ')}) is in none of the files"
    return (
        f"{name}: {OTHERS.get(kind, kind)} are not read from a code's files; compare them by a CSV with the sensors' "
        "names, without --deck"
    )


def _curves(path: Path, deck: DeckSensors) -> Curves:
    if not path.is_file():
        raise MeasuredError(f"no file {path}")
    reader = reader_of(path)
    if reader is None and is_nodout(path):
        return _of_nodout(path, deck)
    if reader is None and is_rcforc(path):
        return _named(read_rcforc(path), _rcforc_key)
    if path.name.lower().startswith("binout"):
        assert reader is not None
        return _of_binout(path, reader)
    table = read_loose_table(path) if reader is None else reader(path, "")
    return (_of_converted(table) if deck.code == "lsdyna" else {}) | _named(table, _radioss_key)


def _of_converted(table: LooseTable) -> Curves:
    """Displacements and contact forces where OpenRadioss ran the LS-DYNA deck itself: its groups bear other titles.

    Variables that th_to_csv leaves without names come in the order of Radioss: of nodes displacements first, of
    contacts the impulses, normal then tangential.
    """
    values, curves = _values(table), Curves()
    time = values[:, 0]
    places: dict[tuple[str, int], int] = {}
    for column, name in enumerate(table.names):
        match = _CONVERTED.fullmatch(" ".join(name.split()))
        if match is None:
            continue
        kind = "contact" if match["group"] == "TH-INTER" else "displacement"
        number, curve = int(match["number"]), values[:, column]
        place = places[kind, number] = places.get((kind, number), -1) + 1
        if match["var"] in _VARIABLES:
            of, axis, _ = _VARIABLES[match["var"]]
        else:
            of, axis = (kind, place % 3) if place < (6 if kind == "contact" else 3) else ("", 0)
            curve = np.gradient(curve, time) if kind == "contact" else curve
        if of == kind:
            before = curves.get((kind, number, axis), (time, np.zeros_like(time)))[1]
            curves[kind, number, axis] = (time, before + curve)
    return curves


def _of_nodout(path: Path, deck: DeckSensors) -> Curves:
    wanted = {n for sensor in deck.sensors.values() if sensor.kind == "displacement" for n in sensor.numbers}
    curves: Curves = {}
    for node in sorted(wanted):
        try:
            table = read_nodout(path, node)
        except MeasuredError as error:
            if "has no node" in str(error):
                continue
            raise
        values = _values(table)
        places = {f"{axis}-disp": i for i, axis in enumerate(AXES)}
        for column, name in enumerate(table.names):
            if name in places:
                curves["displacement", node, places[name]] = (values[:, 0], values[:, column])
    return curves


def _of_binout(path: Path, reader) -> Curves:
    curves: Curves = {}
    for branch, kind in (("nodout", "displacement"), ("rcforc", "contact"), ("spcforc", "reaction")):
        try:
            table = reader(path, branch)
        except MeasuredError:
            continue

        def key(name: str, kind: str = kind) -> tuple[str, int, int, float] | None:
            match = _BINOUT.fullmatch(name)
            if match is None or (match["what"] == "displacement") != (kind == "displacement"):
                return None
            if match["side"] == "slave ":  # the force on the bird
                return None
            return kind, int(match["number"]), AXES.index(match["axis"]), 1.0

        curves |= _named(table, key)
    return curves


def _rcforc_key(name: str) -> tuple[str, int, int, float] | None:
    match = re.fullmatch(r"([xyz])-force master (\d+)", name)
    return None if match is None else ("contact", int(match[2]), AXES.index(match[1]), 1.0)


def _radioss_key(name: str) -> tuple[str, int, int, float] | None:
    match = _RADIOSS.fullmatch(" ".join(name.split()))
    if match is None or match["var"] not in _VARIABLES:
        return None
    kind, axis, factor = _VARIABLES[match["var"]]
    return kind, int(match["number"]), axis, factor


def _named(table: LooseTable, key) -> Curves:
    """Curves of a table by what their names say; normal and tangential forces of one contact add up.

    Raises MeasuredError where two columns of a sensor have one name, because one would be lost or counted twice.
    """
    values, curves, read = _values(table), dict[tuple[str, int, int], tuple[Array, Array]](), set[str]()
    for column, name in enumerate(table.names):
        found = key(name)
        if found is None:
            continue
        if name in read:
            raise MeasuredError(
                f'{table.path}: two columns are called "{name}", and which is of the struck side is not said; give the '
                "solver's text file"
            )
        read.add(name)
        *place, factor = found
        at = (place[0], place[1], place[2])
        before = curves.get(at, (values[:, 0], np.zeros(len(values))))[1]
        curves[at] = (values[:, 0], before + factor * values[:, column])
    return curves


def _values(table: LooseTable) -> Array:
    return np.array([[float(cell or "nan") for cell in cells] for _, cells in table.rows])


def _sensor(
    sensor: DeckSensor, curves: Mapping[tuple[str, int, int], tuple[Array, Array]]
) -> tuple[Array, Array] | None:
    kind = KINDS.get(sensor.kind)
    if kind is None:
        return None
    times, total = None, None
    for number, weight in zip(sensor.numbers, sensor.weights, strict=True):
        for axis, component in enumerate(sensor.direction):
            if component == 0.0:
                continue
            if (kind, number, axis) not in curves:
                return None
            times, values = curves[kind, number, axis]
            part = weight * component * values
            total = part if total is None else total + part
    if times is None or total is None:
        return None
    if kind != "displacement" and _impulse(times, total) < 0.0:
        total = -total
    return times, total


def _impulse(times: Iterable[float], values: Array) -> float:
    return float(np.trapezoid(values, np.asarray(times)))
