"""The box in which a campaign looks: the parameters, their SI units and their ranges."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from birdstrike.data.dataset import Dataset, Ranges
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.case.case import Case, Parameter
from birdstrike.solver.case.remarks import example_parameter


@dataclass(frozen=True)
class ParameterSpace(Ranges):
    """k parameters by dotted case key; units: SI unit of each; lows, highs: (k,) SI, the case's ranges.

    scales: "linear" or "logarithmic" of each, linear where left out; a logarithmic range lies on one side of 0.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    lows: Array
    highs: Array
    scales: tuple[str, ...] = ()

    @classmethod
    def of(cls, parameters: Iterable[Parameter], example: str = "") -> ParameterSpace:
        """The box of `case.parameters()`; UserError when the case names none, with an `example` of one."""
        listed = tuple(parameters)
        if not listed:
            raise UserError(
                "inversion.parameters is empty: a campaign needs at least one parameter with a range"
                + (f"; add e.g. {example}" if example else "")
            )
        return cls(
            tuple(p.name for p in listed),
            tuple(p.unit for p in listed),
            np.array([p.low for p in listed], dtype=float),
            np.array([p.high for p in listed], dtype=float),
            tuple(p.scale for p in listed),
        )

    @classmethod
    def of_case(cls, case: Case) -> ParameterSpace:
        """The box that a case names; UserError when it names none, with an example of its own model."""
        return cls.of(case.parameters(), example_parameter(case))

    @classmethod
    def of_dataset(cls, dataset: Dataset) -> ParameterSpace:
        """The box that a campaign's runs lie in."""
        return cls(dataset.names, dataset.units, dataset.lows, dataset.highs, dataset.scales)

    @property
    def middle(self) -> Array:
        """(k,) SI, of every range in its scale."""
        return self.to_physical(np.full(len(self.names), 0.5))
