"""A plate that tears: layers fail one by one, elements go, and energy still balances."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import load_case
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial

FAST = {
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "plate.thickness": "3 mm",
    "plate.material.yield_stress": "350 MPa",
    "plate.material.tangent_modulus": "700 MPa",
    "plate.material.failure_strain": "0.12",
    "time.end": "1 ms",
    "time.snapshots": "[]",
    "impact.standoff": "2 mm",
    "impact.angle": "90 deg",
    "impact.speed": "250 m/s",
}


FOLDED = {"plate.thickness": "2 mm", "plate.material.failure_strain": "0.2", "bird.particles": "700"}


@pytest.fixture(scope="module", params=[{}, FOLDED], ids=["holed", "folded"])
def torn(request: pytest.FixtureRequest) -> Histories:
    return simulate(load_case("reference_strike_156mm", FAST | request.param))


def test_a_fast_bird_tears_a_thin_plate(torn):
    assert torn.summary["eroded_shells"] > 5
    assert any("the plate tore" in text for text in torn.summary["warnings"])


def test_the_books_of_a_torn_plate_balance(torn):
    assert torn.summary["worst_energy_error"] < 0.01
    assert torn.summary["momentum_error"] < 1e-10
    assert torn.summary["energies_J"]["plate_eroded"] > 0.0


def test_a_slow_bird_tears_nothing():
    slow = simulate(load_case("reference_strike_156mm", FAST | {"impact.speed": "50 m/s"}))
    assert slow.summary["eroded_shells"] == 0
    assert slow.summary["energies_J"]["plate_eroded"] == 0.0


def stretched(rotation: float) -> tuple[Target, list[tuple[int, float]]]:
    """A single shell pulled (and bent) until nothing is left: its failed layers and force at each step."""
    metal = ShellMaterial(70e9, 0.3, 2700.0, 300e6, 0.0, failure_strain=0.05)
    plate = plate_of(plate_mesh(0.01, 0.01, (1, 1)), 0.002, metal, "free")
    right = plate.x[:, 0] > 0.0
    history = []
    for _ in range(400):
        plate.v[right, 0], plate.omega[right, 1] = 1.0, rotation
        plate.x[:] += 5e-6 * plate.v
        plate.update_forces(5e-6)
        plate.update_energies()
        failed = int((plate.shells.eps_p[0] >= 0.05).sum())
        history.append((failed, float(np.abs(plate.nodal[:, :3]).max())))
    return plate, history


def test_pure_stretch_fails_all_layers_at_the_failure_strain():
    plate, history = stretched(0.0)
    failed = [count for count, _ in history]
    assert set(failed) == {0, 5}
    assert plate.eroded == 1
    assert np.abs(plate.nodal).max() == 0.0
    assert plate.energies["plate_internal"] == pytest.approx(0.0, abs=1e-12)
    assert plate.energies["plate_eroded"] == pytest.approx(300e6 * 0.01 * 0.01 * 0.002 * 0.05 * 1.1, rel=0.15)


def test_bending_fails_layers_one_by_one_and_the_force_falls_with_them():
    plate, history = stretched(600.0)
    failed = np.array([count for count, _ in history])
    assert (np.diff(failed) >= 0).all()
    assert len(set(failed)) > 3
    assert plate.eroded == 1


def test_nodes_of_a_gone_element_fly_on():
    plate, _ = stretched(0.0)
    plate.v[:] = [1.0, 2.0, 3.0]
    start = plate.x.copy()
    plate.update_forces(1e-6)
    plate.kick_and_drift(1e-6, 1e-6, np.zeros_like(plate.x))
    assert np.allclose(plate.x - start, 1e-6 * np.array([1.0, 2.0, 3.0]), rtol=0.0, atol=1e-15)
    assert plate.mass.sum() == pytest.approx(2700.0 * 0.01 * 0.01 * 0.002)
