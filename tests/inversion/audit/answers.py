"""Answers of a diagnosis as they are stored, made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

FAMILIES = {
    "clamp_rotation": "support",
    "plate_thickness": "plate",
    "impact_speed": "impact",
    "sensor_gain": "instrument",
}
TIME = np.linspace(0.0, 1e-3, 51)


def entry(name: str, probability: float, magnitude: float | None, half: float = 0.0) -> dict[str, Any]:
    interval = None if magnitude is None else [magnitude - half, magnitude + half]
    return {"name": name, "probability": probability, "magnitude": magnitude, "interval_95": interval}


def state(model: str, viscosity: float, half: float) -> dict[str, Any]:
    one = {"value": viscosity, "interval_95": [viscosity - half, viscosity + half], "unit": "Pa*s", "identified": True}
    return {"model": model, "parameters": {"bird.material.viscosity": one}}


def answer(
    probabilities: dict[str, float],
    verdict: str = "ambiguous",
    p: float = 0.01,
    credible: tuple[str, ...] = (),
    after: dict[str, Any] | None = None,
    channels: tuple[str, ...] = ("displacement_centre",),
    shots: int = 1,
    magnitudes: dict[str, tuple[float, float]] | None = None,
) -> dict[str, Any]:
    """probabilities: by model; magnitudes: value and half of the interval."""
    sizes = magnitudes or {}
    effects = [
        entry(name, value, *sizes.get(name, (None if name in ("none", "something_else") else 1.0, 0.5)))
        for name, value in sorted(probabilities.items(), key=lambda one: -one[1])
        if "+" not in name
    ]
    families: dict[str, float] = {}
    for name, value in probabilities.items():
        family = "pairs" if "+" in name else FAMILIES.get(name.split("@")[0].split(".")[0], name)
        families[family] = families.get(family, 0.0) + value
    found = {
        "alpha": 0.05,
        "alarm": p,
        "verdict": verdict,
        "confidence_set": list(credible),
        "probabilities": probabilities,
        "families": families,
        "effects": effects,
        "before": state("none", 400.0, 50.0),
        "after": after,
        "shots": [{"name": f"shot{i + 1}"} for i in range(shots)],
        "noise": {"sensors": {name: {} for name in channels}},
    }
    one = {"time": TIME.tolist(), "sigma": [2e-5] * len(TIME), "error": [2e-5] * len(TIME)}
    stated = {f"shot{i + 1}": dict.fromkeys(channels, one) for i in range(shots)}
    return {"diagnosis": found, "stated": stated}
