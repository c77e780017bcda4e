"""Coverage of the intervals: of a scaled curve, whose posterior is known, and of a model that lacks something."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import binom

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.posterior import Posterior, Sampling, sample
from birdstrike.inversion.identifiability import coverage as module
from birdstrike.inversion.identifiability.coverage import _recorded, coverage, draw_truths
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from tests.inversion.estimation.test_calibration import calibrator
from tests.inversion.stand_in import CHANNEL, NAMES, TIME, TIMES, campaign, pulse, record, spread, truth

NOISE = 1e-4
DENSE = np.linspace(0.4e-3, 2.6e-3, 600)


def linearised(problem: Calibrator, modes, seed: int) -> Posterior:
    """Draws of the first mode's normal distribution, in place of the sampled posterior."""
    mode, rng = modes[0], np.random.default_rng(seed)
    z = rng.multivariate_normal(mode.z, mode.covariance[:-1, :-1], 4000)
    theta, none = problem.coordinates.unlimited(z), np.zeros(len(mode.z))
    return Posterior(z, theta, np.zeros(len(z)), none, none + 1e3, 0.5, 1, mode)


def test_coverage_of_a_scaled_curve_is_that_of_its_normal_posterior(monkeypatch: pytest.MonkeyPatch) -> None:
    """y = a s(t), a from 1 to 2; the other parameters do nothing, and the mean of their posterior is their prior's."""
    monkeypatch.setattr(module, "sample", partial(sample, sampling=Sampling(walkers=24, chunk=200, most=200)))
    base = campaign(spread(40))
    shape = 1e-3 * np.sin(np.pi * base.time / base.time[-1])
    one = replace(base, curves={CHANNEL: (1.0 + spread(40)[:, :1]) * shape})
    slope = np.interp(TIMES, base.time, shape)
    observations = observe(replace(record(truth(0.5)), channels={CHANNEL: 1.5 * slope}), one, {CHANNEL: NOISE})
    emulator = fit_emulator(one, [CHANNEL])
    problem = Calibrator(CurveModel(emulator, observations), parameter_coordinates(one, emulator.regions), 0.0)
    truths, told, others = 30, NAMES[0], NAMES[1:]
    found = coverage(problem, truths, seed=2)
    z = draw_truths(problem, truths, np.random.default_rng(2))
    sd = 1.0 / np.sqrt((slope**2).sum() / NOISE**2 + 12.0)
    assert (found.made_by, found.truths) == ("emulator", truths)
    assert found.identified == {told: 1.0, **dict.fromkeys(others, 0.0)}
    assert found.hits == {told: found.hits_all[told], **dict.fromkeys(others)}
    assert all(truths * share >= binom.ppf(0.001, truths, 0.95) for share in found.hits_all.values())
    assert found.bound[told] == pytest.approx(sd, rel=0.02)
    assert found.error[told] == pytest.approx(sd, rel=0.45)  # 3.5 standard deviations of a root mean square of 30
    expected = np.sqrt(((z[:, 1:] - 0.5) ** 2).mean(axis=0))
    np.testing.assert_allclose([found.error[name] for name in others], expected, rtol=0.1)


def test_records_of_a_coverage_have_noise_correlated_as_the_record_s(dataset: Dataset, emulator: Emulator) -> None:
    """Of 600 points: lag-1 correlation exp(-dt/time) and the stated standard deviation."""
    problem, z = calibrator(dataset, emulator, record(truth(0.5), DENSE), NOISE), np.full(4, 0.5)
    observations, step = problem.model.observations, float(DENSE[1] - DENSE[0])
    channels = tuple(replace(c, correlation_time=2.0 * step) for c in observations.channels)
    problem = replace(problem, model=replace(problem.model, observations=replace(observations, channels=channels)))
    rows = []
    for seed in range(10):
        made = _recorded(problem, z, np.random.default_rng(seed), lambda _: Histories(TIME, CURVE, {CHANNEL: "m"}))
        rows.append(made.model.observations.values - np.interp(DENSE, TIME, CURVE[CHANNEL]))
    noise = np.array(rows)
    assert noise.std() == pytest.approx(NOISE, rel=0.05)
    assert (noise[:, 1:] * noise[:, :-1]).mean() / noise.var() == pytest.approx(np.exp(-0.5), abs=0.04)


CURVE = {CHANNEL: pulse(truth(0.5))}


def test_intervals_that_are_counted_are_widened_as_those_of_an_inversion(
    dataset: Dataset, emulator: Emulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a sine as large as the noise that the model lacks."""
    monkeypatch.setattr(module, "sample", linearised)
    problem = calibrator(dataset, emulator, record(truth(0.5), DENSE), 5e-5)
    sine = 5e-5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 3.0 * (TIME - 0.4e-3) / 2.2e-3)

    def lacking(theta: Mapping[str, float]) -> Histories:
        curve = pulse(np.array([theta[name] for name in NAMES])) + sine
        return Histories(TIME, {CHANNEL: curve}, {CHANNEL: "m"})

    found = coverage(problem, 20, seed=0, forward=lacking)
    assert found.made_by == "solver"
    assert np.mean(list(found.hits_all.values())) >= 0.85
