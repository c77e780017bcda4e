"""The inverse network trained on a campaign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.surrogate.files import load_network, save_network
from birdstrike.surrogate.inverse_network import fit_network, sampled
from birdstrike.surrogate.scaling import OutputScaling
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, TIMES, campaign, over_decades, spread


@pytest.mark.parametrize("trainer", ["lm", "adam"])
def test_learns_its_training_runs_and_is_validated_on_the_others(trainer: str) -> None:
    dataset = campaign(spread(25))
    fit = fit_network(dataset, {CHANNEL: TIMES}, trainer, outputs="linear")
    assert str(fit.network.shape) == "12-9-4"
    assert (fit.held_out + 1).tolist() == [1, 5, 10, 15, 20, 25]
    assert fit.training.mse.min() < 5e-3 < fit.training.mse[0]
    predicted = fit.network.predict(sampled(dataset, {CHANNEL: TIMES}))
    errors = (predicted[fit.held_out] - dataset.parameters[fit.held_out]) / (HIGHS - LOWS)
    np.testing.assert_allclose(errors, fit.errors)
    train = np.setdiff1d(np.arange(25), fit.held_out)
    unit_error = (predicted - dataset.parameters)[train] / (HIGHS - LOWS)
    assert np.mean(unit_error**2) == pytest.approx(fit.training.mse.min(), rel=1e-9)


def test_bounded_outputs_learn_the_runs_and_never_leave_the_ranges() -> None:
    dataset = campaign(spread(25))
    bounded, linear = (fit_network(dataset, {CHANNEL: TIMES}, outputs=o).network for o in ("bounded", "linear"))
    values = sampled(dataset, {CHANNEL: TIMES})
    train = np.setdiff1d(np.arange(25), [0, 4, 9, 14, 19, 24])
    error = (bounded.predict(values) - dataset.parameters)[train] / (HIGHS - LOWS)
    assert np.sqrt(np.mean(error**2)) < 0.1
    strange = 3.0 * values  # curves that no run has
    assert ((bounded.predict(strange) >= LOWS) & (bounded.predict(strange) <= HIGHS)).all()
    assert ((linear.predict(strange) < LOWS) | (linear.predict(strange) > HIGHS)).any()
    low, high = np.full(4, 0.3), np.full(4, 0.9)  # 0.3 + (0.9 - 0.3) is more than 0.9: such an answer was "clipped"
    found = replace(bounded, weights=1e3 * bounded.weights, outputs=OutputScaling(low, high)).predict(strange)
    assert found.max() == 0.9


def test_a_bounded_output_s_scale_has_its_inverse() -> None:
    scale, unit = OutputScaling(LOWS, HIGHS), spread(20)
    np.testing.assert_allclose(scale.fractions(scale.targets(LOWS + unit * (HIGHS - LOWS))), unit)
    np.testing.assert_allclose(scale.targets(np.stack([LOWS, HIGHS])), [[0.0] * 4, [1.0] * 4], atol=1e-12)


@pytest.mark.parametrize("outputs", ["bounded", "linear"])
def test_a_logarithmic_range_is_learnt_in_its_logarithm(outputs: str, tmp_path) -> None:
    """The network of the same runs over linear ranges, whose targets were a thousandth to 1 of three decades."""
    runs = campaign(spread(15))
    wide = over_decades(runs)
    fits = [fit_network(one, {CHANNEL: TIMES}, outputs=outputs) for one in (runs, wide)]
    values = sampled(wide, {CHANNEL: TIMES})
    expected, found = (fit.network.fractions(values) for fit in fits)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    np.testing.assert_allclose(fits[1].errors, fits[0].errors, atol=1e-6)
    save_network(tmp_path / "network.npz", fits[1].network)
    again = load_network(tmp_path / "network.npz")
    np.testing.assert_allclose(np.log10(again.predict(values)[:, 0]), -5.0 + 3.0 * found[:, 0])


def test_held_out_runs_have_no_influence() -> None:
    dataset = campaign(spread(25))
    fit = fit_network(dataset, {CHANNEL: TIMES})
    curves = dataset.curves[CHANNEL].copy()
    curves[fit.held_out] *= 3.0
    other = fit_network(replace(dataset, curves={CHANNEL: curves}), {CHANNEL: TIMES})
    np.testing.assert_array_equal(fit.training.weights, other.training.weights)
    assert not np.allclose(fit.errors, other.errors)


def test_inputs_that_never_change_are_named() -> None:
    fit = fit_network(campaign(spread(25)), {CHANNEL: np.array([0.0, 0.1e-3, 1.0e-3, 1.5e-3, 2.0e-3, 2.5e-3])})
    assert fit.notes == ("2 of the network's 6 inputs are the same in all training runs and carry no information",)
    assert np.isfinite(fit.training.mse).all()


def test_several_channels_are_read_one_after_the_other() -> None:
    dataset = campaign(spread(25))
    fit = fit_network(dataset, {CHANNEL: TIMES, "contact_force": TIMES[:5]})
    assert str(fit.network.shape) == "17-9-4"


def test_before_the_record_everything_rests_and_after_it_nothing_is_known() -> None:
    dataset = campaign(spread(5))
    values = sampled(dataset, {CHANNEL: np.array([-1e-3, 0.0])})
    np.testing.assert_array_equal(values[:, 0], values[:, 1])
    with pytest.raises(UserError, match=r"raise time\.end"):
        sampled(dataset, {CHANNEL: np.array([3.2e-3])})


def test_unknown_trainer_is_an_error() -> None:
    with pytest.raises(UserError, match=r'trainer = "sgd" is unknown; use one of: lm, adam'):
        fit_network(campaign(spread(5)), {CHANNEL: TIMES}, "sgd")
    with pytest.raises(UserError, match=r'outputs = "free" is unknown; use one of: bounded, linear'):
        fit_network(campaign(spread(5)), {CHANNEL: TIMES}, outputs="free")


def test_read_back_network_answers_the_same(tmp_path) -> None:
    dataset = campaign(spread(10))
    network = fit_network(dataset, {CHANNEL: TIMES}).network
    save_network(tmp_path / "network.npz", network)
    again = load_network(tmp_path / "network.npz")
    values = sampled(dataset, {CHANNEL: TIMES})
    np.testing.assert_array_equal(again.predict(values), network.predict(values))
    assert again.names == network.names
    np.testing.assert_array_equal(again.times[CHANNEL], TIMES)


def test_a_run_that_repeats_a_training_run_tests_nothing() -> None:
    runs = spread(10)
    repeated = fit_network(campaign(np.vstack([runs[5:], runs])), {CHANNEL: TIMES})
    alone = fit_network(campaign(np.vstack([runs[5:], runs[:5]])), {CHANNEL: TIMES})
    np.testing.assert_array_equal(repeated.held_out, alone.held_out)
    np.testing.assert_array_equal(repeated.training.weights, alone.training.weights)
