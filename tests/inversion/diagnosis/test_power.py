"""What could have been detected, on data simulated from the linear model itself."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.evidence import ModelTester
from birdstrike.inversion.diagnosis.next_measurement import expected
from birdstrike.inversion.diagnosis.power import scatter_of_sizes
from birdstrike.inversion.results.diagnosis import NONE
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


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_sensor_that_would_tell_an_effect_from_none_is_worth_what_it_adds(size: float) -> None:
    """No effect loses nothing to one beside it, which has the Occam factor; an effect loses to none by its distance."""
    told = []
    for distance in (0.1, 1.0, 10.0, 100.0):
        found = expected(np.array([[1.0, 0.0], [0.0, distance]]), 1, np.array([size]), np.array([0.3]), none=0.6)
        absent = 1.0 / (1.0 + 1.0 / np.sqrt(1.0 + distance))
        there = 1.0 / (1.0 + np.exp(-0.5 * distance * size**2))
        assert found == pytest.approx((0.6 * absent + 0.3 * there) / 0.9)
        told.append(found)
    assert told == sorted(told)


def test_a_model_without_a_share_takes_no_part() -> None:
    gram = np.diag([1.0, 4.0, 9.0])
    sizes, weights = np.array([1.0, 1.0]), np.array([0.5, 0.5])
    apart = 0.5 / (1.0 + np.exp(-2.0)) + 0.5 / (1.0 + np.exp(-4.5))
    assert expected(gram, 1, sizes, weights) == pytest.approx(apart)
