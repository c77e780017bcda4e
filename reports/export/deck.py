"""A case as a deck that runs in another code, with the file that says which of its outputs are the sensors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from birdstrike.data.decks.sensors import DeckSensor, DeckSensors, sensors_file
from birdstrike.data.formatting import quantity
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.inversion.labels import flight
from birdstrike.reports.export.lsdyna_deck import write_lsdyna_deck
from birdstrike.reports.export.model import StrikeModel, strike_model
from birdstrike.reports.export.numbering import Numbering
from birdstrike.reports.export.radioss import write_radioss_deck
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.case.effects import stated


@dataclass(frozen=True)
class WrittenDeck:
    """files: of the deck, the first to be given to the code; sensors: the file of its outputs; missing: sensors that
    another code does not record.
    """

    files: tuple[Path, ...]
    sensors: Path
    missing: tuple[str, ...]
    nodes: int
    elements: int


def write_deck(case: Case, path: Path, code: str, system: UnitSystem) -> WrittenDeck:
    """Write the deck of a case, for "lsdyna" or "radioss"; raises UserError for what their common keywords have not."""
    model = strike_model(case)
    head = tuple(_head(case, model, system))
    if code == "radioss":
        files = write_radioss_deck(path, model, system, head)
    else:
        files = (write_lsdyna_deck(path, model, system, head),)
    beside = sensors_file(files[0], code)
    replace(outputs(model, code, system), case_hash=case_hash(case)).save(beside)
    bird = len(model.bird.cells) or len(model.bird.points)
    return WrittenDeck(
        files,
        beside,
        model.missing,
        len(model.nodes) + len(model.bird.points),
        sum(len(part.quads) for part in model.parts) + bird,
    )


def _head(case: Case, model: StrikeModel, system: UnitSystem) -> Iterator[str]:
    """Lines that say where the deck comes from, in which units it is, and what a reader should compare first."""
    try:
        by = f"birdstrike {version('birdstrike')}"
    except PackageNotFoundError:
        by = "birdstrike"
    yield f"Bird strike written by {by}: case {case.name}, hash {case_hash(case)}."
    yield f"Units {system.name}: {system.sentence}."
    yield from (f"Effect of the case: {line}" for line in stated(case))
    mass = quantity(float(model.bird.masses.sum()), "kg", 6)
    yield f"Bird: {mass}, towards -z, {flight(model.case.impact, 6)}."
    momentum = system.value(float(model.bird.masses.sum()) * model.case.impact.speed, "N") * system.value(1.0, "s")
    yield f"Check on the first output: momentum of the bird {momentum:.6g} {system.unit('N')} {system.base['time']}."
    if model.begin < 0.0:
        yield f"Time 0 is {quantity(model.begin, 's')} on the case's clock: the bird's outermost points touch early."
    plane = case.struck_plane
    if plane is None:
        yield "Sensors are positive in the push, along -z: turn displacements and forces along z round."
    else:
        push = ", ".join(f"{0.0 - c:.4g}" for c in plane.normal.round(6))
        yield f"Sensors are positive in the push, along ({push}): take displacements and forces along it."


def outputs(model: StrikeModel, code: str, system: UnitSystem) -> DeckSensors:
    """The sensors by the numbers of the deck."""
    numbering, found = Numbering(model), {}
    half = {}
    for part in model.parts:
        half |= dict.fromkeys(range(part.first, part.first + len(part.quads)), 0.5 * part.thickness)
    for sensor in model.sensors:
        numbers, weights = [int(n) + 1 for n in sensor.nodes], [float(w) for w in sensor.weights]
        if sensor.kind == "contact_force":
            numbers = list(range(1, len(model.contacts) + 1))
            weights = [1.0] * len(numbers)
        elif sensor.kind == "reaction_force":
            numbers = numbering.reaction_nodes(model, sensor.nodes)
            weights = [1.0] * len(numbers)
        elif sensor.element is not None:
            numbers, weights = [sensor.element + 1], [sensor.side * half[sensor.element]]
        x, y, z = (float(c) for c in sensor.direction)
        found[sensor.name] = DeckSensor(sensor.kind, sensor.unit, tuple(numbers), tuple(weights), (x, y, z))
    return DeckSensors(code, system.name, found, model.begin)
