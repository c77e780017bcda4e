"""The page of two shots that were inverted together: the first one's curves, the other named."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from birdstrike.cli.train_and_invert import lines
from birdstrike.data.curves import read_measured
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.reports.blocks import Picture
from birdstrike.reports.explore.kinds.inversion import read as explored
from birdstrike.reports.export.exported import read_export
from birdstrike.reports.page.page import page
from birdstrike.reports.results.measurement import residual, simulated_curves
from birdstrike.reports.results.reading import read_results
from birdstrike.reports.sections.curves import comparisons
from tests.reports.conftest import page_of
from tests.reports.html import Page
from tests.reports.synthetic import simulate, write_record


@pytest.fixture(scope="module")
def two_shots(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first loop's campaign with two records of its case."""
    folder = tmp_path_factory.mktemp("two_shots")
    shutil.copytree(finished / "doe", folder / "doe")
    records = [write_record(folder / "shot7.csv"), write_record(folder / "shot8.csv", peak=5.52e-3)]
    records[1].write_text("# SIMULATED by a formula\n" + records[1].read_text())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.inversion.forward.simulate", simulate)
        train_and_invert(
            folder / "doe", records, folder / "inversion", method="emulator", extras=Extras(refine=0, posterior=False)
        )
    return folder


def test_the_page_shows_the_first_shot_and_names_the_other(two_shots: Path) -> None:
    results = read_results(two_shots)
    assert results.channels == ("displacement_centre",)
    assert [Path(shot.path).name for shot in results.inversion.shots] == ["shot7.csv", "shot8.csv"]
    (told,) = results.other_shots
    assert told in results.warnings
    text = page_of(two_shots).read_text(encoding="utf-8")
    assert "shot 2, shot8.csv, was inverted together with shot 1, shot7.csv: tables and figures are of shot 1" in text
    assert "6 The records (shot7 measured, shot8 simulated by a formula) and the simulated curves" in text
    assert ">records</td><td>shot7.csv, shot8.csv</td>" in text
    assert "parameters from the records shot7 and shot8" in text
    assert "The record of shot8 is simulated, not measured" in text, "the page called the record measured"
    assert "@2" not in " ".join(words for tag in ("p", "li", "td", "figcaption") for words in Page(text).text[tag])


def test_records_whose_files_have_one_name_are_told_apart(two_shots: Path) -> None:
    """The page called both measured where the second was simulated, of two files record.csv in folders of their own."""
    results = read_results(two_shots)
    (other,) = results.later
    alike = replace(
        results,
        record=replace(results.record, path="a/record.csv"),
        later=(replace(other, record=replace(other.record, path="b/record.csv")),),
    )
    html = page(alike, makers=())
    assert simulated_curves(alike.records) == "every curve but the measured records is simulated"
    assert simulated_curves(alike.records[1:]) == "every curve is simulated, the record too"
    assert "parameters from the records record_1 and record_2" in html
    assert "The record of record_2 is simulated, not measured" in html


def test_the_page_with_sliders_tells_them_apart_too(two_shots: Path, tmp_path: Path) -> None:
    """Both channels were called `displacement centre, record.csv`."""
    folder = shutil.copytree(two_shots / "inversion", tmp_path / "inversion")
    path = folder / "inversion.json"
    path.write_text(path.read_text().replace("shot7.csv", "a/record.csv").replace("shot8.csv", "b/record.csv"))
    (view,) = explored(folder)
    (both,) = view.shots
    assert both["name"] == "record_1, record_2"
    assert [one["label"] for one in both["channels"]] == [f"displacement centre, record_{i}" for i in (1, 2)]


def test_the_curves_of_the_other_shot_stand_below_those_of_the_first(two_shots: Path) -> None:
    results = read_results(two_shots)
    (other,) = results.later
    own, score = read_measured(two_shots / "shot8.csv"), other.answer.channels["displacement_centre"]
    assert other.record.channels["displacement_centre"] == pytest.approx(own.channels["displacement_centre"])
    left = residual(other, "displacement_centre", other.best)
    assert rms(left.values) == pytest.approx(score.verified_rmse, rel=1e-6)
    first, last = comparisons(results).blocks
    assert isinstance(last, Picture)
    assert last.caption.startswith("Shot 2, shot8.csv. The record (simulated by a formula) has its peak of 5.")
    assert isinstance(first, Picture)
    assert first.name != last.name


def test_shots_on_other_clocks_are_drawn_without_the_gaps_of_their_common_file(two_shots: Path, tmp_path: Path) -> None:
    """A dense record between whose instants lay another's was a line with a gap behind every point, and not seen."""
    folder = shutil.copytree(two_shots, tmp_path / "late")
    inverted, late = folder / "inversion", 3e-5
    content = json.loads((inverted / "inversion.json").read_text(encoding="utf-8"))
    content["shots"][1]["time_offset"] += late
    content["time_offset"]["sigma"] = 1e-5
    content["measured"]["cuts"] = {"displacement_centre@2": {"clipped": [4e-4]}}
    (inverted / "inversion.json").write_text(json.dumps(content), encoding="utf-8")
    table = pd.read_csv(inverted / "verification.csv")
    moved = table.assign(time_s=table.time_s + 1e-7)
    table.loc[:, [name for name in table if "@2" in name]] = np.nan
    moved.loc[:, [name for name in moved if name.endswith("centre_m")]] = np.nan
    pd.concat([table, moved]).sort_values("time_s").to_csv(inverted / "verification.csv", index=False)
    results, before = read_results(folder), read_results(two_shots)
    for one, other, shift in ((results, before, 0.0), (results.later[0], before.later[0], late + 1e-7)):
        assert np.isfinite(one.record.channels["displacement_centre"]).all()
        assert one.record.time == pytest.approx(other.record.time + shift, abs=1e-12)
    assert results.later[0].offset == pytest.approx(before.later[0].offset + late)
    assert results.later[0].cut("displacement_centre", "clipped") == pytest.approx(
        [4e-4 + results.later[0].offset - results.offset]
    )


def test_each_record_keeps_its_own_provenance(two_shots: Path) -> None:
    """The page had the lines of all records under the first one, and the cards named the last file alone."""
    results = read_results(two_shots)
    assert list(results.record.provenance) == list(read_measured(two_shots / "shot7.csv").provenance)
    inversion = Inversion.load(two_shots / "inversion" / "inversion.json")
    assert inversion.records == (str(two_shots / "shot7.csv"), str(two_shots / "shot8.csv"))
    assert inversion.simulated_records == inversion.records[1:]
    assert not results.record.simulated, "an instrument took the first one"
    cards = read_export(two_shots / "inversion").source
    assert "Records: shot7.csv, shot8.csv, of which shot8.csv is SIMULATED, NOT MEASURED." in cards
    assert next(lines(inversion)) == f"measurement: {two_shots / 'shot8.csv'} is simulated, not measured"


def test_an_older_answer_calls_no_record_measured_that_may_be_simulated(two_shots: Path) -> None:
    """Its lines do not say of which record they are."""
    found = Inversion.load(two_shots / "inversion" / "inversion.json")
    older = replace(found, measured=replace(found.measured, provenance=("SIMULATED by a formula",)))
    assert older.simulated_records == older.records


def test_a_single_shot_has_no_others(finished: Path) -> None:
    assert read_results(finished).other_shots == ()
