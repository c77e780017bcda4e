"""Co-kriging of two meshes: what a few fine runs tell corrects the others, and the error is stated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.mesh_correction import (
    CorrectedCampaign,
    MeshCorrection,
    correct_campaign,
    fine_mesh,
    shells_of_a_file,
    unrefined_file,
)
from birdstrike.inversion.observations.observations import observe
from birdstrike.solver.case.case import load_case
from birdstrike.surrogate.emulator import fit_emulator
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, NAMES, START, TIME, forward, record, truth
from tests.solver.target.test_mesh_file import table_with, written

COARSE = load_case("synthetic_strike")
FINE = fine_mesh(COARSE, COARSE)
FORCE = "contact_force"
INSTANTS = np.linspace(START + 0.05e-3, 2.9e-3, 200)


def growth(damping: float) -> float:
    """Factor by which the fine mesh enlarges a curve: 1.06 at the least damping, 1.01 at the most."""
    return 1.06 - 0.05 * (damping - LOWS[2]) / (HIGHS[2] - LOWS[2])


def fine(theta: Mapping[str, float]) -> Histories:
    """The pulse on the fine mesh; the force is the coarse one's."""
    run = forward(theta)
    return replace(run, channels={**run.channels, CHANNEL: growth(theta["pulse.damping"]) * run.channels[CHANNEL]})


@pytest.fixture(scope="module")
def corrected(dataset: Dataset) -> CorrectedCampaign:
    return correct_campaign(dataset, fine, FINE, [CHANNEL], lambda _: None)


def test_fine_mesh_has_half_the_spacing_and_is_never_coarser_than_declared() -> None:
    assert FINE.bird.particles == 8 * COARSE.bird.particles
    assert FINE.plate.elements == tuple(2 * n for n in COARSE.plate.elements)
    declared = COARSE.with_mesh(1000, (20, 16))
    found = fine_mesh(COARSE.with_mesh(100, (4, 16)), declared)
    assert (found.bird.particles, found.plate.elements) == (1000, (20, 32))


def test_every_run_is_corrected_to_an_eighth_of_what_the_mesh_does(
    dataset: Dataset, corrected: CorrectedCampaign
) -> None:
    """0.106 to 0.110 of it is left by five seeds of the emulator's draws."""
    wanted = np.stack([growth(row[2]) for row in dataset.parameters])[:, None] * dataset.curves[CHANNEL]
    missed = corrected.dataset.curves[CHANNEL] - wanted
    assert np.sqrt((missed**2).mean()) < 0.125 * np.sqrt(((wanted - dataset.curves[CHANNEL]) ** 2).mean())
    np.testing.assert_array_equal(corrected.dataset.curves[FORCE], dataset.curves[FORCE])


def test_a_logarithmic_range_is_corrected_by_its_logarithm() -> None:
    """Fine runs of three decades stood in the last one, where runs are farthest apart linearly."""
    a, seen = np.geomspace(1.0, 1e3, 12), list[float]()

    def finer(theta: Mapping[str, float]) -> Histories:
        seen.append(theta["bird.a"])
        if len(seen) > 5:
            raise RunFailed("five are enough")
        decades = np.log10(theta["bird.a"])
        return Histories(TIME, {CHANNEL: (1.0 + decades) * (1.01 + 0.02 * decades) * shape}, {CHANNEL: "m"})

    shape = 1e-3 * np.sin(np.pi * TIME / TIME[-1])
    runs = Dataset(
        names=("bird.a",),
        units=("Pa",),
        lows=a[:1],
        highs=a[-1:],
        runs=np.arange(1, 13),
        parameters=a[:, None],
        time=TIME,
        curves={CHANNEL: (1.0 + np.log10(a))[:, None] * shape},
        channel_units={CHANNEL: "m"},
        smooth=np.ones(12, dtype=bool),
        case_hash="decades",
        scales=("logarithmic",),
    )
    found = correct_campaign(runs, finer, FINE, [CHANNEL], lambda _: None)
    assert {int(np.log10(one)) for one in seen[:5]} >= {0, 1, 2}
    wanted = (0.01 + 0.02 * np.log10(a))[:, None] * runs.curves[CHANNEL]
    added = found.dataset.curves[CHANNEL] - runs.curves[CHANNEL]
    assert np.sqrt(((added - wanted) ** 2).mean()) < 0.1 * np.sqrt((wanted**2).mean())
    assert found.added(a[4:5])[CHANNEL] == pytest.approx(added[4], abs=1e-9)


def test_new_point_is_corrected_within_the_stated_error(corrected: CorrectedCampaign) -> None:
    """At 50 points that no run knows the correction errs by no more than three of its standard deviations."""
    z = np.random.default_rng(1).random((50, 4))
    run = corrected.forward(forward)
    for row in z:
        theta: dict[str, float] = dict(zip(NAMES, map(float, LOWS + row * (HIGHS - LOWS)), strict=True))
        missed = run(theta).channels[CHANNEL] - fine(theta).channels[CHANNEL]
        factor = np.vstack([corrected.correction.factor(row), corrected.correction.extrapolation(row)])
        stated = np.sqrt((factor**2).sum(axis=0))
        assert np.sqrt((missed**2).mean()) < 3.0 * np.sqrt((stated**2).mean())


def test_where_no_process_predicts_a_run_is_missed_by_its_distance_from_the_mean_of_the_others() -> None:
    rng = np.random.default_rng(0)
    differences = rng.normal(size=(10, 60))
    found = MeshCorrection.fit(rng.random((10, 4)), differences, 1)
    assert not found.processes
    expected = [differences[i] - np.delete(differences, i, axis=0).mean(axis=0) for i in range(10)]
    np.testing.assert_allclose(found.errors, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.rest, expected, rtol=1e-9, atol=1e-12)


def test_along_a_predicted_component_a_run_is_missed_by_what_its_process_misses() -> None:
    """And by its distance from the others' mean across it."""
    rng = np.random.default_rng(0)
    z = rng.random((10, 1))
    found = MeshCorrection.fit(z, np.outer(np.sin(3.0 * z), np.ones(60)) + 0.02 * rng.normal(size=(10, 60)), 1)
    (process,), (along,) = found.processes, found.directions
    np.testing.assert_allclose(found.errors @ along / (along @ along), process.errors, rtol=1e-9, atol=1e-12)
    across = np.eye(60) - np.outer(along, along) / (along @ along)
    np.testing.assert_allclose(found.errors @ across, found.rest, rtol=1e-9, atol=1e-12)


def scattered(theta: Mapping[str, float]) -> Histories:
    """The fine mesh whose particles lie anew with every run: a smooth curve of 0.05 mm besides, as the run draws it."""
    rng = np.random.default_rng(np.array([*theta.values()]).view(np.uint64))
    drawn = CubicSpline(np.linspace(0.0, TIME[-1], 9), rng.normal(size=9))(TIME)
    run = fine(theta)
    own = 0.05e-3 * drawn * np.clip((TIME - START) / START, 0.0, 1.0)
    return replace(run, channels={**run.channels, CHANNEL: run.channels[CHANNEL] + own})


def test_estimates_from_fine_records_err_as_stated(dataset: Dataset) -> None:
    """Root mean square of 240 errors of parameters over what is stated for them, where every fine run scatters.

    Without the correction's columns it is 11, with the covariance of ten left-out curves as it is 1.3.
    """
    corrected, times, noise = correct_campaign(dataset, scattered, FINE, [CHANNEL], lambda _: None), INSTANTS, 1e-5
    measured = replace(record(truth(0.5), times), sigma={CHANNEL: np.full(len(times), noise)})
    observations = observe(measured, corrected.dataset, {})
    emulator = fit_emulator(corrected.dataset, [CHANNEL])
    coordinates = parameter_coordinates(corrected.dataset, emulator.regions)
    bare = Calibrator(CurveModel(emulator, observations), coordinates, 0.0)
    widening, rng = corrected.widening(observations, 0.0), np.random.default_rng(3)
    assert widening >= 1.0
    errors = []
    for z in rng.random((60, 4)):
        mode = Mode(z, truth(z), 0.0, np.eye(5), 0.0, np.zeros(0), coordinates.boxes[0])
        problem = bare.with_known(corrected.columns(observations, mode, widening))
        curve = scattered(dict(zip(NAMES, map(float, mode.theta), strict=True))).at(CHANNEL, times)
        errors.append(linear_error(problem, mode, curve + noise * rng.normal(size=len(times))))
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.3


def linear_error(problem: Calibrator, mode: Mode, values: Array) -> Array:
    """(k,) error of each parameter over what is stated, of a linear fit about the truth."""
    model = problem.model
    curves = model.curves(model.scores(mode.theta[None]), 0.0)[0]
    covariance = np.diag(model.noise_at(0.0) ** 2) + (factor := model.error_factor(mode.theta, 0.0)) @ factor.T
    slopes = derivatives(problem, mode)
    stated = np.linalg.inv(slopes @ np.linalg.solve(covariance, slopes.T))
    return stated @ slopes @ np.linalg.solve(covariance, values - curves) / np.sqrt(np.diag(stated))


def derivatives(problem: Calibrator, mode: Mode) -> Array:
    """(k, n) of the model's curves at a mode, for a whole range of each parameter."""
    step = 1e-4 * np.eye(len(mode.z))
    up, down = (
        problem.model.curves(problem.model.scores(problem.coordinates.theta(mode.z + s * step, mode.box)), 0.0)
        for s in (1, -1)
    )
    return (up - down) / 2e-4


def test_what_it_cost_and_came_to_is_said(corrected: CorrectedCampaign) -> None:
    figures = corrected.figures
    assert figures.runs == 10
    assert figures.seconds > 0.0
    assert 0.01 < figures.added[CHANNEL] < 0.06
    assert figures.error[CHANNEL] < 0.25 * figures.added[CHANNEL]
    shells = "{} x {} shells".format(*FINE.plate.elements)
    assert f"10 simulations of {FINE.bird.particles} particles and {shells}" in figures.sentence
    assert not shells_of_a_file([figures.mesh_file])


def test_shells_of_a_file_are_no_fine_mesh(dataset: Dataset, tmp_path: Path) -> None:
    case = load_case(table_with(written(tmp_path / "panel.inp")))
    own = fine_mesh(case, case)
    assert own.plate.elements == case.plate.elements
    figures = correct_campaign(dataset, fine, own, [CHANNEL], lambda _: None).figures
    assert figures.elements is None
    assert f"10 simulations of {own.bird.particles} particles and the mesh of panel.inp in" in figures.sentence
    (line,) = shells_of_a_file([None, figures.mesh_file, figures.mesh_file])
    assert line.startswith("target.mesh = panel.inp: shells from a file are not refined")
    generated = load_case("openradioss_panel", {"target.generator.element_size": "50 mm"})
    assert unrefined_file(generated) is None


def test_failed_fine_runs_are_left_out_until_too_few_remain(dataset: Dataset) -> None:
    calls = iter(range(100))

    def fragile(theta: Mapping[str, float]) -> Histories:
        if next(calls) % 10 < failing:
            raise RunFailed("energy balance off by 9 %", "lower solver.courant")
        return fine(theta)

    failing = 3
    assert correct_campaign(dataset, fragile, FINE, [CHANNEL], lambda _: None).figures.runs == 7
    failing = 5
    fewest = correct_campaign(dataset, fragile, FINE, [CHANNEL], lambda _: None)
    assert (fewest.figures.runs, len(fewest.left_out)) == (5, 5)
    failing = 6
    with pytest.raises(UserError, match=r"4 of 10 .* 5 are needed \(energy balance off"):
        correct_campaign(dataset, fragile, FINE, [CHANNEL], lambda _: None)
