"""The instrument behind a sensor: what a case says of it, how it changes a signal; and seeded noise on a record."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import field_validator

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.solver.fields import Between, Section, complaint
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.sensors.sensor import Sensor

LEAST_GAIN = 0.01  # of a sensor that is as good as dead
NO_DRIFT = 'fits no kind of sensor; write it per second, such as "1 mm/s" or "5 kN/s"'


class Instrument(Section):
    """What stands between the sensor and the record: reading(t) = gain * lowpass[signal](t - time_offset) + drift t.

    bandwidth [Hz]: of a first-order low-pass (-3 dB), absent: none; time_offset [s]: above 0 the record is late;
    drift: in the channel's SI unit per second, from the record's time 0.
    """

    time_offset: Annotated[float, Between("-10 ms", "10 ms")] = 0.0
    gain: Annotated[float, Between(LEAST_GAIN, 100.0)] = 1.0
    bandwidth: Annotated[float, Between("1 Hz", "1e9 Hz")] | None = None
    drift: float = 0.0

    @field_validator("drift", mode="before")
    @classmethod
    def _drift_of_some_kind(cls, value: Any) -> float:
        """Of any kind: a rule between the sections sees to it that it is that of the instrument's own sensor."""
        drift = drift_of_some_kind(value)
        if drift is None:
            raise complaint(NO_DRIFT)
        return drift


def drift_of_some_kind(value: Any) -> float | None:
    """The drift in SI, in the unit of the first kind of sensor that it fits; None where it fits none."""
    fitting = (kind.drift_range.valid(value) for kind in SENSORS.values())
    return next((drift for drift in fitting if drift is not None), None)


def recorded(instrument: Instrument | None, time: Array, signal: Array) -> Array:
    """gain * lowpass[signal](t - time_offset) + drift * t at the instants time [s]; without an instrument, the signal.

    Before the signal begins it is as at its beginning, at rest; beyond its end (an offset below 0) it keeps its last.
    """
    if instrument is None:
        return signal
    passed = signal if instrument.bandwidth is None else low_pass(time, signal, instrument.bandwidth)
    late = delayed(time, passed, instrument.time_offset) if instrument.time_offset else passed
    return instrument.gain * late + instrument.drift * time


def delayed(time: Array, signal: Array, offset: float) -> Array:
    """signal(t - offset) at the instants time [s]: before its beginning its first value, beyond its end its last."""
    return np.interp(time - offset, time, signal)


def low_pass(time: Array, signal: Array, bandwidth: float) -> Array:
    """First-order low-pass, tau y' + y = s with tau = 1/(2 pi bandwidth [Hz]), from rest at the signal's first value.

    Exact for a signal that is linear between its instants, of whatever spacing.
    """
    tau = 1.0 / (2.0 * math.pi * bandwidth)
    steps = np.diff(time) / tau
    decay = np.exp(-steps)
    mean_decay = -np.expm1(-steps) / steps
    passed = np.empty_like(signal)
    passed[0] = signal[0]
    driven = (mean_decay - decay) * signal[:-1] + (1.0 - mean_decay) * signal[1:]
    for i in range(len(steps)):
        passed[i + 1] = decay[i] * passed[i] + driven[i]
    return passed


def with_noise(histories: Histories, sensors: Mapping[str, Sensor], seed: int) -> Histories:
    """The histories with white Gaussian noise of each sensor's `noise` on every sample.

    The same seed gives the same noise; each sensor has its own stream, named by it, so that another sensor beside it
    changes nothing. Raises UserError when no sensor has a noise.
    """
    refuse_noiseless(sensors)
    noisy = {name: sensor.noise for name, sensor in sensors.items() if sensor.noise}
    channels = dict(histories.channels)
    for name, sigma in noisy.items():
        stream = np.random.default_rng([seed, zlib.crc32(name.encode())])
        channels[name] = channels[name] + sigma * stream.standard_normal(len(histories.time))
    return replace(histories, channels=channels)


def refuse_noiseless(sensors: Mapping[str, Sensor]) -> None:
    """Raise UserError when no sensor has a noise."""
    if not any(sensor.noise for sensor in sensors.values()):
        raise UserError('no sensor has noise; give one, such as sensors.displacement_centre.noise = "0.03 mm"')


def unrecorded(instruments: Mapping[str, Instrument], first_contact: float, end: float) -> list[str]:
    """Warnings about instruments whose record would need what happens after the end [s] of the run, or is over

    before first contact [s] reaches it.
    """
    early = [
        f"instrument.{name}.time_offset = {1e3 * own.time_offset:.3g} ms: the last {-1e3 * own.time_offset:.3g} ms of "
        "its record lie beyond time.end and repeat the last reading; lengthen time.end"
        for name, own in instruments.items()
        if own.time_offset < 0.0
    ]
    late = [
        f"instrument.{name}.time_offset = {1e3 * own.time_offset:.3g} ms: first contact, at {1e3 * first_contact:.3g} "
        f"ms, reaches its record after time.end = {1e3 * end:.3g} ms; the record stands at its value at rest and is no "
        "measurement of the impact: microseconds, or a later time.end?"
        for name, own in instruments.items()
        if own.time_offset > 0.0 and first_contact + own.time_offset >= end
    ]
    return early + late
