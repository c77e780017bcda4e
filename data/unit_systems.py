"""Consistent unit systems as solvers without units use them: SI values in lengths, times and masses of one's choice."""

from __future__ import annotations

from dataclasses import dataclass

from birdstrike.data.errors import UserError
from birdstrike.data.units import from_si

COHERENT = {
    "": "",
    "m": "{length}",
    "s": "{time}",
    "kg": "{mass}",
    "1/s": "1/{time}",
    "m/s": "{length}/{time}",
    "kg/m^3": "{mass}/{length}^3",
    "N": "{mass}*{length}/{time}^2",
    "Pa": "{mass}/({length}*{time}^2)",
    "Pa s": "{mass}/({length}*{time})",
    "Pa/m": "{mass}/({length}^2*{time}^2)",
    "kg m^2": "{mass}*{length}^2",
    "m^2/s": "{length}^2/{time}",
    "N/m": "{mass}/{time}^2",
    "N m/rad": "{mass}*{length}^2/{time}^2",
    "N/rad": "{mass}*{length}/{time}^2",
}
"""SI unit -> what it is made of in any consistent system."""


@dataclass(frozen=True)
class UnitSystem:
    """name: its length, time, mass and stress; the stress is only what these three make, named for the reader."""

    name: str

    @property
    def base(self) -> dict[str, str]:
        """Names of its length, time and mass, as data.units reads them."""
        length, time, mass, _ = self.name.split("-")
        return {"length": length, "time": time, "mass": mass}

    @property
    def stress(self) -> str:
        """What engineers call its unit of stress."""
        return self.name.split("-")[3]

    def unit(self, si: str) -> str:
        """The system's unit in place of an SI one: unit("Pa s") is "kg/(mm*ms)"."""
        return COHERENT[si].format(**self.base)

    def value(self, value: float, si: str) -> float:
        """An SI value as a number of this system."""
        return from_si(value, self.unit(si))

    @property
    def sentence(self) -> str:
        """The system in a line for the head of a file."""
        length, time, mass = self.base.values()
        return (
            f"{length}, {time}, {mass}; hence stress {self.stress}, force {self.unit('N')}, "
            f"density {self.unit('kg/m^3')}, viscosity {self.stress} {time}, speed {self.unit('m/s')}"
        )


SYSTEMS = {
    system.name: system
    for system in map(UnitSystem, ("mm-ms-kg-GPa", "mm-s-t-MPa", "mm-ms-g-MPa", "m-s-kg-Pa", "cm-us-g-Mbar"))
}
"""The systems on offer, the first one by default."""


def unit_system(name: str) -> UnitSystem:
    """A system by its name, in any case of letters; raises UserError that lists those on offer."""
    for system in SYSTEMS.values():
        if system.name.lower() == name.strip().lower():
            return system
    raise UserError(f'--units "{name}" is no unit system on offer; available: {", ".join(SYSTEMS)}')
