"""What could have been detected, on data simulated from the linear model itself."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.evidence import ModelTester
from birdstrike.inversion.diagnosis.hypotheses import NONE
from birdstrike.inversion.diagnosis.power import scatter_of_sizes
from tests.inversion.diagnosis.test_evidence import POINTS, known, models, system


@pytest.mark.parametrize("lattice_size", [0.0, 0.5])
def test_an_estimated_size_scatters_as_stated(lattice_size: float) -> None:
    """Generalised least squares of records without the effect, on lattices of their own: the sizes' scatter."""
    rng, s, draws = np.random.default_rng(3), system(0), 2000
    signature = s.columns[:, s.at["e1"].start]
    near = np.column_stack([s.columns[:, s.at["J"]], signature])
    lattice = lattice_size * near @ rng.standard_normal((3, 4)) / 2.0
    at = {**s.at, "lattice": slice(s.columns.shape[1], s.columns.shape[1] + 4)}
    tester = ModelTester(
        replace(s, columns=np.column_stack([s.columns, lattice]), at=at), known(np.array([1e-3])), unnamed=(1e-6,)
    )
    fit: Any = SimpleNamespace(system=tester.system, tester=tester, evidence=tester.model(models()[NONE]))
    (stated,) = scatter_of_sizes(fit, ["e1"])
    free = np.column_stack([s.columns[:, s.at["J"]], s.columns[:, s.at["nuisance"]]])
    C = np.eye(POINTS) + free @ free.T
    y = (
        free @ rng.standard_normal((free.shape[1], draws))
        + lattice @ rng.standard_normal((4, draws))
        + rng.standard_normal((POINTS, draws))
    )
    weight = np.linalg.solve(C, signature)
    assert np.std(weight @ y / (weight @ signature)) == pytest.approx(stated, rel=0.05)
