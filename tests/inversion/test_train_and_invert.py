"""From a campaign's folder and a measured file to a folder with everything in it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import birdstrike.inversion.forward
from birdstrike.data.curves import Measured, read_histories, write_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.observations.filters import zero_phase
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.surrogate.files import load_emulator, load_network
from tests.inversion import small_campaign
from tests.inversion.stand_in import CHANNEL, pulse

PLAIN = Extras(refine=0, posterior=False)  # linearised intervals, no profiles, no run added
FIXED = Extras(refine=0)
VISCOSITY, CUTOFF = "bird.material.viscosity", "bird.material.pressure_cutoff"


@pytest.fixture(autouse=True)
def formula_for_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)


@pytest.fixture(scope="module")
def doe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loop") / "doe"
    small_campaign.build(folder)
    return folder


@pytest.fixture(scope="module")
def measured(doe: Path) -> Path:
    return small_campaign.write_record(doe.parent / "record.csv")


@pytest.fixture(scope="module")
def out(doe: Path, measured: Path) -> Path:
    """The folder of a finished inversion."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)
        train_and_invert(doe, measured, doe.parent / "inversion", extras=FIXED)
    return doe.parent / "inversion"


def test_truth_is_found_and_every_file_is_there(out: Path) -> None:
    found = Inversion.load(out / "inversion.json")
    answer = found.methods["emulator"].parameters
    for name, expected in ((VISCOSITY, 600.0), (CUTOFF, -0.5e6)):
        interval = answer[name].interval_95
        assert answer[name].identified
        assert interval is not None
        assert interval[0] < expected < interval[1]
    assert not answer["bird.material.tension_erosion"].identified
    assert not answer["bird.material.compression_erosion"].identified
    names = {path.name for path in out.iterdir()}
    assert names >= {"inversion.json", "verification.csv", "training.csv", "network.npz", "emulator.npz", "runs"}
    assert names >= {"verified_network.csv", "verified_emulator.csv"}
    assert found.measured.noise_source == {CHANNEL: "case"}
    assert found.time_offset.sigma == pytest.approx(0.1e-3)  # the reference strike's nuisance


def test_verified_runs_are_in_the_store_under_the_key_in_the_json(out: Path) -> None:
    for method, answer in json.loads((out / "inversion.json").read_text())["methods"].items():
        stored = RunStore(out / "runs").load(answer["run"])
        assert stored is not None
        written = read_histories(out / f"verified_{method}.csv")
        np.testing.assert_allclose(written.channels[CHANNEL], stored.channels[CHANNEL], atol=1e-12)


def test_second_call_pays_no_run(
    doe: Path, measured: Path, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    again = shutil.copytree(out, tmp_path / "again")
    monkeypatch.setattr(
        birdstrike.inversion.forward, "simulate", lambda *_args, **_options: pytest.fail("a run was paid twice")
    )
    assert train_and_invert(doe, measured, again, extras=FIXED) == Inversion.load(out / "inversion.json")


def test_an_answer_leaves_no_file_of_the_one_before(doe: Path, measured: Path, tmp_path: Path) -> None:
    """An answer without a posterior or a network had those of the record before it beside it, and in its evidence."""
    folder = tmp_path / "out"
    both = train_and_invert(doe, measured, folder, extras=FIXED)
    assert both.posterior is not None
    assert {"posterior.csv", "network.npz", "training.csv", "verified_network.csv"} <= {
        p.name for p in folder.iterdir()
    }
    train_and_invert(doe, measured, folder, method="emulator", extras=PLAIN)
    alone = tmp_path / "alone"
    train_and_invert(doe, measured, alone, method="emulator", extras=PLAIN)
    assert {p.name for p in folder.iterdir()} == {p.name for p in alone.iterdir()}


def test_an_interruption_leaves_no_answer_beside_files_of_another(
    out: Path, doe: Path, measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "again"
    shutil.copytree(out, folder)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("birdstrike.inversion.train_and_invert.copy_case", killed)
    with pytest.raises(KeyboardInterrupt):
        train_and_invert(doe, measured, folder, seed=7)
    assert not (folder / "inversion.json").exists()


def test_run_that_the_campaign_holds_is_not_paid(
    doe: Path, measured: Path, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    merged = shutil.copytree(doe, tmp_path / "doe")
    for run in (out / "runs").glob("*.h5"):
        shutil.copy(run, merged / "runs")
    monkeypatch.setattr(
        birdstrike.inversion.forward, "simulate", lambda *_args, **_options: pytest.fail("a run was paid twice")
    )
    found = train_and_invert(merged, measured, tmp_path / "second", extras=PLAIN).methods
    expected = Inversion.load(out / "inversion.json").methods
    assert {name: answer.run for name, answer in found.items()} == {name: one.run for name, one in expected.items()}


def test_trained_models_can_be_read_back(out: Path) -> None:
    found = Inversion.load(out / "inversion.json")
    network, emulator = load_network(out / "network.npz"), load_emulator(out / "emulator.npz")
    assert found.training is not None
    assert str(network.shape) == found.training.shape
    theta = np.array([[answer.value for answer in found.methods["emulator"].parameters.values()]], dtype=float)
    curve, _ = emulator.predict(theta, CHANNEL)
    truth = small_campaign.curve(theta[0, 1], theta[0, 0])
    np.testing.assert_allclose(
        np.interp(small_campaign.TIME, emulator.channels[CHANNEL].time, curve[0]), truth, atol=2e-5
    )


def test_the_case_states_a_discrepancy_and_the_option_replaces_it(doe: Path, measured: Path, tmp_path: Path) -> None:
    case = load_case("reference_strike", {f"inversion.discrepancy.{CHANNEL}": "5 %"})

    def found(share: float | None) -> tuple[tuple[str, ...], float]:
        extras = Extras(posterior=False, discrepancy=share)
        answer = train_and_invert(doe, measured, tmp_path / f"{share}", method="emulator", case=case, extras=extras)
        low, high = answer.methods["emulator"].parameters[VISCOSITY].interval_95 or (0.0, 0.0)
        return answer.known_errors, high - low

    (said, width), (without, narrow) = found(None), found(0.0)
    assert said == (f"a stated discrepancy of 5 % of the peak of {CHANNEL}",)
    assert without == ()
    assert width > 2.0 * narrow > 0.0


def test_an_uncertain_speed_is_carried_by_two_simulations_which_the_answer_counts(
    doe: Path, measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = load_case("reference_strike", {"inversion.nuisance.speed": "1 m/s"})
    speeds: list[float] = []

    def counted(case: Case, **options: Any) -> Histories:
        speeds.append(case.impact.speed)
        return small_campaign.strike(case, **options)

    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", counted)
    extras = Extras(posterior=False, refine=0)
    answer = train_and_invert(doe, measured, tmp_path / "out", method="emulator", case=case, extras=extras)
    assert answer.known_errors == ("uncertain speed: ± 1 m/s (2 simulations at the first best fit)",)
    assert len([speed for speed in speeds if speed != case.impact.speed]) == 2


def test_mesh_correction_finds_the_truth_that_the_coarse_mesh_misses(
    doe: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a mesh of half the size curves are 5 % larger at the lowest viscosity, 2 % at the highest; the record too."""
    declared = load_case("reference_strike")

    def meshed(case: Case, **options: Any) -> Histories:
        run = small_campaign.strike(case, **options)
        finer = case.bird.particles == 8 * declared.bird.particles
        assert finer == (case.plate.elements == tuple(2 * n for n in declared.plate.elements))
        return replace(run, channels={n: y * (grown(case) if finer else 1.0) for n, y in run.channels.items()})

    def grown(case: Case) -> float:
        return 1.05 - 0.03 * case.bird.material.viscosity / 1500.0

    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", meshed)
    record = small_campaign.write_record(tmp_path / "fine.csv", size=grown(declared.with_values({VISCOSITY: 600.0})))
    answers = {
        corrected: train_and_invert(
            doe,
            record,
            tmp_path / f"{corrected}",
            method="emulator",
            extras=Extras(refine=0, posterior=False, mesh_correction=corrected),
        )
        for corrected in (False, True)
    }
    estimates = {corrected: one.methods["emulator"].parameters[VISCOSITY] for corrected, one in answers.items()}
    held = {c: e.interval_95 is not None and e.interval_95[0] < 600.0 < e.interval_95[1] for c, e in estimates.items()}
    assert held == {False: False, True: True}
    assert estimates[True].identified
    (figures,) = answers[True].mesh_correction
    assert (figures.runs, figures.particles) == (10, 8 * declared.bird.particles)
    assert "10 simulations" in figures.sentence
    assert figures.error[CHANNEL] < 0.1 * figures.added[CHANNEL]
    best = answers[True].methods["emulator"].verified_rmse
    assert best is not None
    assert best < 4e-5, "verified on the fine mesh, to the noise of 0.03 mm"
    assert answers[False].mesh_correction == ()


def test_mesh_study_and_mesh_correction_are_not_both_carried(doe: Path, measured: Path, tmp_path: Path) -> None:
    both = Extras(mesh=tmp_path / "convergence.csv", mesh_correction=True)
    with pytest.raises(UserError, match="leave one out"):
        train_and_invert(doe, measured, tmp_path / "out", extras=both)


def test_convergence_file_is_the_training_that_is_reported(doe: Path, measured: Path, tmp_path: Path) -> None:
    found = train_and_invert(doe, measured, tmp_path, trainer="adam", method="network", extras=PLAIN)
    assert found.training is not None
    table = pd.read_csv(tmp_path / found.training.history)
    assert len(table) == found.training.epochs + 1
    assert float(np.min(table["mse"])) == pytest.approx(found.training.mse)
    assert found.training.trainer == "adam"
    assert not (tmp_path / "verified_emulator.csv").exists()


def test_a_campaign_of_another_case_is_refused(doe: Path, measured: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"was run for another case .* bird.length is 0.262 there and 0.156 here"):
        train_and_invert(doe, measured, tmp_path, case="reference_strike_156mm")
    assert not (tmp_path / "inversion.json").exists()


def test_a_seed_below_0_is_refused_before_anything_is_trained(doe: Path, measured: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--seed = -1 is below 0"):
        train_and_invert(doe, measured, tmp_path / "out", seed=-1)
    assert not (tmp_path / "out").exists()


def test_another_noise_is_not_another_case(doe: Path, measured: Path, tmp_path: Path) -> None:
    noisy = load_case("reference_strike", {"sensors.displacement_centre.noise": "0.1 mm"})
    found = train_and_invert(doe, measured, tmp_path, method="emulator", case=noisy, extras=PLAIN)
    assert found.measured.noise == {CHANNEL: pytest.approx(1e-4)}


def test_channel_without_a_sensor_is_refused(doe: Path, tmp_path: Path) -> None:
    (tmp_path / "strain.csv").write_text("time [ms],strain_1 [-]\n0.5,0.001\n1.0,0.002\n")
    with pytest.raises(MeasuredError, match="sensors: displacement_centre, contact_force, reaction_force"):
        train_and_invert(doe, tmp_path / "strain.csv", tmp_path / "out")


def test_folder_without_a_campaign_is_refused(measured: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="run-doe"):
        train_and_invert(tmp_path, measured, tmp_path / "out")


def test_shipped_curve_goes_by_its_name(doe: Path, tmp_path: Path) -> None:
    found = train_and_invert(doe, "table7_group5", tmp_path, extras=PLAIN)
    assert found.measured.simulated
    assert found.measured.points == {CHANNEL: 12}


def test_own_forward_model_takes_the_solvers_place(doe: Path, measured: Path, tmp_path: Path) -> None:
    seen: list[float] = []

    def external(theta):
        seen.append(theta[VISCOSITY])
        return small_campaign.strike(load_case("reference_strike").with_values(theta))

    found = train_and_invert(doe, measured, tmp_path, forward=external, extras=PLAIN)
    assert len(seen) == 2
    assert found.methods["emulator"].run is None
    assert not (tmp_path / "runs").exists()


def stored(out: Path) -> dict[str, Any]:
    return json.loads((out / "options.json").read_text(encoding="utf-8"))


def test_what_python_hands_over_can_be_asked_for_again(doe: Path, measured: Path, tmp_path: Path) -> None:
    """One channel was stored letter by letter, a case as none, a function in the solver's place not at all."""
    out, case = tmp_path / "out", load_case(doe / "case.toml")
    other = case.overlaid({"inversion": {"nuisance": {"speed": "1 m/s"}}})
    options = replace(PLAIN, channels=CHANNEL)
    train_and_invert(doe, measured, out, method="emulator", case=other, forward=own_model, extras=options)
    told = stored(out)
    assert told["extras"]["channels"] == [CHANNEL]
    assert told["cases"] == [str(out / "case.toml")]
    assert load_case(told["cases"][0]).inversion == other.inversion
    assert told["forward"] == f"{__name__}.own_model"
    train_and_invert(doe, measured, out, method="emulator", extras=PLAIN)
    assert (stored(out)["cases"], stored(out)["forward"]) == ([None], None)
    train_and_invert(doe, measured, out, method="emulator", case=str(doe / "case.toml"), extras=PLAIN)
    assert stored(out)["cases"] == [str(doe / "case.toml")]


def own_model(theta: Mapping[str, float]) -> Histories:
    return small_campaign.strike(load_case("reference_strike").with_values(theta))


def test_several_campaigns_need_a_case_for_each_record(doe: Path, measured: Path, tmp_path: Path) -> None:
    second = shutil.copytree(doe, tmp_path / "second")
    with pytest.raises(UserError, match="2 campaign folders were given and no --case"):
        train_and_invert([doe, second], [measured, measured], tmp_path / "out")


def test_a_campaign_that_no_record_uses_is_refused(doe: Path, measured: Path, tmp_path: Path) -> None:
    second = shutil.copytree(doe, tmp_path / "second")
    with pytest.raises(UserError, match=f"no record uses the campaign in {second}"):
        train_and_invert([doe, second], measured, tmp_path / "out", case="reference_strike")


@pytest.mark.parametrize(
    ("extras", "said"),
    [
        ({"copies": -1}, "copies = -1 is no whole number of at least 0"),
        ({"copies": 1.5}, "copies = 1.5 is no whole number of at least 0"),
        ({"hidden": 0}, "hidden = 0 is no whole number of at least 1"),
        ({"discrepancy": -0.02}, "discrepancy = -0.02 is outside 0 .. 1"),
        ({"discrepancy": "2 %"}, "discrepancy = '2 %' is outside 0 .. 1"),
        ({"discrepancy": float("nan")}, "discrepancy = nan is outside 0 .. 1"),
        ({"channels": "displacement_center"}, 'has no channel "displacement_center"'),
        ({"filter": "CFC12"}, 'filter = "CFC12" is unknown; use one of: CFC60, CFC180, CFC600, CFC1000'),
        ({"filtered": "CFC12"}, 'filtered = "CFC12" is unknown'),
        ({"filter": "CFC600", "filtered": "CFC600"}, "filter = CFC600 and filtered = CFC600 were both given"),
    ],
)
def test_extras_that_the_command_refuses_are_refused(
    doe: Path, measured: Path, tmp_path: Path, extras: dict[str, Any], said: str
) -> None:
    with pytest.raises(UserError, match=said):
        train_and_invert(doe, measured, tmp_path / "out", extras=Extras(**extras))


@pytest.mark.parametrize("none", [None, []])
def test_a_missing_record_is_named(doe: Path, tmp_path: Path, none: Any) -> None:
    with pytest.raises(UserError, match="--measured is missing"):
        train_and_invert(doe, none, tmp_path / "out")


def test_one_record_is_not_two_shots(doe: Path, measured: Path, tmp_path: Path) -> None:
    copy = shutil.copy(measured, tmp_path / "copy.csv")
    with pytest.raises(UserError, match=r"hold the same points; a record counts once"):
        train_and_invert(doe, [measured, copy], tmp_path / "out")


@pytest.mark.parametrize("content", ["node,x\na,b\n", "time_s,displacement_centre_m\n0,0\n1,1\n", ""])
def test_a_file_that_is_no_mesh_study_is_refused(doe: Path, measured: Path, tmp_path: Path, content: str) -> None:
    (tmp_path / "other.csv").write_text(content)
    with pytest.raises(UserError, match=r"other\.csv is no convergence\.csv of birdstrike converge"):
        train_and_invert(doe, measured, tmp_path / "out", extras=Extras(refine=0, mesh=tmp_path / "other.csv"))


def test_choices_of_a_network_are_refused_where_none_is_trained(doe: Path, measured: Path, tmp_path: Path) -> None:
    extras = replace(PLAIN, hidden=None, outputs="linear")
    with pytest.raises(UserError, match="so that --trainer, --hidden, --outputs would change nothing"):
        train_and_invert(doe, measured, tmp_path / "out", "adam", "emulator", extras=extras)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("by_laboratory", [False, True])
def test_a_filtered_record_gives_the_truth(doe: Path, tmp_path: Path, by_laboratory: bool) -> None:
    """A record that begins before the trigger and goes on after the simulation, filtered here or beforehand."""
    clock = np.arange(-2e-3, 5e-3, 5e-6)
    values = np.where(clock > 0.3e-3, pulse(np.array([5.6e-3, 2.5e-3, 0.14, 0.0]), clock), 0.0)
    values += 2e-5 * np.random.default_rng(3).normal(size=len(clock))
    values = zero_phase(values, 5e-6, "CFC600") if by_laboratory else values
    write_measured(tmp_path / "shot.csv", Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}))
    more = replace(PLAIN, **{"filtered" if by_laboratory else "filter": "CFC600"})
    found = train_and_invert(doe, tmp_path / "shot.csv", tmp_path / "out", method="emulator", extras=more)
    estimates = found.methods["emulator"].parameters
    for name, true in ((VISCOSITY, 600.0), (CUTOFF, -0.5e6)):
        low, high = estimates[name].interval_95 or (np.nan, np.nan)
        assert low < true < high
        assert high - low < 0.3 * (found.ranges[name][1] - found.ranges[name][0])
    score = found.methods["emulator"].channels[CHANNEL]
    assert (score.verified_rmse or 1.0) < 2e-5
    assert any("after 2.5 ms are left out of the fit" in text for text in found.warnings) is True
    stored = json.loads((tmp_path / "out" / "options.json").read_text())["filters"]
    assert stored == [{"name": "CFC600", "end": pytest.approx(3e-3), "step": pytest.approx(5e-6)}]


def test_filtered_shots_are_inverted_together(doe: Path, tmp_path: Path) -> None:
    """Each with its own end and its own reading at rest, which is subtracted before the filter."""
    paths: list[Path] = []
    for number, (end, offset) in enumerate(((5e-3, 0.0), (2.8e-3, 3e-4))):
        clock = np.arange(-2e-3, end, 5e-6)
        values = np.where(clock > 0.3e-3, pulse(np.array([5.6e-3, 2.5e-3, 0.14, 0.0]), clock), 0.0) + offset
        values += 2e-5 * np.random.default_rng(number).normal(size=len(clock))
        paths.append(tmp_path / f"{number}.csv")
        write_measured(paths[-1], Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}))
    more = replace(PLAIN, filter="CFC600")
    found = train_and_invert(doe, paths, tmp_path / "out", method="emulator", extras=more)
    for name, true in ((VISCOSITY, 600.0), (CUTOFF, -0.5e6)):
        low, high = found.methods["emulator"].parameters[name].interval_95 or (np.nan, np.nan)
        assert low < true < high
    zeroed = [text for text in found.warnings if "its zero is taken" in text]
    assert [text.startswith(f"{paths[1]}: displacement centre reads 0.") for text in zeroed] == [True]
    stored = json.loads((tmp_path / "out" / "options.json").read_text())["filters"]
    assert [one["end"] for one in stored] == pytest.approx([3e-3, 2.795e-3])


def test_the_case_of_every_shot_stays_with_the_answer(doe: Path, measured: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    lines = measured.read_text(encoding="utf-8").splitlines(keepends=True)
    other.write_text("".join(lines[:-1]), encoding="utf-8")
    out = tmp_path / "out"
    out.mkdir()
    (out / "case_3.toml").write_text("of an answer before this one", encoding="utf-8")
    found = train_and_invert(doe, [measured, other], out, method="emulator", extras=PLAIN)
    assert [case_hash(load_case(out / name)) for name in ("case.toml", "case_2.toml")] == [
        shot.case_hash for shot in found.shots
    ]
    assert not (out / "case_3.toml").exists()
