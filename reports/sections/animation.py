"""The impact in motion: snapshots packed into the page for its own player, all models on one scale.

Positions take 16 bits of the window that is shown (some 0.02 mm), pressures and displacements 8 bits of their scale.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import Colormap, to_hex
from numpy.typing import ArrayLike, NDArray

from birdstrike.data.histories import Array, Snapshot
from birdstrike.reports.blocks import Animation, embedded_json
from birdstrike.reports.comparison.end_state import sensor_of_kind
from birdstrike.reports.comparison.models import PICTURE_TIME
from birdstrike.reports.figures.quantities import milliseconds, quantity, shown, words
from birdstrike.reports.figures.shapes import PRESSURE_COLOURS, pressure_scale
from birdstrike.reports.figures.stress import PLATE_COLOURS
from birdstrike.reports.figures.switches import COLOURS
from birdstrike.reports.figures.views import Scene, mid_line, part_colours, section_outlines, window
from birdstrike.reports.results.results import Results
from birdstrike.solver.target.mesh import vector_areas

MOST_PARTICLES, MOST_POINTS = 2200, 300
MOST_MESH = 3_000_000  # numbers of two bytes: nodes of a target at all instants of all models
WIDTH, HEIGHT = 872, 690  # CSS pixels
GONE = 255  # in place of a step of an 8-bit scale: what is eroded or torn


@dataclass(frozen=True)
class Scales:
    """What all models share: limits of x, y, height [mm], pressure's top [MPa], displacement's limits [mm].

    Displacement starts at 0: where the plate swings back, it is drawn as 0.
    """

    x: Array
    y: Array
    z: Array
    pressure: float
    displacement: tuple[float, float]


def animation(
    results: Results, seen: Mapping[str, Sequence[Snapshot]], keys: Mapping[str, str], scene: Scene
) -> Animation:
    """The player's data for the models' snapshots `seen` (by title, `keys` to their switches), and a caption."""
    seen = _thinned(seen, len(scene.resting)) if results.case.target is not None else seen
    scales, line = _scales(seen, scene), mid_line(scene.resting)
    corners = shown(scene.resting[scene.sheets.quads][:, :, :2], "m")[0]
    box = None if results.case.target is None else _box(seen)
    content = {
        "limits": {"x": _rounded(scales.x), "y": _rounded(scales.y), "z": _rounded(scales.z)},
        "thickness": 1e3 * scene.thickness,
        "spacing": 1e3 * scene.spacing,
        "pressure": {"top": scales.pressure, "colours": _colours(PRESSURE_COLOURS)},
        "displacement": {"limits": list(scales.displacement), "colours": _colours(PLATE_COLOURS)},
        "shells": _rounded(np.hstack([corners.min(axis=1), corners.max(axis=1)]).ravel()),
        "line": _rounded(shown(scene.resting[line, 0], "m")[0]),
        "parts": [{"name": words(n), "colour": to_hex(c)} for n, c in zip(*_parts(scene), strict=True)],
        "solid": None if box is None else _solid(scene, box),
        "first": 1e3 * PICTURE_TIME,
        "sensor": _sensor(results),
        "models": [
            {
                "title": title,
                "colour": COLOURS[keys[title]],
                **_bird(snapshots, scales, scene),
                **_plate(snapshots, scales, scene),
                **({} if box is None else {"nodes": _nodes(snapshots, box)}),
                **_curves(results, keys[title]),
            }
            for title, snapshots in seen.items()
        ],
    }
    return Animation("animation", embedded_json(content), _caption(seen, scene, box is not None), WIDTH, HEIGHT)


def _thinned(seen: Mapping[str, Sequence[Snapshot]], nodes: int) -> dict[str, Sequence[Snapshot]]:
    """So many instants, evenly, that all models' meshes take at most MOST_MESH numbers."""
    most = max(12, MOST_MESH // (3 * nodes * len(seen)))
    chosen = {}
    for title, snapshots in seen.items():
        kept = np.unique(np.linspace(0, len(snapshots) - 1, min(most, len(snapshots))).round().astype(int))
        chosen[title] = [snapshots[i] for i in kept]
    return chosen


def _parts(scene: Scene) -> tuple[tuple[str, ...], Array]:
    return scene.sheets.names, part_colours(scene.sheets.names)


def _box(seen: Mapping[str, Sequence[Snapshot]]) -> tuple[Array, Array]:
    """Lowest and highest x, y, z [m] of any facet that is drawn: what torn-off nodes do widens nothing."""
    held = [s.nodes[np.unique(s.quads)] for snapshots in seen.values() for s in snapshots]
    return np.min([x.min(axis=0) for x in held], axis=0), np.max([x.max(axis=0) for x in held], axis=0)


def _solid(scene: Scene, box: tuple[Array, Array]) -> dict[str, Any]:
    """The mesh that the player draws in space: facets, their parts, and the box [mm] in which nodes are packed."""
    quads = scene.sheets.quads
    return {
        "quads": base64.b64encode(quads.astype("<u4").tobytes()).decode("ascii"),
        "part": base64.b64encode(scene.sheets.part.astype("u1").tobytes()).decode("ascii"),
        "low": _rounded(1e3 * box[0]),
        "high": _rounded(1e3 * box[1]),
        "up": scene.up,
        "size": round(1e3 * _typical_side(scene), 2),
    }


def _typical_side(scene: Scene) -> float:
    """Root of the facets' mean area [m]."""
    return float(np.sqrt(np.linalg.norm(vector_areas(scene.resting, scene.sheets.quads), axis=1).mean()))


def _nodes(snapshots: Sequence[Snapshot], box: tuple[Array, Array]) -> str:
    """Frames of every node's place in the box."""
    size = np.maximum(box[1] - box[0], 1e-6)
    return packed(np.stack([(s.nodes - box[0]) / size for s in snapshots]), "<u2")


def _scales(seen: Mapping[str, Sequence[Snapshot]], scene: Scene) -> Scales:
    every = [snapshot for snapshots in seen.values() for snapshot in snapshots]
    x, z = window(every, scene)
    half = 1.04e3 * float(np.abs(scene.resting[:, 1]).max())
    deflections = [deflection(snapshot, scene)[np.unique(snapshot.quads)] for snapshot in every]
    largest = max(float(d.max()) for d in deflections)
    top = float(pressure_scale(every).vmax or 1.0)
    return Scales(x, np.array([-half, half]), z, top, (0.0, round(max(largest, 1e-3), 4)))


def deflection(snapshot: Snapshot, scene: Scene) -> Array:
    """Displacement of every node in the direction of the push, (m,) mm."""
    return shown((snapshot.nodes - scene.resting) @ scene.push, "m")[0]


def _bird(snapshots: Sequence[Snapshot], scales: Scales, scene: Scene) -> dict[str, Any]:
    """Frames of at most MOST_PARTICLES pieces, those of the mid-plane last: x, y, height interleaved, and pressure."""
    depth = np.abs(snapshots[0].particles[:, 1])
    count = min(len(depth), MOST_PARTICLES)
    some = np.unique(np.linspace(0, len(depth) - 1, count).round().astype(int))
    chosen = some[np.argsort(-depth[some], kind="stable")]
    places = np.stack([shown(s.particles[chosen], "m")[0] * (1.0, 1.0, scene.up) for s in snapshots])
    low, high = np.column_stack([scales.x, scales.y, scales.z])
    pressures = np.stack([shown(s.pressure[chosen], "Pa")[0] for s in snapshots])
    gone = np.stack([s.eroded[chosen] for s in snapshots])
    return {
        "times": _rounded(milliseconds(np.array([s.time for s in snapshots])), 4),
        "particles": len(chosen),
        "share": len(chosen) / len(depth),
        "places": packed((places - low) / (high - low), "<u2"),
        "pressures": packed(pressures / scales.pressure, "u1", gone),
    }


def _plate(snapshots: Sequence[Snapshot], scales: Scales, scene: Scene) -> dict[str, Any]:
    """Frames of every shell's displacement, the torn ones gone, of the mid line's [mm], of the section's outlines."""
    (low, high), quads = scales.displacement, scene.sheets.quads
    found = np.stack([deflection(s, scene) for s in snapshots])
    torn = np.ones((len(snapshots), len(quads)), np.bool_)
    for frame, snapshot in enumerate(snapshots):
        torn[frame, scene.sheets.numbers(snapshot.quads)] = False
    return {
        "shells": packed((found[:, quads].mean(axis=2) - low) / (high - low), "u1", torn),
        "line": [_rounded(row, 3) for row in found[:, mid_line(scene.resting)]],
        "cuts": [_outlines(snapshot, scene) for snapshot in snapshots],
    }


def _outlines(snapshot: Snapshot, scene: Scene) -> list[float]:
    """Four corners, x and height [mm], and the part of every facet that the section's plane cuts, one after another."""
    outlines, _, facet = section_outlines(snapshot, scene)
    return _rounded(np.column_stack([outlines.reshape(-1, 8), scene.sheets.part[facet]]).ravel())


def packed(shares: Array, kind: str, gone: NDArray[np.bool_] | None = None) -> str:
    """Shares 0..1 of a scale as unsigned integers of `kind`, base64; with `gone`, the highest step means gone."""
    top = int(np.iinfo(np.dtype(kind)).max) - (0 if gone is None else 1)
    steps = np.round(np.clip(shares, 0.0, 1.0) * top)
    if gone is not None:
        steps[gone] = GONE
    return base64.b64encode(steps.astype(kind).tobytes()).decode("ascii")


def _sensor(results: Results) -> dict[str, Any] | None:
    """The displacement that is drawn against time: its name, and the record's points where it has them."""
    name = _displacement(results)
    if name is None:
        return None
    recorded = name in results.channels
    time, values = results.used.points(name) if recorded else (np.empty(0), np.empty(0))
    return {"name": name.replace("_", " "), "time": _rounded(milliseconds(time), 4), "values": _mm(values)}


def _displacement(results: Results) -> str | None:
    run = next((model.run for model in results.models.values() if model.run is not None), None)
    return None if run is None else sensor_of_kind(results.case, run, "displacement")


def _curves(results: Results, key: str) -> dict[str, Any]:
    """The model's displacement on its own clock, and by how much the record's is ahead [ms]."""
    name, model = _displacement(results), results.models[key]
    if name is None or model.run is None:
        return {"curve": None, "offset": 0.0}
    kept = np.linspace(0, len(model.run.time) - 1, min(len(model.run.time), MOST_POINTS)).round().astype(int)
    time, values = milliseconds(model.run.time[kept]), model.run.channels[name][kept]
    return {"curve": {"time": _rounded(time, 4), "values": _mm(values)}, "offset": round(1e3 * model.offset, 4)}


def _caption(seen: Mapping[str, Sequence[Snapshot]], scene: Scene, solid: bool) -> str:
    parts = []
    for title, snapshots in seen.items():
        live = [deflection(s, scene)[np.unique(s.quads)] for s in snapshots]
        largest = [float(d.max()) for d in live]
        at = int(np.argmax(largest))
        parts.append(f"{title} {largest[at]:.3g} mm at {quantity(snapshots[at].time, 's')}")
    frames = min(len(snapshots) for snapshots in seen.values())
    if solid:
        torn = [f"{t} {len(scene.sheets.quads) - len(s[-1].quads)}" for t, s in seen.items()]
        where = quantity(scene.middle, "m")
        return (
            f"The simulations in motion, {frames} instants each. Above: the bird from the front, coloured by pressure, "
            f"and every sheet that the plane y = {where} cuts, in its part's colour, to scale; a gap is a failed "
            "shell. Below: the deformed mesh in space, failed shells left out, and the bird; drag to turn it. Parts "
            "do not touch each other in the simulation, so a sheet that came loose may cross another. Failed "
            f"shells at the end, of {len(scene.sheets.quads)}: {'; '.join(torn)}. Largest displacement of any shell at "
            f"these instants: {'; '.join(parts)}."
        )
    return (
        f"The simulations in motion, {frames} instants each. Above: the bird from the front, coloured by "
        "pressure, to scale with the plate; blue: the plate's displacement magnified. Below: the plate from the top, "
        "coloured by displacement in the direction of the push. Largest displacement anywhere on the plate at "
        f"these instants: {'; '.join(parts)}. Grey: eroded pieces."
    )


def _colours(colours: Colormap) -> list[str]:
    return [to_hex(colour) for colour in colours(np.linspace(0.0, 1.0, 64))]


def _mm(values: Array) -> list[float]:
    return _rounded(shown(values, "m")[0], 4)


def _rounded(values: ArrayLike, digits: int = 2) -> list[float]:
    return np.round(np.asarray(values, dtype=float), digits).tolist()
