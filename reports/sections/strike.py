"""The strike itself at the best answer: pictures at the snapshots, forces, and the impulse they carry."""

from __future__ import annotations

import numpy as np

from reports.blocks import Block, Paragraph, Section, drawing, photograph
from reports.figures.force import force_figure, impulse
from reports.figures.plate_fields import plate_figure
from reports.figures.quantities import milliseconds, parameter_label, quantity, shown
from reports.figures.strike import magnification, push_direction, strike_figure
from reports.results import Results
from solver.build_plate import mesh_of

PICTURE_TIME = 1.5e-3  # s: near the plate's peak in the reference strike, where the models are usually compared


def section(results: Results) -> Section:
    """Everything here is the best method's verification run."""
    words = f"All of this section is simulated: the verification run of the {results.best}, {_values(results)}."
    return Section("strike", "The simulated strike", (Paragraph(words), *_pictures(results), *_forces(results)))


def _values(results: Results) -> str:
    """The identified parameters with their values; the others claim nothing."""
    told = {name: e for name, e in results.answer.parameters.items() if e.identified and e.value is not None}
    if not told:
        return "at a point of the parameters' ranges that claims nothing about them"
    return "at " + ", ".join(f"{parameter_label(name)} {quantity(e.value or 0.0, e.unit)}" for name, e in told.items())


def _pictures(results: Results) -> tuple[Block, ...]:
    """Side views of all snapshots, the plate from above at the one nearest 1.5 ms."""
    snapshots = results.verified[results.best].snapshots
    if not snapshots:
        return (
            Paragraph(
                "There is no picture of the strike: the case names no time.snapshots, or its run was cleared away."
            ),
        )
    plate = results.case.plate
    resting = mesh_of(plate).nodes
    times = ", ".join(f"{float(milliseconds(np.asarray(s.time))):.2f}" for s in snapshots[:4])
    factor = magnification(snapshots[:4], resting)
    caption = (
        f"Simulated bird and plate from the side at {times} ms, one scale of pressure (its top is the 99th "
        f"percentile). Bird and plate are to scale; blue: the plate's displacement along its length, × {factor}. "
        "Grey: eroded particles."
    )
    side = photograph(
        "strike", strike_figure(snapshots, resting, plate.thickness), caption, f"Side views of the strike at {times} ms"
    )
    nearest = min(snapshots, key=lambda s: abs(s.time - PICTURE_TIME))
    push = push_direction(snapshots)
    deflection = push * (nearest.nodes[:, 2] - resting[:, 2])
    at = quantity(nearest.time, "s")
    words = (
        f"The simulated plate from above at {at}: displacement up to {quantity(float(deflection.max()), 'm')}, von "
        f"Mises stress up to {shown(nearest.plate_stress, 'Pa')[0].max():.3g} MPa (yield "
        f"{quantity(plate.material.yield_stress, 'Pa')}). White dots: the bird's particles."
    )
    top = photograph("plate", plate_figure(nearest, resting, push), words, f"Plate from above at {at}")
    return side, top


def _forces(results: Results) -> tuple[Block, ...]:
    """Force sensors of the run with their impulse against the bird's normal momentum."""
    run = results.verified[results.best]
    forces = {name: values for name, values in run.channels.items() if run.units[name] == "N"}
    if not forces:
        return (Paragraph("The case has no force sensors, so there is no force history."),)
    momentum = results.case.bird.actual_mass * results.case.normal_speed
    parts = []
    for name, force in forces.items():
        top, given = int(np.argmax(np.abs(force))), float(impulse(run.time, force)[-1])
        peak = f"peak {quantity(float(force[top]), 'N')} at {quantity(float(run.time[top]), 's')}"
        parts.append(f"{name.replace('_', ' ')}: {peak}, impulse {given:.3g} N s, {100 * given / momentum:.0f} %")
    caption = (
        f"Simulated forces on the plate and their impulse. The bird brings {momentum:.3g} N s normally (100 %); "
        f"by the end of the run, {'; '.join(parts)}."
    )
    return (drawing("force", force_figure(run.time, forces, momentum), caption),)
