"""Prior probabilities of the hypotheses."""

from __future__ import annotations

import pytest

from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, family_of, hypotheses
from birdstrike.inversion.results.diagnosis import NONE


def test_priors_sum_to_one_and_families_share_alike() -> None:
    found = [
        CandidateEffect(n, n, f, ("shot",))
        for n, f in (("impact_speed", "impact"), ("plate_modulus", "plate"), ("plate_density", "plate"))
    ]
    models = hypotheses(found)
    assert sum(one.prior for one in models) == pytest.approx(1.0)
    prior = {one.label: one.prior for one in models}
    assert prior[NONE] == 0.5
    assert prior["impact_speed"] == pytest.approx(prior["plate_modulus"] + prior["plate_density"])


def test_an_effect_shares_its_prior_among_the_sets_of_nodes_that_it_may_have_alone() -> None:
    labels = ("edge_slip", "clamp_rotation", "clamp_rotation.left", "clamp_rotation.right")
    found = [CandidateEffect(n, n, family_of(n), ("shot",)) for n in labels]
    models = {one.label: one.prior for one in hypotheses(found)}
    clamp = [models[n] for n in labels[1:]]
    assert clamp == pytest.approx([models["edge_slip"] / 3.0] * 3)
    assert "clamp_rotation.left+clamp_rotation.right" not in models
    assert "edge_slip+clamp_rotation.right" in models
