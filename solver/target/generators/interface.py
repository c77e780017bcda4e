"""What every generator of a target's mesh offers: its table in a case, its parts and sets, and the mesh."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

from birdstrike.solver.fields import Between, Section
from birdstrike.solver.target.part_mesh import PartMesh

Length = Annotated[float, Between("1 mm", "5000 mm")]
SIDE, ELEMENT_SIZE = Between("20 mm", "5000 mm"), Between("0.5 mm", "200 mm")
MOST_SHELLS = 250_000
"""Of the skin: of a million no check came to an end."""


class Generator(Section):
    """Table of a generator in a case; `kind` names it.

    struck: the part whose mid-surface lies in z = 0 about the origin,
    on which the bird is aimed.
    """

    kind: str
    struck: ClassVar[str]

    length: Annotated[float, SIDE]
    width: Annotated[float, SIDE]
    element_size: Annotated[float, ELEMENT_SIZE]

    @property
    def sets(self) -> tuple[str, ...]:
        """Names of the sets of nodes."""
        raise NotImplementedError(self.kind)

    @property
    def rows(self) -> tuple[str, ...]:
        """Names of the rows of rivets, each of which a case gives its strengths."""
        return ()

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts."""
        raise NotImplementedError(self.kind)

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        """One line for every rule between keys that the table as read breaks; prefix: its dotted key."""
        length, width = (SIDE.valid(raw.get(key)) for key in ("length", "width"))
        size = ELEMENT_SIZE.valid(raw.get("element_size"))
        if length and width and size and length * width / size**2 > MOST_SHELLS:
            least = 1e3 * math.sqrt(length * width / MOST_SHELLS)
            yield (
                f"{prefix}.element_size = {raw['element_size']} makes {length * width / size**2:,.0f} shells of "
                f"{prefix}.length = {raw['length']} and width = {raw['width']}, beyond {MOST_SHELLS:,}; "
                f"{math.ceil(10.0 * least) / 10.0:g} mm or more"
            )

    def canonical(self) -> dict[str, Any]:
        """What changes its mesh, SI."""
        return self.model_dump(mode="json")

    def mesh(self) -> PartMesh:
        """The mesh itself."""
        raise NotImplementedError(self.kind)


def closed_panel(length: float | None, radius: float | None, given: str) -> Iterator[str]:
    """A panel of this length [m] along its arc spans at most half a circle; given: its radius as the file has it."""
    if radius is not None and length is not None and length > math.pi * radius:
        yield f"{given} closes the panel beyond half a circle; length is along the arc, at most pi times the radius"
