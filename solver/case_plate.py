"""What a case says of the plate; after validation every value is SI."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import model_validator

from solver.case_fields import Between, Count, OneOf, Section, Switch

UNUSED_BY_RIGID = {
    "thickness": "10 mm",
    "material": {"young": "200 GPa", "poisson": 0.3, "density": "7850 kg/m^3", "yield_stress": "1000 MPa"},
}
"""What a rigid plate does not need to say; the thickness is only the height at which its surface lies."""


class PlateMaterial(Section):
    """Elastic-plastic metal. beta: 0 kinematic .. 1 isotropic; rate_c, rate_p: Cowper-Symonds, rate_c = 0 is off."""

    young: Annotated[float, Between("0.1 GPa", "1000 GPa")]
    poisson: Annotated[float, Between(0.0, 0.49)]
    density: Annotated[float, Between("100 kg/m^3", "25000 kg/m^3")]
    yield_stress: Annotated[float, Between("1 MPa", "10000 MPa")]
    tangent_modulus: Annotated[float, Between("0 MPa", "100000 MPa")] = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0
    rate_c: Annotated[float, Between("0 1/s", "1e9 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0
    failure_strain: Annotated[float, Between(0.001, 10.0)] = 10.0


class Plate(Section):
    """Rectangular plate, `length` along the velocity's plane; elements: shells along length and width.

    rigid: the plate neither moves nor strains; its edges and material mean nothing and may be left out, as may its
    thickness.
    """

    length: Annotated[float, Between("20 mm", "5000 mm")]
    width: Annotated[float, Between("20 mm", "5000 mm")]
    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    elements: tuple[Annotated[int, Count(2, 400)], Annotated[int, Count(2, 400)]]
    edges: Annotated[str, OneOf(("clamped", "pinned", "free"))] = "clamped"
    material: PlateMaterial
    rigid: Annotated[bool, Switch()] = False

    @model_validator(mode="before")
    @classmethod
    def _a_rigid_plate_needs_no_metal(cls, raw: Any) -> Any:
        return UNUSED_BY_RIGID | raw if isinstance(raw, dict) and raw.get("rigid") is True else raw
