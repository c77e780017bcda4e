"""Extension: a longer design with the same first rows pays for the new strikes only; any other is refused."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import whole_file
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.adoption import adopted_design
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.folder import DAY, CampaignFolder, design_rows, design_text
from birdstrike.doe.campaign.planned import planned_design
from birdstrike.doe.campaign.results import load_dataset, running
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.case import load_case
from tests.doe.campaign.test_campaign import HIGHEST, campaign, same, snapshot
from tests.doe.stand_in import VERSION, attempts, design, reference, strike


@pytest.fixture
def short_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundredth of the usual search for a uniform design: how good it is does not matter here."""
    monkeypatch.setattr("birdstrike.doe.designs.uniform.SWAPS", 20_000)


def file_design(path: Path, values: np.ndarray, numbers: list[int] | None = None) -> Design:
    """A user's FILE of SI `values`, read as the command reads it."""
    space = ParameterSpace.of(reference().parameters())
    header = ["run", *(f"{name} [{unit}]" for name, unit in zip(space.names, space.units, strict=True))]
    rows = zip(numbers or range(1, len(values) + 1), values, strict=True)
    lines = [header, *([str(number), *(repr(float(value)) for value in row)] for number, row in rows)]
    path.write_text("\n".join(",".join(line) for line in lines) + "\n", encoding="utf-8")
    return make_design(path, space)


def test_a_longer_sobol_design_runs_only_the_added_strikes(tmp_path: Path) -> None:
    diary, out, whole = tmp_path / "diary", tmp_path / "out", tmp_path / "whole"
    campaign(out, design(4, 3, "sobol"), diary=diary)
    assert len(attempts(diary)) == 4
    extended = campaign(out, design(8, 3, "sobol"), diary=diary)
    assert len(attempts(diary)) == 8
    same(extended, campaign(whole, design(8, 3, "sobol")))
    for name in ("curves.csv", "design.csv"):
        assert (out / name).read_bytes() == (whole / name).read_bytes()
    first, second = (json.loads((folder / "summary.json").read_text(encoding="utf-8")) for folder in (out, whole))
    for summary in (first, second):
        assert [run.pop("wall_s") for run in summary["runs"]] == [None] * 8
    assert [summary["design"].pop("calls") for summary in (first, second)] == [[4, 8], [8]]
    assert first == second
    same(extended, load_dataset(out))


@pytest.mark.parametrize("numbers", [None, [11, 12, 13, 14, 3, 2, 1]])
def test_a_file_with_rows_appended_runs_only_those(tmp_path: Path, numbers: list[int] | None) -> None:
    diary, out, whole = tmp_path / "diary", tmp_path / "out", tmp_path / "whole"
    values, path = design(7).values, tmp_path / "runs.csv"
    campaign(out, file_design(path, values[:4], numbers and numbers[:4]), diary=diary)
    longer = file_design(path, values, numbers)
    campaign(out, longer, diary=diary)
    assert len(attempts(diary)) == 7
    campaign(whole, longer)
    assert (out / "curves.csv").read_bytes() == (whole / "curves.csv").read_bytes()


def test_failures_of_the_held_strikes_are_not_paid_for_again(tmp_path: Path) -> None:
    diary, out, whole = tmp_path / "diary", tmp_path / "out", tmp_path / "whole"
    longer = design(8, 0, "sobol")
    broken = longer.values[:, 1] > HIGHEST
    assert 0 < broken[:4].sum() < 4
    campaign(out, design(4, 0, "sobol"), diary=diary, breaks_above=HIGHEST)
    campaign(out, longer, diary=diary, breaks_above=HIGHEST)
    assert len(attempts(diary)) == 8 + broken.sum()
    campaign(whole, longer, breaks_above=HIGHEST)
    assert (out / "curves.csv").read_bytes() == (whole / "curves.csv").read_bytes()


def test_an_extension_stopped_midway_resumes_and_can_be_extended_further(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, design(4, 0, "sobol"), diary=diary)
    before = (out / "summary.json").read_bytes()
    campaign(out, design(8, 0, "sobol"), diary=diary)
    (out / "summary.json").write_bytes(before)  # as a kill leaves it between design.csv and summary.json
    assert len(campaign(out, design(4, 0, "sobol"), diary=diary).runs) == 4
    assert len(attempts(diary)) == 8
    campaign(out, design(16, 0, "sobol"), diary=diary)
    assert len(attempts(diary)) == 16


def refused(out: Path, asked: Design, *parts: str) -> None:
    """The design is refused in these words, and not a byte of the folder changes."""
    before = snapshot(out)
    with pytest.raises(UserError) as caught:
        campaign(out, asked)
    for part in ("choose another --out", *parts):
        assert part in str(caught.value)
    assert snapshot(out) == before


@pytest.mark.usefixtures("short_search")
@pytest.mark.parametrize(("kind", "short", "long"), [("lhs", 4, 8), ("uniform", 6, 8), ("orthogonal", 9, 25)])
def test_a_fresh_longer_design_is_refused(tmp_path: Path, kind: str, short: int, long: int) -> None:
    campaign(tmp_path, design(short, 0, kind))
    refused(tmp_path, design(long, 0, kind), f"rows may only be appended to the first {short}, which differ")


SPACE = ParameterSpace.of(reference().parameters())


@pytest.mark.usefixtures("short_search")
@pytest.mark.parametrize(("kind", "short", "long"), [("lhs", 6, 9), ("uniform", 6, 9), ("orthogonal", 9, 12)])
def test_a_planned_longer_design_keeps_the_held_runs_and_pays_for_the_new(
    tmp_path: Path, kind: str, short: int, long: int
) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    campaign(out, design(short, 0, kind), diary=diary)
    held = (out / "design.csv").read_text(encoding="utf-8")
    longer = planned_design(kind, SPACE, long, 0, out)
    np.testing.assert_array_equal(longer.values[:short], design(short, 0, kind).values)
    np.testing.assert_array_equal(longer.numbers, np.arange(1, long + 1))
    dataset = campaign(out, longer, diary=diary)
    assert (out / "design.csv").read_text(encoding="utf-8").startswith(held)
    assert len(attempts(diary)) == long
    assert len(dataset.runs) == long
    again = planned_design(kind, SPACE, long, 0, out)
    np.testing.assert_array_equal(again.values, longer.values)
    campaign(out, again, diary=diary)
    assert len(attempts(diary)) == long


def test_an_extension_killed_before_its_summary_is_planned_again_as_it_was(tmp_path: Path) -> None:
    diary = tmp_path / "diary"
    campaign(tmp_path, design(6), diary=diary)
    summary = (tmp_path / "summary.json").read_bytes()
    longer = planned_design("lhs", SPACE, 9, 0, tmp_path)
    campaign(tmp_path, longer, diary=diary)
    (tmp_path / "summary.json").write_bytes(summary)
    np.testing.assert_array_equal(planned_design("lhs", SPACE, 9, 0, tmp_path).values, longer.values)
    campaign(tmp_path, planned_design("lhs", SPACE, 12, 0, tmp_path), diary=diary)
    assert 12 <= len(attempts(diary)) <= 15  # the 3 of the forgotten extension are other points than the 6 now


def test_a_held_design_that_was_edited_is_not_taken_for_the_campaign_s(tmp_path: Path) -> None:
    campaign(tmp_path, design(6))
    text = (tmp_path / "design.csv").read_text(encoding="utf-8")
    (tmp_path / "design.csv").write_text(text.replace("3,", "3,1", 1), encoding="utf-8")
    np.testing.assert_array_equal(planned_design("lhs", SPACE, 6, 0, tmp_path).values, design(6).values)


def test_a_design_read_back_has_the_quality_of_the_design_that_was_written(tmp_path: Path) -> None:
    for seed in range(8):
        fresh, out = design(6, seed), tmp_path / str(seed)
        campaign(out, fresh)
        assert planned_design("lhs", SPACE, 6, seed, out).quality().as_json() == fresh.quality().as_json()


def test_an_edited_design_is_named_as_such(tmp_path: Path) -> None:
    campaign(tmp_path, design(6))
    path = tmp_path / "design.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("3,", "3,1", 1), encoding="utf-8")
    with pytest.raises(UserError, match=r"design\.csv has been edited since the campaign wrote it"):
        campaign(tmp_path, design(6))


def test_an_extended_campaign_without_its_design_is_restored_by_its_commands_in_order(tmp_path: Path) -> None:
    diary, out = tmp_path / "diary", tmp_path / "out"
    for _ in range(2):
        for runs in (6, 9):
            campaign(out, planned_design("lhs", SPACE, runs, 0, out), diary=diary)
        path, text = out / "design.csv", (out / "design.csv").read_text(encoding="utf-8")
        path.write_text(text.replace("3,", "3,1", 1), encoding="utf-8")
        with pytest.raises(UserError, match="of an extended one all of them, in their order"):
            load_dataset(out)
        path.unlink()
    assert len(attempts(diary)) == 9


def test_a_planned_shorter_design_or_another_seed_s_is_a_fresh_one(tmp_path: Path) -> None:
    campaign(tmp_path, design(6))
    for runs, seed in ((5, 0), (9, 1)):
        fresh = planned_design("lhs", SPACE, runs, seed, tmp_path)
        np.testing.assert_array_equal(fresh.values, design(runs, seed).values)


def test_a_shorter_design_is_refused(tmp_path: Path) -> None:
    campaign(tmp_path, design(8, 0, "sobol"))
    refused(tmp_path, design(4, 0, "sobol"), "a campaign cannot be shortened")


def test_a_longer_sobol_design_of_another_seed_is_refused(tmp_path: Path) -> None:
    campaign(tmp_path, design(4, 0, "sobol"))
    refused(tmp_path, design(8, 1, "sobol"), "seed 0, not with", "seed 1")


def test_a_file_whose_held_rows_have_changed_is_refused(tmp_path: Path) -> None:
    values, path = design(7).values, tmp_path / "runs.csv"
    campaign(tmp_path / "out", file_design(path, values[:4]))
    values[2, 1] *= 1.01
    refused(tmp_path / "out", file_design(path, values), "rows may only be appended to the first 4, which differ")


def test_a_longer_file_over_other_ranges_is_refused(tmp_path: Path) -> None:
    values, path = design(7).values, tmp_path / "runs.csv"
    campaign(tmp_path / "out", file_design(path, values[:4]))
    longer = file_design(path, values)
    wider = replace(longer, space=replace(longer.space, highs=longer.space.highs * [1.0, 2.0, 1.0, 1.0]))
    there, here = (f"bird.material.viscosity 0 .. {high} Pa s" for high in (1500, 3000))
    refused(tmp_path / "out", wider, f"the campaign varied {there}, the case seeks {here}: choose")
    refused(tmp_path / "out", reversed_columns(longer), "inversion.parameters differ in their order")


def reversed_columns(design: Design) -> Design:
    """The design of the case whose parameters stand the other way round."""
    space = design.space
    turned = ParameterSpace(
        space.names[::-1], space.units[::-1], space.lows[::-1], space.highs[::-1], space.scales[::-1]
    )
    return replace(design, space=turned, values=design.values[:, ::-1], unit=design.unit[:, ::-1])


def test_an_adopted_campaign_s_columns_stand_as_the_case_has_its_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("birdstrike.solver.version.SOLVER_VERSION", VERSION)
    campaign(tmp_path, design(3))
    table = reference().table
    table["inversion"]["parameters"] = dict(reversed(table["inversion"]["parameters"].items()))
    adopted, wanted = adopted_design(load_case(table), tmp_path), reversed_columns(design(3))
    assert adopted.names == wanted.names
    np.testing.assert_array_equal(adopted.values, wanted.values)


def test_only_the_store_s_own_temporary_files_older_than_a_day_are_removed(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    store, key = RunStore(runs), "0123456789abcdef" * 2
    names: list[Path] = []
    for place in (store.path(key), store.path(key), runs / f"{key}.failed.json"):
        with whole_file(place) as temporary:
            temporary.touch()
        place.unlink()
        names.append(temporary)
    young, *stale = names
    others = [runs / ".notes.tmp", runs / f"{key}.h5.corrupt", runs / ".notes.csv.12-0123abcd.tmp"]
    for path in (*stale, *others, young):
        path.touch()
        age = DAY / 2 if path == young else 2 * DAY
        os.utime(path, (time.time() - age, time.time() - age))
    campaign(tmp_path)
    assert not any(path.exists() for path in stale)
    assert all(path.exists() for path in (young, *others))


def test_a_folder_whose_first_call_was_stopped_before_any_run_takes_another_design(tmp_path: Path) -> None:
    def stopped(_: str) -> None:
        raise KeyboardInterrupt

    planned = design(6)
    planned.values[:] = planned.space.to_physical(np.linspace(0.1, 0.9, 6)[:, None] * np.ones(4))
    planned.unit[:] = planned.space.to_unit(
        planned.values
    )  # a line of runs: there is something to say before the first
    with pytest.raises(KeyboardInterrupt):
        run_campaign(reference(), planned, tmp_path, simulate=strike, solver_version=VERSION, say=stopped)
    assert (tmp_path / "design.csv").exists()
    assert len(campaign(tmp_path, design(4, 1)).runs) == 4


def test_an_extension_stopped_before_its_first_run_leaves_the_campaign_and_may_be_another(tmp_path: Path) -> None:
    diary = tmp_path / "diary"
    campaign(tmp_path, design(6), diary=diary)
    summary = (tmp_path / "summary.json").read_bytes()
    for runs in (12, 9, 6):
        CampaignFolder(tmp_path).claim(reference(), planned_design("lhs", SPACE, runs, 0, tmp_path))
        assert (tmp_path / "summary.json").read_bytes() == summary
    assert len(campaign(tmp_path, planned_design("lhs", SPACE, 6, 0, tmp_path), diary=diary).runs) == 6
    assert len(attempts(diary)) == 6


def test_a_summary_tells_the_calls_that_made_its_design(tmp_path: Path) -> None:
    for runs in (6, 9, 9):
        campaign(tmp_path, planned_design("lhs", SPACE, runs, 0, tmp_path))
    assert json.loads((tmp_path / "summary.json").read_text())["design"]["calls"] == [6, 9]


def test_a_campaign_whose_first_run_is_under_way_is_no_free_folder(tmp_path: Path) -> None:
    planned = design(6)
    CampaignFolder(tmp_path).claim(reference(), planned)
    running(CampaignFolder(tmp_path), reference(), planned, [], VERSION)
    with pytest.raises(UserError, match="the lhs design of 6 runs and seed 0, not with the lhs design of 4 runs"):
        CampaignFolder(tmp_path).claim(reference(), design(4, 1))


def test_a_parameter_of_a_material_whose_name_has_commas_and_quotes_is_one_column(tmp_path: Path) -> None:
    wanted = design(3)
    names = ('target.materials.AA2024,T3 "clad".a', *wanted.names[1:])
    text = design_text(replace(wanted, space=replace(wanted.space, names=names)))
    numbers, values = design_rows(tmp_path / "design.csv", text.splitlines())
    assert numbers.tolist() == [1, 2, 3]
    np.testing.assert_array_equal(values, wanted.values)
    with pytest.raises(UserError, match="line 3 has 2 cells, its header 5"):
        design_rows(tmp_path / "design.csv", [*text.splitlines()[:2], "2,1.0"])
