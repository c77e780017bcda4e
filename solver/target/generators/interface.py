"""What every generator of a target's mesh offers: its table in a case, its parts and sets, and the mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

from birdstrike.solver.fields import Between, Section
from birdstrike.solver.target.part_mesh import PartMesh

Length = Annotated[float, Between("1 mm", "5000 mm")]


class Generator(Section):
    """Table of a generator in a case; `kind` names it.

    struck: the part whose mid-surface lies in z = 0 about the origin,
    on which the bird is aimed.
    """

    kind: str
    struck: ClassVar[str]

    length: Annotated[float, Between("20 mm", "5000 mm")]
    width: Annotated[float, Between("20 mm", "5000 mm")]
    element_size: Annotated[float, Between("0.5 mm", "200 mm")]

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
    def broken_rules(cls, _raw: Mapping[str, Any], _prefix: str) -> Iterator[str]:
        """One line for every rule between keys that the table as read breaks; prefix: its dotted key."""
        yield from ()

    def canonical(self) -> dict[str, Any]:
        """What changes its mesh, SI."""
        return self.model_dump(mode="json")

    def mesh(self) -> PartMesh:
        """The mesh itself."""
        raise NotImplementedError(self.kind)
