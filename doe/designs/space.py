"""The box in which a campaign looks: the parameters, their SI units and their ranges."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.case.case import Case, Parameter
from birdstrike.solver.case.remarks import example_parameter


@dataclass(frozen=True)
class ParameterSpace:
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
    def logarithmic(self) -> np.ndarray:
        """(k,) bool."""
        return np.array([scale == "logarithmic" for scale in self.scales or ("linear",) * len(self.names)])

    @property
    def middle(self) -> Array:
        """(k,) SI, of every range in its scale."""
        return self.to_physical(np.full(len(self.names), 0.5))

    def to_physical(self, unit: Array) -> Array:
        """(n, k) fractions of the ranges, each in its scale -> (n, k) SI values."""
        linear = self.lows + unit * (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        low, high = self._logarithms(self.lows), self._logarithms(self.highs)
        values = np.sign(self.lows) * np.exp(low + unit * (high - low))
        inside = np.clip(values, self.lows, self.highs)  # rounding of exp and log leaves no range
        return np.where(self.logarithmic, np.where((unit >= 0.0) & (unit <= 1.0), inside, values), linear)

    def to_unit(self, values: Array) -> Array:
        """(n, k) SI values -> (n, k) fractions of the ranges; outside 0..1 where a value lies outside its range."""
        linear = (values - self.lows) / (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        low, high = self._logarithms(self.lows), self._logarithms(self.highs)
        logarithmic = (self._logarithms(values) - low) / np.where(self.logarithmic, high - low, 1.0)
        return np.where(self.logarithmic, logarithmic, linear)

    def slopes(self, values: Array) -> Array:
        """(k,) by what fraction of each range `to_unit` grows per SI unit at values (k,)."""
        linear = 1.0 / (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        width = self._logarithms(self.highs) - self._logarithms(self.lows)
        return np.where(self.logarithmic, 1.0 / np.where(self.logarithmic, values * width, 1.0), linear)

    def _logarithms(self, values: Array) -> Array:
        """log |v| on the range's side of 0, of the smallest positive number beyond it; 0 in linear columns."""
        towards = np.where(self.logarithmic, np.maximum(values * np.sign(self.lows), np.finfo(float).tiny), 1.0)
        return np.log(towards)

    def outside(self, values: Array) -> np.ndarray:
        """(n, k) bool: beyond the range by more than rounding (1e-9 of the range's width)."""
        unit = self.to_unit(values)
        return (unit < -1e-9) | (unit > 1.0 + 1e-9)
