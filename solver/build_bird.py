"""The bird of a case, in place and in flight."""

from __future__ import annotations

import math

import numpy as np

from solver.bird import Bird, NullMaterial
from solver.body import BirdBody
from solver.case import Case
from solver.eos import grueneisen
from solver.geometry import fill_bird, place_bird, slope_gain
from solver.hex_bird import HexBird, HexMaterial, HexSettings
from solver.hex_mesh import HexMesh, bird_mesh


def build_bird(case: Case) -> BirdBody:
    """Bird of the case, `standoff` of flight before its first particle or node touches the plate."""
    return build_hexahedra(case) if case.bird.method == "hexahedra" else build_particles(case)


def build_hexahedra(case: Case) -> HexBird:
    """Lagrangian bird of the case."""
    b, m, s = case.bird, case.bird.material, case.solver
    mesh = bird_mesh(b.shape, b.diameter, b.length, b.volume, b.particles)
    surface, angle = 0.5 * case.plate.thickness, case.impact.angle
    x = place_bird(mesh.nodes, angle, case.impact.standoff, case.impact.aim, surface)
    velocity = case.impact.speed * np.array([math.cos(angle), 0.0, -math.sin(angle)])
    e = m.eos
    law = grueneisen(b.actual_density, e.C, e.S1, e.S2, e.S3, e.g0, e.a)
    four = NullMaterial(law, m.pressure_cutoff, m.viscosity, m.tension_erosion, m.compression_erosion)
    material = HexMaterial(law, m.pressure_cutoff, m.viscosity, *four.limits[1:])
    shock = (s.shock_linear, s.shock_quadratic)
    settings = HexSettings(shock, s.hourglass or "viscous", s.hourglass_coefficient, s.smallest_step)
    return HexBird(HexMesh(x, mesh.cells), np.tile(velocity, (len(x), 1)), material, settings)


def build_particles(case: Case) -> Bird:
    """SPH bird of the case."""
    b, m = case.bird, case.bird.material
    points = fill_bird(b.shape, b.diameter, b.length, b.volume, b.particles, b.lattice)
    spacing = (b.volume / len(points)) ** (1.0 / 3.0)
    surface = 0.5 * case.plate.thickness + 0.5 * spacing
    angle = case.impact.angle
    x = place_bird(points, angle, case.impact.standoff, case.impact.aim, surface)
    velocity = case.impact.speed * np.array([math.cos(angle), 0.0, -math.sin(angle)])
    e = m.eos
    law = grueneisen(b.actual_density, e.C, e.S1, e.S2, e.S3, e.g0, e.a)
    material = NullMaterial(law, m.pressure_cutoff, m.viscosity, m.tension_erosion, m.compression_erosion)
    shock = (case.solver.shock_linear, case.solver.shock_quadratic)
    mass = b.actual_mass / len(points)
    gain = slope_gain(b.lattice, case.solver.smoothing)
    return Bird(x, np.tile(velocity, (len(x), 1)), mass, case.solver.smoothing * spacing, material, shock, gain=gain)
