"""A rigid plate: what a case says of it, the energy balance of an impact on it, and its gauges."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.estimate import estimate
from birdstrike.solver.reference.wilbeck import duration, hugoniot_pressure, peak, stagnation_pressure, steady_mean
from birdstrike.solver.simulate import simulate

FLAT = {
    "plate.rigid": "true",
    "plate.elements": "[12, 12]",
    "plate.length": "300 mm",
    "plate.width": "300 mm",
    "bird.shape": "cylinder",
    "bird.diameter": "80 mm",
    "bird.length": "120 mm",
    "bird.particles": "1200",
    "bird.material.compression_erosion": "0.0",
    "impact.angle": "90 deg",
    "impact.standoff": "0 mm",
    "time.end": "0.6 ms",
    "time.snapshots": '["0.3 ms"]',
    "sensors.gauge.kind": "pressure",
    "sensors.gauge.radius": "24 mm",
}


def flat(**changes: str) -> Case:
    return load_case("reference_strike", FLAT | {key.replace("__", "."): text for key, text in changes.items()})


@pytest.fixture(scope="module")
def strike() -> Histories:
    return simulate(flat(), threads=1)


def test_energy_and_momentum_balance_on_a_rigid_plate(strike):
    assert strike.summary["momentum_error"] < 1e-10
    assert strike.summary["worst_energy_error"] < 0.01
    assert strike.summary["energies_J"]["plate_internal"] == strike.summary["energies_J"]["plate_kinetic"] == 0.0


def test_it_does_not_move_and_passes_everything_on(strike):
    assert not strike.channels["displacement_centre"].any()
    assert strike.channels["reaction_force"] == pytest.approx(strike.channels["contact_force"], rel=1e-12)
    assert not strike.snapshots[0].plate_stress.any()


def test_the_impulse_stops_the_bird(strike):
    """Most of it in this time; the whole impulse belongs to the verification page."""
    impulse = np.trapezoid(strike.channels["contact_force"], strike.time)
    momentum = flat().bird.actual_mass * 91.1
    assert 0.4 * momentum < impulse < 1.1 * momentum


def test_pressures_have_the_size_that_theory_gives(strike):
    """The gauge's peak lies between stagnation and Hugoniot pressure; the disc of 3 spacings averages the shock."""
    top, when = peak(strike.time, strike.channels["gauge"])
    assert stagnation_pressure(900.0, 91.1) < top < 1.1 * hugoniot_pressure(900.0, 1670.0, 2.48, 91.1)
    assert when < 60e-6


def test_heat_of_friction_on_a_rigid_plate_is_in_the_energy_balance():
    inviscid = {"impact__angle": "45 deg", "bird__material__viscosity": "0 Pa s", "time__snapshots": "[]"}
    slanted = simulate(flat(**inviscid, impact__friction="0.3"), threads=1)
    smooth = simulate(flat(**inviscid), threads=1)
    assert slanted.summary["energies_J"]["friction"] > 0.01 * slanted.summary["energies_J"]["normal"]
    assert "friction" not in smooth.summary["energies_J"]
    for run in (slanted, smooth):
        assert run.summary["momentum_error"] < 1e-10
        assert run.summary["angular_momentum_error"] < 1e-6
        assert run.summary["worst_energy_error"] < 0.01


def test_a_rigid_plate_needs_neither_thickness_nor_metal(tmp_path):
    text = """extends = "reference_strike"
[plate]
rigid = true
"""
    (tmp_path / "rigid.toml").write_text(text)
    case = load_case(tmp_path / "rigid.toml")
    assert estimate(case)["first_period"] is None
    bare = {"length": "0.3 m", "width": "0.3 m", "elements": [10, 10], "rigid": True}
    assert type(case.plate).model_validate(bare).thickness == 0.01
    with pytest.raises(CaseError, match="a rigid plate has no strain"):
        load_case(tmp_path / "rigid.toml", {"sensors.s.kind": "strain"})


def test_the_hash_of_a_deformable_plate_knows_nothing_of_rigidity():
    plain = load_case("reference_strike")
    assert case_hash(load_case("reference_strike", {"plate.rigid": "false"})) == case_hash(plain)
    assert case_hash(load_case("reference_strike", {"plate.rigid": "true"})) != case_hash(plain)


def test_the_steady_mean_is_that_of_the_middle_third():
    time = np.linspace(0.0, 3e-3, 3001)
    pressure = np.where((time > 1.1e-3) & (time < 2.1e-3), 2e6, 9e6)
    assert steady_mean(time, pressure, 0.1e-3, duration(0.3, 100.0)) == pytest.approx(2e6, rel=0.01)
    with pytest.raises(ValueError, match="before 2 t_D/3"):
        steady_mean(time[:1500], pressure[:1500], 0.1e-3, 3e-3)
    assert hugoniot_pressure(1000.0, 1482.9, 2.0, 200.0) == pytest.approx(376.6e6, rel=1e-3)
