"""A diagnosis carried to another shot: its explanations with their probabilities, and shots at several speeds."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.tree import load_tree
from birdstrike.inversion.diagnosis.discrepancy import unknown_or_stated
from birdstrike.inversion.diagnosis.system import Places, build
from tests.inversion.diagnosis.conftest import Laboratory
from tests.inversion.diagnosis.rig import few_simulations


def test_draws_of_each_model_have_the_mean_that_the_diagnosis_states(laboratory: Laboratory) -> None:
    ranking, (shot, *_) = laboratory.answered[0]
    told = load_tree(laboratory.folder / "out" / "model.npz")["posterior"]
    assert {one["label"] for one in told} == {*ranking.confidence_set, "none"}
    assert sum(one["share"] for one in told) == pytest.approx(1.0)
    space = shot.setup.plan.space
    for one in told:
        k = len(space.names)
        fit = ranking.fits.get(one["label"])
        if fit is None:
            continue
        mean, sd = fit.interval(shot.group, k)
        z = space.to_unit(one["parameters"])
        assert z.mean(axis=0) == pytest.approx(np.clip(mean, 0.0, 1.0), abs=0.3 * float(sd.max()) + 0.02)
        for member, sizes in zip(ranking.models[one["label"]].members, one["magnitudes"].T, strict=True):
            assert not member.one_sided or (sizes >= 0.0).all()


def test_the_draws_of_a_single_effect_have_its_magnitude_and_its_spread(laboratory: Laboratory) -> None:
    ranking, _ = laboratory.answered[0]
    labels = [name for name, fit in ranking.fits.items() if len(ranking.models[name].members) == 1]
    assert labels
    for label in labels:
        fit, model = ranking.fits[label], ranking.models[label]
        evidence = fit.evidence
        _, sizes, _ = fit.tester.draws(model, list(evidence.h), 2000, np.random.default_rng(0))
        sd = float(np.sqrt(evidence.h_cov[0, 0]))
        if model.members[0].one_sided and evidence.h[0] < 2.0 * sd:
            continue  # a magnitude cut at 0 has another mean than the Gaussian that is cut
        assert sizes.mean() == pytest.approx(float(evidence.h[0]), abs=0.35 * sd)
        assert sizes.std() == pytest.approx(sd, rel=0.35)


def test_a_diagnosis_is_carried_to_another_speed(laboratory: Laboratory) -> None:
    words = [
        "predict", str(laboratory.folder / "case.toml"), "--from", str(laboratory.folder / "out"),
        "--out", str(laboratory.folder / "predicted"), "--set", "impact.speed=90 m/s", "--budget", "8", "--json",
        "--workers", "1",
    ]  # fmt: skip
    with few_simulations():
        result = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
    content = json.loads((laboratory.folder / "predicted" / "prediction.json").read_text(encoding="utf-8"))
    credible = laboratory.content()["confidence_set"]
    assert [one["name"] for one in content["explanations"]] == credible[:2]  # eight simulations, four for each
    assert sum(one["probability"] for one in content["explanations"]) == pytest.approx(1.0)
    assert content["campaign"]["finer"] >= 2  # what was learnt stands for a finer mesh: so does the prediction
    assert "12 % above" in content["extrapolation"][0]
    for shares in content["sources"].values():
        assert sum(shares.values()) == pytest.approx(1.0)
        assert shares["discrepancy"] > 0.0


def test_the_model_error_of_two_speeds_is_one_process_since_each_shot_s_contact(laboratory: Laboratory) -> None:
    ranking, (shot, *_) = laboratory.answered[0]
    slow = shot.setup.plan.case.with_values({"impact.speed": 30.0})
    setup = replace(shot.setup, plan=replace(shot.setup.plan, case=slow, fine=slow))
    assert setup.plan.case.first_contact > shot.setup.plan.case.first_contact
    both = (shot, replace(shot, name="slow", setup=setup, group="slow"))
    places = Places({one.group: np.full(len(shot.setup.lows), 0.5) for one in both}, {})
    known = unknown_or_stated(["displacement"], {}, several=True)
    system = build(both, (), places, known, ranking.problem.shapes, ranking.problem.options)
    for block in system.blocks:
        np.testing.assert_allclose(block.U, block.U.T, atol=1e-9 * np.abs(block.U).max())
        assert np.linalg.eigvalsh(block.U).min() > -1e-6 * np.abs(block.U).max()
