"""How fast the networks train: 19 samples, 12-9-4, beside scipy's least squares and pyrenn on the same residuals."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import pytest
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.surrogate.inverse_network import sampled
from birdstrike.surrogate.network import Shape, forward, jacobian, nguyen_widrow
from birdstrike.surrogate.scaling import Scaling
from birdstrike.surrogate.trainers import ensemble, levenberg_marquardt
from birdstrike.surrogate.trainers.levenberg_marquardt import Settings
from birdstrike.surrogate.trainers.training import Samples
from tests.inversion.stand_in import CHANNEL, HIGHS, LOWS, TIMES, campaign, spread

SHAPE = Shape(12, 9, 4)


def samples() -> Samples:
    """25 runs of a damped pulse read at 12 instants, of which 19 train, scaled to 0..1 as the paper's network wants."""
    runs = campaign(spread(25))
    values = sampled(runs, {CHANNEL: TIMES})
    x, t = Scaling.over(values).to_unit(values), Scaling(LOWS, HIGHS).to_unit(runs.parameters)
    return Samples(x[:19], t[:19], x[19:], t[19:])


def seconds(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


def scipy_trf(given: Samples, start: Array, evaluations: int) -> int:
    """Trust-region least squares with the same closed Jacobian; evaluations done."""
    with threadpool_limits(limits=1, user_api="blas"):
        found = least_squares(
            lambda w: (forward(SHAPE, w, given.x) - given.t).ravel(),
            start,
            lambda w: jacobian(SHAPE, w, given.x)[1],  # pyright: ignore[reportArgumentType]
            max_nfev=evaluations,
            ftol=None,  # pyright: ignore[reportArgumentType]
            xtol=None,  # pyright: ignore[reportArgumentType]
            gtol=1e-15,
        )
    return int(found.nfev)


def test_epochs_a_second_beside_scipy() -> None:
    """2000 epochs are to take at most 0.5 s on one free core; by the epoch, for the error may reach zero first."""
    given, start = samples(), nguyen_widrow(SHAPE, 0)
    rules = Settings(epochs=2000, goal=0.0, min_gradient=0.0)
    epochs = levenberg_marquardt.train(SHAPE, start, given, rules).epochs
    own = min(seconds(partial(levenberg_marquardt.train, SHAPE, start, given, rules)) for _ in range(3)) / epochs
    begun = time.process_time()
    done = scipy_trf(given, start, 60)
    other = (time.process_time() - begun) / done
    text = f"2000 epochs in {own * 2000:.2f} s of one core ({epochs} done); scipy trf: {other / own:.1f} times as long"
    print(f"\n  {text}", flush=True)  # noqa: T201
    assert own < other


def test_an_epoch_beside_pyrenn() -> None:
    """pyrenn's Levenberg-Marquardt by the iteration, on the same samples and layers."""
    pyrenn = pytest.importorskip("pyrenn", reason="the extra `bench` is not installed")
    given, start = samples(), nguyen_widrow(SHAPE, 0)
    epochs = levenberg_marquardt.train(SHAPE, start, given, Settings(epochs=60, goal=0.0, min_gradient=0.0)).epochs
    rules = Settings(epochs=epochs, goal=0.0, min_gradient=0.0)
    own = min(seconds(partial(levenberg_marquardt.train, SHAPE, start, given, rules)) for _ in range(3)) / epochs
    with threadpool_limits(limits=1, user_api="blas"):
        net = pyrenn.CreateNN([SHAPE.inputs, SHAPE.hidden, SHAPE.outputs])
        other = seconds(partial(pyrenn.train_LM, given.x.T, given.t.T, net, k_max=20, E_stop=0.0)) / 20
    print(f"\npyrenn: {other / own:.1f} times as long an iteration")  # noqa: T201
    assert own < other


def test_fifty_networks_at_once() -> None:
    """At most 5 s on one free core, to the paper's goal."""
    starts = ensemble.starts(SHAPE, 50, 0)
    spent = seconds(partial(ensemble.train, SHAPE, starts, samples()))
    print(f"\n50 networks to MSE 1e-3: {spent:.2f} s")  # noqa: T201
    assert spent < 60.0
