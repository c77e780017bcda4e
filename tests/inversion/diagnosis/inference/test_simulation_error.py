"""What simulations leave uncertain of curves and signatures."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.diagnosis.inference.linearisation import Linearisation, Places
from birdstrike.inversion.diagnosis.inference.system import IN_COMMON, SHARE, TRENDS, lattice_columns, trends


@pytest.mark.parametrize("channels", [1, 16])
def test_what_other_models_answer_is_not_averaged_away_by_many_sensors(channels: int) -> None:
    """The size of a signature as all channels see it together; over time and channels its variance is SHARE squared."""
    t = np.linspace(0.0, 1.0, 200)
    record = SimpleNamespace(
        values=np.zeros(200 * channels),
        middle=np.tile(t, channels),
        channel=np.repeat(np.arange(channels), 200),
        traces=[SimpleNamespace(name=str(i)) for i in range(channels)],
    )
    shot: Any = SimpleNamespace(record=record, setup=SimpleNamespace(time=t))
    signature = np.ones(200 * channels)
    (parts,) = trends(Linearisation([shot], Places({}, {})), signature)
    errors = np.hstack([*parts.values()])
    assert (errors**2).sum(axis=1).mean() == pytest.approx(SHARE**2, rel=0.02)
    seen = float(((signature @ errors) ** 2).sum()) / len(signature) ** 2
    assert seen == pytest.approx(SHARE**2 / TRENDS * (IN_COMMON + (1.0 - IN_COMMON) / channels), rel=0.02)


def test_shots_share_the_mean_of_what_another_lattice_moves() -> None:
    rng = np.random.default_rng(4)
    one, other = 1.0 + rng.standard_normal((4, 6)), 1.0 + rng.standard_normal((3, 5))
    columns = lattice_columns([one, other, np.zeros((0, 2))])
    covariance = columns @ columns.T
    np.testing.assert_allclose(covariance[:6, :6], one.T @ one / 4.0)
    np.testing.assert_allclose(covariance[6:11, 6:11], other.T @ other / 3.0)
    np.testing.assert_allclose(covariance[:6, 6:11], np.outer(one.mean(axis=0), other.mean(axis=0)))
    assert not covariance[11:].any()
