"""Activity limits: what the solver cannot feel, the emulator must not see."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.surrogate.features import covered, features, regions

NAMES = ("bird.material.viscosity", "bird.material.tension_erosion", "bird.material.compression_erosion")
LOWS, HIGHS = np.array([0.0, 0.05, 0.05]), np.array([1500.0, 1.25, 1.25])


def test_off_is_one_point_far_from_the_strongest_erosion() -> None:
    theta = np.array([[1.0, 0.05, 1.25], [1.0, 1.0, 1.0], [1.0, 0.7, 1.1], [1.0, 1.01, 0.99]])
    seen = features(NAMES, theta)
    assert (seen[:3, 1:] == 0.0).all()
    assert (seen[3, 1:] > 0.98).all()
    assert (seen[:, 0] == 1.0).all()


def test_stronger_erosion_is_a_larger_feature() -> None:
    tension = features(("x.tension_erosion",), np.array([[1.25], [1.1], [1.01]]))[:, 0]
    compression = features(("x.compression_erosion",), np.array([[0.1], [0.9], [0.97]]))[:, 0]
    assert (np.diff(tension) > 0.0).all()
    assert (np.diff(compression) > 0.0).all()


def test_regions_stop_at_the_limit_and_at_the_last_active_run() -> None:
    rng = np.random.default_rng(0)
    runs = LOWS + rng.random((41, 3)) * (HIGHS - LOWS)
    runs[:, 1] = np.where(runs[:, 1] > 1.0, np.maximum(runs[:, 1], 1.08), runs[:, 1])
    boxes = regions(NAMES, LOWS, HIGHS, runs)
    assert len(boxes) == 4
    active = runs[runs[:, 1] > 1.0, 1]
    for box in boxes:
        tension, compression = (box.lows[1], box.highs[1]), (box.lows[2], box.highs[2])
        assert tension == (0.05, 1.0) if box.flat[1] else tension[0] == active.min() >= 1.08
        assert compression == (1.0, 1.25) if box.flat[2] else compression[1] == runs[runs[:, 2] < 1.0, 2].max()
        assert not box.flat[0]


def test_ordinary_parameter_is_trusted_one_spacing_beyond_its_runs() -> None:
    runs = np.linspace(300.0, 900.0, 16)[:, None]
    (box,) = regions(NAMES[:1], LOWS[:1], HIGHS[:1], runs)
    assert (box.lows[0], box.highs[0]) == (200.0, 1000.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_logarithmic_range_is_trusted_one_spacing_of_logarithms_beyond_its_runs(sign: float) -> None:
    runs = sign * np.logspace(3.0, 5.0, 5)[:, None]
    lows, highs = np.sort(sign * np.array([[1.0], [1e8]]), axis=0)
    (box,) = regions(NAMES[:1], lows, highs, runs, ("logarithmic",))
    np.testing.assert_allclose(np.sort(sign * np.concatenate([box.lows, box.highs])), [1e1, 1e7])
    (box,) = regions(NAMES[:1], lows, highs, runs[:2], ("logarithmic",))
    assert (box.lows[0], box.highs[0]) == (lows[0], highs[0])  # to the last bit


def test_active_part_with_fewer_runs_than_it_takes_is_not_trusted() -> None:
    """Two parameters need three active runs."""
    names, lows, highs = NAMES[:2], LOWS[:2], HIGHS[:2]
    runs = np.array([[100.0, 0.2], [500.0, 0.5], [900.0, 0.9], [300.0, 1.1], [700.0, 1.2], [1300.0, 1.24]])
    assert len(regions(names, lows, highs, runs)) == 2
    (box,) = regions(names, lows, highs, runs[:-1])
    assert box.flat.tolist() == [False, True]
    assert covered([box], runs).tolist() == [True, True, True, False, False, False]


def test_no_region_where_no_run_is_active() -> None:
    runs = np.array([[0.2], [0.6], [0.9]])
    (box,) = regions(("x.tension_erosion",), LOWS[1:2], HIGHS[1:2], runs)
    assert (box.lows[0], box.highs[0], box.flat[0]) == (0.05, 1.0, True)
