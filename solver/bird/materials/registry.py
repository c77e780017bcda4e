"""The bird's materials that a case can name; a new one is a file beside this one and a line here.

An installed package adds its own as entry points of the group `birdstrike.bird_materials`: name = "module:Class", the
name being the `model` of a case and the class a `BirdMaterial`.
"""

from __future__ import annotations

from birdstrike.solver.bird.materials.elastic import ElasticMaterial
from birdstrike.solver.bird.materials.hydrodynamic import HydrodynamicMaterial
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.bird.materials.null import NullMaterial
from birdstrike.solver.bird.materials.plastic_kinematic import PlasticKinematicMaterial
from birdstrike.solver.registry import Kinds

BIRD_MATERIALS: Kinds[BirdMaterial] = Kinds(
    "bird material",
    "model",
    "birdstrike.bird_materials",
    {
        "null": NullMaterial,
        "elastic": ElasticMaterial,
        "plastic_kinematic": PlasticKinematicMaterial,
        "hydrodynamic": HydrodynamicMaterial,
    },
    BirdMaterial,
)
