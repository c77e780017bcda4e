"""Instrument effects as signatures on the model's own curve: clock, gain, bandwidth, drift; in common and per sensor.

reading(t) = (1 + gain) lowpass[signal](t - time_offset) + drift t, as solver/sensors/instrument.py has it; each
signature is the change for one plausible size, so that no simulation is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.plan import INSTRUMENT
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.instrument import transducers
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.sensors.instrument import low_pass

WIDEST = 10.0  # plausible sizes that are looked for: these signatures are exact


@dataclass(frozen=True)
class InstrumentEffect:
    """One fault. sensors: those that it acts on; label: `sensor_gain` or `sensor_gain.displacement_centre`."""

    effect: Effect
    size: float
    sensors: tuple[str, ...]
    label: str

    @property
    def one_sided(self) -> bool:
        """Whether 0 is the smallest magnitude."""
        return self.effect.name == "sensor_bandwidth"


def instrument_effects(case: Case, channels: Sequence[str]) -> tuple[InstrumentEffect, ...]:
    """Faults in common, then sensor by sensor where that is another fault than the common one."""
    found: list[InstrumentEffect] = []
    for name in INSTRUMENT:
        effect = effects()[name]
        common = tuple(channels) if name == "time_offset" else _own(case, channels)
        able = _able(name, case, channels)
        common = tuple(c for c in common if c in able)
        size = effect.size(case)
        if common:
            found.append(InstrumentEffect(effect, size, common, name))
        found += [InstrumentEffect(effect, size, (c,), f"{name}.{c}") for c in able if common != (c,)]
    return tuple(found)


def _own(case: Case, channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(c for c in transducers(case) if c in channels)


def _able(name: str, case: Case, channels: Sequence[str]) -> tuple[str, ...]:
    """Channels that a fault may act on.

    The library states a drift in m/s: of displacement sensors. No instrument reads the contact force, so that it has no
    bandwidth; a low-pass would only imitate how the layers of a particle lattice arrive one after another.
    """
    kinds = {channel: case.sensors[channel].kind for channel in channels}
    if name == "sensor_drift":
        return tuple(c for c in channels if kinds[c] == "displacement")
    return tuple(c for c in channels if name != "sensor_bandwidth" or kinds[c] != "contact_force")


def signature(name: str, size: float, time: Array, curve: Array) -> Array:
    """(m,) change of a channel's curve (m,) on the uniform clock `time` [s] by one plausible size [SI]."""
    if name == "sensor_gain":
        return size * curve
    if name == "sensor_drift":
        return size * time
    if name == "time_offset":
        return -size * np.gradient(curve, time)
    return low_pass(time, curve, 1.0 / (2.0 * np.pi * size)) - curve
