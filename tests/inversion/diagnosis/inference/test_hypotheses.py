"""Prior probabilities of the hypotheses."""

from __future__ import annotations

import pytest

from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect, by_family, family_of, hypotheses
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE


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
    assert sum(one.prior for one in hypotheses(found[:1])) == pytest.approx(1.0), "one effect makes no pair"


@pytest.mark.parametrize("sensors", [1, 4])
def test_a_family_is_as_likely_beforehand_with_many_sensors_as_with_one(sensors: int) -> None:
    found = [CandidateEffect("impact_speed", "impact_speed", "impact", ("shot",))]
    for name in ("sensor_gain", "time_offset"):
        found += [CandidateEffect(f"{name}.s{i}", name, "instrument", ("shot",)) for i in range(sensors)]
    models = hypotheses(found)
    families = by_family({one.label: one.prior for one in models}, models)
    assert families == pytest.approx({NONE: 0.5, "impact": 0.2, "instrument": 0.2, "pairs": 0.05, SOMETHING_ELSE: 0.05})


def test_an_effect_shares_its_prior_among_the_sets_of_nodes_that_it_may_have_alone() -> None:
    labels = ("edge_slip", "clamp_rotation", "clamp_rotation.left", "clamp_rotation.right")
    found = [CandidateEffect(n, n, family_of(n), ("shot",)) for n in labels]
    models = {one.label: one.prior for one in hypotheses(found)}
    clamp = [models[n] for n in labels[1:]]
    assert clamp == pytest.approx([models["edge_slip"] / 3.0] * 3)
    assert "clamp_rotation.left+clamp_rotation.right" not in models
    assert "edge_slip+clamp_rotation.right" in models
