"""A target: nodes, blocks of elements on them, supports, ties and rivets; what the coupling steps and a bird hits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.node_motion import force_on_frame
from birdstrike.solver.target.block import Block
from birdstrike.solver.target.links.rivets import Rivets
from birdstrike.solver.target.links.ties import Ties
from birdstrike.solver.target.mesh import ShellMesh
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.shell_block import ShellBlock
from birdstrike.solver.target.supports import DISPLACEMENTS, Supports


class Target:
    """Blocks on common nodes, held by supports, joined by ties and rivets.

    mesh: its shells at rest, with the surface in which sensors lie.
    x, v, omega, mass, inertia, nodal: those of the nodes; quads (f, 4), skin (f,): the facets of all blocks, in their
    order; one_sided: touched from the side alone that the bird starts on.
    """

    def __init__(
        self,
        mesh: ShellMesh,
        nodes: Nodes,
        blocks: Sequence[Block],
        supports: Supports,
        one_sided: bool = False,
        ties: Ties | None = None,
        rivets: Rivets | None = None,
    ) -> None:
        self.mesh, self.nodes, self.blocks, self.supports = mesh, nodes, list(blocks), supports
        self.one_sided, self.ties, self.rivets = one_sided, ties, rivets
        for block in self.blocks:
            block.add_mass(nodes)
        if ties is not None:
            ties.take_mass(nodes)
        self.acting, self.shared = np.zeros((len(nodes), 3)), False
        supports.hold(nodes)
        self.mass, self.inertia, self.nodal = nodes.mass, nodes.inertia, nodes.nodal
        self.quads = np.concatenate([block.facets for block in self.blocks])
        self.skin = np.concatenate([block.skin for block in self.blocks])
        self.support_work = 0.0
        self.lost_to_frame = {"plate_edges": 0.0, "plate_damping": 0.0}
        if rivets is not None:
            self.lost_to_frame["rivets"] = 0.0
        self.on_frame = np.zeros(6)
        self.watched = np.empty(0, np.int64)

    @property
    def x(self) -> Array:
        """Positions, (m, 3) [m]."""
        return self.nodes.x

    @property
    def v(self) -> Array:
        """Velocities of the half step, (m, 3) [m/s]."""
        return self.nodes.v

    @property
    def omega(self) -> Array:
        """Rates of rotation of the half step, (m, 3) [rad/s]."""
        return self.nodes.omega

    @property
    def straining(self) -> list[ShellBlock]:
        """The blocks of shells that are not rigid."""
        return [block for block in self.blocks if isinstance(block, ShellBlock)]

    @property
    def shells(self) -> ShellBlock:
        """The first block of shells; raises UserError where there is none that strains."""
        self.require_strain()
        return self.straining[0]

    def require_strain(self) -> None:
        """Raise UserError where all blocks are rigid."""
        if not self.strains:
            raise UserError("a rigid plate has no strain: leave out its strain sensors or plate.rigid")

    @property
    def strains(self) -> bool:
        """Whether any block is not rigid."""
        return any(isinstance(block, ShellBlock) for block in self.blocks)

    def frames(self, facets: NDArray[np.int64]) -> Array:
        """Frames of shells, (k, 9), see `kernels.target.shell_geometry`."""
        return np.concatenate([block.frame for block in self.straining])[facets]

    def watch(self, facets: NDArray[np.int64]) -> None:
        """From now on the strain increments of these facets (k,), which rise, are summed, for strain gauges."""
        self.watched, first = facets, 0
        for block in self.straining:
            beyond = first + len(block.facets)
            block.watch(facets[(facets >= first) & (facets < beyond)] - first)
            first = beyond

    @property
    def felt(self) -> Array:
        """Sums of the strain increments of the watched facets, (k, 8)."""
        blocks = self.straining
        return blocks[0].felt if len(blocks) == 1 else np.concatenate([block.felt for block in blocks])

    @property
    def alive(self) -> NDArray[np.bool_]:
        """Facets that have not torn, (f,)."""
        return self.blocks[0].alive if len(self.blocks) == 1 else np.concatenate([b.alive for b in self.blocks])

    @property
    def thickness(self) -> float:
        """Of the thickest facet [m]."""
        return 2.0 * float(self.skin.max())

    @property
    def eps_p(self) -> float:
        """Largest plastic strain."""
        return max(float(block.eps_p.max()) for block in self.blocks)

    @property
    def eroded(self) -> int:
        """Elements that are gone."""
        return sum(block.eroded for block in self.blocks)

    @property
    def air_impulse(self) -> Array:
        """What mass damping has given to the surroundings, (3,) [N s]."""
        return self.nodes.air_impulse

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Nodes held in all displacements, (m,)."""
        return self.nodes.held & DISPLACEMENTS == DISPLACEMENTS

    @property
    def energies(self) -> dict[str, float]:
        """Of all blocks, the supports' springs and the damping [J]."""
        together = dict.fromkeys((name for block in self.blocks for name in block.energies), 0.0)
        for block in self.blocks:
            for name, value in block.energies.items():
                together[name] += value
        return together | self.lost_to_frame

    def clear_stress(self) -> None:
        """Stress-free blocks, springs at rest."""
        for block in self.blocks:
            block.clear_stress()
        self.supports.relax()
        if self.rivets is not None:
            self.rivets.relax()

    def preload(self, along_length: float, along_width: float) -> None:
        """Initial membrane stresses [Pa] along x and y, held by the frame; raises UserError for free edges."""
        self.shells.prestress(along_length, along_width)
        self.update_forces(0.0)
        self.supports.balance(self.nodal)

    def update_forces(self, dt: float) -> None:
        """Stress over the step that ended and the nodal forces of the present shape, `nodal` (m, 6) [N, N m]."""
        self.nodal[:] = 0.0
        for block in self.blocks:
            block.add_forces(self.nodes, dt)
        self.support_work = self.supports.update_forces(self.nodes, dt)
        self.shared = False
        if self.rivets is not None:
            self.lost_to_frame["rivets"] += self.rivets.update_forces(self.nodes, dt)

    def share_forces(self, applied: Array) -> Array:
        """Internal and applied forces (m, 3) [N] of tied nodes pass on, once a step; returns the applied ones left."""
        if self.ties is None:
            return applied
        if not self.shared:
            self.acting[:] = applied
            self.ties.share_forces(self.nodal, self.acting)
            self.shared = True
        return self.acting

    def update_energies(self) -> None:
        """Works of the step that ended."""
        for block in self.blocks:
            block.update_energies()
        self.lost_to_frame["plate_edges"] += self.support_work

    def kick_and_drift(self, kick: float, drift: float, applied: Array) -> None:
        """New half-step velocities under internal and applied forces (m, 3) [N], then new positions."""
        acting = self.share_forces(applied)
        self.lost_to_frame["plate_damping"] += self.nodes.kick_and_drift(kick, drift, acting)
        if self.ties is not None:
            self.ties.follow(self.nodes, drift)

    def reaction(self, applied: Array, result: Array) -> None:
        """Force of the target on its frame into result (3,) [N]; with its moment about the origin in `on_frame`."""
        acting = self.share_forces(applied)
        force_on_frame(self.nodal, acting, self.nodes.held, self.nodes.axes, self.x, self.on_frame)
        self.supports.add_to_frame(self.x, self.on_frame)
        result[:] = self.on_frame[:3]

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        return self.nodes.kinetic_energy()

    def von_mises(self) -> Array:
        """Largest von Mises stress of each facet, (f,) [Pa]."""
        return np.concatenate([block.von_mises() for block in self.blocks])

    def unloaded(self) -> Target | None:
        """The same target at rest without yielding, its rigid holds released; None where nothing strains."""
        blocks = [block.elastic() for block in self.blocks]
        straining = [block for block in blocks if block is not None]
        if not straining:
            return None
        rest = self.mesh.nodes
        ties = None if self.ties is None else self.ties.again(rest)
        rivets = None if self.rivets is None else self.rivets.elastic()
        return Target(self.mesh, Nodes(rest), straining, self.supports.released(), ties=ties, rivets=rivets)

    def highest_frequency(self, iterations: int = 60) -> float:
        """Largest circular frequency [rad/s] of the unloaded target, its rigid holds released, by power iteration.

        The iteration on M^-1 K approaches from below; the caller's safety factor covers the remainder (below 1 % after
        60). Released holds can only raise the answer; springs are in it.
        """
        trial = self.unloaded()
        if trial is None:
            return 0.0
        rng = np.random.default_rng(0)
        v, omega = rng.standard_normal(self.x.shape), rng.standard_normal(self.x.shape) / self.thickness
        trial.v[:], trial.omega[:] = v, omega
        squared, still, moving = 0.0, np.zeros_like(v), (trial.mass > 0.0)[:, None]
        masses, inertias = trial.mass[:, None], trial.inertia[:, None]
        for _ in range(iterations):
            norm = np.sqrt(2.0 * trial.kinetic_energy())
            trial.v[:], trial.omega[:] = 1e-9 * trial.v / norm, 1e-9 * trial.omega / norm
            trial.clear_stress()
            if trial.ties is not None:
                trial.ties.follow(trial.nodes, 0.0)
            trial.update_forces(1.0)
            trial.share_forces(still)
            np.divide(-trial.nodal[:, :3], masses, out=trial.v, where=moving)
            np.divide(-trial.nodal[:, 3:], inertias, out=trial.omega, where=moving)
            squared = np.sqrt(2.0 * trial.kinetic_energy()) / 1e-9
        return float(np.sqrt(squared))

    def stable_step(self) -> float:
        """Largest stable step of central differences, 2/omega_max [s]; infinite where nothing strains."""
        highest = self.highest_frequency()
        return 2.0 / highest if highest > 0.0 else np.inf
