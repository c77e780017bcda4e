"""Models judged on a toy that needs no strike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from inversion.diagnosis.groundwork import emulator_error
from tests.inversion.diagnosis.toy_study import HIGHS, LOWS, SCATTER, TIME, curves, groundwork, judge

MIDDLE = np.full((1, 2), 0.5)


def test_the_emulators_error_holds_the_whole_scatter_of_a_new_run(tmp_path: Path) -> None:
    ground = groundwork(tmp_path)
    (values,) = curves(MIDDLE)
    model = ground.model(judge(ground, [values[0]], 1e-5).record)
    theta = 0.5 * (LOWS + HIGHS)
    said = np.diag(emulator_error(model, theta))
    assert said == pytest.approx(np.diag(ground.emulator.covariance(theta, "middle", TIME)))
    assert np.sqrt(said.mean()) == pytest.approx(SCATTER, rel=0.2)
