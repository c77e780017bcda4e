"""Ranges of parameters, each in its scale: fractions 0..1 of them, and the values that these stand for."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array


class Ranges:
    """What has ranges lows..highs (k,) SI and scales, "linear" or "logarithmic" of each, linear where left out.

    A logarithmic range lies on one side of 0. Fractions are of the range in its scale.
    """

    lows: Array
    highs: Array
    scales: tuple[str, ...]

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """(k,) where the scale is the logarithm."""
        return np.array([scale == "logarithmic" for scale in self.scales or ("linear",) * len(self.lows)])

    def to_physical(self, unit: Array) -> Array:
        """(n, k) or (k,) fractions of the ranges -> SI values of the same shape."""
        linear = self.lows + unit * (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        low, high = self._logarithms(self.lows), self._logarithms(self.highs)
        values = np.sign(self.lows) * np.exp(low + unit * (high - low))
        inside = np.clip(values, self.lows, self.highs)  # rounding of exp and log leaves no range
        return np.where(self.logarithmic, np.where((unit >= 0.0) & (unit <= 1.0), inside, values), linear)

    def to_unit(self, values: Array) -> Array:
        """SI values (n, k) or (k,) -> fractions of the ranges; outside 0..1 where a value lies outside its range."""
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

    def outside(self, values: Array) -> NDArray[np.bool_]:
        """(n, k) beyond the range by more than rounding (1e-9 of the range's width)."""
        unit = self.to_unit(values)
        return (unit < -1e-9) | (unit > 1.0 + 1e-9)

    def _logarithms(self, values: Array) -> Array:
        """log |v| on the range's side of 0, of the smallest positive number beyond it; 0 in linear columns."""
        towards = np.where(self.logarithmic, np.maximum(values * np.sign(self.lows), np.finfo(float).tiny), 1.0)
        return np.log(towards)


def fraction(value: float, low: float, high: float, logarithmic: bool) -> float:
    """Place of one value on its range low..high in its scale, 0..1 inside."""
    if logarithmic:
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)
