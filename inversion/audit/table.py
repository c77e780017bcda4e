"""The audit's table: every gate with its figure, the confusion matrix, power, robustness; written as JSON."""

from __future__ import annotations

import platform
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from data.files import write_json
from inversion.audit.gates import Gate, at_least, at_most, below, between, contains, rate, shown
from inversion.audit.planted import CLEAN, OUTSIDE, PAIR, SINGLE
from inversion.diagnosis.verdict import ATTRIBUTED, NONE
from solver.version import SOLVER_VERSION

if TYPE_CHECKING:
    from inversion.audit.audit import Score

STATED = "as stated"


def gates(scores: Sequence[Score], alpha: float) -> list[Gate]:
    """The table of gates for one set of scores."""
    clean, single = _of(scores, CLEAN), _of(scores, SINGLE)
    found = [
        contains("false-alarm rate on clean data", rate([1.0 - _draws(s).holds(NONE) for s in clean]), alpha),
        at_least("the truth is in the confidence set", rate([_draws(s).holds(_name(s)) for s in single]), 0.93),
        at_most("unique and wrong", rate([_draws(s).unique_other([_name(s)]) for s in single]), 0.05),
    ]
    found += [
        shown(f"unique, {words}", rate([_draws(s).unique_other([]) for s in _of(scores, kind)]))
        for kind, words in ((PAIR, "pairs (one alone counts as wrong)"), (OUTSIDE, "outside the library (wrong)"))
    ]
    for size, least in ((4.0, 0.75), (5.0, 0.95)):
        powers = [s.power[size] for s in single if size in s.power]
        found.append(at_least(f"power at signal {size:g}", rate(powers), least))
    lone = [_draws(s).unique(_name(s)) for s in single if s.lone and s.signals[_name(s)] >= 5.0]
    found.append(shown("attributed to it, effects without a twin, signal of 5 or more", rate(lone)))
    errors = [np.array([s.error[1] / s.error[0]]) for s in scores if s.error is not None]
    found.append(below("error after / before, held out, against the truth", rate(errors, middle=np.median), 0.5))
    inside = [values for s in single for key, values in s.covered.items() if key == "b"]
    theta = [values for s in scores for key, values in s.covered.items() if key != "b"]
    found.append(between("coverage of 95 % intervals: identified parameters", rate(theta), 0.90, 0.98))
    found.append(between("coverage of 95 % intervals: the effect's magnitude", rate(inside), 0.90, 0.98))
    picked = [_picked(s) for s in single]
    found.append(shown("coverage of the magnitude, where it was attributed", rate([one for one in picked if len(one)])))
    return found


def _of(scores: Sequence[Score], kind: str) -> list[Score]:
    return [s for s in scores if s.truth.kind == kind and (kind != SINGLE or len(s.signals) == 1)]


def _draws(score: Score):
    return score.draws[STATED]


def _name(score: Score) -> str:
    return next(iter(score.signals))


def _picked(score: Score) -> np.ndarray:
    """Coverage of the magnitude on the draws that attribute the miss to it."""
    values = score.covered.get("b")
    return np.empty(0) if values is None else values[_draws(score).unique(_name(score)) > 0.5]


def robustness(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """False alarms, truth in the set and unique-and-wrong under other noise than stated."""
    kinds = list(scores[0].draws) if scores else []
    figures: list[tuple[str, Callable[[Score, str], Any], str]] = [
        ("false alarms", lambda s, k: 1.0 - s.draws[k].holds(NONE), CLEAN),
        ("truth in the set", lambda s, k: s.draws[k].holds(_name(s)), SINGLE),
        ("unique and wrong", lambda s, k: s.draws[k].unique_other([_name(s)]), SINGLE),
    ]
    return [
        {"noise": kind, **{words: vars(rate([take(s, kind) for s in _of(scores, of)])) for words, take, of in figures}}
        for kind in kinds
    ]


def confusion(scores: Sequence[Score]) -> dict[str, dict[str, float]]:
    """Planted -> share of draws by answer: none, an effect alone, ambiguous with or without the truth, unexplained."""
    found: dict[str, dict[str, float]] = {}
    for s in scores:
        planted = _planted(s)
        counts = Counter(_answer(one, list(s.truth.effects)) for one in _draws(s).sets)
        row = found.setdefault(planted, {})
        for key, count in counts.items():
            row[key] = row.get(key, 0.0) + count
    return {name: {k: v / sum(row.values()) for k, v in row.items()} for name, row in sorted(found.items())}


def _planted(score: Score) -> str:
    effects = " + ".join(score.truth.effects)
    return effects or (score.truth.kind if score.truth.kind == CLEAN else f"outside: {score.truth.what}")


def _answer(one: tuple[str, ...], planted: list[str]) -> str:
    if NONE in one:
        return "none needed"
    if not one:
        return "unexplained"
    if len(one) == 1:
        return one[0]
    return "ambiguous, truth among them" if set(planted) & set(one) else "ambiguous, truth not among them"


def power_curve(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Power against signal, and the physical magnitude at which each effect reaches it on its curve."""
    found = []
    for s in _of(scores, SINGLE):
        name = _name(s)
        unit = s.truth.effects[name] / s.signals[name] if s.signals[name] else 0.0
        for size, rejected in s.power.items():
            found.append(
                {
                    "experiment": s.name,
                    "effect": name,
                    "signal": size,
                    "magnitude": size * unit,
                    "power": float(np.mean(rejected)),
                }
            )
    return found


def lines(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """One line an experiment."""
    return [
        {
            "experiment": s.name,
            "channels": list(s.channels),
            "kind": s.truth.kind,
            "planted": dict(s.truth.effects) or s.truth.what,
            "signals": s.signals,
            "verdict": s.blind[0],
            "confidence_set": list(s.blind[1]),
            "confirmed": None
            if s.confirmed is None
            else {"verdict": s.confirmed[0], "confidence_set": list(s.confirmed[1])},
            "in_set": float(np.mean(_draws(s).holds(next(iter(s.truth.effects), NONE)))),
            "none_in_set": float(np.mean(_draws(s).holds(NONE))),
            "attributed": float(np.mean([v == ATTRIBUTED for v in _draws(s).verdicts])),
            "covered": {key: float(np.mean(values)) for key, values in s.covered.items()},
            "error_before_after": s.error,
        }
        for s in scores
    ]


def write_audit(place: Path, scores: list[Score], alpha: float, draws: int, confirm: bool) -> dict[str, Any]:
    """`audit.json`, one table for each number of channels."""
    tables = {}
    for count in sorted({len(s.channels) for s in scores}):
        part = [s for s in scores if len(s.channels) == count]
        tables[f"{count} channel{'s' if count > 1 else ''}"] = {
            "curves": len(part),
            "gates": [gate.figures() for gate in gates(part, alpha)],
            "robustness": robustness(part),
            "confusion": confusion(part),
            "power": power_curve(part),
            "experiments": lines(part),
        }
    content = {
        "alpha": alpha,
        "draws": draws,
        "confirmed": confirm,
        "solver_version": SOLVER_VERSION,
        "machine": platform.platform(),
        "tables": tables,
    }
    write_json(place / "audit.json", content)
    return content
