"""What instruments add to a record, and what the reader makes of it: noise, offset, hum, clipping, stopped loggers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.before_contact import BeforeContact
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.high_frequency import white_scatter
from birdstrike.inversion.observations.noise import Stated, channel_noise
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.observations.outliers import held
from birdstrike.inversion.observations.reader import ChannelRecord, read_record
from tests.inversion.stand_in import CHANNEL, pulse, record, truth

STEP = 1e-5
SIGMA = 5e-5
STATED = 3e-5
RESPONSE = np.arange(0.0, 3e-3, STEP)
EXPECTED = Expected({CHANNEL: "m"}, 0.0, 3e-3, 0.0, {CHANNEL: STATED})
NO_NOISE_STATED = replace(EXPECTED, noise={})


def shot(
    before: float = 0.0, noise: float = SIGMA, seed: int = 0, end: float = 3e-3, added: Array | float = 0.0
) -> Measured:
    """The pulse from `before` [s] before t = 0 on, with white noise and what an instrument has `added` [m]."""
    clock = STEP * np.arange(-round(before / STEP), round(end / STEP))
    found = record(truth(0.5), clock, noise, seed=seed)
    return replace(found, channels={CHANNEL: found.channels[CHANNEL] + added})


def read(measured: Measured, expected: Expected = EXPECTED, zero: bool = True) -> ChannelRecord:
    return read_record(measured, expected, test_stated=False, zero=zero)[0]


def test_noise_that_is_stated_too_small_is_replaced_by_that_between_neighbours() -> None:
    """0.03 mm stated, as in a case made by `birdstrike new`, and a record without any rest that scatters by 0.05."""
    found = read(shot())
    assert found.noise.level == pytest.approx(SIGMA, rel=0.25)  # some 50 degrees of freedom: 10 % at one sigma
    (said,) = found.remarks
    assert "the noise stated (0.03 mm, case) is less than the scatter of neighbouring points (0.05" in said
    assert "sensors.displacement_centre.noise of its case, or birdstrike import --sigma" in said
    assert read(shot(noise=STATED)).noise.source == "case"


def test_white_noise_as_stated_is_contradicted_no_oftener_than_the_test_says() -> None:
    """0.5 % of short records: with a fifth of a degree of freedom a difference it was 1.7 %."""
    clock, rng = STEP * np.arange(100), np.random.default_rng(0)
    stated = Stated(SIGMA, None, np.arange(100), np.zeros(100, dtype=bool))
    nothing_before = BeforeContact.of(clock[:0], clock[:0], 1.0)

    def source() -> str:
        white = white_scatter(clock, rng.normal(0.0, SIGMA, 100))
        return channel_noise(CHANNEL, "m", 1.0, nothing_before, stated, white)[0].source

    assert [source() for _ in range(4000)].count("scatter of neighbouring points") < 0.01 * 4000


def test_noise_that_nobody_states_is_that_between_neighbours() -> None:
    found = read(shot(), NO_NOISE_STATED)
    assert found.noise.source == "scatter of neighbouring points"
    assert found.noise.level == pytest.approx(SIGMA, rel=0.25)
    assert found.noise.known


def test_a_stated_noise_that_is_larger_stands_and_both_are_said() -> None:
    found = read(shot(before=1e-3, noise=1e-5))
    assert (found.noise.sigma == STATED).all()
    assert "the noise stated (0.03 mm, case) is more than that of the record before contact (0.009" in found.remarks[0]


def test_a_stated_noise_that_is_clearly_smaller_gives_way_however_little() -> None:
    """0.03 mm stated, 0.035 before contact over many points: less than a fifth more, and sure."""
    found = read(shot(before=0.05, noise=1.18 * STATED))
    assert found.noise.level == pytest.approx(1.18 * STATED, rel=0.05)
    assert "is not that of the record before contact" in found.remarks[0]
    assert "which is used instead" in found.remarks[0]


def test_what_the_runs_scatter_themselves_is_no_noise_of_the_record(dataset: Dataset) -> None:
    """Numerical jitter is in every run of the model: a record of the same jitter has no more noise than is stated."""
    rng = np.random.default_rng(3)
    rough = {name: rows + SIGMA * rng.normal(size=rows.shape) for name, rows in dataset.curves.items()}
    jittery = replace(dataset, curves={**dataset.curves, CHANNEL: rough[CHANNEL]})
    measured = shot()
    measured = replace(measured, time=measured.time + 4e-4)  # no rest before the response
    assert observe(measured, jittery, {CHANNEL: STATED}).channels[0].noise_source == "case"
    assert observe(measured, dataset, {CHANNEL: STATED}).channels[0].noise_source == "scatter of neighbouring points"


def test_an_offset_before_contact_is_taken_out_and_its_interval_said() -> None:
    """500 points before contact at 1.2 mm."""
    found = read(shot(before=5e-3, added=1.2e-3))
    exact = pulse(truth(0.5), found.times)
    assert found.values - exact == pytest.approx(np.zeros(len(exact)), abs=5.0 * SIGMA)
    assert abs(float(np.mean(found.values - exact))) < 4.0 * SIGMA / np.sqrt(300.0) + 4.0 * SIGMA / np.sqrt(500.0)
    assert found.baseline is not None
    low, high = found.baseline.interval(found.baseline.middle)
    assert low < 1.2e-3 < high < low + 1e-5
    assert any("reads 1.2 mm (95 %: 1.19" in text and "birdstrike import --zero" in text for text in found.remarks)


def test_a_sensor_at_zero_is_left_alone() -> None:
    for seed in range(5):
        measured = shot(before=5e-3, seed=seed)
        found = read(measured)
        assert found.baseline is None
        np.testing.assert_array_equal(found.values, measured.channels[CHANNEL][np.isin(measured.time, found.times)])


@pytest.mark.parametrize("kind", ["hum of 50 Hz", "hum of 60 Hz", "drift"])
def test_drift_and_hum_are_followed_as_far_as_their_uncertainty_says(kind: str) -> None:
    """What is left after the baseline, in the standard deviations that its columns give."""
    apart = []
    for seed in range(12):
        clock = shot(before=25e-3).time
        wave = 2e-4 * np.sin(2.0 * np.pi * float(kind.split()[2]) * clock + seed) if "hum" in kind else 0.05 * clock
        measured = shot(before=25e-3, seed=seed, added=wave)
        found = read(measured)
        assert found.baseline is not None
        assert kind in found.baseline.kind
        left = np.interp(found.times, clock, wave) - found.baseline.at(found.times)
        spread = np.sqrt((found.baseline.columns(found.times) ** 2).sum(axis=1))
        apart.append(left[-1] / spread[-1])
    assert np.sqrt(np.mean(np.square(apart))) < 1.6  # of 12 draws of a standard normal: 0.1 % are larger
    assert np.max(np.abs(apart)) < 4.0


def test_the_beginning_of_a_hum_is_a_drift_whose_bend_is_uncertain() -> None:
    """2 ms before contact are a tenth of a period of 50 Hz: the drift is found, and what it becomes is left open."""
    for seed in range(8):
        clock = shot(before=2e-3).time
        wave = 3e-4 * np.sin(2.0 * np.pi * 50.0 * clock + seed)
        found = read(shot(before=2e-3, noise=1e-5, added=wave), NO_NOISE_STATED)
        assert found.baseline is not None
        left = np.interp(found.times, clock, wave) - found.baseline.at(found.times)
        spread = np.sqrt((found.baseline.columns(found.times) ** 2).sum(axis=1))
        assert np.abs(left / spread).max() < 4.0


def test_readings_beside_a_clipped_stretch_do_not_pull_the_fit() -> None:
    """The size of the curve, by least squares over what is left of 300 clipped records, is right on average."""
    size = []
    for seed in range(300):
        measured = shot(noise=1e-4, seed=seed)
        stopped = np.minimum(measured.channels[CHANNEL], 4.2e-3)  # of a peak of 4.7 mm
        found = read(replace(measured, channels={CHANNEL: stopped}), replace(EXPECTED, noise={CHANNEL: 1e-4}))
        exact = pulse(truth(0.5), found.times)
        size.append((exact @ found.values / (exact @ exact) - 1.0) / (1e-4 / np.sqrt(exact @ exact)))
    assert abs(np.mean(size)) < 4.0 / np.sqrt(len(size))
    assert 0.8 < np.std(size) < 1.2


def test_an_overload_that_the_logger_left_empty_is_a_clipped_stretch_too() -> None:
    measured = shot(noise=1e-4)
    values = measured.channels[CHANNEL].copy()
    values[values > 4.2e-3] = np.nan
    found = read(replace(measured, channels={CHANNEL: values}), replace(EXPECTED, noise={CHANNEL: 1e-4}))
    assert found.values[found.times < 1.4e-3].max() < 4.2e-3 - 2.0e-4
    assert any("beside a clipped stretch" in text for text in found.warnings)


def test_cells_lost_now_and_then_are_no_overload_where_they_fall_on_the_peak() -> None:
    measured = shot(noise=1e-4)
    values = measured.channels[CHANNEL].copy()
    values[::7] = np.nan
    found = read(replace(measured, channels={CHANNEL: values}), replace(EXPECTED, noise={CHANNEL: 1e-4}))
    assert not found.cuts
    values[values > 4.2e-3] = np.nan  # an overload among them is one
    found = read(replace(measured, channels={CHANNEL: values}), replace(EXPECTED, noise={CHANNEL: 1e-4}))
    assert any("beside a clipped stretch" in text for text in found.warnings)


def test_empty_cells_between_a_channels_own_readings_are_no_overload() -> None:
    """Two sensors on one clock: each has its gap at the other's instants, and loses nothing by it."""
    clock = STEP / 2.0 * np.arange(600)
    values = np.where(np.arange(600) % 2 == 0, pulse(truth(0.5), clock) + 1e-5 * np.cos(1e6 * clock), np.nan)
    found = read(replace(shot(), time=clock, channels={CHANNEL: values}))
    assert len(found.times) == 300
    assert not found.cuts


def test_a_smooth_peak_of_a_coarse_digitiser_is_not_clipped() -> None:
    measured = shot(noise=0.0, end=3e-3)
    step = 2e-5
    rounded = {CHANNEL: step * np.round(measured.channels[CHANNEL] / step)}
    assert not any("clipped" in text for text in read(replace(measured, channels=rounded)).warnings)


def test_a_logger_that_stops_is_found_and_what_it_repeats_is_left_out() -> None:
    measured = shot(before=5e-4)
    values = measured.channels[CHANNEL].copy()
    values[150:190] = values[150]
    found = read(replace(measured, channels={CHANNEL: values}))
    assert not np.isin(measured.time[150:190], found.times).any()
    assert any("40 points at 1 .. 1.39 ms are frozen (one reading repeated)" in text for text in found.warnings)


def test_a_record_that_moves_before_contact_tells_neither_noise_nor_zero() -> None:
    """Triggered 1 ms late: by its clock the response begins before t = 0."""
    late = shot(before=1.5e-3)
    moved = replace(late, channels={CHANNEL: pulse(truth(0.5), late.time + 1e-3)})
    noisy = moved.channels[CHANNEL] + 1e-5 * np.random.default_rng(0).normal(size=len(late.time))
    found = read(replace(moved, channels={CHANNEL: noisy}))
    assert found.baseline is None
    assert found.noise.level < 1e-4
    assert any("moves before contact" in text and "--shift" in text for text in found.remarks)


@pytest.mark.parametrize("before", [0, 100])
def test_a_force_that_rings_between_two_samples_is_not_taken_for_noise(before: int) -> None:
    """3 kN at 38 kHz, read every 10 us: 100 N of noise were read as 3 to 4 kN; a displacement has no such part."""
    clock = STEP * np.arange(-before, 300)
    force = 20e3 * np.sin(np.pi * clock / 3e-3) + 3e3 * np.sin(2.0 * np.pi * 38e3 * clock)
    noisy = np.where(clock > 0.0, force, 0.0) + np.random.default_rng(0).normal(0.0, 100.0, len(clock))
    measured = Measured(clock, {"force": noisy}, {}, {"force": "N"})
    found = read(measured, Expected({"force": "N"}, 0.0, 3e-3, 0.0, modelled=False))
    if before:
        assert found.noise.source == "record before contact"
        assert found.noise.level == pytest.approx(100.0, rel=0.2)
    else:
        assert not found.noise.known


def test_a_slower_channel_that_the_logger_repeats_is_read_at_its_own_rate() -> None:
    """Every tenth reading is one; the others were late, and the true ones were left out as outliers."""
    own = shot(before=1e-3)
    values = own.channels[CHANNEL]
    repeated = replace(own, channels={CHANNEL: values[np.arange(len(values)) // 10 * 10]})
    found = read(repeated, NO_NOISE_STATED, zero=False)
    slow = replace(own, time=own.time[::10], channels={CHANNEL: values[::10]})
    wanted = read(slow, NO_NOISE_STATED, zero=False)
    assert found.times.tolist() == wanted.times.tolist()
    assert found.values.tolist() == wanted.values.tolist()
    assert found.noise.level == wanted.noise.level
    assert "360 points at -0.99 .. 2.99 ms are held (a slower channel's reading repeated)" in found.warnings[0]


def test_readings_of_a_slower_channel_that_are_alike_are_all_kept() -> None:
    """100 readings at rest, five times each, came down to one, and the rest before contact was lost."""
    slow = np.concatenate([np.zeros(100), np.round(2000.0 * np.sin(np.arange(300) / 60.0))])
    assert np.flatnonzero(~held(np.repeat(slow, 5))).tolist() == list(range(0, 2000, 5))


def test_a_slow_motion_in_steps_of_a_digitiser_is_not_held() -> None:
    clock = STEP * np.arange(400)
    assert not held(np.round(clock / 5e-5) * 1e-4).any()


def test_a_hum_takes_four_degrees_of_freedom_from_the_level_before_contact() -> None:
    clock = STEP * np.arange(3000)
    wave = 1e-3 * np.sin(2.0 * np.pi * 50.0 * clock)
    noise = np.random.default_rng(0).normal(0.0, SIGMA, len(clock))
    line, hum = (BeforeContact.of(clock[:12], noise[:12], 1.0), BeforeContact.of(clock, wave + noise, 1.0))
    assert (line.hum, line.freedom) == (0.0, 10)
    assert (hum.hum, hum.freedom) == (50.0, 2996)
    stated = Stated(2.0 * SIGMA, None, np.arange(5), np.ones(len(clock), dtype=bool))
    found, (said, *_) = channel_noise(CHANNEL, "m", 1.0, hum, stated)
    assert found.freedom == 2996.0
    assert "over 3000 points" in said


@pytest.mark.parametrize(("rate", "digit"), [(300e3, 1e-7), (300e3, 1e-6), (48e3, 1e-6)])
def test_a_rounded_clock_keeps_the_noise_between_neighbours(rate: float, digit: float) -> None:
    """Steps of 3.3 and 3.4 us were taken for an uneven clock, and no noise was found."""
    clock = np.arange(0.4e-3, 2.6e-3 if rate > 1e5 else 10e-3, 1.0 / rate)
    values = 5e-3 * np.sin(np.pi * clock / 10e-3) + np.random.default_rng(0).normal(0.0, SIGMA, len(clock))
    exact, rounded = (white_scatter(times, values) for times in (clock, digit * np.round(clock / digit)))
    assert exact is not None
    assert rounded is not None
    assert rounded[0] == pytest.approx(exact[0], rel=0.05)


def test_an_uneven_clock_gives_no_noise_between_neighbours() -> None:
    """Instants off by a tenth of a step, and one reading in four missing: neither is rounding."""
    rng = np.random.default_rng(0)
    even = STEP * np.arange(400)
    jittered = even + rng.uniform(-0.1, 0.1, 400) * STEP
    missing = even[np.arange(400) % 4 > 0]
    for clock in (jittered, missing):
        assert white_scatter(clock, rng.normal(0.0, SIGMA, len(clock))) is None
