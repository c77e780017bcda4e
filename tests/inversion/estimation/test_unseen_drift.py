"""A drift that no reading before contact shows: carried where the residual asks for it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation import unseen_drift
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.unseen_drift import by_chance, drift_columns, with_drift
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.filtered_records import filtered_record
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from tests.inversion.estimation.test_calibration import calibrator
from tests.inversion.stand_in import CHANNEL, START, forward, pulse, record, truth

NOISE = 5e-5
DENSE = np.linspace(0.4e-3, 2.6e-3, 600)
OPTIONS = InversionOptions(sampling=None, analyse=False, method="emulator", noise={CHANNEL: NOISE})
SAID = "unless the sensor drifts"


def drifting(z: np.ndarray, rate: float, seed: int = 0) -> Measured:
    """A record of the pulse with a drift [m/s] from its first reading on."""
    measured = record(truth(z), DENSE, NOISE, seed=seed)
    return replace(measured, provenance=(), channels={CHANNEL: measured.channels[CHANNEL] + rate * (DENSE - DENSE[0])})


def hits(dataset: Dataset, emulator: Emulator, rate: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(truths, k) each: whether the interval holds the truth without and with this step, and the ratio of widths."""
    rng, rows = np.random.default_rng(5), []
    for seed in range(8):
        z = 0.1 + 0.8 * rng.random(4)
        problem = calibrator(dataset, emulator, drifting(z, rate, seed), NOISE)
        found = problem.best_fits()
        spans = [intervals(fits[1]) for fits in (found, with_drift(problem, found, 0)[1])]
        held = [(span[:, 0] <= z) & (z <= span[:, 1]) for span in spans]
        rows.append([*held, np.ptp(spans[1], axis=1) / np.ptp(spans[0], axis=1)])
    without, within, ratio = np.array(rows, dtype=np.float64).transpose(1, 0, 2)
    return without, within, ratio


def test_intervals_hold_the_truth_beside_a_drift(dataset: Dataset, emulator: Emulator) -> None:
    without, within, _ = hits(dataset, emulator, 0.2)
    assert without.mean() < 0.8, "the drift does not matter: nothing is tested"
    assert within.mean() >= 0.9


def test_a_drift_is_carried_beside_an_offset_that_hides_it(dataset: Dataset, emulator: Emulator) -> None:
    """Few readings before contact show the offset, and not the drift."""
    times, held = np.arange(0.2e-3, 2.6e-3, 4e-6), []
    for seed in range(6):
        z = 0.1 + 0.8 * np.random.default_rng(seed).random(4)
        clean = record(truth(z), times, NOISE, seed=seed)
        seen = clean.channels[CHANNEL] + 5e-4 + 0.2 * (times - times[0])
        problem = calibrator(dataset, emulator, replace(clean, provenance=(), channels={CHANNEL: seen}), NOISE)
        (channel,) = problem.model.observations.channels
        assert channel.record is not None
        assert channel.record.baseline is not None
        assert not channel.record.baseline.drifts
        problem = problem.with_known(problem.model.observations.baseline_columns)
        found = problem.best_fits()
        spans = [intervals(fits[1]) for fits in (found, with_drift(problem, found, 0)[1])]
        held.append([(span[:, 0] <= z) & (z <= span[:, 1]) for span in spans])
    without, within = np.array(held, dtype=np.float64).mean(axis=(0, 2))
    assert without < 0.8, "the drift does not matter: nothing is tested"
    assert within >= 0.9


@pytest.mark.parametrize(("points", "columns"), [(1, 0), (2, 0), (3, 2)])
def test_a_channel_of_one_or_two_points_has_no_drift(
    dataset: Dataset, emulator: Emulator, points: int, columns: int
) -> None:
    problem = calibrator(dataset, emulator, drifting(np.full(4, 0.5), 0.2), NOISE)
    (channel,) = problem.model.observations.channels
    found = drift_columns(replace(channel, times=channel.times[:points], values=channel.values[:points]))
    assert found.shape == (points, columns)
    assert np.all(np.isfinite(found))


@pytest.mark.parametrize("time", [0.0, 0.1e-3], ids=["white", "correlated"])
@pytest.mark.parametrize("level", [1e-6, 1e-4, 1e-2])
def test_the_columns_of_a_drift_have_the_covariance_of_a_line_through_the_readings_before(
    level: float, time: float
) -> None:
    """Offset and drift of 5 % of the peak, conditioned on four readings with noise `level` as any Gaussian is."""
    early, times = np.array([0.1e-3, 0.15e-3, 0.2e-3, 0.35e-3]), np.linspace(0.4e-3, 2.4e-3, 9)
    noise = SimpleNamespace(level=level)
    own = SimpleNamespace(drift_subtracted=False, early=early, noise=noise)
    channel: Any = SimpleNamespace(times=times, peak=6e-3, record=own, correlation_time=time)
    found = drift_columns(channel)
    elapsed = (np.concatenate([early, times]) - 0.4e-3) / 2.0e-3
    joint = (0.05 * 6e-3) ** 2 * (1.0 + np.outer(elapsed, elapsed))
    apart = np.abs(early[:, None] - early)
    seen, across = joint[:4, :4] + level**2 * (np.exp(-apart / time) if time else np.eye(4)), joint[4:, :4]
    expected = joint[4:, 4:] - across @ np.linalg.solve(seen, across.T)
    np.testing.assert_allclose(found @ found.T, expected, rtol=1e-6, atol=1e-6 * expected.max())


@pytest.mark.parametrize(("gain", "kept"), [(14.0, False), (18.4, False), (18.6, True)])
def test_the_drifts_of_two_channels_must_gain_what_four_nuisances_do_not_by_chance(
    gain: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Chi-square with four degrees exceeds 18.47 once in a thousand, with two 13.82."""
    assert by_chance(4) == pytest.approx(18.467, abs=1e-3)
    channels = [SimpleNamespace(name=name, times=np.arange(5.0)) for name in "ab"]
    observations = SimpleNamespace(channels=channels, split=lambda _: dict.fromkeys("ab", np.zeros(5)))
    correlation = SimpleNamespace(widened={"a": 2.0, "b": 2.0}, correlated=())
    after = SimpleNamespace(best_fits=lambda _: (SimpleNamespace(cost=100.0 - gain), (), correlation))
    before: Any = SimpleNamespace(model=SimpleNamespace(observations=observations), with_known=lambda _: after)
    monkeypatch.setattr(unseen_drift, "drift_columns", lambda channel: np.ones((len(channel.times), 2)))
    monkeypatch.setattr(unseen_drift, "_estimates", lambda *_: np.zeros(10))
    monkeypatch.setattr(unseen_drift, "_sentence", lambda *_: "drifts")
    fits: Any = (SimpleNamespace(cost=100.0), (), correlation)
    problem, _, said = with_drift(before, fits, 0)
    assert (problem is after) == kept
    assert said == (("drifts", "drifts") if kept else ())


def test_a_record_without_a_drift_keeps_its_intervals(dataset: Dataset, emulator: Emulator) -> None:
    _, _, ratio = hits(dataset, emulator, 0.0)
    assert ratio == pytest.approx(1.0)


def test_the_drift_is_said_with_its_rate_and_remedy(dataset: Dataset, emulator: Emulator) -> None:
    found = invert(dataset, drifting(np.full(4, 0.5), 0.2), forward, OPTIONS, emulator=emulator).inversion
    assert found.residual is not None
    assert found.residual.white
    (said,) = (text for text in found.warnings if SAID in text)
    rate = float(said.split("about ")[1].split(" mm/ms")[0])
    assert rate == pytest.approx(0.2, abs=0.06)
    assert "before contact" in said


def test_a_simulated_record_has_no_sensor_that_drifts(dataset: Dataset, emulator: Emulator) -> None:
    """What it has that the model has not is an effect."""
    simulated = replace(drifting(np.full(4, 0.5), 0.2), provenance=("SIMULATED by another solver",))
    assert simulated.simulated
    found = invert(dataset, simulated, forward, OPTIONS, emulator=emulator).inversion
    assert not any(SAID in text for text in found.warnings)


def of_an_instrument(z: np.ndarray, clock: np.ndarray, rate: float, seed: int, level: float = 2e-5) -> Measured:
    """The pulse, at rest before it begins, with noise and a drift [m/s]."""
    rest = np.where(clock < START, 0.0, pulse(truth(z), clock))
    noise = level * np.random.default_rng(seed).normal(size=len(clock))
    return Measured(clock, {CHANNEL: rest + noise + rate * (clock - clock[0])}, {}, {CHANNEL: "m"}, (), "shot.csv")


def test_intervals_of_filtered_records_hold_the_truth_beside_a_drift(dataset: Dataset) -> None:
    """Filtered noise hangs together with or without a drift: none was found, and 11 of 32 intervals held the truth."""
    clock, noise, held, without = np.arange(0.27e-3, 3.0e-3, 5e-6), {CHANNEL: 2e-5}, [], []
    for seed in range(8):
        z = 0.1 + 0.8 * np.random.default_rng(seed).random(4)
        found = filtered_record(of_an_instrument(z, clock, 0.2, seed), "CFC1000", dataset, noise)
        passed = found.filter.dataset(dataset)
        problem = calibrator(passed, fit_emulator(passed, [CHANNEL]), found.measured, noise[CHANNEL])
        fits = problem.best_fits()
        spans = [intervals(one[1]) for one in (fits, with_drift(problem, fits, 0)[1])]
        hits = [(span[:, 0] <= z) & (z <= span[:, 1]) for span in spans]
        without.append(hits[0])
        held.append(hits[1])
    assert np.mean(without) < 0.8, "the drift does not matter: nothing is tested"
    assert np.mean(held) >= 0.9


def test_a_drift_is_as_well_known_behind_a_filter_as_before_it(dataset: Dataset) -> None:
    """A rest of 20 ms: the filtered record had forgotten it, and its drift was uncertain by 5 % of the peak."""
    clock, noise = np.arange(-20e-3, 3e-3, 5e-6), {CHANNEL: 2e-5}
    raw = of_an_instrument(np.full(4, 0.5), clock, 0.0, 0)
    found = filtered_record(raw, "CFC1000", dataset, noise).measured
    ends = [drift_columns(observe(one, dataset, noise).channels[0])[-1] for one in (raw, found)]
    assert np.hypot(*ends[1]) == pytest.approx(np.hypot(*ends[0]), rel=0.2)


def test_a_drift_that_was_subtracted_before_the_filter_is_not_tried_again(dataset: Dataset) -> None:
    clock, noise = np.arange(-20e-3, 3e-3, 5e-6), {CHANNEL: 2e-5}
    found = filtered_record(of_an_instrument(np.full(4, 0.5), clock, 0.02, 0), "CFC1000", dataset, noise)
    assert found.baselines[CHANNEL].drifts
    (channel,) = observe(found.measured, dataset, noise).channels
    assert drift_columns(channel).shape == (len(channel.times), 0)


def test_a_drift_is_found_beside_a_noise_that_is_stated_too_small(dataset: Dataset, emulator: Emulator) -> None:
    """Its residual is then larger than noise, and does not hang together."""
    problem = calibrator(dataset, emulator, drifting(np.full(4, 0.5), 0.3), NOISE / 1.3)
    found = problem.best_fits()
    assert with_drift(problem, found, 0)[2]
