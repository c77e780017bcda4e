"""The clamped plate's problems: frequencies, step responses, edge springs, preload and damping, each with its truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from data.histories import Array
from data.paths import REFERENCE
from reports.verification.plate_ritz import RitzPlate, ritz_frequencies
from solver.plate import Plate
from solver.plate_edges import EdgeStiffness
from solver.plate_modes import natural_frequencies
from solver.shell_material import ShellMaterial
from solver.shell_mesh import plate_mesh

RITZ = RitzPlate(0.525, 0.430, 0.010, 71e9, 0.3, 2780.0)
ALUMINIUM = ShellMaterial(RITZ.young, RITZ.poisson, RITZ.density)
MESHES = ((25, 20), (50, 40), (100, 80))
LINEAR_LOAD, LARGE_LOAD = 30.0, 30e3  # N on the central 100 x 100 mm; the reference's is the large one
RESPONSES = {"mindlin_ritz_lin_mm": LINEAR_LOAD, "ccx_S4_n16_nl_mm": LARGE_LOAD}


@dataclass(frozen=True)
class Compared:
    """Our figures and the truth's, alike in shape and SI."""

    computed: Array
    reference: Array

    @property
    def error(self) -> float:
        """Largest relative error."""
        return float(np.abs(self.computed / self.reference - 1.0).max())


@dataclass(frozen=True)
class Response:
    """Centre displacement [m] at the reference's times [s]."""

    time: Array
    computed: Array
    reference: Array

    @property
    def rms_of_peak(self) -> float:
        """RMS difference over the reference's largest value."""
        return float(np.sqrt(np.mean((self.computed - self.reference) ** 2)) / np.abs(self.reference).max())


def shells(elements: tuple[int, int], edges: str | EdgeStiffness = "clamped", damping: float = 0.0) -> Plate:
    """The reference's plate, 525 x 430 x 10 mm of elastic aluminium."""
    return Plate(plate_mesh(RITZ.length, RITZ.width, elements), RITZ.thickness, ALUMINIUM, edges, damping)


def clamped_frequencies(elements: tuple[int, int] = (50, 40)) -> Compared:
    """First three frequencies [Hz] of the shells against Ritz on Mindlin's plate (397.7, 708.2, 897.6 Hz)."""
    return Compared(natural_frequencies(shells(elements))[0], ritz_frequencies(RITZ, terms=12))


def spring_frequencies(rotational: float, elements: tuple[int, int] = (50, 40)) -> Compared:
    """First three frequencies [Hz] on rotational edge springs [N m/rad per m] against Ritz on the same springs."""
    plate = shells(elements, EdgeStiffness(rotational=rotational))
    return Compared(natural_frequencies(plate)[0], ritz_frequencies(replace(RITZ, rotational=rotational), terms=12))


def preloaded_frequencies(tension: tuple[float, float], elements: tuple[int, int] = (50, 40)) -> Compared:
    """First three frequencies [Hz] of the clamped plate under initial stresses [Pa] against Ritz with the same."""
    plate = shells(elements)
    plate.preload(*tension)
    return Compared(natural_frequencies(plate)[0], ritz_frequencies(replace(RITZ, tension=tension), terms=12))


def central_load(plate: Plate, force: float) -> Array:
    """`force` [N] in -z spread uniformly over the central 100 x 100 mm, as nodal forces (m, 3)."""
    corners = plate.mesh.nodes[plate.quads][:, :, :2]
    overlap = np.minimum(corners.max(axis=1), 0.05) - np.maximum(corners.min(axis=1), -0.05)
    share = force * np.clip(overlap, 0.0, None).prod(axis=1) / 0.01 / 4.0
    load = np.zeros_like(plate.x)
    np.add.at(load[:, 2], plate.quads.ravel(), -np.repeat(share, 4))
    return load


def centre_of(plate: Plate) -> int:
    """The node nearest the middle of the surface."""
    return int(np.argmin(np.hypot(*plate.mesh.surface.T)))


def respond(plate: Plate, load: Array, end: float) -> tuple[Array, Array]:
    """Times [s] and centre displacement [m] towards -z under a load held from t = 0, by the time loop."""
    dt = 0.9 * plate.stable_step()
    centre = centre_of(plate)
    rest, steps = plate.x[centre, 2], int(end / dt)
    w = np.zeros(steps)
    for step in range(steps):
        plate.update_forces(dt if step else 0.0)
        w[step] = rest - plate.x[centre, 2]
        plate.keep_books()
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    return dt * np.arange(steps), w


def step_response(column: str, elements: tuple[int, int] = (50, 40)) -> Response:
    """The centre's response to 30 kN applied at once, against a column of the reference (see RESPONSES).

    The linear columns are compared with the response to a thousandth of the load, times a thousand.
    """
    table = pd.read_csv(REFERENCE / "plate_step_response.csv", comment="#")
    time, reference = table["t_ms"].to_numpy() * 1e-3, table[column].to_numpy() * 1e-3
    force = LINEAR_LOAD if column.endswith("_lin_mm") else LARGE_LOAD
    plate = shells(elements)
    at, w = respond(plate, central_load(plate, force), time[-1] + 1e-5)
    return Response(time, LARGE_LOAD / force * np.interp(time, at, w), reference)


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
