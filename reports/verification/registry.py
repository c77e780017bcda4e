"""The problems of the verification, in the order of the page."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable
from importlib import import_module

from birdstrike.data.errors import UserError
from birdstrike.reports.verification.problem import Problem

MODULES = (
    "planar",
    "lattice",
    "clamped_plate",
    "plate",
    "shell",
    "plasticity",
    "stagnation",
    "target",
    "energy_balance",
    "openradioss",
    "assembly",
    "joined",
    "parameter_sensitivity",
    "published",
    "bird_model",
)


def problems() -> dict[str, Problem]:
    """All, by name."""
    listed = [
        p for module in MODULES for p in import_module(f"birdstrike.reports.verification.problems.{module}").PROBLEMS
    ]
    return {problem.name: problem for problem in listed}


def chosen(patterns: Iterable[str]) -> list[Problem]:
    """Those whose name or family fits a pattern such as `plate_*`; all without one.

    Raises UserError for a pattern that fits none.
    """
    known, wanted = problems(), list(patterns)
    if not wanted:
        return list(known.values())
    fits = {
        pattern: [p for p in known.values() if any(fnmatch.fnmatch(text, pattern) for text in (p.name, p.family))]
        for pattern in wanted
    }
    idle = [pattern for pattern, found in fits.items() if not found]
    if idle:
        raise UserError(f'--only "{pattern}" fits no problem; known: {", ".join(known)}' for pattern in idle)
    return [p for p in known.values() if any(p in found for found in fits.values())]
