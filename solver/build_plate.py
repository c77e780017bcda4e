"""The plate of a case."""

from __future__ import annotations

from solver.case import Case
from solver.geometry import plate_mesh
from solver.plate import Plate, ShellMaterial
from solver.rigid_plate import RigidPlate, Target


def build_plate(case: Case) -> Target:
    """Plate of the case, at rest."""
    m = case.plate.material
    mesh = plate_mesh(case.plate.length, case.plate.width, case.plate.elements)
    if case.plate.rigid:
        return RigidPlate(mesh, case.plate.thickness)
    material = ShellMaterial(m.young, m.poisson, m.density, m.yield_stress, m.tangent_modulus, m.beta)
    return Plate(mesh, case.plate.thickness, material, case.plate.edges)
