"""A plain weakly compressible SPH of the same bird in taichi, to hold our cost against: fewer terms, same pairs.

Continuity, a linear equation of state, pressure and Monaghan's viscosity on the Wendland C2 kernel, float64, one
thread. Ours computes besides: corrected gradients, the viscous stress, a limited shock viscosity, a Grueneisen equation
of state with energy, erosion, and the energies.
"""

import numpy as np
import taichi as ti  # pyright: ignore[reportMissingImports]

from birdstrike.solver.bird.sph import Bird

ALPHA = 0.1  # Monaghan's linear viscosity
LONGEST = 128  # neighbours of a particle


@ti.data_oriented
class Wcsph:
    """Its state, copied from a bird; `search` lists all pairs within the support, `step` moves on by dt [s]."""

    def __init__(self, bird: Bird, dt: float) -> None:
        self.n, self.mass, self.h, self.constant, self.dt = bird.n, bird.mass, bird.h, bird.slope, dt
        self.rho0, self.c = bird.material.rho0, bird.material.eos.sound_speed
        self.x, self.v, self.force = (ti.Vector.field(3, ti.f64, self.n) for _ in range(3))
        self.rho, self.pressure, self.rate = (ti.field(ti.f64, self.n) for _ in range(3))
        self.x.from_numpy(bird.x[: self.n])
        self.v.from_numpy(bird.v[: self.n])
        self.rho.from_numpy(bird.rho[: self.n])
        self.lower = ti.Vector((bird.x.min(axis=0) - 2.0 * self.h).tolist())
        self.shape = tuple(int(k) for k in np.ceil(np.ptp(bird.x, axis=0) / (2.0 * self.h)) + 3)
        self.start, self.filled = (ti.field(ti.i32, int(np.prod(self.shape)) + 1) for _ in range(2))
        self.member, self.count = ti.field(ti.i32, self.n), ti.field(ti.i32, self.n)
        self.listed = ti.field(ti.i32, (self.n, LONGEST))

    @ti.func
    def cell(self, a):
        return ti.cast(ti.floor((self.x[a] - self.lower) / (2.0 * self.h)), ti.i32)

    @ti.func
    def place(self, cell):
        return (cell[0] * self.shape[1] + cell[1]) * self.shape[2] + cell[2]

    @ti.kernel
    def search(self):
        for k in self.start:
            self.start[k] = 0
        for a in range(self.n):
            self.start[self.place(self.cell(a)) + 1] += 1
        ti.loop_config(serialize=True)
        for k in range(self.start.shape[0] - 1):
            self.start[k + 1] += self.start[k]
            self.filled[k] = self.start[k]
        for a in range(self.n):
            k = ti.atomic_add(self.filled[self.place(self.cell(a))], 1)
            self.member[k] = a
        for a in range(self.n):
            here, found = self.cell(a), 0
            for offset in ti.static(ti.ndrange((-1, 2), (-1, 2))):
                row = self.place(here + ti.Vector([offset[0], offset[1], 0]))
                for m in range(self.start[row - 1], self.start[row + 2]):
                    b = self.member[m]
                    r = self.x[a] - self.x[b]
                    if b != a and r.dot(r) < 4.0 * self.h * self.h:
                        self.listed[a, found] = b
                        found += 1
            self.count[a] = found

    @ti.func
    def slope(self, r2):
        s = ti.max(1.0 - 0.5 * ti.sqrt(r2) / self.h, 0.0)
        return self.constant * s * s * s

    @ti.kernel
    def step(self):
        for a in range(self.n):
            rate = 0.0
            for m in range(self.count[a]):
                b = self.listed[a, m]
                r = self.x[a] - self.x[b]
                rate += (self.v[a] - self.v[b]).dot(r) * self.slope(r.dot(r))
            self.rate[a] = self.mass * rate
        for a in range(self.n):
            self.rho[a] += self.dt * self.rate[a]
            self.pressure[a] = self.c * self.c * (self.rho[a] - self.rho0)
        for a in range(self.n):
            total = ti.Vector([0.0, 0.0, 0.0])
            own = self.pressure[a] / self.rho[a] ** 2
            for m in range(self.count[a]):
                b = self.listed[a, m]
                r, u = self.x[a] - self.x[b], self.v[a] - self.v[b]
                r2 = r.dot(r)
                mu = ti.min(self.h * u.dot(r) / (r2 + 0.01 * self.h * self.h), 0.0)
                push = own + self.pressure[b] / self.rho[b] ** 2
                push -= 2.0 * ALPHA * self.c * mu / (self.rho[a] + self.rho[b])
                total -= self.mass * push * self.slope(r2) * r
            self.force[a] = total
        for a in range(self.n):
            self.v[a] += self.dt * self.force[a]
            self.x[a] += self.dt * self.v[a]
