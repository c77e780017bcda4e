"""What was answered: the confusion matrix, power by physical size, and a line for every experiment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from birdstrike.inversion.diagnosis.verdict import NONE

from birdstrike.inversion.audit.planted import CLEAN, OUTSIDE, PAIR, SINGLE
from birdstrike.inversion.audit.score import STATED, Score

ORDER = (CLEAN, SINGLE, PAIR, OUTSIDE)


def of_kind(scores: Sequence[Score], kind: str) -> list[Score]:
    """Scores of a kind; single effects only where the case can carry them."""
    return [s for s in scores if s.kind == kind and (kind != SINGLE or len(s.signals) == 1)]


def confusion(scores: Sequence[Score]) -> dict[str, dict[str, float]]:
    """Planted -> share of draws by answer: none, an effect alone, ambiguous with or without the truth, unexplained."""
    found: dict[str, dict[str, float]] = {}
    for s in sorted(scores, key=lambda one: (ORDER.index(one.kind), list(one.planted))):
        planted = _planted(s)
        draws = s.believed[STATED]
        counts = Counter(_answer(one, name, set(s.planted)) for one, name in zip(draws.sets, draws.named, strict=True))
        row = found.setdefault(planted, {})
        for key, count in counts.items():
            row[key] = row.get(key, 0.0) + count
    return {name: {k: v / sum(row.values()) for k, v in row.items()} for name, row in found.items()}


def _planted(score: Score) -> str:
    effects = " + ".join(score.planted)
    return effects or (score.kind if score.kind == CLEAN else f"outside: {score.what}")


def _answer(allowed: tuple[str, ...], named: str, planted: set[str]) -> str:
    if NONE in allowed:
        return "none needed"
    if not allowed:
        return "unexplained"
    return named or f"ambiguous, truth {'' if planted & set(allowed) else 'not '}among them"


def power_curve(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Power against signal, reached by the noise; in physical units, what would make it at the stated noise.

    magnitude: the planted size times the wanted over the planted signal, as if the curve answered in proportion; shown:
    |P_0 r| of the noise-free record at that noise.
    """
    return [
        {
            "experiment": s.name,
            "effect": s.effect,
            "planted": s.planted[s.effect],
            "planted_signal": s.signals[s.effect],
            "signal": one.signal,
            "shown": one.shown,
            "along": one.along,
            "noise": one.scale,
            "magnitude": one.signal / s.signals[s.effect] * s.planted[s.effect],
            "power": float(np.mean(one.rejected)),
        }
        for s in of_kind(scores, SINGLE)
        for one in s.power
    ]


def lines(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """One line an experiment."""
    return [_line(s) for s in scores]


def _line(s: Score) -> dict[str, Any]:
    draws = s.believed[STATED]
    return {
        "experiment": s.name,
        "channels": list(s.channels),
        "kind": s.kind,
        "planted": dict(s.planted) or s.what,
        "signals": dict(s.signals),
        "shown": s.shown,
        "verdict": s.blind.verdict,
        "confidence_set": list(s.blind.allowed),
        "struck": list(s.blind.struck),
        "strikes": s.blind.strikes,
        "in_set": float(np.mean(draws.holds(s.effect))),
        "none_in_set": float(np.mean(draws.holds(NONE))),
        "attributed": float(np.mean([one != "" for one in draws.named])),
        "unasked": s.unasked,
        "covered": {key: float(np.mean(values)) for key, values in s.covered.items()},
        "error_before_after": s.error,
    }
