"""A formula in the solver's place: two shots at two speeds, one of them faster than stated and with a sensor more."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from birdstrike.data.curves import LONGEST, Measured, shot_names
from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.formatting import quantity
from birdstrike.inversion.diagnosis.conclusions.answer import sensors_left_out
from birdstrike.inversion.diagnosis.conclusions.baseline import Baselines
from birdstrike.inversion.diagnosis.conclusions.before_and_after import other_record
from birdstrike.inversion.diagnosis.conclusions.solver_update import _on
from birdstrike.inversion.diagnosis.diagnose import NamedRecord, described, diagnose, matched
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.inference.linearisation import Linearisation, Nearness, Places
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.diagnosis.inference.system import changed_by_effects, numerical_error, trends
from birdstrike.inversion.diagnosis.model_file import model_table
from birdstrike.inversion.diagnosis.pipeline import Pipeline
from birdstrike.inversion.diagnosis.preparation.discrepancy import STATED, Amplitudes
from birdstrike.inversion.diagnosis.preparation.shots import Record, Shot
from birdstrike.inversion.prediction.from_diagnosis import read_diagnosis
from birdstrike.inversion.results.diagnosis import ATTRIBUTED, NO_RESIDUAL, Diagnosis, errors
from birdstrike.inversion.results.diagnosis_files import curve_files, write
from birdstrike.inversion.results.diagnosis_text import _errors
from birdstrike.reports.explore.kinds.diagnosis import read
from birdstrike.reports.export.exported import read_export
from birdstrike.reports.page.diagnosis import write_diagnosis_page
from birdstrike.solver.case.case import Case, load_case
from tests.diagnoses import diagnosis, state, written_diagnosis
from tests.inversion.diagnosis.rig import few_simulations, tiny
from tests.inversion.diagnosis.test_late_and_slow import CENTRE, NOISE, SIDE, TIME, deflections, strike

FASTER = 6.0  # m/s, than stated
FAST = tiny().overlaid({"impact": {"speed": "110 m/s"}})


def shot(name: str, speed: float, seed: int, *channels: str, viscosity: float = 430.0) -> Measured:
    """What the sensors record."""
    rng, time = np.random.default_rng(seed), TIME[::2]
    curves = deflections(viscosity, speed, 6e-3)
    seen = {channel: curves[channel][::2] + NOISE * rng.standard_normal(len(time)) for channel in channels}
    sigma = {channel: np.full(len(time), NOISE) for channel in seen}
    return Measured(time, seen, sigma, dict.fromkeys(seen, "m"), ("SIMULATED by a formula",), f"{name}.csv")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the diagnosis."""
    return tmp_path_factory.mktemp("several") / "out"


@pytest.fixture(scope="module")
def rankings() -> list[Ranking]:
    """What the answer is made of."""
    return []


@pytest.fixture(scope="module")
def found(out: Path, rankings: list[Ranking]) -> Diagnosis:
    """Of `slow`, as its case states it but without one sensor, and `fast`."""

    def kept(ranking: Ranking, shots: tuple[Shot, ...], fits: dict[str, str]) -> dict[str, Any]:
        rankings.append(ranking)
        return model_table(ranking, shots, fits)

    records = [shot("slow", 80.0, 1, SIDE), shot("fast", 110.0 + FASTER, 2, CENTRE, SIDE)]
    with few_simulations(sought=("plate_thickness", "impact_speed")) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        patch.setattr("birdstrike.inversion.diagnosis.pipeline.model_table", kept)
        return diagnose([tiny(), FAST], records, out)


def test_the_magnitude_of_an_effect_of_one_shot_is_that_of_its_own_case(found: Diagnosis) -> None:
    """2 % of 80 m/s is the plausible size in one case, 2 % of 110 m/s in the other: it came out a quarter too small."""
    first = found.effects[0]
    assert first.name == "impact_speed@fast"
    assert first.magnitude == pytest.approx(FASTER, rel=0.05)
    assert first.interval_95 is not None
    assert first.interval_95[0] < FASTER < first.interval_95[1]
    after = found.shots[1].after
    assert after is not None
    assert after.solver is not None
    assert all(after.solver["rmse"][name] < 2.0 * NOISE for name in (CENTRE, SIDE))


def test_birds_of_several_shots_that_are_not_alike_are_each_calibrated_and_told(tmp_path: Path) -> None:
    """One bird was fitted to all shots: two sound records of two birds were "something else" with probability 1.00."""
    birds = {"slow": 180.0, "fast": 700.0}
    speeds, numbers = {"slow": 80.0, "fast": 110.0}, {"slow": 1, "fast": 2}
    records = [shot(n, speeds[n], numbers[n], CENTRE, SIDE, viscosity=viscosity) for n, viscosity in birds.items()]
    with few_simulations(sought=("plate_thickness", "impact_speed")) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        found = diagnose([tiny(), FAST], records, tmp_path)
    assert found.verdict == NO_RESIDUAL
    for one in found.shots:
        low, high = one.before.parameters["bird.material.viscosity"]["interval_95"]
        assert low < birds[one.name] < high
    assert any(one.startswith("the birds of the shots and baselines are not of one recipe") for one in found.warnings)
    assert not any(name.startswith("shot ") for name in found.held_out), "no shot tells of the bird of another"


def test_effects_are_read_from_the_file_as_they_were_found(found: Diagnosis, out: Path) -> None:
    """Intervals came back as lists."""
    assert Diagnosis.read(out / "diagnosis.json").effects == found.effects


def test_birds_that_are_alike_are_not_told_apart(found: Diagnosis) -> None:
    assert not any("recipe" in one for one in found.warnings)
    assert found.verdict == ATTRIBUTED


def test_a_sensor_that_the_first_record_lacks_has_faults_and_a_place_on_the_page(found: Diagnosis, out: Path) -> None:
    assert f"sensor_gain.{CENTRE}" in {one.name for one in found.effects}
    assert list(found.noise["sensors"]) == [SIDE, CENTRE]
    page = write_diagnosis_page(out).read_text(encoding="utf-8")
    assert "displacement centre" in page


def test_the_page_has_the_bird_of_every_shot(found: Diagnosis, out: Path) -> None:
    """Each shot has a bird of its own; the page had that of the first, and did not say whose it was."""
    page = write_diagnosis_page(out).read_text(encoding="utf-8")
    for one in found.shots:
        table = page[page.index(f"The bird of shot {one.name}: calibrated parameters") :]
        value = one.before.parameters["bird.material.viscosity"]["value"]
        assert quantity(value, "Pa s") in table[: table.index("</table>")]
    assert "Noise of each sensor in the first shot that has it" in page


def test_the_page_to_play_with_and_the_cards_say_whose_bird_they_have(found: Diagnosis, out: Path) -> None:
    """Both had the bird of the first shot alone, which is not that of the others, and did not say so."""
    (view,) = read(out)
    assert "those of the bird of shot slow" in view.headline
    assert [one["name"] for one in view.presets] == ["after, slow", "after, fast", "before, slow", "before, fast"]
    fast = found.shots[1].before.parameters["bird.material.viscosity"]["value"]
    assert view.presets[3]["theta"] == pytest.approx([fast])
    said = " ".join(read_export(out).source)
    assert "Records: slow, fast. The records are simulated, not measured." in said
    assert "The bird is that of shot slow; every shot has its own" in said
    assert "the bird is that of shot slow; every shot has its own" in read_diagnosis(out).said


@pytest.mark.usefixtures("found")
def test_a_fault_of_a_later_shot_is_added_to_the_instrument_of_that_shot(out: Path, tmp_path: Path) -> None:
    """The page took the instrument of the first shot's case for that of every shot."""
    folder = tmp_path / "out"
    shutil.copytree(out, folder)
    later = folder / "diagnosis_fast.toml"
    later.write_text(f"{later.read_text()}\n[instrument.{CENTRE}]\ngain = 1.5\n")
    (view,) = read(folder)
    told = {one["label"]: (one["stated"], one["elsewhere"]) for one in view.effects}
    first, later_ones = told[f"sensor_gain.{CENTRE}"]
    assert first["gain"] == 1.0
    assert {name: one["gain"] for name, one in later_ones.items()} == {"fast": 1.5}
    assert told[f"sensor_gain.{SIDE}"][1] == {}, "both cases state the same"
    later.unlink()
    assert read(folder)[0].effects, "a folder of an earlier version has the first shot's case alone"


def test_a_picture_names_its_shot_and_what_is_not_there(found: Diagnosis) -> None:
    """A shot that is not there was "KeyError: 'quick'", any curve of a diagnosis read from its file "StopIteration"."""
    axes = [Figure().subplots() for _ in range(2)]
    assert [found.plot(SIDE, axes[0]).get_title(), found.plot(CENTRE, axes[1], "fast").get_title()] == [
        "shot slow",
        "shot fast",
    ]
    for channel, shot_name, said in (
        (SIDE, "quick", 'no shot "quick"; the shots are: slow, fast'),
        (CENTRE, "slow", f'shot slow has no channel "{CENTRE}"; its channels: {SIDE}'),
    ):
        with pytest.raises(UserError, match=said):
            found.plot(channel, axes[0], shot_name)
    with pytest.raises(UserError, match="has no curves"):
        replace(found, curves={}).plot(SIDE, axes[0])


def test_records_that_are_simulated_are_told_by_name() -> None:
    """Of a simulated shot beside a measured first one, the first was called simulated."""
    cases = [NamedRecord(name, tiny(), shot(name, 80.0, 1, SIDE)) for name in ("slow", "fast", "third")]
    taken = replace(cases[0], record=replace(cases[0].record, provenance=("laser",)))

    def provenance(*records: NamedRecord) -> str:
        return diagnosis(record=described(records)).provenance

    assert provenance(taken) == "The record is measured"
    assert provenance(taken, cases[1]) == "The record of fast is simulated, not measured"
    assert provenance(taken, *cases[1:]) == "The records of fast, third are simulated, not measured"
    assert provenance(*cases) == "The records are simulated, not measured"


def test_the_case_and_the_sentence_are_of_the_shot_that_has_the_effect(found: Diagnosis, out: Path) -> None:
    """Both were of the first shot: a case without the effect, and an error that the effect does not change."""
    repaired = load_case(out / (found.case_after or ""))
    assert found.effects[0].magnitude is not None
    assert repaired.impact.speed == pytest.approx(110.0 + found.effects[0].magnitude, rel=1e-9)
    fast = found.shown_shot
    assert fast.after is not None
    viscosity = fast.after.parameters["bird.material.viscosity"]["value"]
    assert repaired.bird.material.viscosity == pytest.approx(viscosity, rel=1e-9)
    assert fast.name == "fast"
    channel = next(iter(fast.before.rmse))
    old, new = (quantity((one.solver or {})["rmse"][channel], "m") for one in (fast.before, fast.after))
    assert f"in shot fast falls from {old.removesuffix(' mm')} to {new}" in _errors(found)


def test_a_shot_without_which_its_effect_is_not_known_has_no_error_after(found: Diagnosis) -> None:
    """Held out was what the effect is known from; the model without it was judged by the errors of the one with it."""
    assert found.held_out["shot fast"]["before"] is not None
    assert found.held_out["shot fast"]["after"] is None
    assert found.held_out["shot slow"]["after"] is not None
    assert found.shots[1].after is not None
    assert found.shots[1].after.heldout["shot"] is None


@pytest.mark.usefixtures("found")
@pytest.mark.parametrize("kept", [(1, 0), (1,)], ids=["in another order", "without the first"])
def test_two_shots_of_one_bird_share_a_channel_s_numerical_error_wherever_their_records_list_it(
    rankings: list[Ranking], kept: tuple[int, ...]
) -> None:
    """What the process of one channel was off by was shared with the other channel of the second record."""
    first = rankings[0].problem.shots[1]
    again = replace(first, name="again", record=Record(tuple(first.record.traces[i] for i in kept), ()))
    place = Places(dict.fromkeys((first.name, "again"), rankings[0].fits["none"].places.z[first.name]), {})
    directions = numerical_error(Linearisation((first, again), place), True)
    n = len(first.record.values)
    same = np.concatenate([np.flatnonzero(first.record.channel == i) for i in kept])
    own, shared = directions[:n] @ directions[:n].T, directions[:n] @ directions[n:].T
    np.testing.assert_allclose(shared, own[:, same], atol=1e-4 * own.max())


@pytest.mark.usefixtures("found")
@pytest.mark.parametrize("kept", [(0, 1), (1, 0), (1,)], ids=["alike", "in another order", "without the first"])
def test_shots_share_what_another_model_would_answer_as_far_as_their_birds_are_alike(
    rankings: list[Ranking], kept: tuple[int, ...]
) -> None:
    """It was drawn anew in every shot, as an effect's change of the model error was, so that each shot more cost an
    effect as much as it told: a clamp that slips was likelier with one shot than with three."""
    first = rankings[0].problem.shots[1]
    again = replace(first, name="again", record=Record(tuple(first.record.traces[i] for i in kept), ()))
    column = np.linspace(1.0, 2.0, (n := len(first.record.values)) + len(again.record.values))
    same = np.concatenate([np.flatnonzero(first.record.channel == i) for i in kept])
    column[n:] = column[same]
    known = Amplitudes({}, {}, {"displacement": 0.01}, "", frozenset({"displacement"}))
    place = Places(dict.fromkeys((first.name, "again"), rankings[0].fits["none"].places.z[first.name]), {})
    at = Linearisation((first, again), place)
    for parts in (trends(at, column), changed_by_effects(at, first.shapes, known)):
        for apart, share in ((0.0, 1.0), (20.0, 0.0)):
            errors = Nearness(at.shots, [np.zeros(1), np.full(1, apart)], np.ones(1)).shared(parts)
            own, shared = errors[:n] @ errors[:n].T, errors[:n] @ errors[n:].T
            np.testing.assert_allclose(shared, share * own[:, same], atol=1e-4 * own.max())
            np.testing.assert_allclose(errors[n:] @ errors[n:].T, own[np.ix_(same, same)], atol=1e-4 * own.max())


@pytest.mark.usefixtures("found")
def test_responses_of_two_cases_were_learnt_apart(rankings: list[Ranking]) -> None:
    """Their errors were taken for one, direction by direction, which are those of other simulations."""
    system, first = rankings[0].fits["none"].system, rankings[0].problem.shots[0]
    errors, n = system.columns[:, system.at["error of plate_thickness"]], len(first.record.values)
    assert errors[:n].any()
    assert errors[n:].any()
    assert not (errors[:n] @ errors[n:].T).any()


def test_the_magnitude_of_an_effect_without_a_fit_of_its_own_is_not_the_end_of_its_interval(found: Diagnosis) -> None:
    """A plate thinner by 0.014 mm stood beside an interval of 0.014 to 0.208 mm, which had been moved there to hold it:
    a mean that knows an effect's signature as if the effect were absent."""
    inside = {one.name: one for one in found.effects if one.interval_95 and one.magnitude and not one.at_bound}
    assert {"plate_thickness", "impact_speed"} < inside.keys()
    for one in inside.values():
        assert one.interval_95 is not None
        assert one.magnitude is not None
        assert one.interval_95[0] < one.magnitude < one.interval_95[1]


def test_a_sensor_that_no_case_predicts_is_told_once_for_all_shots() -> None:
    """Three shots at three speeds had three warnings that differed by the case's name alone."""

    def setup(name: str, **left_out: float) -> Any:
        declared, fine = (SimpleNamespace(name=name, bird=SimpleNamespace(particles=count)) for count in (120, 960))
        plan = SimpleNamespace(case=declared, fine=fine)
        return SimpleNamespace(plan=plan, left_out=left_out, unpredictable=left_out)

    told = sensors_left_out([setup("slow", force=0.15), setup("fast", force=0.15), setup("other")])
    assert len(told) == 1
    assert told[0].startswith("slow, fast: another lattice of the bird's 960 particles alone moves force by 15 %")


def test_errors_before_and_after_are_of_one_mesh() -> None:
    """A run that failed leaves both to the fits; what a baseline shows was seen on the emulator's mesh alone."""
    fitted = state(rmse={SIDE: 2.0}, rmse_less_baseline={SIDE: 1.0})
    ran = replace(fitted, solver={"rmse": {SIDE: 5.0}, "rmse_less_baseline": None, "weighted": 1.0, "raw": 1.0})
    both = errors(ran, ran)
    assert all(one and one.rmse_less_baseline and one.rmse[SIDE] == 5.0 for one in both)
    assert all(one and one.rmse_less_baseline == {SIDE: 1.0} for one in both)
    assert all(one and one.rmse[SIDE] == 2.0 for one in errors(ran, fitted))


def test_one_record_and_two_cases_are_refused_in_good_grammar() -> None:
    with pytest.raises(UserError, match=r"^1 record and 2 cases: give one case"):
        matched([tiny(), FAST], [shot("slow", 80.0, 1, SIDE)])


def test_a_shot_s_name_cannot_be_taken_for_another_part_of_an_answer_and_names_files() -> None:
    """A record "gel+85@a.csv" became a pair of effects in the answer; one of 235 letters ended in an error of the file
    system after all simulations; "a_2" beside "a" twice were two shots of one name."""
    names = shot_names([shot(stem, 80.0, 1, SIDE) for stem in ("gel+85@a,b", "x" * 235, "a", "a_2", "a", "Schuß 1.v2")])
    assert names == ["gel_85_a_b", "x" * LONGEST, "a_3", "a_2", "a_5", "Schuß 1.v2"]
    twice = shot_names([shot(stem, 80.0, 1, SIDE) for stem in ("a", "a_2", "a_1", "a")])
    assert len(set(twice)) == 4
    assert max(len(name) for name in curve_files(names)) < 100


def cut(record: Measured, end: float) -> Measured:
    """The record up to an instant [s]."""
    kept = record.time <= end
    channels, sigma = ({name: values[kept] for name, values in own.items()} for own in (record.channels, record.sigma))
    return replace(record, time=record.time[kept], channels=channels, sigma=sigma)


@pytest.fixture(scope="module")
def named_badly(tmp_path_factory: pytest.TempPathFactory) -> tuple[Diagnosis, str]:
    """Shots whose names read as parts of an answer, the second faster than stated and ended early, beside a baseline
    and a further record of the first case.
    """
    folder = tmp_path_factory.mktemp("named") / "out"
    records = [shot("baseline clean", 80.0, 1, SIDE), cut(shot("2 of 2", 110.0 + FASTER, 2, CENTRE, SIDE), 0.37e-3)]
    clean, again = shot("clean", 80.0, 3, CENTRE, SIDE), shot("again", 80.0, 4, SIDE)
    with few_simulations(sought=("plate_thickness", "impact_speed")) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        found = diagnose([tiny(), FAST], records, folder, baseline=[clean], heldout=again)
    return found, write_diagnosis_page(folder).read_text(encoding="utf-8")


def test_a_shot_may_be_named_as_a_baseline_is_in_an_answer(named_badly: tuple[Diagnosis, str]) -> None:
    """Beside a baseline `clean` a shot `baseline clean` was taken for it: arrays of two lengths after all runs."""
    found, _ = named_badly
    assert [one.name for one in found.shots] == ["baseline clean", "2 of 2"]
    assert found.effects[0].name == "impact_speed@2 of 2"


def test_a_name_with_of_in_it_is_no_part_of_another_shot(named_badly: tuple[Diagnosis, str]) -> None:
    """The shot held out from which alone its effect is known was given an error after, and spoke against the effect."""
    found, _ = named_badly
    held = found.held_out["shot 2 of 2"]
    assert held["before"] is not None
    assert held["after"] is None


def test_a_stretch_of_a_record_that_ends_early_is_held_out_too(named_badly: tuple[Diagnosis, str]) -> None:
    """A stretch of the simulated time in which the record had no point gave NaN, and nothing could be attributed."""
    found, _ = named_badly
    held = found.held_out["time_block of 2 of 2"]
    assert held["gain"] is not None
    assert held["gain"] > 0.0
    assert found.verdict == ATTRIBUTED


def test_a_held_out_record_has_not_what_one_of_several_shots_has(named_badly: tuple[Diagnosis, str]) -> None:
    """It was predicted with the other shot's speed, 6 m/s too high, and the effect was doubted for it."""
    found, page = named_badly
    held = found.held_out["shot"]
    assert held["after"] is not None
    assert held["after"] < 1.5
    assert "<td>the record of --heldout</td>" in page
    assert not any("held-out record is predicted worse" in one for one in found.warnings)


@pytest.mark.usefixtures("found")
def test_a_held_out_record_has_not_what_the_first_shot_s_case_cannot_carry(rankings: list[Ranking]) -> None:
    """It ended in a KeyError after all simulations."""
    problem, (first, *_) = rankings[0].problem, rankings[0].problem.shots
    lost = replace(first.setup, learnt={k: v for k, v in first.setup.learnt.items() if k != "plate_thickness"})
    problem = _on(problem, first.setup, lost)
    thinner = next(one for one in problem.found if one.label == "plate_thickness")
    model = Hypothesis(thinner.label, (thinner,), 0.1, "plate")
    fit = problem.tested(model, Places(rankings[0].fits["none"].places.z, {thinner.label: -1.0}))
    held = other_record(problem, model, fit, replace(problem.shots[0], name="held"), problem.shots[0])
    assert thinner.shots == ("fast",)
    assert np.isfinite(held.error)


def test_a_fault_of_a_sensor_that_the_first_shot_lacks_is_told_where_it_is(tmp_path: Path) -> None:
    """The error was told of another sensor, in the shot without it, where it "rises from 0.0138 to 0.0139 mm"; the
    corrected case was of that shot."""
    slow, fast = shot("slow", 80.0, 1, SIDE), shot("fast", 110.0, 2, SIDE, CENTRE)
    wrong = replace(fast, channels={**fast.channels, CENTRE: 1.06 * fast.channels[CENTRE]})
    with few_simulations(sought=("plate_thickness",)) as patch:
        patch.setattr("birdstrike.doe.campaign.simulations.simulate", strike)
        found = diagnose([tiny(), FAST], [slow, wrong], tmp_path, baseline=[shot("clean", 80.0, 3, CENTRE, SIDE)])
    assert found.after is not None
    assert found.after.model == f"sensor_gain.{CENTRE}"
    assert "the error at displacement centre in shot fast, less what the baseline shows, falls" in _errors(found)
    corrected = load_case(tmp_path / (found.case_after or ""))
    assert corrected.impact.speed == pytest.approx(FAST.impact.speed)
    assert corrected.instrument[CENTRE].gain == pytest.approx(1.06, abs=0.01)


def stating(share: str, sensor: str = CENTRE) -> Case:
    return FAST.overlaid({"inversion": {"discrepancy": {sensor: share}}})


def test_a_model_error_that_one_of_the_cases_states_holds_for_all() -> None:
    def known(*cases: Case) -> str:
        shots = [SimpleNamespace(setup=SimpleNamespace(plan=SimpleNamespace(case=case))) for case in cases]
        one: Any = SimpleNamespace(shots=shots, baselines=Baselines())
        return Pipeline._known(one, ["displacement"]).source

    assert known(tiny(), tiny()) != STATED
    assert known(stating("3 %"), tiny()) == known(tiny(), stating("3 %")) == STATED


def test_two_model_errors_of_one_sensor_are_refused(tmp_path: Path) -> None:
    records = [shot("slow", 80.0, 1, CENTRE), shot("fast", 110.0, 2, CENTRE)]
    own = tiny().overlaid({"inversion": {"discrepancy": {CENTRE: "2 %"}}})
    with pytest.raises(CaseError, match=rf"inversion.discrepancy.{CENTRE} = 3 % in case .* and 2 % in case .* alike"):
        diagnose([own, stating("3 %")], records, tmp_path)
    assert not [*tmp_path.iterdir()]


def test_an_interrupted_answer_leaves_no_case_of_an_earlier_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    written_diagnosis(tmp_path, case_after="rig_with_impact_speed.toml")
    for name in ("rig_with_impact_speed.toml", "case.toml", "notes.toml"):
        (tmp_path / name).write_text("")
    with monkeypatch.context() as patched:
        patched.setattr("birdstrike.inversion.results.diagnosis_files.copy_case", killed)
        with pytest.raises(KeyboardInterrupt):
            write(diagnosis(), tmp_path, {"case.toml": tiny()})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "notes.toml"]
