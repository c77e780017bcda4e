"""Filters of records and of the curves that are compared with them: alike, and nothing smeared into sound readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.answers.estimates import intervals
from birdstrike.inversion.estimation.locate import InversionOptions, locate
from birdstrike.inversion.observations.filtered_records import (
    FilteredRecord,
    filtered_by_laboratory,
    filtered_record,
)
from birdstrike.inversion.observations.filters import FilteredForward, ModelFilter, reach, zero_phase
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import fit_emulator
from tests.inversion.stand_in import CHANNEL, NAMES, START, TIME, forward, pulse, record, truth

STEP = 5e-6
NOISE = 2e-5
LEAST = binom.ppf(0.001, 48, 0.95) / 48.0  # share of 48 intervals of 95 %; 73 to 77 % of 80 held before
LONG = STEP * np.arange(-400, 1001)  # from 2 ms before the trigger to 5 ms


def taken(clock: Array = LONG, noise: float = 0.0, share: float = 0.5, **more: Any) -> Measured:
    """The pulse at a share of the parameters' ranges, at rest before it begins."""
    theta = truth(share)
    measured = record(theta, clock, noise=noise, **more)
    rest = np.where(clock < START, pulse(theta, clock), 0.0)
    return replace(measured, channels={CHANNEL: measured.channels[CHANNEL] - rest})


def filtered(measured: Measured, dataset: Dataset, name: str = "CFC600", time_offset: float = 0.0) -> FilteredRecord:
    return filtered_record(measured, name, dataset, {CHANNEL: NOISE}, time_offset)


def apart(found: FilteredRecord, share: float = 0.5) -> float:
    """The largest difference between a filtered record and the filtered curve of the same parameters, in noise."""
    curve = found.filter.curves(TIME, pulse(truth(share)))
    measured = found.measured
    both = measured.time >= 0.0
    times = measured.time[both]
    return float(np.abs(np.interp(times, TIME, curve) - measured.channels[CHANNEL][both]).max()) / NOISE


@pytest.mark.parametrize("name", ["CFC600", "CFC1000"])
def test_class_passes_half_the_power_at_its_corner_without_delay(name: str) -> None:
    """-3 dB at CFC / 0.6 (SAE J211-1), and a slow wave passes where it was."""
    time = np.arange(0.0, 0.2, STEP)
    corner = float(name.removeprefix("CFC")) / 0.6
    middle = slice(len(time) // 4, -len(time) // 4)
    passed = zero_phase(np.sin(2.0 * np.pi * corner * time), STEP, name)[middle]
    assert np.sqrt(2.0 * np.mean(passed**2)) == pytest.approx(1.0 / np.sqrt(2.0), rel=0.02)
    slow = np.sin(2.0 * np.pi * corner / 20.0 * time)
    np.testing.assert_allclose(zero_phase(slow, STEP, name)[middle], slow[middle], atol=0.01)


def test_a_straight_line_passes_up_to_its_ends() -> None:
    """Odd reflection continues it; even reflection breaks it, and too short a one leaves the filter's start in it."""
    line = np.linspace(1.0, 3.0, 801)
    np.testing.assert_allclose(zero_phase(line, STEP, "CFC600"), line, atol=1e-6)


@pytest.mark.parametrize("name", ["CFC600", "CFC1000"])
@pytest.mark.parametrize("clock", [LONG, LONG[400:], LONG[320:901], LONG[440:]], ids=["long", "late", "short", "rest"])
def test_a_record_and_the_curve_that_it_is_of_pass_alike(dataset: Dataset, clock: Array, name: str) -> None:
    """Whatever the record has before the trigger and after the simulation: they differed by 11 times the noise."""
    assert apart(filtered(taken(clock), dataset, name)) < 0.25


def test_a_clock_that_is_late_does_not_matter(dataset: Dataset) -> None:
    """The filter then sees another end of the record than of the model, and what that changes is left out."""
    late, t0 = taken(t0=4e-5), 4e-5
    found = filtered(late, dataset, time_offset=2e-5)
    curve = found.filter.curves(TIME, pulse(truth(0.5)))
    inside = found.measured.time >= t0
    times = found.measured.time[inside]
    difference = np.interp(times - t0, TIME, curve) - found.measured.channels[CHANNEL][inside]
    assert np.abs(difference).max() < 0.25 * NOISE
    assert times[-1] == pytest.approx(TIME[-1] - reach("CFC600"), abs=STEP)


def test_the_laboratory_s_filter_is_taken_from_the_model_alone(dataset: Dataset) -> None:
    whole = taken()
    by_them = replace(whole, channels={CHANNEL: zero_phase(whole.channels[CHANNEL], STEP, "CFC600")})
    found = filtered_by_laboratory(by_them, "CFC600", dataset, {})
    assert apart(found) < 0.25
    assert found.measured.time[-1] == pytest.approx(2.5e-3)
    kept = np.isin(by_them.time, found.measured.time)
    np.testing.assert_array_equal(found.measured.channels[CHANNEL], by_them.channels[CHANNEL][kept])
    # Before the trigger those into which the filter has carried the response would be taken for the reading at rest.
    at_rest = found.measured.time < 0.0
    assert np.abs(found.measured.channels[CHANNEL][at_rest]).max() < 0.05 * NOISE
    assert at_rest.sum() == 159
    assert "filtered = CFC600: 500 readings after 2.5 ms are left out" in found.warnings[0]
    twice = filtered(by_them, dataset)
    assert apart(twice) > 5.0


def test_a_class_that_reaches_over_much_of_the_simulation_is_refused(dataset: Dataset) -> None:
    said = (
        r"filter = CFC180 mixes readings 1\.67 ms apart \(half a period of its corner frequency, 300 Hz\); allowed is "
        r"a quarter of the simulated 3 ms, 0\.75 ms: use CFC600 or CFC1000, or simulate 6\.67 ms \(time\.end\)"
    )
    with pytest.raises(UserError, match=said):
        filtered(taken(), dataset, "CFC180")
    with pytest.raises(UserError, match=r"filtered = CFC60 mixes readings 5 ms apart"):
        filtered_by_laboratory(taken(), "CFC60", dataset, {})


def test_what_cannot_be_filtered_is_refused(dataset: Dataset) -> None:
    measured = taken()
    for uneven, refused in ((2e-4, False), (1e-2, True)):
        moved = replace(measured, time=measured.time + uneven * STEP * (np.arange(len(LONG)) % 2))
        if not refused:
            assert apart(filtered(moved, dataset)) < 0.25
            continue
        with pytest.raises(UserError, match=r"steps of 0\.00495 \.\. 0\.00505 ms; a filter needs equally spaced"):
            filtered(moved, dataset)
    holes = np.where(np.arange(len(LONG)) == 409, np.nan, measured.channels[CHANNEL])
    with pytest.raises(UserError, match=f"smear the gaps of {CHANNEL}"):
        filtered(replace(measured, channels={CHANNEL: holes}), dataset)
    with pytest.raises(UserError, match=r"begins at 0\.5 ms, when the plate already moves \(from 0\.29 ms on\)"):
        filtered(taken(LONG[500:]), dataset)


def test_a_clock_that_was_rounded_is_filtered_as_the_exact_one(dataset: Dataset) -> None:
    """300 kHz to 0.1 us: steps of 3.3 and 3.4 us, refused as uneven."""
    exact = np.arange(-600, 1500) / 300e3
    measured = taken(exact)
    rounded = replace(measured, time=np.round(exact, 7))
    sound, found = filtered(measured, dataset), filtered(rounded, dataset)
    assert found.filter.step == pytest.approx(sound.filter.step, rel=1e-6)
    np.testing.assert_allclose(
        found.measured.channels[CHANNEL], sound.measured.channels[CHANNEL], rtol=0.0, atol=0.01 * NOISE
    )


def test_a_clipped_record_is_refused_and_one_that_is_clipped_later_is_not(dataset: Dataset) -> None:
    measured = taken(noise=NOISE)
    values = measured.channels[CHANNEL]
    clipped = replace(measured, channels={CHANNEL: np.minimum(values, 4e-3)})
    with pytest.raises(MeasuredError, match=r"has \d+ points at 0\.\d+ \.\. 1\.\d+ ms that are clipped"):
        filtered(clipped, dataset)
    stuck = replace(measured, channels={CHANNEL: np.where(LONG > 1.6e-3, values[720], values)})
    with pytest.raises(MeasuredError, match=r"has 281 points at 1\.6 \.\. 3 ms that are frozen"):
        filtered(stuck, dataset)
    later = replace(measured, channels={CHANNEL: np.where(LONG > 3.2e-3, 9e-3, values)})
    np.testing.assert_array_equal(
        filtered(later, dataset).measured.channels[CHANNEL], filtered(measured, dataset).measured.channels[CHANNEL]
    )


def test_spikes_do_not_reach_their_neighbours(dataset: Dataset) -> None:
    """Five readings of 30 mm, one before the trigger: the filter spread them by up to 0.6 mm."""
    measured, places = taken(noise=NOISE), np.array([310, 480, 520, 640, 700])
    values = measured.channels[CHANNEL].copy()
    values[places] = 30e-3
    sound, found = filtered(measured, dataset), filtered(replace(measured, channels={CHANNEL: values}), dataset)
    assert not np.isin(LONG[places], found.measured.time).any()
    assert len(found.measured.time) == len(sound.measured.time) - 4
    both = np.isin(sound.measured.time, found.measured.time)
    np.testing.assert_allclose(
        found.measured.channels[CHANNEL], sound.measured.channels[CHANNEL][both], rtol=0.0, atol=0.2 * NOISE
    )
    assert any("5 points at -0.45 .. 1.5 ms are" in text and "by interpolation" in text for text in found.warnings)


def test_offset_and_noise_are_those_of_the_record_before_the_filter(dataset: Dataset) -> None:
    measured = taken(noise=NOISE)
    moved = replace(measured, channels={CHANNEL: measured.channels[CHANNEL] + 3e-4})
    found = filtered_record(moved, "CFC600", dataset, {})
    assert apart(found) < 2.0
    observed = observe(found.measured, dataset, {})
    assert observed.channels[0].noise[0] == pytest.approx(NOISE, rel=0.15)
    columns = found.rest_columns(observed)
    # 400 + 60 readings at rest: the mean of those is uncertain by noise / sqrt(460).
    assert np.hypot.reduce(columns[0]) == pytest.approx(NOISE / np.sqrt(460), rel=1.5)
    assert any("reads 0.3 mm" in text for text in found.warnings)
    assert observe(filtered(measured, dataset).measured, dataset, {CHANNEL: NOISE}).channels[0].noise_source == "case"


def test_a_curve_that_moves_at_once_has_its_rest_in_front() -> None:
    """As long as the filter can see: a curve with 10 ms of rest before it passes alike."""
    force = np.exp(-TIME / 1e-3)
    found = ModelFilter("CFC600", float(TIME[-1]), STEP).curves(TIME, force)
    clock = TIME[-1] - STEP * np.arange(2600)[::-1]
    expected = zero_phase(np.interp(clock, TIME, force), STEP, "CFC600")
    np.testing.assert_allclose(found, np.interp(TIME, clock, expected), rtol=0.0, atol=1e-5)


def test_a_filtered_model_is_the_filter_of_its_curves(dataset: Dataset) -> None:
    passed = ModelFilter("CFC600", 2.8e-3, STEP)
    theta: dict[str, float] = dict(zip(NAMES, truth(0.5), strict=True))
    run = FilteredForward(forward, passed)(theta)
    plain = forward(theta)
    for name, values in plain.channels.items():
        np.testing.assert_array_equal(run.channels[name], passed.curves(TIME, values))
        np.testing.assert_array_equal(run.channels[name][TIME > 2.8e-3], values[TIME > 2.8e-3])
    rows = passed.dataset(dataset).curves[CHANNEL]
    np.testing.assert_array_equal(rows[3], passed.curves(TIME, dataset.curves[CHANNEL][3]))
    assert np.abs(rows - dataset.curves[CHANNEL]).max() > 10.0 * NOISE


def errors_with(
    dataset: Dataset, prepared: Callable[[Measured], FilteredRecord], rho: float = 0.0, rest: float = 2e-3
) -> tuple[float, float]:
    """Coverage of the 95 % intervals and the errors over their standard deviations, of 12 records with noise.

    rho: correlation of neighbouring readings' noise; rest: before the trigger [s].
    """
    hits, scaled = [], []
    clock = STEP * np.arange(-round(rest / STEP), 1001)
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        z = 0.1 + 0.8 * rng.random(4)
        noise = np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.normal(size=len(clock))))
        values = pulse(truth(z), clock) * (clock >= START) + 1e-4 * noise
        found = prepared(Measured(clock, {CHANNEL: values}, {}, {CHANNEL: "m"}, (), "shot.csv"))
        passed = found.filter.dataset(dataset)
        options = InversionOptions(sampling=None, method="emulator")
        located = locate(passed, found.measured, options, fit_emulator(passed, [CHANNEL]))
        ends, mode = intervals(located.calibration.modes), located.calibration.modes[0]
        hits.append((ends[:, 0] <= z) & (z <= ends[:, 1]))
        scaled.append((mode.z - z) / np.sqrt(np.diag(mode.covariance)[:4]))
    return float(np.mean(hits)), float(np.sqrt(np.mean(np.square(scaled))))


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_intervals_of_filtered_records_hold_the_truth(dataset: Dataset, rho: float) -> None:
    """The noise before the filter counts, with its correlation, and no reading that the filter has but the end for."""
    coverage, size = errors_with(dataset, lambda measured: filtered_record(measured, "CFC600", dataset, {}), rho)
    assert coverage >= LEAST
    assert 0.6 < size < 1.25


def by_laboratory(measured: Measured, dataset: Dataset, noise: Mapping[str, float]) -> FilteredRecord:
    passed = zero_phase(measured.channels[CHANNEL], STEP, "CFC600")
    return filtered_by_laboratory(replace(measured, channels={CHANNEL: passed}), "CFC600", dataset, noise)


@pytest.mark.parametrize(("noise", "rest"), [({CHANNEL: 1e-4}, 2e-3), ({}, 15e-3)])
def test_intervals_of_records_that_the_laboratory_has_filtered_hold_the_truth(
    dataset: Dataset, noise: Mapping[str, float], rest: float
) -> None:
    """A stated noise is that before the filter; else level and correlation are those of a long rest behind it."""
    coverage, size = errors_with(dataset, lambda measured: by_laboratory(measured, dataset, noise), rest=rest)
    assert coverage >= LEAST
    assert 0.4 < size < 1.25


def test_a_short_rest_behind_the_laboratory_s_filter_is_told(dataset: Dataset) -> None:
    """Of 20 such records 75 % of the intervals held the truth."""
    found = by_laboratory(taken(noise=1e-4), dataset, {})
    assert "shows the noise of displacement_centre behind the filter alone" in found.warnings[-1]
    assert "(12.5 ms would do)" in found.warnings[-1]
    stated = by_laboratory(taken(noise=1e-4), dataset, {CHANNEL: 1e-4})
    assert len(stated.warnings) == len(found.warnings) - 1


def test_a_plateau_that_rang_before_the_filter_is_no_flat_top_behind_it(dataset: Dataset) -> None:
    """A plate that yields and rings at 12 kHz; 519 of 750 points of the filtered record were left out as saturated."""
    rng = np.random.default_rng(3)
    level = np.clip((LONG - START) / 3e-4, 0.0, 1.0) * 50.0 * NOISE
    ringing = np.where(LONG > START, 5.0 * NOISE * np.sin(2.0 * np.pi * 12e3 * LONG), 0.0)
    values = level + ringing + NOISE * rng.standard_normal(len(LONG))
    found = filtered(replace(taken(), channels={CHANNEL: values}), dataset)
    (channel,) = observe(found.measured, dataset, {CHANNEL: NOISE}).channels
    assert channel.record is not None
    assert {cut.reason for cut in channel.record.cuts} <= {"outside"}
