"""Clipped readings and outliers: an experimentalist's care, with nothing done silently."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.observations import outliers as module
from birdstrike.inversion.observations.noise import Noise, with_digitiser
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.observations.outliers import (
    _stretches,
    beside_clipped,
    clipped,
    dropouts,
    frozen,
    jumps,
    lost_at_the_extreme,
    outliers,
    saturated,
)
from tests.inversion.stand_in import CHANNEL, record, truth

STEP = 5e-6
CLOCK = np.linspace(0.3e-3, 2.6e-3, 120)


def test_flat_top_is_clipped_and_rest_is_not(dataset: Dataset) -> None:
    measured = record(truth(0.5), CLOCK, noise=1e-5)
    values = np.minimum(measured.channels[CHANNEL], 4e-3)
    assert clipped(values).sum() == (values == 4e-3).sum() > 4
    assert not clipped(measured.channels[CHANNEL]).any()
    observations = observe(replace(measured, channels={CHANNEL: values}), dataset, {CHANNEL: 1e-5})
    assert len(observations.channels[0].times) == 120 - int((values == 4e-3).sum())
    assert any("are clipped" in warning for warning in observations.warnings)


@pytest.mark.parametrize("seed", range(5))
def test_one_spike_is_found_and_noise_is_not(seed: int) -> None:
    values = record(truth(0.5), CLOCK, noise=2e-5, seed=seed).channels[CHANNEL]
    noise = np.full(len(values), 2e-5)
    assert not outliers(CLOCK, values, noise).any()
    values[60] += 6e-4
    np.testing.assert_array_equal(np.flatnonzero(outliers(CLOCK, values, noise)), [60])


def test_table_of_twelve_points_is_taken_as_it_is() -> None:
    values = np.array([0.0, 1.0, 5.0, 5.0, 5.0, 5.0, 3.0, 1.0, 9.0, 0.0, 0.0, 0.0])
    assert not clipped(values).any()
    assert not outliers(np.arange(12.0), values, np.full(12, 1e-3)).any()


@pytest.mark.parametrize("seed", range(5))
def test_a_flat_top_under_noise_is_found_and_a_smooth_peak_is_not(seed: int) -> None:
    clock = np.arange(0.3e-3, 2.6e-3, STEP)
    clean = record(truth(0.5), clock).channels[CHANNEL]
    noise = 2e-5 * np.random.default_rng(seed).normal(size=len(clock))
    assert not saturated(clean + noise, 2e-5).any()
    for share in (0.5, 0.75, 0.95):
        end = share * clean.max()
        found = saturated(np.minimum(clean, end) + noise, 2e-5)
        assert found[clean > end].mean() > 0.95
        assert not found[clean < 0.9 * end].any()


@pytest.mark.parametrize("seed", range(5))
def test_a_plate_that_rings_at_its_peak_is_no_flat_top(seed: int) -> None:
    """A plate that yields stays near its largest deflection for a while; what it rings by there is above the noise."""
    t, sigma = np.arange(0.0, 3.0, 0.005), 0.05  # ms, mm
    plateau = np.minimum(np.interp(t, [0.0, 1.45, 1.75, 3.0], [0.0, 32.0, 32.0, 22.0]), 32.0)
    ringing = np.where((t > 1.45) & (t < 1.75), 0.1 * np.sin(2.0 * np.pi * (t - 1.45) / 0.15), 0.0)
    noise = sigma * np.random.default_rng(seed).normal(size=len(t))
    assert saturated(plateau + noise, sigma).any()
    assert not saturated(plateau + ringing + noise, sigma).any()


def test_lost_samples_are_found_and_a_coarse_converter_has_none() -> None:
    clock = np.arange(0.3e-3, 2.6e-3, STEP)
    values = record(truth(0.5), clock, noise=2e-5).channels[CHANNEL]
    assert not dropouts(values).any()
    assert not dropouts(5e-4 * np.round(values / 5e-4)).any()
    lost = np.array([100, 101, 180, 300])
    values[lost] = 0.0
    np.testing.assert_array_equal(np.flatnonzero(dropouts(values)), lost)


def test_a_code_for_lost_samples_is_one_at_a_record_s_ends_too() -> None:
    """The first and the last reading were kept for the plate's motion, which then jumps."""
    clock = np.arange(0.3e-3, 2.6e-3, STEP)
    values = record(truth(0.5), clock, noise=2e-5).channels[CHANNEL]
    code = np.array([0, 1, 100, 180, 300, len(values) - 1])
    values[code] = -0.999
    np.testing.assert_array_equal(np.flatnonzero(dropouts(values)), code)
    pulse = np.concatenate([np.zeros(3), 50e3 * np.exp(-np.arange(200) / 50.0)])  # N, from one sample to the next
    assert not dropouts(pulse).any()


def test_levels_of_a_fine_converter_without_lost_samples_are_not_looked_at_one_by_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of 16 bits: a million readings took more than a minute."""
    looked: list[int] = []
    monkeypatch.setattr(module, "_stretches", lambda marked: looked.append(len(marked)) or _stretches(marked))
    values = np.round(30000.0 * np.sin(np.linspace(0.0, 3.0, 20000)))
    values[[300, 700, 1200]] = -32768.0
    assert np.flatnonzero(dropouts(values)).tolist() == [300, 700, 1200]
    assert len(looked) == 1


def test_a_converter_that_overflows_jumps() -> None:
    clock = np.arange(0.3e-3, 2.6e-3, STEP)
    values = record(truth(0.5), clock, noise=2e-5).channels[CHANNEL]
    assert not len(jumps(clock, values))
    beyond = values > 4e-3
    edges = np.flatnonzero(np.diff(beyond.astype(int)))
    np.testing.assert_array_equal(jumps(clock, np.where(beyond, values - 8e-3, values)), edges)


def test_rounding_that_exceeds_the_noise_takes_its_place(dataset: Dataset) -> None:
    measured = record(truth(0.5), np.arange(0.0, 2.6e-3, STEP), noise=2e-5)
    coarse = replace(measured, channels={CHANNEL: 5e-4 * np.round(measured.channels[CHANNEL] / 5e-4)})
    found = observe(coarse, dataset, {CHANNEL: 2e-5})
    assert found.channels[0].noise[0] == pytest.approx(5e-4 / np.sqrt(12.0), rel=0.02)
    assert found.channels[0].noise_source == "digitiser's step"
    assert any("multiples of 0.5 mm" in text for text in found.warnings)


def test_rounding_is_taken_to_last_somewhat_longer_than_it_does() -> None:
    """Of 40 slow motions of some steps: until its correlation is 1/e; a third of a step's time is on the safe side."""
    rng, time, ratios = np.random.default_rng(0), STEP * np.arange(6000), []
    for _ in range(40):
        waves = np.sin(2.0 * np.pi * rng.uniform(16.0, 100.0, (4, 1)) * time + rng.uniform(0.0, 6.0, (4, 1))).sum(
            axis=0
        )
        read = 1e-3 * np.round(3.0 * waves)
        error = read - 3e-3 * waves
        correlation = np.correlate(error, error, "full")[len(time) - 1 :]
        lasts = STEP * int(np.argmax(correlation < correlation[0] / np.e))
        noise, _ = with_digitiser("w", "m", Noise(np.full(len(time), 1e-6), 0.0, "case"), time, read)
        ratios.append(noise.correlation_time / lasts)
    assert min(ratios) > 1.0
    assert np.median(ratios) < 4.0


def test_a_single_reading_far_beyond_the_noise_is_no_flat_top() -> None:
    """-1e17 among millimetres: the band of the noise about it is less than its rounding, which ended in a traceback."""
    values = np.random.default_rng(0).normal(0.0, 1e-5, 100)
    values[50] = -1e17
    assert not saturated(values, 1e-5).any()


def rounded(step: float, spacing: float, noise: float, seed: int) -> np.ndarray:
    """A smooth peak of 5 mm in steps of a digitiser, its zero anywhere between two; noise: in steps."""
    rng, clock = np.random.default_rng(seed), np.arange(-2e-4, 2.6e-3, spacing)
    smooth = 5e-3 * np.sin(np.pi * np.maximum(clock, 0.0) / 3e-3)
    return step * np.round(smooth / step + noise * rng.normal(size=len(clock)) + rng.uniform())


@pytest.mark.parametrize("noise", [0.0, 0.3, 0.5])
@pytest.mark.parametrize(("step", "spacing"), [(1e-6, 5e-6), (1e-6, 2e-6), (5e-6, 2e-5), (2e-5, 1e-6), (2e-4, 5e-6)])
def test_a_smooth_peak_in_steps_is_neither_clipped_nor_frozen(step: float, spacing: float, noise: float) -> None:
    """Of these 15 x 12 records 42 had readings cut, as from a stopped logger or an amplifier at its end."""
    cut = 0
    for seed in range(12):
        values = rounded(step, spacing, noise, seed)
        cut += bool(clipped(values).any() or frozen(values).any())
    assert cut <= 1


@pytest.mark.parametrize("share", [0.6, 0.8, 0.95])
@pytest.mark.parametrize(("step", "spacing"), [(1e-6, 5e-6), (5e-6, 2e-5), (2e-5, 1e-6)])
def test_a_clipped_peak_in_steps_is_clipped(step: float, spacing: float, share: float) -> None:
    for seed in range(12):
        values = rounded(step, spacing, 0.3, seed)
        end = step * np.round(share * 5e-3 / step)
        np.testing.assert_array_equal(clipped(np.minimum(values, end)), values >= end)


def test_a_logger_that_stops_at_a_fine_step_is_frozen() -> None:
    for seed in range(12):
        values = rounded(1e-6, 5e-6, 0.3, seed)[60:]
        values[200:212] = values[200]
        assert frozen(values)[200:212].all()


def test_readings_beside_a_clipped_stretch_go_until_their_mean_is_four_standard_deviations_off() -> None:
    values = np.concatenate([np.zeros(10), np.full(10, 6.5), np.full(10, 10.0), np.full(10, 6.5), np.zeros(10)])
    beside = beside_clipped(values, values == 10.0, 1.0)  # 3.5 off, until one of the five is 10
    assert np.flatnonzero(beside).tolist() == [*range(14, 20), *range(30, 36)]


def test_one_empty_cell_at_the_extreme_is_an_overload() -> None:
    """Two steps between readings; elsewhere there is one."""
    times = np.arange(40.0)
    values = np.sin(np.pi * times / 39.0)
    values[20] = np.nan
    assert np.flatnonzero(lost_at_the_extreme(times, values)).tolist() == [20]


def test_a_lost_sample_near_the_curve_is_found_by_those_far_from_it() -> None:
    """-0.5 mm again and again: far from 5 mm, and by half of that limit from the readings about it."""
    values = 5.0 * np.sin(np.linspace(0.0, np.pi, 201))
    values += 0.02 * np.random.default_rng(0).normal(size=201)
    usual = max(0.05 * 5.0, 20.0 * float(np.median(np.abs(np.diff(values)))))
    lost = np.array([60, 90, 120, 3])
    values[lost] = float(np.median(values[[0, 1, 2, 4, 5, 6, 7, 8]])) - 0.5 * usual
    np.testing.assert_array_equal(np.flatnonzero(dropouts(values)), np.sort(lost))
