"""Faults of instruments: what they change is what the solver's instrument does."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.preparation.shots import fault_named, instrument_effects, with_faults
from birdstrike.solver.case.case import load_case
from birdstrike.solver.sensors.instrument import Instrument, recorded

TIME = np.linspace(0.0, 3e-3, 601)
CURVE = 5e-3 * np.sin(900.0 * TIME) ** 2
FAULTS = {"sensor_gain": 0.03, "time_offset": 2e-5, "sensor_bandwidth": 3e-5, "sensor_drift": 0.1}


def reading(name: str, magnitude: float) -> np.ndarray:
    """What the solver's instrument makes of the curve."""
    own = {
        "sensor_gain": {"gain": 1.0 + magnitude},
        "time_offset": {"time_offset": f"{magnitude} s"},
        "sensor_bandwidth": {"bandwidth": f"{1.0 / (2.0 * np.pi * (magnitude or 1e-9))} Hz"},
        "sensor_drift": {"drift": f"{magnitude} m/s"},
    }[name]
    return recorded(Instrument.model_validate(own), TIME, CURVE)


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("h", [0.7, 3.0, 8.0])
def test_a_fault_changes_a_curve_as_the_instrument_does(name: str, h: float) -> None:
    expected = reading(name, h * FAULTS[name]) - CURVE
    assert np.abs(fault_named(name).change(h * FAULTS[name], TIME, CURVE) - expected).max() < 1e-6 * np.abs(CURVE).max()


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("h", [0.0, 1.0, 5.0])
def test_a_signature_is_the_slope_of_what_the_instrument_does(name: str, h: float) -> None:
    """Within the second difference over one plausible size, which no slope can show."""
    low, middle, high = (reading(name, x * FAULTS[name]) for x in (max(h - 0.5, 0.0), h, max(h + 0.5, 1.0)))
    slope, bent = high - low, np.abs(high - 2.0 * middle + low).max()
    error = np.abs(fault_named(name).signature(FAULTS[name], TIME, CURVE, h) - slope)[5:-5].max()
    assert error < 0.02 * np.abs(slope).max() + (bent if h == 0.0 else 0.0)


def test_a_slow_sensor_is_written_into_the_case_beside_the_bandwidth_that_it_declares() -> None:
    """Time constants add, for one sensor as for all."""
    sensor = "displacement_centre"
    case = load_case("virtual_strike", {f"instrument.{sensor}.bandwidth": "10 kHz"})
    tau = 3e-5 + 1.0 / (2.0 * np.pi * 10e3)
    for slow in (
        with_faults(case, [(sensor, "sensor_bandwidth", 3e-5)]),
        case.with_effects({"sensor_bandwidth": 3e-5}),
    ):
        assert slow.instrument[sensor].bandwidth == pytest.approx(1.0 / (2.0 * np.pi * tau))
    assert with_faults(case, [(sensor, "sensor_bandwidth", 0.0)]).instrument[sensor].bandwidth == pytest.approx(10e3)


def test_a_record_that_is_early_goes_on_straight_beyond_the_simulation() -> None:
    early = CURVE + fault_named("time_offset").change(-1e-4, TIME, CURVE)
    known = TIME[-1] - 1e-4 > TIME
    assert early[known] == pytest.approx(np.interp(TIME[known] + 1e-4, TIME, CURVE))
    assert np.diff(early[~known]) == pytest.approx(np.gradient(CURVE, TIME)[-1] * 5e-6, rel=1e-3)


def test_each_sensor_may_have_a_fault_of_its_own() -> None:
    case = load_case("virtual_strike")
    labels = [one.label for one in instrument_effects(case, ("displacement_centre", "displacement_quarter"))]
    assert "sensor_gain" in labels
    assert "sensor_gain.displacement_centre" in labels
    alone = [one.label for one in instrument_effects(case, ("displacement_centre",))]
    assert "sensor_gain.displacement_centre" not in alone
