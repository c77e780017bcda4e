"""Sections of shells: layers through the thickness, each with its weight and its law; and the metal of a plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.hardening import hardening_moduli
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import elastic_row

LAYERS = 5


@dataclass(frozen=True)
class ShellMaterial:
    """Elastic-plastic shell; SI. beta: 0 kinematic .. 1 isotropic hardening with Ep = E Et/(E - Et).

    rate_c [1/s], rate_p: Cowper-Symonds factor 1 + (plastic strain rate/C)^(1/P) on the yield stress, rate_c = 0 off;
    failure_strain: plastic strain at which a layer fails; an element goes with its last layer.
    """

    young: float
    poisson: float
    density: float
    yield_stress: float = np.inf
    tangent_modulus: float = 0.0
    beta: float = 1.0
    rate_c: float = 0.0
    rate_p: float = 1.0
    failure_strain: float = np.inf

    @property
    def elastic(self) -> tuple[float, float]:
        return self.young, self.poisson

    @property
    def hardening(self) -> tuple[float, float, float]:
        """Yield stress, isotropic and kinematic hardening modulus [Pa]."""
        return self.yield_stress, *hardening_moduli(self.young, self.tangent_modulus, self.beta)

    def row(self) -> Array:
        """Constants as the kernels read them, see `kernels.target.metal`."""
        first, isotropic, kinematic = self.hardening
        row = elastic_row(self.young, self.poisson)
        row[metal.KINEMATIC], row[metal.YIELD] = kinematic, first
        row[metal.RATE_C], row[metal.RATE_P] = self.rate_c, 1.0 / self.rate_p
        row[metal.FAILURE] = self.failure_strain
        row[metal.CONSTANTS : metal.CONSTANTS + 2] = first, isotropic
        return row


@dataclass(frozen=True)
class Section:
    """A metal shell of one thickness [m]: Gauss layers of one law.

    density: [kg/m^3]; row: of the law, see `kernels.target.metal`; layers (k, 2): heights and weights [m].
    """

    thickness: float
    density: float
    row: Array
    layers: Array = field(default_factory=lambda: np.empty((0, 2)))

    def __post_init__(self) -> None:
        if not len(self.layers):
            object.__setattr__(self, "layers", through_thickness(self.thickness))

    @property
    def young(self) -> float:
        """[Pa]."""
        return float(self.row[metal.YOUNG])

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        return float(self.row[metal.POISSON])

    @property
    def can_fail(self) -> bool:
        """Whether any strain ends it."""
        return can_fail(self.row)

    def elastic(self) -> Section:
        """The same without yielding."""
        return Section(self.thickness, self.density, elastic_row(self.young, self.poisson), self.layers)


def can_fail(row: Array) -> bool:
    """Whether any strain ends a metal of this row (`kernels.target.metal`)."""
    return bool(np.isfinite(row[metal.FAILURE]) or row[metal.DAMAGE] != metal.STRAIN_LIMIT)


def through_thickness(thickness: float, layers: int = LAYERS) -> Array:
    """Gauss heights and weights [m] of the layers, (layers, 2)."""
    points, weights = np.polynomial.legendre.leggauss(layers)
    return 0.5 * thickness * np.column_stack([points, weights])


class SectionTable:
    """Sections as the kernels read them.

    layers (s,): how many each has; first (s + 1,): where they begin; heights (l, 2), rows (l, ROW) of the layers;
    elastic (s, 3): thickness [m], E [Pa], nu; start (s,): flow stress at rest [Pa].
    """

    def __init__(self, sections: Sequence[Section]) -> None:
        self.layers = np.array([len(section.layers) for section in sections])
        self.first = np.concatenate([[0], np.cumsum(self.layers)]).astype(np.int64)
        self.heights = np.vstack([section.layers for section in sections])
        self.rows = np.vstack([np.tile(section.row, (len(section.layers), 1)) for section in sections])
        self.elastic = np.array([[section.thickness, section.young, section.poisson] for section in sections])
        self.start = np.array([metal.first_flow(section.row) for section in sections])
