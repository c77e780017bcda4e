"""A record that nothing is fitted to is judged by its own noise, and only where its case predicts it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.inversion.diagnosis.conclusions.answer import curve_at
from birdstrike.inversion.diagnosis.conclusions.before_and_after import Held, expected_residual, other_record
from birdstrike.inversion.diagnosis.diagnose import NamedRecord, predicted_heldout
from birdstrike.inversion.diagnosis.inference.hypotheses import NOTHING
from birdstrike.inversion.diagnosis.preparation.shots import Record, Shot
from tests.inversion.diagnosis.conftest import Laboratory
from tests.inversion.diagnosis.rig import tiny


def repeated(shot: Shot, factor: float) -> Shot:
    """The same shot by sensors of other noise: `factor` times that of the first record."""
    rng, traces = np.random.default_rng(5), []
    for trace in shot.record.traces:
        noise = replace(trace.noise, sigma=factor * trace.noise.sigma)
        rest = np.sqrt(max(factor**2 - 1.0, 0.0)) * trace.noise.sigma
        traces.append(replace(trace, values=trace.values + rest * rng.standard_normal(len(rest)), noise=noise))
    return replace(shot, name="held out", record=Record(tuple(traces), ()))


@pytest.mark.parametrize("factor", [1.0, 20.0, 100.0])
def test_a_held_out_record_is_judged_by_its_own_noise(laboratory: Laboratory, factor: float) -> None:
    """One of twenty times the noise was told to be as many times off."""
    ranking, (first, *_) = laboratory.answered[0]
    problem, fit = ranking.problem, ranking.fits["none"]
    found = other_record(problem, NOTHING, fit, repeated(first, 1.0), first)
    noisy = other_record(problem, NOTHING, fit, repeated(first, factor), first)
    own = found.error**2 - 1.0
    mean, sd = expected_residual(first, problem, NOTHING, fit)
    share = np.diag(first.record.covariance()) / sd**2
    rest = float(np.mean(1.0 / (1.0 + (factor**2 - 1.0) * share)))
    assert noisy.error == pytest.approx(np.sqrt(1.0 + own * rest), rel=0.15)
    assert found.error == pytest.approx(
        Held.of("shot", first.record.values - _curve(laboratory) - mean, sd, first.name).error, rel=1e-6
    )


def test_a_held_out_record_is_predicted_with_the_responses_that_were_simulated_at_the_fits(
    laboratory: Laboratory,
) -> None:
    """It was read before them, and predicted with the responses of the design."""
    ranking, (first, *_) = laboratory.answered[0]
    (changed, *_) = first.setup.changes
    model, fit = ranking.models[changed.name], ranking.fits[changed.name]
    assert model.members[0].response is first.setup.responses[changed.name]
    now = other_record(ranking.problem, model, fit, replace(first, name="held out"), first)
    early = replace(first, name="held out", setup=replace(first.setup, changes=()))
    assert other_record(ranking.problem, model, fit, early, first) == now


def _curve(laboratory: Laboratory) -> np.ndarray:
    """What the fit without an effect predicts of the first shot."""
    ranking, (first, *_) = laboratory.answered[0]
    return curve_at(ranking, "none", first)


def test_a_held_out_record_of_a_first_shot_that_is_left_out_is_left_out_too() -> None:
    """It was read with the next shot's case, of another speed, and judged by that."""
    other = Measured(np.zeros(1), {"reaction_force": np.zeros(1)}, {}, {"reaction_force": "N"}, (), path="again.csv")
    slow, fast = (NamedRecord(name, tiny(), other) for name in ("slow", "fast"))
    assert predicted_heldout(other, slow, [slow, fast]) == (other, ())
    assert predicted_heldout(None, slow, [fast]) == (None, ())
    held, (told,) = predicted_heldout(other, slow, [fast])
    assert held is None
    assert "again.csv is left out as slow is" in told
