"""A diagnosis carried to another shot: its explanations with their probabilities, and shots at several speeds."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.storage.tree import load_tree, save_tree
from birdstrike.inversion.diagnosis.conclusions.answer import curve_at
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester, draws
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.system import FAST, build
from birdstrike.inversion.diagnosis.preparation.discrepancy import OWN_SHARE, unknown_or_stated
from birdstrike.inversion.prediction.from_diagnosis import read_diagnosis
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
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
        mean, sd = fit.interval(shot.name, k)
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
        fitted = replace(fit.system, at={**fit.system.at, "lattice": slice(0, 0)})  # draws are of the fit alone
        tester = ModelTester(fitted, fit.tester.known, fit.places.h, fit.tester.scale, apart=ranking.problem.apart)
        evidence = tester.model(model, list(fit.evidence.h))
        _, sizes, _ = draws(fit.tester, evidence, 2000, np.random.default_rng(0))
        sd = float(np.sqrt(evidence.h_cov[0, 0]))
        if model.members[0].one_sided and evidence.h[0] < 2.0 * sd:
            continue  # a magnitude cut at 0 has another mean than the Gaussian that is cut
        assert sizes.mean() == pytest.approx(float(evidence.h[0]), abs=0.35 * sd)
        assert sizes.std() == pytest.approx(sd, rel=0.35)


def test_what_each_model_leaves_of_the_record_is_that_of_its_own_curve(laboratory: Laboratory) -> None:
    ranking, (shot, *_) = laboratory.answered[0]
    known = read_diagnosis(laboratory.folder / "out")
    assert not any("earlier version" in line for line in known.warnings)
    compared = 0
    for one in known.explanations:
        if one.label not in ranking.fits:
            continue
        left = shot.record.values - curve_at(ranking, one.label, shot)
        for i, trace in enumerate(shot.record.traces):
            own = known.shots[0].errors[trace.name].residual[one.label]
            assert len(own) == len(one.parameters)
            of = shot.record.channel == i
            assert own.mean(axis=0) == pytest.approx(
                left[of], abs=0.3 * float(own.std(axis=0).max()) + 1e-2 * trace.peak
            )
        compared += 1
    assert compared > 1


def test_residuals_that_an_earlier_version_did_not_store_are_told(laboratory: Laboratory, tmp_path: Path) -> None:
    old = tmp_path / "old"
    shutil.copytree(laboratory.folder / "out", old, ignore=shutil.ignore_patterns("runs"))
    model = load_tree(old / "model.npz")
    for one in model["posterior"]:
        del one["residuals"]
    save_tree(old / "model.npz", model)
    known, now = read_diagnosis(old), read_diagnosis(laboratory.folder / "out")
    chosen = laboratory.content()["after"]["model"]
    for name, error in known.shots[0].errors.items():
        assert set(error.residual) == {NONE, SOMETHING_ELSE, chosen}  # no other has another one's
        assert error.excess("none") == pytest.approx(now.shots[0].errors[name].excess("none"), rel=0.3)
    (told,) = (line for line in known.warnings if "earlier version" in line)
    assert "repeat the diagnose command" in told
    for one in known.explanations:
        assert one.label in told


def test_a_later_shot_has_its_own_peak_and_contact(laboratory: Laboratory, tmp_path: Path) -> None:
    out = tmp_path / "two"
    shutil.copytree(laboratory.folder / "out", out, ignore=shutil.ignore_patterns("runs"))
    model = load_tree(out / "model.npz")
    model["shots"].append({**model["shots"][0], "name": "slow"})
    model["conditions"].append(model["conditions"][0])
    model["contacts"].append(model["contacts"][0] + 1e-4)
    for one in model["posterior"]:
        one["residuals"].append(one["residuals"][0])
    save_tree(out / "model.npz", model)
    table = pd.read_csv(out / "diagnosis.csv")
    table["measured"] *= 0.5
    table.to_csv(out / "diagnosis_slow.csv", index=False)
    first, slow = read_diagnosis(out).shots
    for name, error in first.errors.items():
        assert slow.errors[name].peak == pytest.approx(0.5 * error.peak)
        np.testing.assert_allclose(slow.errors[name].times, error.times - 1e-4, atol=1e-9)


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
    both = (shot, replace(shot, name="slow", setup=setup))
    places = Places({one.name: np.full(len(shot.setup.lows), 0.5) for one in both}, {})
    known = unknown_or_stated(["displacement"], {}, several=True)
    system = build(both, (), places, known, ranking.problem.shapes, ranking.problem.options)
    for block in system.blocks:
        np.testing.assert_allclose(block.U, block.U.T, atol=1e-9 * np.abs(block.U).max())
        assert np.linalg.eigvalsh(block.U).min() > -1e-6 * np.abs(block.U).max()


def test_a_lone_record_may_ring_otherwise_than_the_model_in_every_direction(laboratory: Laboratory) -> None:
    """Shells and contact ring in another phase in every record: a smooth process alone would call that an effect."""
    ranking, (shot, *_) = laboratory.answered[0]
    places = Places({shot.name: np.full(len(shot.setup.lows), 0.5)}, {})
    known = unknown_or_stated(["displacement"], {})
    system = build((shot,), (), places, known, ranking.problem.shapes, ranking.problem.options)
    (block,) = system.blocks
    peak = min(trace.peak for trace in shot.record.traces)
    noise = np.sqrt(np.diag(shot.record.covariance()))[block.rows].max()
    assert np.linalg.eigvalsh(block.U).min() > 0.9 * OWN_SHARE * FAST * (peak / noise) ** 2
