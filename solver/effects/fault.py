"""What is wrong with an instrument: its settings in a case, and what that changes in a curve, exactly.

reading(t) = gain lowpass[signal](t - time_offset) + drift t, as `sensors.instrument` has it. A fault stands beside what
the case declares of the instrument: gains multiply, offsets, time constants and drifts add.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from birdstrike.data.histories import Array
from birdstrike.solver.sensors.instrument import Instrument

AS_IT_IS = Instrument()  # reads the signal itself


def added(declared: float, found: float) -> float:
    """Magnitude of one fault that does what two of its kind do, where they add."""
    return declared + found


@dataclass(frozen=True)
class Fault:
    """A fault of one instrument, by its magnitude x [SI].

    key, example: of `instrument.<sensor>`, what states it; settings: (declared instrument, x) -> its settings with the
    fault, none where it has none; adds: (x, time, signal, declared instrument) -> (m,) what it adds to a signal (m,)
    that the declared instrument has read, less the latter's drift; derivative: (fault, size, time, curve, h, declared
    instrument) -> (m,) of `change`, of a fault that is no multiple of its size; reads: whether it may act on a kind of
    sensor; common: whether one fault is that of all sensors; combined: the magnitude of two of its kind; largest:
    magnitude that is looked for at most, either way, None where plausible sizes say so.
    """

    key: str
    example: str
    settings: Callable[[Instrument, float], dict[str, Any]]
    adds: Callable[[float, Array, Array, Instrument], Array]
    derivative: Callable[[Fault, float, Array, Array, float, Instrument], Array] | None = None
    reads: Callable[[str], bool] = lambda _: True
    common: bool = False
    combined: Callable[[float, float], float] = added
    largest: float | None = None

    @property
    def bends(self) -> bool:
        """Whether what it changes is no multiple of its size beyond small sizes."""
        return self.derivative is not None

    def change(self, x: float, time: Array, curve: Array, own: Instrument = AS_IT_IS) -> Array:
        """(m,) what a magnitude x [SI] adds to a channel's curve (m,) on the clock `time` [s], exactly.

        own: the instrument through which the case reads the curve already.
        """
        return self.adds(x, time, curve - own.drift * time, own)

    def signature(self, size: float, time: Array, curve: Array, h: float = 0.0, own: Instrument = AS_IT_IS) -> Array:
        """(m,) derivative of `change` with respect to the magnitude in plausible sizes [SI], where it is h of them."""
        if self.derivative is None:
            return self.change(size, time, curve, own)
        return self.derivative(self, size, time, curve, h, own)
