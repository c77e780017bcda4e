"""A plate in rigid motion, of any element: what every kind of shell must pass."""

import numpy as np

from birdstrike.solver.target.assembly import Target


def assert_strained_by_no_rigid_motion(plate: Target) -> None:
    """Turned out of its plane, flying and spinning at 50 rad/s: strains at rounding after a step."""
    axis = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    k = np.cross(axis, np.eye(3)).T
    plate.x[:] = plate.x @ (np.eye(3) + np.sin(0.7) * k + (1.0 - np.cos(0.7)) * (k @ k)).T
    plate.omega[:] = 50.0 * axis
    plate.v[:] = np.array([3.0, -2.0, 1.0]) + np.cross(50.0 * axis, plate.x)
    plate.update_forces(1e-15)
    assert np.abs(plate.shells.strain).max() < 1e-12 * 50.0 * 1e-15
    assert np.abs(plate.shells.hourglass_strain).max() < 1e-12 * 50.0 * 1e-15
