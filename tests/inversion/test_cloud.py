"""A curve that the model cannot produce is flagged, not refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from data.curves import Measured
from data.dataset import Dataset
from inversion.cloud import Cloud, warning, whose_fault
from inversion.invert import Options, invert
from inversion.observations import observe
from surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, TIMES, forward, pulse, record, truth

OPTIONS = Options(sampling=None, analyse=False, noise={CHANNEL: 3e-5})


def foreign(measured: Measured) -> Measured:
    """The record with a kink that no parameter makes: 0.3 mm at its middle."""
    bump = 0.3e-3 * np.exp(-(((TIMES - 1.4e-3) / 0.1e-3) ** 2))
    return replace(measured, channels={CHANNEL: measured.channels[CHANNEL] + bump})


def test_foreign_curve_is_flagged_and_the_loop_goes_on(dataset: Dataset, emulator: Emulator) -> None:
    found = invert(dataset, foreign(record(truth(0.5))), forward, OPTIONS, emulator=emulator).inversion
    assert not found.cloud.inside
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
    found = invert(dataset, measured, forward, replace(OPTIONS, method="emulator"), emulator=emulator).inversion.cloud
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
    assert found.cloud.nearest_run == 17
    assert found.cloud.nearest_distance[CHANNEL] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("seed", range(5))
def test_curve_of_the_model_is_inside(dataset: Dataset, emulator: Emulator, seed: int) -> None:
    theta = truth(np.random.default_rng(seed).random(4))
    options = replace(OPTIONS, method="emulator")
    found = invert(dataset, record(theta, noise=3e-5, seed=seed), forward, options, emulator=emulator).inversion
    assert found.cloud.inside
    assert 0.3 < found.cloud.fit < 1.5
    assert found.cloud.outside_envelope == 0.0
    assert not any("cannot produce" in warning for warning in found.warnings)


def test_curve_far_from_all_runs_lies_outside_the_envelope(dataset: Dataset, emulator: Emulator) -> None:
    far = record(truth(0.5))
    far = replace(far, channels={CHANNEL: 2.5 * far.channels[CHANNEL]})
    found = invert(dataset, far, forward, replace(OPTIONS, method="emulator"), emulator=emulator).inversion.cloud
    assert not found.inside
    assert found.outside_envelope > 0.5


def test_coarse_emulator_is_not_a_model_that_cannot(dataset: Dataset) -> None:
    """The solver's own curve between runs, noise a tenth of what the emulator can follow: a run beside it tells."""
    theta = truth((0.4, 0.6, 0.45, 0.5))
    found = Cloud(False, 4.0, 0.0, 3, {CHANNEL: 1e-4})
    q2: dict[str, float | None] = {CHANNEL: 0.99}
    observations = observe(record(theta), dataset, {CHANNEL: 1e-5})
    assert whose_fault(found, 7.0, q2) == found
    assert "the model can produce it" in warning(whose_fault(found, 1.1, q2), observations)
    poor = whose_fault(found, 7.0, {CHANNEL: 0.5})
    assert "displacement centre (Q2 0.50)" in warning(poor, observations)
    assert "cannot produce" not in warning(poor, observations)
    inside = replace(found, inside=True)
    assert whose_fault(inside, 9.0, {CHANNEL: 0.1}) == inside
