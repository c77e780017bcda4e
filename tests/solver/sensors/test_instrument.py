"""The instrument: gain and phase of its low-pass, its clock, drift and noise; and its place in a case."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.sensors.displacement import Displacement
from birdstrike.solver.sensors.instrument import Instrument, low_pass, recorded, with_noise
from birdstrike.solver.sensors.registry import SENSORS

TIME = np.linspace(0.0, 20e-3, 40_001)


def instrument(**fields: object) -> Instrument:
    return Instrument.model_validate(fields)


@pytest.mark.parametrize("frequency", [200.0, 1000.0, 5000.0])
def test_the_low_pass_has_the_first_orders_gain_and_phase(frequency):
    """Gain 1/sqrt(1 + (f/fc)^2), phase -atan(f/fc), once the start has died away."""
    passed = low_pass(TIME, np.sin(2.0 * np.pi * frequency * TIME), 1000.0)
    late = TIME > 10e-3
    waves = np.stack([np.sin(2.0 * np.pi * frequency * TIME), np.cos(2.0 * np.pi * frequency * TIME)])[:, late]
    a, b = np.linalg.lstsq(waves.T, passed[late], rcond=None)[0]
    assert np.hypot(a, b) == pytest.approx(1.0 / np.hypot(1.0, frequency / 1000.0), rel=1e-4)
    assert np.arctan2(b, a) == pytest.approx(-np.arctan(frequency / 1000.0), abs=1e-4)


def test_the_low_pass_answers_a_step_as_its_time_constant_says_on_any_clock():
    """A ramp lags by tau once started: exact also on an uneven clock."""
    time = np.sort(np.random.default_rng(0).uniform(0.0, 5e-3, 60))
    tau = 1.0 / (2.0 * np.pi * 800.0)
    passed = low_pass(time, 3.0 * (time - time[0]), 800.0)
    since = time - time[0]
    assert passed == pytest.approx(3.0 * (since - tau * (1.0 - np.exp(-since / tau))), abs=1e-15)


def test_offset_shifts_gain_scales_and_drift_adds():
    pulse = np.exp(-(((TIME - 8e-3) / 1e-3) ** 2))
    late = recorded(instrument(time_offset="2 ms"), TIME, pulse)
    assert TIME[late.argmax()] == pytest.approx(10e-3, abs=1e-6)
    assert np.abs(recorded(instrument(gain=1.2), TIME, pulse) - 1.2 * pulse).max() == 0.0
    assert np.abs(recorded(instrument(drift="5 mm/s"), TIME, pulse) - pulse - 5e-3 * TIME).max() < 1e-15
    assert recorded(None, TIME, pulse) is pulse
    assert np.array_equal(recorded(instrument(), TIME, pulse), pulse)


def test_the_bandwidth_acts_before_the_sampling():
    """A 49 kHz ringing sampled at 50 kHz would be a 1 kHz wave of size 1: a 2 kHz instrument leaves 4 % of it."""
    ringing = np.sin(2.0 * np.pi * 49e3 * TIME)
    clock = 20e-6 * np.arange(900)
    slow = recorded(instrument(bandwidth="2 kHz"), TIME, ringing)
    seen = Displacement().sampled(clock, TIME, slow)
    assert np.abs(seen[100:]).max() < 0.045


def histories() -> Histories:
    time = 5e-6 * np.arange(4000)
    return Histories(
        time, {"w": np.zeros(4000), "e": np.zeros(4000), "f": np.zeros(4000)}, {"w": "m", "e": "", "f": "N"}
    )


NOISY = {
    "w": SENSORS.validate({"kind": "displacement", "noise": "0.03 mm"}),
    "e": SENSORS.validate({"kind": "strain", "noise": 5e-6}),
    "f": SENSORS.validate({"kind": "contact_force"}),
}


def test_noise_has_its_sigma_its_seed_and_its_own_stream():
    one, again, other = (with_noise(histories(), NOISY, seed) for seed in (1, 1, 2))
    assert np.std(one.channels["w"]) == pytest.approx(3e-5, rel=0.05)
    assert np.std(one.channels["e"]) == pytest.approx(5e-6, rel=0.05)
    assert not one.channels["f"].any()
    assert np.array_equal(one.channels["w"], again.channels["w"])
    assert not np.array_equal(one.channels["w"], other.channels["w"])
    assert abs(np.corrcoef(one.channels["w"], one.channels["e"])[0, 1]) < 0.06
    alone = with_noise(histories(), {"e": NOISY["e"]}, 1)
    assert np.array_equal(alone.channels["e"], one.channels["e"])


def test_noise_without_a_sigma_is_an_error():
    with pytest.raises(UserError, match="no sensor has noise"):
        with_noise(histories(), {"f": NOISY["f"]}, 0)


def test_an_instrument_changes_the_hash_and_its_absence_does_not():
    plain = load_case("reference_strike")
    idle = load_case("reference_strike", {"instrument.contact_force.gain": "1.0"})
    acting = load_case("reference_strike", {"instrument.contact_force.bandwidth": "10 kHz"})
    assert "instrument" not in plain.canonical()
    assert case_hash(idle) == case_hash(plain) != case_hash(acting)
    assert acting.canonical()["instrument"]["contact_force"]["bandwidth"] == 1e4


@pytest.mark.parametrize(
    ("key", "text", "expected"),
    [
        ("x.gain", "1.1", "instrument.x belongs to no sensor of the case; its sensors: displacement_centre,"),
        ("contact_force.drift", "5 mm/s", "~ = 5 mm/s is no drift of a contact_force sensor; write -1e6 kN/s .."),
        ("contact_force.drift", "5 kg", "~ = 5 kg fits no kind of sensor; write it per second, such as"),
        ("contact_force.bandwidth", "10", '~ = 10 has no unit; write "10 Hz" (accepted units: 1/s, 1/ms, Hz, kHz)'),
        ("contact_force.gain", "0", "~ = 0 is outside 0.01 .. 100.0;"),
        ("contact_force.bandwith", "10 Hz", "~ is not a key of a case; did you mean bandwidth?"),
    ],
)
def test_a_wrong_instrument_is_one_line(key: str, text: str, expected: str):
    with pytest.raises(CaseError) as caught:
        load_case("reference_strike", {f"instrument.{key}": text})
    (line,) = caught.value.errors
    assert line.startswith(expected.replace("~", f"instrument.{key}"))
