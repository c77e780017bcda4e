"""Effects of the instruments: clock, gain, bandwidth, drift.

The trigger is common to all sensors. Gain, bandwidth and drift are those of the displacement transducers; where a case
has none, gain and bandwidth are those of all its sensors that can have them (`able`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.data.units import quantity_text
from birdstrike.solver.effects.effect import Declared, Effect, Table
from birdstrike.solver.effects.fault import Fault
from birdstrike.solver.sensors.instrument import LEAST_GAIN, Instrument, delayed, low_pass

FAMILY = "instrument"
LARGEST_GAIN = 1.0  # that is looked for: twice the reading, as of a range set wrong; the least is a dead sensor's


def transducers(case: Declared) -> tuple[str, ...]:
    """Sensors whose own electronics an effect changes: those of displacement, or all where there is none."""
    found = tuple(name for name, sensor in case.sensors.items() if sensor.is_transducer)
    return found or tuple(case.sensors)


def able(case: Declared, fault: Fault, sensors: Iterable[str]) -> tuple[str, ...]:
    """Those of some sensors that a fault may act on."""
    return tuple(sensor for sensor in sensors if fault.reads(case.sensors[sensor].kind))


def settings_with(case: Declared, fault: Fault, x: float, sensor: str) -> dict[str, Any]:
    """Settings of one sensor's instrument with a fault of magnitude x [SI] beside what the case declares of it."""
    return fault.settings(case.instrument.get(sensor, Instrument()), x)


def _faulty(case: Declared, fault: Fault, x: float, sensors: Iterable[str]) -> Table:
    found = {sensor: settings for sensor in sensors if (settings := settings_with(case, fault, x, sensor))}
    return {"instrument": found} if found else {}


def _of_all(fault: Fault) -> Callable[[Declared, float], Table]:
    return lambda case, x: _faulty(case, fault, x, case.sensors)


def _of_transducers(fault: Fault) -> Callable[[Declared, float], Table]:
    return lambda case, x: _faulty(case, fault, x, able(case, fault, transducers(case)))


def _late(own: Instrument, x: float) -> dict[str, Any]:
    return {"time_offset": quantity_text(own.time_offset + x, "s")}


def _shifted(x: float, time: Array, signal: Array, _: Instrument) -> Array:
    """Where a record that is early needs what comes after the curve's end, the curve goes on straight."""
    beyond = np.maximum(time - x - time[-1], 0.0)
    return delayed(time, signal, x) + beyond * np.gradient(signal, time)[-1] - signal


def _shift_slope(fault: Fault, size: float, time: Array, curve: Array, h: float, own: Instrument) -> Array:
    late = curve + fault.change(h * size, time, curve, own)
    return -size * np.gradient(late - own.drift * time, time)


CLOCK = Fault("time_offset", '"0.02 ms"', _late, _shifted, _shift_slope, common=True)


def _gain(own: Instrument, x: float) -> dict[str, Any]:
    return {"gain": own.gain * (1.0 + x)}


def _both_gains(declared: float, found: float) -> float:
    return (1.0 + declared) * (1.0 + found) - 1.0


GAIN = Fault("gain", "1.03", _gain, lambda x, _, signal, __: x * signal, combined=_both_gains, largest=LARGEST_GAIN)


def _time_constant(own: Instrument) -> float:
    """Of the instrument's low-pass [s], 0 without one."""
    return 0.0 if own.bandwidth is None else 1.0 / (2.0 * math.pi * own.bandwidth)


def _slow(own: Instrument, x: float) -> dict[str, Any]:
    """Time constants add: a first-order low-pass of 1/(2 pi tau)."""
    if x <= 0.0:
        return {}
    return {"bandwidth": quantity_text(1.0 / (2.0 * math.pi * (x + _time_constant(own))), "1/s")}


def _slower(x: float, time: Array, signal: Array, own: Instrument) -> Array:
    """(m,) what a time constant x [s] beside the instrument's own adds to a signal that has passed the latter.

    1/(1 + (a + b) s) = 1/(1 + a s) [a + b/(1 + (a + b) s)] / (a + b), so that no low-pass has to be undone.
    """
    if x <= 0.0:
        return np.zeros_like(signal)
    whole = x + _time_constant(own)
    return x / whole * (low_pass(time, signal, 1.0 / (2.0 * np.pi * whole)) - signal)


def _slope_of_slower(fault: Fault, size: float, time: Array, curve: Array, h: float, own: Instrument) -> Array:
    """By a central difference over one size; none is below 0."""
    low = max(h - 0.5, 0.0) * size
    return fault.change(low + size, time, curve, own) - fault.change(low, time, curve, own)


def _has_electronics(kind: str) -> bool:
    """No instrument reads the contact force; a low-pass would only imitate how layers of a lattice arrive in turn."""
    return kind != "contact_force"


BANDWIDTH = Fault("bandwidth", '"5 kHz"', _slow, _slower, _slope_of_slower, _has_electronics)


def _drifting(own: Instrument, x: float) -> dict[str, Any]:
    return {"drift": quantity_text(own.drift + x, "m/s")}


DRIFT = Fault(
    "drift",
    '"0.1 m/s"',
    _drifting,
    lambda x, time, _, __: x * time,
    reads=lambda kind: kind == "displacement",  # the library states a drift in m/s
)


def _no_displacement(case: Declared) -> str:
    return (
        "" if any(sensor.is_transducer for sensor in case.sensors.values()) else "the case has no displacement sensor"
    )


def _never_slow(case: Declared) -> str:
    sensors = able(case, BANDWIDTH, transducers(case))
    return "" if sensors else "no instrument reads the contact force, and the case has no other sensor"


INSTRUMENT = (
    Effect(
        "time_offset",
        "a record that starts late or early",
        "s",
        _of_all(CLOCK),
        lambda _: 2e-5,
        family=FAMILY,
        source="trigger delay, common to all sensors; above 0 the record is late",
        scope="shot",
        fault=CLOCK,
    ),
    Effect(
        "sensor_gain",
        "a displacement transducer with another gain",
        "",
        _of_transducers(GAIN),
        lambda _: 0.03,
        lambda _: LEAST_GAIN - 1.0,
        family=FAMILY,
        source="calibration of the transducer and its amplifier: a few per cent",
        scope="sensor",
        fault=GAIN,
    ),
    Effect(
        "sensor_bandwidth",
        "a displacement transducer that is too slow",
        "s",
        _of_transducers(BANDWIDTH),
        lambda _: 3e-5,
        lambda _: 0.0,
        _never_slow,
        family=FAMILY,
        source="first-order low-pass, stated by its time constant tau = 1/(2 pi bandwidth): 0.03 ms is 5.3 kHz",
        alternative=("1/s", lambda bandwidth: 1.0 / (2.0 * math.pi * bandwidth)),
        scope="sensor",
        fault=BANDWIDTH,
    ),
    Effect(
        "sensor_drift",
        "a displacement transducer that drifts",
        "m/s",
        _of_transducers(DRIFT),
        lambda _: 0.1,
        refuses=_no_displacement,
        family=FAMILY,
        source="linear in time from the record's zero",
        scope="sensor",
        fault=DRIFT,
    ),
)
