"""A curve that the model cannot produce is flagged, not refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.observations.prior_predictive import (
    emulator_or_model,
    prior_predictive,
    prior_predictive_warning,
)
from birdstrike.inversion.results.fit import PriorPredictive
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, TIME, TIMES, forward, pulse, record, truth

OPTIONS = InversionOptions(sampling=None, analyse=False, noise={CHANNEL: 3e-5})


def foreign(measured: Measured) -> Measured:
    """The record with a kink that no parameter makes: 0.3 mm at its middle."""
    bump = 0.3e-3 * np.exp(-(((TIMES - 1.4e-3) / 0.1e-3) ** 2))
    return replace(measured, channels={CHANNEL: measured.channels[CHANNEL] + bump})


def test_foreign_curve_is_flagged_and_the_loop_goes_on(dataset: Dataset, emulator: Emulator) -> None:
    found = invert(dataset, foreign(record(truth(0.5))), forward, OPTIONS, emulator=emulator).inversion
    assert not found.prior_predictive.inside
    assert found.warnings[0].startswith("the model cannot produce this curve: nearest is run ")
    assert " mm RMS in displacement centre" in found.warnings[0]
    for answer in found.methods.values():
        assert not any(estimate.identified for estimate in answer.parameters.values())
        assert all(estimate.interval_95 is None for estimate in answer.parameters.values())
        assert all("cannot produce" in estimate.reason for estimate in answer.parameters.values())
        assert answer.verified_rmse is not None
    assert found.best in found.methods


def test_nearest_run_is_the_nearest(dataset: Dataset, emulator: Emulator) -> None:
    measured = foreign(record(dataset.parameters[16]))
    found = invert(
        dataset, measured, forward, replace(OPTIONS, method="emulator"), emulator=emulator
    ).inversion.prior_predictive
    assert found.nearest_run == 17
    expected = np.sqrt(np.mean((measured.channels[CHANNEL] - pulse(dataset.parameters[16], TIMES)) ** 2))
    assert found.nearest_distance[CHANNEL] == pytest.approx(expected, rel=0.01)  # the record is sampled off the grid


def test_runs_are_compared_on_the_records_clock(dataset: Dataset, emulator: Emulator) -> None:
    measured = foreign(record(dataset.parameters[16], t0=0.1e-3))
    options = replace(OPTIONS, method="emulator", time_offset=0.1e-3)
    found = invert(dataset, measured, forward, options, emulator=emulator).inversion
    assert found.time_offset.value == pytest.approx(0.1e-3, abs=2e-5)
    on_its_clock = pulse(dataset.parameters[16], TIMES - found.time_offset.value)
    expected = np.sqrt(np.mean((measured.channels[CHANNEL] - on_its_clock) ** 2))
    assert found.prior_predictive.nearest_run == 17
    assert found.prior_predictive.nearest_distance[CHANNEL] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("seed", range(5))
def test_curve_of_the_model_is_inside(dataset: Dataset, emulator: Emulator, seed: int) -> None:
    theta = truth(np.random.default_rng(seed).random(4))
    options = replace(OPTIONS, method="emulator")
    found = invert(dataset, record(theta, noise=3e-5, seed=seed), forward, options, emulator=emulator).inversion
    assert found.prior_predictive.inside
    assert 0.3 < found.prior_predictive.fit < 1.5
    assert found.prior_predictive.outside_envelope == 0.0
    assert not any("cannot produce" in warning for warning in found.warnings)


def test_curve_far_from_all_runs_lies_outside_the_envelope(dataset: Dataset, emulator: Emulator) -> None:
    far = record(truth(0.5))
    far = replace(far, channels={CHANNEL: 2.5 * far.channels[CHANNEL]})
    found = invert(
        dataset, far, forward, replace(OPTIONS, method="emulator"), emulator=emulator
    ).inversion.prior_predictive
    assert not found.inside
    assert found.outside_envelope > 0.5


def test_coarse_emulator_is_not_a_model_that_cannot(dataset: Dataset) -> None:
    """The solver's own curve between runs, noise a tenth of what the emulator can follow."""
    theta = truth((0.4, 0.6, 0.45, 0.5))
    found = PriorPredictive(False, 4.0, 0.0, 3, {CHANNEL: 1e-4})
    q2: dict[str, float | None] = {CHANNEL: 0.99}
    observations = observe(record(theta), dataset, {CHANNEL: 1e-5})
    assert emulator_or_model(found, 7.0, q2) == found
    assert "the model can produce it" in prior_predictive_warning(emulator_or_model(found, 1.1, q2), observations)
    poor = emulator_or_model(found, 7.0, {CHANNEL: 0.5})
    assert "displacement centre (Q2 0.50)" in prior_predictive_warning(poor, observations)
    assert "cannot produce" not in prior_predictive_warning(poor, observations)


def test_channels_that_the_emulator_predicts_poorly_identify_nothing_where_the_solver_differs() -> None:
    """Errors as large as the signal make every curve a good fit; only the solver's run can contradict it."""
    inside = PriorPredictive(True, 0.4, 0.0, 3, {CHANNEL: 1e-4})
    q2: dict[str, float | None] = {CHANNEL: 0.99, "strain": 0.45, "contact_force": 0.23}
    refused = emulator_or_model(inside, 9.0, q2)
    assert not refused.inside
    assert (
        "is 9.0 times noise and left-out error, and the emulator predicts strain (Q2 0.45), contact" in refused.coarse
    )
    assert emulator_or_model(inside, 1.1, q2) == inside
    assert emulator_or_model(inside, 9.0, {CHANNEL: 0.99}) == inside


def test_jittery_channels_leave_every_parameter_its_whole_range(dataset: Dataset) -> None:
    """A second channel of nothing but scatter between runs: the fit is content, the solver's run is far off."""
    scatter = 3e3 * np.random.default_rng(0).normal(size=(len(dataset.runs), len(TIME)))
    jittery = replace(dataset, curves={CHANNEL: dataset.curves[CHANNEL], "contact_force": scatter})
    channels = {**record(truth(0.5)).channels, "contact_force": 3e3 * np.cos(1e5 * TIMES)}
    measured = replace(record(truth(0.5)), channels=channels, units={CHANNEL: "m", "contact_force": "N"})
    noise = {CHANNEL: 3e-5, "contact_force": 30.0}
    found = invert(jittery, measured, forward, replace(OPTIONS, method="emulator", noise=noise)).inversion
    assert found.prior_predictive.coarse
    assert found.warnings[0].startswith("the emulator is too coarse for this curve")
    for name, estimate in found.methods["emulator"].parameters.items():
        assert not estimate.identified
        assert estimate.interval_95 == found.ranges[name]
        assert "too coarse" in estimate.reason


def test_one_rejected_channel_is_not_drowned_by_many_good_points(dataset: Dataset) -> None:
    """100 points of one channel without error, 6 of another 3 standard deviations off: 54 in all, for 106 points."""
    few = np.isin(np.arange(100), np.arange(10, 70, 10))
    run = Histories(TIME, {name: rows[16] for name, rows in dataset.curves.items()}, dict(dataset.channel_units))
    times = TIME[100:200]
    force = np.where(few, run.at("contact_force", times), np.nan)
    measured = replace(
        record(truth(0.5), times),
        channels={CHANNEL: run.at(CHANNEL, times), "contact_force": force},
        units=dict(dataset.channel_units),
    )
    observations = observe(measured, dataset, {CHANNEL: 3e-5, "contact_force": 1.0})
    residual = np.concatenate([np.zeros(100), np.full(6, 3.0)])
    assert not prior_predictive(dataset, observations, residual, 0.0).inside
    assert prior_predictive(dataset, observations, residual, 0.0).fit == pytest.approx(3.0)
    assert prior_predictive(dataset, observations, np.full(106, 1.2), 0.0).inside
