"""A target as it is struck: its parts in colour, supports, rivets, sensors, bird and velocity, seen from both sides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, KDTree

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import quantity, words
from birdstrike.reports.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    styled,
    write_figure,
)
from birdstrike.solver.build import aimed_at, build_plate, direction_of, flight_to, surface_in_flight
from birdstrike.solver.case.case import Case
from birdstrike.solver.sensors.places import place_in_space, place_on, point_at
from birdstrike.solver.sensors.sensor import Placed
from birdstrike.solver.target.mesh import vector_areas
from birdstrike.solver.target.part_mesh import PartMesh

PART_COLOURS = ("#B8C7D3", SKY, GREEN, ORANGE, PURPLE, "#F0E442", BLUE, VERMILION)
SUPPORT_MARKS = ("s", "D", "^", "v", "<", ">", "p", "h")
MARK = "#D00000"
"""Of shells that something is said about."""
ELEVATION, TURN = np.deg2rad(32.0), np.deg2rad(-58.0)
"""Of the eye: above the surface, and from the length axis."""
LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])
IN_FRONT = 0.01
"""Of the target's extent, by which a shell must be nearer to the eye than what it hides."""
LETTER = 0.0092
"""Of a view's width, that a letter of a sensor's name takes."""
WIDER = 1.4
"""Least width of a view over its height."""
NAME_OFFSET = 16.0  # points between a support and its name
NEAR = 0.1
"""Of the target's extent, within which the names of two supports would overlap."""
LABELLED = 12
"""Sensors up to which each has its name in the picture."""


@dataclass(frozen=True)
class DrawnTarget:
    """What the picture shows, SI: nodes, facets, part of each, and where things are in space.

    bird: points of its outline, none where it is not drawn; marked (k,): facets that something is said about; plane
    (3, 3): axes of the plane that is struck, along length, width and the normal, from which the eye is counted.
    """

    nodes: Array
    quads: NDArray[np.int64]
    part: NDArray[np.int64]
    names: tuple[str, ...]
    supports: dict[str, Array]
    rivets: Array
    sensors: dict[str, Array]
    bird: Array
    centre: Array
    velocity: Array
    speed: float
    marked: NDArray[np.int64]
    plane: Array


def drawn_target(case: Case) -> DrawnTarget:
    """The case's target and bird before the impact; raises UserError where they cannot be built."""
    target = build_plate(case)
    parts = target.mesh.parts or {"plate": np.arange(len(target.quads))}
    part = np.zeros(len(target.quads), np.int64)
    for number, facets in enumerate(parts.values()):
        part[facets] = number
    direction = direction_of(case.impact)
    surface = surface_in_flight(case) + aimed_at(case)
    flight = flight_to(case, surface, 0.5 * case.plate.thickness, case.struck_plane)
    surface += (flight - case.impact.standoff) * direction
    supports = {name: target.mesh.nodes[target.supports.nodes[rows]] for name, rows in target.supports.sets.items()}
    if case.plate.rigid and case.target is None:
        supports = {}
    sensors = {}
    for name, sensor in case.sensors.items():
        if isinstance(sensor, Placed):
            where = (
                place_on(target.mesh, sensor.at)
                if sensor.point is None
                else place_in_space(target.mesh, np.array(sensor.point), sensor.part)
            )
            sensors[name] = point_at(target.mesh, *where)
    rivets = np.empty((0, 3)) if target.rivets is None else target.rivets.points
    names = tuple(parts)
    where = (target.mesh.nodes, target.quads, part, names, supports, rivets, sensors)
    found = [] if case.target is None else case.target.findings()
    marked = np.unique(np.concatenate([np.empty(0, np.int64), *(one.shells for one in found)]))
    plane = np.eye(3) if case.struck_plane is None else case.struck_plane.axes
    return DrawnTarget(*where, surface, surface.mean(axis=0), direction, case.impact.speed, marked, plane)


@styled
def target_figure(shown: DrawnTarget) -> Figure:
    """The struck side above, the back below, in parallel projection to one scale."""
    figure = Figure(figsize=(7.4, 8.6), layout="constrained")
    views = figure.subplots(2, 1)
    for axes, behind in zip(views, (False, True), strict=True):
        _view(axes, shown, behind)
    labelled = len(shown.sensors) <= LABELLED
    _to_one_scale(list(views), max((len(words(name)) for name in shown.sensors if labelled), default=0))
    handles = [
        Patch(facecolor=PART_COLOURS[i % len(PART_COLOURS)], edgecolor=GREY, label=words(name))
        for i, name in enumerate(shown.names)
    ]
    handles += [
        Line2D([], [], color=BLACK, marker=mark, markersize=4, linestyle="", label=f"held: {words(name)}")
        for name, mark in _marks(shown)
    ]
    if len(shown.rivets):
        label = f"rivets ({len(shown.rivets)})"
        handles.append(Line2D([], [], color=PURPLE, marker="o", markersize=3, linestyle="", label=label))
    if shown.sensors:
        handles.append(Line2D([], [], color=VERMILION, marker="P", markersize=6, linestyle="", label="sensors"))
    placed = np.concatenate([np.empty((0, 3)), *shown.supports.values(), *(p[None] for p in shown.sensors.values())])
    if any(hidden_from(shown, placed, axes_of_view(shown, behind)).any() for behind in (False, True)):
        hollow = {"markerfacecolor": "none", "markersize": 5, "linestyle": ""}
        handles.append(Line2D([], [], color=GREY, marker="s", label="hollow: behind a shell", **hollow))
    if len(shown.marked):
        label = f"doubtful shells ({len(shown.marked)})"
        handles.append(Line2D([], [], color=MARK, marker="o", markerfacecolor="none", linestyle="", label=label))
    figure.legend(handles=handles, loc="outside upper left", ncols=4, handlelength=1.4)
    return figure


def _to_one_scale(views: list[Axes], letters: int) -> None:
    """Limits of one size, wide enough for a narrow target to clear the compass and for names of so many letters."""
    limits = np.array([[axes.get_xlim(), axes.get_ylim()] for axes in views])
    across, up = np.ptp(limits, axis=2).max(axis=0)
    names = min(LETTER * letters, 0.5)
    whole = max(across / (1.0 - names), WIDER * up)
    for axes, ((left, right), low_high) in zip(views, limits, strict=True):
        start = left - 0.5 * max((1.0 - names) * whole - (right - left), 0.0)
        axes.set_xlim(start, start + whole)
        axes.set_ylim(low_high.mean() - 0.5 * up, low_high.mean() + 0.5 * up)


def _marks(shown: DrawnTarget) -> Iterator[tuple[str, str]]:
    """Every support with its mark; of many alike, such as load cells, in turn."""
    for i, name in enumerate(shown.supports):
        yield name, SUPPORT_MARKS[i % len(SUPPORT_MARKS)]


def axes_of_view(shown: DrawnTarget, behind: bool) -> Array:
    """Rows (3, 3): to the right, up, and towards the eye, which looks at the struck side, or at the back."""
    elevation = -ELEVATION if behind else ELEVATION
    eye = np.array([np.cos(elevation) * np.cos(TURN), np.cos(elevation) * np.sin(TURN), np.sin(elevation)])
    right = np.array([-np.sin(TURN), np.cos(TURN), 0.0])
    return np.stack([right, np.cross(eye, right), eye]) @ shown.plane


def _view(axes: Axes, shown: DrawnTarget, behind: bool) -> None:
    """One view; what lies nearer to the eye is drawn later."""
    look = axes_of_view(shown, behind)
    _facets(axes, shown, look)
    for name, mark in _marks(shown):
        held, hidden = 1e3 * shown.supports[name] @ look[:2].T, hidden_from(shown, shown.supports[name], look)
        axes.plot(*held[~hidden].T, mark, color=BLACK, markersize=2.2, alpha=0.8, zorder=3)
        axes.plot(*held[hidden].T, mark, color=GREY, markersize=2.2, markerfacecolor="none", alpha=0.8, zorder=3)
    if len(shown.supports) > 1:
        _support_names(axes, shown, look)
    if behind and len(shown.rivets):
        axes.plot(*(1e3 * shown.rivets @ look[:2].T).T, "o", color=PURPLE, markersize=1.8, zorder=4)
    if len(shown.marked):
        middles = 1e3 * shown.nodes[shown.quads[shown.marked]].mean(axis=1) @ look[:2].T
        axes.plot(*middles.T, "o", color=MARK, markerfacecolor="none", markersize=6.0, markeredgewidth=1.2, zorder=4)
    if not behind and len(shown.bird):
        _bird(axes, shown, look)
    _sensors(axes, shown, look)
    axes.set_aspect("equal")
    axes.set_axis_off()
    flying = f"; velocity {quantity(shown.speed, 'm/s')}" if len(shown.bird) else ""
    side = "From behind" if behind else f"From the impact side{flying}"
    axes.set_title(side, loc="left")
    _compass(axes, look)


def _support_names(axes: Axes, shown: DrawnTarget, look: Array) -> None:
    """The name of each set of supports beside the node that lies in its middle, on the target's side of it.

    Names of sets whose middles lie together stand below the first of them.
    """
    around = [withStroke(linewidth=2.5, foreground="white")]
    near, named = NEAR * float(np.ptp(shown.nodes, axis=0).max()), list[tuple[Array, Array, list[str]]]()
    for name, nodes in shown.supports.items():
        middle = nodes[np.argmin(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1))]
        place, inward = look[:2] @ middle, look[:2] @ (shown.nodes.mean(axis=0) - middle)
        to = NAME_OFFSET * inward / max(float(np.linalg.norm(inward)), 1e-12)
        beside = (lines for other, _, lines in named if float(np.linalg.norm(other - place)) < near)
        lines = next(beside, None)
        if lines is None:
            named.append((place, to, [words(name)]))
        else:
            lines.append(words(name))
    where = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 8}
    for place, to, lines in named:
        axes.annotate("\n".join(lines), tuple(1e3 * place), tuple(to), path_effects=around, zorder=6, **where)


def hidden_from(shown: DrawnTarget, points: Array, look: Array) -> NDArray[np.bool_]:
    """Whether a shell lies between points (k, 3) [m] and the eye, which looks along the last row of `look`."""
    corners = shown.nodes[shown.quads] @ look.T
    triangles = np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]])
    a, sides = triangles[:, 0], triangles[:, 1:] - triangles[:, :1]
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    seen = np.abs(area) > 1e-12
    a, sides, area = a[seen], sides[seen], area[seen]
    reach = float(np.linalg.norm(triangles[seen][:, :, :2] - a[:, None, :2], axis=2).max(initial=0.0))
    near = IN_FRONT * float(np.ptp(shown.nodes, axis=0).max())
    places, found = points @ look.T, np.zeros(len(points), np.bool_)
    if not len(a):
        return found
    for k, around in enumerate(KDTree(a[:, :2]).query_ball_point(places[:, :2], reach)):
        one = np.array(around, np.int64)
        to, side = places[k] - a[one], sides[one]
        u = (to[:, 0] * side[:, 1, 1] - to[:, 1] * side[:, 1, 0]) / area[one]
        v = (side[:, 0, 0] * to[:, 1] - side[:, 0, 1] * to[:, 0]) / area[one]
        over = u * side[:, 0, 2] + v * side[:, 1, 2] - to[:, 2]
        found[k] = bool(((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (over > near)).any())
    return found


def _facets(axes: Axes, shown: DrawnTarget, look: Array) -> None:
    """Facets of all parts, shaded by their slope to the light."""
    corners, normals = shown.nodes[shown.quads], vector_areas(shown.nodes, shown.quads)
    normal = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    shade = 0.55 + 0.45 * np.abs(normal @ (LIGHT @ shown.plane))
    colours = np.array([to_rgb(PART_COLOURS[i % len(PART_COLOURS)]) for i in range(len(shown.names))])
    layer = shown.part * 0.6 * np.sqrt(np.linalg.norm(normals, axis=1).mean()) * np.sign(look[2] @ shown.plane[2])
    order = np.argsort(
        corners.mean(axis=1) @ look[2] - layer, kind="stable"
    )  # of sheets that touch, the first is outside
    faces = (colours[shown.part] * shade[:, None])[order]
    polygons = (1e3 * corners @ look[:2].T)[order]
    edges = np.clip(0.82 * faces, 0.0, 1.0)
    edges[np.isin(order, shown.marked)] = to_rgb(MARK)
    axes.add_collection(
        PolyCollection(list(polygons), facecolors=faces, edgecolors=edges, linewidths=0.25, rasterized=True, zorder=1)
    )
    axes.autoscale_view()


def _bird(axes: Axes, shown: DrawnTarget, look: Array) -> None:
    """The bird's outline and the way that it flies."""
    flat = 1e3 * shown.bird @ look[:2].T
    outline = flat[ConvexHull(flat).vertices]
    axes.fill(*outline.T, facecolor="#F6DFC1", edgecolor=ORANGE, linewidth=1.2, alpha=0.85, zorder=5)
    reach = float(np.linalg.norm(np.ptp(shown.bird, axis=0))) * 0.55
    tail, head = (1e3 * (shown.centre + way * shown.velocity) @ look[:2].T for way in (-0.25 * reach, 0.75 * reach))
    arrow = {"arrowstyle": "-|>", "color": VERMILION, "lw": 2.0}
    axes.annotate("", xy=tuple(head), xytext=tuple(tail), arrowprops=arrow, zorder=6)


def _sensors(axes: Axes, shown: DrawnTarget, look: Array) -> None:
    """Places of the sensors, and their names in a column of their own where they are few."""
    if not shown.sensors:
        return
    places = {name: 1e3 * point @ look[:2].T for name, point in shown.sensors.items()}
    flat, hidden = np.array(list(places.values())), hidden_from(shown, np.array(list(shown.sensors.values())), look)
    axes.plot(*flat[~hidden].T, "P", color=VERMILION, markersize=5, markeredgecolor="white", zorder=7)
    axes.plot(*flat[hidden].T, "P", color=VERMILION, markersize=5, markerfacecolor="none", zorder=7)
    if len(places) > LABELLED:
        return
    across = axes.dataLim
    for at, (name, place) in enumerate(sorted(places.items(), key=lambda entry: -entry[1][1])):
        up = 0.5 * (len(places) - 1) - at
        axes.annotate(
            words(name),
            tuple(place),
            xytext=(across.x1 + 0.03 * across.width, across.y0 + 0.5 * across.height + up * 0.055 * across.height),
            textcoords="data",
            fontsize=8,
            va="center",
            color=VERMILION,
            arrowprops={"arrowstyle": "-", "color": VERMILION, "lw": 0.5, "alpha": 0.7, "shrinkB": 3},
            zorder=7,
        )


def _compass(axes: Axes, look: Array) -> None:
    """The directions of length, width and impact."""
    corner, size = (0.03, 0.05), 0.09
    for name, axis in zip("xyz", np.eye(3), strict=True):
        tip = look[:2] @ axis
        end = (corner[0] + size * tip[0], corner[1] + size * tip[1])
        arrow = {"arrowstyle": "-|>", "color": GREY, "lw": 0.9}
        share = "axes fraction"
        axes.annotate("", xy=end, xytext=corner, arrowprops=arrow, xycoords=share, textcoords=share)
        axes.text(corner[0] + 1.35 * size * tip[0], corner[1] + 1.35 * size * tip[1], name, transform=axes.transAxes)


def write_picture(case: Case, path: Path) -> None:
    """The case's target as a PNG, SVG or PDF file; raises as `write_figure` does."""
    write_figure(target_figure(drawn_target(case)), path)


def write_mesh_picture(mesh: PartMesh, shells: NDArray[np.int64], path: Path) -> None:
    """A mesh alone, with some shells (k,) marked; raises as `write_figure` does."""
    nothing = np.empty((0, 3))
    where = (mesh.nodes, mesh.quads, mesh.part, mesh.parts, {}, nothing, {})
    write_figure(target_figure(DrawnTarget(*where, nothing, np.zeros(3), np.zeros(3), 0.0, shells, np.eye(3))), path)
