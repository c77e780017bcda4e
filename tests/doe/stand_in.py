"""A cheap strike in the solver's place: a closed formula, a diary of what was run, and failures on demand."""

from __future__ import annotations

import math
import os
import time
from functools import partial
from pathlib import Path

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import Case, load_case

VERSION = "stand-in"
TIME = np.linspace(0.0, 3e-3, 31)


def strike(
    case: Case,
    *,
    step_factor: float = 1.0,
    threads: int | None = None,
    diary: Path | None = None,
    seconds: float = 0.0,
    breaks_above: float = math.inf,
    cured_by_step: bool = False,
    ends_not_finite: bool = False,
) -> Histories:
    """A pulse that all four parameters shape. Viscosities above `breaks_above` [Pa s] fail, or end in NaN.

    diary: a folder that gets one file per attempt begun and one per attempt ended; seconds: how long a strike takes.
    """
    material = case.bird.material
    name = f"{material.viscosity!r}-{step_factor}-{os.getpid()}-{time.monotonic_ns()}"
    _note(diary, f"begun-{name}")
    time.sleep(seconds)
    breaks = material.viscosity > breaks_above and not (cured_by_step and step_factor < 1.0)
    if breaks and not ends_not_finite:
        raise RunFailed(f"unstable at {material.viscosity:g} Pa s", "lower the viscosity")
    peak = 5e-3 * (1.0 - 1e-4 * material.viscosity) * (1.0 + 1e-8 * material.pressure_cutoff)
    pulse = peak * np.sin(np.pi * TIME / TIME[-1]) ** (1.0 + material.tension_erosion)
    force = np.where(breaks, np.nan, 1e7 * pulse * (1.0 + material.compression_erosion))
    _note(diary, f"ended-{name}")
    summary = {"eroded_mass_fraction": 0.1 if 0.9 < material.compression_erosion < 1.0 else 0.0, "threads": threads}
    return Histories(
        TIME,
        {"displacement_centre": pulse, "contact_force": force},
        {"displacement_centre": "m", "contact_force": "N"},
        summary,
    )


def _note(diary: Path | None, name: str) -> None:
    if diary is not None:
        diary.mkdir(parents=True, exist_ok=True)
        (diary / name).touch()


def attempts(diary: Path, event: str = "begun") -> list[tuple[str, float]]:
    """(viscosity's text, step factor) of every attempt begun or ended, in order of time."""
    notes = sorted(diary.glob(f"{event}-*"), key=lambda path: int(path.name.rsplit("-", 1)[1]))
    parts = [path.name.rsplit("-", 3) for path in notes]
    return [(head.split("-", 1)[1], float(factor)) for head, factor, _, _ in parts]


def pids(diary: Path) -> set[int]:
    """Processes that have begun an attempt."""
    return {int(path.name.rsplit("-", 2)[1]) for path in diary.glob("begun-*")}


def reference(**settings: str) -> Case:
    """The reference strike; settings: dotted keys with __ for the dots."""
    return load_case("reference_strike", {key.replace("__", "."): text for key, text in settings.items()})


def design(runs: int = 6, seed: int = 0, kind: str = "lhs") -> Design:
    """A cheap design over the reference strike's four parameters."""
    return make_design(kind, ParameterSpace.of(reference().parameters()), runs, seed)


def recording(into: list[RunCounts]) -> partial[None]:
    """A progress callback that keeps what it is told."""
    return partial(list.append, into)
