"""What a block of elements gives to the target that it is part of."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.target.nodes import Nodes


class Block(Protocol):
    """Elements of one kind on a target's nodes.

    facets (f, 4): quadrilaterals that a bird can touch; skin (f,): how far the surface lies from them [m]; alive (f,):
    those that have not torn; eps_p: plastic strains, of any shape; energies: [J] by name.
    """

    facets: NDArray[np.int64]
    skin: Array
    alive: NDArray[np.bool_]
    energies: dict[str, float]

    @property
    def eps_p(self) -> Array:
        """Equivalent plastic strains at all its points."""
        ...

    @property
    def eroded(self) -> int:
        """Elements that are gone."""
        ...

    def add_mass(self, nodes: Nodes) -> None:
        """Give the nodes their share of the elements' mass and inertia."""
        ...

    def add_forces(self, nodes: Nodes, dt: float) -> None:
        """Stress over the step dt [s] that ended, and its forces added to `nodes.nodal`."""
        ...

    def update_energies(self) -> None:
        """Works of the step that ended [J]."""
        ...

    def clear_stress(self) -> None:
        """Stress-free, and no memory of plastic strain."""
        ...

    def elastic(self) -> Block | None:
        """The same elements, unloaded and without yielding; None for a block that does not strain."""
        ...

    def von_mises(self) -> Array:
        """Largest von Mises stress of each facet, (f,) [Pa]."""
        ...
