"""The whole inversion on the stand-in: truth found, verified, and written as the formats promise."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.verification import error_words, overall, verdict, write_verification
from birdstrike.inversion.invert import InversionOutcome, best, invert
from birdstrike.inversion.misfit import rmse
from birdstrike.inversion.results.estimates import Answer, ChannelScore
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.surrogate.emulator import Emulator
from tests.inversion import eroding
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, TIME, TIMES, forward, pulse, record, truth

SHARE = (0.4, 0.6, 0.45, 0.5)
OPTIONS = InversionOptions(sampling=None, analyse=False, noise={CHANNEL: 1e-5})


@pytest.fixture(scope="module")
def clean(dataset: Dataset) -> InversionOutcome:
    return invert(dataset, record(truth(SHARE)), forward, OPTIONS)


def test_emulator_recovers_every_parameter_within_two_per_cent_of_its_range(clean: InversionOutcome) -> None:
    for i, estimate in enumerate(clean.inversion.methods["emulator"].parameters.values()):
        assert estimate.identified
        assert estimate.value is not None
        assert abs(estimate.value - truth(SHARE)[i]) < 0.02 * (HIGHS - LOWS)[i]
        assert estimate.interval_95 is not None
        assert estimate.interval_95[0] < truth(SHARE)[i] < estimate.interval_95[1]


def test_every_answer_is_verified_by_the_forward_model(clean: InversionOutcome) -> None:
    for answer in clean.inversion.methods.values():
        theta = np.array([answer.parameters[name].value for name in NAMES], dtype=float)
        expected = rmse(np.interp(TIMES, TIME, pulse(theta)), pulse(truth(SHARE), TIMES))
        assert answer.verified_rmse == pytest.approx(expected, rel=1e-9)
        assert answer.verified_relative == pytest.approx(expected / np.abs(pulse(truth(SHARE), TIMES)).max(), rel=1e-9)


def test_best_is_the_better_verified_and_the_verdict_says_so(clean: InversionOutcome) -> None:
    errors = {name: answer.verified_misfit or np.inf for name, answer in clean.inversion.methods.items()}
    assert clean.inversion.best == min(errors, key=lambda name: errors[name])
    assert verdict(clean.inversion).startswith(f"better verified by the solver: the {clean.inversion.best} (")
    flipped = replace(clean.inversion, best=max(errors, key=lambda name: errors[name]))
    assert verdict(flipped) != verdict(clean.inversion)


def scored(displacement: float, force: float) -> Answer:
    """An answer that errs by these shares of the peaks; a displacement known to 1 %, a rough force to 20 %."""
    score = {
        "displacement": ChannelScore("m", None, displacement, displacement, None, displacement / 0.01),
        "force": ChannelScore("N", None, force, force, None, force / 0.2),
    }
    relative = overall(s.verified_relative for s in score.values())
    misfit = overall(s.verified_misfit for s in score.values())
    return Answer({}, None, displacement, relative, score, None, None, None, misfit)


def test_a_rough_force_does_not_decide_which_method_is_better_verified() -> None:
    """By shares of the peaks the network was, with twice the emulator's error in a displacement known to 1 %."""
    answers = {"network": scored(0.04, 0.28), "emulator": scored(0.02, 0.29)}
    assert (answers["network"].verified_relative or 0.0) < (answers["emulator"].verified_relative or 0.0)
    assert best(answers) == "emulator"
    assert "over noise" in error_words(answers["emulator"])


def test_a_verified_misfit_is_over_the_noise(clean: InversionOutcome) -> None:
    for answer in clean.inversion.methods.values():
        assert answer.verified_rmse is not None
        assert answer.verified_misfit == pytest.approx(answer.verified_rmse / OPTIONS.noise[CHANNEL], rel=1e-9)


def test_network_interval_is_students_from_the_held_out_samples(dataset: Dataset, emulator: Emulator) -> None:
    options = InversionOptions(sampling=None, analyse=False, method="network", noise={CHANNEL: 1e-9})
    outcome = invert(dataset, record(truth(0.5)), forward, options, emulator=emulator)
    assert outcome.network is not None
    for i, estimate in enumerate(outcome.inversion.methods["network"].parameters.values()):
        error = np.sqrt(np.mean(outcome.network.errors[:, i] ** 2)) * (HIGHS[i] - LOWS[i])
        assert estimate.interval_95 is not None
        assert "9 held-out samples" in estimate.reason
        told = max(estimate.value - 2.262 * error, LOWS[i]), min(estimate.value + 2.262 * error, HIGHS[i])
        known = told if estimate.identified else (LOWS[i], HIGHS[i])
        assert estimate.interval_95 == pytest.approx(known, rel=1e-4)


def test_network_on_few_runs_gives_no_interval(dataset: Dataset) -> None:
    few = replace(
        dataset,
        runs=dataset.runs[:8],
        parameters=dataset.parameters[:8],
        curves={name: curves[:8] for name, curves in dataset.curves.items()},
        smooth=dataset.smooth[:8],
    )
    found = invert(few, record(truth(0.5)), forward, replace(OPTIONS, method="network")).inversion
    assert list(found.methods) == ["network"]
    for estimate in found.methods["network"].parameters.values():
        assert estimate.interval_95 is None
        assert not estimate.identified


def test_noise_that_the_network_amplifies_is_in_its_interval(dataset: Dataset, emulator: Emulator) -> None:
    options = [
        InversionOptions(sampling=None, analyse=False, method="network", noise={CHANNEL: noise})
        for noise in (1e-7, 2e-4)
    ]
    quiet, loud = (invert(dataset, record(truth(0.5)), forward, o, emulator=emulator).inversion for o in options)
    for name, estimate in quiet.methods["network"].parameters.items():
        other = loud.methods["network"].parameters[name].interval_95
        assert estimate.interval_95 is not None
        assert other is not None
        whole = not estimate.identified and other == estimate.interval_95
        assert whole or other[1] - other[0] > estimate.interval_95[1] - estimate.interval_95[0]
    assert any(estimate.identified for estimate in quiet.methods["network"].parameters.values())


@pytest.mark.parametrize("outputs", ["bounded", "linear"])
def test_network_that_answers_nonsense_identifies_nothing(outputs: str) -> None:
    """Most runs of this campaign share one curve but for viscosity, so the network is steep beyond all reason."""
    campaign = eroding.campaign()
    values = np.interp(TIMES, TIME, eroding.curve(np.array([600.0, 0.4, 0.5])))
    measured = replace(record(truth(0.5)), channels={CHANNEL: values + 0.1e-3 * np.cos(1e5 * TIMES)})
    options = InversionOptions(sampling=None, analyse=False, noise={CHANNEL: 0.1e-3}, outputs=outputs, copies=0)
    found = invert(campaign, measured, eroding.forward, options).inversion
    assert found.prior_predictive.inside
    assert any("outside its range" in warning for warning in found.warnings) == (outputs == "linear")
    assert not any(estimate.identified for estimate in found.methods["network"].parameters.values())
    for name, estimate in found.methods["network"].parameters.items():
        assert estimate.interval_95 in (None, found.ranges[name])
    assert found.methods["emulator"].parameters[eroding.NAMES[0]].identified


def test_noisy_copies_of_the_runs_keep_the_network_from_nonsense() -> None:
    """The same campaign and record: trained with the record's noise, as by default, it finds what the curve shows."""
    campaign = eroding.campaign()
    values = np.interp(TIMES, TIME, eroding.curve(np.array([600.0, 0.4, 0.5])))
    measured = replace(record(truth(0.5)), channels={CHANNEL: values + 0.1e-3 * np.cos(1e5 * TIMES)})
    options = InversionOptions(sampling=None, analyse=False, noise={CHANNEL: 0.1e-3})
    found = invert(campaign, measured, eroding.forward, options).inversion
    estimates = found.methods["network"].parameters
    assert [name for name, one in estimates.items() if one.identified] == [eroding.NAMES[0]]
    low, high = estimates[eroding.NAMES[0]].interval_95 or (0.0, 0.0)
    assert low < 600.0 < high
    assert found.training is not None
    assert found.training.copies == 10


def test_linear_outputs_are_trained_as_published_and_copies_asked_for_are_made() -> None:
    assert InversionOptions(outputs="linear").noisy_copies == 0
    assert InversionOptions(trainer="ensemble").noisy_copies == 0
    assert InversionOptions(outputs="linear", copies=3).noisy_copies == 3


def test_network_answer_beyond_a_range_is_clipped_aloud(dataset: Dataset, emulator: Emulator) -> None:
    tall = record(truth((1.35, 0.5, 0.5, 0.5)))
    linear = replace(OPTIONS, method="network", outputs="linear")
    found = invert(dataset, tall, forward, linear, emulator=emulator).inversion
    assert found.methods["network"].parameters["pulse.peak"].value == HIGHS[0]
    assert any("the network gives peak" in w and "outside its range; 7 mm is used" in w for w in found.warnings)
    assert any(" outside what it was trained on" in w for w in found.warnings)


def test_warnings_stand_the_gravest_first(dataset: Dataset, emulator: Emulator) -> None:
    """No parameter is identified; then what the network lacks; then what was left out of the record."""
    tall = record(truth((1.35, 0.5, 0.5, 0.5)), np.append(TIMES, 2.0 * TIMES[-1]))
    found = invert(dataset, tall, forward, replace(OPTIONS, method="both"), emulator=emulator).inversion
    places = [
        next(i for i, line in enumerate(found.warnings) if words in line)
        for words in ("No parameter is identified", "it extrapolates there", "left out of the fit")
    ]
    assert places[0] == 0
    assert places == sorted(places)


def test_bounded_network_names_what_it_never_saw_and_identifies_nothing(dataset: Dataset, emulator: Emulator) -> None:
    tall = record(truth((1.35, 0.5, 0.5, 0.5)))
    found = invert(dataset, tall, forward, replace(OPTIONS, method="network"), emulator=emulator).inversion
    assert any("displacement centre at" in w and "it extrapolates there" in w for w in found.warnings)
    for name, one in found.methods["network"].parameters.items():
        assert one.value is not None
        assert LOWS[NAMES.index(name)] <= one.value <= HIGHS[NAMES.index(name)]
        assert not one.identified


def test_time_origin_serves_both_methods_and_the_verification(dataset: Dataset, emulator: Emulator) -> None:
    options = replace(OPTIONS, time_offset=0.1e-3)
    found = invert(dataset, record(truth(SHARE), TIMES, t0=0.12e-3), forward, options, emulator=emulator).inversion
    assert found.time_offset.value == pytest.approx(0.12e-3, abs=3e-6)
    for method in ("network", "emulator"):
        score = found.methods[method].channels[CHANNEL]
        assert score.verified_rmse is not None
        assert score.verified_rmse_at_zero_offset is not None
        assert score.verified_rmse_at_zero_offset > 2.0 * score.verified_rmse
    assert "+0.1" in found.time_offset.sentence


def test_gap_in_the_record_changes_nothing_but_the_points(
    dataset: Dataset, emulator: Emulator, clean: InversionOutcome
) -> None:
    values = pulse(truth(SHARE), TIMES)
    values[[3, 8]] = np.nan
    measured = replace(record(truth(SHARE)), channels={CHANNEL: values})
    found = invert(dataset, measured, forward, OPTIONS, emulator=emulator).inversion
    assert found.measured.points == {CHANNEL: 10}
    assert found.training is not None
    assert found.training.shape == "10-9-4"
    for name, estimate in found.methods["emulator"].parameters.items():
        expected = clean.inversion.methods["emulator"].parameters[name].value
        assert estimate.value == pytest.approx(expected, abs=0.03 * (HIGHS - LOWS)[NAMES.index(name)])


def test_two_channels_are_inverted_together(dataset: Dataset) -> None:
    run = forward(dict(zip(NAMES, truth(SHARE), strict=True)))
    measured = replace(
        record(truth(SHARE)),
        channels={name: run.at(name, TIMES) for name in (CHANNEL, "contact_force")},
        units=dict(run.units),
    )
    found = invert(
        dataset,
        measured,
        forward,
        InversionOptions(sampling=None, analyse=False, noise={CHANNEL: 1e-5, "contact_force": 0.05}),
    ).inversion
    assert found.training is not None
    assert found.training.shape == "24-9-4"
    answer = found.methods["emulator"]
    assert set(answer.channels) == {CHANNEL, "contact_force"}
    shares = [answer.channels[name].verified_relative or np.nan for name in answer.channels]
    assert answer.verified_relative == pytest.approx(np.sqrt(np.mean(np.square(shares))))
    theta = np.array([answer.parameters[name].value for name in NAMES], dtype=float)
    np.testing.assert_allclose((theta - LOWS) / (HIGHS - LOWS), SHARE, atol=0.02)


def test_failed_verification_is_reported_and_the_other_method_goes_on(
    dataset: Dataset, emulator: Emulator, clean: InversionOutcome
) -> None:
    answer = clean.inversion.methods["network"].parameters["pulse.peak"].value

    def fragile(theta: Mapping[str, float]) -> Histories:
        if theta["pulse.peak"] == answer:
            raise RunFailed("energy balance off by 9 %", "lower solver.courant")
        return forward(theta)

    found = invert(dataset, record(truth(SHARE)), fragile, OPTIONS, emulator=emulator).inversion
    assert found.best == "emulator"
    assert found.methods["network"].verified_rmse is None
    assert "energy balance" in (found.methods["network"].failure or "")
    assert any("verification run of the network failed" in warning for warning in found.warnings)


def test_warnings_of_the_simulations_are_those_of_the_answer(dataset: Dataset, emulator: Emulator) -> None:
    def warned(values: Mapping[str, float]) -> Histories:
        found = forward(values)
        return replace(found, summary={**found.summary, "warnings": ["the plate tore: 3 shells"]})

    told = invert(dataset, record(truth(SHARE)), warned, OPTIONS, emulator=emulator).inversion.warnings
    assert told[-1] == "the plate tore: 3 shells (2 of 2 simulations)"


def test_no_verification_at_all_is_a_failed_run(dataset: Dataset, emulator: Emulator) -> None:
    def broken(_: Mapping[str, float]) -> Histories:
        raise RunFailed("unstable")

    with pytest.raises(RunFailed, match="no verification run finished"):
        invert(dataset, record(truth(SHARE)), broken, OPTIONS, emulator=emulator)


def test_unknown_method_is_an_error(dataset: Dataset) -> None:
    with pytest.raises(UserError, match='method = "magic" is unknown'):
        invert(dataset, record(truth(0.5)), forward, InversionOptions(sampling=None, analyse=False, method="magic"))


def test_json_has_the_keys_other_programs_read(clean: InversionOutcome, tmp_path) -> None:
    clean.inversion.save(tmp_path / "inversion.json")
    found = json.loads((tmp_path / "inversion.json").read_text())
    assert found["schema_version"] == 1
    assert set(found["methods"]) == {"network", "emulator"}
    for answer in found["methods"].values():
        assert {"parameters", "predicted_rmse", "verified_rmse", "verified_relative"} <= set(answer)
        assert set(answer["parameters"]) == set(NAMES)
        for estimate in answer["parameters"].values():
            assert set(estimate) == {"value", "interval_95", "unit", "identified", "reason"}
            assert isinstance(estimate["identified"], bool)
    assert found["best"] in found["methods"]
    assert {"rank", "discrepancy", "max_correlation"} <= set(found["design"])
    assert found["runs_used"] == 40
    assert found["time_offset"] == {"value": 0.0, "sigma": None, "interval_95": None}
    assert {"trainer", "epochs", "mse", "test_mse", "history", "status", "holdout"} <= set(found["training"])
    assert {"components", "q2", "loo_rmse"} <= set(found["emulator"])
    assert found["measured"]["simulated"] is True
    assert "NaN" not in (tmp_path / "inversion.json").read_text()


def test_json_read_back_is_the_same(clean: InversionOutcome, tmp_path) -> None:
    clean.inversion.save(tmp_path / "inversion.json")
    assert Inversion.load(tmp_path / "inversion.json") == clean.inversion


def test_same_seed_same_inversion(dataset: Dataset, emulator: Emulator, clean: InversionOutcome) -> None:
    assert invert(dataset, record(truth(SHARE)), forward, OPTIONS, emulator=emulator).inversion == clean.inversion


def test_verification_file_lies_on_the_records_clock(dataset: Dataset, emulator: Emulator, tmp_path) -> None:
    times = np.append(TIMES, 3.5e-3)
    measured = record(truth(SHARE), times, t0=0.1e-3)
    values = measured.channels[CHANNEL].copy()
    values[4] = np.nan
    measured = replace(measured, channels={CHANNEL: values})
    outcome = invert(dataset, measured, forward, replace(OPTIONS, time_offset=0.1e-3), emulator=emulator)
    t0 = outcome.inversion.time_offset.value
    write_verification(tmp_path / "v.csv", measured, outcome.observations, outcome.verified, t0)
    table = pd.read_csv(tmp_path / "v.csv")
    assert list(table) == ["time_s", *(f"{who}_{CHANNEL}_m" for who in ("measured", "network", "emulator"))]
    np.testing.assert_allclose(table["time_s"], times)
    assert np.isnan(table[f"measured_{CHANNEL}_m"][4])
    assert np.isnan(table[f"emulator_{CHANNEL}_m"][12])  # after the simulated record
    np.testing.assert_allclose(table[f"emulator_{CHANNEL}_m"][:12], pulse(truth(SHARE), TIMES - 0.1e-3), atol=5e-5)


def test_progress_rises_to_the_end(dataset: Dataset, emulator: Emulator) -> None:
    seen: list[float] = []
    invert(dataset, record(truth(SHARE)), forward, OPTIONS, seen.append, emulator)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
