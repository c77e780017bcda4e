"""Directions, profiles, Sobol indices and the information bound against models whose answers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

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
from tests.inversion.stand_in import CHANNEL, NAMES, TIMES, campaign, record, spread, truth

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


def test_profile_of_a_parameter_that_is_felt_is_bounded_by_the_data(erosion: Calibrator) -> None:
    viscosity, _, compression = profiles(erosion, erosion.fit())
    assert viscosity.sentence == "viscosity: below bounded by the data; above bounded by the data"
    assert compression.sentence == "compression erosion: below not bounded; above not bounded"


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
