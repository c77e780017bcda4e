"""Strikes with something in them that no effect of the library is: made by altering the strike itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import Case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.plate.boundary import ROTATIONS
from birdstrike.solver.plate.shell import Plate
from birdstrike.solver.sensors.recording import Recorder
from birdstrike.solver.simulate import run


@dataclass(frozen=True)
class Outside:
    """name: its kind; meaning: for the truth file; alter: changes the strike; during: called at every audit."""

    name: str
    meaning: str
    alter: Callable[[Coupling], None] | None = None
    during: Callable[[Coupling], None] | None = None


def bolted(every: int) -> Outside:
    """Edges that rotate except at every so many nodes, where a bolt holds them."""
    return Outside("bolted", f"edges held against rotation at every {every}th node only", partial(_loosen, every))


def _loosen(every: int, strike: Coupling) -> None:
    assert isinstance(strike.plate, Plate)
    edges = strike.plate.edges
    loose = np.ones(len(edges.nodes), dtype=bool)
    loose[::every] = False
    edges.held[edges.nodes[loose]] &= ~ROTATIONS


def tumbling(rate: float) -> Outside:
    """A bird that turns about the plate's width direction at `rate` [rad/s]."""
    return Outside("tumbling", f"the bird tumbles at {rate:.4g} rad/s", partial(_spin, rate))


def _spin(rate: float, strike: Coupling) -> None:
    bird = strike.bird
    arm = bird.x[: bird.n] - bird.x[: bird.n].mean(axis=0)
    bird.v[: bird.n] += np.cross([0.0, rate, 0.0], arm)


def yawed(angle: float) -> Outside:
    """A bird whose axis is turned by `angle` [rad] about the plate's normal, its velocity as stated."""
    return Outside("yawed", f"the bird's axis is yawed by {math.degrees(angle):.3g} deg", partial(_turn, angle))


def _turn(angle: float, strike: Coupling) -> None:
    bird = strike.bird
    n, c, s = bird.n, math.cos(angle), math.sin(angle)
    middle = bird.x[:n].mean(axis=0)
    bird.x[:n] = (bird.x[:n] - middle) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + middle


def second_impact(time: float, momentum: float, place: tuple[float, float]) -> Outside:
    """A fragment that hits the plate at `time` [s] with `momentum` [N s], over about 40 mm around `place` [m]."""
    words = f"a fragment hits the plate at {1e3 * time:.3g} ms with {momentum:.3g} N s"
    return Outside("second impact", words, during=partial(_hit, time, momentum, place, []))


def _hit(time: float, momentum: float, place: tuple[float, float], done: list[float], strike: Coupling) -> None:
    if done or strike.time < time:
        return
    done.append(strike.time)
    plate = strike.plate
    assert isinstance(plate, Plate)
    distance = np.hypot(plate.x[:, 0] - place[0], plate.x[:, 1] - place[1])
    weight = np.exp(-0.5 * (distance / 0.02) ** 2)
    plate.v[:, 2] -= momentum * weight / float((plate.mass * weight).sum())


def strike_with(case: Case, outside: Outside) -> Histories:
    """Histories of a case with something outside the library in it; books that do not know of it are not judged."""
    strike = Coupling(case)
    if outside.alter is not None:
        outside.alter(strike)
    recorder = Recorder(strike, case.sensors, strike.steps)
    run(strike, recorder, (), lambda _: outside.during(strike) if outside.during is not None else None)
    interval = case.time.output_interval
    clock = interval * np.arange(int(case.time.end / interval * (1.0 + 1e-12)) + 1)
    channels = recorder.sampled(clock, case.instrument)
    return Histories(clock, channels, {name: sensor.unit for name, sensor in case.sensors.items()})
