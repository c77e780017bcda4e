"""`birdstrike close-the-loop` from case and record to the page, with a stand-in for the solver."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from birdstrike import close_the_loop
from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.data.paths import REFERENCE
from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.loop import LoopPlan, onwards
from birdstrike.reports.sections import summary
from birdstrike.solver.case.case import Case
from tests.diagnoses import written_diagnosis
from tests.reports import synthetic
from tests.reports.synthetic import stand_in_for_models, write_record

RUNS = 12


class Solver:
    """The stand-in, counting its strikes; it fails above a viscosity [Pa s], and strike `stops` (from 1) is Ctrl-C."""

    def __init__(self) -> None:
        self.strikes = 0
        self.fails_above = float("inf")
        self.stops = 0

    def __call__(self, case: Case, **_: object) -> Histories:
        self.strikes += 1
        if self.strikes == self.stops:
            raise KeyboardInterrupt
        if getattr(case.bird.material, "viscosity", 0.0) > self.fails_above:
            raise RunFailed("the step collapsed", "lower solver.courant")
        return synthetic.simulate(case)


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch) -> Solver:
    """In place of the embedded solver, in the campaign (on threads) and in the verification."""
    stand_in = Solver()
    monkeypatch.setattr("birdstrike.solver.simulate.simulate", stand_in)
    monkeypatch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
    stand_in_for_models(monkeypatch, stand_in)
    return stand_in


@pytest.fixture
def short_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page of one section and a short posterior, where neither is what is tested."""
    monkeypatch.setattr("birdstrike.reports.page.page.SECTIONS", (summary.section,))
    monkeypatch.setattr("birdstrike.reports.page.page.run_models", lambda results, _: results)
    short = partial(Sampling, walkers=16, chunk=20, most=20)
    monkeypatch.setattr("birdstrike.inversion.train_and_invert.Sampling", short)


@pytest.fixture
def campaign_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Inversion and report leave empty files, where they are not what is tested."""

    def invert(plan: Any, _: object) -> None:
        plan.inversion.mkdir(parents=True, exist_ok=True)
        for name in ("inversion.json", "verification.csv"):
            (plan.inversion / name).write_text("{}")

    monkeypatch.setattr("birdstrike.loop._inversion", invert)
    monkeypatch.setattr("birdstrike.loop._report", lambda plan, _: plan.report.write_text("a page"))
    monkeypatch.setattr("birdstrike.loop.conclude", lambda plan: plan.ledger.read())


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """A record that the stand-in can produce."""
    return write_record(tmp_path / "shot7.csv")


def invoke(out: Path, measured: Path | str, *options: str, design: str = "lhs") -> Result:
    """The command on the demo case with one worker; lhs is the design that costs least to make."""
    settings = {"--measured": measured, "--out": out, "--runs": RUNS, "--workers": 1, "--design": design}
    named = [str(word) for pair in settings.items() for word in pair]
    return CliRunner().invoke(app, ["close-the-loop", "demo", "--no-diagnosis", *named, *options])


def close(out: Path, measured: Path, **options: Any) -> dict[str, Any]:
    """The same in Python."""
    asked = {"design": "lhs", "runs": RUNS, "workers": 1, "say": lambda _: None, **options}
    return close_the_loop(asked.pop("case", "demo"), measured, out, **asked)


def ledger(out: Path) -> dict[str, Any]:
    return json.loads((out / "close_the_loop.json").read_text(encoding="utf-8"))


def reused(out: Path) -> dict[str, bool]:
    return {name: stage["reused"] for name, stage in ledger(out)["stages"].items()}


def test_one_command_ends_with_the_page_and_five_findings(solver: Solver, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    result = invoke(out, "table7_group5", design="uniform")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[-7] == f"Report: {out / 'report.html'}"
    found, last = lines[-6:-1], lines[-1]
    assert [line[:2] for line in found] == ["1.", "2.", "3.", "4.", "5."]
    assert last == f"Next: open {out / 'report.html'} in a browser; the cards: birdstrike export {out}"
    assert "simulated by LS-DYNA, not measured" in found[0]
    for heading in ("Check", "Campaign: 12 runs, uniform design", "Inversion", "Report"):
        assert any(line.startswith(heading) for line in lines), heading
    assert solver.strikes == RUNS + 2 + 4, "the campaign, two verifications, four bird models"
    noted = ledger(out)
    assert noted["schema_version"] == 1
    assert noted["seed"] == 0
    assert [f"{i}. {line}" for i, line in enumerate(noted["findings"], 1)] == found
    assert noted["paths"]["report"] == str(out / "report.html")
    inversion = json.loads((out / "inversion" / "inversion.json").read_text())
    assert noted["figures"]["methods"]["emulator"]["verified_rmse"] == inversion["methods"]["emulator"]["verified_rmse"]
    assert all(stage["seconds"] > 0 for stage in noted["stages"].values())
    assert "the model cannot produce this curve" in result.stdout


@pytest.mark.usefixtures("short_page")
def test_run_again_nothing_is_due_and_another_record_keeps_the_campaign(
    solver: Solver, record: Path, tmp_path: Path
) -> None:
    """Closed by the Python verb, then again by the command."""
    out, said = tmp_path / "loop", list[str]()
    first = close(out, record, diagnosis=False, say=said.append)["findings"]
    assert len(first) == 5
    assert any("inactive" in line for line in said)
    assert solver.strikes == RUNS + 2
    page = (out / "report.html").stat().st_mtime_ns
    result = invoke(out, record, "--json")
    assert result.exit_code == 0, result.output
    assert solver.strikes == RUNS + 2
    assert (out / "report.html").stat().st_mtime_ns == page
    assert reused(out) == {"doe": True, "inversion": True, "report": True}
    assert json.loads(result.stdout.splitlines()[-1])["findings"] == ledger(out)["findings"] == first
    write_record(record, peak=5.3e-3, period=2.42e-3)
    assert invoke(out, record).exit_code == 0
    assert reused(out) == {"doe": True, "inversion": False, "report": False}
    assert solver.strikes <= RUNS + 2 + 2
    assert [a != b for a, b in zip(first, ledger(out)["findings"], strict=True)][:4] == [True] * 4


@pytest.mark.usefixtures("short_page", "solver")
def test_where_the_emulator_is_too_coarse_the_loop_names_an_option_of_its_own(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It advised `--refine N`, which train-and-invert has."""
    monkeypatch.setattr(
        "birdstrike.inversion.invert.emulator_or_model",
        lambda found, *_: replace(found, inside=False, coarse="it predicts poorly"),
    )
    out = tmp_path / "loop"
    close(out, record, diagnosis=False)
    told = " ".join(json.loads((out / "inversion" / "inversion.json").read_text(encoding="utf-8"))["warnings"])
    assert "add runs (--runs N)" in told
    assert "--refine" not in told


@pytest.mark.usefixtures("campaign_only")
def test_another_design_takes_the_folder_over_and_uses_the_strikes_that_it_shares(
    solver: Solver, record: Path, tmp_path: Path
) -> None:
    out = tmp_path / "loop"
    for seed in (0, 1):
        close(out, record, seed=seed, diagnosis=False)
        assert reused(out)["doe"] is False
    after = solver.strikes
    close(out, record, diagnosis=False)
    assert reused(out)["doe"] is False
    assert solver.strikes == after, "the first design's strikes are still in the store"


@pytest.mark.usefixtures("short_page")
def test_a_campaign_that_the_loop_did_not_make_is_not_taken_over(solver: Solver, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    options = ["run-doe", "demo", "--out", str(out / "doe"), "--runs", "6", "--workers", "1", "--design", "lhs"]
    assert CliRunner().invoke(app, options).exit_code == 0
    for _ in range(2):
        result = invoke(out, record)
        assert result.exit_code == 1
        assert "holds a campaign with the lhs design of 6 runs" in result.stderr
    assert solver.strikes == 6


@pytest.mark.usefixtures("campaign_only")
def test_after_ctrl_c_the_finished_strikes_are_kept(solver: Solver, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    solver.stops = 8
    result = invoke(out, record)
    assert result.exit_code == 130
    assert "run the same command again to resume" in result.stderr
    kept = len(list((out / "doe" / "runs").glob("*.h5")))
    assert 0 < kept < RUNS
    solver.strikes, solver.stops = 0, 0
    close(out, record, diagnosis=False)
    assert solver.strikes == RUNS - kept


@pytest.mark.usefixtures("short_page")
def test_a_strike_that_fails_is_reported_and_the_rest_is_used(solver: Solver, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    solver.fails_above = 1500.0 * (1 - 1 / RUNS)  # a Latin hypercube has one strike in the topmost of its layers
    result = invoke(out, record)
    assert result.exit_code == 2
    assert "runs of the campaign failed and are left out: run " in result.stderr
    assert solver.strikes == RUNS + 1 + 2, "the failing one twice, and two verifications"
    (reason,) = ledger(out)["failed_strikes"].values()
    assert "the step collapsed" in reason
    assert (out / "report.html").is_file()
    assert f"{RUNS + 1} simulations used, 1 more failed" in ledger(out)["findings"][4]


def test_mistakes_are_named_before_any_strike_is_paid_for(solver: Solver, record: Path, tmp_path: Path) -> None:
    out = tmp_path / "loop"
    strange = tmp_path / "strange.csv"
    strange.write_text(record.read_text().replace("displacement_centre", "displacement_rim"))
    forces = tmp_path / "forces.csv"
    forces.write_text(record.read_text().replace("displacement_centre [mm]", "displacement_centre [kN]"))
    table6 = str(REFERENCE / "table6_design.csv")
    for result, words in (
        (invoke(out, strange), "strange.csv is no sensor of case demo; sensors: displacement_centre"),
        (invoke(out, forces), "has unit N, the sensor m"),
        (invoke(out, "table7_group9"), "table7_group5"),
        (invoke(out, record, design=table6), "rank 1 of 4"),
        (invoke(out, record, "--set", "bird.speeed=3 m/s"), "bird.speeed"),
        (invoke(out, record, "--heldout", str(record)), "leave out --heldout or --no-diagnosis"),
        (invoke(out, record, "--diagnosis", "--heldout", str(forces)), "forces.csv has unit N, the sensor m"),
        (invoke(out, record, "--diagnosis", "--heldout", str(record)), "hold the same"),
    ):
        assert result.exit_code == 1, result.output
        assert words in result.stderr
        assert "Traceback" not in result.output
    with pytest.raises(UserError):
        close(out, record, case="no_such_case")
    assert solver.strikes == 0
    assert not out.exists()


@pytest.mark.usefixtures("campaign_only")
def test_the_diagnosis_gets_the_held_out_record_and_a_baseline_that_cannot_serve_is_told_at_once(
    solver: Solver, record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other, strange = write_record(tmp_path / "shot8.csv", peak=5.4e-3), tmp_path / "strange.csv"
    strange.write_text(record.read_text().replace("displacement_centre", "displacement_rim"))
    asked, told = list[Any](), list[str]()

    def diagnose(*given: Any, **_: Any) -> None:
        _, _, out, _, heldout = given
        asked.append(heldout)
        assert solver.strikes == RUNS
        out.mkdir(parents=True, exist_ok=True)
        for name in ("diagnosis.json", "diagnosis.csv"):
            (out / name).write_text("{}")

    def say(line: str) -> None:
        told.append(line)
        assert "strange" not in line or not solver.strikes

    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", diagnose)
    close(tmp_path / "loop", record, heldout=other, baseline=[strange], say=say)
    assert asked == [other]
    assert any("strange" in line for line in told)


@pytest.mark.usefixtures("solver")
def test_a_diagnosis_of_other_options_does_not_stand_beside_a_new_inversion(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What report, export and predict read is gone; its simulations stay. Only left out, it stays too."""
    out, answer = tmp_path / "loop", tmp_path / "loop" / "diagnosis" / "diagnosis.json"

    def write(folder: Path, *names: str) -> None:
        (folder / "runs").mkdir(parents=True, exist_ok=True)
        for name in names:
            (folder / name).write_text("{}")

    def invert(_doe: Path, _measured: Path, folder: Path, **_: Any) -> None:
        write(folder, "inversion.json", "verification.csv")

    def diagnose(_case: Case, _measured: Path, folder: Path, *_: Any, **__: Any) -> None:
        write(folder, "diagnosis.csv", "model.npz", "case.toml", "demo_with_impact_speed.toml")
        written_diagnosis(folder, case_after="demo_with_impact_speed.toml")

    monkeypatch.setattr("birdstrike.inversion.train_and_invert.train_and_invert", invert)
    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", diagnose)
    monkeypatch.setattr("birdstrike.loop._report", lambda plan, _: plan.report.write_text("a page"))
    monkeypatch.setattr("birdstrike.loop.conclude", lambda plan: plan.ledger.read())
    close(out, record)
    close(out, record, diagnosis=False)
    assert answer.is_file()
    close(out, record, diagnosis=False, trainer="adam")
    assert answer.is_file()
    close(out, record, diagnosis=False, seed=1)
    assert [path.name for path in answer.parent.iterdir()] == ["runs"]


@pytest.mark.usefixtures("solver")
def test_the_report_is_made_again_where_something_that_it_shows_has_changed(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, made = tmp_path / "loop", []

    def write(plan: LoopPlan, _: Any) -> None:
        made.append(plan.report.write_text("a page"))

    monkeypatch.setattr("birdstrike.loop._report", write)
    monkeypatch.setattr("birdstrike.loop.conclude", lambda plan: plan.ledger.read())
    for count in (1, 1):
        close(out, record, diagnosis=False)
        assert len(made) == count
    draws = out / "inversion" / "posterior.csv"
    draws.write_text(draws.read_text().replace("\n", "\n\n", 1))
    (out / "comparison").mkdir()
    for count, change in ((2, lambda: None), (3, lambda: (out / "comparison" / "comparison.json").write_text("{}"))):
        change()
        close(out, record, diagnosis=False)
        assert len(made) == count


def test_help_has_an_example() -> None:
    result = CliRunner().invoke(app, ["close-the-loop", "--help"])
    assert "Example: birdstrike close-the-loop demo --measured table7_group5 --out loop" in " ".join(
        result.output.split()
    )


@pytest.mark.usefixtures("short_page")
def test_a_finished_campaign_is_adopted_and_not_run_again(solver: Solver, record: Path, tmp_path: Path) -> None:
    campaign, out = tmp_path / "my campaign", tmp_path / "loop"
    run_campaign_of_the_stand_in(campaign)
    before, paid = sorted(path.stat().st_mtime_ns for path in campaign.rglob("*")), solver.strikes
    adopting = ["close-the-loop", "demo", "--no-diagnosis", "--measured", str(record), "--doe", str(campaign)]
    result = CliRunner().invoke(app, [*adopting, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert solver.strikes == paid + 2, "the two verifications alone"
    assert f"Campaign: 6 runs, lhs design, adopted from {campaign}" in result.stdout
    assert not (out / "doe").exists()
    assert sorted(path.stat().st_mtime_ns for path in campaign.rglob("*")) == before
    again = CliRunner().invoke(app, [*adopting, "--out", str(out)])
    assert "Nothing was due." in again.stdout


def run_campaign_of_the_stand_in(folder: Path, *settings: str) -> None:
    """A finished campaign of six runs."""
    words = ["run-doe", "demo", "--out", str(folder), "--runs", "6", "--workers", "1", "--design", "lhs", *settings]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output


def test_a_campaign_that_does_not_fit_is_refused_with_what_differs(
    solver: Solver, record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign, out = tmp_path / "campaign", tmp_path / "loop"
    run_campaign_of_the_stand_in(campaign)
    paid = solver.strikes

    def refusal(*options: str) -> str:
        words = ["close-the-loop", "demo", "--measured", str(record), "--doe", str(campaign), "--out", str(out)]
        result = CliRunner().invoke(app, [*words, *options])
        assert result.exit_code == 1, result.output
        return result.stderr

    assert "impact.speed is 91.1 there and 80.0 here (SI)" in refusal("--set", "impact.speed=80 m/s")
    narrower = 'inversion.parameters."bird.material.viscosity".range=["0 Pa s", "900 Pa s"]'
    said = refusal("--set", narrower)
    assert "the campaign varied bird.material.viscosity 0 .. 1500 Pa s" in said
    assert "the case seeks bird.material.viscosity 0 .. 900 Pa s" in said
    assert "leave them out beside --doe" in refusal("--runs", "30")
    with monkeypatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.adoption.solver_for", lambda _: type("Other", (), {"version": "other"}))
        assert "this is other: repeat birdstrike run-doe" in refusal()
    curves = campaign / "curves.csv"
    curves.write_text(curves.read_text().replace("1", "2", 1))
    assert "has been edited since the campaign wrote it" in refusal()
    (campaign / "summary.json").write_text('{"state": "running"}')
    assert "it was stopped midway: run the same birdstrike run-doe again" in refusal()
    (campaign / "summary.json").unlink()
    (campaign / ".birdstrike.json").write_text('{"command": "simulate"}')
    assert "birdstrike simulate made this folder; give one of: birdstrike run-doe" in refusal()
    assert solver.strikes == paid
    assert not out.exists()


def test_progress_of_a_diagnosis_never_goes_back() -> None:
    """Its planned simulations are followed by batches whose number nobody knows beforehand."""
    shown: list[float] = []
    counted = onwards(shown.append)
    for total, finished in ((4, 0), (4, 2), (4, 4), (2, 0), (2, 2), (1, 0), (1, 1)):
        counted(RunCounts(total, finished, 0, 0, 0))
    assert shown == sorted(shown)
    assert shown[2] == pytest.approx(0.8)
    assert 0.9 < shown[-1] < 1.0
