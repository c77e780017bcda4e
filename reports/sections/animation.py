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
from birdstrike.reports.figures.quantities import milliseconds, quantity, shown
from birdstrike.reports.figures.shapes import PRESSURE_COLOURS, pressure_scale
from birdstrike.reports.figures.stress import PLATE_COLOURS
from birdstrike.reports.figures.switches import COLOURS
from birdstrike.reports.figures.views import Scene, mid_line, window
from birdstrike.reports.results.results import Results
from birdstrike.solver.build import rest_mesh

MOST_PARTICLES, MOST_POINTS = 2200, 300
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
    scales, mesh = _scales(seen, scene), rest_mesh(results.case)
    line = mid_line(scene.resting)
    corners = shown(scene.resting[mesh.quads][:, :, :2], "m")[0]
    content = {
        "limits": {"x": _rounded(scales.x), "y": _rounded(scales.y), "z": _rounded(scales.z)},
        "thickness": 1e3 * scene.thickness,
        "spacing": 1e3 * scene.spacing,
        "pressure": {"top": scales.pressure, "colours": _colours(PRESSURE_COLOURS)},
        "displacement": {"limits": list(scales.displacement), "colours": _colours(PLATE_COLOURS)},
        "shells": _rounded(np.hstack([corners.min(axis=1), corners.max(axis=1)]).ravel()),
        "line": _rounded(shown(scene.resting[line, 0], "m")[0]),
        "rest": _rounded(scene.up * shown(scene.resting[line, 2], "m")[0]),
        "first": 1e3 * PICTURE_TIME,
        "sensor": _sensor(results),
        "models": [
            {
                "title": title,
                "colour": COLOURS[keys[title]],
                **_bird(snapshots, scales, scene),
                **_plate(snapshots, mesh.quads, scales, scene),
                **_curves(results, keys[title]),
            }
            for title, snapshots in seen.items()
        ],
    }
    return Animation("animation", embedded_json(content), _caption(seen, scene), WIDTH, HEIGHT)


def _scales(seen: Mapping[str, Sequence[Snapshot]], scene: Scene) -> Scales:
    every = [snapshot for snapshots in seen.values() for snapshot in snapshots]
    x, z = window(every, scene)
    half = 1.04e3 * float(np.abs(scene.resting[:, 1]).max())
    deflections = [deflection(snapshot, scene) for snapshot in every]
    largest = max(float(d.max()) for d in deflections)
    top = float(pressure_scale(every).vmax or 1.0)
    return Scales(x, np.array([-half, half]), z, top, (0.0, round(max(largest, 1e-3), 4)))


def deflection(snapshot: Snapshot, scene: Scene) -> Array:
    """Displacement of every node in the direction of the push, (m,) mm."""
    return shown(-scene.up * (snapshot.nodes[:, 2] - scene.resting[:, 2]), "m")[0]


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


def _plate(snapshots: Sequence[Snapshot], quads: NDArray[np.int64], scales: Scales, scene: Scene) -> dict[str, Any]:
    """Frames of every shell's displacement, the torn ones gone, and of the mid line's [mm]."""
    low, high = scales.displacement
    found = np.stack([deflection(s, scene) for s in snapshots])
    number = {tuple(quad): i for i, quad in enumerate(quads.tolist())}
    torn = np.ones((len(snapshots), len(quads)), np.bool_)
    for frame, snapshot in enumerate(snapshots):
        torn[frame, [number[tuple(quad)] for quad in snapshot.quads.tolist()]] = False
    return {
        "shells": packed((found[:, quads].mean(axis=2) - low) / (high - low), "u1", torn),
        "line": [_rounded(row, 3) for row in found[:, mid_line(scene.resting)]],
    }


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
    time, values = results.record.points(name) if recorded else (np.empty(0), np.empty(0))
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


def _caption(seen: Mapping[str, Sequence[Snapshot]], scene: Scene) -> str:
    parts = []
    for title, snapshots in seen.items():
        largest = [float(deflection(s, scene).max()) for s in snapshots]
        at = int(np.argmax(largest))
        parts.append(f"{title} {largest[at]:.3g} mm at {quantity(snapshots[at].time, 's')}")
    frames = min(len(snapshots) for snapshots in seen.values())
    return (
        f"The simulations in motion, {frames} instants each. Above: the bird from the front, coloured by "
        "pressure, to scale with the plate; blue: the plate's displacement magnified. Below: the plate from the top, "
        "coloured by displacement in the direction of the push. Largest displacement anywhere on the plate: "
        f"{'; '.join(parts)}. Grey: eroded pieces."
    )


def _colours(colours: Colormap, steps: int = 64) -> list[str]:
    return [to_hex(colour) for colour in colours(np.linspace(0.0, 1.0, steps))]


def _mm(values: Array) -> list[float]:
    return _rounded(shown(values, "m")[0], 4)


def _rounded(values: ArrayLike, digits: int = 2) -> list[float]:
    return np.round(np.asarray(values, dtype=float), digits).tolist()
