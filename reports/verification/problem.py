"""A problem of the verification: what it simulates, and the rows, pictures and reasons that come out of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from birdstrike.data.histories import Array, Histories
from birdstrike.reports.verification.runs import RunSpec


@dataclass(frozen=True)
class Row:
    """One comparison.

    truth: what should come out, None where the figure itself is the error (a residual, an RMS difference); ours: our
    figure; both in `unit`. error: in `error_unit`; tolerance: its largest magnitude, None for a row that is shown
    without being judged. figure: file name of the picture that shows it, without its ending.
    """

    name: str
    truth: float | None
    ours: float
    unit: str
    error: float
    error_unit: str
    tolerance: float | None
    source: str
    note: str = ""
    figure: str = ""

    @property
    def verdict(self) -> str:
        """`within`, `beyond` or `shown`; an error that is not a number is beyond any tolerance."""
        if self.tolerance is None:
            return "shown"
        return "within" if abs(self.error) <= self.tolerance else "beyond"

    def as_json(self) -> dict[str, Any]:
        """The row with its verdict."""
        return vars(self) | {"verdict": self.verdict}


def matches(
    name: str,
    ours: float,
    truth: float,
    unit: str,
    tolerance: float | None,
    source: str,
    note: str = "",
    figure: str = "",
) -> Row:
    """Our figure against a truth, the error relative to it in %; tolerance in %."""
    error = 100.0 * (ours / truth - 1.0) if truth else math.nan
    return Row(name, truth, ours, unit, error, "%", tolerance, source, note, figure)


def near(
    name: str,
    ours: float,
    truth: float,
    unit: str,
    tolerance: float | None,
    source: str,
    note: str = "",
    figure: str = "",
) -> Row:
    """Our figure against a truth, the error being their difference."""
    return Row(name, truth, ours, unit, ours - truth, unit, tolerance, source, note, figure)


def below(
    name: str, ours: float, ceiling: float | None, unit: str, source: str, note: str = "", figure: str = ""
) -> Row:
    """A figure that is itself an error: at most `ceiling` in magnitude."""
    return Row(name, None, ours, unit, ours, unit, ceiling, source, note, figure)


def shown(name: str, ours: float, unit: str, source: str, note: str = "", figure: str = "") -> Row:
    """A figure without a truth of its own, for the reader."""
    return Row(name, None, ours, unit, math.nan, unit, None, source, note, figure)


@dataclass(frozen=True)
class Picture:
    """A figure with the caption that its numbers give; `name` is that of its file, without the ending."""

    name: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Reason:
    """Why a row beyond its tolerance may stand: what the experiment showed, and the picture that shows it."""

    text: str
    figure: str


@dataclass(frozen=True)
class Solution:
    """rows and pictures in the order of the page; reasons: a row's name, of whichever problem -> why it may stand."""

    rows: tuple[Row, ...]
    pictures: tuple[Picture, ...] = ()
    reasons: Mapping[str, Reason] = field(default_factory=dict)


def rms_of_peak(ours: Array, truth: Array) -> float:
    """Root of the mean squared difference, % of the truth's peak."""
    return 100.0 * float(np.sqrt(np.mean((ours - truth) ** 2)) / np.abs(truth).max())


Computed = Mapping[RunSpec, Histories]


@dataclass(frozen=True)
class Problem:
    """A truth or several of one kind, and how they are checked.

    name: as `--only` knows it; family: the table that its rows join; about: the paragraph above its figures; runs:
    simulations that `solve` is given, each computed once however many problems ask for it.
    """

    name: str
    family: str
    about: str
    solve: Callable[[Computed], Solution]
    runs: tuple[RunSpec, ...] = ()
