"""Instrument effects as signatures on the model's own curve: clock, gain, bandwidth, drift; in common and per sensor.

reading(t) = gain lowpass[signal](t - time_offset) + drift t, as solver/sensors/instrument.py has it; what a fault
changes is known exactly, so that no simulation is needed. A fault stands beside what the case declares of the
instrument: gains multiply, offsets, time constants and drifts add.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.plan import INSTRUMENT
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.instrument import able, fault, time_constant, transducers
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.sensors.instrument import Instrument, delayed, low_pass

WIDEST = 10.0  # plausible sizes that are looked for: these signatures are exact
LARGEST_GAIN = 1.0  # that is looked for: twice the reading, as of a range set wrong; the least is a dead sensor's
AS_IT_IS = Instrument()  # reads the signal itself


@dataclass(frozen=True)
class InstrumentEffect:
    """One fault. sensors: those that it acts on; label: `sensor_gain` or `sensor_gain.displacement_centre`.

    least: smallest magnitude that means anything, in plausible sizes; -inf: none.
    """

    effect: Effect
    size: float
    sensors: tuple[str, ...]
    label: str
    least: float = -np.inf

    @property
    def one_sided(self) -> bool:
        """Whether 0 is the smallest magnitude."""
        return self.effect.name == "sensor_bandwidth"

    @property
    def limits(self) -> tuple[float, float]:
        """Plausible sizes between which it is looked for; a gain anywhere between a dead sensor's and twice its own."""
        if self.effect.name == "sensor_gain":
            return max(self.least, -LARGEST_GAIN / self.size), LARGEST_GAIN / self.size
        return max(self.least, -WIDEST), WIDEST

    @property
    def ends(self) -> bool:
        """Whether nothing can lie below the lower limit."""
        return self.limits[0] == self.least

    @property
    def bends(self) -> bool:
        """Whether what it changes is no multiple of its size: late and slow are alike to first order alone."""
        return self.effect.name in ("time_offset", "sensor_bandwidth")


def instrument_effects(case: Case, channels: Sequence[str]) -> tuple[InstrumentEffect, ...]:
    """Faults in common, then sensor by sensor where that is another fault than the common one."""
    found: list[InstrumentEffect] = []
    for name in INSTRUMENT:
        effect, alone = effects()[name], able(case, name, channels)
        common = alone if name == "time_offset" else tuple(c for c in _own(case, channels) if c in alone)
        size = effect.size(case)
        least = effect.least(case) / size
        if common:
            found.append(InstrumentEffect(effect, size, common, name, least))
        found += [InstrumentEffect(effect, size, (c,), f"{name}.{c}", least) for c in alone if common != (c,)]
    return tuple(found)


def _own(case: Case, channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(c for c in transducers(case) if c in channels)


def change(name: str, magnitude: float, time: Array, curve: Array, own: Instrument = AS_IT_IS) -> Array:
    """(m,) what a fault of a magnitude [SI] adds to a channel's curve (m,) on the clock `time` [s], exactly.

    own: the instrument through which the case reads the curve already. Where a record that is early needs what comes
    after the curve's end, the curve goes on straight.
    """
    if name == "sensor_drift":
        return magnitude * time
    signal = curve - own.drift * time
    if name == "sensor_gain":
        return magnitude * signal
    if name == "time_offset":
        beyond = np.maximum(time - magnitude - time[-1], 0.0)
        return delayed(time, signal, magnitude) + beyond * np.gradient(signal, time)[-1] - signal
    return _slower(magnitude, time, signal, own)


def _slower(magnitude: float, time: Array, signal: Array, own: Instrument) -> Array:
    """(m,) what a time constant [s] beside the instrument's own adds to a signal that has passed the latter.

    1/(1 + (a + b) s) = 1/(1 + a s) [a + b/(1 + (a + b) s)] / (a + b), so that no low-pass has to be undone.
    """
    if magnitude <= 0.0:
        return np.zeros_like(signal)
    whole = magnitude + time_constant(own)
    return magnitude / whole * (low_pass(time, signal, 1.0 / (2.0 * np.pi * whole)) - signal)


def with_faults(case: Case, faults: Iterable[tuple[str, str, float]]) -> Case:
    """The case with faults of single sensors beside what it declares: sensor, name of the effect, magnitude [SI].

    They are written beside the instruments without the case's effects, which act on top of them.
    """
    table: dict[str, Raw] = {}
    declared = case.with_effects({})
    for sensor, name, x in faults:
        table.setdefault(sensor, {}).update(fault(declared, name, x, sensor))
    return case.overlaid({"instrument": table}) if table else case


def signature(name: str, size: float, time: Array, curve: Array, h: float = 0.0, own: Instrument = AS_IT_IS) -> Array:
    """(m,) derivative of `change` with respect to the magnitude in plausible sizes [SI], where it is h of them.

    That of a low-pass by a central difference over one size, of which none is below 0.
    """
    if name == "time_offset":
        late = curve + change(name, h * size, time, curve, own)
        return -size * np.gradient(late - own.drift * time, time)
    if name == "sensor_bandwidth":
        low = max(h - 0.5, 0.0) * size
        return change(name, low + size, time, curve, own) - change(name, low, time, curve, own)
    return change(name, size, time, curve, own)
