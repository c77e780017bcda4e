"""Numbers of nodes, elements and parts in a deck: the target's first, then the ground of its springs, then the bird."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.reports.export.model import StrikeModel

Numbers = NDArray[np.int64]
ALL = (True,) * 6


class Numbering:
    """bird (n,): node numbers of the bird, which its particles share; ground: of each set of springs, its fixed nodes;

    spring_elements: their elements; spring_parts: their parts; cells: elements of a Lagrangian bird.
    """

    def __init__(self, model: StrikeModel) -> None:
        nodes, shells = len(model.nodes), sum(len(part.quads) for part in model.parts)
        counts = [len(springs.nodes) for springs in model.springs]
        ends = np.cumsum([0, *counts])
        self.ground = [np.arange(ends[i], ends[i + 1]) + nodes + 1 for i in range(len(counts))]
        self.spring_elements = [np.arange(ends[i], ends[i + 1]) + shells + 1 for i in range(len(counts))]
        self.bird_part = len(model.parts) + 1
        self.spring_parts = [self.bird_part + 1 + i for i in range(len(counts))]
        first = _round(max(nodes, shells) + int(ends[-1]))
        self.bird: Numbers = first + 1 + np.arange(len(model.bird.points))
        self.cells: Numbers = first + 1 + np.arange(len(model.bird.cells))
        self.target_group, self.bird_group = 9001, 9002

    def blocks_of_nodes(self, model: StrikeModel) -> Iterator[tuple[Numbers, Array]]:
        """Numbers and places [m] of the target's, the ground's and the bird's nodes."""
        yield np.arange(1, len(model.nodes) + 1), model.nodes
        for ground, springs in zip(self.ground, model.springs, strict=True):
            yield ground, model.nodes[springs.nodes]
        yield self.bird, model.bird.points

    def held(self, model: StrikeModel) -> Iterator[tuple[tuple[bool, ...], list[int]]]:
        """Freedoms and node numbers of every set that is held, the ground of springs among them."""
        for held in model.held:
            yield held.freedoms, [int(n) + 1 for n in held.nodes]
        if self.ground:
            yield ALL, [int(n) for n in np.concatenate(self.ground)]

    def recorded_nodes(self, model: StrikeModel) -> dict[int, str]:
        """Node number -> names of the displacement sensors that it serves."""
        found: dict[int, str] = {}
        for sensor in model.sensors:
            if sensor.kind == "displacement":
                for node in sensor.nodes:
                    number = int(node) + 1
                    found[number] = f"{found[number]}+{sensor.name}" if number in found else sensor.name
        return found

    def reaction_nodes(self, model: StrikeModel, nodes: Numbers | None = None) -> list[int]:
        """Numbers of the nodes whose reactions make up a reaction force: held ones, and the ground of springs.

        nodes: of one sensor, counted from 0; None: of all reaction sensors.
        """
        if nodes is None:
            wanted = [sensor.nodes for sensor in model.sensors if sensor.kind == "reaction_force"]
            nodes = np.unique(np.concatenate(wanted)) if wanted else np.empty(0, np.int64)
        rigid = np.concatenate([held.nodes for held in model.held]) if model.held else np.empty(0, np.int64)
        found = [int(n) + 1 for n in np.intersect1d(nodes, rigid)]
        for ground, springs in zip(self.ground, model.springs, strict=True):
            found += [int(g) for g, n in zip(ground, springs.nodes, strict=True) if n in nodes]
        return found


def _round(number: int) -> int:
    """The next number of one digit and zeros, so that a reader sees where the bird begins."""
    power = 10 ** len(str(number))
    step = power // 10
    return -(-number // step) * step
