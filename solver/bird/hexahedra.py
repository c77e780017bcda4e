"""The bird as Lagrangian one-point hexahedra: nodes, erosion, energies, motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array
from birdstrike.solver.arrays import node_rows
from birdstrike.solver.bird.eos.compiled import with_law
from birdstrike.solver.bird.hex_mesh import HexMesh
from birdstrike.solver.bird.materials.interface import Material
from birdstrike.solver.kernels.bird.hexahedra import gather_accelerations, hex_forces, hex_geometry, hex_rates
from birdstrike.solver.kernels.bird.hexahedra_hourglass import elastic_hourglass, viscous_hourglass
from birdstrike.solver.kernels.bird.hexahedra_stress import (
    find_eroded,
    stable_steps,
    total_stress,
    update_pressure,
    update_strength,
    update_viscosity,
)
from birdstrike.solver.kernels.motion import drift_particles, kick_particles
from birdstrike.solver.kernels.sums import total, weighted_square

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
        self.update_pressure = with_law(update_pressure, material.eos.terms)
        self.strength = material.strength
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
        return np.array([*self.material.volume_limits, self.material.failure_strain, self.shortest_step])

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
        self.update_pressure(*acting, m.eos.constants, m.pressure_cutoff, self.element_mass, *volumes, *pressure)
        both = (self.volume_before, self.volume)
        if self.strength is not None:
            solid = (self.s, self.back, self.eps_p, self.stress_work)
            update_strength(*acting, dt, self.rate, self.strength, *both, *solid)
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
            modulus = 2.0 * m.shear_modulus or m.eos.bulk_modulus
            state = (self.volume, self.gradient, self.hourglass, self.hourglass_work)
            elastic_hourglass(*acting, dt, factor, modulus, self.rate, self.hourglass_rate, *state)

    def find_steps(self) -> None:
        """Stable step of every live element, `step` (e,) [s]."""
        m = self.material
        size = (self.volume, self.gradient, self.rate, self.element_mass, self.c)
        stable_steps(self.alive, *size, 4.0 / 3.0 * m.shear_modulus, m.viscosity, self.shock, self.step)

    def update_element_forces(self) -> None:
        """Forces on the eight nodes of each element, `force` (e, 8, 3) [N]."""
        total_stress(self.alive, self.pressure, self.q, self.s, self.tau, self.stress)
        hex_forces(self.alive, self.stress, self.hourglass, self.volume, self.gradient, self.shape, self.force)


ENERGIES = ("bird_pressure", "bird_stress", "bird_viscous", "bird_shock", "bird_hourglass", "eroded")
DISTORTED_LIMIT, HOURGLASS_LIMIT = 0.05, 0.1  # warned of from these shares of mass and normal kinetic energy


class HexBird(HexElements):
    """n nodes under their elements' forces.

    active: (n,) nodes with a live element. The others fly on freely and touch nothing; their mass, momentum and
    energy stay in the balance.
    """

    subcycled = False

    def __init__(self, mesh: HexMesh, v: Array, material: Material, settings: HexSettings | None = None) -> None:
        super().__init__(mesh, v, material, settings)
        n = self.n = len(mesh.nodes)
        self.bulk_modulus = material.bulk_modulus  # [Pa], that contact goes by, see `stiffen`
        self.acceleration, self.stored = np.zeros((n, 3)), np.zeros((len(mesh.cells), 2))
        self.lag, self.push = np.zeros((n, 3)), np.zeros((n, 3))
        self.active, self.eroded_now = np.ones(n, np.bool_), np.zeros(n, np.bool_)
        self.start, self.member = node_rows(self.elements, n)
        eighths = np.repeat(0.125 * self.element_mass, 8)
        self.masses = np.bincount(self.elements.ravel(), eighths, minlength=n).astype(float)
        self.energies: dict[str, float] = dict.fromkeys(ENERGIES, 0.0)
        self.unit_dissipation, self.distorted_mass = 0.0, 0.0

    @property
    def spacing(self) -> float:
        """Edge of a cube of the elements' mean volume [m]."""
        return float(self.volume0.mean() ** (1.0 / 3.0))

    @property
    def skin(self) -> float:
        """From a point of contact to the bird's surface [m]: none, the nodes lie on it."""
        return 0.0

    @property
    def cells(self) -> NDArray[np.int64]:
        """Nodes of the live elements, (k, 8)."""
        return self.elements[self.alive]

    @property
    def p(self) -> Array:
        """Pressure at the nodes, (n,) [Pa]: mean of the live elements around."""
        return self.at_nodes(self.pressure)

    def stiffen(self, normal_speed: float) -> None:
        """Raise the modulus that contact goes by where the law at rest is far softer than behind the shock.

        As an SPH bird's: at the Hugoniot pressure of the impact the overlap is a quarter of the spacing at most.
        """
        self.bulk_modulus = max(self.bulk_modulus, 4.0 * self.material.eos.hugoniot(normal_speed)[0])

    def update_density(self, dt: float) -> None:
        """Geometry, erosion and stress over the step that ended. Raises RunFailed on a position that is not finite."""
        if not np.isfinite(self.x).all():
            raise RunFailed("a bird node's position is no longer finite", "lower solver.courant")
        self.update_geometry(dt)
        self.free_nodes()
        self.update_stress(dt)

    def free_nodes(self) -> None:
        """Nodes whose last live element went in this step touch nothing from now on."""
        self.eroded_now[:] = False
        if self.going.any():
            self.distorted_mass += float(self.element_mass[self.going & (self.step < self.shortest_step)].sum())
            held = np.zeros(self.n, np.bool_)
            held[self.elements[self.alive]] = True
            self.eroded_now[:] = self.active & ~held
            self.active[:] = held

    def update_forces(self, _dt: float) -> None:
        """Nodal accelerations at the whole step; the stress is already that of the step's end."""
        self.update_element_forces()
        gather_accelerations(self.start, self.member, self.force, self.masses, self.acceleration)

    def update_energies(self, _dt: float) -> None:
        """Works of the step that ended; what an eroded element had stored as pressure and strength is frozen."""
        self.energies["bird_pressure"] += total(self.pressure_work)
        self.energies["bird_stress"] += total(self.stress_work)
        self.energies["bird_viscous"] += total(self.viscous_work[:, 0])
        self.energies["bird_shock"] += total(self.viscous_work[:, 1])
        self.unit_dissipation += total(self.viscous_work[:, 2])
        self.energies["bird_hourglass"] += total(self.hourglass_work)
        self.stored[:, 0] += self.pressure_work
        self.stored[:, 1] += self.stress_work
        dissipated = self.stress_work + self.viscous_work[:, 0] + self.viscous_work[:, 1] + self.hourglass_work
        self.heat = dissipated / self.volume0
        if self.going.any():
            frozen = self.stored[self.going].sum(axis=0)
            self.energies["bird_pressure"] -= float(frozen[0])
            self.energies["bird_stress"] -= float(frozen[1])
            self.energies["eroded"] += float(frozen.sum())

    def kick(self, dt: float) -> None:
        """Half-step velocities under the bird's own forces."""
        kick_particles(self.n, dt, self.acceleration, self.v, self.lag)

    def drift(self, dt: float) -> None:
        """New positions."""
        drift_particles(self.n, dt, self.v, self.x)

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        return weighted_square(self.masses, self.v, self.n)

    def equivalent_viscosity(self) -> float:
        """Shear viscosity [Pa s] that would have dissipated as much in this flow as the shock viscosity did."""
        return self.energies["bird_shock"] / self.unit_dissipation if self.unit_dissipation > 0.0 else 0.0

    def step_at_impact(self, normal_speed: float) -> float:
        """Step [s] that the bird allows: the shortest before an element counts as distorted and is eroded.

        It is `smallest_step` of the undistorted mesh's, behind the shock of an impact at this speed [m/s].
        """
        rest = self.c.copy()
        self.c[:] = self.material.eos.shocked_sound_speed(normal_speed)
        self.find_steps()
        self.c[:] = rest
        self.shortest_step = self.settings.smallest_step * float(self.step.min())
        return self.shortest_step

    def at_nodes(self, values: Array) -> Array:
        """Mean over the live elements around each node, (n,); 0 where there is none."""
        nodes = self.cells.ravel()
        count = np.bincount(nodes, minlength=self.n)
        summed = np.bincount(nodes, np.repeat(values[self.alive], 8), minlength=self.n)
        return summed / np.maximum(count, 1)

    def von_mises(self) -> Array:
        """Von Mises stress at the nodes, (n,) [Pa], of strength and viscosity."""
        d = self.s + self.tau
        return self.at_nodes(np.sqrt(1.5 * ((d[:, :3] ** 2).sum(axis=1) + 2.0 * (d[:, 3:] ** 2).sum(axis=1))))

    def facts(self) -> dict[str, float]:
        """What a summary says of the bird; `particles` counts the elements."""
        gone = ~self.alive
        return {
            "particles": len(self.elements),
            "nodes": self.n,
            "eroded_particles": int(gone.sum()),
            "eroded_mass_fraction": float(self.element_mass[gone].sum() / self.element_mass.sum()),
            "distorted_mass_fraction": self.distorted_mass / float(self.element_mass.sum()),
            "erosion_step_s": self.shortest_step,
        }

    def warnings(self, normal_energy: float) -> list[str]:
        """What the user should know: mass lost by distortion, and hourglass work of the normal kinetic energy [J]."""
        found, distorted = [], self.facts()["distorted_mass_fraction"]
        if distorted > DISTORTED_LIMIT:
            text = f"{distorted:.0%} of the bird's mass was eroded because its elements were too distorted"
            found.append(f"{text}: lower solver.smallest_step (now {self.settings.smallest_step:g}), at more cost")
        share = self.energies["bird_hourglass"] / normal_energy
        if share > HOURGLASS_LIMIT:
            text = f"the bird's hourglass control took {share:.0%} of the normal kinetic energy"
            found.append(f"{text}: its mesh is too coarse for the flow; refine bird.particles, or bird.method = sph")
        return found
