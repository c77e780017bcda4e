"""The plate of a case."""

from __future__ import annotations

from dataclasses import asdict

from birdstrike.solver.case.case import Case
from birdstrike.solver.case.plate import EdgeSprings
from birdstrike.solver.case.plate import Plate as PlateOfCase
from birdstrike.solver.plate.boundary import RIGID, EdgeStiffness
from birdstrike.solver.plate.material import ShellMaterial
from birdstrike.solver.plate.mesh import PlateMesh, cylindrical_panel, plate_mesh
from birdstrike.solver.plate.rigid import RigidPlate, Target
from birdstrike.solver.plate.shell import Plate


def build_plate(case: Case) -> Target:
    """Plate of the case, at rest; raises UserError when its edges cannot hold its preload."""
    said = case.plate
    if said.rigid:
        return RigidPlate(mesh_of(said), said.thickness)
    material = ShellMaterial(**said.material.model_dump())
    plate = Plate(mesh_of(said), said.thickness, material, edges_of(said.edges), said.damping)
    if any(said.preload):
        plate.preload(*said.preload)
    return plate


def mesh_of(plate: PlateOfCase) -> PlateMesh:
    """Mesh at rest: flat, or curved to `radius`."""
    if plate.radius is None:
        return plate_mesh(plate.length, plate.width, plate.elements)
    return cylindrical_panel(plate.length, plate.width, plate.radius, plate.elements)


def edges_of(edges: str | EdgeSprings) -> str | EdgeStiffness:
    """A word as it stands; of springs, the keys that were left out are rigid."""
    if isinstance(edges, str):
        return edges
    given = edges.model_dump()
    return EdgeStiffness(**{name: RIGID if given[name] is None else given[name] for name in asdict(EdgeStiffness())})
