"""Rows of the plate's frame: frequencies on edge springs and under preload, membrane stiffening, damping."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Solution, matches
from birdstrike.solver.reference.plate_membrane import LENGTH, THICKNESS, WIDTH, von_karman_deflection
from birdstrike.solver.reference.plate_ritz import RitzPlate, ritz_frequencies
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.modes import natural_frequencies
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial
from birdstrike.solver.target.supports import EdgeStiffness

RITZ = RitzPlate(0.525, 0.430, 0.010, 71e9, 0.3, 2780.0)
ALUMINIUM = ShellMaterial(RITZ.young, RITZ.poisson, RITZ.density)


@dataclass(frozen=True)
class Compared:
    """Our figures and the truth's, alike in shape and SI."""

    computed: Array
    reference: Array

    @property
    def error(self) -> float:
        """Largest relative error."""
        return float(np.abs(self.computed / self.reference - 1.0).max())


def shells(elements: tuple[int, int], edges: str | EdgeStiffness = "clamped", damping: float = 0.0) -> Target:
    """The reference's plate, 525 x 430 x 10 mm of elastic aluminium."""
    return plate_of(plate_mesh(RITZ.length, RITZ.width, elements), RITZ.thickness, ALUMINIUM, edges, damping)


def spring_frequencies(rotational: float, elements: tuple[int, int] = (50, 40)) -> Compared:
    """First three frequencies [Hz] on rotational edge springs [N m/rad per m] against Ritz on the same springs."""
    plate = shells(elements, EdgeStiffness(rotational=rotational))
    return Compared(natural_frequencies(plate)[0], ritz_frequencies(replace(RITZ, rotational=rotational), terms=12))


def preloaded_frequencies(tension: tuple[float, float], elements: tuple[int, int] = (50, 40)) -> Compared:
    """First three frequencies [Hz] of the clamped plate under initial stresses [Pa] against Ritz with the same."""
    plate = shells(elements)
    plate.preload(*tension)
    return Compared(natural_frequencies(plate)[0], ritz_frequencies(replace(RITZ, tension=tension), terms=12))


def central_load(plate: Target, force: float) -> Array:
    """`force` [N] in -z spread uniformly over the central 100 x 100 mm, as nodal forces (m, 3)."""
    corners = plate.mesh.nodes[plate.quads][:, :, :2]
    overlap = np.minimum(corners.max(axis=1), 0.05) - np.maximum(corners.min(axis=1), -0.05)
    share = force * np.clip(overlap, 0.0, None).prod(axis=1) / 0.01 / 4.0
    load = np.zeros_like(plate.x)
    np.add.at(load[:, 2], plate.quads.ravel(), -np.repeat(share, 4))
    return load


def centre_of(plate: Target) -> int:
    """The node nearest the middle of the surface."""
    return int(np.argmin(np.hypot(*plate.mesh.surface.T)))


def relaxed_deflection(pressure: float, in_plane: float, elements: tuple[int, int] = (20, 16)) -> float:
    """Centre deflection [m] of the shells: the time loop, near critical mass damping, run until it rests."""
    mesh = plate_mesh(LENGTH, WIDTH, elements)
    first = float(natural_frequencies(plate_of(mesh, THICKNESS, ALUMINIUM), 1)[0][0])
    plate = plate_of(mesh, THICKNESS, ALUMINIUM, EdgeStiffness(in_plane=in_plane), 2.0 * np.pi * first)
    load = np.zeros_like(plate.x)
    load[:, 2] = -pressure * plate.mass / (ALUMINIUM.density * THICKNESS)
    dt = 0.9 * plate.stable_step()
    for step in range(int(4.0 / first / dt)):
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    return -float(plate.x[centre_of(plate), 2])


def membrane_stiffening(pressure: float = 0.1e6, stiffnesses: tuple[float, ...] = (np.inf, 2e9, 1e7)) -> Compared:
    """Centre deflections [m] with an edge held in its plane, on springs, and on weak ones, against von Karman."""
    computed = [relaxed_deflection(pressure, k) for k in stiffnesses]
    return Compared(np.array(computed), np.array([von_karman_deflection(pressure, k) for k in stiffnesses]))


def respond(plate: Target, load: Array, end: float) -> tuple[Array, Array]:
    """Times [s] and centre displacement [m] towards -z under a load held from t = 0, by the time loop."""
    dt = 0.9 * plate.stable_step()
    centre = centre_of(plate)
    rest, steps = plate.x[centre, 2], int(end / dt)
    w = np.zeros(steps)
    for step in range(steps):
        plate.update_forces(dt if step else 0.0)
        w[step] = rest - plate.x[centre, 2]
        plate.update_energies()
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    return dt * np.arange(steps), w


def damping_decrement(damping: float = 100.0, elements: tuple[int, int] = (16, 14)) -> Compared:
    """Decay rate [1/s] of the first mode's free vibration, from its amplitude over six periods, against `damping`.

    The plate starts with the velocity of its first mode, so that no other one takes part; amplitudes are read as the
    quadrature of modal displacement and velocity.
    """
    plate = shells(elements, damping=damping)
    frequency, shapes = natural_frequencies(plate, 1)
    omega, shape = 2.0 * np.pi * float(frequency[0]), shapes[0]
    plate.v[:], plate.omega[:] = 1e-3 * shape[:, :3] / np.abs(shape).max(), 1e-3 * shape[:, 3:] / np.abs(shape).max()
    dt, still = 0.9 * plate.stable_step(), np.zeros_like(plate.x)
    weight = plate.mass * shape[:, 2]
    moved, speed = [], []
    for step in range(int(6.0 * 2.0 * np.pi / omega / dt)):
        plate.update_forces(dt if step else 0.0)
        before = weight @ plate.v[:, 2]
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, still)
        moved.append(weight @ (plate.x[:, 2] - dt * plate.v[:, 2]))
        speed.append(0.5 * (before + weight @ plate.v[:, 2]))
    level = np.log(np.hypot(speed, omega * np.array(moved)))
    return Compared(np.array([-np.polyfit(dt * np.arange(len(level)), level, 1)[0]]), np.array([damping]))


MESH = (25, 20)
MINDLIN = "Mindlin plate on the same springs or under the same tension, Ritz series (computed here, without a mesh)"
VON_KARMAN = "von Karman plate on in-plane springs, Ritz minimisation of its energy (computed here)"
ROTATIONAL = (1e4, 5e4, 2e5, 1e6)  # N m/rad per m: from nearly pinned to nearly clamped
TENSIONS = {"100 MPa along": (100e6, 0.0), "100 MPa across": (0.0, 100e6), "-50 and 20 MPa": (-50e6, 20e6)}
IN_PLANE = (np.inf, 2e9, 1e7)  # N/m per m
PRESSURE = 0.1e6  # Pa
DAMPINGS = (50.0, 100.0, 400.0)  # 1/s


def solve_springs(_: Computed) -> Solution:
    """First three frequencies from nearly pinned to nearly clamped; the first is judged."""
    figure = "edge_springs"
    found = [spring_frequencies(stiffness, MESH) for stiffness in ROTATIONAL]
    rows = [
        matches(
            f"frequency {mode + 1}, edge springs {1e-3 * stiffness:g} kN m/rad/m",
            float(pair.computed[mode]),
            float(pair.reference[mode]),
            "Hz",
            None if mode else 1.0,
            MINDLIN,
            "",
            figure,
        )
        for stiffness, pair in zip(ROTATIONAL, found, strict=True)
        for mode in range(3)
    ]
    stiffness = [1e-3 * value for value in ROTATIONAL]
    curves = []
    for mode in range(3):
        curves.append(Curve("Ritz" if mode == 0 else "", stiffness, [p.reference[mode] for p in found], truth=True))
        curves.append(Curve(f"mode {mode + 1}", stiffness, [p.computed[mode] for p in found], dots=True))
    worst = 100.0 * max(pair.error for pair in found)
    caption = f"Three frequencies against the stiffness of rotational edge springs: at most {worst:.2f} % off Ritz."
    panel = Panel("rotational stiffness of the edge [kN m/rad/m]", "frequency [Hz]", curves, log=True)
    return Solution(tuple(rows), (Picture(figure, draw(panel), caption),))


def solve_preload(_: Computed) -> Solution:
    """First three frequencies of the clamped plate under three states of initial stress; the first is judged."""
    rows = []
    for name, tension in TENSIONS.items():
        pair = preloaded_frequencies(tension, MESH)
        for mode, (ours, truth) in enumerate(zip(pair.computed, pair.reference, strict=True)):
            gate = None if mode else 1.0
            rows.append(
                matches(f"frequency {mode + 1}, preload {name}", float(ours), float(truth), "Hz", gate, MINDLIN)
            )
    return Solution(tuple(rows))


def solve_in_plane(_: Computed) -> Solution:
    """Centre deflection under a pressure, the edge held, sprung and nearly free in its plane."""
    pair = membrane_stiffening(PRESSURE, IN_PLANE)
    note = f"{1e3 * THICKNESS:g} mm thick, {1e-6 * PRESSURE:g} MPa; the time loop relaxed to rest, 20 x 16 shells"
    words = ("rigid", "springs of 2 GN/m per m", "springs of 10 MN/m per m")
    rows = [
        matches(
            f"large deflection, edge in its plane: {w}", 1e3 * float(a), 1e3 * float(b), "mm", 2.0, VON_KARMAN, note
        )
        for w, a, b in zip(words, pair.computed, pair.reference, strict=True)
    ]
    return Solution(tuple(rows))


def solve_damping(_: Computed) -> Solution:
    """Decay of the first mode's free vibration over six periods."""
    source = "exp(-d t): plate.damping is the rate at which the amplitude decays"
    rows = []
    for damping in DAMPINGS:
        pair = damping_decrement(damping)
        name = f"decay rate of the first mode, damping {damping:g} 1/s"
        rows.append(matches(name, float(pair.computed[0]), float(pair.reference[0]), "1/s", 1.0, source))
    return Solution(tuple(rows))


ABOUT = (
    "The plate of 525 x 430 x 10 mm on 25 x 20 shells, its frame giving way by springs, or under an initial stress; "
    "in-plane springs on a plate of 4 mm, where the deflection is 1.5 to 2.2 thicknesses."
)
FAMILY = "Edges, preload and damping of the plate"
PROBLEMS = (
    Problem("edge_springs", FAMILY, ABOUT, solve_springs),
    Problem("in_plane_springs", FAMILY, "", solve_in_plane),
    Problem("preload", FAMILY, "", solve_preload),
    Problem("damping", FAMILY, "", solve_damping),
)
