"""The test set-up drawn to scale before impact: front view across the plate's length, top view onto it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Polygon, Rectangle
from matplotlib.patheffects import withStroke

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import quantity, words
from birdstrike.reports.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILION, styled

_WIDTH = 6.4  # in: a sketch, not a drawing
ROW = 0.06  # of the plate's width: sensors nearer than that across it stand in one row
HEIGHTS = (8, -16, 22, -30)  # points
POINTS = 96  # of an outline


@dataclass(frozen=True)
class SetUp:
    """Dimensions [m], `angle` [rad] from the plate's surface, `speed` [m/s], `sensors`: name -> (x, y) [m]."""

    length: float
    width: float
    thickness: float
    edges: str
    bird_shape: str
    bird_diameter: float
    bird_length: float
    angle: float
    speed: float
    aim: str
    standoff: float
    sensors: Mapping[str, tuple[float, float]]


@styled
def setup_figure(setup: SetUp) -> Figure:
    """Front view above (x to the right, impact from above), top view below, on one scale, lengths in mm."""
    outline = bird_outline(setup)
    height = outline[:, 1].max() + 0.02
    reach = min(outline[:, 0].min(), -setup.length / 2) - 0.03, setup.length / 2 + 0.15
    across = setup.width + 0.09
    scale = (_WIDTH - 0.7) / (reach[1] - reach[0])
    figure = Figure(figsize=(_WIDTH, scale * (height + 0.045 + across) + 1.0), layout="compressed")
    front, top = figure.subplots(2, 1, sharex=True, height_ratios=(height + 0.045, across))
    _front(front, setup, outline, height)
    _top(top, setup, outline)
    top.set_xlim(np.asarray(reach) * 1e3)
    return figure


def bird_outline(setup: SetUp, points: int = POINTS) -> Array:
    """Outline of the bird in the vertical plane of its velocity, (n, 2) [m]: x along the plate, z off mid-surface.

    The bird's axis lies on the velocity. `axis`: that axis points at the plate's centre; `first_touch`: the point
    that touches first is above the centre. The lowest point starts `standoff` above the plate's face.
    """
    local = _outline_along_axis(setup, points)
    forward = np.array([np.cos(setup.angle), -np.sin(setup.angle)])
    turned = local[:, :1] * forward + local[:, 1:] * np.array([np.sin(setup.angle), np.cos(setup.angle)])
    lift = setup.thickness / 2 + setup.standoff - turned[:, 1].min()
    lowest = turned[np.argmin(turned[:, 1]), 0]
    back = lift / np.tan(setup.angle) if setup.aim == "axis" else lowest + setup.standoff / np.tan(setup.angle)
    return turned + np.array([-back, lift])


def _outline_along_axis(setup: SetUp, points: int) -> Array:
    """Outline about the bird's centre, first coordinate along its axis, (n, 2) [m]."""
    radius, half = setup.bird_diameter / 2, setup.bird_length / 2
    if setup.bird_shape == "cylinder":
        return np.array([[-half, -radius], [half, -radius], [half, radius], [-half, radius]])
    turn = np.linspace(0.0, 2 * np.pi, points, endpoint=False)
    if setup.bird_shape in ("ellipsoid", "sphere"):
        along = radius if setup.bird_shape == "sphere" else half
        return np.column_stack((along * np.cos(turn), radius * np.sin(turn)))
    straight = (half - radius) * np.sign(np.cos(turn))
    return np.column_stack((straight + radius * np.cos(turn), radius * np.sin(turn)))


def _front(axes: Axes, setup: SetUp, outline: Array, height: float) -> None:
    """Plate in section, supports hatched, bird with its axis, velocity and angle."""
    length, half = setup.length * 1e3, setup.thickness * 5e2
    axes.add_patch(Rectangle((-length / 2, -half), length, 2 * half, facecolor="#9FB4C4", edgecolor=BLACK, lw=0.6))
    for side in (-1, 1):
        x = side * length / 2 - (14 if side < 0 else 0)
        axes.add_patch(Rectangle((x, -25), 14, 50, facecolor="white", edgecolor=GREY, hatch="/////", lw=0.6))
    axes.add_patch(Polygon(outline * 1e3, facecolor="#F6DFC1", edgecolor=ORANGE, lw=1.2))
    _velocity(axes, setup, outline)
    axes.text(length / 2 + 20, 0, f"plate {quantity(setup.thickness, 'm')}\n{setup.edges} edges", va="center")
    axes.set_ylim(-45, height * 1e3)
    _plain(axes, "Front view (plane of the plate's length)", "z [mm]")


def _velocity(axes: Axes, setup: SetUp, outline: Array) -> None:
    """The axis of flight with an arrow of 100 mm, the aimed point, the angle from the surface and the speed."""
    centre = outline.mean(axis=0) * 1e3
    forward = np.array([np.cos(setup.angle), -np.sin(setup.angle)])
    end = centre + forward * centre[1] / np.sin(setup.angle)
    axes.plot(*np.array([centre, end]).T, color=GREY, lw=0.8, linestyle="-.")
    _angle(axes, end, setup.angle)
    arrow = {"arrowstyle": "-|>", "color": VERMILION, "lw": 1.6}
    axes.annotate("", xy=tuple(centre + 50 * forward), xytext=tuple(centre - 50 * forward), arrowprops=arrow)
    degrees = np.degrees(setup.angle)
    text = f"{quantity(setup.speed, 'm/s')}, {degrees:.3g}° from the plate's surface"
    corner = np.array([outline[:, 0].max(), outline[:, 1].max()]) * 1e3
    axes.text(corner[0] + 12, corner[1] - 10, text, color=VERMILION, va="top")
    size = f"bird {quantity(setup.bird_diameter, 'm')} × {quantity(setup.bird_length, 'm')}, {words(setup.bird_shape)}"
    axes.text(corner[0] + 12, corner[1] - 34, size, va="top")


def _angle(axes: Axes, end: Array, angle: float) -> None:
    """Arc between the surface and the axis of flight, at the point that the axis meets."""
    axes.add_patch(Arc(tuple(end), 130, 130, theta1=180 - np.degrees(angle), theta2=180, color=VERMILION, lw=1.0))
    half = np.array([-np.cos(angle / 2), np.sin(angle / 2)])
    x, y = end + 46 * half  # inside the arc, where no bird is drawn
    axes.text(x, y, f"{np.degrees(angle):.3g}°", color=VERMILION, ha="center", va="center", fontsize=8.5)


def _top(axes: Axes, setup: SetUp, outline: Array) -> None:
    """Plate with its dimensions, the bird's shadow, the aimed line and the sensors."""
    length, width = setup.length * 1e3, setup.width * 1e3
    frame = Rectangle((-length / 2 - 14, -width / 2 - 14), length + 28, width + 28)
    frame.set(facecolor="white", edgecolor=GREY, hatch="/////", lw=0.6)
    axes.add_patch(frame)
    axes.add_patch(Rectangle((-length / 2, -width / 2), length, width, facecolor="#DFE7ED", edgecolor=BLACK, lw=0.8))
    axes.add_patch(Polygon(_shadow(setup, outline) * 1e3, facecolor="#F6DFC1", edgecolor=ORANGE, lw=1.2))
    axes.plot((-length / 2 - 20, length / 2 + 20), (0.0, 0.0), color=GREY, lw=0.7, linestyle="-.")
    for name, (x, y) in setup.sensors.items():
        axes.plot(x * 1e3, y * 1e3, "P", color=BLUE, markersize=8)
        at = {"xytext": (0, _height(setup, name)), "textcoords": "offset points", "ha": "center"}
        around = [withStroke(linewidth=3.0, foreground="white")]  # a name may lie across the bird's outline
        axes.annotate(words(name), (x * 1e3, y * 1e3), color=BLUE, path_effects=around, **at)
    _dimension(axes, (-length / 2, -width / 2 - 34), (length / 2, -width / 2 - 34), quantity(setup.length, "m"))
    _dimension(axes, (length / 2 + 34, -width / 2), (length / 2 + 34, width / 2), quantity(setup.width, "m"))
    axes.set_ylim(-width / 2 - 62, width / 2 + 26)
    axes.set_xlabel("x along the plate's length [mm]")
    _plain(axes, "Top view", "y [mm]")


def _height(setup: SetUp, name: str) -> int:
    """Points by which a sensor's name stands above it: above and below in turn along a row, so that none meet."""
    y = setup.sensors[name][1]
    row = [one for one, place in setup.sensors.items() if abs(place[1] - y) < ROW * setup.width]
    place = sorted(row, key=lambda one: setup.sensors[one][0]).index(name)
    return HEIGHTS[place % len(HEIGHTS)]


def _shadow(setup: SetUp, outline: Array) -> Array:
    """The bird seen from above: its round section swept along x between the outline's ends, (n, 2) [m]."""
    radius = setup.bird_diameter / 2
    turn = np.linspace(0.0, 2 * np.pi, POINTS, endpoint=False)
    middle, half = (outline[:, 0].max() + outline[:, 0].min()) / 2, np.ptp(outline[:, 0]) / 2
    if setup.bird_shape == "ellipsoid":
        return np.column_stack((middle + half * np.cos(turn), radius * np.sin(turn)))
    cap = radius * np.sin(setup.angle) if setup.bird_shape == "cylinder" else radius
    x = middle + (half - cap) * np.sign(np.cos(turn)) + cap * np.cos(turn)
    return np.column_stack((x, radius * np.sin(turn)))


def _dimension(axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str) -> None:
    axes.annotate("", xy=end, xytext=start, arrowprops={"arrowstyle": "<|-|>", "color": BLACK, "lw": 0.8})
    upright = abs(end[0] - start[0]) < abs(end[1] - start[1])
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.text(*middle, text, ha="center", va="center", rotation=90 if upright else 0, bbox=box, fontsize=8.5)


def _plain(axes: Axes, title: str, upward: str) -> None:
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set_title(title)
    axes.set_ylabel(upward)
