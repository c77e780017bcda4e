"""Another shot predicted from a calibration: the truth lies in the bands, and the width has its known sources."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.data.storage.files import json_values
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.prediction.answer import Prediction
from birdstrike.inversion.prediction.from_inversion import CALIBRATED, read_inversion
from birdstrike.inversion.prediction.predict import PredictOptions, predict
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.case.write import case_toml
from tests.inversion.diagnosis.rig import as_solver, tiny
from tests.inversion.prediction import formula

FASTER = 95.0  # m/s


@pytest.fixture(scope="module")
def learnt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return formula.calibrated(tmp_path_factory.mktemp("learnt"))


def at(speed: float, **changes: Any) -> Case:
    return tiny().overlaid({"impact": {"speed": f"{speed} m/s"}, **changes})


def predicted(learnt: Path, out: Path, case: Case | None = None, **options: Any) -> Prediction:
    with formula.formula_for_solver():
        return predict(case or at(FASTER), learnt, out, PredictOptions(**{"budget": 16, "workers": 1, **options}))


@pytest.fixture(scope="module")
def found(learnt: Path, tmp_path_factory: pytest.TempPathFactory) -> Prediction:
    return predicted(learnt, tmp_path_factory.mktemp("found") / "out")


def width(one: Prediction) -> float:
    peak = one.peaks["displacement_centre"]
    return float(peak["q975"] - peak["q025"])


def test_the_true_deflection_at_another_speed_lies_in_the_95_percent_band(found: Prediction) -> None:
    truth = formula.deflection(formula.VISCOSITY, FASTER)
    band = found.bands["displacement_centre"]
    inside = (truth >= band.quantiles["q025"] - 1e-12) & (truth <= band.quantiles["q975"] + 1e-12)
    assert inside.mean() > 0.9
    peak = found.peaks["displacement_centre"]
    assert peak["q025"] < formula.largest(formula.VISCOSITY, FASTER) < peak["q975"]
    assert width(found) < 0.2 * formula.PEAK


def test_a_prediction_is_read_back_from_its_folder(learnt: Path, tmp_path: Path) -> None:
    made = predicted(learnt, tmp_path / "out", limits={"displacement_centre": "4 mm"})
    for place in (tmp_path / "out", str(tmp_path / "out" / "prediction.json")):
        again = Prediction.load(place)
        assert json_values(again.figures()) == json_values(made.figures())
        pd.testing.assert_frame_equal(again.to_dataframe(), made.to_dataframe(), rtol=1e-8)
        assert again.bands["displacement_side"].kind == "displacement"
    (tmp_path / "out" / "prediction.csv").unlink()
    with pytest.raises(UserError, match=r"prediction.json, or prediction.csv beside it, is missing, damaged"):
        Prediction.load(tmp_path / "out")


def test_what_the_simulations_warn_of_is_told(learnt: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """simulate and run-doe say that particles are too coarse; prediction.json was silent."""

    def coarse(case: Case) -> Histories:
        found = formula.strike(case)
        return replace(found, summary={**found.summary, "warnings": ["300 particles are too coarse"]})

    with formula.formula_for_solver():
        monkeypatch.setattr("birdstrike.doe.campaign.simulations.simulate", as_solver(coarse))
        made = predict(at(FASTER), learnt, tmp_path / "out", PredictOptions(budget=16, workers=1))
    assert made.warnings[-1] == "300 particles are too coarse (16 of 16 simulations)"


def test_shares_that_are_rounding_alone_are_0(found: Prediction) -> None:
    assert all(share == 0.0 or share > 1e-12 for one in found.sources.values() for share in one.values())


def test_what_lies_outside_the_learnt_range_stands_first(learnt: Path, found: Prediction, tmp_path: Path) -> None:
    assert "19 % above" in found.extrapolation[0]
    assert not found.perforation["modelled"]  # the case states no failure strain
    assert found.growth > 1.0
    predicted(learnt, tmp_path / "out")
    text = (tmp_path / "out" / "prediction.json").read_text(encoding="utf-8")
    assert list(json.loads(text))[1] == "extrapolation"  # after schema_version
    same = predicted(learnt, tmp_path / "same", tiny())
    assert same.extrapolation == ()
    assert same.growth == 1.0
    assert width(same) < width(found)


def test_a_stated_tolerance_of_the_speed_widens_the_band_by_its_own_variance(
    learnt: Path, found: Prediction, tmp_path: Path
) -> None:
    wide = predicted(learnt, tmp_path / "out", tolerances={"impact.speed": "4 m/s"})
    own = formula.largest(formula.VISCOSITY, FASTER) * 4.0 / FASTER  # the deflection is proportional to the speed
    expected = np.hypot(width(found) / 3.92, own)
    assert width(wide) / 3.92 == pytest.approx(expected, rel=0.15)
    assert (
        max(wide.sources["displacement_centre"], key=lambda s: wide.sources["displacement_centre"][s]) == "tolerances"
    )
    assert sum(wide.sources["displacement_centre"].values()) == pytest.approx(1.0)
    assert "speed" in str(wide.narrowing[0]["sentence"])


def test_a_limit_at_the_median_is_exceeded_half_of_the_time(learnt: Path, found: Prediction, tmp_path: Path) -> None:
    middle = found.peaks["displacement_centre"]["q50"]
    limits = {"displacement_centre": f"{1e3 * middle} mm", "displacement_side": "9 mm"}
    again = predicted(learnt, tmp_path / "out", limits=limits)
    half = again.limits["displacement_centre"]
    assert half.probability == pytest.approx(0.5, abs=0.03)
    assert half.interval_95[0] < 0.5 < half.interval_95[1]
    never = again.limits["displacement_side"]
    assert never.probability == 0.0
    assert 0.0 < never.interval_95[1] < 0.05  # so many draws leave something open


def test_a_repeated_prediction_simulates_nothing_and_says_the_same(learnt: Path, tmp_path: Path) -> None:
    first = predicted(learnt, tmp_path / "out")
    kept = (tmp_path / "out" / "prediction.csv").read_bytes()
    again = predicted(learnt, tmp_path / "out")
    assert (first.campaign["paid"], again.campaign["paid"]) == (16, 0)
    assert (tmp_path / "out" / "prediction.csv").read_bytes() == kept
    assert again.peaks == first.peaks


def test_csv_has_the_sensors_columns_with_their_quantiles_in_order(learnt: Path, tmp_path: Path) -> None:
    predicted(learnt, tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "prediction.csv")
    ends = ("q025", "q25", "q50", "q75", "q975")
    names = [f"{sensor}_m_{end}" for sensor in ("displacement_centre", "displacement_side") for end in ends]
    assert list(table.columns) == ["time_s", *names]
    rows = table[names[:5]].to_numpy()
    assert (np.diff(rows, axis=1) >= 0.0).all()


def test_a_plate_that_tears_is_told_and_the_draws_themselves_make_the_bands(learnt: Path, tmp_path: Path) -> None:
    thin = predicted(learnt, tmp_path / "out", at(FASTER, plate={"thickness": "2.5 mm"}))
    assert thin.perforation["probability"] == 1.0
    assert thin.perforation["modelled"]
    assert set(thin.campaign["method"].values()) == {"draws"}
    assert any("thickness" in line for line in thin.extrapolation)
    assert any("tears" in line for line in thin.warnings)


def test_another_structure_has_an_error_that_no_record_tells(learnt: Path, found: Prediction, tmp_path: Path) -> None:
    other = predicted(learnt, tmp_path / "out", at(FASTER, plate={"width": "400 mm"}))
    assert other.correlation == 0.0
    assert other.extrapolation[0].startswith("the structure is another one (plate.width)")
    assert width(other) > width(found)


def test_without_a_stored_posterior_the_answer_says_what_took_its_place(learnt: Path, tmp_path: Path) -> None:
    shutil.copytree(learnt, tmp_path / "inversion")
    (tmp_path / "inversion" / "posterior.csv").unlink()
    bare = predicted(tmp_path / "inversion", tmp_path / "out")
    assert any("independent normal distributions" in line for line in bare.posterior)
    assert any("correlations are lost" in line for line in bare.warnings)


def test_the_residual_is_of_the_answer_that_is_drawn_from(learnt: Path, tmp_path: Path) -> None:
    """Draws are the emulator's; a network that verifies better has its curve at other parameters."""
    folder = tmp_path / "inversion"
    shutil.copytree(learnt, folder)
    content = json.loads((folder / "inversion.json").read_text(encoding="utf-8"))
    content["methods"]["network"] = content["methods"]["emulator"]
    content["best"] = "network"
    (folder / "inversion.json").write_text(json.dumps(content), encoding="utf-8")
    table = pd.read_csv(folder / "verification.csv")
    for column in [name for name in table if name.startswith("emulator_")]:
        table[column.replace("emulator", "network")] = table[column] + 1e-3
    table.to_csv(folder / "verification.csv", index=False)
    both, alone = read_inversion(folder), read_inversion(learnt)
    for name, one in both.shots[0].errors.items():
        np.testing.assert_array_equal(one.residual[CALIBRATED], alone.shots[0].errors[name].residual[CALIBRATED])
    (folder / "posterior.csv").unlink()
    rough = read_inversion(folder).shots[0].errors["displacement_centre"].residual[CALIBRATED]
    assert not np.allclose(rough, alone.shots[0].errors["displacement_centre"].residual[CALIBRATED])


def of_two_shots(learnt: Path, folder: Path, other: Case) -> Path:
    """A folder of train-and-invert as if a second shot of another case had read the same."""
    shutil.copytree(learnt, folder)
    content = json.loads((folder / "inversion.json").read_text(encoding="utf-8"))
    shot = {"path": "shot.csv", "time_offset": 0.0, "inside": True}
    content["shots"] = [
        shot | {"suffix": suffix, "case_hash": case_hash(case)} for suffix, case in (("", tiny()), ("@2", other))
    ]
    for key in ("points", "noise", "noise_source"):
        content["measured"][key] |= {f"{name}@2": own for name, own in content["measured"][key].items()}
    (folder / "inversion.json").write_text(json.dumps(content), encoding="utf-8")
    table = pd.read_csv(folder / "verification.csv")
    for column in [name for name in table if name.endswith("_m")]:
        table[f"{column.removesuffix('_m')}@2_m"] = table[column]
    table.to_csv(folder / "verification.csv", index=False)
    return folder


def test_a_shot_s_case_is_the_one_that_was_inverted_not_today_s_file(learnt: Path, tmp_path: Path) -> None:
    other, named = at(FASTER), tmp_path / "other.toml"
    folder = of_two_shots(learnt, tmp_path / "inversion", other)
    options = json.loads((folder / "options.json").read_text(encoding="utf-8"))
    (folder / "options.json").write_text(json.dumps(options | {"cases": [None, str(named)]}), encoding="utf-8")
    named.write_text(case_toml(at(40.0)), encoding="utf-8")  # edited since
    edited = read_inversion(folder)
    assert len(edited.shots) == 1
    assert "case of shot 2" in edited.warnings[0]
    assert "is gone or was edited" in edited.warnings[0]
    (folder / "case_2.toml").write_text(case_toml(other), encoding="utf-8")
    kept = read_inversion(folder)
    assert [shot.conditions["speed"] for shot in kept.shots] == [conditions(case)["speed"] for case in (tiny(), other)]
    assert not kept.warnings


def command(folder: Path, learnt: Path, *words: str) -> Result:
    (folder / "case.toml").write_text(case_toml(at(FASTER)), encoding="utf-8")
    given = ["--out", str(folder / "out"), "--budget", "16", "--workers", "1", *words]
    with formula.formula_for_solver():
        return CliRunner().invoke(
            app, ["predict", str(folder / "case.toml"), "--from", str(learnt), *given], env={"COLUMNS": "200"}
        )


def test_the_command_says_the_distance_first_and_writes_a_page(learnt: Path, tmp_path: Path) -> None:
    result = command(tmp_path, learnt, "--limit", "displacement_centre=4.75 mm", "--json")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("Outside what was learnt: normal speed")
    content = json.loads(result.stdout.splitlines()[-1])
    assert 0.0 < content["limits"]["displacement_centre"]["probability"] < 1.0
    html = (tmp_path / "out" / "prediction.html").read_text(encoding="utf-8")
    assert html.index("How far it goes beyond") < html.index("Limits and largest readings") < html.index("<svg")
    assert "Where the width comes from" in html


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--limit", "displacement_centre=8 kg"), "accepted units: m"),
        (("--limit", "displacement_centre=8"), "has no unit"),
        (("--limit", "strain_1=8 mm"), "has no such sensor; it has displacement_centre"),
        (("--limit", "displacement_centre"), "write --limit displacement_centre="),
        (("--tolerance", "impact.speed=1 mm"), "accepted units: m/s"),
        (("--tolerance", "bird.material.viscosity=10 Pa s"), "has calibrated it"),
        (("--budget", "3"), "--budget = 3 is outside 8 .. 2000; 40 is usual"),
        (("--budget", "1000000"), "--budget = 1000000 is outside 8 .. 2000"),
        (("--leave-behind", "clamp_rotation"), "no explanation holds it"),
        (("--only", "clamp_rotation"), "holds calibrated"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    learnt: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    result = command(tmp_path, learnt, *words)
    assert result.exit_code == 1
    assert said in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"seed": -1}, "--seed = -1 is below 0"),
        ({"workers": 0}, "--workers = 0 is below 1"),
        ({"workers": -1}, "--workers = -1 is below 1"),
        ({"budget": 16.5}, "--budget = 16.5 is no whole number"),
        ({"limits": {"displacement_centre": 8}}, '--limit displacement_centre="8": 8 has no unit'),
        ({"tolerances": {"impact.speed": 1.0}}, '--tolerance impact.speed="1.0": 1.0 has no unit'),
    ],
)
def test_options_from_python_are_refused_by_name(
    learnt: Path, tmp_path: Path, options: dict[str, Any], said: str
) -> None:
    with pytest.raises(UserError, match=said):
        predicted(learnt, tmp_path / "out", **options)


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is no such folder"):
        predict(tiny(), tmp_path / "none", tmp_path / "out")
    with pytest.raises(UserError, match="holds no results"):
        predict(tiny(), tmp_path, tmp_path / "out")


def test_a_case_without_any_learnt_sensor_is_refused(learnt: Path, tmp_path: Path) -> None:
    table = tiny().table | {"sensors": {"gauge": {"kind": "strain", "at": ["50 mm", "0 mm"]}}}
    with pytest.raises(UserError, match="none of the sensors"):
        predict(table, learnt, tmp_path / "out")
