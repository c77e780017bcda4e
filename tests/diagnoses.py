"""Diagnoses that are stated, for tests of what reads them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from birdstrike.inversion.results.diagnosis import Diagnosis, EffectFigures, ShotStates, State


def state(model: str = "none", **figures: Any) -> State:
    """Of a model, with these figures."""
    plain = {"rmse": {}, "weighted": 1.0, "raw": 1.0, "heldout": {}, "parameters": {}}
    return State(model, **(plain | figures))


def effect(name: str, magnitude: float | None = None, **figures: Any) -> EffectFigures:
    """Of an effect with this magnitude, and these figures."""
    plain = {
        "family": "",
        "meaning": "",
        "probability": 0.9,
        "prior": 0.1,
        "unit": "",
        "interval_95": None,
        "at_bound": False,
        "p_consistent": 1.0,
        "log_evidence": 0.0,
        "required_discrepancy": None,
        "twins": {},
        "absorbed": None,
        "bias": {},
        "plausible_size": None,
        "confirmed": False,
    }
    return EffectFigures(name, magnitude=magnitude, **(plain | figures))


def diagnosis(*effects: EffectFigures, **figures: Any) -> Diagnosis:
    """Of these effects, by default all in the set, and these figures; of one shot, without a baseline."""
    before, after = figures.get("before", state()), figures.get("after")
    plain: dict[str, Any] = {
        "alpha": 0.05,
        "alarm": 0.001,
        "verdict": "attributed",
        "confidence_set": tuple(one.name for one in effects),
        "probabilities": {one.name: one.probability for one in effects},
        "families": {},
        "required_discrepancy": {},
        "effects": effects,
        "before": before,
        "after": after,
        "minimum_detectable": {},
        "next_measurement": None,
        "pairs": (),
        "remainder": None,
        "noise": {"sensors": {}},
        "discrepancy": {},
        "nuisance": {},
        "baseline": None,
        "shots": (ShotStates("shot", "case", before, after),),
        "held_out": {},
        "case_after": None,
        "strikes": {},
        "warnings": (),
        "refused": {},
        "record": {"path": "shot", "simulated": False, "shots": ["shot"], "simulated_shots": []},
        "sentence": "Said of it",
    }
    return Diagnosis(**(plain | figures))


def written_diagnosis(folder: Path, *effects: EffectFigures, **figures: Any) -> Diagnosis:
    """The same, as diagnosis.json of a folder."""
    found = diagnosis(*effects, **figures)
    found.save(folder / "diagnosis.json")
    return found
