"""A record that one number would mend is named with that number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.observations import observe
from birdstrike.inversion.observations.plausibility import implausible
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, forward, pulse, record, truth

CLOCK = np.arange(0.0, 3e-3, 1e-5)
SIGMA = 3e-5


def shot(factor: float = 1.0, late: float = 0.0) -> Measured:
    measured = record(truth(0.45), CLOCK, SIGMA, late)
    return replace(measured, channels={CHANNEL: factor * measured.channels[CHANNEL]})


def said(measured: Measured, dataset: Dataset, time_offset: float = 0.0) -> tuple[str, ...]:
    return implausible(dataset, observe(measured, dataset, {CHANNEL: SIGMA}, time_offset), time_offset)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (-1.0, "has the opposite sign of every run of the campaign (correlation -1.00)"),
        (1e3, "near a thousand: mm for m"),
        (1e-3, "times smaller than their middle (near a thousand"),
        (1.0 / 25.4, "near 25.4: inches for mm"),
    ],
)
def test_a_wrong_sign_or_unit_is_named_with_its_remedy(dataset: Dataset, factor: float, words: str) -> None:
    (text,) = said(shot(factor), dataset)
    assert words in text
    assert "import it again with" in text


def test_the_likely_cause_stands_before_what_follows_from_it(dataset: Dataset, emulator: Emulator) -> None:
    options = InversionOptions(method="emulator", noise={CHANNEL: SIGMA}, sampling=None)
    first, second, *_ = invert(dataset, shot(-1.0), forward, options, emulator=emulator).inversion.warnings
    assert "opposite sign" in first
    assert "the model cannot produce this curve" in second


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_wrong_unit_is_named_before_an_emulator_that_predicts_poorly(dataset: Dataset, factor: float) -> None:
    """Runs of scatter: their emulator is poor, and "too coarse" with "add runs" was the first warning."""
    rng = np.random.default_rng(1)
    scattered = {CHANNEL: dataset.curves[CHANNEL] * rng.uniform(0.5, 1.5, (len(dataset.runs), 1))}
    poor = replace(dataset, curves=scattered, channel_units={CHANNEL: "m"})
    options = InversionOptions(method="emulator", noise={CHANNEL: factor * SIGMA}, sampling=None, analyse=False)
    found = invert(poor, shot(factor), forward, options).inversion
    assert "near a thousand" in found.warnings[0]
    assert "the model cannot produce this curve" in found.warnings[1]
    assert not any("too coarse for this curve" in text for text in found.warnings)
    for estimate in found.methods["emulator"].parameters.values():
        assert not estimate.identified
        assert "the model cannot produce the record" in estimate.reason
    right = invert(poor, shot(1.0), forward, replace(options, noise={CHANNEL: SIGMA})).inversion
    assert not any("another size" in text for text in right.warnings)


def test_a_size_of_no_run_is_named_whatever_the_shape(dataset: Dataset) -> None:
    rng = np.random.default_rng(2)
    other = replace(shot(), channels={CHANNEL: np.cumsum(rng.normal(size=len(CLOCK)))})
    (text,) = said(other, dataset)
    assert "has a size that no run comes near" in text
    assert "times larger than their middle" in text
    assert "correct the case" in text


def test_a_sensor_that_shows_no_response_is_named(dataset: Dataset) -> None:
    rng = np.random.default_rng(0)
    dead = replace(shot(), channels={CHANNEL: SIGMA * rng.normal(size=len(CLOCK))})
    (text,) = said(dead, dataset)
    assert "shows no response" in text
    assert "--channels" in text


@pytest.mark.parametrize("late", [0.4e-3, -0.25e-3])
def test_a_late_or_early_trigger_is_named_with_the_shift_that_mends_it(dataset: Dataset, late: float) -> None:
    measured = replace(shot(), channels={CHANNEL: pulse(truth(0.45), CLOCK - late)})
    (text,) = said(measured, dataset)
    shift = float(text.split('--shift "')[1].split(" ms")[0])
    assert shift == pytest.approx(-1e3 * late, abs=0.06)
    assert "inversion.nuisance.time_offset" in text
    assert not said(measured, dataset, time_offset=0.2e-3), "the case allows it: the fit finds it"


def test_a_record_that_has_lost_its_peak_is_not_taken_for_one_in_another_unit(dataset: Dataset) -> None:
    """Clipped at a tenth of the peak, or broken off before a tenth of it: beside the runs' own peaks it is small."""
    whole = shot().channels[CHANNEL]
    early = CLOCK < 0.38e-3
    for values in (np.minimum(whole, 0.1 * whole.max()), np.where(early, whole, np.nan)):
        assert not any("another size" in text for text in said(replace(shot(), channels={CHANNEL: values}), dataset))
    small = replace(shot(1e-3), channels={CHANNEL: np.where(CLOCK < 0.9e-3, 1e-3 * whole, np.nan)})
    assert "near a thousand" in said(small, dataset)[0]


def test_the_factor_of_a_record_that_ends_early_is_that_of_the_runs_until_there(dataset: Dataset) -> None:
    """A thousandth, until 0.6 ms, where the runs have reached two thirds of their peaks."""
    values = np.where(CLOCK < 0.6e-3, 1e-3 * pulse(truth(0.5), CLOCK), np.nan)
    (text,) = said(replace(shot(), channels={CHANNEL: values}), dataset)
    factor = float(text.split(" times smaller")[0].rsplit(", ", 1)[1])
    assert factor == pytest.approx(1000.0, rel=0.1)


def test_a_good_record_raises_no_word(dataset: Dataset) -> None:
    for share in (0.1, 0.45, 0.9):
        assert not said(record(truth(share), CLOCK, SIGMA), dataset)


def test_a_turned_record_is_named_by_the_inversion_which_identifies_nothing(
    dataset: Dataset, emulator: Emulator
) -> None:
    options = InversionOptions(method="emulator", sampling=None, analyse=False, noise={CHANNEL: SIGMA})
    found = invert(dataset, shot(-1.0), forward, options, emulator=emulator).inversion
    assert any(f"--scale {CHANNEL}=-1" in text for text in found.warnings)
    assert not any(one.identified for one in found.methods["emulator"].parameters.values())


def test_channels_that_were_exchanged_are_named(dataset: Dataset) -> None:
    """A second laser, which moves by 0.6 of the first, under the other's name."""
    second = replace(
        dataset,
        curves={CHANNEL: dataset.curves[CHANNEL], "second": 0.6 * dataset.curves[CHANNEL]},
        channel_units=dict.fromkeys((CHANNEL, "second"), "m"),
    )
    first = shot().channels[CHANNEL]
    stated = dict.fromkeys(second.curves, SIGMA)
    for own, words in (({CHANNEL: first, "second": 0.6 * first}, 0), ({CHANNEL: 0.6 * first, "second": first}, 1)):
        measured = Measured(CLOCK, own, {}, dict.fromkeys(own, "m"), path="shot.csv")
        found = implausible(second, observe(measured, second, stated), 0.0)
        assert sum("change places" in text for text in found) == words


def begun_at_contact(dataset: Dataset, factor: float) -> tuple[Measured, Dataset]:
    """Contact at t = 0: no part of the record, whose clock is off by a factor, is known to lie before it."""
    begun = replace(dataset, time=dataset.time[:-31], curves={name: y[:, 31:] for name, y in dataset.curves.items()})
    return replace(shot(), time=factor * (CLOCK - 0.31e-3)), begun


def test_a_clock_in_too_large_a_unit_is_named(dataset: Dataset) -> None:
    (text,) = said(*begun_at_contact(dataset, 1e2))
    assert "is its clock in another unit" in text
    assert "and ends at 268 ms" in text


@pytest.mark.parametrize(("factor", "first", "last"), [(1e-3, "0.00268 ms", "0.00268 ms"), (1e3, "0 ms", "2.68 s")])
def test_a_clock_in_another_unit_that_leaves_hardly_a_point_is_refused(
    dataset: Dataset, factor: float, first: str, last: str
) -> None:
    with pytest.raises(
        MeasuredError, match=f"in the first {first} alone of .*to {last}: is it in another unit .*-unit"
    ):
        said(*begun_at_contact(dataset, factor))


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_clock_in_another_unit_that_leaves_only_rest_is_refused(dataset: Dataset, factor: float) -> None:
    with pytest.raises(MeasuredError, match=r"shows no impact: until 0.29 ms .*another unit.*--time-unit"):
        said(replace(shot(), time=factor * CLOCK), dataset)


@pytest.mark.parametrize("moving", [0, 15])
def test_a_record_beside_runs_that_mostly_stay_at_rest_is_told_and_no_error(dataset: Dataset, moving: int) -> None:
    """Their middle is 0, by which the record's peak was divided."""
    some = np.where(np.arange(len(dataset.runs)) < moving, 1.0, 0.0)[:, None]
    resting = replace(dataset, curves={name: some * y for name, y in dataset.curves.items()})
    (text,) = said(shot(50.0), resting)
    assert "and most of them not at all" in text
