"""docs/interval_coverage.py: its intervals are those that an inversion samples, and its rows say what was held."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

from birdstrike.data.histories import Histories
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.coordinates import parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.posterior import sample
from birdstrike.surrogate.emulator import fit_emulator
from tests.docs.pages import ROOT
from tests.inversion.stand_in import CHANNEL, TIME, campaign, pulse, spread, truth

SHARE = np.array([0.35, 0.6, 0.45, 0.55])


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script; docs/ is no package."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module("interval_coverage")


def test_interval_is_that_of_the_sampled_posterior_and_a_row_counts_it(script: Any) -> None:
    dataset, cell = campaign(spread(20)), script.Cell(20, 12, 1, 3e-5)
    histories = Histories(TIME, {CHANNEL: pulse(truth(SHARE))}, {CHANNEL: "m"})
    emulator = fit_emulator(dataset, [CHANNEL])
    (found,) = script.held(dataset, emulator, [(0, SHARE, histories)], cell)
    coordinates = parameter_coordinates(dataset, emulator.regions)
    model = CurveModel(emulator, script.record(dataset, histories, cell, 0))
    problem = Calibrator(model, coordinates, 0.0)
    expected = sample(problem, problem.fit()).interval()
    np.testing.assert_allclose(found.interval, expected, atol=0.12 * np.ptp(expected, axis=1).max())
    assert f"| 20 | 12 | 1 | 0.03 mm | 1 | {100 * found.identified.mean():.0f} % |" in script.row(cell, [found])
