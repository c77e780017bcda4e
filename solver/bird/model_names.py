"""Names of bird models: MODEL or MODEL+LAW of any registered material and equation of state; LAW alone is null+LAW."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from birdstrike.data.nearest import did_you_mean
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS

LIKE = 0.8
"""Least likeness of a name to one that is suggested for it: a slip of the keyboard."""

FLUID = "null"
"""Material of a name that is a law's alone."""


def material_and_law(name: str) -> tuple[str, str]:
    """Registered names of the material and of its equation of state, "" for the usual one; raises ValueError."""
    model, _, law = name.partition("+")
    if not law and model in EQUATIONS_OF_STATE and model not in BIRD_MATERIALS:
        model, law = FLUID, model
    if model not in BIRD_MATERIALS or name.endswith("+") or (law and law not in EQUATIONS_OF_STATE):
        hint = did_you_mean(name, _names(), f"name {known_models()}", alike=LIKE, quote='"')
        raise ValueError(f"is no bird model; {hint}")
    if law and "eos" not in BIRD_MATERIALS[model].model_fields:
        raise ValueError(f"is no bird model: {model} has no equation of state of its own; name {model} alone")
    return model, law


def is_model(name: str) -> bool:
    """Whether a name is of a bird model."""
    try:
        material_and_law(name)
    except ValueError:
        return False
    return True


def usual_law(model: str) -> str:
    """Equation of state of a material's published constants; "" of one that has none."""
    eos = dict(BIRD_MATERIALS[model].literature).get("eos")
    return str(eos.get(EQUATIONS_OF_STATE.key) or "") if isinstance(eos, Mapping) else ""


def table_of(name: str) -> dict[str, Any]:
    """What a case's `bird.material` of this model names: its model and law; raises ValueError."""
    model, law = material_and_law(name)
    kind = law or usual_law(model)
    return {BIRD_MATERIALS.key: model} | ({"eos": {EQUATIONS_OF_STATE.key: kind}} if kind else {})


def known_models() -> str:
    """The names in words."""
    laws = ", ".join(EQUATIONS_OF_STATE)
    return f"{', '.join(BIRD_MATERIALS)}, or MODEL+LAW with one of {laws} (LAW alone means {FLUID}+LAW)"


def _names() -> list[str]:
    """All of them."""
    with_law = [model for model, kind in BIRD_MATERIALS.items() if "eos" in kind.model_fields]
    return [*BIRD_MATERIALS, *EQUATIONS_OF_STATE, *(f"{m}+{law}" for m in with_law for law in EQUATIONS_OF_STATE)]
