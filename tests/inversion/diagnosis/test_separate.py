"""The next measurement: what tells twins apart lowers the expected chance that they stay together."""

from __future__ import annotations

import numpy as np
import pytest

from inversion.diagnosis.separate import Sensitivities, _ambiguous, _rows

T = np.linspace(0.0, 1.0, 200)
PULSE, TAIL = np.sin(np.pi * T), np.maximum(T - 0.5, 0.0)
CHANNELS = {"own": (PULSE, 1.02 * PULSE), "telling": (PULSE, TAIL), "deaf": (0.0 * T, 0.0 * T)}
FOUND = Sensitivities(
    theta={c: np.stack([T * (1.0 - T)]) for c in CHANNELS},
    numerical={c: np.zeros((0, len(T))) for c in CHANNELS},
    effects={"a": {c: pair[0] for c, pair in CHANNELS.items()}, "b": {c: pair[1] for c, pair in CHANNELS.items()}},
    peak=dict.fromkeys(CHANNELS, 1.0),
)
NOISE = dict.fromkeys(CHANNELS, 0.2)
SIZES = {"a": 1.0, "b": 1.0}


def chance(*channels: str) -> float:
    return _ambiguous([_rows(FOUND, list(channels), NOISE)], SIZES)


def test_twins_on_one_channel_stay_together() -> None:
    assert chance("own") == pytest.approx(0.95, abs=0.01)


def test_a_channel_on_which_they_differ_separates_them() -> None:
    assert chance("own", "telling") < 0.05
    assert chance("own", "deaf") == pytest.approx(chance("own"), abs=1e-6)


def test_a_numerical_direction_that_looks_like_the_difference_takes_it_away() -> None:
    blurred = Sensitivities(
        FOUND.theta, {c: 10.0 * np.stack([PULSE, TAIL]) for c in CHANNELS}, FOUND.effects, FOUND.peak
    )
    clear = chance("own", "telling")
    assert _ambiguous([_rows(blurred, ["telling"], NOISE)], SIZES) > clear
