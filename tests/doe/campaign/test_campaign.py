"""Campaigns: what they write, what they re-use, what they refuse, and how they fail."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import CaseError, RunFailed, UserError
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.doe.designs.design import Design
from birdstrike.inversion.campaign_shots import campaign_case
from birdstrike.solver.case.case import Case, case_from_table, case_hash, load_case
from tests.doe.stand_in import TIME, VERSION, attempts, design, recording, reference, strike

HIGHEST = 1000.0
"""[Pa s] Viscosity above which the stand-in breaks where a test wants that."""
METAL = {"law": "bilinear", "young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "690 MPa"}
TARGET = {
    "mesh_unit": "m",
    "parts": {"part_1": {"thickness": "3 mm", "material": "metal"}},
    "materials": {"metal": METAL},
    "supports": {"free_edges": "clamped"},
}


def campaign(out: Path, planned: Design | None = None, case: Case | None = None, **options: object) -> Dataset:
    """A campaign of the stand-in on one thread of this process; options: those of the stand-in's strike."""
    simulate = partial(strike, **options)  # type: ignore[arg-type]
    with ThreadPoolExecutor(1) as executor:
        return run_campaign(
            case or reference(),
            planned or design(),
            out,
            workers=1,
            simulate=simulate,
            solver_version=VERSION,
            say=lambda _: None,
            executor=executor,
        )


def same(first: Dataset, second: Dataset) -> None:
    """Equal in every bit."""
    for name in ("names", "units", "channel_units", "case_hash"):
        assert getattr(first, name) == getattr(second, name)
    for name in ("lows", "highs", "runs", "parameters", "time", "smooth"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert first.curves.keys() == second.curves.keys()
    for name in first.curves:
        np.testing.assert_array_equal(first.curves[name], second.curves[name])


def test_the_folder_holds_design_curves_case_and_summary(tmp_path: Path) -> None:
    planned = design()
    campaign(tmp_path, planned)
    table = pd.read_csv(tmp_path / "design.csv")
    assert list(table.columns) == ["run", *planned.names]
    np.testing.assert_allclose(table.to_numpy()[:, 1:], planned.values, rtol=1e-15)
    curves = pd.read_csv(tmp_path / "curves.csv")
    assert list(curves.columns) == ["run", "time_s", "displacement_centre_m", "contact_force_N"]
    assert len(curves) == 6 * len(TIME)
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["schema_version"] == 1
    assert summary["state"] == "finished"
    assert summary["design"]["rank"] == 4
    assert summary["failed"] == []
    assert [run["status"] for run in summary["runs"]] == ["finished"] * 6
    assert all(run["step_factor"] == 1.0 for run in summary["runs"])
    assert summary["solver_version"] == VERSION
    assert summary["case_hash"] == case_hash(reference())
    assert {path.name for path in tmp_path.iterdir()} == {
        ".birdstrike.json", "case.json", "case.toml", "curves.csv", "design.csv", "runs", "summary.json",
    }  # fmt: skip


def test_the_curves_are_the_solver_s_for_the_run_s_values(tmp_path: Path) -> None:
    planned = design()
    dataset = campaign(tmp_path, planned)
    for i, values in enumerate(planned.values):
        expected = strike(reference().with_values(dict(zip(planned.names, map(float, values), strict=True))))
        for name, channel in expected.channels.items():
            np.testing.assert_array_equal(dataset.curves[name][i], channel)


def test_the_case_in_the_folder_is_the_campaign_s_own(tmp_path: Path) -> None:
    case = reference(impact__speed='"80 m/s"', plate__elements="[24, 20]")
    campaign(tmp_path, case=case)
    copy = load_case(tmp_path / "case.toml")
    assert case_hash(copy) == case_hash(case)
    assert copy.parameters() == case.parameters()
    assert copy.inversion == case.inversion
    assert copy.sensors == case.sensors


def test_a_dataset_is_read_back_bit_for_bit(tmp_path: Path) -> None:
    dataset = campaign(tmp_path)
    same(dataset, load_dataset(tmp_path))
    assert dataset.names == design().names
    assert dataset.channel_units == {"displacement_centre": "m", "contact_force": "N"}
    np.testing.assert_array_equal(dataset.parameters, design().values)
    np.testing.assert_array_equal(dataset.lows, design().space.lows)
    np.testing.assert_array_equal(dataset.time, TIME)


def test_runs_that_lose_more_than_5_percent_of_the_bird_are_kept_and_flagged(tmp_path: Path) -> None:
    planned = design(runs=20)
    dataset = campaign(tmp_path, planned)
    erosion = planned.values[:, 3]
    lossy = (erosion > 0.9) & (erosion < 1.0)
    assert lossy.any()
    np.testing.assert_array_equal(dataset.smooth, ~lossy)
    assert len(dataset.runs) == 20


def test_a_second_call_runs_nothing_and_writes_the_same_bytes(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, diary=diary)
    before = (out / "curves.csv").read_bytes()
    campaign(out, diary=diary)
    assert len(attempts(diary)) == 6
    assert (out / "curves.csv").read_bytes() == before


def test_only_a_damaged_run_is_repeated(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, diary=diary)
    before = (out / "curves.csv").read_bytes()
    victim = sorted((out / "runs").glob("*.h5"))[2]
    victim.write_bytes(victim.read_bytes()[:-200])
    with pytest.warns(UserWarning, match="damaged"):
        campaign(out, diary=diary)
    assert len(attempts(diary)) == 7
    assert (out / "curves.csv").read_bytes() == before


def test_a_campaign_on_copied_runs_runs_only_the_rest(tmp_path: Path) -> None:
    diary, first, second = tmp_path / "diary", tmp_path / "first", tmp_path / "second"
    campaign(first)
    (second / "runs").mkdir(parents=True)
    for path in sorted((first / "runs").glob("*.h5"))[:4]:
        (second / "runs" / path.name).write_bytes(path.read_bytes())
    campaign(second, diary=diary)
    assert len(attempts(diary)) == 2
    assert (second / "curves.csv").read_bytes() == (first / "curves.csv").read_bytes()


def test_another_solver_version_s_runs_are_kept_but_not_mixed_in(tmp_path: Path) -> None:
    campaign(tmp_path)
    said: list[str] = []
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), design(), tmp_path, simulate=strike, solver_version="newer", say=said.append, executor=executor
        )
    assert any(VERSION in line and "newer" in line for line in said)
    assert len(RunStore(tmp_path / "runs").keys()) == 12


def test_a_failing_strike_is_retried_with_half_the_step_then_left_out_by_number(tmp_path: Path) -> None:
    diary, said, states = tmp_path / "diary", [], []
    planned = design()
    broken = planned.numbers[planned.values[:, 1] > HIGHEST]
    assert 0 < len(broken) < 6
    simulate = partial(strike, diary=diary, breaks_above=HIGHEST)
    with ThreadPoolExecutor(1) as executor:
        dataset = run_campaign(
            reference(), planned, tmp_path / "out", simulate=simulate, solver_version=VERSION, say=said.append,
            progress=recording(states), executor=executor,
        )  # fmt: skip
    np.testing.assert_array_equal(dataset.runs, np.setdiff1d(planned.numbers, broken))
    for viscosity in planned.values[broken - 1, 1]:
        assert [factor for text, factor in attempts(diary) if text == repr(float(viscosity))] == [1.0, 0.5]
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert [entry["run"] for entry in summary["failed"]] == broken.tolist()
    assert all("unstable" in entry["reason"] for entry in summary["failed"])
    for number in broken:
        assert any(line.startswith(f"run {number} failed twice and is left out: unstable") for line in said)
    assert states[-1] == RunCounts(6, 6 - len(broken), 0, 0, len(broken))


def test_a_recorded_failure_is_not_paid_for_again(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    first = campaign(out, diary=diary, breaks_above=HIGHEST)
    begun = len(attempts(diary))
    same(first, campaign(out, diary=diary, breaks_above=HIGHEST))
    assert len(attempts(diary)) == begun


def test_a_strike_cured_by_the_smaller_step_is_used_and_said_so(tmp_path: Path) -> None:
    planned = design()
    dataset = campaign(tmp_path, planned, breaks_above=HIGHEST, cured_by_step=True)
    np.testing.assert_array_equal(dataset.runs, planned.numbers)
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    halved = [run["run"] for run in summary["runs"] if run["step_factor"] == 0.5]
    np.testing.assert_array_equal(halved, planned.numbers[planned.values[:, 1] > HIGHEST])
    assert summary["failed"] == []


def test_a_history_that_is_not_finite_is_a_failure(tmp_path: Path) -> None:
    campaign(tmp_path, breaks_above=HIGHEST, ends_not_finite=True)
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert {entry["reason"] for entry in summary["failed"]} == {"the history of contact_force is not finite"}


def test_a_campaign_of_which_nothing_finishes_ends_with_the_first_reason(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="none of the 6 runs finished; run 1: unstable"):
        campaign(tmp_path, breaks_above=-1.0)
    with pytest.raises(UserError, match="none of its runs finished"):
        load_dataset(tmp_path)


def snapshot(folder: Path) -> dict[str, bytes]:
    """Every file and its content."""
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_folder_with_another_case_s_campaign_is_refused_and_left_alone(tmp_path: Path) -> None:
    campaign(tmp_path)
    before = snapshot(tmp_path)
    other = reference(impact__speed='"80 m/s"')
    with pytest.raises(UserError) as caught:
        campaign(tmp_path, case=other)
    for part in (case_hash(reference()), case_hash(other), "impact.speed is 91.1 there and 80.0 here", "--out"):
        assert part in str(caught.value)
    assert snapshot(tmp_path) == before


def test_a_folder_with_another_design_s_campaign_is_refused_and_left_alone(tmp_path: Path) -> None:
    campaign(tmp_path)
    before = snapshot(tmp_path)
    with pytest.raises(
        UserError, match=r"lhs design of 6 runs and seed 0, not with the lhs design of 8 runs and seed 1"
    ):
        campaign(tmp_path, design(runs=8, seed=1))
    assert snapshot(tmp_path) == before


def test_a_run_that_the_case_refuses_is_named_before_anything_is_run(tmp_path: Path) -> None:
    planned = design()
    planned.values[3, 1] = -5.0
    with pytest.raises(CaseError, match=r"run 4: bird.material.viscosity"):
        campaign(tmp_path / "out", planned)
    assert not (tmp_path / "out").exists()


def test_what_the_user_should_know_is_said_once(tmp_path: Path) -> None:
    said: list[str] = []
    planned = design()
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), planned, tmp_path, simulate=strike, solver_version=VERSION, say=said.append, executor=executor
        )
    idle = int(np.sum(planned.values[:, 2] <= 1.0))
    lines = [line for line in said if "tension_erosion" in line]
    assert len(lines) == 1
    assert f"inactive in {idle} of 6 runs" in lines[0]
    assert len([line for line in said if "compression_erosion" in line]) == 1


def test_other_sources_of_an_installed_package_make_the_runs_anew_in_the_same_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An upgraded package is no other case: the folder is kept, the runs are not, and that is said."""
    said: list[str] = []
    begun: list[int] = []
    for number, digest in enumerate(("one", "one", "two")):
        monkeypatch.setattr(Case, "sources_from_outside", lambda _, digest=digest: {"sensor kind mean": digest})
        with ThreadPoolExecutor(1) as executor:
            run_campaign(
                reference(), design(), tmp_path / "doe", simulate=partial(strike, diary=tmp_path / str(number)),
                solver_version=VERSION, say=said.append, executor=executor,
            )  # fmt: skip
        begun.append(len(attempts(tmp_path / str(number))) if (tmp_path / str(number)).exists() else 0)
    assert begun == [6, 0, 6]
    (line,) = [line for line in said if "sources" in line]
    assert "was run with other sources of the sensor kind mean, from an installed package" in line
    assert "all runs are made anew" in line
    dataset = load_dataset(tmp_path / "doe")
    monkeypatch.setattr(Case, "sources_from_outside", lambda _: {"sensor kind mean": "three"})
    with pytest.warns(UserWarning, match="was run with other sources of the sensor kind mean"):
        assert campaign_case(tmp_path / "doe", dataset, reference()) == reference()


def test_a_rank_deficient_design_is_run_but_named_at_once(tmp_path: Path) -> None:
    said: list[str] = []
    states: list[RunCounts] = []
    planned = design()
    planned.values[:] = planned.space.to_physical(np.linspace(0.1, 0.9, 6)[:, None] * np.ones(4))
    planned.unit[:] = planned.space.to_unit(planned.values)
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), planned, tmp_path, simulate=strike, solver_version=VERSION, executor=executor,
            say=lambda line: said.append(f"{len(states)}: {line}"), progress=recording(states),
        )  # fmt: skip
    assert said[0].startswith("0: rank 1 of 4")
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["design"]["deficient"] is True
    assert summary["design"]["rank"] == 1
    assert summary["design"]["sentence"].startswith("rank 1 of 4")


def test_a_folder_without_a_finished_campaign_gives_no_dataset(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="make one with: birdstrike run-doe"):
        load_dataset(tmp_path)


def test_no_worker_at_all_is_the_user_s_error(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--workers = 0 is below 1"):
        run_campaign(reference(), design(), tmp_path, workers=0, simulate=strike, solver_version=VERSION)


@pytest.mark.parametrize("name", ["design.csv", "curves.csv"])
def test_an_edited_campaign_is_refused_wherever_it_is_read(tmp_path: Path, name: str) -> None:
    """Two rows of values swapped, as a spreadsheet's sorting leaves them; the folder is mended as the error says."""
    out, record = tmp_path / "campaign", tmp_path / "record.csv"
    first = campaign(out)
    record.write_text("time [ms],displacement_centre [mm]\n0.0,0.0\n0.1,1.0\n0.2,2.0\n0.3,3.0\n")
    before = (out / name).read_bytes()
    lines = before.decode().splitlines()
    swapped = [
        f"{old.split(',', 1)[0]},{new.split(',', 1)[1]}" for old, new in ((lines[1], lines[2]), (lines[2], lines[1]))
    ]
    (out / name).write_text("\n".join([lines[0], *swapped, *lines[3:]]) + "\n", encoding="utf-8")
    with pytest.raises(UserError, match=rf"{name} has been edited since the campaign wrote it"):
        load_dataset(out)
    command = ["train-and-invert", str(out), "--measured", str(record), "--out", str(tmp_path / "inversion")]
    ended = CliRunner().invoke(app, command)
    assert ended.exit_code == 1
    assert f"{name} has been edited since the campaign wrote it" in ended.stderr
    checked = CliRunner().invoke(app, ["check", str(out), "--json"])
    assert f"{name} has been edited" in json.loads(checked.stdout.splitlines()[-1])["warnings"][0]
    (out / name).unlink()
    same(campaign(out), first)
    assert (out / name).read_bytes() == before


def test_a_campaign_whose_case_was_edited_is_refused_wherever_it_is_read(tmp_path: Path) -> None:
    """Report, page of sliders and inversion would describe a case that the curves are not of."""
    campaign(tmp_path)
    case = tmp_path / "case.toml"
    before = case.read_text(encoding="utf-8")
    case.write_text(before.replace('speed = "91.1 m/s"', 'speed = "80 m/s"'), encoding="utf-8")
    with pytest.raises(UserError, match=r"not what the campaign was run for any more: impact\.speed is 91.1"):
        load_dataset(tmp_path)
    checked = CliRunner().invoke(app, ["check", str(tmp_path), "--json"])
    assert "impact.speed is 91.1" in json.loads(checked.stdout.splitlines()[-1])["warnings"][0]
    case.write_text(before, encoding="utf-8")
    load_dataset(tmp_path)


def test_another_mesh_is_named_as_such(tmp_path: Path) -> None:
    """A case holds a mesh by its digest, which says nothing to a reader and has no unit."""
    nodes = np.array([[x, y, 0.0] for y in (-1, 0, 1) for x in (-1, 0, 1)]) * 0.1
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    mesh = tmp_path / "plate.vtk"
    meshio.Mesh(nodes, [("quad", quads)]).write(mesh)
    table = reference().table | {"target": TARGET | {"mesh": str(mesh)}}
    del table["plate"]
    campaign(tmp_path / "out", case=case_from_table(table, "plate"))
    nodes[4, 0] += 0.01
    meshio.Mesh(nodes, [("quad", quads)]).write(mesh)
    with pytest.raises(UserError, match=r"the mesh that target.mesh names has another content \(digest \w+ there, "):
        campaign(tmp_path / "out", case=case_from_table(table, "plate"))
