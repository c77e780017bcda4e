"""A comparison of bird models carried to another speed: the truth lies in the bands of the models that may be best."""

from __future__ import annotations

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from birdstrike.data.errors import UserError
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.candidates import calibrated_case, candidate
from birdstrike.inversion.models.results import ModelComparison, read_comparison
from birdstrike.inversion.models.warning_summary import summarised, warnings_of
from birdstrike.inversion.prediction.from_models import read_models
from birdstrike.inversion.prediction.predict import PredictOptions, predict
from birdstrike.inversion.prediction.reading import read_learnt
from tests.inversion.models import rig


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("models")
    cases, records = rig.shots()
    with rig.formula_for_solver():
        calibrate_models(cases, records, place, ("murnaghan",), runs=12, workers=1)
    return place


def test_the_bands_between_two_learnt_speeds_hold_the_truth(folder: Path, tmp_path: Path) -> None:
    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", rig.strike)
        patch.setattr("birdstrike.doe.campaign.simulations.process_pool", ThreadPoolExecutor)
        found = predict(rig.shot(80.0), folder, tmp_path / "out", PredictOptions(budget=12, workers=1))
    assert found.extrapolation == ()
    assert [one.name for one in found.explanations] == ["murnaghan"]
    truth = rig.strike(calibrated_case(candidate("murnaghan"), rig.shot(80.0)).with_values(rig.TRUTH))
    for name, band in found.bands.items():
        low, high = band.quantiles["q025"], band.quantiles["q975"]
        inside = (truth.channels[name] >= low - 1e-12) & (truth.channels[name] <= high + 1e-12)
        assert inside.mean() > 0.9, name
        assert np.ptp([low.max(), high.max()]) < 0.1 * truth.channels[name].max()


def test_a_model_s_own_folder_tells_of_this_model_alone(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    learnt = read_learnt(folder / "murnaghan")
    assert [(one.label, one.probability) for one in learnt.explanations] == [("murnaghan", 1.0)]
    assert any("the bird model murnaghan alone" in line for line in learnt.said)
    monkeypatch.chdir(folder / "murnaghan")
    assert read_learnt(Path()).explanations[0].label == "murnaghan"
    copy = shutil.copytree(folder, tmp_path / "copy")
    shutil.copytree(copy / "murnaghan", copy / "elastic")
    with pytest.raises(UserError, match=r"--only elastic: no explanation; .* elastic alone: --from .*copy.elastic"):
        predict(rig.shot(80.0), copy, tmp_path / "out", PredictOptions(only=("elastic",)))
    (copy / "murnaghan").rename(copy / "null")
    with pytest.raises(UserError, match=r'ranks no model "null" but murnaghan; .* --models murnaghan,null'):
        read_learnt(copy / "null")


def test_a_model_by_itself_that_misses_the_records_is_said_to(folder: Path, tmp_path: Path) -> None:
    """An elastic bird at 13 times the noise was "the bird model elastic alone (probability of being the best 0 %)"."""
    copy = shutil.copytree(folder, tmp_path / "copy")
    shutil.copytree(copy / "murnaghan", copy / "null")
    content = json.loads((copy / "models.json").read_text(encoding="utf-8"))
    missing = {"expected": 30.0, "expected_95": [29.0, 31.0], "probability_best": 0.0}
    content["models"]["null"] = content["models"]["murnaghan"] | missing
    content["ranking"].append("null")
    (copy / "models.json").write_text(json.dumps(content), encoding="utf-8")
    used = read_models(copy, "null")
    assert used.said[0] == (
        "the bird model null alone (held-out error 30.00 times the noise, probability of being the best 0 %)"
    )
    assert used.warnings[0] == (
        "null leaves 29 .. 31 times the noise (95 %) in what it was not calibrated to; the best model of models.json "
        "is murnaghan"
    )
    assert not any("leaves 29" in line for line in read_models(copy).warnings)


def test_models_that_are_not_used_are_not_warned_of(folder: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    content = json.loads((copy / "models.json").read_text(encoding="utf-8"))
    of_other = "bird.particles = 9 is too coarse: expect an error"
    content["models"]["null"] = content["models"]["murnaghan"] | {"warnings": [of_other], "probability_best": 0.0}
    content["models"]["murnaghan"]["warnings"] = ["its own"]
    content["warnings"] = ["of the comparison", *summarised({"murnaghan": ["its own"], "null": [of_other]})]
    (copy / "models.json").write_text(json.dumps(content), encoding="utf-8")
    assert read_models(copy).warnings == ("of the comparison", "murnaghan: its own")


def test_what_a_model_that_misses_doubts_does_not_double_the_warning_of_one_that_is_used(
    folder: Path, tmp_path: Path
) -> None:
    copy = shutil.copytree(folder, tmp_path / "copy")
    content = json.loads((copy / "models.json").read_text(encoding="utf-8"))
    late = "force lies beside the runs best when its clock is moved by +0.10 ms; a late or early trigger?"
    used = content["models"]["murnaghan"] | {"warnings": [late], "expected_95": [0.9, 1.1]}
    missing = used | {"expected_95": [29.0, 31.0], "probability_best": 0.0}
    content |= {"models": {"murnaghan": used, "null": missing}, "warnings": []}
    (copy / "models.json").write_text(json.dumps(content), encoding="utf-8")
    found = read_comparison(copy)
    assert found == ModelComparison.load(str(copy)) == ModelComparison.load(copy / "models.json")
    content["warnings"] = list(summarised(warnings_of(found.models, found.ranking)))
    (copy / "models.json").write_text(json.dumps(content), encoding="utf-8")
    assert read_models(copy).warnings == (f"beside the runs of murnaghan: {late}",)


def test_a_model_without_a_stored_sample_is_drawn_from_its_intervals(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "copy")
    (tmp_path / "copy" / "murnaghan" / "posterior.csv").unlink()
    learnt = read_models(tmp_path / "copy")
    answer = json.loads((folder / "models.json").read_text(encoding="utf-8"))["models"]["murnaghan"]
    draws = dict(zip(learnt.explanations[0].names, learnt.explanations[0].parameters.T, strict=True))
    for name, (low, high) in answer["ranges"].items():
        assert low <= draws[name].min() < draws[name].max() <= high
    assert any("murnaghan: no posterior is stored" in line for line in learnt.warnings)


def test_without_a_stored_sample_the_answer_speaks_of_none(folder: Path, tmp_path: Path) -> None:
    assert any("up to 2000 draws of murnaghan" in line for line in read_models(folder).said)
    shutil.copytree(folder, tmp_path / "copy")
    (tmp_path / "copy" / "murnaghan" / "posterior.csv").unlink()
    said = read_models(tmp_path / "copy").said
    assert not any("2000 draws" in line for line in said)
    assert any("murnaghan: no posterior is stored" in line for line in said)


def test_the_time_origin_of_a_record_is_taken_off_the_model_s_error(folder: Path, tmp_path: Path) -> None:
    late_one = tmp_path / "late"
    shutil.copytree(folder, late_one)
    for path in (late_one / "records" / "shot_0.csv", late_one / "murnaghan" / "calibrated_shot_0.csv"):
        table = pd.read_csv(path, comment="#")
        table[table.columns[0]] += 5e-5 if table.columns[0] == "time_s" else 0.05  # ms
        path.write_text(table.to_csv(index=False), encoding="utf-8")
    (known, *_), (late, *_) = (read_models(place).shots for place in (folder, late_one))
    for sensor, error in known.errors.items():
        np.testing.assert_allclose(late.errors[sensor].times, error.times, atol=1e-9)
        np.testing.assert_allclose(
            late.errors[sensor].residual["murnaghan"], error.residual["murnaghan"], atol=1e-3 * error.peak
        )


def test_a_missing_run_of_a_model_is_named_with_the_remedy(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "copy")
    (tmp_path / "copy" / "murnaghan" / "calibrated_shot_1.csv").unlink()
    with pytest.raises(UserError, match=r"murnaghan/calibrated_shot_1\.csv is missing.*repeat calibrate-models"):
        read_models(tmp_path / "copy")


def test_a_damaged_comparison_is_refused_with_the_remedy(tmp_path: Path) -> None:
    (tmp_path / "models.json").write_text('{"models": ', encoding="utf-8")
    with pytest.raises(UserError, match="is damaged or of another version; repeat birdstrike calibrate-models"):
        read_models(tmp_path)
