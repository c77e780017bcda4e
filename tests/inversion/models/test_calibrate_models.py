"""Calibration and ranking of bird models: the generating one wins, and its bulk modulus is found."""

from __future__ import annotations

import json
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike import export
from birdstrike.cli.app import app
from birdstrike.data.curves import Measured, read_measured, write_measured
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.data.storage.out_folder import MARK
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.models.calibrate_models import _compared, _verdict, calibrate_models
from birdstrike.inversion.models.campaigns import ShotSetup, unlike_cases
from birdstrike.inversion.models.candidates import calibrated_case, candidate, candidates
from birdstrike.inversion.models.ranking import _order, bootstrap, ranked, shot_error
from birdstrike.inversion.models.results import ModelAnswer, ModelComparison, read_comparison
from birdstrike.inversion.prediction.from_models import read_models
from birdstrike.reports.explore.explore import explore
from birdstrike.reports.explore.kinds.registry import kind_of
from birdstrike.reports.figures.calibrated_models import heldout_figure
from birdstrike.reports.page.models import page, write_models_page
from birdstrike.reports.page.models import read_models as read_page
from birdstrike.reports.results.parts import find_parts
from birdstrike.reports.sections.curves import fitted_curve
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.write import case_toml
from tests.doe.external_case import oscillator
from tests.inversion.models import rig

NAMES = ("null", "murnaghan")
MORE = (*NAMES, "elastic")
RUNS = 12


@dataclass(frozen=True)
class Calibrated:
    """The folder, and what was found."""

    folder: Path
    found: ModelComparison
    content: dict[str, Any]


OFFSET, LIMIT = 3e-4, 2.4e-3
CENTRE, SIDE = "displacement_centre", "displacement_side"


def as_recorded(records: list[Measured]) -> list[Measured]:
    """Each record with its rest before, two points after the end of the simulations, and faults of its instruments.

    At rest the centre's sensor reads 0.3 mm; the side's ends at 2.4 mm, which clips the faster shot.
    """
    before, rng, found = 2e-5 * np.arange(-60, 0), np.random.default_rng(9), []
    for record in records:
        seen = {
            name: np.concatenate([rig.NOISE * rng.standard_normal(60), values, [0.0, 0.0]])
            for name, values in record.channels.items()
        }
        time = np.concatenate([before, record.time, [1.1e-3, 1.2e-3]])
        sigma = {name: np.full(len(time), rig.NOISE) for name in seen}
        seen = {CENTRE: seen[CENTRE] + OFFSET, SIDE: np.minimum(seen[SIDE], LIMIT)}
        found.append(replace(record, time=time, channels=seen, sigma=sigma))
    return found


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    folder = tmp_path_factory.mktemp("models")
    cases, records = rig.shots()
    with rig.formula_for_solver():
        found = calibrate_models(cases, as_recorded(records), folder, NAMES, runs=RUNS, workers=1, posterior=False)
    return Calibrated(folder, found, json.loads((folder / "models.json").read_text(encoding="utf-8")))


def test_the_generating_model_is_ranked_first(calibrated: Calibrated) -> None:
    assert calibrated.found.ranking[0] == "murnaghan"
    assert "null" not in calibrated.found.tied
    own = calibrated.found.models["murnaghan"]
    assert own.expected is not None
    assert 0.7 < own.expected < 1.4  # in units of the noise
    other = calibrated.found.models["null"]
    assert other.expected is not None
    assert other.expected > 3.0 * own.expected


def test_the_bulk_modulus_is_found_and_gamma_is_not(calibrated: Calibrated) -> None:
    own = calibrated.found.models["murnaghan"]
    bulk = own.combinations["bulk_modulus"]
    assert bulk.identified
    assert bulk.value == pytest.approx(420e6, rel=0.03)
    assert not own.parameters["bird.material.eos.g"].identified
    assert "g not identifiable from these records" in bulk.sentence
    viscosity = own.parameters["bird.material.viscosity"].interval_95
    assert viscosity is not None
    assert viscosity[0] < 300.0 < viscosity[1]


def test_what_holds_for_all_models_shots_and_channels_is_warned_of_once(calibrated: Calibrated) -> None:
    told = [line for line in calibrated.found.warnings if "time.end" in line]
    assert told == [
        "248 points of 4 channels outside the simulated time (0 .. 1 ms) are left out of the fit; raise time.end to "
        "use later ones"
    ]
    own = calibrated.content["models"]["null"]["warnings"]
    assert any(line.startswith("displacement side of shot_1: 60 points before and 2 after") for line in own)
    assert len(calibrated.found.warnings) < 8


def test_models_json_has_the_contract_s_keys(calibrated: Calibrated) -> None:
    content = calibrated.content
    assert {"schema_version", "models", "ranking", "per_shot", "tied"} <= set(content)
    own = content["models"]["murnaghan"]
    assert {"parameters", "combinations", "verified", "heldout", "probability_best", "strikes"} <= set(own)
    assert set(own["verified"]) == set(own["heldout"]) == set(content["per_shot"]) == {"shot_0", "shot_1"}
    assert set(own["verified"]["shot_0"]) == {"displacement_centre", "displacement_side"}
    assert {"value", "interval_95", "unit", "identified", "reason"} == set(own["parameters"]["bird.material.eos.B"])
    assert sum(model["probability_best"] for model in content["models"].values()) == pytest.approx(1.0, abs=0.01)


def test_no_shot_takes_more_than_forty_simulations(calibrated: Calibrated) -> None:
    for model in calibrated.content["models"].values():
        assert max(model["strikes_per_shot"].values()) <= 40 - (20 - RUNS)


def test_runs_are_added_while_the_emulator_errs_by_more_than_the_noise(tmp_path: Path) -> None:
    def rough(case: Case, **given: Any) -> Histories:
        run, bird = rig.strike(case, **given), case.bird.material.build(case.bird.actual_density)
        phase = 1e4 * bird.viscosity / 1500.0
        return replace(
            run,
            channels={name: y + 5.0 * rig.NOISE * np.sin(phase + 3e4 * rig.TIME) for name, y in run.channels.items()},
        )

    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.inversion.forward.simulate", rough)
        found = calibrate_models(*rig.shots("null", {}), tmp_path, ["null"], runs=RUNS, workers=1, posterior=False)
    assert set(found.models["null"].strikes.values()) == {RUNS + 15 + 3}  # three rounds; answer, held out, published


@pytest.mark.parametrize(("name", "kept"), [("plastic_kinematic", True), ("null", False)])
def test_eroding_runs_are_used_where_a_failure_strain_erodes(name: str, kept: bool, tmp_path: Path) -> None:
    case = calibrated_case(candidate(name), rig.shot(80.0))

    def eroding(case: Case, **_: Any) -> Histories:
        run = rig.strike(case)
        return replace(run, summary={"eroded_mass_fraction": 0.4})

    design = make_design("lhs", ParameterSpace.of_case(case), 6)
    with ThreadPoolExecutor(1) as pool:
        run_campaign(case, design, tmp_path, workers=1, simulate=eroding, executor=pool, say=lambda _: None)
    assert load_dataset(tmp_path).smooth.tolist() == [kept] * 6


def test_repeating_the_call_simulates_nothing(calibrated: Calibrated) -> None:
    cases, records = rig.shots()
    with rig.formula_for_solver():
        rig.CALLS.clear()
        again = calibrate_models(
            cases, as_recorded(records), calibrated.folder, NAMES, runs=RUNS, workers=1, posterior=False
        )
        turned = calibrate_models(
            cases[::-1], as_recorded(records)[::-1], calibrated.folder, NAMES, runs=RUNS, workers=1, posterior=False
        )
    assert not rig.CALLS
    assert again.as_json() == turned.as_json() == calibrated.found.as_json()


def test_records_of_one_file_name_are_told_apart_whatever_their_order(tmp_path: Path) -> None:
    """slow/record.csv and fast/record.csv were record_1 and record_2 as given, so that the other order was refused."""
    cases, records = rig.shots()
    named = [replace(one, path=f"{place}/record.csv") for one, place in zip(records, ("slow", "fast"), strict=True)]
    with rig.formula_for_solver():
        found = calibrate_models(cases, named, tmp_path, ["null"], runs=RUNS, workers=1, posterior=False)
        turned = calibrate_models(cases[::-1], named[::-1], tmp_path, ["null"], runs=RUNS, workers=1, posterior=False)
    assert found.speeds == {"record_1": 60.0, "record_2": 100.0}
    assert found.as_json() == turned.as_json()


def test_models_that_an_earlier_call_calibrated_are_kept_and_said_to_be_left_out(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    cases, records = rig.shots()

    def repeated(*names: str) -> ModelComparison:
        return calibrate_models(cases, as_recorded(records), folder, names, runs=RUNS, workers=1, posterior=False)

    with rig.formula_for_solver():
        rig.CALLS.clear()
        fewer = repeated("null")
        assert fewer.ranking == ("null",)
        assert fewer.warnings[0].startswith("murnaghan: calibrated in this folder by an earlier call and not ranked")
        assert "--models null,murnaghan:" in fewer.warnings[0]
        assert fewer.warnings[0] in json.loads((folder / "models.json").read_text(encoding="utf-8"))["warnings"]
        assert repeated(*NAMES).as_json() == calibrated.found.as_json()
    assert not rig.CALLS


def test_a_model_that_the_folder_holds_under_another_name_is_read_and_keeps_it(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    """It was calibrated again in a second folder, and --models with both names was advised, which is refused."""
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    cases, records = rig.shots()
    with rig.formula_for_solver():
        rig.CALLS.clear()
        found = calibrate_models(
            cases, as_recorded(records), folder, ["null", "null+murnaghan"], runs=RUNS, workers=1, posterior=False
        )
    assert not rig.CALLS
    assert not (folder / "null+murnaghan").exists()
    assert found.as_json() == calibrated.found.as_json()


def test_the_models_that_rank_all_are_named_so_that_the_command_takes_them(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    """null+grueneisen seeks another list than null, and so has an answer of its own; the two are one model."""
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    shutil.copytree(folder / "null", folder / "no_model_here")
    cases, records = rig.shots()
    with rig.formula_for_solver():
        found = calibrate_models(
            cases, as_recorded(records), folder, ["null+grueneisen"], runs=RUNS, workers=1, posterior=False
        )
    assert found.warnings[0].startswith("murnaghan: calibrated in this folder by an earlier call and not ranked")
    advised = re.findall(r"--models (\S+):", found.warnings[0])
    assert advised == ["null+grueneisen,murnaghan"]
    assert [one.name for one in candidates(advised[0].split(","))] == ["null+grueneisen", "murnaghan"]


def test_an_interrupted_call_with_other_records_leaves_no_ranking_of_the_earlier_ones(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    """The earlier models.json stood beside the later constants, and predict and explore took both."""
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    write_models_page(folder)
    (folder / MARK).write_text('{"command": "calibrate-models"}', encoding="utf-8")
    cases, records = rig.shots()
    louder = [replace(one, channels={name: 1.05 * y for name, y in one.channels.items()}) for one in records]

    def interrupted(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.inversion.models.heldout_fits.HeldOutFits.answers", interrupted)
        with pytest.raises(KeyboardInterrupt):
            calibrate_models(cases, louder, folder, NAMES, runs=RUNS, workers=1, posterior=False)
    assert not [path for path in (folder / "models.json", folder / "models.html") if path.exists()]
    assert not (folder / "null" / "answer.json").exists()  # the first model's, which was being replaced
    for read in (explore, read_models, partial(export, out=tmp_path / "bird.k")):
        with pytest.raises(UserError, match="make it, or resume what was interrupted"):
            read(folder)
    with rig.formula_for_solver():
        again = calibrate_models(cases, as_recorded(records), folder, NAMES, runs=RUNS, workers=1, posterior=False)
    assert again.ranking == calibrated.found.ranking


def test_an_interrupted_call_with_a_further_model_leaves_the_ranking_of_the_others(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    cases, records = rig.shots()

    def interrupted(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.inversion.models.heldout_fits.HeldOutFits.answers", interrupted)
        with pytest.raises(KeyboardInterrupt):
            calibrate_models(cases, as_recorded(records), folder, MORE, runs=RUNS, workers=1, posterior=False)
    assert json.loads((folder / "models.json").read_text(encoding="utf-8")) == calibrated.content


def test_a_refused_call_leaves_the_answer_of_the_folder(calibrated: Calibrated, tmp_path: Path) -> None:
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    cases, records = rig.shots()
    thicker = [case.overlaid({"plate": {"thickness": "7 mm"}}) for case in cases]
    with rig.formula_for_solver(), pytest.raises(UserError, match=r"plate\.thickness is .* there and 0\.007 here"):
        calibrate_models(thicker, as_recorded(records), folder, NAMES, runs=RUNS, workers=1, posterior=False)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_nothing_of_a_shot_that_a_later_call_does_not_name_is_left_beside_the_new_answer(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    """Records, curves and the page to play with of two shots stood beside the ranking by one."""
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    explore(folder)
    cases, records = rig.shots()
    with rig.formula_for_solver():
        calibrate_models(cases[0], records[0], folder, ["null"], runs=RUNS, workers=1, posterior=False)
    assert [path.name for path in (folder / "records").iterdir()] == ["shot_0.csv"]
    assert sorted(path.name for path in (folder / "null").glob("*d_*.csv")) == [
        "calibrated_shot_0.csv",
        "published_shot_0.csv",
    ]
    assert not (folder / "explore.html").exists()


def test_a_repeated_call_keeps_the_pages_of_its_answer(calibrated: Calibrated, tmp_path: Path) -> None:
    folder = shutil.copytree(calibrated.folder, tmp_path / "models")
    pages = [write_models_page(folder), explore(folder)]
    cases, records = rig.shots()
    with rig.formula_for_solver():
        calibrate_models(cases, as_recorded(records), folder, NAMES, runs=RUNS, workers=1, posterior=False)
    assert all(page.is_file() for page in pages)


def test_the_page_says_who_predicts_best_beside_published_constants(calibrated: Calibrated) -> None:
    page = write_models_page(calibrated.folder).read_text(encoding="utf-8")
    assert calibrated.found.sentence in page
    assert "7.98" in page  # the published gamma
    assert 'data-switch="published"' in page
    for caption, columns in (("Error of a prediction: root mean square", 3), ("Error of the simulation over noise", 5)):
        table = page[page.index(caption) :]
        assert table[: table.index("</thead>")].count("<th") == 1 + columns  # <thead>; however many shots
    assert set(re.findall(r"https?://[^\s\"'<>)]*", page)) == {"http://www.w3.org/2000/svg"}


def test_names_of_many_shots_do_not_run_into_one_another_below_the_figure() -> None:
    shots = {f"shot_{i}_of_the_rig, {60 + 10 * i} m/s": {"null": (1.0, (0.9, 1.1))} for i in range(7)}
    figure = heldout_figure(shots, ["null"])
    figure.canvas.draw()
    boxes = [label.get_window_extent() for label in figure.axes[0].get_xticklabels()]
    assert all(label.get_rotation() == 20.0 for label in figure.axes[0].get_xticklabels())
    assert all(box.x0 >= 0.0 and box.x1 <= figure.bbox.x1 for box in boxes)


def test_held_out_errors_stand_on_an_axis_of_plain_numbers() -> None:
    """ "3 x 10^0" was the only number beside errors of 2 to 3 times the noise."""
    figure = heldout_figure({"s70": {"null": (2.3, (2.0, 2.6)), "elastic": (12.0, (11.0, 13.0))}}, ["null", "elastic"])
    figure.canvas.draw()
    ticks = figure.axes[0].yaxis
    assert {"1", "2", "5", "10"} <= {label.get_text() for label in ticks.get_ticklabels()}
    assert not any(label.get_text() for label in ticks.get_ticklabels(minor=True))


def test_the_page_says_which_records_are_simulated(calibrated: Calibrated, tmp_path: Path) -> None:
    """A measured record beside a simulated one was labelled as simulated."""
    folder = tmp_path / "models"
    shutil.copytree(calibrated.folder, folder)
    first, *others = sorted((folder / "records").glob("*.csv"))
    for path, says in ((first, "# taken by a laser"), *((path, "# SIMULATED by a formula") for path in others)):
        rows = [row for row in path.read_text(encoding="utf-8").splitlines() if not row.startswith("#")]
        path.write_text("\n".join([says, *rows]) + "\n", encoding="utf-8")
    page = write_models_page(folder).read_text(encoding="utf-8")
    assert f"of {', '.join(path.stem for path in others)}" in page
    assert "Show in every figure (every curve but the measured records is simulated):" in page
    assert "record (measured)" in page
    assert "record (simulated)" in page
    content = {**calibrated.content, "simulated_shots": ["shot_1"]}
    (folder / "models.json").write_text(json.dumps(content), encoding="utf-8")
    cards = " ".join(export(folder, tmp_path / "bird.k").read_text(encoding="utf-8").replace("$", " ").split())
    assert "Records: shot_0.csv, shot_1.csv. The record of shot_1 is simulated, not measured." in cards
    found = replace(calibrated.found, simulated_shots=("shot_1",))
    assert found.provenance == "The record of shot_1 is simulated, not measured"


def test_the_page_to_play_with_has_a_view_for_each_model(calibrated: Calibrated) -> None:
    views = kind_of(calibrated.folder).read(calibrated.folder)
    assert [view.title for view in views] == ["Bird model murnaghan", "Bird model null"]
    modulus = next(one for one in views[0].parameters if one["key"].endswith(".B"))
    known = {"label": "B", "low": 5e6, "high": 1e9, "log": True, "si": "Pa", "unit": "MPa"}
    assert known.items() <= modulus.items()
    place, values = list(views[0].parameters).index(modulus), np.array(views[0].presets[0]["theta"])
    assert values[place] == pytest.approx(calibrated.found.models["murnaghan"].parameters[modulus["key"]].value)
    assert [one["name"] for one in views[0].presets] == ["calibrated", "published"]
    assert [shot["name"] for shot in views[0].shots] == ["shot_0, 60 m/s", "shot_1, 100 m/s"]
    assert explore(calibrated.folder).is_file()


def test_the_page_to_play_with_tells_the_misfit_of_a_record_whose_noise_the_case_states(tmp_path: Path) -> None:
    cases, records = rig.shots()
    stated = cases[0].overlaid({"sensors": {"displacement_centre": {"noise": "0.01 mm"}}})
    bare = replace(records[0], sigma={})
    with rig.formula_for_solver():
        calibrate_models(stated, bare, tmp_path, ["null"], runs=RUNS, workers=1, posterior=False)
    (view,) = kind_of(tmp_path).read(tmp_path)
    for sensor in view.shots[0]["channels"]:
        assert sensor["noise"] == stated.sensors[sensor["name"]].noise
        assert np.isfinite(sensor["record"]["sigma"]).all()


def test_what_was_used_of_each_record_stands_in_the_answer(calibrated: Calibrated) -> None:
    slow, fast = (calibrated.found.measured[shot] for shot in ("shot_0", "shot_1"))
    assert slow == read_comparison(calibrated.folder).measured["shot_0"]
    assert slow.points == {CENTRE: 26, SIDE: 26}
    assert slow.at_rest[CENTRE].value == pytest.approx(OFFSET, abs=5e-6)
    assert set(slow.at_rest) == {CENTRE}
    assert set(fast.cuts) == {SIDE}
    assert fast.points[SIDE] == 26 - len(fast.cut(SIDE, *fast.cuts[SIDE])) < 23


def test_no_reading_that_the_fit_left_out_is_an_error_of_the_models_in_a_prediction(calibrated: Calibrated) -> None:
    """A clipped peak was a model error of a tenth of the peak."""
    for shot in read_models(calibrated.folder).shots:
        for name, error in shot.errors.items():
            assert len(error.times) == calibrated.found.measured[shot.name].points[name]
            assert error.sigma == pytest.approx(rig.NOISE)
            assert np.sqrt(error.excess("murnaghan")) < 0.005


def test_the_page_draws_what_was_compared_and_what_was_left_out_apart(calibrated: Calibrated) -> None:
    """A record with a zero of its own lay beside every curve, and its clipped readings were drawn as a peak."""
    results = read_page(calibrated.folder)
    for shot, figures in results.found.measured.items():
        run, told = results.calibrated[shot]["murnaghan"], results.found.models["murnaghan"].verified[shot].rmse
        for name in (CENTRE, SIDE):
            curve = fitted_curve(results.records[shot], name, figures, "record")
            left = (curve.values - np.interp(curve.time, run.time, run.channels[name]))[np.isfinite(curve.values)]
            assert len(left) == figures.points[name]
            assert rms(left) == pytest.approx(told[name], rel=1e-6)
    assert curve.clipped is not None
    assert curve.clipped[1] == pytest.approx(LIMIT)
    text = page(results)
    assert "record, left out of the fit" in text
    assert "displacement centre reads 0.3 mm at rest, which is subtracted" in text


def test_the_sliders_score_the_same_points_on_the_simulations_clock(calibrated: Calibrated, tmp_path: Path) -> None:
    late, copy = 2e-5, shutil.copytree(calibrated.folder / "murnaghan", tmp_path / "models" / "murnaghan").parent
    for name in ("models.json", "records"):
        (shutil.copytree if name == "records" else shutil.copy)(calibrated.folder / name, copy / name)
    content = json.loads((copy / "murnaghan" / "emulator.json").read_text(encoding="utf-8"))
    assert content["clocks"] == {"shot_0": 0.0, "shot_1": 0.0}
    content["clocks"]["shot_1"] = late
    (copy / "murnaghan" / "emulator.json").write_text(json.dumps(content), encoding="utf-8")
    (view,) = kind_of(copy / "murnaghan").read(copy / "murnaghan")
    for shot, moved in zip(view.shots, (0.0, late), strict=True):
        name = shot["name"].split(",")[0]
        curves = fitted_of(calibrated, name)
        for sensor, (time, values) in zip(shot["channels"], curves.values(), strict=True):
            assert sensor["record"]["time"] == pytest.approx(time - moved, abs=1e-12)
            assert sensor["record"]["values"] == pytest.approx(values, abs=1e-12)
            assert sensor["record"]["sigma"] == pytest.approx(rig.NOISE)
    assert view.shots[1]["channels"][1]["record"]["left_out"]["values"] == pytest.approx(LIMIT)
    assert "its time less +0.020 ms" in view.shots[1]["channels"][0]["record"]["source"]


def fitted_of(calibrated: Calibrated, shot: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Sensor -> instants and readings that count, of a record in the folder."""
    figures = calibrated.found.measured[shot]
    fitted = figures.fitted(figures.above_rest(read_measured(calibrated.folder / "records" / f"{shot}.csv")))
    return {name: fitted.points(name) for name in fitted.channels}


def test_the_page_to_play_with_of_one_model_s_folder_is_of_this_model(calibrated: Calibrated, tmp_path: Path) -> None:
    place = calibrated.folder / "null"
    assert [view.title for view in kind_of(place).read(place)] == ["Bird model null"]
    assert explore(place, tmp_path / "page.html").is_file()


def test_the_cards_of_a_model_say_what_is_known_of_its_constants(calibrated: Calibrated, tmp_path: Path) -> None:
    best = export(calibrated.folder, tmp_path / "best.k").read_text(encoding="utf-8")
    own = calibrated.content["models"]["murnaghan"]["parameters"]
    assert f"{own['bird.material.eos.B']['value'] / 1e9:.5g}" in best  # GPa
    said = " ".join(best.replace("$", " ").split())
    assert "Bird model murnaghan calibrated by calibrate-models (models.json), place 1 of 2, held-out error" in said
    assert "viscosity: identified, " in said
    assert "eos.g: NOT IDENTIFIED in 4 .. 12" in said
    assert "Records: shot_0.csv, shot_1.csv. The records are simulated, not measured." in said
    assert calibrated.found.models["murnaghan"].combinations["bulk_modulus"].sentence in said
    named = export(calibrated.folder, tmp_path / "named.rad", to="radioss", model="null").read_text(encoding="utf-8")
    assert named == export(calibrated.folder / "null", tmp_path / "own.rad", to="radioss").read_text(encoding="utf-8")
    assert "place 2 of 2" in named
    assert "NO CONSTANTS in its ranges produce the records" in named


def test_of_a_folder_where_no_call_has_finished_the_resumption_is_named(tmp_path: Path) -> None:
    (tmp_path / MARK).write_text('{"command": "calibrate-models"}', encoding="utf-8")
    for read in (explore, export):
        with pytest.raises(UserError, match="make it, or resume what was interrupted, with: birdstrike calibrate-mod"):
            read(tmp_path, tmp_path / "bird.k")


def test_where_no_model_has_an_answer_the_reasons_are_told(calibrated: Calibrated, tmp_path: Path) -> None:
    """explore asked to repeat the call, whose models all failed."""
    reasons = {"elastic": "none of the 8 runs finished", "null": "the energy was off"}
    models = {name: calibrated.content["models"]["null"] | {"failure": reason} for name, reason in reasons.items()}
    content = calibrated.content | {"ranking": [], "models": models}
    (tmp_path / "models.json").write_text(json.dumps(content), encoding="utf-8")
    for read in (explore, read_models, partial(export, out=tmp_path / "bird.k")):
        with pytest.raises(UserError, match="no model has an answer: elastic: none of the 8 runs finished; null: the"):
            read(tmp_path)


@pytest.mark.parametrize(
    ("source", "given", "said"),
    [
        ("", {"model": "jelly"}, r'ranks no model "jelly" but murnaghan, null; "jelly" '),
        ("", {"model": "nul"}, r'ranks no model "nul" but murnaghan, null; "nul" .*null'),
        ("", {"model": "elastic"}, r"; to have it, repeat calibrate-models with .* --models null,murnaghan,elastic"),
        ("null", {"model": "elastic"}, r"--model elastic: .*null is of the bird model null; give "),
        ("", {"method": "network"}, r"--case and --method are of inversions; a model of .* is chosen by --model alone"),
        ("null/shot_0/case.toml", {"model": "null"}, r"--model null chooses from the folder of birdstrike calibrate-"),
    ],
)
def test_a_model_that_cannot_be_exported_is_named(
    calibrated: Calibrated, tmp_path: Path, source: str, given: dict[str, Any], said: str
) -> None:
    with pytest.raises(UserError, match=said):
        export(calibrated.folder / source, tmp_path / "bird.k", **given)


def test_the_command_names_the_cards_after_the_model(calibrated: Calibrated) -> None:
    words = ["export", str(calibrated.folder / "null"), "--to", "radioss"]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert (calibrated.folder / "bird_null.rad").is_file()


def test_neither_report_nor_evidence_is_of_one_model_s_folder(calibrated: Calibrated) -> None:
    with pytest.raises(UserError, match=r"is of the bird model null in .* predict --from take it"):
        find_parts(calibrated.folder / "null")


def test_a_single_record_is_tested_on_its_own_thirds(tmp_path: Path) -> None:
    cases, records = rig.shots()
    with rig.formula_for_solver():
        found = calibrate_models(cases[0], records[0], tmp_path, ["null"], runs=RUNS, workers=1, posterior=False)
    assert found.heldout_by == "time block"
    assert len(found.models["null"].residuals["shot_0"]["displacement_centre"]) >= 20
    assert "thirds of the record" in found.sentence
    page = write_models_page(tmp_path).read_text(encoding="utf-8")
    assert "Each third of the record is predicted" in page
    assert "constants of the others" not in page  # there is no other shot


def test_a_model_whose_answer_the_solver_refuses_is_still_compared(tmp_path: Path) -> None:
    """Every simulation but the campaign's fails, as one whose energy does not balance."""
    cases, records = rig.shots()
    campaign: set[float] = set()

    def fragile(case: Case, **_: Any) -> Histories:
        if len(campaign) == RUNS and case.bird.material.young not in campaign:
            raise RunFailed("the energy balance was off", "refine the mesh")
        campaign.add(case.bird.material.young)
        return rig.strike(case)

    with rig.formula_for_solver() as patch:
        patch.setattr("birdstrike.inversion.forward.simulate", fragile)
        found = calibrate_models(cases[0], records[0], tmp_path, ["elastic"], runs=RUNS, workers=1, posterior=False)
    own = found.models["elastic"]
    assert own.failure is None
    assert own.heldout["shot_0"] > 0.0
    assert any("the nearest that finished, stands in for it" in line for line in own.warnings)


def test_all_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    cases, records = rig.shots()
    with pytest.raises(UserError, match='"jelly" is no bird model; name null, elastic') as caught:
        calibrate_models(cases, records, tmp_path, ["jelly", "elastic+murnaghan", "murnaghan", "null+murnaghan"])
    assert len(caught.value.errors) == 3
    with pytest.raises(UserError, match="2 records and 3 cases"):
        calibrate_models([*cases, cases[0]], records, tmp_path, ["null"])
    with pytest.raises(UserError, match="1 record and 2 cases"):
        calibrate_models(cases, records[0], tmp_path, ["null"])
    with pytest.raises(UserError, match="hold the same points"):
        calibrate_models(cases, [records[0], records[0]], tmp_path, ["null"])
    with pytest.raises(UserError, match="outside 8"):
        calibrate_models(cases, records, tmp_path, ["null"], runs=3)
    renamed = replace(records[0], channels={"gauge": records[0].channels["displacement_side"]}, sigma={})
    with pytest.raises(UserError, match="has no sensor gauge"):
        calibrate_models(cases[0], renamed, tmp_path, ["null"])
    with rig.formula_for_solver():
        rig.CALLS.clear()
        force = replace(records[0], units={**records[0].units, "displacement_side": "N"})
        with pytest.raises(UserError, match="has unit N, the sensor m"):
            calibrate_models(cases[0], force, tmp_path, ["null"])
        seconds = replace(records[0], time=1e3 * (records[0].time + 1.0))
        with pytest.raises(UserError, match="0 points in the simulated record"):
            calibrate_models(cases[0], seconds, tmp_path, ["null"])
        assert not rig.CALLS


def test_other_ranges_of_one_shot_are_named_before_any_simulation(tmp_path: Path) -> None:
    """They were found when the models named before had been calibrated, and neither model nor range was named."""
    cases, records = rig.shots()
    key = "bird.material.young"
    other = cases[1].overlaid({"inversion": {"models": {"elastic": {key: {"range": ["5 MPa", "1 GPa"]}}}}})
    with rig.formula_for_solver():
        rig.CALLS.clear()
        with pytest.raises(
            UserError, match=f"--models elastic: {key} is sought in 1 .. 500 MPa .logarithmic. in "
        ) as no:
            calibrate_models([cases[0], other], records, tmp_path, ["null", "elastic"], runs=RUNS)
    assert f", sought in 5 .. 1000 MPa (linear) in {other.name} with elastic; state the same" in str(no.value)
    assert not rig.CALLS


def test_cases_of_unlike_plates_or_birds_are_warned_of() -> None:
    """Another plate's case beside a record was told as a late trigger alone."""
    cases, records = rig.shots()
    thin = cases[1].overlaid({"plate": {"thickness": "4 mm"}})

    def told(*given: Case) -> tuple[str, ...]:
        return unlike_cases([ShotSetup(f"v{i}", case, records[0]) for i, case in enumerate(given)])

    assert told(*cases) == ()  # speeds differ
    (line,) = told(cases[0], thin)
    thick = f"{1e3 * cases[0].plate.thickness:g} mm"
    assert line.startswith(f"the cases of the shots differ in plate.thickness ({thick} of v0, 4 mm of v1): each record")
    stiff = cases[1].overlaid({"bird": {"material": {"viscosity": "7 Pa s"}}})
    assert told(cases[0], stiff) == ()  # each model has its own


def test_one_name_may_stand_without_a_list(tmp_path: Path) -> None:
    """A channel's name alone was read letter by letter."""
    cases, records = rig.shots()
    with rig.formula_for_solver():
        found = calibrate_models(
            cases[0], records[0], tmp_path, "null", RUNS, workers=1, posterior=False, channels="displacement_side"
        )
        assert set(found.models["null"].verified["shot_0"].rmse) == {"displacement_side"}
        with pytest.raises(UserError, match='"lsq" is unknown'):
            calibrate_models(cases[0], records[0], tmp_path, "null", RUNS, optimisers="lsq")
        with pytest.raises(UserError, match="--budget = 0 is below 1"):
            calibrate_models(cases[0], records[0], tmp_path, "null", RUNS, budget=0)


@pytest.mark.parametrize("runs", [7, 2001])
def test_runs_outside_their_range_are_refused_before_anything_is_written(tmp_path: Path, runs: int) -> None:
    """Too many ended with the advice to use an option that the command does not have, and left a folder."""
    cases, records = rig.shots()
    with pytest.raises(UserError, match=rf"--runs = {runs} is outside 8 \.\. 2000"):
        calibrate_models(cases[0], records[0], tmp_path / "out", "null", runs)
    assert not (tmp_path / "out").exists()


def test_the_command_ends_with_1_for_the_user_s_mistake(tmp_path: Path) -> None:
    cases, records = rig.shots()
    (tmp_path / "case.toml").write_text(case_toml(cases[0]), encoding="utf-8")
    write_measured(tmp_path / "a.csv", records[0])
    words = [str(tmp_path / "case.toml"), "--measured", str(tmp_path / "a.csv"), "--models", "null,jelly"]
    result = CliRunner().invoke(app, ["calibrate-models", *words, "--out", str(tmp_path / "out")])
    assert result.exit_code == 1
    assert "jelly" in result.output + (result.stderr or "")


def test_noise_of_one_record_is_no_reason_to_prefer_a_model(calibrated: Calibrated) -> None:
    """A copy of the best model shares its place."""
    own = calibrated.found.models["murnaghan"]
    rng = np.random.default_rng(0)
    alike = {
        shot: {c: tuple(np.asarray(v) + 0.02 * rng.standard_normal(len(v))) for c, v in channels.items()}
        for shot, channels in own.residuals.items()
    }
    worse = {shot: {c: tuple(2.0 * np.asarray(v)) for c, v in ch.items()} for shot, ch in own.residuals.items()}
    entries = {"a": own, "b": replace(own, residuals=alike), "c": replace(own, residuals=worse)}
    found = ranked(entries)
    assert set(found.tied) == {"a", "b"}
    assert found.ranking[-1] == "c"
    assert found.answers["c"].probability_best == 0.0


def test_the_bootstrap_draws_the_ends_of_a_channel_as_often_as_its_middle() -> None:
    """Residuals that grow towards the end, as those of a wrong model do: the draws lie about the error itself."""
    growing = {"centre": tuple(np.linspace(0.0, 60.0, 61) ** 2)}
    draws = bootstrap(growing, 0)
    assert np.mean(draws**2) == pytest.approx(shot_error(growing) ** 2, rel=0.03)


def test_channels_that_miss_alike_say_no_more_than_one_of_them() -> None:
    """Drawn by themselves, blocks of four such channels made the interval of a shot's error half as wide."""
    missed = tuple(np.sin(np.linspace(0.0, 9.0, 120)) ** 3)
    alone, together = ({f"c{i}": missed for i in range(count)} for count in (1, 4))
    assert bootstrap(together, 0) == pytest.approx(bootstrap(alone, 0))


@pytest.mark.parametrize(("beaten", "tied"), [(0.90, ("a", "b")), (0.97, ("a", "b")), (0.98, ())])
def test_models_are_tied_until_97_5_per_cent_of_the_draws_part_them(beaten: float, tied: tuple[str, ...]) -> None:
    """The 95 % interval of a difference, two-sided, has 0 in it."""
    first = np.full(1000, 1.0)
    other = np.where(np.arange(1000) < 1000 * beaten, 1.2, 0.9)
    assert _order({"b": 1.1, "a": 1.0}, {"a": first, "b": other}) == (("a", "b"), tied)


def of_size(size: float, points: int = 60) -> ModelAnswer:
    """A model whose held-out residuals are white, of a size over the noise."""
    drawn = size * np.random.default_rng(int(1e3 * size)).normal(size=points)
    return ModelAnswer("m", "", residuals={"shot": {"centre": tuple(drawn.tolist())}})


@pytest.mark.parametrize(("sizes", "missed"), [((1.0, 5.0), False), ((1.4, 5.0), False), ((15.0, 30.0), True)])
def test_even_the_best_model_is_said_to_miss_where_it_does(sizes: tuple[float, float], missed: bool) -> None:
    answers = {name: replace(of_size(size), name=name) for name, size in zip(("a", "b"), sizes, strict=True)}
    setup: Any = SimpleNamespace(
        name="shot", case=load_case("demo_rig"), measured=Measured(np.zeros(1), {}, {}, {}, ())
    )
    found = _compared(answers, [setup], 0)
    warned = [line for line in found.warnings if line.startswith("even the best model (a) leaves ")]
    assert bool(warned) is missed
    for sentence in (found.sentence, *found.per_shot_sentences.values()):
        assert ("a has the least error (held-out error" in sentence) is missed
        assert ("even the best is off by more" in sentence) is missed
        assert ("a predicts best (held-out error" in sentence) is not missed


@pytest.mark.parametrize(("best", "told"), [(1.0, False), (15.0, True)])
def test_a_model_that_misses_does_not_doubt_a_record_that_another_follows(best: float, told: bool) -> None:
    late = "force lies beside the runs best when its clock is moved by +0.10 ms; a late or early trigger?"
    answers = {
        "a": replace(of_size(best), name="a"),
        "b": replace(of_size(30.0), name="b", warnings=(late, "another")),
    }
    setup: Any = SimpleNamespace(
        name="shot", case=load_case("demo_rig"), measured=Measured(np.zeros(1), {}, {}, {}, ())
    )
    found = _compared(answers, [setup], 0)
    assert (f"beside the runs of b: {late}" in found.warnings) is told
    assert "b: another" in found.warnings
    assert found.models["b"].warnings == (late, "another")


def test_tied_models_and_one_alone_are_said_to_miss_too() -> None:
    assert "even the best is off by more" in _verdict({"a": 9.0}, ["a"], (), (8.0, 10.0))
    assert "even the best is off by more" in _verdict({"a": 9.0, "b": 9.1}, ["a", "b"], ("a", "b"), (8.0, 10.0))
    assert "even the best is off by more" not in _verdict({"a": 2.1, "b": 9.1}, ["a", "b"], (), (1.9, 2.3))


def test_a_model_that_another_solver_s_deck_cannot_carry_is_refused_before_any_run(tmp_path: Path) -> None:
    case = oscillator(tmp_path / "case")
    time = np.linspace(0.0, 2e-3, 50)
    record = Measured(time, {"displacement_centre": 1e-3 * np.sin(1500.0 * time)}, {}, {"displacement_centre": "m"}, ())
    with pytest.raises(
        UserError, match=r"--models elastic: the deck of strike.k.j2 has no place for bird.material.mod"
    ):
        calibrate_models(case, record, tmp_path / "out", models=["elastic"])
