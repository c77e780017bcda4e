"""The score of an experiment, on analytic curves without a strike: rates, signals, files, the page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.model import low_pass
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.verdict import NONE
from scipy.stats import norm
from tests.inversion.diagnosis.toy_study import TIME, curves, groundwork

from birdstrike.data.curves import Measured
from birdstrike.inversion.audit.answers import confusion
from birdstrike.inversion.audit.carried import covariance_of, of_part, part, without_noise
from birdstrike.inversion.audit.circular import emulator_made
from birdstrike.inversion.audit.coarse import coarse, coarse_models
from birdstrike.inversion.audit.draws import Noises, answer
from birdstrike.inversion.audit.experiment import Truth
from birdstrike.inversion.audit.planted import CLEAN
from birdstrike.inversion.audit.power import Rescaled, shown, signal
from birdstrike.inversion.audit.reading import read_draws
from birdstrike.inversion.audit.score import COARSE, KINDS, STATED, Asked, Score
from birdstrike.inversion.audit.stored import load_score, save_score
from birdstrike.inversion.audit.table import write_audit
from birdstrike.inversion.diagnosis.diagnose import Study, Wishes
from birdstrike.reports.page.audit import audit_markdown, write_audit_page

NOISE = 1e-4
EARLY = TIME[1] * np.arange(-60, 0)
TAU = 7e-5  # s of a slow amplifier, which no parameter imitates
SLOW = "sensor_bandwidth"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("audit")
    return Study(groundwork(folder), Strikes(folder / "runs", (), 1), Wishes())


def truth(study: Study, tau: float) -> Truth:
    """Analytic curves through an amplifier, from 0.6 ms before contact."""
    time = np.append(EARLY, TIME)
    plain = curves(np.array([[0.4, 0.5]]))[0][0]
    curve = np.append(np.zeros(len(EARLY)), low_pass(plain, float(TIME[1]), tau) if tau else plain)
    (channel,) = study.ground.clock.channels
    return Truth("single", {}, {SLOW: tau}, "", time, {channel: curve})


def record(study: Study, one: Truth) -> Measured:
    """The truth with its noise stated in a column."""
    (channel,) = study.ground.clock.channels
    noise = NOISE * np.random.default_rng(3).standard_normal(len(one.time))
    stated = {channel: np.full(len(one.time), NOISE)}
    return Measured(one.time, {channel: one.channels[channel] + noise}, stated, {channel: "m"})


@pytest.fixture(scope="module")
def clean(study: Study) -> tuple[Judge, dict[str, Judged]]:
    """Models of the noise-free record of a slow amplifier."""
    one = truth(study, TAU)
    noisy = Judge.of(study.ground, study.read(record(study, one)))
    judge = replace(noisy, record=without_noise(noisy.record, one))
    return judge, judge.models()


@pytest.fixture(scope="module")
def made(study: Study) -> list[Score]:
    template = study.read(record(study, truth(study, 0.0)))
    return [emulator_made(study, template, i) for i in range(8)]


def test_where_the_model_is_the_truth_rates_are_as_stated(made: list[Score]) -> None:
    """Eight truths, twenty draws each: false alarms near 5 %, the truth in the set and in the intervals near 95 %."""
    alarms = [1.0 - one.believed[STATED].holds(NONE).mean() for one in made if one.kind == CLEAN]
    inside = [one.believed[STATED].holds(one.effect).mean() for one in made]
    covered = [values.mean() for one in made for values in one.covered.values()]
    assert np.mean(alarms) < 0.15
    assert np.mean(inside) > 0.88
    assert np.mean(covered) > 0.88
    assert not any(one.believed[STATED].names_other([one.effect]).mean() > 0.2 for one in made)


def test_power_is_that_of_the_best_of_three_directed_scores(made: list[Score]) -> None:
    """Phi(s - c) at s standard errors along an effect's learnt signature; c: Sidak's 5 % over three effects."""
    threshold = norm.isf(0.5 * (1.0 - 0.95 ** (1.0 / 3.0)))
    found = [(p.along, p.rejected.mean()) for one in made for p in one.power]
    assert len(found) > 3
    for along, rejected in found:
        assert rejected == pytest.approx(norm.cdf(along - threshold), abs=0.3)


def test_a_wanted_signal_is_reached_by_the_noise_and_made_anew(clean: tuple[Judge, dict[str, Judged]]) -> None:
    judge, models = clean
    index = models[NONE].fit.problem.index(SLOW)
    b = TAU / models[NONE].fit.problem.model.known[index].size
    rescaled = Rescaled.of(judge, models[NONE], SLOW, b)
    scale = rescaled.scale(4.0)
    assert scale is not None
    fit = rescaled.fit(scale)
    assert signal(fit, SLOW, b) == pytest.approx(4.0, rel=0.1)  # a bound that is reached makes it jump
    assert shown(fit) == pytest.approx(4.0, rel=0.3)  # nothing is learnt: the record shows what is promised
    assert rescaled.fit(2.0 * scale).cost < fit.cost


def test_the_covariance_comes_back_from_its_whitener() -> None:
    root = np.random.default_rng(0).standard_normal((6, 6))
    sigma = root @ root.T + np.eye(6)
    used = np.array([True, False, True, True, False, True])
    assert np.allclose(covariance_of(Whitener.of(sigma)), sigma)
    assert np.allclose(part(Whitener.of(sigma), used).inverse, Whitener.of(sigma, used).inverse)


def test_models_carried_to_a_part_are_those_fitted_to_it(clean: tuple[Judge, dict[str, Judged]]) -> None:
    judge, models = clean
    trained = judge.only(np.arange(len(judge.record.values)) % 3 > 0)
    carried, fresh = of_part(trained, models), trained.models()
    for name, one in fresh.items():
        assert carried[name].fit.cost == pytest.approx(one.fit.cost, rel=0.05, abs=0.5)


def test_louder_noise_than_stated_alarms_if_believed_and_not_as_it_is_read(
    study: Study, clean: tuple[Judge, dict[str, Judged]]
) -> None:
    judge, models = clean
    one = truth(study, TAU)
    loud = Noises(level=1.5)
    believed = answer(judge, models, loud.draw(judge.record.traces, 60, 0), 0.05)
    read = read_draws(study, judge, models, record(study, one), one, loud, 8, 0)
    assert believed.holds(SLOW).mean() < 0.5
    assert read.holds(SLOW).mean() > 0.7
    assert read.holds(NONE).mean() < 0.3  # it stands out of louder noise as well


def test_a_coarse_emulator_errs_more_and_says_so(study: Study, clean: tuple[Judge, dict[str, Judged]]) -> None:
    judge, models = clean
    few = coarse(study.ground)
    assert len(few.emulator.runs) < len(study.ground.emulator.runs)
    blunt, blunted = coarse_models(few, judge, models)
    sizes = [covariance_of(one["none"].fit.problem.whitener).trace() for one in (models, blunted)]
    assert sizes[1] > sizes[0]
    assert Choice.of(blunted, 0.05).allowed
    assert blunt.groundwork is few


def test_a_score_comes_back_from_its_file(made: list[Score], tmp_path: Path) -> None:
    path = tmp_path / "scores" / "one.json"
    save_score(path, "key", made[1])
    back = load_score(path, "key")
    assert back is not None
    assert back.believed[STATED].sets == made[1].believed[STATED].sets
    assert back.believed[STATED].named == made[1].believed[STATED].named
    assert [one.signal for one in back.power] == [one.signal for one in made[1].power]
    assert {k: v.tolist() for k, v in back.covered.items()} == {k: v.tolist() for k, v in made[1].covered.items()}
    assert load_score(path, "another") is None
    path.write_text(path.read_text()[:100])
    assert load_score(path, "key") is None  # what is not whole is made again


def test_the_page_and_the_tables_show_both_intervals_and_the_circular_part(made: list[Score], tmp_path: Path) -> None:
    kinds = [*(one.name for one in KINDS), COARSE]
    planted = [
        replace(one, believed=dict.fromkeys(kinds, one.believed[STATED]), read=_read(one, kinds)) for one in made
    ]
    content = write_audit(tmp_path, planted, made, 0.05, Asked(20, 6, True))
    (entry,) = content["tables"].values()
    assert {"interval_95", "exact_95"} <= set(entry["gates"][0])
    assert sum(sum(row.values()) for row in confusion(planted).values()) == pytest.approx(len(entry["confusion"]))
    page = write_audit_page(tmp_path).read_text(encoding="utf-8")
    text = audit_markdown(content)
    for shown_in in (page, text):
        assert "Clopper-Pearson" in shown_in
        assert "circular" in shown_in
        assert "as read" in shown_in
        assert COARSE in shown_in


def _read(one: Score, kinds: list[str]) -> dict:
    return dict.fromkeys(kinds, one.believed[STATED])


def test_draws_that_lead_past_a_bound_are_refitted_on_it(clean: tuple[Judge, dict[str, Judged]]) -> None:
    """A one-sided effect that the noise-free record has a little of: no draw gives it a negative size."""
    judge, models = clean
    noise = Noises(level=3.0).draw(judge.record.traces, 50, 0)
    unknowns = answer(judge, models, noise, 0.05).unknowns[SLOW]
    assert unknowns[:, -1].min() >= 0.0
