"""What a campaign's folder holds, listed without changing it; stores that were merged, edited, or shared."""

from __future__ import annotations

import errno
import os
import shutil
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import h5py
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.errors import CaseError, RunFailed, UserError
from birdstrike.data.formatting import many
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.inventory import inventory
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.campaign.run import Finished, retry_before
from birdstrike.solver.version import SOLVER_VERSION
from tests.doe.campaign.test_campaign import HIGHEST, campaign, snapshot
from tests.doe.stand_in import attempts, design, reference, strike


def versioned(out: Path, version: str = SOLVER_VERSION, **options: object) -> None:
    """A campaign whose stand-in passes for a version of the embedded solver."""
    simulate = partial(strike, **options)  # type: ignore[arg-type]
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), design(), out, workers=1, simulate=simulate, solver_version=version, say=lambda _: None,
            executor=executor,
        )  # fmt: skip


def test_a_whole_campaign_has_nothing_to_tell(tmp_path: Path) -> None:
    versioned(tmp_path)
    before = snapshot(tmp_path)
    found = inventory(tmp_path)
    assert (found.state, found.version) == ("finished", SOLVER_VERSION)
    assert found.finished == [1, 2, 3, 4, 5, 6]
    assert (found.failed, found.due, found.damaged) == ({}, [], [])
    assert (found.other_versions, found.elsewhere) == ({}, [])
    assert snapshot(tmp_path) == before


def test_an_error_in_a_campaign_s_case_is_headed_by_the_file_s_path(tmp_path: Path) -> None:
    """Its name is case in every folder; so is that of a case whose copy of a mesh is missing."""
    versioned(tmp_path)
    case = tmp_path / "case.toml"
    text = case.read_text(encoding="utf-8")
    case.write_text(text.replace('speed = "91.1 m/s"', 'speed = "9110 m/s"'), encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        inventory(tmp_path)
    assert caught.value.heading == f"{case}: 1 error"
    assert "impact.speed = 9110 m/s" in caught.value.errors[0]


def test_results_of_an_older_solver_version_are_listed_and_their_runs_are_due(tmp_path: Path) -> None:
    versioned(tmp_path, "older", breaks_above=HIGHEST)
    found = inventory(tmp_path)
    assert found.due == [1, 2, 3, 4, 5, 6]
    older = found.other_versions.pop("older")
    finished = [name for name in older if name.endswith(".h5")]
    assert 0 < len(finished) < 6
    assert len(older) == len(finished) + 2 * (6 - len(finished))  # a failed strike failed at both steps
    assert not found.other_versions
    result = CliRunner().invoke(app, ["check", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert f"kept and not used: results of solver version older ({many(len(older), 'file')}): " in result.stdout
    assert "6 to be run" in result.stdout


def test_failures_damage_and_runs_from_elsewhere_are_told_apart(tmp_path: Path) -> None:
    versioned(tmp_path, breaks_above=HIGHEST)
    failed = sorted(inventory(tmp_path).failed)
    assert failed
    other = tmp_path / "other"
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), design(3, 7), other, workers=1, simulate=strike, solver_version=SOLVER_VERSION,
            say=lambda _: None, executor=executor,
        )  # fmt: skip
    victim = sorted((tmp_path / "runs").glob("*.h5"))[0]
    shutil.copytree(other / "runs", tmp_path / "runs", dirs_exist_ok=True)
    shutil.rmtree(other)
    victim.write_bytes(victim.read_bytes()[:-300])
    before = snapshot(tmp_path)
    found = inventory(tmp_path)
    assert snapshot(tmp_path) == before
    assert found.damaged == [victim.name]
    assert sorted(found.failed) == failed
    assert all("unstable" in reason for reason in found.failed.values())
    assert len(found.due) == 1
    assert len(found.elsewhere) == 3
    assert len(found.finished) == 6 - len(failed) - 1


def test_a_folder_without_a_campaign_is_the_user_s_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no campaign"):
        inventory(tmp_path)
    assert CliRunner().invoke(app, ["check", str(tmp_path)]).exit_code == 1


def test_a_curve_edited_in_place_is_found_set_aside_and_run_again(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, diary=diary)
    before = (out / "curves.csv").read_bytes()
    victim = sorted((out / "runs").glob("*.h5"))[0]
    with h5py.File(victim, "r+") as file:
        file["channels/displacement_centre"][3] *= 1.001  # type: ignore[index]
    with pytest.warns(UserWarning, match="checksum does not fit"):
        campaign(out, diary=diary)
    assert len(attempts(diary)) == 7
    assert (out / "curves.csv").read_bytes() == before
    assert (victim.parent / f"{victim.name}.corrupt").exists()
    assert inventory(out).damaged == []  # the run has been made again
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # and nothing is said of it any more
        campaign(out, diary=diary)
    assert len(attempts(diary)) == 7
    victim.unlink()
    assert inventory(out).damaged == [f"{victim.name}.corrupt"]


def test_a_damaged_record_of_a_failure_is_set_aside_and_the_run_tried_again(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, diary=diary, breaks_above=HIGHEST)
    begun = len(attempts(diary))
    victim = sorted((out / "runs").glob("*.failed.json"))[0]
    victim.write_text('{"reason"', encoding="utf-8")
    with pytest.warns(UserWarning, match="damaged"):
        campaign(out, diary=diary, breaks_above=HIGHEST)
    assert len(attempts(diary)) > begun
    assert (victim.parent / f"{victim.name}.corrupt").exists()


def test_recorded_failures_are_tried_again_when_asked(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    first = campaign(out, diary=diary, breaks_above=HIGHEST)
    begun = len(attempts(diary))
    with ThreadPoolExecutor(1) as executor:
        second = run_campaign(
            reference(), design(), out, workers=1, simulate=partial(strike, diary=diary), solver_version="stand-in",
            say=lambda _: None, executor=executor, retry=retry_before(True),
        )  # fmt: skip
    assert len(second.runs) == 6
    assert len(attempts(diary)) - begun == 6 - len(first.runs)
    assert not list((out / "runs").glob("*.failed.json"))


def test_a_full_disk_stops_the_campaign_and_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, write = tmp_path / "out", Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        if len(list((out / "runs").glob("*.h5"))) >= 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left") as caught:
        campaign(out)
    assert caught.value.errno == errno.ENOSPC
    assert ".tmp" not in str(caught.value.filename)
    monkeypatch.undo()
    kept = RunStore(out / "runs").keys()
    assert len(kept) == 2
    assert not list((out / "runs").glob(".*"))
    diary = tmp_path / "diary"
    campaign(out, diary=diary)
    assert len(attempts(diary)) == 4


def test_a_run_that_vanishes_before_the_curves_are_written_is_named(tmp_path: Path) -> None:
    campaign(tmp_path)
    store = RunStore(tmp_path / "runs")
    key = store.keys()[0]
    finished = Finished(store, key, 1.0, {})
    assert finished.histories.time.size == 31
    store.path(key).unlink()
    with pytest.raises(RunFailed, match="has gone or is damaged"):
        _ = finished.histories


def test_curves_of_an_older_version_are_no_dataset_once_every_run_of_the_present_one_failed(tmp_path: Path) -> None:
    versioned(tmp_path, "older")
    with pytest.raises(RunFailed, match="none of the 6 runs finished"):
        versioned(tmp_path, breaks_above=-1.0)
    with pytest.raises(UserError, match="none of its runs finished"):
        load_dataset(tmp_path)
    assert len(inventory(tmp_path).other_versions["older"]) == 6


@pytest.mark.parametrize("edit", [lambda text: text.replace("\n2,", "\n2,1,", 1), lambda _: ""])
def test_an_edited_design_of_which_no_runs_follow_is_named(tmp_path: Path, edit: Callable[[str], str]) -> None:
    versioned(tmp_path)
    path = tmp_path / "design.csv"
    path.write_text(edit(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(UserError, match="has been edited since the campaign wrote it"):
        inventory(tmp_path)


def test_a_line_of_a_design_that_nothing_vouches_for_is_named(tmp_path: Path) -> None:
    versioned(tmp_path)
    (tmp_path / "summary.json").unlink()
    path = tmp_path / "design.csv"
    path.write_text(path.read_text(encoding="utf-8") + "7,abc\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"design\.csv, line 8: 7,abc is no row of numbers; put the original back"):
        inventory(tmp_path)


def test_a_loop_s_folder_names_its_campaign(tmp_path: Path) -> None:
    versioned(tmp_path / "doe")
    for read in (inventory, load_dataset):
        with pytest.raises(UserError, match=f"its campaign is {tmp_path / 'doe'}"):
            read(tmp_path)
