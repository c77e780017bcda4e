"""A made-up simulation with closed formulas, quick to build and rich enough for every figure of the report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.histories import Array, Histories, Snapshot
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.solver.case.case import Case, case_hash, load_case

END = 3.0e-3
RECORD_TIMES = np.array([0.34, 0.59, 0.71, 0.98, 1.09, 1.34, 1.53, 1.60, 1.79, 1.91, 2.11, 2.35]) * 1e-3


def displacement(time: Array, peak: float = 5.6e-3, period: float = 2.5e-3, start: float = 0.25e-3) -> Array:
    """A push that starts at `start` and swings with the plate's `period`: (n,) m."""
    t = np.clip(time - start, 0.0, None)
    return peak * 0.5 * (1 - np.cos(2 * np.pi * t / period))


def contact_force(time: Array, impulse: float = 46.0) -> Array:
    """A half sine of 2 ms that carries `impulse` N s: (n,) N."""
    length = 2.0e-3
    t = np.clip((time - 0.1e-3) / length, 0.0, 1.0)
    return impulse * np.pi / (2 * length) * np.sin(np.pi * t)


INSTANTS = (0.5e-3, 1.0e-3, 1.5e-3, 2.5e-3)


def strike(
    peak: float = 5.6e-3,
    summary: Mapping[str, object] | None = None,
    steps: int = 301,
    period: float = 2.5e-3,
    instants: Sequence[float] = INSTANTS,
) -> Histories:
    """Histories of the made-up simulation with the three default sensors and a snapshot at each instant [s]."""
    time = np.linspace(0.0, END, steps)
    force = contact_force(time)
    channels = {
        "displacement_centre": displacement(time, peak, period),
        "contact_force": force,
        "reaction_force": np.interp(time - 0.1e-3, time, force)
        + 6e3 * np.sin(2 * np.pi * time / 0.6e-3) * (time > 2e-4),
    }
    units = {"displacement_centre": "m", "contact_force": "N", "reaction_force": "N"}
    snapshots = tuple(snapshot(t, peak) for t in instants)
    return Histories(time, channels, units, {**SUMMARY, **(summary or {})}, snapshots)


SUMMARY: dict[str, object] = {
    "wall_s": 12.5,
    "steps": 4200,
    "particles": 4488,
    "shells": 2000,
    "momentum_error": 3.1e-13,
    "energy_error": 0.0042,
    "eroded_particles": 3,
    "eroded_mass_fraction": 0.0007,
    "eroded_shells": 0,
    "largest_plastic_strain": 0.0,
    "energies_J": {"plate_internal": 400.0, "plate_hourglass": 3.0},
    "shock_equivalent_viscosity_Pa_s": 8.1,
    "solver_version": "0123456789abcdef",
    "case_hash": "fedcba9876543210",
    "warnings": [],
}


def snapshot(time: float, peak: float = 5.6e-3) -> Snapshot:
    """Bird as a flattening capsule of points above a bent 50 x 40 plate."""
    nodes, quads = plate(float(displacement(np.array([time]), peak)[0]))
    particles, along = _bird(time)
    pressure = 8e6 * np.exp(-((particles[:, 2] - 0.01) ** 2) / 0.03**2) * np.exp(-(particles[:, 0] ** 2) / 0.1**2)
    velocity = np.tile([78.9, 0.0, -45.6], (len(particles), 1))
    eroded = np.arange(len(particles)) % 997 == 0
    middle, no_cells = nodes[quads].mean(axis=1), np.empty((0, 8), np.int64)
    stress = 2.0e8 * np.cos(np.pi * middle[:, 0] / 0.525) ** 2 * np.cos(np.pi * middle[:, 1] / 0.43) ** 2
    return Snapshot(
        time, particles, pressure + 1e5 * along, velocity, eroded, 0.1 * pressure, no_cells, nodes, quads, stress
    )


def plate(deflection: float) -> tuple[Array, np.ndarray]:
    """Nodes (51 * 41, 3) of the plate bent to `deflection` m at its centre, away from the bird, and its quads."""
    x, y = np.meshgrid(np.linspace(-0.2625, 0.2625, 51), np.linspace(-0.215, 0.215, 41), indexing="ij")
    z = -deflection * np.cos(np.pi * x / 0.525) ** 2 * np.cos(np.pi * y / 0.43) ** 2
    number = np.arange(51 * 41).reshape(51, 41)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    return np.column_stack((x.ravel(), y.ravel(), z.ravel())), np.stack([c.ravel() for c in corners], axis=1)


def _bird(time: float) -> tuple[Array, Array]:
    """Capsule at 30 degrees, flown for `time`; what would pass the plate spreads on it. (n, 3) m and (n,) in 0..1."""
    pitch, angle = 0.008, np.radians(30.0)
    axis = np.arange(-0.131, 0.131, pitch)
    cross = np.arange(-0.053, 0.053, pitch)
    a, b, c = (g.ravel() for g in np.meshgrid(axis, cross, cross, indexing="ij"))
    inside = np.clip(np.abs(a) - 0.078, 0, None) ** 2 + b**2 + c**2 < 0.053**2
    a, b, c = a[inside], b[inside], c[inside]
    forward, up = np.array([np.cos(angle), -np.sin(angle)]), np.array([np.sin(angle), np.cos(angle)])
    x = a * forward[0] + c * up[0] - 0.21 + 78.9 * time
    z = a * forward[1] + c * up[1] + 0.121 - 45.6 * time
    below, place = np.clip(0.009 - z, 0.0, None), (a + 0.131) / 0.262
    return np.column_stack((x + 0.5 * below, b * (1 + 8 * below), np.maximum(z, 0.009 + 0.1 * below))), place


STANDARD_PEAKS = {"elastic": 8.0e-3, "plastic_kinematic": 4.6e-3, "hydrodynamic": 4.8e-3}  # m


def simulate(case: Case, **_: object) -> Histories:
    """The solver's stand-in: MU lowers the peak, PC shortens the swing, TEROD and CEROD do nothing.

    Another model than NULL has a peak of its own.
    """
    material, own = case.bird.material, {"case_hash": case_hash(case)}
    if material.model in STANDARD_PEAKS:
        return strike(STANDARD_PEAKS[material.model], own, instants=case.time.snapshots)
    peak = 5.8e-3 * (1.0 - 0.12 * material.viscosity / 1500.0)
    period = 2.45e-3 * (1.0 + 0.06 * material.pressure_cutoff / 1.25e6)
    return strike(peak, own, period=period, instants=case.time.snapshots)


def write_record(path: Path, peak: float = 5.5e-3, period: float = 2.38e-3, provenance: str = "Shot 7.") -> Path:
    """A measured-data CSV at twelve instants; whether it counts as simulated is for `provenance` to say."""
    values = displacement(RECORD_TIMES, peak, period)
    record = Measured(RECORD_TIMES, {"displacement_centre": values}, {}, {"displacement_centre": "m"}, (provenance,))
    write_measured(path, record)
    return path


class InThisProcess(Executor):
    """In place of the report's worker processes, which would not know a stand-in: each run when it is handed over."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def stand_in_for_models(patch: pytest.MonkeyPatch, solver: Callable[..., Histories] = simulate) -> None:
    """The bird models of the report by a stand-in, one after the other, with few instants in motion."""
    patch.setattr("birdstrike.inversion.forward.simulate", solver)
    patch.setattr("birdstrike.reports.comparison.models.process_pool", lambda _: InThisProcess())
    patch.setattr("birdstrike.reports.comparison.models.worker_count", lambda _: 1)
    patch.setattr("birdstrike.reports.comparison.models.FRAMES", 8)


def finished_folder(
    folder: Path, record: Path, patch: pytest.MonkeyPatch, runs: int = 25, posterior: bool = True
) -> Path:
    """`doe/` and `inversion/` of a loop closed by the real campaign and the real inversion around the stand-in.

    posterior: drawn, with the figures of identifiability; else intervals are linearised.
    """
    case = load_case("demo")
    design = make_design("uniform", ParameterSpace.of(case.parameters()), runs, seed=0)
    with ThreadPoolExecutor(2) as pool:
        run_campaign(case, design, folder / "doe", simulate=simulate, executor=pool, say=lambda _: None)
    patch.setattr("birdstrike.inversion.forward.simulate", simulate)
    train_and_invert(folder / "doe", record, folder / "inversion", extras=Extras(refine=0, posterior=posterior))
    return folder
