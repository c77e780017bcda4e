"""One-point hexahedra of one material: their state, and every part of their stress after a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data.histories import Array
from solver.hex_mesh import HexMesh
from solver.kernels.hexahedra import hex_forces, hex_geometry, hex_rates
from solver.kernels.hexahedra_hourglass import elastic_hourglass, viscous_hourglass
from solver.kernels.hexahedra_stress import (
    find_eroded,
    stable_steps,
    total_stress,
    update_pressure,
    update_strength,
    update_viscosity,
)
from solver.materials import NullMaterial, SolidMaterial

Material = NullMaterial | SolidMaterial

SHOCK = (0.06, 0.75)  # linear and quadratic coefficient per unit of shock_linear and shock_quadratic: 0.06 and 1.5
COEFFICIENTS = {"viscous": 0.02, "stiffness": 0.05}  # 0.005 to 0.1 moves the peak by 0.5 % (MU 641), 2 % (MU 0)


@dataclass(frozen=True)
class HexSettings:
    """Numerical choices of the elements.

    shock: linear and quadratic coefficient of the shock viscosity in the case's units, times `SHOCK`; hourglass:
    "viscous" or "stiffness", with its coefficient (None: of `COEFFICIENTS`); smallest_step: share of the undistorted
    bird's stable step below which a distorted element is eroded.
    """

    shock: tuple[float, float] = (1.0, 2.0)
    hourglass: str = "viscous"
    hourglass_coefficient: float | None = None
    smallest_step: float = 0.25

    @property
    def control(self) -> float:
        """The coefficient, or the usual one of its kind."""
        return COEFFICIENTS[self.hourglass] if self.hourglass_coefficient is None else self.hourglass_coefficient


class HexElements:
    """e elements on n nodes; x: (n, 3) [m] at the whole step, v: (n, 3) [m/s] at the half step before.

    alive: (e,) elements that are not eroded; going: (e,) those that go in the step that ended.
    """

    def __init__(self, mesh: HexMesh, v: Array, material: Material, settings: HexSettings | None = None) -> None:
        self.material, self.settings = material, settings or HexSettings()
        self.shear_modulus = material.shear_modulus if isinstance(material, SolidMaterial) else 0.0
        self.shock, self.shortest_step = np.array(self.settings.shock) * SHOCK, 0.0
        self.x, self.v, self.elements = mesh.nodes.copy(), v.copy(), mesh.cells
        e = len(mesh.cells)
        self.alive, self.going = np.ones(e, np.bool_), np.zeros(e, np.bool_)
        self.volume, self.volume_before = np.zeros(e), np.zeros(e)
        self.gradient, self.shape, self.force = np.zeros((e, 3, 8)), np.zeros((e, 3, 4)), np.zeros((e, 8, 3))
        self.rate, self.hourglass_rate, self.hourglass = np.zeros((e, 9)), np.zeros((e, 3, 4)), np.zeros((e, 3, 4))
        hex_geometry(self.elements, self.alive, self.x, self.volume, self.gradient, self.shape)
        self.volume0, eos = self.volume.copy(), material.eos
        self.element_mass = eos.rho0 * self.volume0
        self.rho, self.c, self.q = np.full(e, eos.rho0), np.full(e, eos.sound_speed), np.zeros(e)
        self.pressure, self.energy = np.full(e, eos.pressure_at_rest), np.full(e, eos.initial_energy)
        self.s, self.back, self.tau, self.stress = (np.zeros((e, 6)) for _ in range(4))
        self.eps_p, self.heat, self.step = np.zeros(e), np.zeros(e), np.full(e, np.inf)
        self.pressure_work, self.stress_work, self.hourglass_work = np.zeros(e), np.zeros(e), np.zeros(e)
        self.viscous_work = np.zeros((e, 3))

    @property
    def limits(self) -> Array:
        """Largest and smallest V/V0, largest plastic strain, smallest stable step [s] before erosion."""
        m = self.material
        if isinstance(m, SolidMaterial):
            return np.array([np.inf, 0.0, m.failure_strain, self.shortest_step])
        return np.array([*m.limits[1:], np.inf, self.shortest_step])

    def update_geometry(self, dt: float) -> None:
        """Rates over the step that ended, present volumes, and which elements go."""
        hex_rates(self.elements, self.alive, self.x, self.v, dt, self.rate, self.hourglass_rate)
        self.volume_before, self.volume = self.volume, self.volume_before
        hex_geometry(self.elements, self.alive, self.x, self.volume, self.gradient, self.shape)
        self.find_steps()
        find_eroded(self.volume, self.volume0, self.eps_p, self.step, self.limits, self.alive, self.going)

    def update_stress(self, dt: float) -> None:
        """Pressure, strength, viscosity, shock and hourglass forces over the step that ended, each with its work."""
        m, acting = self.material, (self.alive, self.going)
        pressure = (self.rho, self.pressure, self.energy, self.c, self.pressure_work)
        volumes = (self.volume, self.volume0, self.heat)
        update_pressure(*acting, m.eos.constants, m.pressure_cutoff, self.element_mass, *volumes, *pressure)
        both = (self.volume_before, self.volume)
        if isinstance(m, SolidMaterial):
            solid = (self.s, self.back, self.eps_p, self.stress_work)
            update_strength(*acting, dt, self.rate, m.strength, *both, *solid)
        fluid = (self.gradient, self.tau, self.q, self.viscous_work)
        update_viscosity(*acting, dt, self.rate, m.viscosity, self.shock, self.c, self.rho, *both, *fluid)
        self.update_hourglass(dt)

    def update_hourglass(self, dt: float) -> None:
        """Hourglass forces: dampers, or springs of the shear modulus (of a fluid: of the bulk modulus)."""
        m, acting, factor = self.material, (self.alive, self.going), self.settings.control
        if self.settings.hourglass == "viscous":
            state = (self.element_mass, self.volume, self.c, self.hourglass, self.hourglass_work)
            viscous_hourglass(*acting, dt, factor, self.hourglass_rate, *state)
        else:
            modulus = 2.0 * self.shear_modulus or m.eos.bulk_modulus
            state = (self.volume, self.gradient, self.hourglass, self.hourglass_work)
            elastic_hourglass(*acting, dt, factor, modulus, self.rate, self.hourglass_rate, *state)

    def find_steps(self) -> None:
        """Stable step of every live element, `step` (e,) [s]."""
        m = self.material
        size = (self.volume, self.gradient, self.rate, self.element_mass, self.c)
        stable_steps(self.alive, *size, 4.0 / 3.0 * self.shear_modulus, m.viscosity, self.shock, self.step)

    def update_element_forces(self) -> None:
        """Forces on the eight nodes of each element, `force` (e, 8, 3) [N]."""
        total_stress(self.alive, self.pressure, self.q, self.s, self.tau, self.stress)
        hex_forces(self.alive, self.stress, self.hourglass, self.volume, self.gradient, self.shape, self.force)
