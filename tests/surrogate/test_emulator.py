"""The forward emulator against the curves that it stands in for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.surrogate.emulator import CurveEmulator, Emulator, ExtrapolationError, fit_emulator, jointly
from birdstrike.surrogate.files import load_emulator, save_emulator
from birdstrike.surrogate.gaussian_process import GaussianProcess, kernel_of
from birdstrike.surrogate.validation import leave_one_out, q2, rmse
from birdstrike.surrogate.weights import emulator_table
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, TIME, TIMES, UNITS, campaign, pulse, spread


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    return campaign(spread())


@pytest.fixture(scope="module")
def emulator(dataset: Dataset) -> Emulator:
    return fit_emulator(dataset, [CHANNEL, "contact_force"])


@pytest.fixture(scope="module")
def unseen() -> np.ndarray:
    return LOWS + np.random.default_rng(7).random((60, 4)) * (HIGHS - LOWS) * 0.9 + 0.05 * (HIGHS - LOWS)


def test_predicts_curves_it_never_saw(emulator: Emulator, unseen: np.ndarray) -> None:
    truth = np.stack([pulse(theta) for theta in unseen])
    mean, sd = emulator.predict(unseen, CHANNEL)
    assert q2(truth, mean) > 0.99
    assert rmse(truth, mean) < 0.01 * np.abs(truth).max()
    moving = TIME > 0.4e-3
    inside = np.abs(truth - mean)[:, moving] <= 1.96 * sd[:, moving]
    assert inside.mean() > 0.9  # its own error bars hold


def test_leave_one_out_figure_is_that_of_unseen_runs(emulator: Emulator, unseen: np.ndarray) -> None:
    for channel in (CHANNEL, "contact_force"):
        assert emulator.channels[channel].validation.q2 > 0.99
    truth = np.stack([pulse(theta) for theta in unseen])
    claimed = emulator.channels[CHANNEL].validation.rmse
    assert 0.3 < claimed / rmse(truth, emulator.predict(unseen, CHANNEL)[0]) < 3.0


def test_leave_one_out_formula_is_refitting_without_each_run() -> None:
    rng = np.random.default_rng(0)
    u = rng.random((14, 2))
    y = np.sin(4.0 * u[:, 0]) + u[:, 1] ** 2 + 0.01 * rng.normal(size=14)
    process = GaussianProcess.fit(u, y - y.mean(), seed=0)
    kernel: Any = process.kernel
    mean = leave_one_out(kernel(u), (y - y.mean()) / process.scale)
    fixed: Any = None  # no optimiser
    for i in range(14):
        rest = np.arange(14) != i
        refit = GaussianProcessRegressor(kernel, optimizer=fixed, alpha=0.0)
        refit.fit(u[rest], (y - y.mean())[rest] / process.scale)
        assert mean[i] == pytest.approx(refit.predict(u[i : i + 1])[0], abs=1e-6)


def test_mean_is_that_of_the_checked_prediction() -> None:
    rng = np.random.default_rng(0)
    process = GaussianProcess.fit(rng.random((20, 3)), rng.normal(size=20), seed=0)
    places = rng.random((9, 3))
    np.testing.assert_allclose(process.mean(places), process.predict(places)[0], rtol=1e-10, atol=1e-12)


def test_a_process_of_ten_times_larger_values_states_a_hundred_times_the_variance() -> None:
    """Of a run's scatter, and of what is not known far from all runs, by the same hyperparameters."""
    rng = np.random.default_rng(0)
    u = rng.random((15, 2))
    y, kernel = 0.3 * np.sin(4.0 * u[:, 0]) + u[:, 1], kernel_of(2, np.log([1.0, 0.5, 0.5, 1e-2]))
    small, large = (GaussianProcess.with_kernel(u, factor * y, kernel) for factor in (1.0, 10.0))
    places = np.array([[0.5, 0.5], [1.5, 0.5], [9.0, 9.0]])
    assert large.nugget == pytest.approx(100.0 * small.nugget)
    assert large.distance_variance(places) == pytest.approx(100.0 * small.distance_variance(places))
    assert small.distance_variance(places)[2] == pytest.approx(np.mean(y**2))  # far away, the prior's


def test_error_covers_what_the_components_do_not_predict() -> None:
    """A component of pure noise stays at its mean and is carried as error, instants moving together."""
    rng, time = np.random.default_rng(0), np.linspace(0.0, 1.0, 50, endpoint=False)
    signal, noise = np.sin(2.0 * np.pi * time), np.cos(2.0 * np.pi * time)
    u = rng.random((60, 1))
    emulator = CurveEmulator.fit(time, u * signal + rng.normal(0.0, 0.1, (60, 1)) * noise, u)
    factor = emulator.error_factor(np.array([0.5]), time)
    sd, strong = np.linalg.norm(factor, axis=1), np.abs(noise) > 0.7
    np.testing.assert_allclose(sd[strong] / np.abs(noise[strong]), 0.1, rtol=0.3)  # 60 draws: 9 % at one sigma
    opposite = factor[0] @ factor[25] / (sd[0] * sd[25])
    assert opposite < -0.9  # instants half a period apart err against each other


def test_noise_is_not_predicted() -> None:
    """One component follows the parameters, the rest is drawn at random for each run."""
    rng, time = np.random.default_rng(0), np.linspace(0.0, 1.0, 60)
    u = rng.random((25, 4))
    signal = u[:, :1] * np.sin(2.0 * np.pi * time)
    emulator = CurveEmulator.fit(time, signal + 0.01 * rng.normal(size=(25, 60)), u)
    assert len(emulator.processes) == 1
    said = (emulator.error_factor(np.full(4, 0.5), time) ** 2).sum(axis=1) + emulator.outside_at(time)
    assert 0.8 < np.sqrt(said.mean()) / 0.01 < 1.4  # 25 draws of the noise, a mean and a component learnt from them


def test_error_of_a_process_is_that_of_its_leave_one_out_predictions_whatever_its_kernel_states() -> None:
    """A smooth kernel all but free of noise is sure of itself near every run; the runs are noise."""
    rng = np.random.default_rng(0)
    u, noise = rng.random((30, 1)), rng.normal(size=30)
    sure = GaussianProcess.with_kernel(u, noise, kernel_of(1, np.log([1.0, 3.0, 1e-2])))
    places = np.linspace(0.0, 1.0, 200)[:, None]
    mean, variance = sure.predict(places)
    regressor: Any = sure.model
    states = regressor.predict(places, return_std=True)[1] * sure.scale
    errors = rng.normal(size=200) - mean
    assert np.mean(errors**2 / states**2) > 10.0
    assert 0.3 < np.mean(errors**2 / variance) < 1.3


def test_error_is_larger_where_the_left_out_runs_were_missed_by_more() -> None:
    rng = np.random.default_rng(1)
    u = np.sort(rng.random((60, 1)), axis=0)
    y = 2.0 * np.sin(6.0 * u[:, 0]) + np.where(u[:, 0] < 0.4, 0.5, 0.01) * rng.normal(size=60)
    variance = GaussianProcess.fit(u, y, 0).variance(np.array([[0.1], [0.9]]))
    assert variance[0] > 20.0 * variance[1]


def test_error_far_from_all_runs_is_finite() -> None:
    rng = np.random.default_rng(1)
    u = rng.uniform(0.0, 1.0, (20, 1))
    fitted = GaussianProcess.fit(u, np.sin(6.0 * u[:, 0]) + 0.05 * rng.standard_normal(20), 0)
    far = replace(fitted.missed, locality=128.0).at(np.array([[0.5], [50.0]]))
    assert np.isfinite(far).all()
    assert far[1] > 0.0


def test_scatter_that_lasts_is_carried_as_lasting() -> None:
    """A slow error common to two channels: their mean errs with it, however many instants are averaged."""
    rng, time = np.random.default_rng(2), np.linspace(0.0, 1.0, 400)
    slow = np.exp(-0.5 * ((time[:, None] - rng.random((1, 12))) / 0.15) ** 2)
    u = rng.random((30, 2))
    own = 0.02 * rng.normal(size=(30, 12)) @ slow.T
    curves = {name: u[:, :1] * np.sin(3.0 * time) + own for name in ("a", "b")}
    alone = {name: CurveEmulator.fit(time, rows, u) for name, rows in curves.items()}
    both = np.vstack([e.error_factor(u[0], time) for e in jointly(alone).values()])
    outside = np.concatenate([e.outside_at(time) for e in jointly(alone).values()])
    average = np.full(800, 1.0 / 800)
    said = np.sqrt(((average @ both) ** 2).sum() + average**2 @ outside)
    fresh = (0.02 * rng.normal(size=(2000, 12)) @ slow.T).mean(axis=1)
    assert 0.6 < said / fresh.std() < 1.6


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_what_no_component_predicts_is_as_large_as_in_the_runs_nearby(factor: float) -> None:
    """Wiggles that are drawn anew with every run, larger by a factor in one half of the range than in the other."""
    rng, time = np.random.default_rng(3), np.linspace(0.0, 1.0, 200)

    def wiggles(u: np.ndarray) -> np.ndarray:
        size = np.where(u[:, 0] > 0.5, 0.01 * factor, 0.01)
        return size[:, None] * rng.normal(size=(len(u), 30)) @ np.sin(np.pi * np.arange(10, 40)[:, None] * time)

    u = rng.random((40, 2))
    emulator = CurveEmulator.fit(time, u[:, :1] * time + wiggles(u), u)
    for side in (0.2, 0.8):
        place = np.array([side, 0.5])
        stated = np.sqrt((emulator.error_factor(place, time) ** 2).sum(axis=1) + emulator.outside_at(time))
        actual = np.sqrt(np.mean(wiggles(np.tile(place, (400, 1))) ** 2))
        assert 0.75 < np.sqrt(np.mean(stated**2)) / actual < 1.8
        least = emulator.scatter_factor(place, time)
        assert (least**2).sum() <= (emulator.error_factor(place, time) ** 2).sum() * (1.0 + 1e-12)


def test_refuses_to_extrapolate(emulator: Emulator) -> None:
    with pytest.raises(ExtrapolationError, match=r"pulse\.peak = 0\.009"):
        emulator.predict(np.array([[9e-3, *(0.5 * (LOWS + HIGHS))[1:]]]), CHANNEL)


def test_rests_before_the_record_and_ends_with_it(emulator: Emulator) -> None:
    middle = 0.5 * (LOWS + HIGHS)[None]
    mean, _ = emulator.predict(middle, CHANNEL, np.array([-1e-3, 0.0, 3.0e-3, 3.1e-3]))
    assert mean[0, 0] == mean[0, 1] == pytest.approx(0.0, abs=1e-9)
    assert np.isfinite(mean[0, 2])
    assert np.isnan(mean[0, 3])


def test_covariance_has_the_standard_deviations_on_its_diagonal(emulator: Emulator) -> None:
    middle = 0.5 * (LOWS + HIGHS)
    covariance = emulator.covariance(middle, CHANNEL, TIMES)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), emulator.predict(middle[None], CHANNEL, TIMES)[1][0])
    assert np.linalg.eigvalsh(covariance).min() > -1e-12 * np.trace(covariance)


def test_only_smooth_runs_are_learnt(dataset: Dataset, emulator: Emulator) -> None:
    curves, smooth = dataset.curves[CHANNEL].copy(), dataset.smooth.copy()
    extra = dataset.parameters[:3] * 1.01
    spoilt = replace(
        dataset,
        runs=np.arange(1, len(smooth) + 4),
        parameters=np.vstack([dataset.parameters, extra]),
        curves={CHANNEL: np.vstack([curves, 100.0 * curves[:3]])},
        smooth=np.append(smooth, [False] * 3),
    )
    middle = 0.5 * (LOWS + HIGHS)[None]
    found = fit_emulator(spoilt, [CHANNEL]).predict(middle, CHANNEL)[0]
    np.testing.assert_array_equal(found, emulator.predict(middle, CHANNEL)[0])


def test_too_few_smooth_runs_are_an_error(dataset: Dataset) -> None:
    smooth = np.zeros(len(dataset.runs), dtype=bool)
    smooth[:4] = True
    with pytest.raises(UserError, match="4 runs of the campaign's 40 are smooth; the emulator needs 5"):
        fit_emulator(replace(dataset, smooth=smooth), [CHANNEL])


def test_channel_that_never_changes_is_emulated_as_it_is(dataset: Dataset) -> None:
    still = replace(dataset, curves={CHANNEL: np.full_like(dataset.curves[CHANNEL], 0.25)})
    mean, sd = fit_emulator(still, [CHANNEL]).predict(0.5 * (LOWS + HIGHS)[None], CHANNEL)
    assert (mean == 0.25).all()
    assert sd.max() < 1e-9


def test_read_back_emulator_predicts_the_same(emulator: Emulator, dataset: Dataset, unseen, tmp_path) -> None:
    save_emulator(tmp_path / "emulator.npz", emulator, dataset)
    again = load_emulator(tmp_path / "emulator.npz")
    for channel in (CHANNEL, "contact_force"):
        for found, expected in zip(again.predict(unseen, channel), emulator.predict(unseen, channel), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)


def test_too_few_runs_on_one_side_of_an_activity_limit_are_an_error(dataset: Dataset) -> None:
    theta = dataset.parameters[:7].copy()
    theta[:, 3] = [0.2, 0.4, 0.6, 0.8, 1.1, 1.15, 1.2]
    few = replace(
        dataset,
        names=(*dataset.names[:3], "bird.material.compression_erosion"),
        runs=dataset.runs[:7],
        parameters=theta,
        curves={name: values[:7] for name, values in dataset.curves.items()},
        smooth=dataset.smooth[:7],
        lows=np.array([*dataset.lows[:3], 0.05]),
        highs=np.array([*dataset.highs[:3], 1.25]),
    )
    said = "7 runs of the campaign's 7 are smooth, 3 of them where enough lie on the same side of 1 in .*compression"
    with pytest.raises(UserError, match=said):
        fit_emulator(few, [CHANNEL])


def test_a_parameter_that_no_run_feels_is_an_error(dataset: Dataset) -> None:
    """Tension erosion below 1 is off."""
    name = ("bird.material.tension_erosion",)
    off = replace(
        dataset,
        names=name,
        units=dataset.units[:1],
        parameters=np.linspace(0.3, 0.9, len(dataset.runs))[:, None],
        lows=np.array([0.3]),
        highs=np.array([0.9]),
        scales=(),
    )
    with pytest.raises(UserError, match=r"none of the 40 smooth runs depends on bird\.material\.tension_erosion"):
        fit_emulator(off, [CHANNEL])


def test_runs_that_repeat_another_make_the_emulator_no_surer() -> None:
    """As the replicates at the centre of a design for measurements: left out, each is predicted by its twin."""
    runs = spread(8)
    once, twice = campaign(runs), campaign(np.vstack([runs, runs]))
    single, repeated = (fit_emulator(dataset, [CHANNEL]) for dataset in (once, twice))
    assert repeated.runs == single.runs == tuple(range(1, 9))
    between = 0.5 * (once.parameters[:1] + once.parameters[1:2])
    np.testing.assert_array_equal(repeated.predict(between, CHANNEL)[1], single.predict(between, CHANNEL)[1])
    with pytest.raises(UserError, match="8 runs of the campaign's 8 are smooth, 4 of them with values of their own"):
        fit_emulator(campaign(np.vstack([runs[:4], runs[:4]])), [CHANNEL])


def test_a_logarithmic_range_is_learnt_in_its_logarithm(tmp_path: Path) -> None:
    """As the same runs are in fractions of the ranges, which have the design's own scale."""
    space = ParameterSpace(NAMES, UNITS, 1e-3 * HIGHS, HIGHS, ("logarithmic", *["linear"] * 3))
    unit = spread(25)
    runs = campaign(unit)
    seen = replace(runs, lows=space.lows, parameters=space.to_physical(unit), scales=space.scales)
    emulator = fit_emulator(seen, [CHANNEL])
    fractions = replace(runs, lows=np.zeros(4), highs=np.ones(4), parameters=unit)
    wanted = fit_emulator(fractions, [CHANNEL])
    again = np.random.default_rng(1).uniform(0.1, 0.9, (20, 4))
    expected = wanted.predict(again, CHANNEL)
    np.testing.assert_allclose(emulator.predict(space.to_physical(again), CHANNEL), expected, rtol=1e-6, atol=1e-9)
    assert emulator_table(emulator)["features"] == ["logarithm", "", "", ""]
    save_emulator(tmp_path / "emulator.npz", emulator, seen)
    loaded = load_emulator(tmp_path / "emulator.npz")
    np.testing.assert_allclose(loaded.predict(space.to_physical(again), CHANNEL), expected, rtol=1e-6, atol=1e-9)
