"""Result of one simulation: sensor histories on a common clock, its energy balance, and a few snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Snapshot:
    """The simulation at one instant, for pictures and ParaView.

    time: [s]; particles: (n, 3) positions [m]; pressure: (n,) [Pa]; velocity: (n, 3) [m/s];
    eroded: (n,) bool; bird_stress: (n,) von Mises [Pa];
    cells: (k, 8) node numbers of the bird's hexahedra, none when it is of particles;
    nodes: (m, 3) current positions of the shell nodes [m]; quads: (e, 4) node numbers of those not torn;
    plate_stress: (e,) largest von Mises stress through the thickness [Pa].
    """

    time: float
    particles: Array
    pressure: Array
    velocity: Array
    eroded: NDArray[np.bool_]
    bird_stress: Array
    cells: NDArray[np.int64]
    nodes: Array
    quads: NDArray[np.int64]
    plate_stress: Array


@dataclass(frozen=True)
class Histories:
    """Histories of one simulation.

    time: (n,) [s], uniform; channels: sensor name -> (n,) in SI; units: sensor name -> SI unit ("m", "N", "");
    summary: the run's energies and figures, the content of `summary.json`; snapshots: in order of time.
    """

    time: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    summary: Mapping[str, Any] = field(default_factory=dict)
    snapshots: tuple[Snapshot, ...] = ()

    def at(self, channel: str, times: Array) -> Array:
        """Linear interpolation of one channel at `times` [s]; before the first and after the last sample: NaN."""
        return np.interp(times, self.time, self.channels[channel], left=np.nan, right=np.nan)
