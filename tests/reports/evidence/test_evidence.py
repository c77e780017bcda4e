"""The evidence of an answer, unpacked elsewhere, repeats the calibration and gets the same numbers."""

from __future__ import annotations

import hashlib
import json
import shutil
import tomllib
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import tomli_w
from typer.testing import CliRunner

import birdstrike.inversion.forward
from birdstrike import evidence
from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import file_digest
from birdstrike.data.storage.out_folder import MARK
from birdstrike.doe.solvers import solver_for
from birdstrike.reports.evidence.archive import _other_solver
from birdstrike.reports.evidence.sources import of_diagnosis
from birdstrike.reports.evidence.verification_rows import aspects, read_rows
from birdstrike.solver.case.case import case_hash, load_case
from tests.diagnoses import diagnosis
from tests.inversion import small_campaign
from tests.solver.target.test_mesh_file import written

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def zipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The archive of a finished inversion by the emulator; the folders that it was made from are gone."""
    folder = tmp_path_factory.mktemp("evidence")
    small_campaign.build(folder / "doe")
    small_campaign.write_record(folder / "shot 7.csv")
    line = ["train-and-invert", str(folder / "doe"), "--measured", str(folder / "shot 7.csv"), "--method", "emulator"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)
        found = CliRunner().invoke(app, [*line, "--seed", "3", "--refine", "0", "--out", str(folder / "inversion")])
        assert found.exit_code == 0, found.output
    out = tmp_path_factory.mktemp("kept") / "evidence.zip"
    made = CliRunner().invoke(app, ["evidence", str(folder / "inversion"), "--out", str(out), "--json"])
    assert made.exit_code == 0, made.output
    assert "Written to" in made.stdout
    again = evidence(folder / "inversion", out.with_name("again.zip"))
    assert again.path.read_bytes() == out.read_bytes(), "the same evidence has the same bytes"
    shutil.rmtree(folder)
    return out


def unpacked(zipped: Path, folder: Path) -> dict[str, Any]:
    with zipfile.ZipFile(zipped) as archive:
        archive.extractall(folder)
    return json.loads((folder / "manifest.json").read_text())


def test_the_calibration_repeats_from_the_archive_alone(
    zipped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = unpacked(zipped, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)
    found = CliRunner().invoke(app, manifest["repeat"][1:])
    assert found.exit_code == 0, found.output
    before, after = (json.loads((tmp_path / one / "inversion.json").read_text()) for one in ("inversion", "again"))
    for key in ("methods", "best", "ranges", "posterior", "seed", "case_hash", "time_offset", "runs_used"):
        assert after[key] == before[key], key
    assert " ".join(manifest["repeat"][:2]) in (tmp_path / "repeat.sh").read_text()


def test_every_file_has_the_digest_of_the_manifest(zipped: Path, tmp_path: Path) -> None:
    manifest = unpacked(zipped, tmp_path)
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert files == {*manifest["files"], "manifest.json"}
    for name, entry in manifest["files"].items():
        content = (tmp_path / name).read_bytes()
        assert hashlib.sha256(content).hexdigest() == entry["sha256"]
        assert len(content) == entry["bytes"]
    needed = {"SUMMARY.md", "case.toml", "records/shot 7.csv", "campaigns/1/curves.csv", "inversion/inversion.json"}
    assert needed | {"verification.json", "inversion/options.json", "inversion/posterior.csv"} <= files
    assert manifest["seed"] == 3
    assert len(manifest["campaigns"][0]["runs"]) == small_campaign.RUNS
    assert manifest["verification_runs"]["emulator"]


def test_the_summary_says_what_was_found_where_it_holds_and_what_is_open(zipped: Path, tmp_path: Path) -> None:
    manifest = unpacked(zipped, tmp_path)
    page = (tmp_path / "SUMMARY.md").read_text()
    assert "bird.material.viscosity: " in page
    assert "NOT IDENTIFIED" in page
    assert "SIMULATED, NOT MEASURED" in page
    assert manifest["files"]["records/shot 7.csv"]["sha256"] in page
    assert "birdstrike train-and-invert campaigns/1 --measured 'records/shot 7.csv'" in page
    assert "was sought in" in page
    assert "no diagnosis: whether an effect is missing from the model was not asked" in page


def test_a_campaign_of_another_solver_is_an_open_point(tmp_path: Path) -> None:
    """The page named the solver at hand beside the case, and the archive was said to repeat the numbers."""
    for name, version in (("old", "0123456789ab"), ("new", solver_for(load_case("demo")).version)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "summary.json").write_text(json.dumps({"solver_version": version}))
    old, new = (SimpleNamespace(case=load_case("demo"), campaigns=(tmp_path / one,)) for one in ("old", "new"))
    assert not _other_solver(cast("Any", new))
    (said,) = _other_solver(cast("Any", old))
    assert said.startswith("the campaign was simulated with solver 0123456789ab, and the one at hand is ")


def test_rows_that_bear_on_a_case_are_chosen_by_what_it_asks_of_the_solver() -> None:
    rows, codes = read_rows(ROOT / "VERIFICATION.md")
    assert len(rows) > 200
    assert codes
    assert all(len(code) == 12 for code in codes)
    found = {one.name: one for one in aspects(load_case("reference_strike"), rows)}
    shock = next(one for name, one in found.items() if name.startswith("shock in the bird"))
    assert not shock.missing
    assert {row.family for row in shock.rows} == {"Planar impact"}
    assert all(": Grueneisen" in row.name for row in shock.rows)
    assert found["clamped plate"].rows
    assert not any("Curved" in row.family for one in found.values() for row in one.rows)


def test_what_no_row_covers_is_named() -> None:
    rows, _ = read_rows(ROOT / "VERIFICATION.md")
    fast = load_case(
        "reference_strike", {"impact.speed": "900 m/s", "impact.angle": "90 deg", "impact.friction": "0.2"}
    )
    missing = {one.name: one.missing for one in aspects(fast, rows) if one.missing}
    shock = next(text for name, text in missing.items() if name.startswith("shock in the bird"))
    assert shock.startswith("outside the range: the rows go from ")
    assert shock.endswith("and the case has 900 m/s")
    elastic = {one.name: one.missing for one in aspects(load_case("reference_strike_elastic"), rows)}
    assert elastic["strength of the bird"] == "no row checks the strength of a bird of model elastic"


def test_evidence_that_could_not_be_repeated_is_refused(tmp_path: Path, zipped: Path) -> None:
    unpacked(zipped, tmp_path / "there")
    folder = tmp_path / "there" / "inversion"
    with pytest.raises(UserError, match=r"the campaign of the inversion is not where it was .* name it: --doe"):
        evidence(folder, tmp_path / "e.zip")
    campaign = tmp_path / "there" / "campaigns" / "1"
    with pytest.raises(UserError, match="is not where the inversion read it; name its file: --measured"):
        evidence(folder, tmp_path / "e.zip", doe=campaign)
    record = tmp_path / "there" / "records" / "shot 7.csv"
    assert evidence(folder, tmp_path / "e.zip", doe=campaign, measured=[record]).path.is_file()
    with pytest.raises(UserError, match="is a zip; name it so"):
        evidence(folder, tmp_path / "e.tar", doe=campaign, measured=[record])
    changed = tmp_path / "changed" / record.name
    changed.parent.mkdir()
    changed.write_text(record.read_text().replace("\n0.", "\n 0.", 1))
    with pytest.raises(UserError, match=r"is not as the inversion read it .* as it was read: --measured CSV"):
        evidence(folder, tmp_path / "f.zip", doe=campaign, measured=[changed])
    (campaign / "curves.csv").write_text((campaign / "curves.csv").read_text() + "\n")
    with pytest.raises(UserError, match="has been edited since the campaign wrote it"):
        evidence(folder, tmp_path / "f.zip", doe=campaign, measured=[record])
    with pytest.raises(UserError, match="does not exist; make it with: birdstrike close-the-loop"):
        evidence(tmp_path / "nothing", tmp_path / "f.zip")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "models.json").write_text("{}")
    with pytest.raises(UserError, match="was made by birdstrike calibrate-models; give a folder"):
        evidence(tmp_path / "models", tmp_path / "f.zip")
    assert not (tmp_path / "f.zip").exists()


@pytest.mark.parametrize(("maker", "files"), [("diagnose", ("diagnosis.json", "diagnosis.csv")), ("compare", ())])
def test_a_folder_without_an_inversion_is_told_what_evidence_is_of(
    tmp_path: Path, maker: str, files: tuple[str, ...]
) -> None:
    for name in files:
        (tmp_path / name).write_text("{}")
    (tmp_path / MARK).write_text(json.dumps({"command": maker}))
    with pytest.raises(UserError, match="give a folder of train-and-invert, close-the-loop or start"):
        evidence(tmp_path)


def test_a_mesh_file_goes_along_by_a_path_in_the_archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folders that the archive was made from are gone, and so is the mesh: the calibration repeats all the same."""
    table = load_case("reference_strike").table | {"target": load_case("openradioss_panel").table["target"]}
    del table["plate"], table["target"]["generator"]
    home = tmp_path / "home"
    home.mkdir()
    table["target"] |= {"mesh": str(written(home / "panel.inp")), "mesh_unit": "m"}
    (home / "panel strike.toml").write_text(tomli_w.dumps(table))
    digest = case_hash(small_campaign.build(home / "doe", case=load_case(home / "panel strike.toml")))
    assert tomllib.loads((home / "doe" / "case.toml").read_text())["target"]["mesh"] == "mesh/panel.inp"
    record = small_campaign.write_record(home / "shot.csv")
    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)
    line = ["train-and-invert", str(home / "doe"), "--measured", str(record), "--method", "emulator", "--refine", "0"]
    line += ["--case", str(home / "panel strike.toml"), "--no-posterior", "--out", str(home / "inversion")]
    assert CliRunner().invoke(app, line).exit_code == 0
    evidence(home / "inversion", tmp_path / "evidence.zip")
    shutil.rmtree(home)
    place = tmp_path / "elsewhere"
    manifest = unpacked(tmp_path / "evidence.zip", place)
    assert "# Evidence: panel strike\n" in (place / "SUMMARY.md").read_text()
    assert manifest["case_hash"] == digest
    cases = list(place.rglob("*.toml"))
    assert len(cases) == 4, "the answer's, the record's, the campaign's and the inversion's"
    for path in cases:
        assert case_hash(load_case(path)) == digest, path
    monkeypatch.chdir(place)
    found = CliRunner().invoke(app, manifest["repeat"][1:])
    assert found.exit_code == 0, found.output


def test_the_summary_names_the_case_and_not_the_file_that_holds_it(zipped: Path, tmp_path: Path) -> None:
    assert unpacked(zipped, tmp_path)["case"] == "reference_strike"
    assert "# Evidence: reference_strike\n" in (tmp_path / "SUMMARY.md").read_text()


def test_records_of_a_diagnosis_are_enclosed_or_an_open_point(tmp_path: Path) -> None:
    """The record of a baseline, on which an answer rests, was missing from the archive without a word."""
    own, clean = tmp_path / "shot.csv", tmp_path / "clean.csv"
    for path in (own, clean):
        path.write_text("time_s,displacement_centre_m\n0,0\n")

    def of(*files: Path) -> tuple[tuple[Path, ...], list[str]]:
        return of_diagnosis(diagnosis(record={"files": [str(path) for path in files]}), [own])

    assert of(own) == of(tmp_path / "elsewhere" / own.name) == ((), [])
    beside, (said,) = of(own, clean)
    assert beside == (clean.resolve(),)
    assert "further records (clean.csv), which are in diagnosis/records" in said
    beside, (said,) = of(own, tmp_path / "moved.csv")
    assert not beside
    assert "not in this archive" in said
    assert "moved.csv" in said
    digests = [file_digest(one) for one in (own, clean)]
    told = diagnosis(record={"files": [str(own), str(clean)], "digests": digests})
    assert of_diagnosis(told, [own])[0] == (clean.resolve(),)
    clean.write_text("time_s,displacement_centre_m\n0,1\n")
    with pytest.raises(UserError, match=r"clean.csv .* is not as the diagnosis read it .* repeat birdstrike diagnose"):
        of_diagnosis(told, [own])
    beside, (said,) = of_diagnosis(diagnosis(record={}, baseline={"shots": ["clean"]}), [own])
    assert "1 of which the diagnosis does not say the files" in said


def test_another_program_is_not_vouched_for_by_checks_of_our_own_solver(external_loop: Path, tmp_path: Path) -> None:
    made = evidence(external_loop / "inversion", tmp_path / "evidence.zip", doe=external_loop / "doe")
    manifest = unpacked(made.path, tmp_path)
    page = (tmp_path / "SUMMARY.md").read_text()
    assert manifest["solver_version"] == "external: oscillator 1"
    assert "solver oscillator 1, an external program" in page
    assert "rows within their tolerance" not in page
    assert json.loads((tmp_path / "verification.json").read_text())["aspects"] == []
    assert any("oscillator 1 is not in this archive" in point for point in manifest["open_points"])
