"""What the page is told of one emulator: parameters, effects, records, presets, runs, and the emulator as arrays.

A view is a plain table, because a script reads it: all values are SI, each quantity with the unit and the factor in
which the page writes it. A kind of folder makes one or several views (see `kinds`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.formatting import plain, quantity, span
from birdstrike.data.histories import Array
from birdstrike.data.units import DISPLAY, from_si, of_reading
from birdstrike.reports.figures.quantities import symbol
from birdstrike.solver.case.effects import SHOWN

Table = dict[str, Any]

MOST_INSTANTS = 201  # of a campaign's run, as it is drawn
MOST_RUNS = 200  # whose curves are drawn


@dataclass(frozen=True)
class View:
    """One emulator with what is known of it.

    answers: what fits, a sentence a parameter, for the first screen; presets: named points; systems: emulators as
    arrays, one a case (see surrogate.weights and inversion.diagnosis.model_file); shots: each with its system and its
    record, if there is one; runs: the campaign's points and curves; clock: the slider of the time origin, None where
    the clocks are the same; case: how a command names the case.
    """

    title: str
    parameters: Sequence[Table]
    systems: Sequence[Table]
    shots: Sequence[Table]
    answers: Sequence[Table]
    case: str
    headline: str = ""
    effects: Sequence[Table] = ()
    presets: Sequence[Table] = ()
    runs: Table | None = None
    clock: Table | None = None
    warnings: Sequence[str] = ()

    def table(self) -> Table:
        """As the page reads it."""
        return dict(vars(self))


def unit_of(si: str) -> Table:
    """The unit in which the page writes a quantity, and how many of it are one SI unit."""
    return {"si": si, **_shown(si)}


def _shown(si: str) -> Table:
    shown = {**SHOWN, **DISPLAY}.get(si, si)
    return {"unit": shown, "factor": from_si(1.0, shown) if shown else 1.0}


def parameter(
    name: str,
    si: str,
    low: float,
    high: float,
    estimate: Mapping[str, Any] | None = None,
    *,
    logarithmic: bool = False,
    among: Iterable[str] = (),
) -> Table:
    """A slider; estimate: value, interval_95, identified, reason, where there is one; among: all parameters' keys."""
    found = estimate or {}
    return {
        "key": name,
        "label": plain(name, among),
        "symbol": symbol(name, among),
        **unit_of(si),
        "low": low,
        "high": high,
        "log": logarithmic,
        "value": found.get("value"),
        "interval": found.get("interval_95"),
        "identified": found.get("identified"),
    }


def answer(name: str, si: str, estimate: Mapping[str, Any], among: Iterable[str]) -> Table:
    """One line of the first screen: the parameter, what fits, and whether the record identifies it."""
    label, interval = plain(name, among), estimate.get("interval_95")
    if not estimate["identified"] or estimate.get("value") is None:
        reason = estimate.get("reason") or _wide(interval, si)
        return {"label": label, "identified": False, "text": "not identifiable from this record", "more": reason}
    ends = f"95 % interval {span(interval[0], interval[1], si)}" if interval else "no interval"
    return {"label": label, "identified": True, "text": quantity(estimate["value"], si), "more": ends}


def _wide(interval: tuple[float, float] | None, si: str) -> str:
    ends = span(interval[0], interval[1], si) if interval else ""
    return f"its 95 % interval {ends} is most of what was known before" if ends else ""


def record(times: Array, values: Array, sigma: Array, source: str, used: NDArray[np.bool_] | None = None) -> Table:
    """One channel of a record: instants [s], values and standard deviations of their noise, SI; gaps left out.

    used: (n,) True where the fit used a reading, None: everywhere; the others are drawn and not scored.
    """
    given = np.isfinite(values)
    scored = given if used is None else given & used
    rest = given & ~scored
    return {
        "time": times[scored],
        "values": values[scored],
        "sigma": sigma[scored],
        "source": source,
        "left_out": {"time": times[rest], "values": values[rest]},
    }


def channel(name: str, si: str, noise: float | None, measured: Table | None = None, label: str = "") -> Table:
    """One sensor of a shot; noise: its standard deviation where one is stated, SI."""
    shown = _shown(of_reading(si))
    return {"name": name, "label": label or plain(name), "si": si, **shown, "noise": noise, "record": measured}


def preset(name: str, theta: Sequence[float], effects: Mapping[str, float] | None = None, clock: float = 0.0) -> Table:
    """A named point: parameters SI, effects SI by label, time origin [s]."""
    return {"name": name, "theta": [float(v) for v in theta], "effects": dict(effects or {}), "clock": clock}


def runs(parameters: Array, time: Array, curves: Mapping[str, Array]) -> Table | None:
    """The campaign's points (n, k) SI and curves (of the first shot), thinned for a screen; None without points."""
    if not len(parameters):
        return None
    kept = np.unique(np.linspace(0, len(time) - 1, min(len(time), MOST_INSTANTS)).round().astype(int))
    few = {name: np.asarray(values[:MOST_RUNS, kept], dtype=np.float32) for name, values in curves.items()}
    return {"parameters": parameters[:MOST_RUNS], "time": time[kept], "curves": few, "shot": 0}
