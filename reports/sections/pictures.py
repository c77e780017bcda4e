"""The impact in pictures: in motion, by stress at one instant, and the bird's shape over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from birdstrike.data.histories import Snapshot
from birdstrike.reports.blocks import Block, Paragraph, Picture, Section, photograph
from birdstrike.reports.comparison.models import PICTURE_TIME
from birdstrike.reports.figures.cut import Sheets
from birdstrike.reports.figures.quantities import milliseconds, quantity, shown
from birdstrike.reports.figures.shapes import shapes_figure
from birdstrike.reports.figures.stress import stress_figure
from birdstrike.reports.figures.views import Scene, nearest, push_direction
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.animation import animation
from birdstrike.solver.build import aimed_at, rest_mesh
from birdstrike.solver.case.struck import Plane

ASLANT = (
    "The struck part lies aslant in space. The pictures are drawn along it: x and y lie in its plane, from the point "
    "that is struck, and heights are along its normal."
)
SHAPES = (0.25, 0.5, 0.75, 1.0)  # of the time from contact to the end, where the case names no snapshots


def section(results: Results) -> Section:
    """Animation, stresses, shapes; or why there are none."""
    seen = {model.title: model.run.snapshots for model in results.models.values() if model.run is not None}
    plane = results.case.struck_plane
    seen = {title: along_plate(snapshots, plane) for title, snapshots in seen.items() if snapshots}
    if not seen:
        blocks: tuple[Block, ...] = (
            Paragraph("There is no picture of the impact: no simulation with snapshots is at hand."),
        )
        return Section("pictures", "The impact in pictures", blocks)
    scene = _scene(results, next(iter(seen.values())))
    keys = {model.title: model.key for model in results.models.values()}
    moving = animation(results, seen, keys, scene) if min(map(len, seen.values())) > 4 else None
    blocks = (
        *([] if plane is None else [Paragraph(ASLANT)]),
        *([moving] if moving else []),
        _stress(results, seen, scene),
        _shapes(results, seen, scene),
    )
    return Section("pictures", "The impact in pictures", blocks)


def along_plate(snapshots: Sequence[Snapshot], plane: Plane | None) -> tuple[Snapshot, ...]:
    """The snapshots in the axes of the plane that is struck, from its point; of one at z = 0 as they are."""
    if plane is None:
        return tuple(snapshots)
    return tuple(
        replace(s, particles=plane.seen(s.particles), nodes=plane.seen(s.nodes), velocity=s.velocity @ plane.axes.T)
        for s in snapshots
    )


def _scene(results: Results, snapshots: Sequence[Snapshot]) -> Scene:
    """snapshots: as `along_plate` has them."""
    bird, plate = results.case.bird, results.case.plate
    spacing = (bird.volume / len(snapshots[0].particles)) ** (1.0 / 3.0)
    mesh, target = rest_mesh(results.case), results.case.target
    thick = plate.thickness if target is None else {name: part.thickness for name, part in target.parts.items()}
    resting, aim, plane = mesh.nodes, aimed_at(results.case), results.case.struck_plane
    if plane is not None:
        resting, aim = plane.seen(resting), plane.seen(aim)
    up = -push_direction(snapshots)
    sheets = Sheets.of(mesh, thick)
    return Scene(resting, plate.thickness, spacing, up, sheets, float(aim[1]), (0.0, 0.0, -up))


def _stress(results: Results, seen: dict[str, tuple[Snapshot, ...]], scene: Scene) -> Picture:
    chosen = {title: nearest(snapshots, PICTURE_TIME) for title, snapshots in seen.items()}
    at = quantity(next(iter(chosen.values())).time, "s")
    parts = [
        f"{title}: bird {_mpa(float(np.median(s.bird_stress[~s.eroded])))} (median), plate up to "
        f"{_mpa(float(s.plate_stress.max()))}"
        for title, s in chosen.items()
        if (~s.eroded).any() and len(s.plate_stress)
    ]
    plate = results.case.plate
    yields = "" if plate.rigid else f" The plate's metal yields at {quantity(plate.material.yield_stress, 'Pa')}."
    caption = (
        f"Simulated von Mises stress at {at}, from the front (the bird opened at its mid-plane) and from the top. One "
        f"scale for all birds, by decades, and one for all plates. {'; '.join(parts)}.{yields} "
        "Grey: eroded pieces, which push nothing."
    )
    return photograph("stress", stress_figure(chosen, scene), caption, f"Stress of bird and plate at {at} by model")


def _mpa(stress: float) -> str:
    return quantity(stress, "Pa", 2)


def _shapes(results: Results, seen: dict[str, tuple[Snapshot, ...]], scene: Scene) -> Picture:
    instants = results.case.time.snapshots[:4] or _evenly(results)
    last = {title: nearest(snapshots, instants[-1]) for title, snapshots in seen.items()}
    spread = [f"{title} {_length(s)}" for title, s in last.items()]
    taken = [nearest(next(iter(seen.values())), t).time for t in instants]
    times = ", ".join(f"{float(milliseconds(np.asarray(t))):.2f}" for t in taken)
    end, first = quantity(taken[-1], "s"), next(iter(seen.values()))[0]
    caption = (
        f"Simulated bird and plate from the front at {times} ms, to scale, on one scale of pressure (its top is the "
        f"99th percentile). Extent of the bird along the plate at {end}: {', '.join(spread)}; {_length(first)} at "
        f"{quantity(first.time, 's')}. Grey: eroded pieces."
    )
    figure = shapes_figure(seen, instants, scene)
    return photograph("shapes", figure, caption, f"Front views of the impact at {times} ms by model")


def _evenly(results: Results) -> tuple[float, ...]:
    start, end = results.case.first_contact, results.case.time.end
    return tuple(start + share * (end - start) for share in SHAPES)


def _length(snapshot: Snapshot) -> str:
    """Extent along x of all but the outermost hundredth of the pieces that are left."""
    x = snapshot.particles[~snapshot.eroded, 0]
    if not x.size:
        return "nothing left"
    low, high = np.percentile(shown(x, "m")[0], (0.5, 99.5))
    return f"{high - low:.0f} mm"
