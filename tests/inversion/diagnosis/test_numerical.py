"""The numerical error's covariance: gain, shift and scatter that are drawn come back, and new draws are white by it."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.numerical import Numerical
from birdstrike.inversion.diagnosis.widened import matern

TIME = np.linspace(0.0, 2e-3, 201)
STEP = float(TIME[1] - TIME[0])
NOISE = 2e-5
GAIN, SHIFT, ROUGH, LENGTH = 0.02, 2e-5, 2e-5, 2e-4


def shape(place: float) -> Array:
    """A displacement that rises and falls, faster or slower."""
    return 6e-3 * np.sin(np.pi * TIME / (2e-3 * (0.9 + 0.4 * place))) ** 2


def draws(count: int, seed: int) -> tuple[Array, Array]:
    """Declared curves, and what finer strikes add: gain, shift in time, smooth scatter."""
    rng = np.random.default_rng(seed)
    root = np.linalg.cholesky(matern(TIME, LENGTH) + 1e-9 * np.eye(len(TIME)))
    shapes = np.stack([shape(place) for place in rng.random(count)])
    gain, shift = GAIN * rng.standard_normal((count, 1)), SHIFT * rng.standard_normal((count, 1))
    rough = ROUGH * rng.standard_normal((count, len(TIME))) @ root.T
    return shapes, gain * shapes + shift * np.gradient(shapes, STEP, axis=1) + rough


def covariance(numerical: Numerical, curve: Array) -> Array:
    """On the clock itself, beside white noise."""
    channel = np.zeros(len(TIME), dtype=int)
    at = numerical.on(lambda rows: rows, TIME, channel, NOISE**2 * np.eye(len(TIME))).at
    return at(numerical.frame(curve))


def test_new_draws_are_white_by_a_covariance_learnt_from_ten() -> None:
    size, along = [], []
    for seed in range(6):
        shapes, changes = draws(40, seed)
        numerical = Numerical(shapes[:10], changes[:10], {}, 1, STEP)
        channel = np.zeros(len(TIME), dtype=int)
        at = numerical.on(lambda rows: rows, TIME, channel, NOISE**2 * np.eye(len(TIME))).at
        rng = np.random.default_rng(seed)
        for curve, change in zip(shapes[10:], changes[10:], strict=True):
            whitener = Whitener.of(at(numerical.frame(curve)) + NOISE**2 * np.eye(len(TIME)))
            whitened = whitener.apply(change + NOISE * rng.standard_normal(len(TIME)))
            size.append(np.mean(whitened**2))
            signature = whitener.apply(np.gradient(curve, STEP))
            along.append(signature @ whitened / np.linalg.norm(signature))
    assert np.mean(size) == pytest.approx(1.0, abs=0.1)
    assert np.std(along) == pytest.approx(1.0, abs=0.3)  # ten draws know a variance to a third


def test_what_the_draws_have_in_common_moves_the_curve_and_is_one_direction() -> None:
    shapes, changes = draws(10, 2)
    common = 20.0 * ROUGH * np.sin(40.0 * np.pi * TIME / TIME[-1])
    moved = changes + 5.0 * GAIN * shapes + common
    plain, biased = Numerical(shapes, changes, {}, 1, STEP), Numerical(shapes, moved, {}, 1, STEP)
    curve = shape(0.5)
    added = (biased.finer(curve[None]) - plain.finer(curve[None]))[0]
    assert added == pytest.approx(5.0 * GAIN * curve + common, abs=1e-3 * np.abs(curve).max() * GAIN + 0.05 * ROUGH)
    more = covariance(biased, curve) - covariance(plain, curve)
    along = added / np.linalg.norm(added)
    assert along @ more @ along == pytest.approx(added @ added, rel=0.3)  # a yet finer mesh may add as much again
    assert more.trace() == pytest.approx(added @ added, rel=0.3)
    few = Numerical(shapes[:2], moved[:2], {}, 1, STEP)
    assert few.finer(curve[None])[0] == pytest.approx(curve)


def test_gain_and_shift_go_with_the_curve_that_is_asked_about() -> None:
    shapes, changes = draws(30, 1)
    numerical = Numerical(shapes, changes, {}, 1, STEP)
    curve = shape(0.5)
    for direction in (curve, np.gradient(curve, STEP)):
        unit = direction / np.linalg.norm(direction)
        sigma = GAIN if direction is curve else SHIFT
        said = unit @ covariance(numerical, curve) @ unit
        assert np.sqrt(said) == pytest.approx(sigma * np.linalg.norm(direction), rel=0.6)
    late = np.where(TIME > 1e-3, curve, 0.0)  # half a curve: nothing that a mesh does to the whole one
    rest = (
        late
        - np.stack([curve, np.gradient(curve, STEP)]).T
        @ np.linalg.lstsq(np.stack([curve, np.gradient(curve, STEP)]).T, late, rcond=None)[0]
    )
    unit = rest / np.linalg.norm(rest)
    assert unit @ covariance(numerical, curve) @ unit < 0.1 * (curve @ curve) * GAIN**2


def test_a_choice_is_one_direction_and_no_draws_are_no_scatter() -> None:
    none, d = np.zeros((0, len(TIME))), 1e-4 * np.sin(20.0 * np.pi * TIME / TIME[-1])
    numerical = Numerical(none, none, {"smoothing length 1.1 times": d}, 1, STEP)
    assert covariance(numerical, shape(0.5)) == pytest.approx(np.outer(d, d))
    assert set(numerical.sizes) == {"smoothing length 1.1 times"}


def test_two_channels_that_err_together_are_known_to() -> None:
    rng = np.random.default_rng(0)
    curve = shape(0.5)
    gain = GAIN * rng.standard_normal((12, 1))
    shapes, changes = np.tile(curve, (12, 2)), np.hstack([gain * curve, 2.0 * gain * curve])
    numerical = Numerical(shapes, changes + 1e-6 * rng.standard_normal(changes.shape), {}, 2, STEP)
    times, channel = np.tile(TIME, 2), np.repeat([0, 1], len(TIME))
    at = numerical.on(lambda rows: rows, times, channel, NOISE**2 * np.eye(2 * len(TIME))).at
    found = at(numerical.frame(np.tile(curve, 2)))
    peak = int(np.argmax(curve))
    between = found[peak, peak + len(TIME)] / np.sqrt(found[peak, peak] * found[peak + len(TIME), peak + len(TIME)])
    assert between > 0.95


def test_gain_and_shift_are_found_in_channels_of_any_unit() -> None:
    """A displacement in metres beside a force in newtons: a common cutoff of singular values would lose the former."""
    rng = np.random.default_rng(0)
    gain, shift = GAIN * rng.standard_normal((12, 1)), SHIFT * rng.standard_normal((12, 1))
    curve = shape(0.5)
    change = gain * curve + shift * np.gradient(curve, STEP)
    shapes, changes = np.tile(np.hstack([curve, 1e8 * curve]), (12, 1)), np.hstack([change, 1e8 * change])
    times, channel = np.tile(TIME, 2), np.repeat([0, 1], len(TIME))
    found = Numerical(shapes, changes, {}, 2, STEP).on(lambda rows: rows, times, channel, NOISE**2 * np.eye(len(times)))
    assert found.moments == pytest.approx(np.hstack([gain, shift, gain, shift]), rel=1e-6)
    assert np.abs(found.rest[:, : len(TIME)]).max() < 1e-9 * np.abs(change).max()


def test_the_rest_goes_through_the_records_instrument() -> None:
    """A late record errs late: what the draws say of an instant is true of that instant of the strike."""
    shapes, changes = draws(10, 0)
    late = 30
    numerical = Numerical(shapes, changes, {"smoothing length 1.1 times": changes[0]}, 1, STEP)
    channel, noise = np.zeros(len(TIME), dtype=int), NOISE**2 * np.eye(len(TIME))
    error = numerical.on(lambda rows: rows, TIME, channel, noise)
    delayed = numerical.through(error, lambda rows: np.pad(rows, ((0, 0), (late, 0)))[:, : rows.shape[1]])
    frame = np.zeros((2, len(TIME)))
    before, after = error.at(frame).diagonal(), delayed.at(frame).diagonal()
    assert delayed.choices[late:, late:] == pytest.approx(error.choices[:-late, :-late])
    quiet = np.sqrt(after[: late // 2].mean() / before[: late // 2].mean())
    assert quiet < 0.1
