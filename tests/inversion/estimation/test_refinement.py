"""Runs added near the answer, until the emulator errs by less than the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.inversion.estimation.locate import InversionOptions
from birdstrike.inversion.estimation.posterior import Sampling
from birdstrike.inversion.estimation.refinement import AUTO_RUNS, PAYS, refine
from birdstrike.inversion.invert import invert
from birdstrike.inversion.results.ingredients import RefinementFigures
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, campaign, forward, record, spread, truth

SHARE = np.array([0.35, 0.6, 0.45, 0.55])
QUICK = InversionOptions(noise={CHANNEL: 1e-5}, sampling=Sampling(walkers=16, chunk=50, most=100), analyse=False)


def test_coarse_campaign_is_refined_to_one_per_cent_of_the_ranges() -> None:
    coarse, measured = campaign(spread(16)), record(truth(SHARE))
    dataset, found = refine(coarse, measured, forward, QUICK, 12)
    assert 0 < len(found.added) < 12
    assert found.error[0] > 1.0 > found.error[-1]
    assert "of the noise" in found.reason
    assert len(dataset.runs) == 16 + len(found.added)
    estimates = invert(dataset, measured, forward, replace(QUICK, sampling=None)).inversion.methods["emulator"]
    values = np.array([e.value for e in estimates.parameters.values()], dtype=float)
    np.testing.assert_allclose((values - LOWS) / (HIGHS - LOWS), SHARE, atol=0.01)


def test_good_emulator_needs_no_run(dataset) -> None:
    same, found = refine(
        dataset, record(truth(SHARE)), forward, replace(QUICK, noise={CHANNEL: 1e-3}, sampling=None), 5
    )
    assert same is dataset
    assert found == RefinementFigures((), found.error, found.reason, found.added_variance)
    assert found.error[0] < 1.0


def test_failed_run_ends_the_refinement_and_is_named() -> None:
    def fragile(_theta):
        raise RunFailed("energy balance off by 9 %", "lower solver.courant")

    coarse = campaign(spread(12))
    same, found = refine(coarse, record(truth(SHARE)), fragile, replace(QUICK, sampling=None), 3)
    assert same is coarse
    assert "energy balance off" in found.reason


def test_auto_adds_runs_until_the_emulator_adds_less_than_a_fifth_to_every_interval() -> None:
    coarse, measured = campaign(spread(25)), record(truth(SHARE), noise=3e-5)
    choice = replace(QUICK, noise={CHANNEL: 3e-5}, sampling=None)
    dataset, found = refine(coarse, measured, forward, choice, "auto")
    assert 0 < len(found.added) <= AUTO_RUNS
    assert len(found.added_variance) == len(found.added) + 1
    assert found.added_variance[0] >= PAYS > found.added_variance[-1]
    assert "adds" in found.reason
    _, again = refine(dataset, measured, forward, choice, "auto")
    assert not again.added


def test_auto_adds_no_run_where_no_fit_explains_the_record(dataset) -> None:
    strange = record(truth(SHARE))
    shifted = replace(strange, channels={CHANNEL: strange.channels[CHANNEL] + 5e-3 * np.sin(9e3 * strange.time)})
    same, found = refine(dataset, shifted, forward, replace(QUICK, sampling=None), "auto")
    assert same is dataset
    assert "no run was added" in found.reason


def test_unknown_word_is_refused(dataset) -> None:
    with pytest.raises(UserError, match=r'often; give the number of runs that may be added, 0 \.\. 1000, or "auto"'):
        refine(dataset, record(truth(SHARE)), forward, QUICK, "often")


def test_negative_number_is_refused(dataset) -> None:
    with pytest.raises(UserError, match=r"-1; give the number of runs that may be added, 0 \.\. 1000"):
        refine(dataset, record(truth(SHARE)), forward, QUICK, -1)
