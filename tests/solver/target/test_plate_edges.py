"""Edge springs: their energy and what the frame feels of them. Held in its plane, an edge stiffens: `make verify`."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.reports.verification.problems.plate import central_load, shells
from birdstrike.solver.target.modes import natural_frequencies
from birdstrike.solver.target.supports import EdgeStiffness

SPRINGS = EdgeStiffness(in_plane=2e9, transverse=5e9, rotational=2e5)


@pytest.mark.parametrize("edges", ["clamped", "pinned", SPRINGS, EdgeStiffness(in_plane=2e9)])
def test_frame_takes_the_load_and_its_moment(edges):
    """Momentum and moment of momentum of a plate under an eccentric load: what the load gave and the frame took."""
    plate = shells((12, 10), edges)
    load = central_load(plate, 2e3) * (1.0 + plate.x[:, :1] / 0.1)
    dt, force, given, taken = 0.9 * plate.stable_step(), np.zeros(3), np.zeros(6), np.zeros(6)
    for step in range(600):
        kick = dt if step else 0.5 * dt
        plate.update_forces(dt if step else 0.0)
        plate.update_energies()
        plate.reaction(load, force)
        given += kick * np.concatenate([load.sum(axis=0), np.cross(plate.x, load).sum(axis=0)])
        taken += kick * plate.on_frame
        plate.kick_and_drift(kick, dt, load)
    momentum = plate.mass @ plate.v
    assert np.allclose(momentum, given[:3] - taken[:3], atol=1e-12 * np.abs(given).max())
    spin = np.cross(plate.x, plate.mass[:, None] * plate.v).sum(axis=0) + plate.inertia @ plate.omega
    assert np.abs(spin - (given[3:] - taken[3:])).max() < 2e-3 * np.abs(given[3:]).max()
    assert (plate.energies["plate_edges"] > 0.0) == (not isinstance(edges, str))


def test_springs_hold_half_k_u_squared():
    """What the springs took is what they hold, to rounding, however the plate got there."""
    plate = shells((8, 6), SPRINGS)
    load, dt = central_load(plate, 5e3), 0.9 * plate.stable_step()
    for step in range(300):
        plate.update_forces(dt if step else 0.0)
        plate.update_energies()
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    u = plate.supports.displacement
    across = (u[:, :3] * plate.supports.normal).sum(axis=1)
    along = (u[:, :3] ** 2).sum(axis=1) - across**2
    parts = np.stack([along, across**2, (u[:, 3:] ** 2).sum(axis=1)], axis=1)
    assert plate.energies["plate_edges"] == pytest.approx(0.5 * (plate.supports.springs * parts).sum(), rel=1e-9)


def test_tributary_lengths_make_up_the_border():
    plate = shells((8, 6))
    assert plate.mesh.edge_lengths().sum() == pytest.approx(2.0 * (0.525 + 0.430), rel=1e-12)


def test_springs_lie_between_the_named_edges():
    """No rotational stiffness is a pin, a huge one a clamp."""
    limits = [natural_frequencies(shells((10, 8), e), 1)[0][0] for e in ("pinned", "clamped")]
    sprung = [natural_frequencies(shells((10, 8), EdgeStiffness(rotational=k)), 1)[0][0] for k in (1.0, 1e11)]
    assert sprung == pytest.approx(limits, rel=1e-4)


def test_stiff_springs_shorten_the_stable_step():
    assert shells((8, 6), EdgeStiffness(in_plane=1e13)).stable_step() < 0.5 * shells((8, 6)).stable_step()


def test_preload_rests_on_springs():
    """A preloaded plate on springs stays where it is."""
    plate = shells((8, 6), SPRINGS)
    plate.preload(50e6, 20e6)
    dt, none = 0.9 * plate.stable_step(), np.zeros_like(plate.x)
    for step in range(50):
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt, dt, none)
    assert np.abs(plate.x - plate.mesh.nodes).max() < 1e-12
    assert np.allclose(plate.shells.stress[:, :, 0], 50e6)


def test_a_preload_needs_a_hold():
    with pytest.raises(UserError, match=r"plate\.preload"):
        shells((8, 6), "free").preload(50e6, 0.0)
