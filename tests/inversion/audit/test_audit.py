"""The command on a truth of its own making: made, answered, scored, resumed."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.cli.audit import typed
from birdstrike.data.errors import UserError
from birdstrike.inversion.audit.answers import answer_key, answered, records
from birdstrike.inversion.audit.audit import audit as run_audit
from birdstrike.inversion.audit.records import experiment_of, find_experiments, read_truth
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
from birdstrike.solver.case.case import load_case
from birdstrike.solver.case.write import case_toml
from birdstrike.solver.effects.registry import effects
from tests.inversion.diagnosis.rig import SOUGHT, few_simulations, tiny


@dataclass(frozen=True)
class Bench:
    """Folder with case.toml and the command's first result: one truth, one record of it answered."""

    folder: Path
    first: Result

    def audit(self, *words: str) -> Result:
        return audit(self.folder, *words)


def audit(folder: Path, *words: str) -> Result:
    given = ["--out", str(folder / "out"), "--case", str(folder / "case.toml"), "--workers", "1", "--seed", "3"]
    with few_simulations(particles=100) as patch:
        sought = {name: effects()[name] for name in (*SOUGHT, "sensor_gain")}
        patch.setattr("birdstrike.inversion.audit.draws.effects", lambda: sought)
        return CliRunner().invoke(app, ["audit", *given, *words], env={"COLUMNS": "200"})


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """The command has made one truth and answered one record of it."""
    folder = tmp_path_factory.mktemp("bench")
    case = tiny().with_mesh(100, (8, 6)).overlaid({"time": {"end": "0.6 ms"}})
    (folder / "case.toml").write_text(case_toml(case), encoding="utf-8")
    return Bench(folder, audit(folder, "--make", "1", "--most", "1"))


def test_a_truth_is_made_answered_and_scored(bench: Bench) -> None:
    assert bench.first.exit_code == 0, bench.first.output
    out = bench.folder / "out"
    content = json.loads((out / "audit.json").read_text(encoding="utf-8"))
    assert (content["records"], content["not_answered"], content["complete"]) == (1, 11, False)
    assert content["failed"] == {}
    (entry,) = content["tables"].values()
    (line,) = entry["experiments"]
    assert 0.0 <= line["p"] <= 1.0
    assert line["confidence_set"]
    if line["kind"] == "single":
        assert line["signal"] > 0.0
        assert line["rank"] >= 1
    names = {path.name for path in (out / "experiments").iterdir()}
    assert {"truth_000_1.csv", "truth_000_1.truth.toml", "truth_000_8.shot3.csv", "truth_000_8.baseline.csv"} <= names
    said = {i: load_case(out / "experiments" / f"truth_000_{i}.toml").diagnosis.baseline_bird for i in (2, 9)}
    assert said == {2: "auto", 9: "same"}
    assert "has not been run to the end" in (out / "audit.md").read_text(encoding="utf-8")
    assert (out / "audit.html").is_file()


def test_run_again_it_makes_nothing_anew(bench: Bench) -> None:
    out = bench.folder / "out"
    kept = [*(out / "answers").iterdir(), *(out / "experiments").iterdir(), *(out / "truths").iterdir()]
    assert any(path.parent.name == "truths" for path in kept)
    before = {path: path.stat().st_mtime_ns for path in kept}
    again = bench.audit("--make", "1", "--most", "1")
    assert again.exit_code == 0, again.output
    assert {path: path.stat().st_mtime_ns for path in kept} == before


def test_a_record_that_cannot_be_diagnosed_is_counted_apart_and_tried_again_when_asked(bench: Bench) -> None:
    made = bench.folder / "out" / "experiments"
    alone = bench.folder / "alone"
    alone.mkdir()
    for name in ("truth_000_1.toml", "truth_000_1.truth.toml", "truth_000.curves"):
        (alone / name).write_text((made / name).read_text(encoding="utf-8"), encoding="utf-8")
    (alone / "truth_000_1.csv").write_text("time [ms],no_such_sensor [mm]\n0,0.1\n0.1,0.2\n0.6,0.3\n")
    out = bench.folder / "other"
    words = ["audit", "--experiments", str(alone), "--out", str(out)]
    found = CliRunner().invoke(app, words)
    assert found.exit_code == 2, found.output
    assert "no record has an answer; the first says: " in found.stderr
    content = json.loads((out / "audit.json").read_text(encoding="utf-8"))
    assert content["records"] == 0
    assert "no_such_sensor" in content["failed"]["truth_000_1"]
    stored = out / "answers" / "truth_000_1.json"
    before = stored.stat().st_mtime_ns
    CliRunner().invoke(app, words)
    assert stored.stat().st_mtime_ns == before
    CliRunner().invoke(app, [*words, "--retry-failed"])
    assert stored.stat().st_mtime_ns > before


def test_a_record_whose_case_cannot_be_read_fails_alone(bench: Bench, tmp_path: Path) -> None:
    made = bench.folder / "out" / "experiments"
    for name in ("truth_000_1.csv", "truth_000_1.truth.toml", "truth_000.curves"):
        shutil.copy(made / name, tmp_path)
    (tmp_path / "truth_000_1.toml").write_text('extends = "no_such_case"\n', encoding="utf-8")
    (experiment,) = find_experiments(tmp_path)
    assert "no_such_case" in answered(experiment, tmp_path, DiagnosisOptions())["failed"]


def test_an_answer_is_of_all_that_made_it(bench: Bench, tmp_path: Path) -> None:
    """The case that the record's own extends, every option that moves an answer, and the curves under drawn noise."""
    made = bench.folder / "out" / "experiments"
    for name in ("truth_000_1.csv", "truth_000_1.truth.toml", "truth_000.curves"):
        shutil.copy(made / name, tmp_path)
    parent = tmp_path / "rig.toml"
    parent.write_text(case_toml(tiny()), encoding="utf-8")
    (tmp_path / "truth_000_1.toml").write_text('extends = "rig.toml"\n', encoding="utf-8")
    (experiment,), usual = find_experiments(tmp_path), DiagnosisOptions()
    before = answer_key(experiment, usual, 0), answer_key(experiment, usual, 1)
    assert answer_key(experiment, replace(usual, workers=2, retry=1.0), 0) == before[0]
    others = [replace(usual, refine=0), replace(usual, baseline_bird="other"), replace(usual, seed=1)]
    assert len({before[0], *(answer_key(experiment, one, 0) for one in others)}) == 4
    curves = tmp_path / "truth_000.curves"
    curves.write_text(curves.read_text().replace(",0.", ",1."))
    assert answer_key(experiment, usual, 0) == before[0]
    assert answer_key(experiment, usual, 1) != before[1]
    parent.write_text(case_toml(tiny().overlaid({"plate": {"thickness": "9 mm"}})), encoding="utf-8")
    assert answer_key(experiment, usual, 0) != before[0]


def test_records_are_chosen_by_their_baseline(bench: Bench) -> None:
    made = find_experiments(bench.folder / "out" / "experiments")
    kinds = {kind: [one.name for one in made if one.baseline_kind == kind] for kind in ("none", "another", "own")}
    assert {kind: len(names) for kind, names in kinds.items()} == dict.fromkeys(kinds, 4)
    with pytest.raises(UserError, match='--baselines "same" is unknown; available: none, another, own'):
        run_audit(None, bench.folder / "out", make=1, baselines="same")
    alone = bench.folder / "without"
    shutil.copytree(bench.folder / "out" / "experiments", alone)
    for name in kinds["own"]:
        (alone / f"{name}.csv").unlink()
    with pytest.raises(UserError, match="has 1 shot and --baselines own"):
        run_audit(alone, bench.folder / "answers", shots=1, baselines="own")


def test_experiments_of_ones_own_and_truths_to_be_made_exclude_each_other(tmp_path: Path) -> None:
    words = ["audit", "--experiments", str(tmp_path), "--make", "1", "--out", str(tmp_path / "out")]
    found = CliRunner().invoke(app, words)
    assert found.exit_code == 1
    assert "exclude each other" in found.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--channels", "9"), "has 9 channels: its records have 1 or 4 channels, 1 or 3 shots and --baselines none"),
        (("--shots", "2"), "has 2 shots: its records have 1 or 4 channels"),
    ],
)
def test_records_that_no_truth_can_have_are_refused_before_it_is_simulated(
    tmp_path: Path, words: tuple[str, str], message: str
) -> None:
    found = CliRunner().invoke(app, ["audit", "--make", "1", "--out", str(tmp_path / "out"), *words])
    assert found.exit_code == 1
    assert message in " ".join(found.output.split())
    assert not (tmp_path / "out" / "truths").exists()


def test_a_case_without_truths_to_be_made_is_refused(tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["audit", "--case", "no_such_case", "--out", str(tmp_path / "out")])
    assert found.exit_code == 1
    assert "--case = no_such_case: it is of truths that are made" in found.output


def test_the_command_is_stored_with_every_option_that_moves_its_figures(bench: Bench) -> None:
    content = json.loads((bench.folder / "out" / "audit.json").read_text(encoding="utf-8"))
    assert content["command"] == "birdstrike audit --out audit --make 1 --case case.toml --most 1 --seed 3"
    assert typed({"make": 0, "most": None, "no-confirm": True, "alpha": 0.1}) == (
        "birdstrike audit --out audit --no-confirm --alpha 0.1"
    )


def test_a_rate_of_false_alarms_that_is_none_is_refused_before_a_truth_is_simulated(tmp_path: Path) -> None:
    for alpha in ("2", "0", "nan"):
        found = CliRunner().invoke(app, ["audit", "--make", "1", "--alpha", alpha, "--out", str(tmp_path / "out")])
        assert found.exit_code == 1
        assert f"--alpha = {float(alpha)} is not above 0 and below 0.5" in found.output
    assert not (tmp_path / "out" / "truths").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--seed", "4"), "holds truths of --seed 3, such as truth_000_1.truth.toml"),
        (("--case", "synthetic_strike"), "--case = synthetic_strike: "),
    ],
)
def test_truths_of_another_seed_or_case_are_not_taken_for_those_asked_for(
    bench: Bench, words: tuple[str, str], message: str
) -> None:
    known = (bench.folder / "out" / "audit.json").read_bytes()
    found = bench.audit("--make", "1", "--most", "1", *words)
    assert found.exit_code == 1, found.output
    assert message in found.output
    assert "another --out" in found.output
    assert (bench.folder / "out" / "audit.json").read_bytes() == known


def test_truth_files_that_cannot_be_read_are_all_named_before_a_record_is_diagnosed(
    bench: Bench, tmp_path: Path
) -> None:
    shutil.copytree(bench.folder / "out" / "experiments", tmp_path / "given")
    for name in ("truth_000_2", "truth_000_5"):
        (tmp_path / "given" / f"{name}.truth.toml").write_text("kind = [", encoding="utf-8")
    found = CliRunner().invoke(app, ["audit", "--experiments", str(tmp_path / "given"), "--out", str(tmp_path / "out")])
    assert found.exit_code == 1
    assert "truth_000_2.truth.toml is no truth file" in found.output
    assert "truth_000_5.truth.toml is no truth file" in found.output
    assert not (tmp_path / "out" / "diagnoses").exists()


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ({"most": 0}, "--most = 0 is below 1"),
        ({"channels": 0}, "--channels = 0 is below 1"),
        ({"shots": -1}, "--shots = -1 is below 1"),
        ({"forms": -1}, "--make-forms = -1 is below 0"),
        ({"draws": 0}, "--draws = 0 is below 1; 1 takes each record as it is"),
    ],
)
def test_a_count_that_is_none_is_refused_in_python_too(
    bench: Bench, tmp_path: Path, counts: dict[str, Any], message: str
) -> None:
    with pytest.raises(UserError, match=message):
        run_audit(bench.folder / "out" / "experiments", tmp_path / "out", **counts)


def test_further_draws_put_other_noise_of_the_stated_level_on_the_truth_s_own_curve(bench: Bench) -> None:
    one = experiment_of(bench.folder / "out" / "experiments" / "truth_000_1.csv")
    clean = read_truth(one.truth)
    drawn = [records(one, noise, 0)[0] for noise in (0, 1, 2)]
    (channel,) = drawn[0].channels
    curve = np.interp(drawn[0].time, clean.time, clean.curves["shot1"][channel])
    off = [record.channels[channel] - curve for record in drawn]
    for noise in off:
        assert np.std(noise) == pytest.approx(2e-5, rel=0.3)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert abs(np.corrcoef(off[a], off[b])[0, 1]) < 0.4
