"""The model-form discrepancy: its process in time, its amplitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sklearn.gaussian_process.kernels import Matern

from birdstrike.inversion.diagnosis.preparation.discrepancy import (
    Amplitudes,
    alike,
    beside_baselines,
    matern52,
    shape_of,
    started,
    unknown_or_stated,
)


def test_thinned_amplitudes_are_every_other_one_of_each_kind() -> None:
    nodes = {"displacement": np.arange(4.0), "strain": np.array([9.0]), "contact_force": np.arange(3.0)}
    found = Amplitudes(nodes, {kind: 0.0 * own for kind, own in nodes.items()}, {}, "test").thinned()
    assert found.combinations().tolist() == [[1.0, 9.0, 1.0], [3.0, 9.0, 1.0]]
    assert len(found.log_weights()) == 2


def test_of_some_kinds_the_kept_combinations_are_what_the_kept_ones_have_of_these_kinds() -> None:
    """A sensor held out of four kinds of which few combinations are kept: no other amplitudes, and none twice."""
    kinds = ("displacement", "strain", "contact_force", "acceleration")
    every = unknown_or_stated(kinds, {})
    kept = (0, 7, 300, 301, 1295)
    few = replace(every, kept=kept)
    for left in (("displacement", "strain", "acceleration"), ("contact_force",), kinds):
        own = few.only(set(left))
        expected = {tuple(row[[kinds.index(kind) for kind in left]]) for row in every.combinations()[list(kept)]}
        found = [tuple(row) for row in own.combinations()]
        assert len(found) == len(expected)
        assert set(found) == expected
        assert own.log_weights() == pytest.approx(np.full(len(found), -len(left) * np.log(6.0)))
    assert len(every.only({"strain"}).combinations()) == 6


def test_baselines_tell_of_the_sensors_that_they_show() -> None:
    """A kind that errs by more than 5 % in the baseline, or is not in it, stays as unknown as in a lone record."""
    kinds = ("displacement", "strain", "reaction_force")
    found = beside_baselines(kinds, {"displacement": 0.004, "strain": 0.08}, 1, {"reaction_force": 0.02})
    lone = unknown_or_stated(kinds, {"reaction_force": 0.02}, several=True)
    assert found.learnt == {"displacement"}
    assert found.fixed["displacement"] == pytest.approx(2.0 * np.sqrt(0.5) * 0.004)
    for kind in kinds[1:]:
        np.testing.assert_array_equal(found.nodes[kind], lone.nodes[kind])
        assert found.fixed[kind] == lone.fixed[kind]
    assert found.nodes["reaction_force"].tolist() == [0.02]
    for weights in found.log_prior.values():
        assert np.exp(weights).sum() == pytest.approx(1.0)
    assert "; strain unknown" in found.source
    assert "; reaction force stated in the case" in found.source


def test_discrepancy_starts_at_contact() -> None:
    t = np.linspace(0.0, 1e-3, 30)
    K = started(t, t, 1e-4, 2e-4)
    assert np.allclose(K[t <= 1e-4], 0.0)
    assert K[-1, -1] == pytest.approx(1.0, abs=1e-3)
    assert np.linalg.eigvalsh(K).min() > -1e-9


@pytest.mark.parametrize("length", [0.08, 0.2])
def test_a_process_gives_back_its_correlation_time(length: float) -> None:
    """300 draws of a Matern 5/2 process over a second; its length is known from their slopes to a tenth."""
    time: np.ndarray = np.linspace(0.0, 1.0, 401)
    covariance = Matern(length, nu=2.5)(time[:, None])
    draws = np.random.default_rng(0).multivariate_normal(np.zeros(401), covariance, 300, method="eigh")
    assert shape_of(draws, np.sin(np.pi * time), time).length == pytest.approx(length, rel=0.1)


def test_shots_with_the_same_identified_parameters_share_their_discrepancy() -> None:
    weight = np.array([0.0, 3.0])
    assert alike(np.array([0.0, 0.3]), np.array([1.0, 0.3]), weight) == pytest.approx(1.0)
    assert alike(np.array([0.0, 0.0]), np.array([0.0, 1.0]), weight) == pytest.approx(float(matern52(np.array(3.0))))
