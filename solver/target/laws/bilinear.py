"""Linear hardening, isotropic or kinematic, with Cowper and Symonds' rate factor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, si_in
from birdstrike.solver.hardening import hardening_moduli
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import Modulus, RatedMetal, Stress


class Bilinear(RatedMetal):
    """Slope `tangent_modulus` of the stress-strain curve beyond yield; beta: 0 kinematic .. 1 isotropic."""

    law: Literal["bilinear"]
    yield_stress: Stress
    tangent_modulus: Modulus = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0

    def harden(self, row: Array) -> None:
        isotropic, row[metal.KINEMATIC] = hardening_moduli(self.young, self.tangent_modulus, self.beta)
        row[metal.CONSTANTS : metal.CONSTANTS + 2] = self.yield_stress, isotropic

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        yield from super().broken_rules(raw, prefix)
        young, tangent = si_in(cls, raw, "young"), si_in(cls, raw, "tangent_modulus")
        if young is not None and tangent is not None and tangent >= young:
            yield f"{prefix}.tangent_modulus = {raw['tangent_modulus']} is not below young; megapascals?"
