"""Numbers and names in the user's words."""

from __future__ import annotations

from data.units import display


def quantity(value: float, si_unit: str, digits: int = 3) -> str:
    """An SI value in the engineers' unit: quantity(5e-5, "m") is "0.05 mm"."""
    number, unit = display(value, si_unit)
    return f"{number:.{digits}g} {unit}".rstrip()


def plain(name: str) -> str:
    """A dotted key or a sensor's name as words: "bird.material.viscosity" is "viscosity"."""
    return name.rsplit(".", 1)[-1].replace("_", " ")
