"""The box in which a campaign looks: the parameters, their SI units and their ranges."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from data.errors import UserError
from data.histories import Array
from solver.case import Case, Parameter
from solver.case_remarks import example_parameter


@dataclass(frozen=True)
class ParameterSpace:
    """k parameters by dotted case key; units: SI unit of each; lows, highs: (k,) SI, the case's ranges."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    lows: Array
    highs: Array

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
        )

    @classmethod
    def of_case(cls, case: Case) -> ParameterSpace:
        """The box that a case names; UserError when it names none, with an example of its own model."""
        return cls.of(case.parameters(), example_parameter(case))

    def to_physical(self, unit: Array) -> Array:
        """(n, k) fractions of the ranges -> (n, k) SI values."""
        return self.lows + unit * (self.highs - self.lows)

    def to_unit(self, values: Array) -> Array:
        """(n, k) SI values -> (n, k) fractions of the ranges; outside 0..1 where a value lies outside its range."""
        return (values - self.lows) / (self.highs - self.lows)

    def outside(self, values: Array) -> np.ndarray:
        """(n, k) bool: beyond the range by more than rounding (1e-9 of the range's width)."""
        unit = self.to_unit(values)
        return (unit < -1e-9) | (unit > 1.0 + 1e-9)
