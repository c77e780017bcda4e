"""A flat or curved skin with straight stiffeners on the side away from the bird, integral with it or riveted to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, Count, OneOf, si_in
from birdstrike.solver.target.generators.interface import Generator, Length
from birdstrike.solver.target.generators.panel_rules import ASIDE, SIDE_OF_PAD, broken_panel_rules
from birdstrike.solver.target.part_mesh import PartMesh, Patch, Row, divided, merged

Aside = Annotated[float, ASIDE]
Flange = Annotated[float, Between("1 mm", "500 mm")]
PadSide = Annotated[float, SIDE_OF_PAD]
UNSAID = ("foot", "lap", "rivet_pitch", "overlap", "joint", "pad", "pad_at", "radius")
"""Keys that are no part of a case's content where they are at their defaults."""
SIZES = ("length", "width", "pitch", "height", "flange", "foot", "lap", "rivet_pitch", "overlap", "radius")
"""Dimensions between which there are rules."""


class StiffenedPanel(Generator):
    """Skin length x width in z = 0, its impact side z > 0; stiffeners run along the width behind it.

    stiffeners: how many, `pitch` apart and symmetric about the centre; section "blade": a web of `height` from the
    skin's mid-surface; "L": with a flange of width `flange` at its end, towards the length's end. They share the skin's
    nodes. With `foot`, a flange of that width on the skin towards the length's end, they are riveted to it instead: "L"
    is foot and web, "Z" has the inner flange too, towards the length's start.
    overlap: of two skins, the second behind the first from `joint` on (along the length, from the centre), riveted in
    two lines; pad: size along length and width of a sheet riveted behind the skin at `pad_at`; lap: distance of the
    mid-surfaces of sheets that lie on each other; rivet_pitch: of all rows; radius: of a skin curved about the width's
    direction, convex to the bird, `length` then along the arc.
    Sets: edges (the skins' rim and the stiffeners' ends), skin_edges, stiffener_ends, and the skin's four sides.
    """

    struck: ClassVar = "skin"

    kind: Literal["stiffened_panel"]
    stiffeners: Annotated[int, Count(0, 50)]
    pitch: Length | None = None
    height: Length | None = None
    section: Annotated[str, OneOf(("blade", "L", "Z"))] = "blade"
    flange: Flange | None = None
    foot: Flange | None = None
    lap: Annotated[float, Between("0.1 mm", "50 mm")] | None = None
    rivet_pitch: Length | None = None
    overlap: Flange | None = None
    joint: Aside = 0.0
    pad: tuple[PadSide, PadSide] | None = None
    pad_at: tuple[Aside, Aside] = (0.0, 0.0)
    radius: Annotated[float, Between("20 mm", "1e6 mm")] | None = None

    @property
    def sets(self) -> tuple[str, ...]:
        return ("edges", "skin_edges", "stiffener_ends", "length_low", "length_high", "width_low", "width_high")

    @property
    def parts(self) -> tuple[str, ...]:
        further = {"skin_2": self.overlap, "pad": self.pad, "stiffeners": self.stiffeners}
        return ("skin", *(name for name, there in further.items() if there))

    @property
    def rows(self) -> tuple[str, ...]:
        placed = {"joint": self.overlap, "pad": self.pad, "stiffeners": self.stiffeners and self.foot}
        return tuple(name for name, there in placed.items() if there)

    @property
    def places(self) -> list[float]:
        """Where the stiffeners stand along the length [m]."""
        middle = 0.5 * (self.stiffeners - 1)
        return [(i - middle) * (self.pitch or 0.0) for i in range(self.stiffeners)]

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        yield from super().broken_rules(raw, prefix)
        sizes = {key: si_in(cls, raw, key) for key in SIZES}
        yield from broken_panel_rules(raw, sizes, prefix)

    def mesh(self) -> PartMesh:
        patches, y = [], divided([-0.5 * self.width, 0.0, 0.5 * self.width], self.element_size)
        for name, z, low, high in self._skins():
            inside = [place for place in self.places if low < place < high]
            x = divided([low, *inside, high], self.element_size)
            patches.append(Patch(name, _level(x, y, z), name))
        for place in self.places:
            patches += self._stiffener(place, y)
        if self.pad is not None:
            x, across = (
                middle + divided([-0.5 * size, 0.5 * size], self.element_size)
                for middle, size in zip(self.pad_at, self.pad, strict=True)
            )
            patches.append(Patch("pad", _level(x, across, self._depth(self.pad_at[0]) - (self.lap or 0.0)), "pad"))
        nodes, quads, owner = merged(patches)
        part = np.array([self.parts.index(patch.part) for patch in patches])[owner]
        rows: dict[str, tuple[Row, ...]] = dict.fromkeys(self.rows, ())
        for name, points, joined in self._rows():
            rows[name] = (*rows[name], Row(self._bent(points), joined))
        return PartMesh(self._bent(nodes), quads, part, self.parts, self._sets(nodes, quads, part), rows)

    def canonical(self) -> dict[str, Any]:
        """Without the keys of a riveted or curved panel where it has none."""
        return self.model_dump(mode="json", exclude={key for key in UNSAID if key not in self.model_fields_set})

    def _skins(self) -> Iterator[tuple[str, float, float, float]]:
        """Name, height and stretch along the length of each skin."""
        half = 0.5 * self.length
        if self.overlap is None:
            yield "skin", 0.0, -half, half
            return
        yield "skin", 0.0, -half, self.joint + 0.5 * self.overlap
        yield "skin_2", -(self.lap or 0.0), self.joint - 0.5 * self.overlap, half

    def _depth(self, place: float) -> float:
        """Height of the skin behind which things lie at a place along the length."""
        return -(self.lap or 0.0) if self.overlap is not None and place > self.joint else 0.0

    def _skin_at(self, place: float) -> str:
        return "skin_2" if self.overlap is not None and place > self.joint else "skin"

    def _stiffener(self, place: float, y: Array) -> Iterator[Patch]:
        """Web and flanges of one stiffener."""
        skin = self._depth(place)
        top, body = (skin - (self.lap or 0.0), "stiffeners") if self.foot else (skin, self._skin_at(place))
        z = divided([skin - (self.height or 0.0), top], self.element_size)[::-1]
        yield Patch("stiffeners", np.stack(np.broadcast_arrays(place, y[None, :], z[:, None]), axis=-1), body)
        if self.foot:
            yield Patch("stiffeners", _level(place + divided([0.0, self.foot], self.element_size), y, z[0]), body)
        if self.flange:
            ends = [-self.flange, 0.0] if self.section == "Z" else [0.0, self.flange]
            yield Patch("stiffeners", _level(place + divided(ends, self.element_size), y, z[-1]), body)

    def _rows(self) -> Iterator[tuple[str, Array, tuple[str, str]]]:
        """Name, points and parts of every row of rivets; of stiffeners on two skins, those of either apart."""
        pitch, lap = self.rivet_pitch or 0.0, self.lap or 0.0
        if self.overlap:
            lines = (self.joint - 0.25 * self.overlap, self.joint + 0.25 * self.overlap)
            along = _spread(self.width, pitch)
            yield "joint", np.vstack([_line(x, along, -0.5 * lap) for x in lines]), ("skin", "skin_2")
        if self.pad is not None:
            (x, y), inset = self.pad_at, pitch
            sides = [max(0.5 * size - 0.5 * inset, 0.0) for size in self.pad]
            along, across = (_spread(2.0 * side + inset, inset) for side in sides)
            height = self._depth(x) - 0.5 * lap
            rim = [_line(x + sign * sides[0], y + across, height) for sign in (-1.0, 1.0)]
            rim += [_line(x + along[1:-1], y + sign * sides[1], height) for sign in (-1.0, 1.0)]
            yield "pad", _once(np.vstack(rim)), (self._skin_at(x), "pad")
        if self.foot and self.stiffeners:
            along = _spread(self.width, pitch)
            for place in self.places:
                points = _line(place + 0.5 * self.foot, along, self._depth(place) - 0.5 * lap)
                yield "stiffeners", points, (self._skin_at(place), "stiffeners")

    def _bent(self, points: Array) -> Array:
        """Points of the flat panel on the curved one."""
        if self.radius is None:
            return points
        angle, r = points[:, 0] / self.radius, self.radius + points[:, 2]
        return np.column_stack([r * np.sin(angle), points[:, 1], r * np.cos(angle) - self.radius])

    def _sets(self, nodes: Array, quads: NDArray[np.int64], part: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
        """Nodes of each set."""
        near = 1e-9 + 1e-6 * self.element_size
        skins = [number for number, name in enumerate(self.parts) if name.startswith("skin")]
        skin, web = np.zeros(len(nodes), np.bool_), np.zeros(len(nodes), np.bool_)
        skin[quads[np.isin(part, skins)]] = True
        if self.stiffeners:
            web[quads[part == self.parts.index("stiffeners")]] = True
        sides = {
            f"{name}_{end}": skin & (np.abs(nodes[:, axis] - sign * 0.5 * size) < near)
            for axis, (name, size) in enumerate((("length", self.length), ("width", self.width)))
            for end, sign in (("low", -1.0), ("high", 1.0))
        }
        rim = np.logical_or.reduce(list(sides.values()))
        ends = web & ~skin & (np.abs(np.abs(nodes[:, 1]) - 0.5 * self.width) < near)
        found = {"edges": rim | ends, "skin_edges": rim, "stiffener_ends": ends, **sides}
        return {name: np.flatnonzero(mask).astype(np.int64) for name, mask in found.items()}


def _level(x: Array, y: Array, z: float) -> Array:
    """Points (a, b, 3) over a grid of places at one height."""
    return np.stack([*np.meshgrid(x, y, indexing="ij"), np.full((len(x), len(y)), z)], axis=-1)


def _line(x: Array | float, y: Array | float, z: float) -> Array:
    """Points (k, 3) of a straight row."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).reshape(-1, 3)


def _spread(size: float, pitch: float) -> Array:
    """Places of rivets about the middle of a stretch, half a pitch or more from its ends."""
    count = max(int(size / pitch + 1e-9), 1)
    return (np.arange(count) - 0.5 * (count - 1)) * pitch


def _once(points: Array, tolerance: float = 1e-9) -> Array:
    """The points (k, 3) without those that are there before; tolerance [m]."""
    first = np.unique(np.round(points / tolerance).astype(np.int64), axis=0, return_index=True)[1]
    return points[np.sort(first)]
