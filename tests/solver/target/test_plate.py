"""The flat shell against the clamped plate's frequencies, independent codes' step response, and its own work."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.problems.clamped_plate import MINDLIN, off_reference, step_response
from birdstrike.reports.verification.problems.plate import (
    ALUMINIUM,
    RITZ,
    central_load,
    damping_decrement,
    preloaded_frequencies,
    respond,
    shells,
    spring_frequencies,
)
from birdstrike.solver.reference.plate_ritz import ritz_frequencies
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.modes import natural_frequencies
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.rectangle import plate_of
from tests.solver.target.rigid_motion import assert_strained_by_no_rigid_motion


def test_ritz_gives_the_published_frequencies():
    assert ritz_frequencies(RITZ, terms=12) == pytest.approx(MINDLIN, abs=0.06)


def test_clamped_plate_first_three_frequencies():
    assert natural_frequencies(shells((50, 40)))[0] == pytest.approx(MINDLIN, rel=0.002)


def test_clamped_frequencies_converge_to_mindlin():
    """Errors of all three fall at second order, to below 0.1 %: nothing but the mesh stands between."""
    truth = ritz_frequencies(RITZ, terms=12)
    coarse, fine = (np.abs(natural_frequencies(shells(mesh))[0] / truth - 1.0) for mesh in ((20, 16), (40, 32)))
    assert (fine < np.maximum(0.35 * coarse, 1e-4)).all()
    assert fine.max() < 0.0025


def test_the_loop_vibrates_at_the_modes_frequency():
    """The small step response in time has its spectral peak where the modes of the same shells say."""
    plate = shells((24, 20))
    time, w = respond(plate, central_load(plate, 1.0), 12e-3)
    spectrum = np.abs(np.fft.rfft((w - w.mean()) * np.hanning(len(w)), 64 * len(w)))
    peak = np.fft.rfftfreq(64 * len(w), time[1])[spectrum.argmax()]
    assert peak == pytest.approx(natural_frequencies(shells((24, 20)), 1)[0][0], rel=0.002)


@pytest.mark.parametrize("rotational", [5e4, 2e5, 1e6])
def test_rotational_springs_between_pinned_and_clamped(rotational):
    assert spring_frequencies(rotational, (25, 20)).error < 0.006


@pytest.mark.parametrize("tension", [(100e6, 0.0), (0.0, 100e6), (-50e6, 20e6)])
def test_preload_moves_the_frequencies_as_ritz_says(tension):
    assert preloaded_frequencies(tension, (25, 20)).error < 0.007


def test_damping_is_the_rate_of_decay():
    assert damping_decrement(100.0).error < 0.005


def test_small_step_response_follows_mindlin():
    """A thousandth of the load, scaled up: within 1 % of the Ritz series, and so of the peak."""
    assert off_reference(*step_response((50, 40), 1000.0), "mindlin_ritz_lin_mm") < 1.0


@pytest.mark.parametrize("column", ["ccx_S4_n16_nl_mm", "kratos_MITC_n8_nl_mm"])
def test_large_step_response_follows_independent_codes(column):
    mesh = (25, 20) if "kratos" in column else (50, 40)
    assert off_reference(*step_response(mesh, 1.0), column) < 2.0


@pytest.mark.parametrize("warped", [False, True])
def test_rigid_motion_strains_nothing(warped):
    """Translation and spin of the whole plate, turned out of its plane, leave strains at rounding."""
    plate = shells((6, 5), "free")
    if warped:
        plate.x[:] += np.random.default_rng(4).normal(0.0, 5e-3, plate.x.shape)
    assert_strained_by_no_rigid_motion(plate)


@pytest.mark.parametrize("pattern", ["membrane", "bending", "shear"])
def test_constant_strain_patches(pattern):
    """Distorted quadrilaterals reproduce constant membrane strain, curvature and transverse shear exactly."""
    plate, dt = shells((5, 4), "free"), 1e-12
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
    plate.update_forces(dt)
    turned = invariants(plate.shells.strain / dt)
    columns = slice(2, 4) if pattern == "bending" else slice(None)
    assert np.allclose(turned[:, columns], invariants(expected[None, :])[:, columns], rtol=1e-9, atol=1e-10)


def invariants(strain: np.ndarray) -> np.ndarray:
    """Of membrane strain, curvature (trace and determinant) and shear (length): free of the element's axes."""
    columns = [strain[:, 0] + strain[:, 1], strain[:, 0] * strain[:, 1] - 0.25 * strain[:, 2] ** 2]
    columns += [strain[:, 3] + strain[:, 4], strain[:, 3] * strain[:, 4] - 0.25 * strain[:, 5] ** 2]
    return np.stack([*columns, np.hypot(strain[:, 6], strain[:, 7])], axis=1)


def test_a_twisted_plate_has_no_hourglass():
    """w = x y with the thin plate's rotations is pure twist: its stiffness is the plate's own, on any mesh."""
    plate = shells((5, 4), "free")
    x, y = plate.x[:, 0], plate.x[:, 1]
    plate.v[:, 2], plate.omega[:, 0], plate.omega[:, 1] = x * y, x, -y
    plate.update_forces(1e-12)
    assert np.abs(plate.shells.hourglass_strain[:, 2]).max() < 1e-12 * 1e-12
    assert np.allclose(plate.shells.strain[:, 5], -2e-12, rtol=1e-9)


def test_nodal_forces_do_the_work_of_the_stresses():
    """Virtual work: force . velocity = - (resultants . strain rates) area - hourglass power, on a warped mesh."""
    plate, dt = shells((4, 3), "free"), 1e-18
    rng = np.random.default_rng(1)
    plate.x[:] += rng.normal(0.0, 0.005, plate.x.shape)
    plate.v[:], plate.omega[:] = rng.normal(0.0, 1.0, plate.x.shape), rng.normal(0.0, 10.0, plate.x.shape)
    plate.update_forces(dt)
    inside = (plate.shells.shape[:, 4:5] * plate.shells.resultant * plate.shells.strain).sum() / dt
    inside += (plate.shells.hourglass * plate.shells.hourglass_strain).sum() / dt
    outside = (plate.nodal[:, :3] * plate.v).sum() + (plate.nodal[:, 3:] * plate.omega).sum()
    assert outside == pytest.approx(-inside, rel=1e-12)


@pytest.mark.parametrize("damping", [0.0, 200.0])
def test_energy_of_the_step_response(damping):
    """Work of the load = strain energy + hourglass + damping + kinetic; the hourglass share stays below 5 %."""
    plate = plate_of(plate_mesh(RITZ.length, RITZ.width, (25, 20)), RITZ.thickness, ALUMINIUM, "clamped", damping)
    load = central_load(plate, 30e3)
    dt = 0.9 * plate.stable_step()
    given = before = 0.0
    for step in range(800):
        plate.update_forces(dt if step else 0.0)
        plate.update_energies()
        given += dt * float((load * plate.v).sum())
        before = plate.kinetic_energy()
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    kinetic = 0.5 * (before + plate.kinetic_energy())
    assert sum(plate.energies.values()) + kinetic == pytest.approx(given, rel=2e-4)
    assert plate.energies["plate_hourglass"] < 0.05 * plate.energies["plate_internal"]
    assert (plate.energies["plate_damping"] > 0.01 * given) == (damping > 0.0)


def test_damping_takes_what_the_motion_loses_in_displacement_and_in_turning():
    """Of free nodes over one kick; half is counted before the whole step. Its impulse is the momentum lost."""
    nodes, rng = Nodes(np.zeros((3, 3)), damping=300.0), np.random.default_rng(1)
    nodes.mass[:], nodes.inertia[:] = rng.uniform(1.0, 2.0, (2, 3))
    nodes.v[:], nodes.omega[:] = rng.normal(size=(2, 3, 3))
    energy, momentum = nodes.kinetic_energy(), nodes.mass @ nodes.v
    taken = nodes.kick_and_drift(1e-3, 1e-3, np.zeros((3, 3)))
    assert 2.0 * taken == pytest.approx(energy - nodes.kinetic_energy(), rel=1e-12)
    assert nodes.air_impulse == pytest.approx(momentum - nodes.mass @ nodes.v, rel=1e-12)


def test_stable_step_is_the_limit():
    """Just below the power iteration's step noise stays bounded; 5 % above, it explodes."""
    growth = []
    for factor in (0.98, 1.05):
        plate = shells((12, 10))
        dt = factor * plate.stable_step()
        plate.v[:] += np.random.default_rng(2).normal(0.0, 1e-6, plate.v.shape)
        plate.v[plate.fixed] = 0.0
        start = plate.kinetic_energy()
        for _ in range(1500):
            plate.update_forces(dt)
            plate.kick_and_drift(dt, dt, np.zeros_like(plate.x))
        growth.append(plate.kinetic_energy() / start)
    assert growth[0] < 10.0
    assert not growth[1] < 1e3
