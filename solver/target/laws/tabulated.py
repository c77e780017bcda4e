"""Hardening point by point, straight between the points, with Cowper and Symonds' rate factor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import field_validator

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, complaint
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import RatedMetal, Stress


class Tabulated(RatedMetal):
    """Flow stress over the plastic strain, which begins at 0; beyond the last point it stays."""

    law: Literal["tabulated"]
    plastic_strain: tuple[Annotated[float, Between(0.0, 10.0)], ...]
    flow_stress: tuple[Stress, ...]

    @field_validator("plastic_strain")
    @classmethod
    def _rises_from_zero(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if not 2 <= len(value) <= metal.MOST_POINTS:
            raise complaint(f"has {len(value)} points; give 2 .. {metal.MOST_POINTS}")
        if value[0] != 0.0:
            raise complaint(f"begins at {value[0]:g}; its first point is the yield stress, at a plastic strain of 0")
        for point, (one, after) in enumerate(pairwise(value), start=2):
            if after <= one:
                remedy = "leave one of the two out" if after == one else "sort the points"
                raise complaint(f"does not rise at point {point} of {len(value)}: {after:g} after {one:g}; {remedy}")
        return value

    @field_validator("flow_stress")
    @classmethod
    def _never_falls(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if any(after < one for one, after in pairwise(value)):
            raise complaint("falls: a metal that softens by itself tears in one row of shells; use fracture_energy")
        return value

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        yield from super().broken_rules(raw, prefix)
        strain, stress = raw.get("plastic_strain"), raw.get("flow_stress")
        if isinstance(strain, list) and isinstance(stress, list) and len(strain) != len(stress):
            yield f"{prefix}: {len(strain)} values of plastic_strain and {len(stress)} of flow_stress; give as many"

    def harden(self, row: Array) -> None:
        row[metal.HARDENING], row[metal.POINTS] = metal.TABLE, len(self.plastic_strain)
        pairs = np.column_stack([self.plastic_strain, self.flow_stress])
        row[metal.CONSTANTS : metal.CONSTANTS + pairs.size] = pairs.ravel()
