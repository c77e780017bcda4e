"""The page of two shots that were inverted together: the first one's curves, the other named."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from birdstrike.cli.train_and_invert import lines
from birdstrike.data.curves import read_measured
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.inversion.train_and_invert import Extras, train_and_invert
from birdstrike.reports.export.exported import read_export
from birdstrike.reports.results.reading import read_results
from tests.reports.conftest import page_of
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
    assert "shot8.csv was inverted together with shot7.csv" in text


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
