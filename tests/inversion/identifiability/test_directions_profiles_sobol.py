"""Directions, profiles, Sobol indices and the information bound against models whose answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.data.dataset import Dataset
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.identifiability.directions import directions
from birdstrike.inversion.identifiability.information import bound
from birdstrike.inversion.identifiability.profile import profiles
from birdstrike.inversion.identifiability.sobol import sobol_indices
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from tests.inversion import eroding
from tests.inversion.stand_in import CHANNEL, NAMES, TIME, TIMES, campaign, record, spread, truth

NOISE = 2e-5


def calibrator(dataset: Dataset, emulator: Emulator, values: np.ndarray, times: np.ndarray = TIMES) -> Calibrator:
    measured = replace(record(truth(0.5), times), channels={CHANNEL: values})
    observations = observe(measured, dataset, {CHANNEL: NOISE})
    return Calibrator(CurveModel(emulator, observations), parameter_coordinates(dataset, emulator.regions), 0.0)


@pytest.fixture(scope="module")
def erosion() -> Calibrator:
    """Viscosity acts, tension erosion is off, compression erosion does nothing."""
    runs = eroding.campaign()
    values = np.interp(TIMES, eroding.TIME, eroding.curve(np.array([600.0, 0.4, 0.5])))
    return calibrator(runs, fit_emulator(runs, [CHANNEL]), values)


@pytest.fixture(scope="module")
def product() -> Dataset:
    """Curves that depend on the product of the first two parameters alone, each from 1 to 2."""
    base = campaign(spread(40))
    time, (a, b) = base.time, 1.0 + spread(40).T[:2]
    curve = 1e-3 * np.sin(np.pi * time / time[-1])
    parameters = base.parameters.copy()
    parameters[:, 0], parameters[:, 1] = a, b
    lows, highs = base.lows.copy(), base.highs.copy()
    lows[:2], highs[:2] = 1.0, 2.0
    return replace(
        base, parameters=parameters, lows=lows, highs=highs, curves={CHANNEL: (a * b)[:, None] * curve[None]}
    )


def test_null_directions_are_the_parameters_that_do_nothing(erosion: Calibrator) -> None:
    found = directions(erosion, erosion.fit()[0])
    assert found[0].words == "viscosity"
    assert found[0].strength > 10.0
    assert {d.words for d in found if d.null} == {"tension erosion", "compression erosion"}


def test_a_product_is_told_and_its_factors_are_not(product: Dataset) -> None:
    curve = 1e-3 * np.sin(np.pi * TIMES / product.time[-1])
    problem = calibrator(product, fit_emulator(product, [CHANNEL]), 2.25 * curve)
    found = directions(problem, problem.fit()[0])
    told, null = found[0], found[-1]
    assert "with more" in told.words
    assert abs(told.parts[NAMES[0]]) == pytest.approx(abs(told.parts[NAMES[1]]), abs=0.2)
    assert null.null
    assert sum(d.null for d in found) == 3


def test_profile_rises_by_the_data_or_because_another_parameter_is_at_its_end(product: Dataset) -> None:
    """With a b = 3.6 a can fall to 1.8 only: there b reaches 2."""
    curve = 1e-3 * np.sin(np.pi * TIMES / product.time[-1])
    problem = calibrator(product, fit_emulator(product, [CHANNEL]), 3.6 * curve)
    first = profiles(problem, problem.fit())[0]
    assert "below bounded because period reaches the end of its range" in first.sentence
    assert "above not bounded" in first.sentence


def test_profile_of_a_parameter_that_is_felt_is_bounded_and_that_of_one_that_is_not_rises_by_its_prior_alone(
    erosion: Calibrator,
) -> None:
    """The prior is normal about the middle, range/sqrt(12) wide: minus twice its logarithm is 12 (z - 1/2)^2."""
    viscosity, tension, compression = profiles(erosion, erosion.fit())
    assert viscosity.rise[[0, -1]].min() > 1000.0
    assert viscosity.rise.min() == 0.0
    assert compression.sentence == "compression erosion: below not bounded; above not bounded"
    z = (compression.values - 0.05) / 1.2
    expected = 12.0 * (z - 0.5) ** 2
    np.testing.assert_allclose(compression.rise, expected - expected.min(), atol=0.05)
    assert tension.sentence == "tension erosion: below not bounded; above bounded by the data"


def test_profile_is_the_least_cost_of_all_boxes_also_where_a_fit_s_own_holds_the_value(erosion: Calibrator) -> None:
    """By a scan of both limits: with a wrong viscosity an active tension erosion fits better than none.

    The emulator's error is that at the best fit of a box, or at the point of it that is nearest to the best of all.
    """
    modes = erosion.fit()
    profile, values, costs = profiles(erosion, modes)[0], erosion.model.observations.values, []
    shares = (profile.values - erosion.coordinates.base[0]) / erosion.coordinates.basis[0, 0]
    for box in erosion.coordinates.boxes:
        z = next((mode.z for mode in modes if mode.box is box), np.clip(modes[0].z, box.lows, box.highs))
        factor = erosion.model.error_factor(erosion.coordinates.theta(z, box), 0.0)
        covariance = np.diag(erosion.model.noise_at(0.0) ** 2) + factor @ factor.T
        ends = [np.linspace(low, high, 40) for low, high in zip(box.lows[1:], box.highs[1:], strict=True)]
        limits = [part.ravel() for part in np.meshgrid(*ends)]
        for share in shares:
            places = np.stack([np.full(1600, share), *limits], axis=1)
            left = values - erosion.model.curves(erosion.model.scores(erosion.coordinates.theta(places, box)), 0.0)
            squares = (left * np.linalg.solve(covariance, left.T).T).sum(axis=1)
            prior = (erosion.coordinates.prior.deviations(places) ** 2).sum(axis=1)
            costs.append((squares + prior).min() + np.linalg.slogdet(covariance)[1])
    least = np.reshape(costs, (-1, len(shares))).min(axis=0)
    np.testing.assert_allclose(profile.rise, least - least.min(), rtol=0.02, atol=0.5)


def test_strength_is_the_prior_s_standard_deviation_in_those_of_the_data(product: Dataset) -> None:
    """y = a s(t): the data alone know a to noise/|s|; its prior has 1/sqrt(12) of its range, 1, or what is stated."""
    one = replace(
        product,
        curves={CHANNEL: product.parameters[:, :1] * 1e-3 * np.sin(np.pi * product.time / product.time[-1])[None]},
    )
    slope = 1e-3 * np.sin(np.pi * TIMES / product.time[-1])
    problem = calibrator(one, fit_emulator(one, [CHANNEL]), 1.5 * slope)
    for sd in (1.0 / np.sqrt(12.0), 0.01):
        prior = replace(problem.coordinates.prior, sd=np.full(4, sd))
        told = replace(problem, coordinates=replace(problem.coordinates, prior=prior))
        found = directions(told, told.fit()[0])
        assert found[0].strength == pytest.approx(sd * np.linalg.norm(slope) / NOISE, rel=0.02)
        assert abs(found[0].parts[NAMES[0]]) == pytest.approx(1.0, abs=1e-3)
        assert all(one.strength < 0.05 for one in found[1:])


def test_sobol_indices_follow_the_pulse(emulator: Emulator) -> None:
    """The bump at 2.2 ms is added by the rebound alone, so that both its indices are its own share of the variance."""
    found = sobol_indices(emulator, CHANNEL, instants=13, base=128)
    early = int(np.argmin(np.abs(found.times - 0.75e-3)))
    assert found.total[3, early] < 0.02
    assert found.total[0, early] > 0.5
    bump = int(np.argmin(np.abs(found.times - 2.25e-3)))
    shape = np.exp(-(((found.times[bump] - 2.2e-3) / 0.3e-3) ** 2))
    share = (0.8e-3 * shape) ** 2 / 12.0 / found.sd[bump] ** 2
    assert found.total[3, bump] == pytest.approx(share, rel=0.2)
    assert found.first[3, bump] == pytest.approx(share, abs=0.05)
    assert np.isnan(found.total[:, 0]).all()  # nothing has moved yet


def test_a_logarithmic_range_is_spread_by_its_logarithm_in_sobol_indices() -> None:
    """Curves of log10 a + 3 b with a over three decades: half of the variance is a's; linearly it was a fifth."""
    u = qmc.LatinHypercube(2, rng=0).random(30)
    scale = np.sin(np.pi * TIME / TIME[-1])
    runs = Dataset(
        names=("bird.a", "bird.b"),
        units=("Pa", ""),
        lows=np.array([1.0, 0.0]),
        highs=np.array([1000.0, 1.0]),
        runs=np.arange(1, 31),
        parameters=np.column_stack([1000.0 ** u[:, 0], u[:, 1]]),
        time=TIME,
        curves={CHANNEL: 3e-3 * u.sum(axis=1)[:, None] * scale},
        channel_units={CHANNEL: "m"},
        smooth=np.ones(30, dtype=bool),
        case_hash="decades",
        scales=("logarithmic", "linear"),
    )
    found = sobol_indices(fit_emulator(runs, [CHANNEL]), CHANNEL, instants=3, base=64)
    assert found.first[:, 1] == pytest.approx([0.5, 0.5], abs=0.1)


def test_information_bound_of_a_scaled_curve_is_the_textbooks(product: Dataset) -> None:
    """y = c a b s(t): d y / d a at b = 1.5, alone with its prior when b has none of it."""
    one = replace(
        product,
        curves={CHANNEL: product.parameters[:, :1] * 1e-3 * np.sin(np.pi * product.time / product.time[-1])[None]},
    )
    slope = 1e-3 * np.sin(np.pi * TIMES / product.time[-1])
    problem = calibrator(one, fit_emulator(one, [CHANNEL]), 1.5 * slope)
    expected = 1.0 / np.sqrt((slope**2).sum() / NOISE**2 + 12.0)  # the range is 1 wide, its prior 1/sqrt(12)
    found = bound(problem, np.full((3, 4), 0.5))
    assert found[0] == pytest.approx(expected, rel=0.02)
    np.testing.assert_allclose(found[1:], 1.0 / np.sqrt(12.0), rtol=0.02)
    error = 0.1 * slope  # as large as one of 0.1 in a
    carried = bound(problem.with_known(error[:, None]), np.full((3, 4), 0.5), emulator_error=True)
    assert carried[0] == pytest.approx(1.0 / np.sqrt(1.0 / (NOISE**2 / (slope**2).sum() + 0.1**2) + 12.0), rel=0.02)
    assert bound(problem.with_known(error[:, None]), np.full((3, 4), 0.5))[0] == pytest.approx(expected, rel=0.02)
