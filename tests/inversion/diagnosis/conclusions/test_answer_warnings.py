"""Warnings of an answer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis.conclusions.baseline import Baselines
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions, Pipeline
from birdstrike.inversion.diagnosis.preparation.discrepancy import STATED
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.solver.case.case import load_case
from tests.solver.target.test_mesh_file import table_with, written


def test_a_diagnosis_says_that_shells_of_a_file_are_not_refined(tmp_path: Path) -> None:
    case = load_case(table_with(written(tmp_path / "panel.inp")))
    space = ParameterSpace(("MU",), ("Pa s",), np.array([0.0]), np.array([1.0]), ("",))
    plan = SimpleNamespace(case=case, lattices=dict, space=space, prior=NormalPrior.of_ranges(1))
    setup = SimpleNamespace(plan=plan, left_out=(), lattice_moves={}, channels=(), learnt={})
    shot: Any = SimpleNamespace(name="a", setup=setup, nuisances={}, record=SimpleNamespace(warnings=()))
    pipeline: Any = Pipeline((shot,), Baselines(()), DiagnosisOptions(), None)  # pyright: ignore[reportArgumentType]
    fit = SimpleNamespace(interval=lambda *_: (np.array([0.5]), np.array([0.1])))
    problem = SimpleNamespace(known=SimpleNamespace(source=STATED))
    ranking: Any = SimpleNamespace(problem=problem, same_bird=None, fits={NONE: fit})
    decision: Any = SimpleNamespace(ranking=ranking, chosen=None, failed={}, fit_warnings=())
    (line,) = pipeline._warnings(decision)
    assert line.startswith("target.mesh = panel.inp: shells from a file are not refined")
