"""docs/interval_coverage.py: its intervals are those that an inversion samples, and its rows say what was held."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.posterior import sample
from birdstrike.inversion.observations.observations import observe
from birdstrike.surrogate.emulator import fit_emulator
from tests.docs.pages import ROOT
from tests.inversion.stand_in import CHANNEL, TIME, campaign, pulse, spread, truth

SHARE = np.array([0.35, 0.6, 0.45, 0.55])


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script; docs/ is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("interval_coverage")


def test_interval_is_that_of_the_sampled_posterior(script: Any) -> None:
    dataset, cell = campaign(spread(20)), script.Cell(20, 12, 1, 3e-5)
    histories = Histories(TIME, {CHANNEL: pulse(truth(SHARE))}, {CHANNEL: "m"})
    emulator = fit_emulator(dataset, [CHANNEL])
    observations = observe(script.record(dataset, histories, cell, 0), dataset, {})
    problem = Calibrator(CurveModel(emulator, observations), parameter_coordinates(dataset, emulator.regions), 0.0)
    _, found = script.posterior(problem, 0)
    expected = sample(problem, problem.fit()).interval()
    np.testing.assert_allclose(found, expected, atol=0.12 * np.ptp(expected, axis=1).max())


class Bench:
    """Stands in for the simulations: intervals of which every fourth misses, half as wide with 196 runs."""

    def __init__(self, script: Any) -> None:
        self.script, self.calls = script, 0

    def interval(self, part: str, cell: Any, number: int) -> Any:
        self.calls += 1
        z = np.full(3, 0.5)
        centre = 0.9 if number % 4 == 0 else 0.5
        width = 0.1 if cell.runs == 196 else 0.2
        ends = np.stack([np.full(3, centre - width / 2), np.full(3, centre + width / 2)], axis=1)
        return self.script.Interval(z, ends, np.full(3, 0.9), 4 if part == "refined" else 0)


def test_table_counts_what_held_and_a_second_call_goes_on(script: Any, tmp_path: Path) -> None:
    bench, file = Bench(script), tmp_path / "intervals.csv"
    few, many = (script.Cell(runs, 12, 1, 2e-5) for runs in (25, 196))
    assert len(list(script.fill(bench, file, "plain", [few, many], range(4)))) == 2
    assert bench.calls == 8
    assert list(script.fill(bench, file, "plain", [few, many], range(4))) == []
    assert len(list(script.fill(bench, file, "refined", [few], range(4)))) == 1
    assert bench.calls == 12
    text = script.tables(script.read(file))
    assert "| 25 | 12 | 1 | 0.02 mm | 4 | 100 % | 75 % | – | 75 % | 20.0 % | 20.0 % | 20.0 % | 2.00 | 0.0 |" in text
    assert "### The same after `--refine auto`" in text
    assert text.count("| 4.0 |") == 1
