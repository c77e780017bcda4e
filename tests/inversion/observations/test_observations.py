"""What is used of a measured file, and with which noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError
from birdstrike.data.formatting import plain
from birdstrike.inversion.observations.observations import observe
from tests.inversion.stand_in import CHANNEL, TIMES, record, truth

MIDDLE = truth(0.5)


def test_gaps_are_left_out_and_the_rest_is_untouched(dataset: Dataset) -> None:
    measured = record(MIDDLE)
    values = measured.channels[CHANNEL].copy()
    values[[2, 7]] = np.nan
    channel = observe(replace(measured, channels={CHANNEL: values}), dataset, {CHANNEL: 1e-5}).channels[0]
    np.testing.assert_array_equal(channel.times, np.delete(TIMES, [2, 7]))
    np.testing.assert_array_equal(channel.values, np.delete(measured.channels[CHANNEL], [2, 7]))


def test_points_outside_the_record_are_left_out_aloud(dataset: Dataset) -> None:
    times = np.array([-0.2e-3, -0.1e-3, 0.0, 1.0e-3, 3.0e-3, 3.1e-3])
    found = observe(record(MIDDLE, times), dataset, {CHANNEL: 1e-5})
    np.testing.assert_array_equal(found.channels[0].times, times[2:5])
    assert found.warnings == (
        f"{plain(CHANNEL)}: 2 points before and 1 after the simulated record 0 .. 3 ms are left out of the fit",
    )


def test_an_uncertain_clock_leaves_the_simulation_room_on_both_sides(dataset: Dataset) -> None:
    """Every point that is used keeps a simulated value when the record's clock is four sigmas early."""
    times = np.linspace(0.2e-3, 3.0e-3, 57)
    found = observe(record(MIDDLE, times), dataset, {CHANNEL: 1e-5}, time_offset=0.05e-3)
    assert found.last == pytest.approx(2.8e-3)
    assert found.warnings[0].startswith(
        f"{plain(CHANNEL)}: 0 points before and 4 after the simulated record 0 .. 2.8 ms (less its last 0.2 ms"
    )
    wide = observe(record(MIDDLE, times), dataset, {CHANNEL: 1e-5}, time_offset=1e-3)
    assert wide.last == pytest.approx(2.25e-3), "never more than a quarter of what was simulated"


def test_a_record_that_ends_before_anything_moves_is_refused(dataset: Dataset) -> None:
    times = np.linspace(0.0, 0.2e-3, 40)
    with pytest.raises(MeasuredError, match=r"shows no impact: until .* nothing moves .* from 0 ms to 0.2 ms.*--shift"):
        observe(record(MIDDLE, times), dataset, {CHANNEL: 1e-5})


def test_record_on_another_clock_is_refused(dataset: Dataset) -> None:
    with pytest.raises(MeasuredError, match=r"0 points in the simulated record 0 \.\. 3 ms"):
        observe(record(MIDDLE, TIMES + 1.0), dataset, {})


def test_the_shift_that_a_clock_of_dates_is_given_makes_its_first_row_zero(dataset: Dataset) -> None:
    """To ten digits it left 437 ms of a clock in seconds since 1970, whose span was "1700000000 s to 1700000000 s"."""
    dated = replace(record(MIDDLE, TIMES), time=TIMES + 1700000000.437)
    with pytest.raises(MeasuredError, match=r"to 1700000000 s, 2\.2 ms: .*--shift") as caught:
        observe(dated, dataset, {})
    whole, fraction = str(caught.value).split('--shift "-')[1].split(" s")[0].split(".")
    assert whole == "1700000000"
    assert float(f"0.{fraction}") == pytest.approx(0.437 + TIMES[0], abs=1e-6)


def test_unknown_channel_names_the_sensors_that_exist(dataset: Dataset) -> None:
    measured = record(MIDDLE)
    other = replace(measured, channels={"strain_1": measured.channels[CHANNEL]}, units={"strain_1": ""})
    with pytest.raises(MeasuredError, match=r'"strain_1".*sensors: displacement_centre, contact_force'):
        observe(other, dataset, {})


def test_other_unit_is_refused(dataset: Dataset) -> None:
    with pytest.raises(MeasuredError, match="has unit N, the sensor m"):
        observe(replace(record(MIDDLE), units={CHANNEL: "N"}), dataset, {})


def test_noise_comes_from_the_best_source_there_is(dataset: Dataset) -> None:
    measured = record(MIDDLE)
    sigma = np.linspace(1e-5, 2e-5, len(TIMES))
    with_column = replace(measured, sigma={CHANNEL: sigma})
    np.testing.assert_array_equal(observe(with_column, dataset, {CHANNEL: 9e-5}).noise, sigma)
    from_case = observe(measured, dataset, {CHANNEL: 9e-5})
    assert (from_case.noise == 9e-5).all()
    assert from_case.channels[0].noise_source == "case"


def test_record_before_contact_tells_the_noise(dataset: Dataset) -> None:
    times = np.concatenate([np.linspace(-1e-3, -1e-5, 400), TIMES])
    channel = observe(record(MIDDLE, times, noise=4e-5), dataset, {}).channels[0]
    assert channel.noise_source == "record before contact"
    assert channel.noise[0] == pytest.approx(4e-5, rel=0.12)  # 400 draws: 3.5 % at one sigma


def test_one_per_cent_of_the_peak_is_assumed_aloud(dataset: Dataset) -> None:
    found = observe(record(MIDDLE), dataset, {})
    assert found.noise == pytest.approx(0.01 * found.channels[0].peak)
    assert "no noise is stated" in found.warnings[0]
    assert "1 % of the peak" in found.warnings[0]


def test_stacked_values_come_apart_again(dataset: Dataset) -> None:
    measured = record(MIDDLE)
    two = replace(
        measured,
        channels={CHANNEL: measured.channels[CHANNEL], "contact_force": np.arange(len(TIMES), dtype=float)},
        units={CHANNEL: "m", "contact_force": "N"},
    )
    found = observe(two, dataset, {})
    parts = found.split(found.values)
    np.testing.assert_array_equal(parts["contact_force"], np.arange(len(TIMES)))
    np.testing.assert_array_equal(parts[CHANNEL], measured.channels[CHANNEL])
