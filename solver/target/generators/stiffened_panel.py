"""A flat skin with straight stiffeners on the side away from the bird: blades, or angles with an inner flange."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, Count, OneOf
from birdstrike.solver.target.generators.interface import Generator, Length
from birdstrike.solver.target.part_mesh import PartMesh, Patch, divided, merged


class StiffenedPanel(Generator):
    """Skin length x width in z = 0, its impact side z > 0; stiffeners run along the width and share the skin's nodes.

    stiffeners: how many, `pitch` apart and symmetric about the centre; section "blade": a web of `height` from the
    skin's mid-surface; "L": with a flange of width `flange` at its end, towards the length's end.
    Sets: edges (the skin's rim and the stiffeners' ends), skin_edges, stiffener_ends, and the skin's four sides.
    """

    struck: ClassVar = "skin"

    kind: Literal["stiffened_panel"]
    stiffeners: Annotated[int, Count(0, 50)]
    pitch: Length | None = None
    height: Length | None = None
    section: Annotated[str, OneOf(("blade", "L"))] = "blade"
    flange: Annotated[float, Between("1 mm", "500 mm")] | None = None

    @property
    def sets(self) -> tuple[str, ...]:
        return ("edges", "skin_edges", "stiffener_ends", "length_low", "length_high", "width_low", "width_high")

    @property
    def parts(self) -> tuple[str, ...]:
        return ("skin", "stiffeners") if self.stiffeners else ("skin",)

    @property
    def places(self) -> list[float]:
        """Where the stiffeners stand along the length [m]."""
        middle = 0.5 * (self.stiffeners - 1)
        return [(i - middle) * (self.pitch or 0.0) for i in range(self.stiffeners)]

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        count = raw.get("stiffeners")
        if isinstance(count, int) and count > 0 and "height" not in raw:
            yield f'{prefix}.height is missing: {count} stiffeners need one, such as height = "40 mm"'
        if isinstance(count, int) and count > 1:
            if "pitch" not in raw:
                yield f'{prefix}.pitch is missing: {count} stiffeners need one, such as pitch = "200 mm"'
            pitch, length = Between("1 mm", "5000 mm").valid(raw.get("pitch")), raw.get("length")
            half = Between("20 mm", "5000 mm").valid(length)
            if pitch is not None and half is not None and (count - 1) * pitch >= half:
                given = f"{prefix}.pitch = {raw['pitch']}"
                yield f"{given} puts {count} stiffeners beyond {prefix}.length = {length}; a smaller pitch, or fewer"
        if (raw.get("section") == "L") != ("flange" in raw):
            yield f'{prefix}.flange is the inner flange of section = "L"; give both, or leave both out'

    def mesh(self) -> PartMesh:
        half = (0.5 * self.length, 0.5 * self.width)
        flange = self.flange or 0.0
        x = divided([-half[0], *self.places, half[0]], self.element_size)
        y = divided([-half[1], 0.0, half[1]], self.element_size)
        patches = [Patch("skin", _grid(x, y, np.zeros((len(x), len(y)))))]
        if self.stiffeners:
            z = divided([-(self.height or 0.0), 0.0], self.element_size)[::-1]
        for place in self.places:
            web = np.stack(np.broadcast_arrays(place, y[None, :], z[:, None]), axis=-1)
            patches.append(Patch("stiffeners", web))
            if flange:
                foot = place + divided([0.0, flange], self.element_size)
                patches.append(Patch("stiffeners", _grid(foot, y, np.full((len(foot), len(y)), z[-1]))))
        nodes, quads, owner = merged(patches)
        part = np.array([self.parts.index(patch.part) for patch in patches])[owner]
        return PartMesh(nodes, quads, part, self.parts, self._sets(nodes))

    def _sets(self, nodes: Array) -> dict[str, NDArray[np.int64]]:
        """Nodes of each set."""
        near = 1e-9 + 1e-6 * self.element_size
        skin = np.abs(nodes[:, 2]) < near
        sides = {
            f"{name}_{end}": skin & (np.abs(nodes[:, axis] - sign * 0.5 * size) < near)
            for axis, (name, size) in enumerate((("length", self.length), ("width", self.width)))
            for end, sign in (("low", -1.0), ("high", 1.0))
        }
        rim = np.logical_or.reduce(list(sides.values()))
        ends = ~skin & (np.abs(np.abs(nodes[:, 1]) - 0.5 * self.width) < near)
        found = {"edges": rim | ends, "skin_edges": rim, "stiffener_ends": ends, **sides}
        return {name: np.flatnonzero(mask).astype(np.int64) for name, mask in found.items()}


def _grid(x: Array, y: Array, z: Array) -> Array:
    """Points (a, b, 3) over a grid of places."""
    return np.stack([*np.meshgrid(x, y, indexing="ij"), z], axis=-1)
