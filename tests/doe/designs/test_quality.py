"""Quality of a design: which effects it can separate, with the paper's Table 6 as the bad example."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.data.paths import REFERENCE
from birdstrike.doe.designs.quality import design_quality
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from tests.doe.stand_in import reference


def test_table_6_carries_one_direction_and_says_which() -> None:
    design = make_design(REFERENCE / "table6_design.csv", ParameterSpace.of(reference().parameters()))
    quality = design.quality()
    assert quality.rank == 1
    assert quality.deficient
    assert quality.max_correlation == pytest.approx(1.0, abs=1e-12)
    assert quality.condition == float("inf")
    correlations = np.corrcoef(design.values, rowvar=False)
    np.testing.assert_allclose(np.abs(correlations), 1.0, atol=1e-12)
    assert quality.sentence.startswith("rank 1 of 4: the 5 runs vary along 1 direction only")
    for name in ("pressure_cutoff", "viscosity", "tension_erosion", "compression_erosion"):
        assert name in quality.sentence
    written = json.loads(json.dumps(quality.as_json(), allow_nan=False))
    assert written["condition"] is None
    assert written["deficient"] is True


def test_the_direction_of_table_6_is_the_diagonal_over_the_ranges() -> None:
    quality = make_design(REFERENCE / "table6_design.csv", ParameterSpace.of(reference().parameters())).quality()
    step = np.array([-0.05 / 1.2, 0.1 / 1.5, 0.05 / 1.2, -0.05 / 1.2])  # per k, in fractions of the ranges
    step /= np.linalg.norm(step)
    for value, name in zip(step, ("pressure_cutoff", "viscosity", "tension", "compression"), strict=True):
        assert f"{value:+.2f} {name}" in quality.sentence


def test_a_table_rounded_to_four_figures_stays_deficient() -> None:
    k = np.arange(1, 26)[:, None]
    exact = np.hstack([k / 26.0, 1.0 - k / 26.0, 0.3 + k / 77.0])
    assert design_quality(np.round(exact, 4)).rank == 1


def test_a_free_design_is_of_full_rank_with_scipy_s_discrepancy() -> None:
    unit = qmc.LatinHypercube(4, rng=0).random(25)
    quality = design_quality(unit)
    assert quality.rank == 4
    assert not quality.deficient
    assert quality.discrepancy == qmc.discrepancy(unit, method="CD")
    singular = np.linalg.svd(unit - unit.mean(axis=0), compute_uv=False)
    assert quality.condition == pytest.approx(singular[0] / singular[-1])
    upper = np.abs(np.corrcoef(unit, rowvar=False))[np.triu_indices(4, 1)]
    assert quality.max_correlation == pytest.approx(upper.max())


def test_two_of_three_directions_are_named() -> None:
    x, y = np.meshgrid(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    quality = design_quality(np.column_stack([x.ravel(), y.ravel(), x.ravel()]), ["a.x", "a.y", "a.z"])
    assert quality.rank == 2
    assert "2 directions only (+0.71 x +0.71 z; +1.00 y;" in quality.sentence


def test_fewer_runs_than_parameters_cannot_be_of_full_rank() -> None:
    quality = design_quality(np.random.default_rng(0).random((3, 4)))
    assert quality.rank == 2
    assert quality.deficient


def test_a_parameter_that_does_not_vary_is_not_carried() -> None:
    unit = np.column_stack([np.linspace(0, 1, 9), np.full(9, 0.5)])
    quality = design_quality(unit, ["moves", "rests"])
    assert quality.rank == 1
    assert quality.max_correlation == 0.0
    assert "moves" in quality.sentence
    assert "rests" not in quality.sentence


def test_identical_runs_carry_nothing() -> None:
    quality = design_quality(np.full((5, 3), 0.3))
    assert quality.rank == 0
    assert "nothing can be estimated" in quality.sentence


def test_runs_outside_the_box_have_no_discrepancy() -> None:
    unit = qmc.LatinHypercube(2, rng=0).random(10)
    unit[0, 0] = 1.2
    assert design_quality(unit).discrepancy is None


def test_the_percentile_is_the_share_of_random_designs_that_are_lower() -> None:
    rng = np.random.default_rng(1)
    random = np.array([design_quality(rng.random((12, 2)), ranked=True).percentile for _ in range(200)], dtype=float)
    assert 40.0 < random.mean() < 60.0  # uniform on 0..100, mean 50, standard error 2
    centred = (2.0 * rng.permuted(np.tile(np.arange(12), (2, 1)), axis=1).T + 1.0) / 24.0
    assert 0.0 <= (design_quality(centred, ranked=True).percentile or 0.0) < 20.0  # one run in every stratum
    clustered = design_quality(0.1 * rng.random((12, 2)), ranked=True)
    assert clustered.percentile == clustered.wraparound_percentile == 100.0


def test_wrap_around_discrepancy_and_smallest_distance_are_scipy_s() -> None:
    unit = qmc.LatinHypercube(3, rng=2).random(9)
    quality = design_quality(unit)
    assert quality.wraparound == qmc.discrepancy(unit, method="WD")
    distances = np.linalg.norm(unit[:, None] - unit[None], axis=2)[np.triu_indices(9, 1)]
    assert quality.min_distance == pytest.approx(distances.min())
    assert quality.percentile is None
