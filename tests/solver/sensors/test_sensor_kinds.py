"""Kinds of sensors: a registry whose every member reads, samples and states its units; no unknown one is taken."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from birdstrike.solver.case.case import load_case
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.sensors.sensor import Sensor
from tests.solver.case.wrong_cases import errors_with


@pytest.mark.parametrize("kind", SENSORS)
def test_every_kind_says_what_a_case_a_report_and_an_instrument_need(kind: str) -> None:
    sensor = SENSORS.validate({"kind": kind})
    assert isinstance(sensor, SENSORS[kind])
    assert sensor.unit == sensor.noise_range.unit
    assert sensor.drift_range.unit == (f"{sensor.unit}/s" if sensor.unit else "1/s")
    assert sensor.noun.split(" ")[0] in ("a", "the")
    assert sensor.canonical()["kind"] == kind


@pytest.mark.parametrize("content", [{"kind": "presure"}, {}, {"kind": 3}])
def test_an_unknown_kind_is_never_read_as_another(content: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SENSORS.validate(content)


def test_an_unknown_kind_is_named_with_the_nearest() -> None:
    assert errors_with({"sensors.gauge.kind": "presure"}) == [
        'sensors.gauge.kind = presure is unknown; did you mean "pressure"?'
    ]


def test_a_kind_without_a_reading_reads_nothing() -> None:
    with pytest.raises(NotImplementedError, match="mute"):
        Sensor(kind="mute").reading(None)  # pyright: ignore[reportArgumentType]


def test_the_key_of_another_kind_is_refused_and_a_misspelt_one_is_guessed() -> None:
    assert errors_with({"sensors.contact_force.direction": "30 deg"}) == [
        "sensors.contact_force.direction = 30 deg: only a strain sensor has a direction; leave it out"
    ]
    assert errors_with({"sensors.displacement_centre.nose": "1 mm"}) == [
        "sensors.displacement_centre.nose is not a key of a case; did you mean noise?"
    ]


def test_a_sensor_s_hash_holds_the_keys_of_its_own_kind_alone() -> None:
    sensors = load_case("reference_strike", {"sensors.gauge": '{kind = "pressure"}'}).canonical()["sensors"]
    assert sensors["gauge"].keys() == {"kind", "at", "radius"}
