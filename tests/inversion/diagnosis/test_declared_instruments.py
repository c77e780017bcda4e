"""A fault of the instrument beside what the case declares of it: on curves, in the case, and by the solver."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.before_and_after import case_with
from birdstrike.inversion.diagnosis.hypotheses import Suspect
from birdstrike.inversion.diagnosis.instrument import change, instrument_effects, signature, with_faults
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.sensors.instrument import Instrument, recorded

TIME = np.linspace(0.0, 3e-3, 601)
SIGNAL = 5e-3 * np.sin(900.0 * TIME) ** 2
SIZES = {"sensor_gain": 0.03, "time_offset": 2e-5, "sensor_bandwidth": 3e-5, "sensor_drift": 0.1}
SENSOR = "displacement_centre"
DECLARED: dict[str, dict[str, Any]] = {
    "late": {"time_offset": "50 us"},
    "amplified": {"gain": 1.5},
    "slow": {"bandwidth": "2 kHz"},
    "drifting": {"drift": "0.3 m/s"},
    "all": {"time_offset": "50 us", "gain": 1.5, "bandwidth": "2 kHz", "drift": "0.3 m/s"},
}


def declaring(instrument: dict[str, Any]) -> Case:
    return load_case({**load_case("virtual_strike").table, "instrument": {SENSOR: instrument}})


def read(case: Case) -> np.ndarray:
    """What a case's instrument makes of the signal."""
    return recorded(case.instrument.get(SENSOR, Instrument()), TIME, SIGNAL)


def suspect(case: Case, label: str) -> Suspect:
    fault = next(one for one in instrument_effects(case, tuple(case.sensors)) if one.label == label)
    return Suspect(label, fault.effect.name, "instrument", ("shot",), fault=fault)


@pytest.mark.parametrize("declared", DECLARED)
@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("h", [1.0, 4.0])
def test_a_fault_changes_the_curve_as_the_repaired_case_reads_it(name: str, declared: str, h: float) -> None:
    """Against the solver's own instrument; curves are linear between instants, which two delays smooth twice."""
    case = declaring(DECLARED[declared])
    repaired = with_faults(case, [(SENSOR, name, h * SIZES[name])])
    expected = read(repaired) - read(case)
    found = change(name, h * SIZES[name], TIME, read(case), case.instrument[SENSOR])
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


@pytest.mark.parametrize("name", SIZES)
def test_a_signature_beside_a_declared_instrument_is_the_slope_of_the_change(name: str) -> None:
    own = declaring(DECLARED["all"]).instrument[SENSOR]
    curve = recorded(own, TIME, SIGNAL)
    low, high = (change(name, (2.0 + d) * SIZES[name], TIME, curve, own) for d in (-0.5, 0.5))
    slope = signature(name, SIZES[name], TIME, curve, 2.0, own)
    assert np.abs(slope - (high - low))[20:-20].max() < 0.02 * np.abs(slope).max()


COMBINED = {
    "sensor_gain": (0.1, 0.2, {"gain": 1.32}),
    "time_offset": (4e-5, 8e-5, {"time_offset": 1.2e-4}),
    "sensor_bandwidth": (3e-5, 6e-5, {"bandwidth": 1.0 / (2.0 * np.pi * 9e-5)}),
    "sensor_drift": (0.3, -0.1, {"drift": 0.2}),
}
"""Name -> magnitude that the case declares, the one found beside it, the instrument with both."""


@pytest.mark.parametrize("name", COMBINED)
@pytest.mark.parametrize("place", ["", f".{SENSOR}"])
def test_a_fault_found_stands_beside_the_effect_that_the_case_declares(name: str, place: str) -> None:
    declared, found, expected = COMBINED[name]
    case = load_case("virtual_strike").with_effects({name: declared})
    own = case_with(case, [(suspect(case, f"{name}{place}"), found)]).instrument[SENSOR]
    assert {key: getattr(own, key) for key in expected} == pytest.approx(expected)


def test_a_fault_of_one_sensor_leaves_the_declared_effect_of_the_others() -> None:
    case = load_case("virtual_strike").with_effects({"sensor_gain": 0.1})
    found = case_with(case, [(suspect(case, f"sensor_gain.{SENSOR}"), 0.2)]).instrument
    assert found[SENSOR].gain == pytest.approx(1.32)
    assert found["displacement_quarter"].gain == pytest.approx(1.1)
