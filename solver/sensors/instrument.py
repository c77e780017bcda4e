"""The instrument behind a sensor: bandwidth, gain, time offset, drift; and seeded noise on what was recorded."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.solver.case.sensors import Instrument, Sensor


def recorded(instrument: Instrument | None, time: Array, signal: Array) -> Array:
    """gain * lowpass[signal](t - time_offset) + drift * t at the instants time [s]; without an instrument, the signal.

    Before the signal begins it is as at its beginning, at rest; beyond its end (an offset below 0) it keeps its last.
    """
    if instrument is None:
        return signal
    passed = signal if instrument.bandwidth is None else low_pass(time, signal, instrument.bandwidth)
    late = np.interp(time - instrument.time_offset, time, passed) if instrument.time_offset else passed
    return instrument.gain * late + instrument.drift * time


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


def unrecorded_ends(instruments: Mapping[str, Instrument]) -> list[str]:
    """Warnings about instruments so early that their record would need what happens after time.end."""
    return [
        f"instrument.{name}.time_offset = {1e3 * own.time_offset:.3g} ms: the last {-1e3 * own.time_offset:.3g} ms of "
        "its record lie beyond time.end and repeat the last reading; lengthen time.end"
        for name, own in instruments.items()
        if own.time_offset < 0.0
    ]
