"""The shell against the clamped plate's frequency, independent codes' step response, and its own work."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from data.paths import REFERENCE
from solver.plate import Plate, ShellMaterial
from solver.shell_mesh import plate_mesh

ALUMINIUM = ShellMaterial(71e9, 0.3, 2780.0)
LENGTH, WIDTH, THICKNESS = 0.525, 0.430, 0.010
MINDLIN_RITZ_HZ = 397.7


def clamped(elements: tuple[int, int] = (50, 40), edges: str = "clamped") -> Plate:
    return Plate(plate_mesh(LENGTH, WIDTH, elements), THICKNESS, ALUMINIUM, edges)


def step_load(plate: Plate, force: float) -> np.ndarray:
    """`force` [N] in -z spread uniformly over the central 100 x 100 mm, as nodal forces (m, 3)."""
    corners = plate.mesh.nodes[plate.quads][:, :, :2]
    overlap = np.minimum(corners.max(axis=1), 0.05) - np.maximum(corners.min(axis=1), -0.05)
    share = force * np.clip(overlap, 0.0, None).prod(axis=1) / 0.01 / 4.0
    load = np.zeros_like(plate.x)
    np.add.at(load[:, 2], plate.quads.ravel(), -np.repeat(share, 4))
    return load


def respond(plate: Plate, load: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Centre displacement [m] under a load held from t = 0."""
    dt = 0.9 * plate.stable_step()
    centre = int(np.argmin(np.hypot(plate.x[:, 0], plate.x[:, 1])))
    steps = int(end / dt)
    w = np.zeros(steps)
    for step in range(steps):
        plate.update_forces(dt if step else 0.0)
        w[step] = -plate.x[centre, 2]
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    return dt * np.arange(steps), w


def first_frequency(elements: tuple[int, int]) -> float:
    """First frequency [Hz] of the small step response: peak of its zero-padded spectrum under a Hann window."""
    plate = clamped(elements)
    time, w = respond(plate, step_load(plate, 1.0), 12e-3)
    spectrum = np.abs(np.fft.rfft((w - w.mean()) * np.hanning(len(w)), 64 * len(w)))
    return float(np.fft.rfftfreq(64 * len(w), time[1])[spectrum.argmax()])


def test_clamped_plate_first_frequency():
    assert first_frequency((50, 40)) == pytest.approx(MINDLIN_RITZ_HZ, rel=0.01)


def reference(column: str) -> tuple[np.ndarray, np.ndarray]:
    table = pd.read_csv(REFERENCE / "plate_step_response.csv", comment="#")
    return table["t_ms"].to_numpy() * 1e-3, table[column].to_numpy() * 1e-3


def rms_of_peak(time: np.ndarray, w: np.ndarray, column: str) -> float:
    t, expected = reference(column)
    return float(np.sqrt(np.mean((np.interp(t, time, w) - expected) ** 2)) / expected.max())


def test_small_step_response_follows_mindlin():
    """A thousandth of the load, scaled up: the linear response within 2 % of the Ritz series and of CalculiX."""
    plate = clamped()
    time, w = respond(plate, step_load(plate, 30.0), 3.1e-3)
    assert rms_of_peak(time, 1000.0 * w, "mindlin_ritz_lin_mm") < 0.02
    assert rms_of_peak(time, 1000.0 * w, "ccx_S4_n8_lin_mm") < 0.02


def test_large_step_response_follows_independent_codes():
    plate = clamped()
    time, w = respond(plate, step_load(plate, 30e3), 3.1e-3)
    assert rms_of_peak(time, w, "ccx_S4_n16_nl_mm") < 0.02
    assert rms_of_peak(time, w, "kratos_MITC_n8_nl_mm") < 0.02


def test_rigid_motion_strains_nothing():
    """Translation and a finite turn of the whole plate leave strains at rounding."""
    plate = clamped((6, 5), "free")
    axis = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    angle, velocity = 0.7, np.array([3.0, -2.0, 1.0])
    k = np.cross(np.eye(3), axis)
    turn = np.eye(3) - np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)
    plate.x = plate.x @ turn.T
    plate.omega[:] = 50.0 * axis
    plate.v[:] = velocity + np.cross(50.0 * axis, plate.x)
    plate.update_forces(1e-6)
    assert np.abs(plate.strain).max() < 1e-15
    assert np.abs(plate.hourglass_strain).max() < 1e-15


@pytest.mark.parametrize("pattern", ["membrane", "bending", "shear"])
def test_constant_strain_patches(pattern):
    """Distorted quadrilaterals reproduce constant membrane strain, curvature and transverse shear exactly."""
    plate = clamped((5, 4), "free")
    inner = np.setdiff1d(np.arange(len(plate.x)), plate.mesh.rim)
    plate.x[inner, :2] += np.random.default_rng(0).uniform(-0.02, 0.02, (len(inner), 2))
    x, y = plate.x[:, 0], plate.x[:, 1]
    expected = np.zeros(8)
    if pattern == "membrane":
        plate.v[:, 0], plate.v[:, 1] = 2.0 * x + 1.0 * y, 3.0 * y
        expected[:3] = 2.0, 3.0, 1.0
    elif pattern == "bending":
        plate.omega[:, 1], plate.omega[:, 0] = 2.0 * x + 0.5 * y, -3.0 * y
        expected[3:6] = 2.0, 3.0, 0.5
    else:
        plate.v[:, 2] = 2.0 * x - 1.0 * y
        expected[6:] = 2.0, -1.0
    plate.update_forces(1.0)
    turned = invariants(plate.strain)
    if pattern != "bending":
        assert np.allclose(turned, invariants(expected[None, :]), rtol=1e-9, atol=1e-12)
    else:
        assert np.allclose(turned[:, 2:4], invariants(expected[None, :])[:, 2:4], rtol=1e-9, atol=1e-12)


def invariants(strain: np.ndarray) -> np.ndarray:
    """Of membrane strain, curvature (trace and determinant) and shear (length): free of the element's axes."""
    columns = [strain[:, 0] + strain[:, 1], strain[:, 0] * strain[:, 1] - 0.25 * strain[:, 2] ** 2]
    columns += [strain[:, 3] + strain[:, 4], strain[:, 3] * strain[:, 4] - 0.25 * strain[:, 5] ** 2]
    return np.stack([*columns, np.hypot(strain[:, 6], strain[:, 7])], axis=1)


def test_nodal_forces_do_the_work_of_the_stresses():
    """Virtual work: force . velocity = - (resultants . strain rates) area - hourglass power, on a warped mesh."""
    plate = clamped((4, 3), "free")
    rng = np.random.default_rng(1)
    plate.x += rng.normal(0.0, 0.005, plate.x.shape)
    plate.v, plate.omega = rng.normal(0.0, 1.0, plate.x.shape), rng.normal(0.0, 10.0, plate.x.shape)
    plate.update_forces(1e-6)
    inside = (plate.shape[:, 4:5] * plate.resultant * plate.strain).sum() / 1e-6
    inside += (plate.hourglass * plate.hourglass_strain).sum() / 1e-6
    outside = (plate.nodal[:, :3] * plate.v).sum() + (plate.nodal[:, 3:] * plate.omega).sum()
    assert outside == pytest.approx(-inside, rel=1e-12)


def test_energy_and_hourglass_of_the_step_response():
    """Work of the load = strain energy + hourglass + kinetic; the hourglass share stays below 5 %."""
    plate = clamped((25, 20))
    load = step_load(plate, 30e3)
    dt = 0.9 * plate.stable_step()
    stored = hourglass = given = 0.0
    for step in range(800):
        plate.update_forces(dt if step else 0.0)
        stored += plate.work.sum()
        hourglass += plate.hourglass_work.sum()
        given += dt * float((load * plate.v).sum())
        before = plate.kinetic_energy()
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    kinetic = 0.5 * (before + plate.kinetic_energy())
    assert stored + hourglass + kinetic == pytest.approx(given, rel=0.005)
    assert hourglass < 0.05 * stored


def test_stable_step_is_the_limit():
    """Just below the power iteration's step noise stays bounded; 5 % above, it explodes."""
    growth = []
    for factor in (0.98, 1.05):
        plate = clamped((12, 10))
        dt = factor * plate.stable_step()
        plate.v += np.random.default_rng(2).normal(0.0, 1e-6, plate.v.shape)
        plate.v[plate.fixed] = 0.0
        start = plate.kinetic_energy()
        for _ in range(1500):
            plate.update_forces(dt)
            plate.kick_and_drift(dt, dt, np.zeros_like(plate.x))
        growth.append(plate.kinetic_energy() / start)
    assert growth[0] < 10.0
    assert not growth[1] < 1e3
