"""What a case says of the plate; after validation every value is SI."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import model_validator

from birdstrike.data.units import quantity_text
from birdstrike.solver.fields import EDGE_SPRINGS, Between, Count, Section, Switch, WordOr

UNUSED_BY_RIGID = {
    "thickness": "10 mm",
    "material": {"young": "200 GPa", "poisson": 0.3, "density": "7850 kg/m^3", "yield_stress": "1000 MPa"},
}
"""What a rigid plate does not need to say; the thickness is only the height at which its surface lies."""
EDGE_WORDS = ("clamped", "pinned", "free")
STRESS = Between("-1000 MPa", "1000 MPa")


class PlateMaterial(Section):
    """Elastic-plastic metal. beta: 0 kinematic .. 1 isotropic; rate_c, rate_p: Cowper-Symonds, rate_c = 0 is off.

    failure_strain: plastic strain at which a layer fails; an element is eroded with its last layer.
    """

    young: Annotated[float, Between("0.1 GPa", "1000 GPa")]
    poisson: Annotated[float, Between(0.0, 0.49)]
    density: Annotated[float, Between("100 kg/m^3", "25000 kg/m^3")]
    yield_stress: Annotated[float, Between("1 MPa", "10000 MPa")]
    tangent_modulus: Annotated[float, Between("0 MPa", "100000 MPa")] = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0
    rate_c: Annotated[float, Between("0 1/s", "1e30 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0
    failure_strain: Annotated[float, Between(0.001, 10.0)] = 10.0


class EdgeSprings(Section):
    """Stiffness of the frame per length of edge; a key left out is held rigidly, 0 is free.

    rotational [N m/rad per m]; in_plane, transverse: along and across the surface [N/m per m, that is N/m^2].
    """

    rotational: Annotated[float, EDGE_SPRINGS["rotational"]] | None = None
    in_plane: Annotated[float, EDGE_SPRINGS["in_plane"]] | None = None
    transverse: Annotated[float, EDGE_SPRINGS["transverse"]] | None = None

    def texts(self) -> dict[str, str]:
        """The springs that are given, as a case's table has them."""
        units = {"rotational": "N m/rad/m", "in_plane": "Pa", "transverse": "Pa"}
        return {key: quantity_text(value, units[key]) for key, value in self.model_dump().items() if value is not None}


class Plate(Section):
    """Rectangular plate, `length` along the velocity's plane; elements: shells along length and width.

    rigid: the plate neither moves nor strains; its edges and material mean nothing and may be left out, as may its
    thickness.
    edges: a word, or a table of springs; damping [1/s]: rate at which a free vibration's amplitude decays (2 pi times
    frequency times the ratio of critical damping); preload [Pa]: initial tension along length and width; radius [m]:
    of a panel curved about the width's direction, convex to the bird, `length` then along the arc.
    """

    length: Annotated[float, Between("20 mm", "5000 mm")]
    width: Annotated[float, Between("20 mm", "5000 mm")]
    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    elements: tuple[Annotated[int, Count(2, 400)], Annotated[int, Count(2, 400)]]
    edges: Annotated[str | EdgeSprings, WordOr(EDGE_WORDS, EdgeSprings)] = "clamped"
    damping: Annotated[float, Between("0 1/s", "1e5 1/s")] = 0.0
    preload: tuple[Annotated[float, STRESS], Annotated[float, STRESS]] = (0.0, 0.0)
    radius: Annotated[float, Between("20 mm", "1e6 mm")] | None = None
    material: PlateMaterial
    rigid: Annotated[bool, Switch()] = False

    @model_validator(mode="before")
    @classmethod
    def _a_rigid_plate_needs_no_metal(cls, raw: Any) -> Any:
        return UNUSED_BY_RIGID | raw if isinstance(raw, dict) and raw.get("rigid") is True else raw

    @property
    def edge_words(self) -> str:
        """How the edges are held, for a reader."""
        return self.edges if isinstance(self.edges, str) else "on springs"
