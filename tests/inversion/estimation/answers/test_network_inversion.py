"""What the network's answer says of itself: its end of a range, what moves it, and what it never saw."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.answers.network_inversion import NetworkAnswer, network_answer, network_estimates
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.surrogate.inverse_network import fit_network
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, TIMES, over_decades, record, truth


def peak_at(dataset: Dataset, outputs: str, share: float) -> Estimate:
    """Of the pulse's peak, where the network's output stands at a share of its range and noise moves it by 1 %."""
    fit = fit_network(dataset, {CHANNEL: TIMES}, outputs=outputs)
    raw = truth((share, 0.5, 0.5, 0.5))
    answer = NetworkAnswer(raw, np.clip(raw, LOWS, HIGHS), np.full(len(NAMES), 0.01), ("noise",), ())
    return network_estimates(dataset, fit, answer, True)[NAMES[0]]


def test_a_linear_output_near_an_end_has_an_interval_and_a_bounded_one_has_none(dataset: Dataset) -> None:
    linear, bounded = (peak_at(dataset, outputs, 0.99) for outputs in ("linear", "bounded"))
    assert linear.identified
    assert linear.interval_95 is not None
    assert linear.interval_95[0] < truth(0.99)[0] < linear.interval_95[1] == pytest.approx(HIGHS[0])
    assert bounded.interval_95 is None
    assert "bounded output stands at the upper end" in bounded.reason


def test_a_linear_output_outside_the_range_is_said_to_be_there(dataset: Dataset) -> None:
    outside = peak_at(dataset, "linear", 1.05)
    assert outside.interval_95 is None
    assert "answer, 7.15 mm, is outside the range" in outside.reason


def test_an_interval_over_decades_is_a_factor_and_no_end_of_the_range(dataset: Dataset) -> None:
    """Linearly 3e-5 of 1e-5 .. 1e-2 is 0.2 % of the range, at which a bounded output was said to stand at its end."""
    wide = over_decades(dataset)
    fit = fit_network(wide, {CHANNEL: TIMES})
    middle = truth(0.5)
    middle[0] = 3e-5
    found = network_estimates(wide, fit, NetworkAnswer(middle, middle, np.full(4, 0.01), ("noise",), ()), True)
    one = found[NAMES[0]]
    assert one.identified
    assert one.interval_95 is not None
    spread = 2.262 * np.hypot(np.sqrt(np.mean(fit.errors[:, 0] ** 2)), 0.01)
    np.testing.assert_allclose(one.interval_95, (3e-5 * 1e3**-spread, 3e-5 * 1e3**spread), rtol=1e-3)
    assert "the noise, which moves it by a factor of 1.07" in one.reason
    observations, read = observe(record(truth(0.5)), wide, {CHANNEL: 1e-5}), {CHANNEL: TIMES}
    moved, same = (
        network_answer(d, f, observations, read, np.zeros(len(TIMES))).noise_error
        for d, f in ((wide, fit), (dataset, fit_network(dataset, read)))
    )
    np.testing.assert_allclose(moved, same, rtol=1e-3)


@pytest.mark.parametrize(
    ("clock", "carried", "said"),
    [
        (0.0, 0.0, "and the noise, which moves it by"),
        (1e-5, 0.0, "and the noise and the uncertain time origin, which move it by"),
        (0.0, 1e-5, "and the noise and the errors that the model carries, which move it by"),
    ],
)
def test_only_what_moves_the_answer_is_named(dataset: Dataset, clock: float, carried: float, said: str) -> None:
    fit = fit_network(dataset, {CHANNEL: TIMES})
    observations = observe(record(truth(0.5)), dataset, {CHANNEL: 1e-5})
    drift = np.column_stack([np.full(len(TIMES), clock), np.full(len(TIMES), carried)])
    answer = network_answer(dataset, fit, observations, {CHANNEL: TIMES}, drift)
    found = network_estimates(dataset, fit, answer, True)
    assert said in found[NAMES[0]].reason


@pytest.mark.parametrize("copies", [0, 10])
def test_noise_that_the_network_was_trained_with_is_not_called_strange(dataset: Dataset, copies: int) -> None:
    """A point at rest, where the runs differ by nothing but the noise of their copies, read 2 sigma high."""
    noise, times = 5e-5, {CHANNEL: np.append(0.32e-3, TIMES)}
    fit = fit_network(dataset, times, noise=np.full(len(times[CHANNEL]), noise), copies=copies)
    measured = record(truth(0.5), times[CHANNEL])
    measured.channels[CHANNEL][0] = dataset.sampled(CHANNEL, times[CHANNEL])[:, 0].max() + 2.0 * noise
    observations = observe(measured, dataset, {CHANNEL: noise})
    answer = network_answer(dataset, fit, observations, times, np.zeros(len(times[CHANNEL])))
    assert any(" outside what it was trained on" in text for text in answer.warnings) == (copies == 0)
