"""A problem of the verification: what it runs, and the rows, pictures and reasons that come out of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from matplotlib.figure import Figure

from birdstrike.data.histories import Histories
from birdstrike.reports.verification.rows import Row
from birdstrike.reports.verification.shots import Shot


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
class Outcome:
    """rows and pictures in the order of the page; reasons: a row's name, of whichever problem -> why it may stand."""

    rows: tuple[Row, ...]
    pictures: tuple[Picture, ...] = ()
    reasons: Mapping[str, Reason] = field(default_factory=dict)


Strikes = Mapping[Shot, Histories]


@dataclass(frozen=True)
class Problem:
    """name: as `--only` knows it; family: the table that its rows join; shots: strikes that `solve` is given, each run
    once however many problems ask for it; about: the paragraph above its figures.
    """

    name: str
    family: str
    about: str
    solve: Callable[[Strikes], Outcome]
    shots: tuple[Shot, ...] = ()
