"""Where no noise is known: what the diagnosis says at stated tolerances, side by side."""

from __future__ import annotations

from typing import Any

from birdstrike.inversion.diagnosis.assemble import state
from birdstrike.inversion.diagnosis.choice import Choice, effect_order
from birdstrike.inversion.diagnosis.evidence import log_evidence, magnitude
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.verdict import NONE

TOLERANCES = (0.01, 0.005, 0.03)  # of the peak; the first gives the verdict


def tolerance_figures(tolerance: float, judge: Judge, models: dict[str, Judged], alpha: float) -> dict[str, Any]:
    """Verdict at a tolerance: fitted errors before and after, magnitudes of the confidence set, the likeliest first."""
    choice = Choice.of(models, alpha)
    members = [name for name in effect_order(models) if name in choice.allowed and name != NONE]
    return {
        "tolerance": tolerance,
        "verdict": choice.verdict,
        "confidence_set": list(choice.allowed),
        "unnamed": choice.unnamed,
        "chosen": choice.chosen.name if choice.chosen else None,
        "before": _errors(judge, models[NONE]),
        "after": _errors(judge, choice.chosen) if choice.chosen else None,
        "effects": [_effect(models[name], models[NONE]) for name in members],
    }


def _errors(judge: Judge, judged: Judged) -> dict[str, Any]:
    """rmse by sensor, SI; weighted and raw."""
    figures = state(judge, judged, {})
    return {"rmse": figures.rmse, "weighted": figures.weighted, "raw": figures.raw}


def _effect(judged: Judged, base: Judged) -> dict[str, Any]:
    """Magnitude with interval, SI; None as interval where a limit of the search holds it."""
    value, interval = magnitude(judged)
    return {
        "name": judged.name,
        "magnitude": value,
        "interval_95": interval,
        "unit": judged.fit.problem.model.known[judged.fit.own[0]].effect.unit,
        "p_consistent": judged.p,
        "log_evidence": log_evidence(judged.fit) - log_evidence(base.fit),
    }
