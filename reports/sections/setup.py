"""The test set-up: a sketch to scale and the facts of the case."""

from __future__ import annotations

import math
from collections.abc import Iterable

from matplotlib.figure import Figure

from birdstrike.data.formatting import many
from birdstrike.data.units import display, rounded
from birdstrike.reports.blocks import Picture, Section, Table, drawing, photograph
from birdstrike.reports.figures.quantities import quantity, reading, words
from birdstrike.reports.figures.setup import SetUp, setup_figure
from birdstrike.reports.figures.target import drawn_target, target_figure
from birdstrike.reports.results.measurement import origin, short_name
from birdstrike.reports.results.results import CampaignResults, Results
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.build import outline_of
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.effects import stated
from birdstrike.solver.case.target import Target
from birdstrike.solver.sensors.instrument import Instrument


def section(results: Results) -> Section:
    """Sketch and table."""
    rows = (*_facts(results.case), *_record(results))
    table = Table(("what", "value"), rows, "The case and the record, as the program read them.")
    return Section("setup", "Test set-up", (_sketch(results.case), table))


def of_case(results: CampaignResults) -> Section:
    """The same of a case alone, where no record was inverted."""
    table = Table(("what", "value"), _facts(results.case), "The case, as the program read it.")
    return Section("setup", "Test set-up", (_sketch(results.case), table))


def set_up_figure(case: Case) -> Figure:
    """The sketch with lengths in mm of a flat plate and a bird that flies along its length at the centre; else the
    target and the bird in space."""
    return setup_figure(drawn(case)) if _in_one_plane(case) else target_figure(drawn_target(case))


def _in_one_plane(case: Case) -> bool:
    """Whether the sketch's front view shows all of the aim."""
    impact = case.impact
    aside = any(impact.offset) or impact.point is not None or impact.heading or impact.yaw or impact.pitch
    return case.target is None and case.plate.radius is None and not aside


def _sketch(case: Case) -> Picture:
    if not _in_one_plane(case):
        shown = drawn_target(case)
        told = f"parts {', '.join(shown.names)}; {many(len(shown.sensors), 'sensor')}; bird above the struck side"
        return photograph("setup", target_figure(shown), _caption(case), told)
    return drawing("setup", setup_figure(drawn(case)), _caption(case))


def _caption(case: Case) -> str:
    slope = case.impact.angle
    if case.struck_plane is not None:
        slope = math.asin(min(case.normal_speed / case.impact.speed, 1.0))
    degrees = display(slope, "rad")[0]
    return (
        f"The set-up to scale at the start of the simulation. The velocity makes {degrees:.3g}° with the plate's "
        f"surface, so that {quantity(case.normal_speed, 'm/s')} of {quantity(case.impact.speed, 'm/s')} are normal to "
        f"it; {_aimed(case)}; first contact {quantity(case.first_contact, 's')} after the start."
    )


def _aimed(case: Case) -> str:
    """Where the bird arrives: a point in space, or of the plate or the target, and how far beside it."""
    impact, centre = case.impact, "the plate's centre" if case.target is None else "the target's origin"
    if case.target is not None and case.mesh_file is not None:
        centre = f"the point ({_millimetres(case.target.origin)}) mm of the mesh file"
    if impact.point is not None:
        aimed = f"the bird's axis flies through ({_millimetres(impact.point)}) mm"
    else:
        aimed = f"the bird's axis points at {centre}" if impact.aim == "axis" else f"{centre} is touched first"
    beside = f", ({_millimetres(impact.offset)}) mm beside it along length and width" if any(impact.offset) else ""
    return aimed + beside


def _millimetres(place: Iterable[float]) -> str:
    return ", ".join(f"{1e3 * one:.4g}" for one in place)


def drawn(case: Case) -> SetUp:
    """What the sketch shows of a case."""
    sensors = {name: sensor.place for name, sensor in case.sensors.items() if sensor.place is not None}
    return SetUp(
        length=case.plate.length,
        width=case.plate.width,
        thickness=case.plate.thickness,
        edges=case.plate.edge_words,
        bird_shape=case.bird.shape,
        bird_diameter=case.bird.diameter,
        bird_length=case.bird.length,
        angle=case.impact.angle,
        speed=case.impact.speed,
        aim=case.impact.aim,
        standoff=case.impact.standoff,
        sensors=sensors,
    )


def _facts(case: Case) -> tuple[tuple[str, str], ...]:
    """The case in rows: what, value."""
    return (*_plate(case), *_bird(case), *_effects(case), *_instruments(case))


def _effects(case: Case) -> tuple[tuple[str, str], ...]:
    """What the case states under `effects`; the other rows have it in them."""
    return tuple(("effect of the case", line) for line in stated(case))


def _instruments(case: Case) -> tuple[tuple[str, str], ...]:
    """What the case states of the sensors' instruments."""
    return tuple(
        (f"instrument of {words(name)}", _instrument(one, case.sensors[name].unit))
        for name, one in case.instrument.items()
    )


def _instrument(one: Instrument, unit: str) -> str:
    said = [
        f"bandwidth {1e-3 * one.bandwidth:.4g} kHz" if one.bandwidth is not None else "",
        f"gain {one.gain:.4g}" if one.gain != 1.0 else "",
        f"time offset {quantity(one.time_offset, 's')}" if one.time_offset else "",
        f"drift {reading(1e-3 * one.drift, unit)}/ms" if one.drift else "",
    ]
    return ", ".join(filter(None, said)) or "ideal"


def _parts(case: Case, target: Target) -> tuple[tuple[str, str], ...]:
    """Parts of a target with their thickness and law, and how it is held."""
    source, mesh_file = target.source, case.mesh_file
    sides = (source.length, source.width) if case.struck_plane is None else outline_of(case).sides.tolist()
    parts = tuple(
        (f"part {name}", f"{quantity(part.thickness, 'm')}, {part.material} ({target.materials[part.material].law})")
        for name, part in target.parts.items()
    )
    held = ", ".join(
        f"{name} {edges if isinstance(edges, str) else 'on springs'}" for name, edges in target.supports.items()
    )
    size = " × ".join(quantity(side, "m") for side in sides)
    file = "" if mesh_file is None else f", mesh {mesh_file.name}"
    mesh = f"{size}{file}, {len(source.mesh().quads)} shells of about {quantity(source.element_size, 'm')}"
    return (("target", mesh), *parts, ("supports", held or "none"))


def _plate(case: Case) -> tuple[tuple[str, str], ...]:
    plate, metal = case.plate, case.plate.material
    if case.target is not None:
        return _parts(case, case.target)
    if plate.rigid:
        return (("plate", f"{quantity(plate.length, 'm')} × {quantity(plate.width, 'm')}, rigid"),)
    size = " × ".join(quantity(side, "m") for side in (plate.length, plate.width, plate.thickness))
    return (
        ("plate", f"{size}, edges {plate.edge_words}; {plate.elements[0]} × {plate.elements[1]} shell elements"),
        ("plate's metal", f"E {metal.young / 1e9:.4g} GPa, ν {metal.poisson:g}, density {metal.density:g} kg/m³"),
        (
            "plate's yield",
            f"{quantity(metal.yield_stress, 'Pa')}, tangent modulus {quantity(metal.tangent_modulus, 'Pa')}",
        ),
    )


def _bird(case: Case) -> tuple[tuple[str, str], ...]:
    bird, material = case.bird, case.bird.material
    size = f"{quantity(bird.diameter, 'm')} × {quantity(bird.length, 'm')} overall"
    momentum = bird.actual_mass * case.normal_speed
    return (
        (
            "bird",
            f"{words(bird.shape)}, {size}; {quantity(bird.actual_mass, 'kg', 4)} at {bird.actual_density:.4g} kg/m³",
        ),
        (
            "bird's model",
            f"{model_of(material)}, {pieces_of(bird)} requested",
        ),
        ("speed", f"{quantity(case.impact.speed, 'm/s')}, of which {quantity(case.normal_speed, 'm/s')} normal"),
        ("momentum", f"{rounded(momentum, 3)} N s normal to the plate"),
        ("simulated time", quantity(case.time.end, "s")),
    )


def pieces_of(bird: Bird) -> str:
    """`4500 SPH particles on a lattice of kind fcc`, `4500 Lagrangian hexahedra`."""
    if bird.method == "hexahedra":
        return f"{bird.particles} Lagrangian hexahedra"
    return f"{bird.particles} SPH particles on a lattice of kind {bird.lattice}"


def model_of(material: BirdMaterial) -> str:
    """The bird's model in words, with its equation of state where it has one of its own."""
    name = material.title or words(material.model).capitalize()
    law = material.law
    return f"{name} material" + (f", {words(law.kind).capitalize()} equation of state" if law is not None else "")


def _record(results: Results) -> tuple[tuple[str, str], ...]:
    record, noise = results.record, results.inversion.measured
    sizes = (
        f"{words(name)} {reading(size, record.units[name], 2)} ({noise.noise_source[name]})"
        for name, size in noise.noise.items()
    )
    return (
        ("record", f"{short_name(record)}: {origin(record)}"),
        ("record's noise", "; ".join(sizes)),
        *([("provenance", "\n".join(record.provenance))] if record.provenance else []),
    )
