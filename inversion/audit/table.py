"""The audit's table: every gate with its figure, robustness; written as JSON with every experiment's own lines."""

from __future__ import annotations

import platform
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from birdstrike.inversion.diagnosis.verdict import NONE

from birdstrike.data.files import write_json
from birdstrike.data.histories import Array
from birdstrike.inversion.audit.answers import confusion, lines, of_kind, power_curve
from birdstrike.inversion.audit.gates import Gate, at_least, at_most, below, between, contains, figures_of, rate, shown
from birdstrike.inversion.audit.planted import CLEAN, OUTSIDE, PAIR, SINGLE
from birdstrike.inversion.audit.score import STATED, Asked, Score
from birdstrike.solver.version import SOLVER_VERSION


def gates(scores: Sequence[Score], alpha: float) -> list[Gate]:
    """The table of gates for one set of scores."""
    return [*_answers(scores, alpha), *_powers(scores), *_intervals(scores)]


def _answers(scores: Sequence[Score], alpha: float) -> list[Gate]:
    """What is said of clean records, single effects, pairs and effects outside the library."""
    clean, single = of_kind(scores, CLEAN), of_kind(scores, SINGLE)
    others = ((PAIR, "pairs (one alone counts as wrong)"), (OUTSIDE, "outside the library (wrong)"))
    return [
        contains("false-alarm rate on clean data", rate([1.0 - _draws(s).holds(NONE) for s in clean]), alpha),
        at_least("the truth is in the confidence set", rate([_draws(s).holds(s.effect) for s in single]), 0.93),
        at_most("unique and wrong", rate([_draws(s).names_other([s.effect]) for s in single]), 0.05),
        *(
            shown(f"unique, {words}", rate([_draws(s).names_other([]) for s in of_kind(scores, kind)]))
            for kind, words in others
        ),
    ]


def _powers(scores: Sequence[Score]) -> list[Gate]:
    """Power at two signals, attribution, the error that remains."""
    single = of_kind(scores, SINGLE)
    found = []
    for size, least in ((4.0, 0.75), (5.0, 0.95)):
        powers = [one.rejected for s in single for one in s.power if one.signal == size]
        found.append(at_least(f"power at signal {size:g}", rate(powers), least))
    lone = [_draws(s).names(s.effect) for s in single if s.lone and s.signals[s.effect] >= 5.0]
    found.append(shown("attributed to it, effects without a twin, signal of 5 or more", rate(lone)))
    errors = [np.array([s.error[1] / s.error[0]]) for s in scores if s.error is not None]
    found.append(below("error after / before, held out, against the truth", figures_of(errors, middle=np.median), 0.5))
    return found


def _intervals(scores: Sequence[Score]) -> list[Gate]:
    """Coverage, over all draws and given that the effect was named."""
    single = of_kind(scores, SINGLE)
    inside = [values for s in single for key, values in s.covered.items() if key == "b"]
    theta = [values for s in scores for key, values in s.covered.items() if key != "b"]
    picked = [_picked(s) for s in single]
    return [
        between("coverage of 95 % intervals: identified parameters", rate(theta), 0.90, 0.98),
        between("coverage of 95 % intervals: the effect's magnitude", rate(inside), 0.90, 0.98),
        shown("coverage of the magnitude, where it was attributed", rate([one for one in picked if len(one)])),
    ]


def _draws(score: Score):
    return score.believed[STATED]


def _picked(score: Score) -> Array:
    """Coverage of the magnitude on the draws that attribute the miss to it."""
    values = score.covered.get("b")
    return np.empty(0) if values is None else values[_draws(score).names(score.effect) > 0.5]


def robustness(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """False alarms, truth in the set and unique-and-wrong under each kind of noise, believed and as it is read."""
    figures: list[tuple[str, Callable[[Score, Any], Any], str]] = [
        ("false alarms", lambda _, d: 1.0 - d.holds(NONE), CLEAN),
        ("truth in the set", lambda s, d: d.holds(s.effect), SINGLE),
        ("unique and wrong", lambda s, d: d.names_other([s.effect]), SINGLE),
    ]

    def rates(how: str, kind: str) -> dict[str, Any]:
        return {
            words: vars(rate([take(s, getattr(s, how)[kind]) for s in of_kind(scores, of)]))
            for words, take, of in figures
        }

    kinds = list(scores[0].believed) if scores else []
    return [{"noise": kind, "believed": rates("believed", kind), "as read": rates("read", kind)} for kind in kinds]


def write_audit(
    place: Path, planted: Sequence[Score], emulated: Sequence[Score], alpha: float, asked: Asked
) -> dict[str, Any]:
    """`audit.json`, one table for each number of channels."""
    tables = {}
    for count in sorted({len(s.channels) for s in planted}):
        part = [s for s in planted if len(s.channels) == count]
        made = [s for s in emulated if len(s.channels) == count]
        tables[f"{count} channel{'s' if count > 1 else ''}"] = {
            "curves": len(part),
            "gates": [gate.figures() for gate in gates(part, alpha)],
            "robustness": robustness(part),
            "emulator_made": {"curves": len(made), "gates": [gate.figures() for gate in gates(made, alpha)]},
            "confusion": confusion(part),
            "power": power_curve(part),
            "experiments": lines(part),
        }
    content = {
        "alpha": alpha,
        "draws": asked.draws,
        "read": asked.read,
        "confirmed": asked.confirm,
        "solver_version": SOLVER_VERSION,
        "machine": platform.platform(),
        "tables": tables,
    }
    write_json(place / "audit.json", content)
    return content
