"""A comparison of bird models carried to another speed: the truth lies in the bands of the models that may be best."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.candidates import calibrated_case, candidate
from birdstrike.inversion.prediction.predict import PredictOptions, predict
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


def test_a_comparison_without_draws_is_refused_with_the_remedy(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "models.json").write_text((folder / "models.json").read_text(encoding="utf-8"), encoding="utf-8")
    assert json.loads((tmp_path / "models.json").read_text(encoding="utf-8"))["ranking"] == ["murnaghan"]
    with pytest.raises(UserError, match=r"no draws of murnaghan.*repeat calibrate-models"):
        predict(rig.shot(80.0), tmp_path, tmp_path / "out")
