"""Systematically refined meshes of a case: bird and plate refined together, with one ratio of spacings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real
from typing import Any

import numpy as np

from birdstrike.data.errors import CaseError, UserError, refuse_not_whole
from birdstrike.data.formatting import many
from birdstrike.doe.external.deck import has_place
from birdstrike.solver.case.case import Case
from birdstrike.solver.estimate import estimate

PLACES = ("auto", "middle", "finest", "coarsest")
UNEVEN = 0.1  # of the bird's ratio of refinement, by which that of a part may differ
AFFORDABLE_S = 600.0  # of one core: up to here a study is paid for that also refines the user's mesh


@dataclass(frozen=True)
class Mesh:
    """One mesh of a study. level: steps of refinement from the user's mesh, negative for coarser ones.

    particles: those that the lattice really has; bird_spacing, plate_spacing [m]: cube root of a particle's volume,
    square root of a shell's area; cost: estimated seconds of one core.
    """

    level: int
    case: Case
    particles: int
    bird_spacing: float
    plate_spacing: float
    cost: float

    @property
    def elements(self) -> tuple[int, int]:
        """Shells along length and width."""
        return self.case.plate.elements

    def as_json(self) -> dict[str, Any]:
        """What defines the mesh, SI."""
        return {
            "level": self.level,
            "particles": self.particles,
            "elements": list(self.elements),
            "bird_spacing_m": self.bird_spacing,
            "plate_spacing_m": self.plate_spacing,
        }


def choose_meshes(case: Case, ratio: float, count: int, place: str = "auto") -> list[Mesh]:
    """`count` meshes of the case, finest first; place: of the user's own among them.

    auto is "middle" while the whole study is estimated at 10 minutes of one core or less, else "finest", as with an
    external solver, whose cost is not known. Raises UserError for a ratio or count outside its range, for a mesh that
    leaves the range of a case and for an external solver whose deck names no mesh.
    """
    if not isinstance(ratio, Real) or not 1.1 <= ratio <= 2.0:
        said = f"{ratio:g}" if isinstance(ratio, Real) else repr(ratio)
        raise UserError(f"--ratio = {said} is outside 1.1 .. 2; 1.3 is the usual one")
    refuse_not_whole("--meshes", count, "3 to 6 are possible; the index needs three")
    if not 3 <= count <= 6:
        raise UserError(f"--meshes = {count} is outside 3 .. 6; the index needs three")
    if case.mesh_file is not None:
        raise UserError(
            f"target.mesh = {case.mesh_file.name}: a mesh from a file is not refined, so that its convergence cannot "
            "be studied here; make two finer files, simulate the case on each (birdstrike simulate --set "
            "target.mesh=FILE), and compare the curves. Give a target.generator where one fits: its meshes are refined"
        )
    if place not in PLACES:
        raise UserError(f"--place = {place} is unknown; known: {', '.join(PLACES)}")
    _refuse_one_deck(case)
    if place == "auto":
        middle = _meshes(case, ratio, count, 1)
        known = case.solver.name != "external"
        affordable = known and sum(mesh.cost for mesh in middle) <= AFFORDABLE_S
        return middle if affordable else _meshes(case, ratio, count, 0)
    return _meshes(case, ratio, count, {"middle": 1, "finest": 0, "coarsest": count - 1}[place])


def unevenly_refined(meshes: Sequence[Mesh]) -> dict[str, tuple[float, ...]]:
    """Parts of a generated target that are refined otherwise than the bird, with their ratios from mesh to mesh.

    A generator makes whole numbers of shells between its lines: a web of two shells stays so, or has one.
    """
    target = meshes[0].case.target
    if target is None or target.generator is None:
        return {}
    parts = [mesh.case.target.source.mesh() for mesh in meshes if mesh.case.target is not None]
    shells = np.array([np.bincount(one.part, minlength=len(one.parts)) for one in parts])
    ratios = np.sqrt(shells[:-1] / shells[1:])
    bird = np.array([coarse.bird_spacing / fine.bird_spacing for fine, coarse in pairwise(meshes)])
    uneven = np.flatnonzero((np.abs(ratios / bird[:, None] - 1.0) > UNEVEN).any(axis=0))
    return {parts[0].parts[i]: tuple(ratios[:, i].tolist()) for i in uneven}


def not_refined(case: Case) -> tuple[str, ...]:
    """Keys of the mesh for which an external solver's deck has no place; none for our own solver."""
    if case.solver.name != "external":
        return ()
    finer = {"bird.particles": 2 * case.bird.particles, "plate.elements": [2 * n for n in case.plate.elements]}
    return tuple(key for key, value in finer.items() if not has_place(case, key, value))


def _refuse_one_deck(case: Case) -> None:
    """Raise UserError where all meshes would have the same deck: their differences, 0, would pass for convergence."""
    if len(not_refined(case)) == 2:
        raise UserError(
            f"the deck of {case.name} has no place for bird.particles and plate.elements, so that all meshes "
            "would be one simulation: write {{ bird.particles }} and {{ plate.elements[0] }} in its template where the "
            "mesh is made, for instance by a mesher in external.command, or refine the mesh by hand and compare"
        )


def _meshes(case: Case, ratio: float, count: int, finest: int) -> list[Mesh]:
    own = _mesh(case, 0)
    meshes = [own if level == 0 else _refined(own, ratio, level) for level in range(finest, finest - count, -1)]
    for fine, coarse in pairwise(meshes):
        if not (fine.bird_spacing < coarse.bird_spacing and fine.plate_spacing < coarse.plate_spacing):
            raise UserError(
                f"--ratio = {ratio:g} leaves two meshes alike (plate.elements = {list(coarse.elements)}, "
                f"{coarse.particles} particles); a larger ratio, or finer bird.particles and plate.elements"
            )
    return meshes


def _refined(own: Mesh, ratio: float, level: int) -> Mesh:
    """The user's mesh with both spacings divided by ratio^level, as near as whole elements allow.

    An even number of elements stays even and an odd one odd, so that a sensor at the centre keeps its place in the
    mesh. The bird then follows the ratio that the plate really has.
    """
    nx, ny = (_same_parity(n * ratio**level, n) for n in own.elements)
    actual = math.sqrt(nx * ny / (own.elements[0] * own.elements[1]))
    particles = round(own.particles * actual**3)
    try:
        return _mesh(own.case.with_mesh(particles, (nx, ny)), level)
    except CaseError as error:
        finer = "finer" if level < 0 else "coarser"
        place = f"--place = {'coarsest' if level < 0 else 'finest'}, a smaller --ratio, or a {finer} mesh of your own"
        raise UserError(
            [*error.errors, f"the case cannot be meshed {many(abs(level), 'level')} away: {place}"]
        ) from error


def _same_parity(wanted: float, like: int) -> int:
    return 2 * round((wanted - like % 2) / 2.0) + like % 2


def _mesh(case: Case, level: int) -> Mesh:
    facts = estimate(case)
    particles, cost = facts["particles"], facts["estimated_wall_s"]
    assert particles is not None
    assert cost is not None
    nx, ny = case.plate.elements
    bird = (case.bird.volume / particles) ** (1.0 / 3.0)
    return Mesh(level, case, int(particles), bird, math.sqrt(case.plate.length * case.plate.width / (nx * ny)), cost)
