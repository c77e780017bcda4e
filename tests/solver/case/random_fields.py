"""Strategies of single values as a case writes them."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

Table = dict[str, Any]
Strategy = st.SearchStrategy


def quantity(low: float, high: float, unit: str) -> Strategy[str]:
    """A quantity as a case writes it, three digits, ends included."""
    return st.floats(low, high, allow_nan=False).map(lambda value: f"{value:.3g} {unit}".strip())


def number(low: float, high: float) -> Strategy[float]:
    """A dimensionless number, three digits."""
    return st.floats(low, high, allow_nan=False).map(lambda value: float(f"{value:.3g}"))


def off_or(active: Strategy[Any], off: Any) -> Strategy[Any]:
    """A feature that is absent as often as present."""
    return st.one_of(st.just(off), active)
