"""Effects of the instruments: clock, gain, bandwidth, drift.

The trigger is common to all sensors. Gain, bandwidth and drift are those of the displacement transducers; where a case
has none, gain and bandwidth are those of all its sensors that can have them (`able`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table
from birdstrike.solver.sensors.instrument import Instrument

GROUP = "instrument"


def transducers(case: Declared) -> tuple[str, ...]:
    """Sensors whose own electronics an effect changes: those of displacement, or all where there is none."""
    found = tuple(name for name, sensor in case.sensors.items() if sensor.is_transducer)
    return found or tuple(case.sensors)


def able(case: Declared, name: str, sensors: Iterable[str]) -> tuple[str, ...]:
    """Those of some sensors that an effect may act on.

    The library states a drift in m/s: of displacement sensors. No instrument reads the contact force, so that it has no
    bandwidth; a low-pass would only imitate how the layers of a particle lattice arrive one after another.
    """
    kinds = {sensor: case.sensors[sensor].kind for sensor in sensors}
    if name == "sensor_drift":
        return tuple(sensor for sensor, kind in kinds.items() if kind == "displacement")
    return tuple(sensor for sensor, kind in kinds.items() if name != "sensor_bandwidth" or kind != "contact_force")


def fault(case: Declared, name: str, x: float, sensor: str) -> dict[str, Any]:
    """Settings of one sensor's instrument with a fault of magnitude x [SI] beside what the case declares of it."""
    return _FAULTS[name](case.instrument.get(sensor, Instrument()), x)


def time_constant(own: Instrument) -> float:
    """Of the instrument's low-pass [s], 0 without one."""
    return 0.0 if own.bandwidth is None else 1.0 / (2.0 * math.pi * own.bandwidth)


def combined(name: str, declared: float, found: float) -> float:
    """Magnitude of one fault that does what two of its kind do: gains multiply, the others add."""
    return (1.0 + declared) * (1.0 + found) - 1.0 if name == "sensor_gain" else declared + found


def _faulty(case: Declared, name: str, x: float, sensors: Iterable[str]) -> Table:
    found = {sensor: settings for sensor in sensors if (settings := fault(case, name, x, sensor))}
    return {"instrument": found} if found else {}


def _late(own: Instrument, x: float) -> dict[str, Any]:
    return {"time_offset": quantity_text(own.time_offset + x, "s")}


def _gain(own: Instrument, x: float) -> dict[str, Any]:
    return {"gain": own.gain * (1.0 + x)}


def _slow(own: Instrument, x: float) -> dict[str, Any]:
    """Time constants add: a first-order low-pass of 1/(2 pi tau)."""
    if x <= 0.0:
        return {}
    return {"bandwidth": quantity_text(1.0 / (2.0 * math.pi * (x + time_constant(own))), "1/s")}


def _drifting(own: Instrument, x: float) -> dict[str, Any]:
    return {"drift": quantity_text(own.drift + x, "m/s")}


_FAULTS = {"time_offset": _late, "sensor_gain": _gain, "sensor_bandwidth": _slow, "sensor_drift": _drifting}


def _of_all(name: str) -> Callable[[Declared, float], Table]:
    return lambda case, x: _faulty(case, name, x, case.sensors)


def _of_transducers(name: str) -> Callable[[Declared, float], Table]:
    return lambda case, x: _faulty(case, name, x, able(case, name, transducers(case)))


def _no_displacement(case: Declared) -> str:
    return (
        "" if any(sensor.is_transducer for sensor in case.sensors.values()) else "the case has no displacement sensor"
    )


def _never_slow(case: Declared) -> str:
    sensors = able(case, "sensor_bandwidth", transducers(case))
    return "" if sensors else "no instrument reads the contact force, and the case has no other sensor"


INSTRUMENT = (
    Effect(
        "time_offset",
        "a record that starts late or early",
        "s",
        _of_all("time_offset"),
        lambda _: 2e-5,
        group=GROUP,
        source="trigger delay, common to all sensors; above 0 the record is late",
    ),
    Effect(
        "sensor_gain",
        "a displacement transducer with another gain",
        "",
        _of_transducers("sensor_gain"),
        lambda _: 0.03,
        lambda _: -0.99,
        group=GROUP,
        source="calibration of the transducer and its amplifier: a few per cent",
    ),
    Effect(
        "sensor_bandwidth",
        "a displacement transducer that is too slow",
        "s",
        _of_transducers("sensor_bandwidth"),
        lambda _: 3e-5,
        lambda _: 0.0,
        _never_slow,
        group=GROUP,
        source="first-order low-pass, stated by its time constant tau = 1/(2 pi bandwidth): 0.03 ms is 5.3 kHz",
        alternative=("1/s", lambda bandwidth: 1.0 / (2.0 * math.pi * bandwidth)),
    ),
    Effect(
        "sensor_drift",
        "a displacement transducer that drifts",
        "m/s",
        _of_transducers("sensor_drift"),
        lambda _: 0.1,
        refuses=_no_displacement,
        group=GROUP,
        source="linear in time from the record's zero",
    ),
)
