"""The bird's materials that a case can name; a new one is a file beside this one and a line here.

An installed package adds its own as entry points of the group `birdstrike.bird_materials`: name = "module:Class", the
name being the `model` of a case and the class a `BirdMaterial`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points

from birdstrike.solver.bird.materials.elastic import ElasticMaterial
from birdstrike.solver.bird.materials.hydrodynamic import HydrodynamicMaterial
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.bird.materials.null import NullMaterial
from birdstrike.solver.bird.materials.plastic_kinematic import PlasticKinematicMaterial

ENTRY_POINTS = "birdstrike.bird_materials"
LIBRARY: dict[str, type[BirdMaterial]] = {
    "null": NullMaterial,
    "elastic": ElasticMaterial,
    "plastic_kinematic": PlasticKinematicMaterial,
    "hydrodynamic": HydrodynamicMaterial,
}


@cache
def bird_materials() -> Mapping[str, type[BirdMaterial]]:
    """Every model by name: the library in its order, then those of installed packages.

    Raises TypeError for an entry point that is no BirdMaterial, ValueError for one whose name is taken.
    """
    found = dict(LIBRARY)
    for entry in entry_points(group=ENTRY_POINTS):
        material = entry.load()
        if not (isinstance(material, type) and issubclass(material, BirdMaterial)):
            raise TypeError(f"{entry.value}, entry point {entry.name} of {ENTRY_POINTS}, is no BirdMaterial")
        if entry.name in found:
            raise ValueError(f'a bird material named "{entry.name}" exists already; rename that of {entry.value}')
        found[entry.name] = material
    return found
