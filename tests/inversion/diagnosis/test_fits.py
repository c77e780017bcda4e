"""Where fits end, and the scatter of runs, which the shots of a setup share."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from birdstrike.inversion.diagnosis.conclusions.answer import SIMULATION_SCATTER, fits_elsewhere
from birdstrike.inversion.diagnosis.inference.evidence import ModelTester
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING
from birdstrike.inversion.diagnosis.inference.linearisation import Places
from birdstrike.inversion.diagnosis.inference.ranking import SWING, Assessment, Fit, Problem, likelier
from birdstrike.inversion.diagnosis.preparation.plan import LATTICES
from birdstrike.inversion.diagnosis.preparation.setup import Setup
from birdstrike.inversion.estimation.mesh_correction import stack
from birdstrike.inversion.results.diagnosis import NONE, SOMETHING_ELSE
from tests.inversion.diagnosis.conftest import Laboratory


def test_runs_scatter_alike_in_every_shot_of_a_setup(laboratory: Laboratory) -> None:
    """Mean square 1 a channel, and what a shot reads at one of its instants is the setup's row there."""
    problem = laboratory.answered[0][0].problem
    shot = next(one for one in problem.shots if one.setup.changes)
    setup = shot.setup
    for rows in np.split(setup.scatter, len(setup.channels), axis=1):
        assert (rows**2).sum(axis=0).mean() == pytest.approx(1.0)
    fine = len(setup.time)
    for i, trace in enumerate(shot.record.traces):
        begin = fine * setup.channels.index(trace.name)
        read = shot.scatter[:, shot.record.channel == i]
        expected = np.array(
            [np.interp(trace.middle, setup.time, row) for row in setup.scatter[:, begin : begin + fine]]
        )
        assert np.abs(read - expected).max() < 0.1 * np.abs(expected).max()


def test_no_other_beginning_leads_to_a_much_better_fit(laboratory: Laboratory) -> None:
    """Models are told apart by `SIMULATION_SCATTER`: by so much a fit may not hang on where it begins."""
    ranking = laboratory.answered[0][0]
    best = max((name for name in ranking.fits if name != SOMETHING_ELSE), key=lambda n: ranking.assessments[n].score)
    rng = np.random.default_rng(3)
    for label in (NONE, best):
        own, model = ranking.fits[label], ranking.models[label]
        for _ in range(3):
            begin = {group: rng.random(len(z)) for group, z in own.places.z.items()}
            other = ranking.problem.refit(model, Places(begin, own.places.h))
            assert other.evidence.log_evidence < own.evidence.log_evidence + SIMULATION_SCATTER


def test_without_a_baseline_a_fit_ends_at_the_likeliest_place_that_it_goes_round(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the places from which less than `SWING` is stepped, none makes records and parameters likelier."""
    problem = laboratory.answered[0][0].problem
    lone = replace(problem, shots=tuple(shot for shot in problem.shots if not shot.baseline), found=())
    visited: list[Fit] = []
    tested = Problem.tested

    def seen(*arguments: Any) -> Fit:
        visited.append(tested(*arguments))
        return visited[-1]

    monkeypatch.setattr(Problem, "tested", seen)
    (group,) = {shot.name for shot in lone.shots}
    end = lone.refit(NOTHING, Places({group: np.full(len(lone.shots[0].setup.lows), 0.8)}, {}))
    z = np.array([fit.places.z[group] for fit in visited[:-1]])  # the last one is the end again
    steps = np.abs(np.diff(z, axis=0)).max(axis=1)
    round_it = [fit.joint for fit, step in zip(visited, steps, strict=False) if step < SWING]
    assert round_it
    assert end.joint == pytest.approx(max([*round_it, visited[-2].joint]))


def test_a_second_place_that_the_records_leave_is_said(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Curves that are alike on both sides of 0.6: the answer was that of one side as if there were no other."""
    assert not [line for line in laboratory.content()["warnings"] if "second place" in line]
    ranking, grid = laboratory.answered[0][0], Setup.grid
    monkeypatch.setattr(Setup, "grid", lambda setup, z: grid(setup, np.minimum(z, 1.2 - z)))
    clean = tuple(replace(shot, baseline=False) for shot in ranking.problem.shots if shot.baseline)
    lone = replace(ranking.problem, shots=clean, found=())
    fit = lone.refit(NOTHING, Places({clean[0].name: np.full(len(clean[0].setup.lows), 0.3)}, {}))
    other = lone.elsewhere(fit)
    assert other is not None
    (place,), (mirrored,) = fit.places.z.values(), other.places.z.values()
    assert mirrored == pytest.approx(1.2 - place, abs=0.02)
    gain = "sensor_gain.displacement_centre"
    ranking = replace(ranking, problem=lone, assessments=dict.fromkeys((NONE, gain), Assessment.refitted(fit)))
    for label, named in ((NONE, "the model without an effect"), (gain, "sensor gain, displacement centre")):
        (line,) = fits_elsewhere(ranking, label)
        assert line.startswith(f"{named} fits at a second place too")
        assert "Pa s in place of 40" in line  # the third digit hangs on the lattice


def test_what_a_fit_makes_likely_is_the_density_of_its_linear_model(laboratory: Laboratory) -> None:
    """Records and parameters together: evidence times the posterior density of the parameters, at one node.

    What another lattice moves is in the intervals and not in that density.
    """
    fit = laboratory.answered[0][0].fits[NONE]
    node = int(fit.evidence.weights.argmax())
    alone = ModelTester(
        replace(fit.system, at={**fit.system.at, "lattice": slice(0, 0)}),
        fit.tester.known,
        combinations=fit.tester.combinations[node : node + 1],
        unnamed=(float(fit.tester.unnamed[node]),),
        apart=(float(fit.tester.apart[node]),),
    )
    one = alone.model(NOTHING)
    count = len(fit.system.dz)
    density = multivariate_normal.logpdf(fit.system.dz, one.z[:count], one.z_cov)  # pyright: ignore[reportArgumentType]
    assert alone.joint(NOTHING, ()) == pytest.approx(one.log_evidence + density, abs=1e-6)


def redrawn(problem: Problem, truth: Problem, places: Places, rng: np.random.Generator) -> Problem:
    """Another problem with records of no effect that the truth's model of their errors makes."""
    system = truth.refit(NOTHING, places, steps=0).system
    whitened = np.zeros(len(system.noise))
    for block in system.blocks:
        covariance = block.F + truth.known.nodes[block.kind][0] ** 2 * block.U
        whitened[block.rows] = np.linalg.cholesky(covariance) @ rng.standard_normal(len(covariance))
    errors = iter(np.split(system.noise @ whitened, np.cumsum([len(one.record.values) for one in truth.shots])[:-1]))
    shots = []
    for one in problem.shots:
        values = one.sample(one.setup.grid(places.z[one.name][None]))[0] + next(errors)
        traces = [replace(trace, values=values[one.record.channel == i]) for i, trace in enumerate(one.record.traces)]
        shots.append(replace(one, record=replace(one.record, traces=tuple(traces))))
    return replace(problem, shots=tuple(shots), begin=places)


@pytest.mark.parametrize("grows", [False, True])
def test_the_records_say_whether_the_model_error_grows(laboratory: Laboratory, grows: bool) -> None:
    """Records drawn with an error that grows tenfold are likelier with it, others without."""
    ranking = laboratory.answered[0][0]
    bare = replace(ranking.problem, found=())
    places = Places(ranking.fits[NONE].places.z, {})
    late = np.linspace(1.0, 10.0, len(bare.shots[0].setup.time))
    flat = {channel: replace(shape, growth=np.ones_like(late)) for channel, shape in bare.shapes.items()}
    grown = {channel: replace(shape, growth=late) for channel, shape in bare.shapes.items()}
    known = replace(bare.known, fixed=dict.fromkeys(bare.known.fixed, 0.02))
    stationary, growing = (replace(bare, known=known, shapes=shapes) for shapes in (flat, grown))
    for seed in range(3):
        truth = growing if grows else stationary
        first = redrawn(stationary, truth, places, np.random.default_rng(seed))
        chosen = likelier(first, replace(growing, shots=first.shots, begin=places))
        assert chosen.shapes is (grown if grows else flat)


def test_what_another_lattice_moves_is_read_where_both_simulations_finished(laboratory: Laboratory) -> None:
    setup = laboratory.answered[0][1][0].setup
    assert len(setup.lattice_moves) == LATTICES
    first = setup.plan.fine_points()[0]
    own, other = (stack(setup.runs[f"{kind} {first}"], setup.time, setup.channels) for kind in ("fine", "lattice"))
    assert setup.lattice_moves[0] == pytest.approx(other - own)
    lost = replace(setup, runs={label: run for label, run in setup.runs.items() if label != f"lattice {first}"})
    assert len(lost.lattice_moves) == LATTICES - 1
