"""The bird of a case, in place and in flight."""

from __future__ import annotations

import math

import numpy as np

from data.histories import Array
from solver.bird import Bird
from solver.bird_shape import outline
from solver.body import BirdBody
from solver.case import Case
from solver.case_bird import Bird as BirdSection
from solver.case_material import (
    BirdMaterial,
    ElasticMaterial,
    HydrodynamicMaterial,
    NullMaterial,
    PlasticKinematicMaterial,
)
from solver.elastic_bird import ElasticBird
from solver.first_touch import flight_to_panel, nose_meets, turned, yawed
from solver.geometry import fill_bird, jittered, slope_gain
from solver.hex_bird import HexBird
from solver.hex_elements import HexSettings
from solver.hex_mesh import HexMesh, bird_mesh
from solver.materials import NullMaterial as FluidMaterial
from solver.materials import SolidMaterial, elastic, hardening
from solver.solid_bird import SolidBird

BODIES: dict[str, type[Bird]] = {"null": Bird, "elastic": ElasticBird}


def build_bird(case: Case) -> BirdBody:
    """Bird of the case, `standoff` of flight before its ideal surface touches the plate."""
    return build_hexahedra(case) if case.bird.method == "hexahedra" else build_particles(case)


def in_flight(case: Case, points: Array, skin: float) -> tuple[Array, Array]:
    """Positions (n, 3) [m] and velocities (n, 3) [m/s] of a bird's points (n, 3), given about its centre, axis along x.

    The bird's ideal surface touches after the stand-off, so that the clock does not hang on where the outermost points
    happen to lie. Each acts `skin` [m] ahead of itself. Where a lattice is cut at random, its points lie 0 to 2 skins
    deep at even odds; those less than one deep are stopped early, and the first layer comes to rest skin/4 further out
    than the mass that it stands for. The bird begins as much further back. None is let begin in the plate.
    """
    impact, half = case.impact, 0.5 * case.plate.thickness
    direction = np.array([math.cos(impact.angle), 0.0, -math.sin(impact.angle)])
    ideal = outline(case.bird.shape, case.bird.diameter, case.bird.length)
    surface = turned(yawed(ideal, impact.yaw), impact.angle)
    start = np.array([*impact.offset, 0.0])
    if impact.aim == "first_touch":
        start[0] -= nose_meets(surface, impact.angle, half)
    x = turned(yawed(points, impact.yaw), impact.angle) + start
    flight = flight_to_panel(surface + start, direction, case.plate, half + 0.25 * skin) - impact.standoff
    x += min(flight, flight_to_panel(x, direction, case.plate, half + skin)) * direction
    return x, np.tile(impact.speed * direction, (len(x), 1))


def build_hexahedra(case: Case) -> HexBird:
    """Lagrangian bird of the case, its hourglass control by springs when it is elastic and by dampers when it flows."""
    b, s = case.bird, case.solver
    mesh = bird_mesh(b.shape, b.diameter, b.length, b.volume, b.particles)
    x, v = in_flight(case, mesh.nodes, 0.0)
    hourglass = s.hourglass or ("stiffness" if b.material.model == "elastic" else "viscous")
    settings = HexSettings((s.shock_linear, s.shock_quadratic), hourglass, s.hourglass_coefficient, s.smallest_step)
    bird = HexBird(HexMesh(x, mesh.cells), v, bird_material(b.material, b.actual_density), settings)
    bird.stiffen(case.normal_speed)
    return bird


def build_particles(case: Case) -> Bird:
    """SPH bird of the case."""
    b = case.bird
    points, spacing = bird_lattice(b)
    share = b.volume / len(points)
    x, v = in_flight(case, points, 0.5 * share ** (1.0 / 3.0))
    material = bird_material(b.material, b.actual_density)
    shock = (case.solver.shock_linear, case.solver.shock_quadratic)
    state = (x, v, b.actual_mass / len(points), case.solver.smoothing * spacing)
    gain = slope_gain(b.lattice, case.solver.smoothing) * spacing**3 / share
    bird = BODIES.get(b.material.model, SolidBird)(*state, material, shock, gain=gain)
    bird.stiffen(case.normal_speed)
    return bird


def bird_lattice(b: BirdSection) -> tuple[Array, float]:
    """Particle positions (n, 3) [m] about the bird's centre, axis along x, and the lattice's spacing [m]."""
    points, spacing = fill_bird(b.shape, b.diameter, b.length, b.volume, b.particles, b.lattice)
    return jittered(points, b.jitter * spacing, b.seed), spacing


def bird_material(m: BirdMaterial, rho0: float) -> FluidMaterial | SolidMaterial:
    """The case's material about the reference density [kg/m^3], for particles and finite elements alike."""
    if isinstance(m, NullMaterial):
        four = (m.pressure_cutoff, m.viscosity, m.tension_erosion, m.compression_erosion)
        return FluidMaterial(m.eos.build(rho0), *four)
    if isinstance(m, HydrodynamicMaterial):
        moduli = (m.shear_modulus, m.yield_stress, m.hardening_modulus)
        limits = {"failure_strain": m.failure_strain, "pressure_cutoff": m.pressure_cutoff}
        return SolidMaterial(m.eos.build(rho0), *moduli, **limits)
    if isinstance(m, PlasticKinematicMaterial):
        base = elastic(rho0, m.young, m.poisson)
        moduli = (base.shear_modulus, m.yield_stress, *hardening(m.young, m.tangent_modulus, m.beta))
        return SolidMaterial(base.eos, *moduli, m.rate_c, m.rate_p, m.failure_strain)
    if isinstance(m, ElasticMaterial):
        return elastic(rho0, m.young, m.poisson)
    raise TypeError(f"no body for the bird's model {m.model}")
