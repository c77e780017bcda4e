"""The test set-up: a sketch to scale and the facts of the case."""

from __future__ import annotations

from data.units import display
from reports.blocks import Section, Table, drawing
from reports.figures.quantities import quantity, words
from reports.figures.setup import SetUp, setup_figure
from reports.record import origin, short_name
from reports.results import Results
from solver.case import Case


def section(results: Results) -> Section:
    """Sketch and table."""
    case = results.case
    degrees = display(case.impact.angle, "rad")[0]
    caption = (
        f"The set-up to scale before impact. The velocity makes {degrees:.3g}° with the plate's surface, so that "
        f"{quantity(case.normal_speed, 'm/s')} of {quantity(case.impact.speed, 'm/s')} are normal to it; "
        + ("the bird's axis points at the plate's centre." if case.impact.aim == "axis" else "first touch at the centre.")
    )
    return Section("setup", "Test set-up", (drawing("setup", setup_figure(_drawn(case)), caption), _facts(results)))


def _drawn(case: Case) -> SetUp:
    sensors = {name: sensor.at for name, sensor in case.sensors.items() if sensor.kind == "displacement"}
    return SetUp(
        length=case.plate.length,
        width=case.plate.width,
        thickness=case.plate.thickness,
        edges=case.plate.edges,
        bird_shape=case.bird.shape,
        bird_diameter=case.bird.diameter,
        bird_length=case.bird.length,
        angle=case.impact.angle,
        speed=case.impact.speed,
        aim=case.impact.aim,
        standoff=case.impact.standoff,
        sensors=sensors,
    )


def _facts(results: Results) -> Table:
    """Case and record in rows: what, value."""
    case, measured = results.case, results.measured
    plate, bird, metal = case.plate, case.bird, case.plate.material
    normal_momentum = bird.actual_mass * case.normal_speed
    rows = [
        ("plate", f"{quantity(plate.length, 'm')} × {quantity(plate.width, 'm')} × {quantity(plate.thickness, 'm')}"),
        ("plate's edges", f"{plate.edges}; {plate.elements[0]} × {plate.elements[1]} shell elements"),
        ("plate's metal", f"E {metal.young / 1e9:.4g} GPa, ν {metal.poisson:g}, ρ {metal.density:g} kg/m³"),
        ("yield", f"{quantity(metal.yield_stress, 'Pa')}, tangent modulus {quantity(metal.tangent_modulus, 'Pa')}"),
        ("bird", f"{words(bird.shape)}, {quantity(bird.diameter, 'm')} × {quantity(bird.length, 'm')} overall"),
        ("bird's mass", f"{quantity(bird.actual_mass, 'kg', 4)} at {bird.actual_density:.4g} kg/m³"),
        ("bird's model", f"{bird.material.model} with {bird.material.eos.kind}, {bird.method}, {bird.lattice} lattice"),
        ("speed", f"{quantity(case.impact.speed, 'm/s')}, normal component {quantity(case.normal_speed, 'm/s')}"),
        ("normal momentum", f"{normal_momentum:.4g} N s"),
        ("simulated time", quantity(case.time.end, "s")),
        ("record", f"{short_name(measured)}: {origin(measured)}"),
        *(("provenance", line) for line in measured.provenance),
    ]
    return Table(("what", "value"), tuple(rows), "The case and the record, as the program read them.")
