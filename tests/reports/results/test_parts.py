"""Which diagnosis a report shows beside an inversion: one of the same record and case, and no other."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from birdstrike.data.errors import UserError
from birdstrike.inversion.prediction.reading import read_learnt
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.reports.evidence.sources import find_sources
from birdstrike.reports.export.effects import read_effects
from birdstrike.reports.page.page import report
from birdstrike.reports.results.parts import find_parts
from birdstrike.reports.results.reading import read_results
from birdstrike.solver.case.case import case_hash
from tests.diagnoses import effect, state, written_diagnosis

OTHER = "0" * 64


@pytest.fixture
def loop(finished: Path, tmp_path: Path) -> Path:
    """A loop of shot7.csv without a diagnosis."""
    for part in ("doe", "inversion"):
        shutil.copytree(finished / part, tmp_path / part)
    return tmp_path


def digest_of(loop: Path) -> str:
    """Of the inverted record's content, as inversion.json has it."""
    return Inversion.load(loop / "inversion" / "inversion.json").measured.digest


def diagnosed(loop: Path, *files: str, digests: tuple[str, ...] = (), count: int = 1) -> Path:
    """A diagnosis in the loop whose first `count` files are its shots; the case of each is the inversion's."""
    folder, names = loop / "diagnosis", [Path(one).stem for one in files[:count]]
    folder.mkdir(exist_ok=True)
    record: dict[str, Any] = {"path": files[0], "simulated": False, "shots": names, "simulated_shots": []}
    record |= {"files": list(files)} | ({"digests": list(digests)} if digests else {})
    written_diagnosis(folder, effect("impact_speed", 5.0), record=record, before=state(rmse={}))
    (folder / "diagnosis.csv").write_text("channel,time_s\n")
    for name in ("case.toml", *(f"diagnosis_{one}.toml" for one in names[1:])):
        shutil.copy(loop / "inversion" / "case.toml", folder / name)
    return folder


def test_an_inversion_holds_the_digest_of_its_record(finished: Path) -> None:
    assert digest_of(finished) == hashlib.sha256((finished / "shot7.csv").read_bytes()).hexdigest()


def test_a_diagnosis_of_another_record_is_left_out_and_told(loop: Path) -> None:
    """The page was titled by the inverted record and began with the other record's diagnosis, without a warning."""
    folder = diagnosed(loop, "shot6.csv")
    parts = find_parts(loop)
    assert parts.diagnosis is None
    told = f"the diagnosis in {folder} is of shot6.csv, not of shot7.csv, the record of the inversion"
    (line,) = (one for one in parts.missing if one.startswith(told))
    assert f"birdstrike report {folder} shows it by itself" in line
    assert f"birdstrike diagnose {loop / 'doe' / 'case.toml'} --measured CSV --out {folder}" in line
    page = report(loop, models=False).read_text(encoding="utf-8")
    assert "is of shot6.csv, not of shot7.csv" in page
    assert "what the model lacks" not in page
    assert any(told in one for one in read_results(loop).warnings)


def test_a_prediction_and_an_export_of_both_ask_which_is_meant(loop: Path) -> None:
    folder = diagnosed(loop, "shot6.csv")
    for read in (read_learnt, read_effects):
        with pytest.raises(UserError, match=f"name the one that is meant: {loop / 'inversion'}, or {folder}"):
            read(loop)


def test_a_record_that_has_changed_since_is_another_one(loop: Path) -> None:
    diagnosed(loop, "shot7.csv", digests=(OTHER,))
    assert "read shot7.csv when it had another content than for the inversion" in find_parts(loop).other_diagnosis


def test_a_record_that_has_moved_is_the_same_one(loop: Path) -> None:
    folder = diagnosed(loop, "/elsewhere/renamed.csv", digests=(digest_of(loop),))
    assert find_parts(loop).diagnosis == folder


def test_one_of_several_shots_is_the_inversions(loop: Path) -> None:
    """Its case is its own, not that of the first shot."""
    folder = diagnosed(loop, "shot6.csv", "shot7.csv", digests=(OTHER, digest_of(loop)), count=2)
    (folder / "case.toml").write_text('extends = "demo"\n[impact]\nspeed = "80 m/s"\n')
    assert find_parts(loop).diagnosis == folder
    (folder / "diagnosis_shot7.toml").write_text('extends = "demo"\n[impact]\nspeed = "80 m/s"\n')
    assert "is of another case (hash" in find_parts(loop).other_diagnosis


def test_a_held_out_record_or_a_baseline_is_no_shot(loop: Path) -> None:
    diagnosed(loop, "shot6.csv", "shot7.csv", digests=(OTHER, digest_of(loop)))
    assert "is of shot6.csv, not of shot7.csv" in find_parts(loop).other_diagnosis


def test_of_an_earlier_version_the_names_count(loop: Path) -> None:
    folder = diagnosed(loop, "/elsewhere/shot7.csv")
    assert find_parts(loop).diagnosis == folder
    content = json.loads((folder / "diagnosis.json").read_text())
    content["record"] = {"path": "shot6.csv", "simulated": False, "shots": ["shot6", "shot7"]}
    (folder / "diagnosis.json").write_text(json.dumps(content))
    assert find_parts(loop).diagnosis == folder, "of further shots nothing tells the files"


def test_a_diagnosis_of_another_record_is_refused_where_it_is_named(loop: Path) -> None:
    elsewhere = diagnosed(loop, "shot6.csv").rename(loop / "elsewhere")
    with pytest.raises(
        UserError, match=r"is of shot6\.csv, not of shot7\.csv.*leave --diagnosis out: birdstrike report"
    ):
        find_parts(loop, diagnosis=elsewhere)


def test_evidence_says_that_a_diagnosis_is_of_another_record(loop: Path) -> None:
    """It said that whether an effect is missing was not asked."""
    diagnosed(loop, "shot6.csv")
    sources = find_sources(loop)
    assert sources.diagnosis is None
    assert any("is of shot6.csv" in one for one in sources.open_points)
    assert not any("was not asked" in one for one in sources.open_points)


def test_evidence_holds_the_case_that_was_inverted_and_not_what_its_file_became(loop: Path) -> None:
    path, named = loop / "inversion" / "options.json", loop / "shot.toml"
    options = json.loads(path.read_text())
    path.write_text(json.dumps(options | {"cases": [str(named)]}))
    named.write_text((loop / "inversion" / "case.toml").read_text().replace("speed = ", "speed = 2.0 #", 1))
    sources = find_sources(loop)
    assert sources.cases == (loop / "inversion" / "case.toml",)
    assert case_hash(sources.case) == Inversion.load(loop / "inversion" / "inversion.json").case_hash


def test_of_an_earlier_version_the_case_of_any_shot_may_be_the_inversions(loop: Path) -> None:
    folder = diagnosed(loop, "shot6.csv", "shot7.csv", count=2)
    slow = (folder / "case.toml").read_text().replace('speed = "', 'speed = "8', 1)
    (folder / "case.toml").write_text(slow)
    path = folder / "diagnosis.json"
    told = json.loads(path.read_text())
    del told["record"]["files"]
    path.write_text(json.dumps(told))
    assert find_parts(loop).diagnosis == folder
