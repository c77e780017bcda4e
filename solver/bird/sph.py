"""The bird as SPH particles: state, and one step of density, pressure and forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array
from birdstrike.solver.arrays import aligned_zeros
from birdstrike.solver.bird.eos.compiled import with_law
from birdstrike.solver.bird.materials.interface import Material
from birdstrike.solver.bird.neighbour_list import VerletList
from birdstrike.solver.kernels.bird.columns import ROW
from birdstrike.solver.kernels.bird.null_material import update_null_material
from birdstrike.solver.kernels.bird.smoothing import slope_constant
from birdstrike.solver.kernels.bird.sph import RATE, pack_state, pair_forces
from birdstrike.solver.kernels.bird.velocity_gradient import pack_midpoint, rate_of_deformation
from birdstrike.solver.kernels.motion import drift_particles, kick_particles
from birdstrike.solver.kernels.sums import total, weighted_square

WAVE_COURANT = 0.72  # c dt/h of a weak wave; with it the energy error of the reference strike is 0.14 %


@dataclass(frozen=True)
class Images:
    """Copies of particles that stand in for a periodic neighbourhood: parent (g,) numbers, shift (g, 3) [m]."""

    parent: np.ndarray
    shift: Array


class Bird:
    """n particles of equal mass (and the images of some, in rows n..N), stepped by kick and drift.

    x: (N, 3) [m] at the whole step; v: (N, 3) [m/s] at the half step before; the rest at the whole step. lag (N, 3)
    [m/s]: by how much v exceeds the mean velocity of the step, when contact kicks the bird within its step; push
    (N, 3) [m/s]: half of contact's kick at the present whole step. stored: p dV work since the start per reference
    volume [J/m^3]. gain: of the kernel's slope, see `slope_gain`.
    """

    subcycled = True

    def __init__(
        self,
        x: Array,
        v: Array,
        mass: float,
        h: float,
        material: Material,
        shock: tuple[float, float],
        images: Images | None = None,
        gain: float = 1.0,
    ) -> None:
        self.n = len(x)
        self.images = images
        rows = self.n + (len(images.parent) if images else 0)
        self.slope, self.gain = gain * slope_constant(h), gain
        self.mass, self.h, self.material, self.shock = mass, h, material, np.array(shock)
        self.limits = material.limits
        self.update_material = with_law(update_null_material, material.eos.terms)
        self.bulk_modulus = material.bulk_modulus  # [Pa], at rest, see `stiffen`
        self.x, self.v = np.zeros((rows, 3)), np.zeros((rows, 3))
        self.lag, self.push = np.zeros((rows, 3)), np.zeros((rows, 3))
        self.x[: self.n], self.v[: self.n] = x, v
        eos = material.eos
        self.rho, self.p = np.full(rows, eos.rho0), np.full(rows, eos.pressure_at_rest)
        self.c = np.full(rows, eos.sound_speed)
        self.energy = np.full(rows, eos.initial_energy)
        self.work, self.heating = np.zeros(rows), np.zeros(rows)
        self.stored = np.zeros(rows)
        self.active, self.eroded_now = np.ones(rows, np.bool_), np.zeros(rows, np.bool_)
        self.drho_dt = np.zeros(rows)
        self.acceleration, self.acceleration_before = np.zeros((rows, 3)), np.zeros((rows, 3))
        self.dissipation = np.zeros((rows, 2))
        self.row = aligned_zeros(rows, ROW)
        self.deformation = self.row[:, RATE : RATE + 6]  # a million particles pay for no copy
        self.masses = np.broadcast_to(mass, self.n)  # all alike: a million particles pay for one
        self.cells = np.empty((0, 8), np.int64)
        self.energies: dict[str, float] = dict.fromkeys(("bird_pressure", "bird_viscous", "bird_shock", "eroded"), 0.0)
        self.unit_dissipation = 0.0
        self.powers: dict[str, float] = {}  # of dissipation and springs [W], at the end of the step before
        self.list = VerletList(self.n, 2.0 * h)
        self.refresh_images()

    @property
    def volume(self) -> float:
        """Reference volume of a particle [m^3]."""
        return self.mass / self.material.rho0

    @property
    def spacing(self) -> float:
        """Edge of the cube that a particle stands for [m]."""
        return self.volume ** (1.0 / 3.0)

    @property
    def skin(self) -> float:
        """From a particle's centre to the bird's surface [m]."""
        return 0.5 * self.spacing

    def facts(self) -> dict[str, float]:
        """What a summary says of the bird."""
        eroded = int(np.count_nonzero(~self.active[: self.n]))
        return {
            "particles": self.n,
            "neighbours_mean": self.list.mean_length,
            "list_rebuilds": self.list.rebuilds,
            "eroded_particles": eroded,
            "eroded_mass_fraction": eroded / self.n,
        }

    def warnings(self, _normal_energy: float) -> list[str]:
        """Nothing beyond what every bird has."""
        return []

    def refresh_images(self) -> None:
        """Images follow their parents."""
        if self.images is None:
            return
        parent = self.images.parent
        self.x[self.n :] = self.x[parent] + self.images.shift
        followed = (self.v, self.lag, self.rho, self.p, self.c, self.drho_dt, self.deformation, self.active)
        for field in (*followed, self.acceleration, self.acceleration_before):
            field[self.n :] = field[parent]

    def update_density(self, dt: float) -> None:
        """Density over the step that ended, pressure, erosion. Raises RunFailed on a density that is not positive."""
        self.list.refresh(self.x, self.active)
        rows = self.list.rows
        pack_midpoint(len(self.x), self.x, self.v, self.lag, self.rho, dt, self.row)
        rate_of_deformation(self.n, self.row, self.mass, self.h, self.slope, *rows, self.drho_dt, self.deformation)
        state = (self.rho, self.p, self.energy, self.c, self.active, self.eroded_now, self.work)
        self.update_material(self.n, dt, self.material.eos.constants, self.limits, self.drho_dt, self.heating, *state)
        self.stored += self.work
        self.after_material()

    def after_material(self) -> None:
        """What eroded leaves the lists, images follow. Raises RunFailed on a density that is not positive."""
        if not self.rho[: self.n].min() > 0.0:
            raise RunFailed("a bird particle's density is no longer positive", "lower solver.courant")
        if self.eroded_now.any():
            self.deformation[self.eroded_now] = 0.0
            self.list.build(self.x, self.active)
        self.refresh_images()

    def update_forces(self, dt: float) -> None:
        """Accelerations and dissipated powers at the whole step."""
        mu = self.material.viscosity
        rows = self.list.rows
        state = (self.rho, self.p, self.c)
        motion = (self.x, self.v, self.push, self.acceleration, self.acceleration_before)
        pack_state(len(self.x), *motion, *state, dt, self.row)
        self.acceleration, self.acceleration_before = self.acceleration_before, self.acceleration
        pair = (self.row, self.mass, self.h, self.slope, mu, self.shock, *rows, self.acceleration, self.dissipation)
        pair_forces(self.n, *pair)
        heating = self.heating[: self.n]  # in place: a million particles would take three arrays on the way
        np.multiply(self.dissipation[: self.n, 0], mu, out=heating)
        heating += self.dissipation[: self.n, 1]
        heating /= self.volume

    def update_energies(self, dt: float) -> None:
        """Works of the step that ended; of the dissipated powers the mean of its two ends."""
        unit, shock = (self.over_step(dt, name, self.dissipation[:, i]) for i, name in enumerate(("unit", "shock")))
        self.unit_dissipation += unit
        self.energies["bird_pressure"] += self.volume * total(self.work)
        self.energies["bird_viscous"] += self.material.viscosity * unit
        self.energies["bird_shock"] += shock
        if self.eroded_now.any():
            frozen = self.volume * float(self.stored[self.eroded_now].sum())
            self.energies["bird_pressure"] -= frozen
            self.energies["eroded"] += frozen

    def over_step(self, dt: float, name: str, powers: Array) -> float:
        """Trapezoid of the sum of powers (n,) over the step that ended [J]."""
        before, self.powers[name] = self.powers.get(name, 0.0), total(powers)
        return 0.5 * dt * (before + self.powers[name])

    def equivalent_viscosity(self) -> float:
        """Shear viscosity [Pa s] that would have dissipated as much in this flow as the shock viscosity did."""
        return self.energies["bird_shock"] / self.unit_dissipation if self.unit_dissipation > 0.0 else 0.0

    def kick(self, dt: float) -> None:
        """Half-step velocities under the bird's own forces."""
        kick_particles(self.n, dt, self.acceleration, self.v, self.lag)

    def drift(self, dt: float) -> None:
        """New positions."""
        drift_particles(self.n, dt, self.v, self.x)
        self.refresh_images()

    def kick_and_drift(self, kick: float, drift: float) -> None:
        """New half-step velocities, then new positions."""
        self.kick(kick)
        self.drift(drift)

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        return weighted_square(np.array([self.mass]), self.v, self.n)

    def step_at_impact(self, normal_speed: float) -> float:
        """Largest stable step [s] behind the shock of an impact at this speed [m/s].

        A law that hardly stiffens has as steep a shock: its quadratic viscosity adds 2 beta u to the sound speed c0,
        and the step falls as 1/(1 + 2 beta u/c0), to a quarter at most, where stiffening has not asked for that.
        """
        rest, behind = self.material.fastest_wave(1e-3), self.material.fastest_wave(normal_speed)
        steep = 1.0 + 2.0 * float(self.shock[1]) * normal_speed / rest
        stiff = max((rest / behind) ** 2, 0.25)
        return self.stable_step(behind) * min(1.0, max(1.0 / steep, 0.25) / stiff)

    def stiffen(self, normal_speed: float) -> None:
        """Raise the bulk modulus that contact goes by, where the law at rest is far softer than behind the shock.

        At the Hugoniot pressure of the impact the overlap is then a quarter of the spacing at most; a bubbly bird,
        40 m/s at rest, would else be penetrated. Stiff liquids keep their own.
        """
        pressure = self.material.eos.hugoniot(normal_speed)[0]
        self.bulk_modulus = max(self.bulk_modulus, 4.0 * pressure)

    def von_mises(self) -> Array:
        """Von Mises stress of each particle, (n,) [Pa]: that of 2 MU dev D; nothing in what is eroded."""
        d = self.deformation[: self.n]
        trace = d[:, :3].sum(axis=1) / 3.0
        squared = ((d[:, :3] - trace[:, None]) ** 2).sum(axis=1) + 2.0 * (d[:, 3:] ** 2).sum(axis=1)
        return 2.0 * self.material.viscosity * np.sqrt(1.5 * squared) * self.active[: self.n]

    def stable_step(self, speed_of_sound: float) -> float:
        """Largest step [s] that is stable, and resolves the waves in time.

        Resolved: c dt/h <= WAVE_COURANT (c0/c)^2, a quarter of it at least, for a strong shock, which stiffens the bird
        from c0 to c, dissipates more of the energy in as few steps; half of it where an erosion limit acts, because
        erosion is a jump.
        Stable on an undistorted lattice is lambda dt + (omega dt)^2/2 <= 2, by von Neumann analysis.

        omega = 1.165 c/h is the highest acoustic frequency of Wendland C2 on cubic and FCC lattices (h = 1 to 2.5
        spacings), lambda the highest damping rate. That of the shock viscosity is 18/h^2 times half of its linear part,
        c h/10: on a lattice a disturbance opens one pair for each that it closes, and the shock viscosity acts on the
        closing ones only. That of MU is 4/3 (1.165/h)^2 MU/rho, doubled because the gradient's correction enlarges
        strains at a free surface. Velocities extrapolated by the mean of the last two accelerations are second order,
        and stable to the same limit as if they were not extrapolated at all; extrapolated by the last one alone, only
        to lambda dt + (omega dt)^2/4 = 1.
        """
        omega = 1.165 * self.gain * speed_of_sound / self.h
        viscous = 8.0 / 3.0 * (1.165 * self.gain / self.h) ** 2 * self.material.viscosity / self.material.rho0
        damping = viscous + 18.0 * self.gain * 0.05 * self.shock[0] * speed_of_sound / self.h
        stable = 4.0 / (damping + (damping**2 + 4.0 * omega**2) ** 0.5)
        stiffening = max(speed_of_sound / self.material.fastest_wave(1e-3), 1.0)
        resolved = WAVE_COURANT * max(stiffening**-2, 0.25) * self.h / speed_of_sound
        return float(min(stable, 0.5 * resolved if self.may_erode(stiffening) else resolved))

    def may_erode(self, stiffening: float, /) -> bool:
        """Whether an erosion limit may act when shocks raise the sound speed by the factor `stiffening`.

        A liquid's sound speed grows at least twice as fast as its density (K' >= 3).
        """
        largest, smallest = self.material.volume_limits
        return bool(largest < np.inf or 1.0 - smallest < 0.5 * (stiffening - 1.0))
