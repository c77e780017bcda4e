"""Effects beside what the case declares: an instrument's fault on curves and in the case, magnitudes at their least."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.conclusions import before_and_after
from birdstrike.inversion.diagnosis.conclusions.before_and_after import case_with
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.preparation.plan import with_candidate_sensors
from birdstrike.inversion.diagnosis.preparation.shots import fault_named, instrument_effects, with_faults
from birdstrike.solver.case.case import Case, case_from_table, load_case
from birdstrike.solver.effects.registry import effects
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


def candidate(case: Case, label: str) -> CandidateEffect:
    fault = next(one for one in instrument_effects(case, tuple(case.sensors)) if one.label == label)
    return CandidateEffect(label, fault.effect.name, "instrument", ("shot",), fault=fault)


@pytest.mark.parametrize("declared", DECLARED)
@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("h", [1.0, 4.0])
def test_a_fault_changes_the_curve_as_the_repaired_case_reads_it(name: str, declared: str, h: float) -> None:
    """Against the solver's own instrument; curves are linear between instants, which two delays smooth twice."""
    case = declaring(DECLARED[declared])
    repaired = with_faults(case, [(SENSOR, name, h * SIZES[name])])
    expected = read(repaired) - read(case)
    found = fault_named(name).change(h * SIZES[name], TIME, read(case), case.instrument[SENSOR])
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


@pytest.mark.parametrize("name", SIZES)
def test_a_signature_beside_a_declared_instrument_is_the_slope_of_the_change(name: str) -> None:
    own = declaring(DECLARED["all"]).instrument[SENSOR]
    curve = recorded(own, TIME, SIGNAL)
    low, high = (fault_named(name).change((2.0 + d) * SIZES[name], TIME, curve, own) for d in (-0.5, 0.5))
    slope = fault_named(name).signature(SIZES[name], TIME, curve, 2.0, own)
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
    own = case_with(case, [(candidate(case, f"{name}{place}"), found)]).instrument[SENSOR]
    assert {key: getattr(own, key) for key in expected} == pytest.approx(expected)


def test_a_fault_of_one_sensor_leaves_the_declared_effect_of_the_others() -> None:
    case = load_case("virtual_strike").with_effects({"sensor_gain": 0.1})
    found = case_with(case, [(candidate(case, f"sensor_gain.{SENSOR}"), 0.2)]).instrument
    assert found[SENSOR].gain == pytest.approx(1.32)
    assert found["displacement_quarter"].gain == pytest.approx(1.1)


@pytest.mark.parametrize(
    ("name", "declared"),
    [
        ("plate_damping", {"plate.damping": "400 1/s"}),
        ("bird_friction", {"impact.friction": 0.07}),
        ("edge_slip", {"plate.edges": '{ in_plane = "3e9 Pa" }'}),
    ],
)
def test_a_fit_at_the_least_magnitude_is_a_case_whatever_the_rounding(name: str, declared: dict[str, Any]) -> None:
    case = load_case("virtual_strike", declared)
    least = effects()[name].least(case)
    for value in (least, np.nextafter(least, -np.inf), np.nextafter(least, 0.0)):
        found = case_with(case, [(CandidateEffect(name, name, "plate", ("shot",)), float(value))])
        assert found.effects[name] == pytest.approx(least)


def test_a_fit_that_no_case_can_state_loses_its_own_run_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def fits(case: Case, *_: object) -> Case:
        return case.with_effects({"plate_thickness": -1.0}) if case.name == "impossible" else case

    monkeypatch.setattr(before_and_after, "case_at", fits)
    monkeypatch.setattr(before_and_after, "carried", lambda *_: SIGNAL)
    cases = {name: case_from_table(load_case("virtual_strike").table, name) for name in ("possible", "impossible")}
    simulations = SimpleNamespace(run=lambda wanted: dict.fromkeys(wanted), failures={})
    wanted: Any = {name: (case, None, None) for name, case in cases.items()}
    runs, failed = before_and_after.run_at(wanted, simulations)  # type: ignore[arg-type]
    assert set(runs) == {"possible"}
    assert "plate_thickness" in failed["impossible"]


FORCED = {
    "gauge": {"kind": "strain", "at": ["75 mm", "20 mm"]},
    "force": {"kind": "contact_force"},
    "support": {"kind": "reaction_force"},
}


@pytest.mark.parametrize("sensors", [("gauge", "force"), ("force", "support"), ("gauge", "support"), ("force",)])
@pytest.mark.parametrize("name", SIZES)
def test_an_effect_in_common_acts_on_the_same_sensors_in_the_case_as_on_its_curves(
    name: str, sensors: tuple[str, ...]
) -> None:
    """Without displacements the case's slow transducers filtered the contact force, the fitted curves did not."""
    table = {**load_case("virtual_strike").table, "sensors": {sensor: FORCED[sensor] for sensor in sensors}}
    case = load_case({key: value for key, value in table.items() if key != "inversion"})
    faults = {one.label: one.sensors for one in instrument_effects(case, sensors)}
    if effects()[name].refuses(case):
        assert name not in faults
        return
    changed = case.with_effects({name: SIZES[name]}).instrument
    found = {sensor for sensor, own in changed.items() if own != Instrument()}
    assert found == set(faults.get(name, ()))


@pytest.mark.parametrize(("offset", "longer"), [(-2e-4, 1.4e-4), (-1e-4, 4e-5), (-5e-5, 0.0), (1e-4, 0.0)])
@pytest.mark.parametrize("place", ["", f".{SENSOR}"])
def test_an_early_record_is_simulated_until_its_end(offset: float, longer: float, place: str) -> None:
    """The last points of a record that is 0.2 ms early were held against the simulation's last reading, repeated."""
    case = load_case("virtual_strike")
    found = case_with(case, [(candidate(case, f"time_offset{place}"), offset)])
    assert found.time.end == pytest.approx(case.time.end + longer)
    assert found.instrument[SENSOR].time_offset == pytest.approx(offset)


def test_an_early_record_that_the_case_declares_is_left_as_it_is() -> None:
    case = load_case("virtual_strike").with_effects({"time_offset": -2e-4})
    assert case_with(case, [(candidate(case, "sensor_gain"), 0.1)]).time == case.time


@pytest.mark.parametrize("kinds", [("gauge", "support"), (SENSOR, "gauge")])
def test_the_effects_of_a_case_stay_with_its_own_sensors_beside_candidate_ones(kinds: tuple[str, ...]) -> None:
    """The gain of a case of strains went over to the candidate displacements, and its own curves lacked it."""
    sensors = {name: FORCED.get(name, {"kind": "displacement"}) for name in kinds}
    acting = {"sensor_gain": 0.1, "sensor_bandwidth": 3e-5, "time_offset": 2e-5, "plate_thickness": 2e-4}
    table = {**load_case("virtual_strike").table, "sensors": sensors, "instrument": {kinds[0]: {"gain": 1.5}}}
    case = case_from_table({key: one for key, one in table.items() if key != "inversion"}).with_effects(acting)
    probed = with_candidate_sensors(case)
    assert len(probed.sensors) > len(case.sensors)
    for name in kinds:
        assert probed.instrument[name].model_dump() == pytest.approx(case.instrument[name].model_dump())
    assert probed.plate.thickness == case.plate.thickness
    assert probed.with_effects(probed.effects).instrument == probed.instrument


@pytest.mark.parametrize("declared", [0.3, 1.0, 7.0])
@pytest.mark.parametrize("place", ["", f".{SENSOR}"])
def test_a_sensor_as_good_as_dead_is_a_case_whatever_its_gain_and_the_rounding(declared: float, place: str) -> None:
    """Beside a declared gain of 0.3 the least gain was 0.003, which no case can state: the run at the fit was lost."""
    case = declaring({"gain": declared})
    dead = candidate(case, f"sensor_gain{place}")
    least = dead.magnitude(dead.limits[0])
    for value in (least, np.nextafter(least, -np.inf), -1.0):
        found = case_with(case, [(dead, float(value))]).instrument[SENSOR].gain
        assert found == pytest.approx(max(0.01, 0.0 if place else 0.01 * declared))
