"""Instrument effects as signatures on the model's own curve: clock, gain, bandwidth, drift; in common and per sensor.

What a fault changes is known exactly (`solver.effects.fault`), so that no simulation is needed. It stands beside what
the case declares of the instrument.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.fault import AS_IT_IS, Fault
from birdstrike.solver.effects.instrument import GAIN, able, settings_with, transducers
from birdstrike.solver.effects.registry import effect_named, effects
from birdstrike.solver.sensors.instrument import LEAST_GAIN

WIDEST = 10.0  # plausible sizes that are looked for: these signatures are exact
ROUNDING = 1e-12  # of the least gain: what a product of gains may miss it by


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
    def fault(self) -> Fault:
        """What it does to one instrument."""
        assert self.effect.fault is not None, "an effect of the instruments has a fault"
        return self.effect.fault

    @property
    def one_sided(self) -> bool:
        """Whether 0 is the smallest magnitude."""
        return self.least == 0.0

    @property
    def limits(self) -> tuple[float, float]:
        """Plausible sizes between which it is looked for."""
        largest = WIDEST if self.fault.largest is None else self.fault.largest / self.size
        return max(self.least, -largest), largest

    @property
    def ends(self) -> bool:
        """Whether nothing can lie below the lower limit."""
        return self.limits[0] == self.least

    @property
    def bends(self) -> bool:
        """Whether what it changes is no multiple of its size: late and slow are alike to first order alone."""
        return self.fault.bends


def instrument_effects(case: Case, channels: Sequence[str]) -> tuple[InstrumentEffect, ...]:
    """Faults in common, then sensor by sensor where that is another fault than the common one."""
    found: list[InstrumentEffect] = []
    for name, effect in effects().items():
        if effect.fault is None:
            continue
        alone = able(case, effect.fault, channels)
        common = alone if effect.fault.common else tuple(c for c in _own(case, channels) if c in alone)
        acting = [(common, name)] if common else []
        acting += [((c,), f"{name}.{c}") for c in alone if common != (c,)]
        size = effect.size(case)
        found += [InstrumentEffect(effect, size, on, label, _least(case, effect, on) / size) for on, label in acting]
    return tuple(found)


def _least(case: Case, effect: Effect, sensors: Sequence[str]) -> float:
    """Smallest magnitude of a fault of some sensors [SI]: of a gain one with which a case can state all of theirs."""
    if effect.fault is not GAIN:
        return effect.least(case)
    smallest = min(case.instrument.get(sensor, AS_IT_IS).gain for sensor in sensors)
    return LEAST_GAIN * (1.0 + ROUNDING) / smallest - 1.0


def _own(case: Case, channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(c for c in transducers(case) if c in channels)


def with_faults(case: Case, faults: Iterable[tuple[str, str, float]]) -> Case:
    """The case with faults of single sensors beside what it declares: sensor, name of the effect, magnitude [SI].

    They are written beside the instruments without the case's effects, which act on top of them.
    """
    table: dict[str, Raw] = {}
    declared = case.with_effects({})
    for sensor, name, x in faults:
        table.setdefault(sensor, {}).update(settings_with(declared, fault_named(name), x, sensor))
    return case.overlaid({"instrument": table}) if table else case


def beside_declared(case: Case, name: str, magnitude: float) -> float:
    """Magnitude [SI] of an effect together with what the case declares of it.

    Only an instrument's can be there twice: what the case states of another effect is not looked for.
    """
    fault = effect_named(name).fault
    return magnitude if fault is None else fault.combined(case.effects.get(name, 0.0), magnitude)


def fault_named(name: str) -> Fault:
    """What the effect of that name does to one instrument; raises KeyError where it is no effect of the instruments."""
    fault = effects()[name].fault
    if fault is None:
        raise KeyError(name)
    return fault
