"""What every model carries besides its parameters: intervals that hold the truth because of it."""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.inversion.diagnosis.preparation.discrepancy import started
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import (
    NuisanceRuns,
    discrepancy_columns,
    mesh_columns,
    stacked,
    stated_discrepancy,
)
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.refinement import refine
from birdstrike.inversion.estimation.whitening import factor_between
from birdstrike.inversion.invert import invert
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.solver.case.case import load_case
from birdstrike.solver.case.nuisances import Nuisance, case_nuisances
from birdstrike.surrogate.emulator import Emulator
from tests.inversion.stand_in import CHANNEL, NAMES, START, TIME, campaign, forward, record, spread, truth

SPEED = Nuisance("speed", "impact.speed", 90.0, 0.9)


def faster(theta: Mapping[str, float]) -> Histories:
    """The pulse, in proportion to the speed."""
    run = forward(theta)
    size = theta.get("impact.speed", 90.0) / 90.0
    return replace(run, channels={name: size * values for name, values in run.channels.items()})


def columns(observations: Observations, mode: Mode) -> np.ndarray:
    theta: dict[str, float] = dict(zip(NAMES, map(float, mode.theta), strict=True))
    return NuisanceRuns(faster, [SPEED]).columns(observations, theta, mode.t0)


def test_column_is_the_change_for_one_sigma(dataset: Dataset) -> None:
    observations = observe(record(truth(0.5)), dataset, {CHANNEL: 1e-5})
    theta: dict[str, float] = dict(zip(NAMES, map(float, truth(0.5)), strict=True))
    found = NuisanceRuns(faster, [SPEED]).columns(observations, theta, 0.0)
    np.testing.assert_allclose(found[:, 0], 0.01 * stacked(forward(theta), observations, 0.0), rtol=1e-9)


def test_a_refinement_pays_two_simulations_a_nuisance_whatever_the_runs_that_it_adds() -> None:
    """Each run that was added moved the best fit, and two more simulations were made there, which nothing counted."""
    coarse, measured = campaign(spread(16)), record(truth(np.array([0.35, 0.6, 0.45, 0.55])))
    made: list[Mapping[str, float]] = []

    def counted(theta: Mapping[str, float]) -> Histories:
        made.append(theta)
        return faster(theta)

    runs = NuisanceRuns(counted, [SPEED])
    choice = InversionOptions(noise={CHANNEL: 1e-5}, sampling=None, analyse=False)
    _, found = refine(
        coarse, measured, forward, choice, 3, lambda seen, mode: runs.columns(seen, coarse.named(mode.theta), mode.t0)
    )
    assert len(found.added) > 1
    assert [theta["impact.speed"] for theta in made] == pytest.approx([90.9, 89.1])


def test_interval_holds_the_truth_of_a_shot_that_was_faster_than_it_was_said_to_be(
    dataset: Dataset, emulator: Emulator
) -> None:
    """2 % more speed is 2 % more of the peak, 4 % of its range, and far more than the noise would allow."""
    fast = record(truth(0.5))
    fast = replace(fast, channels={CHANNEL: 1.02 * fast.channels[CHANNEL]})
    options = InversionOptions(method="emulator", noise={CHANNEL: 1e-5}, sampling=None, analyse=False)
    peak = NAMES[0]
    blind = invert(dataset, fast, forward, options, emulator=emulator).inversion.methods["emulator"].parameters[peak]
    aware = invert(dataset, fast, forward, options, emulator=emulator, columns=columns).inversion
    told = aware.methods["emulator"].parameters[peak]
    assert blind.interval_95 is not None
    assert told.interval_95 is not None
    assert not blind.interval_95[0] < truth(0.5)[0] < blind.interval_95[1]
    assert told.interval_95[0] < truth(0.5)[0] < told.interval_95[1]
    assert told.identified


def test_case_says_how_uncertain_speed_mass_and_thickness_are() -> None:
    case = load_case(
        "reference_strike",
        {
            "inversion.nuisance.speed": "0.5 m/s",
            "inversion.nuisance.mass": "18 g",
            "inversion.nuisance.thickness": "0.05 mm",
        },
    )
    found = {n.name: n for n in case_nuisances(case)}
    assert found["speed"].key == "impact.speed"
    assert found["mass"].key == "bird.density"  # this bird is given by its density
    assert found["mass"].sigma == pytest.approx(9.0, rel=0.01)  # 18 g of 1.8 kg
    assert found["thickness"].value == pytest.approx(0.01)


def test_discrepancy_has_the_stated_size_and_is_slow(dataset: Dataset) -> None:
    observations = observe(record(truth(0.5)), dataset, {CHANNEL: 1e-5})
    covariance = (found := discrepancy_columns({CHANNEL: 0.03}, observations)) @ found.T
    peak = observations.channels[0].peak
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), 0.03 * peak, rtol=0.01)
    assert covariance[0, 1] > 0.9 * covariance[0, 0]
    assert abs(covariance[0, -1]) < 0.01 * covariance[0, 0]


def test_a_channel_without_a_stated_discrepancy_has_none(dataset: Dataset) -> None:
    observations = observe(record(truth(0.5)), dataset, {CHANNEL: 1e-5})
    assert discrepancy_columns({"another": 0.03}, observations).shape == (len(observations.values), 0)


def test_the_discrepancy_of_the_case_is_by_sensor_and_what_is_given_replaces_it() -> None:
    case = load_case(
        "reference_strike",
        {"inversion.discrepancy.displacement_centre": "2.5 %", "inversion.discrepancy.contact_force": "0 %"},
    )
    sensors = ("displacement_centre", "contact_force")
    assert stated_discrepancy(case, sensors, None) == {"displacement_centre": 0.025}
    assert stated_discrepancy(case, sensors, 0.1) == dict.fromkeys(sensors, 0.1)
    assert stated_discrepancy(case, sensors, 0.0) == {}
    assert stated_discrepancy(case, ("reaction_force",), None) == {}


def test_mesh_band_is_two_sigma_and_a_missing_one_is_an_error(dataset: Dataset) -> None:
    observations = observe(record(truth(0.5)), dataset, {CHANNEL: 1e-5})
    bands = Histories(TIME, {f"{CHANNEL}_uncertainty": np.full(len(TIME), 1e-4)}, {f"{CHANNEL}_uncertainty": "m"})
    np.testing.assert_allclose(mesh_columns(bands, observations, 0.0), 5e-5)
    with pytest.raises(UserError, match="run birdstrike converge"):
        mesh_columns(replace(bands, channels={}), observations, 0.0)


@pytest.mark.parametrize("kind", ["discrepancy", "started"])
def test_the_columns_of_a_dense_record_have_the_covariance_of_all_its_instants(dataset: Dataset, kind: str) -> None:
    """Of 1200 instants 250 carry them: to 0.1 % of the variance, at every instant and between any two."""
    times = np.linspace(0.0, 2.9e-3, 1200)
    process = partial(started, contact=START, length=0.3e-3) if kind == "started" else None
    if process is None:
        observations = observe(record(truth(0.5), times), dataset, {CHANNEL: 1e-5})
        (channel,) = observations.channels
        apart = (channel.times[:, None] - channel.times) / (0.25 * np.ptp(channel.times))
        exact = (0.03 * channel.peak) ** 2 * np.exp(-0.5 * apart**2)
        found = discrepancy_columns({CHANNEL: 0.03}, observations)
    else:
        exact, found = process(times, times), factor_between(process, times, 1e-7)
    assert found.shape[1] < 250
    assert np.abs(found @ found.T - exact).max() < 1e-3 * exact.max()


def test_the_columns_hold_where_a_record_is_sparse_beside_a_burst() -> None:
    """Instants chosen by number left two of 50 to 18 ms behind 20 000 in 2 ms: 12 % of the variance between them."""
    times = np.concatenate([np.linspace(0.0, 2e-3, 20000, endpoint=False), np.linspace(2e-3, 20e-3, 50)])
    length = 5e-3
    found = factor_between(lambda t, s: np.exp(-0.5 * ((t[:, None] - s) / length) ** 2), times, 1e-3)
    assert (found**2).sum(axis=1) == pytest.approx(np.ones(len(times)), abs=0.01)


def test_the_columns_of_a_record_of_4000_instants_need_no_matrix_of_that_size(dataset: Dataset) -> None:
    """128 MB, and 30 s."""
    observations = observe(record(truth(0.5), np.linspace(0.0, 2.9e-3, 4000)), dataset, {CHANNEL: 1e-5})
    tracemalloc.start()
    discrepancy_columns({CHANNEL: 0.03}, observations)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 40e6
