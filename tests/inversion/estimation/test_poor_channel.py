"""A channel that the emulator predicts poorly carries its own error, and does not take the others' answer away."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.estimation.known_errors import error_columns, left_out
from birdstrike.inversion.estimation.locate import InversionOptions, emulator_warnings, locate
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, TIME, TIMES, campaign, pulse, spread, truth
from tests.inversion.stand_in import record as stand_in_record

STRAIN = "strain_1"
NOISE = {CHANNEL: 3e-5, STRAIN: 2e-5}


def strain(theta: Array) -> Array:
    """A smooth response of the pulse's peak, and a jitter that changes from one point to the next: chaos.

    Points that round to the same 1e-4 of a range share it, or an answer's last digits would draw another run.
    """
    seed = int(abs(hash(tuple(np.round(theta / HIGHS, 4)))) % 2**32)
    slow = np.convolve(np.random.default_rng(seed).normal(size=len(TIME) + 40), np.ones(41) / np.sqrt(41.0), "valid")
    return 0.2 * pulse(theta, TIME) + 2.5e-4 * np.real(slow)


def with_strain(theta: Mapping[str, float]) -> Histories:
    row = np.array([theta[name] for name in NAMES])
    return Histories(TIME, {CHANNEL: pulse(row), STRAIN: strain(row)}, {CHANNEL: "m", STRAIN: ""})


@pytest.fixture(scope="module")
def both() -> tuple[Dataset, Emulator]:
    made = campaign(spread())
    curves = {CHANNEL: made.curves[CHANNEL], STRAIN: np.stack([strain(row) for row in made.parameters])}
    dataset = replace(made, curves=curves, channel_units={CHANNEL: "m", STRAIN: ""})
    return dataset, fit_emulator(dataset, [CHANNEL, STRAIN])


def strain_at(times: Array) -> Array:
    return np.interp(times, TIME, strain(truth(0.5)))


def shot(share: float):
    measured = stand_in_record(truth(share), TIMES, NOISE[CHANNEL], seed=int(100 * share))
    values = np.interp(TIMES, TIME, strain(truth(share))) + NOISE[STRAIN] * np.random.default_rng(1).normal(
        size=len(TIMES)
    )
    return replace(measured, channels={**measured.channels, STRAIN: values}, units={CHANNEL: "m", STRAIN: ""})


def test_its_error_is_that_of_the_runs_left_out(both: tuple[Dataset, Emulator]) -> None:
    """At 200 new points the error columns tell the size of what the emulator misses, within a quarter."""
    dataset, emulator = both
    assert emulator.channels[STRAIN].validation.q2 < 0.9 < emulator.channels[CHANNEL].validation.q2
    observations = observe(shot(0.5), dataset, NOISE)
    columns = error_columns(emulator, dataset, observations)
    assert not columns[: len(TIMES)].any(), "the displacement is predicted well and carries nothing"
    stated = np.sqrt((columns[len(TIMES) :] ** 2).sum(axis=1).mean())
    new = LOWS + np.random.default_rng(5).random((200, 4)) * (HIGHS - LOWS)
    missed = np.stack([strain(row) for row in new]) - emulator.channels[STRAIN].curves(emulator.inputs(new), TIME)
    assert stated == pytest.approx(np.sqrt(np.mean(missed**2)), rel=0.25)


def test_its_error_in_a_dense_record_is_that_at_all_instants(both: tuple[Dataset, Emulator]) -> None:
    """The covariance of the runs left out, tapered, at 900 instants, from those of the runs."""
    dataset, emulator = both
    times = np.linspace(0.4e-3, 2.6e-3, 900)
    measured = stand_in_record(truth(0.5), times, NOISE[CHANNEL])
    dense = replace(measured, channels={STRAIN: strain_at(times)}, units={STRAIN: ""})
    found = error_columns(emulator, dataset, observe(dense, dataset, NOISE))
    one = emulator.channels[STRAIN]
    residual = dataset.curves[STRAIN] - left_out(one, dataset.curves[STRAIN])
    rows = np.stack([np.interp(times, TIME, row) for row in residual])
    apart = (times[:, None] - times) / (0.2 * np.ptp(TIME))
    exact = rows.T @ rows / len(rows) * np.exp(-0.5 * apart**2)
    assert np.abs(found @ found.T - exact).max() < 1e-3 * exact.max()


def test_the_other_channels_answer_stands_and_holds_the_truth(both: tuple[Dataset, Emulator]) -> None:
    dataset, emulator = both
    options = InversionOptions(method="emulator", sampling=None, analyse=False, noise=NOISE)
    for share in (0.3, 0.5, 0.7):
        found = invert(dataset, shot(share), with_strain, options, emulator=emulator).inversion
        peak = found.methods["emulator"].parameters["pulse.peak"]
        assert peak.identified, found.warnings
        assert peak.interval_95 is not None
        assert peak.interval_95[0] < truth(share)[0] < peak.interval_95[1]
        assert any("the channel carries the error of these predictions" in text for text in found.warnings)


def test_a_networks_poor_answer_is_not_the_emulators(both: tuple[Dataset, Emulator]) -> None:
    """Two neurons answer badly; the solver at the emulator's answer shows that the model can produce the record."""
    dataset, emulator = both
    options = InversionOptions(method="network", sampling=None, analyse=False, noise=NOISE, hidden=2, copies=0)
    alone, beside = (
        invert(dataset, shot(0.3), with_strain, replace(options, method=method), emulator=emulator).inversion
        for method in ("network", "both")
    )
    assert alone.methods == {"network": beside.methods["network"]}
    assert alone.prior_predictive == beside.prior_predictive
    assert not any("too coarse" in text for text in alone.warnings)


def test_its_error_goes_with_the_records_clock(both: tuple[Dataset, Emulator]) -> None:
    """The same record on a clock 0.1 ms late: the same errors at its points, and so a fit takes them."""
    dataset, emulator = both
    record, late = shot(0.5), 0.1e-3
    used = TIMES < 2.4e-3  # on both clocks inside what an uncertain one leaves of the simulation
    channels = {name: values[used] for name, values in record.channels.items()}
    here, there = (replace(record, time=TIMES[used] + t0, channels=channels) for t0 in (0.0, late))
    options = InversionOptions(method="emulator", noise=NOISE, time_offset=late, sampling=None, analyse=False)

    def errors(measured: Measured, t0: float) -> Array:
        """Standard deviations at the points."""
        return np.sqrt((error_columns(emulator, dataset, observe(measured, dataset, NOISE, late), t0) ** 2).sum(axis=1))

    truth_of = errors(here, 0.0)
    np.testing.assert_allclose(errors(there, late), truth_of, rtol=1e-9)
    fitted = locate(dataset, there, options, emulator).calibration.calibrator.model.known
    assert fitted is not None
    taken = np.sqrt((fitted**2).sum(axis=1))
    assert np.abs(taken - truth_of).max() < 0.25 * np.abs(errors(there, 0.0) - truth_of).max()


def test_a_decade_without_runs_is_told_of_a_logarithmic_range(both: tuple[Dataset, Emulator]) -> None:
    """The lowest of four decades is a thousandth of the range, of which 1 % is worth saying."""
    dataset, emulator = both
    lowest, tenfold = (np.append(share * HIGHS[0], LOWS[1:]) for share in (1e-4, 1e-3))
    seen = replace(dataset, lows=lowest, scales=("logarithmic", *["linear"] * 3))
    box = replace(emulator.regions[0], lows=tenfold, highs=HIGHS)
    first, _ = emulator_warnings(replace(emulator, regions=(box,)), seen)
    assert first == "peak 0.0007 .. 0.007 mm: too few smooth runs stand there, so no answer is sought there"


def test_several_channels_that_are_predicted_poorly_are_one_warning(both: tuple[Dataset, Emulator]) -> None:
    """Seven warnings that differed by the channel's name stood above the report's first table."""
    dataset, emulator = both
    (alone,) = emulator_warnings(emulator, dataset)
    assert alone.startswith("the emulator predicts left-out runs of strain 1 (Q2 ")
    assert " poorly: the channel carries the error of these predictions" in alone
    twice = replace(emulator, channels={**emulator.channels, "strain_2": emulator.channels[STRAIN]})
    (together,) = emulator_warnings(twice, dataset)
    assert " and strain 2 (Q2 " in together
    assert (
        " poorly: each carries the error of these predictions and counts for less; add runs, or leave them" in together
    )
