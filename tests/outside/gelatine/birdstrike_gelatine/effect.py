"""Paint: a speckle pattern for cameras, whose mass the declared plate does not have."""

from __future__ import annotations

from birdstrike.effects import Effect

PAINT = Effect(
    "paint",
    "the paint on the plate",
    "kg/m^3",
    lambda case, x: {"plate": {"material": {"density": f"{case.plate.material.density + x} kg/m^3"}}},
    lambda case: 0.05 * case.plate.material.density,
    source="mass of the paint over the plate's volume",
)
