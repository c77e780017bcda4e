"""Effects of the instruments: clock, gain, bandwidth, drift.

The trigger is common to all sensors. Gain, bandwidth and drift are those of the displacement transducers; where a case
has none, gain and bandwidth are those of all its sensors.
"""

from __future__ import annotations

import math
from typing import Any

from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table
from birdstrike.solver.sensors.instrument import Instrument

GROUP = "instrument"


def transducers(case: Declared) -> tuple[str, ...]:
    """Sensors whose own electronics an effect changes: those of displacement, or all where there is none."""
    found = tuple(name for name, sensor in case.sensors.items() if sensor.is_transducer)
    return found or tuple(case.sensors)


def _set(case: Declared, names: tuple[str, ...], key: str, value: Any) -> Table:
    """One key of several instruments; value: from the instrument that the case declares."""
    own = {name: case.instrument.get(name, Instrument()) for name in names}
    return {"instrument": {name: {key: value(instrument)} for name, instrument in own.items()}}


def _time_offset(case: Declared, x: float) -> Table:
    return _set(case, tuple(case.sensors), "time_offset", lambda own: quantity_text(own.time_offset + x, "s"))


def _gain(case: Declared, x: float) -> Table:
    return _set(case, transducers(case), "gain", lambda own: own.gain * (1.0 + x))


def _bandwidth(case: Declared, x: float) -> Table:
    """Time constants add: a first-order low-pass of 1/(2 pi tau)."""

    def passed(own: Instrument) -> str:
        tau = x + (0.0 if own.bandwidth is None else 1.0 / (2.0 * math.pi * own.bandwidth))
        return quantity_text(1.0 / (2.0 * math.pi * tau), "1/s")

    return _set(case, transducers(case), "bandwidth", passed) if x > 0.0 else {}


def _drift(case: Declared, x: float) -> Table:
    return _set(case, transducers(case), "drift", lambda own: quantity_text(own.drift + x, "m/s"))


def _no_displacement(case: Declared) -> str:
    return (
        "" if any(sensor.is_transducer for sensor in case.sensors.values()) else "the case has no displacement sensor"
    )


INSTRUMENT = (
    Effect(
        "time_offset",
        "a record that starts late or early",
        "s",
        _time_offset,
        lambda _: 2e-5,
        group=GROUP,
        source="trigger delay, common to all sensors; above 0 the record is late",
    ),
    Effect(
        "sensor_gain",
        "a displacement transducer with another gain",
        "",
        _gain,
        lambda _: 0.03,
        lambda _: -0.99,
        group=GROUP,
        source="calibration of the transducer and its amplifier: a few per cent",
    ),
    Effect(
        "sensor_bandwidth",
        "a displacement transducer that is too slow",
        "s",
        _bandwidth,
        lambda _: 3e-5,
        lambda _: 0.0,
        group=GROUP,
        source="first-order low-pass, stated by its time constant tau = 1/(2 pi bandwidth): 0.03 ms is 5.3 kHz",
        alternative=("1/s", lambda bandwidth: 1.0 / (2.0 * math.pi * bandwidth)),
    ),
    Effect(
        "sensor_drift",
        "a displacement transducer that drifts",
        "m/s",
        _drift,
        lambda _: 0.1,
        refuses=_no_displacement,
        group=GROUP,
        source="linear in time from the record's zero",
    ),
)
