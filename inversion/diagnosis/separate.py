"""The next measurement: the channel, or the second shot, that would tell rival effects apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.groundwork import CENTRE, Groundwork
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.probes import described, planned
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.rivals import Shot, chance
from birdstrike.inversion.diagnosis.sensitivities import SPEED, Sensitivities, sampled, sensitivities
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.verdict import ALPHA
from birdstrike.solver.sensors.sensor import Sensor

SPEEDS = (0.8, 1.2)
RIVALS = 6
WORTHWHILE = 0.1  # share of the chance now that a measurement must take off it
TOO_SURE = 0.1  # chance that rivals stand: one lower than this did not expect the verdict that it was asked about
SECOND = "second shot"


@dataclass(frozen=True)
class Proposal:
    """A measurement: its name, what it separates, and the expected chance that rivals still stand beside each other.

    speed: of a second shot [m/s]; what: the measurement in words; candidates: all that were tried, the best first.
    """

    channel: str
    separates: tuple[str, ...]
    ambiguous: float
    ambiguous_now: float
    speed: float | None = None
    what: str = ""
    candidates: tuple[Mapping[str, Any], ...] = ()

    @property
    def worthwhile(self) -> bool:
        """Whether it lowers the chance by a tenth of what it is now, or more."""
        return self.ambiguous <= (1.0 - WORTHWHILE) * self.ambiguous_now

    @property
    def sentence(self) -> str:
        """For the user."""
        rivals = ", ".join(self.separates)
        chance = f"from {self.ambiguous_now:.2f} to {self.ambiguous:.2f} by the linearised model"
        if self.ambiguous_now < TOO_SURE:
            chance += ", which would have told them apart already: trust the order more than the figures"
        if self.worthwhile:
            return (
                f"{self.what}; of those tried it is expected to tell {rivals} apart best: the chance that a wrong one "
                f"stands falls {chance}"
            )
        return (
            f"none of those tried would tell {rivals} apart: with the best, {self.what}, the chance that a wrong one "
            f"stands goes {chance}"
        )


@dataclass(frozen=True)
class Bench:
    """What every candidate is judged with.

    record: what is measured; sensors: all that the strike has; here: derivatives at its speed; numerical: a record's
    (n, n) covariance of the numerical error; nuisances: effect -> sigma, sizes: rival -> magnitude, in plausible sizes.
    """

    record: Record
    sensors: Mapping[str, Sensor]
    here: Sensitivities
    numerical: Callable[[Record], Array]
    nuisances: Mapping[str, float]
    sizes: Mapping[str, float]
    alpha: float = ALPHA
    theres: Mapping[float, Sensitivities] = field(default_factory=dict)

    def shot(self, record: Record, found: Sensitivities | None = None) -> Shot:
        """A shot whitened by its whole covariance; nothing for the emulator: the solver itself was asked."""
        return Shot.of(found or self.here, record, record.covariance() + self.numerical(record), self.nuisances)

    def chance(self, *shots: Shot) -> float:
        """Expected chance that a wrong rival stands."""
        return chance(shots, self.sizes, self.alpha)


def rank(bench: Bench) -> Proposal | None:
    """The best of all candidates with the list of them; None where there is none.

    A sensor more is judged as if it had stood beside the record's in the same shot, sampled as the record's first
    trace; the record's own sensors on the record's points. A second shot has the record's sensors and points; its
    numerical error, of the same covariance, is independent: taking both for the same biases would let the two shots
    cancel them, though another speed flows another way through the same mesh.
    """
    own = bench.shot(bench.record)
    now, names = bench.chance(own), tuple(bench.sizes)
    planned = {name: record for name in bench.here.channels if (record := _with_sensor(bench, name)) is not None}
    found = [
        Proposal(name, names, bench.chance(bench.shot(record)), now, what=f"a sensor more, {described(name, sensor)}")
        for name, record in planned.items()
        if (sensor := bench.sensors[name])
    ]
    found += [
        Proposal(
            SECOND,
            names,
            bench.chance(own, bench.shot(bench.record, there)),
            now,
            speed,
            f"a second shot at {speed:.4g} m/s with the same sensors",
        )
        for speed, there in bench.theres.items()
    ]
    ranked = sorted(found, key=lambda one: one.ambiguous)
    tried = tuple({"channel": p.channel, "speed": p.speed, "ambiguous": p.ambiguous} for p in ranked)
    return replace(ranked[0], candidates=tried) if ranked else None


def _with_sensor(bench: Bench, name: str) -> Record | None:
    """The record with a sensor more; None for one that it has, that reads nothing, or that nobody can buy."""
    peak = float(np.abs(bench.here.curves[bench.here.channels.index(name)]).max())
    there = [trace.name for trace in bench.record.traces]
    if name in there or bench.sensors[name].kind == "contact_force" or not peak:
        return None
    return Record((*bench.record.traces, planned(bench.record, name, bench.sensors, peak)), bench.record.warnings)


def propose(judge: Judge, members: Sequence[Judged], strikes: Strikes, alpha: float = ALPHA) -> Proposal | None:
    """The candidate with the lowest expected chance of an ambiguous verdict at level alpha; None where there is none.

    members: the rivals, the likeliest first; the first six count, each as likely as the next. Candidates: every sensor
    that the record does not have, and a second shot at a speed 20 % lower or higher (unless the speed is calibrated).
    What is tried needs its strikes: where one of them fails, it is left out, and where one at the record's speed does,
    nothing is proposed; `strikes.failures` has the reasons.
    """
    ground = judge.groundwork
    own = [(one.name, one.fit.problem.model.known[one.fit.own[0]], one.fit) for one in members[:RIVALS]]
    if len(own) < 2:
        return None
    nuisances = {ground.known[i].name: sigma for i, sigma in ground.nuisances()}
    wanted = {known.name: known for _, known, _ in own} | {k.name: k for k in ground.known if k.name in nuisances}
    found = {speed: sensitivities(ground, tuple(wanted.values()), strikes, speed) for speed in (None, *_speeds(ground))}
    here = found.pop(None)
    if here is None:
        return None
    sizes = {name: float(fit.magnitudes[0]) for name, _, fit in own}
    theres = {speed: there for speed, there in found.items() if speed is not None and there is not None}
    numerical = _numerical(ground, judge.size)
    bench = Bench(judge.record, ground.probed.sensors, here, numerical, nuisances, sizes, alpha, theres)
    return rank(bench)


def _speeds(ground: Groundwork) -> tuple[float, ...]:
    """Of second shots [m/s]."""
    return () if SPEED in ground.theta else tuple(share * ground.case.impact.speed for share in SPEEDS)


def _numerical(ground: Groundwork, size: float) -> Callable[[Record], Array]:
    """A record's covariance of the numerical error; at another speed the same, as no mesh is changed there.

    size: by which the draws' part is multiplied.
    """

    def error(record: Record) -> Array:
        names, time = [trace.name for trace in record.traces], ground.clock.time
        whole = ground.numerical_of(names)
        base = replace(ground.clock, channels=tuple(names)).stack(ground.runs[CENTRE])

        def sample(curves: Array) -> Array:
            return sampled(record, time, curves.reshape(len(curves), len(names), len(time)))

        drawn = whole.on(sample, record.middle, record.channel, record.covariance())
        return drawn.sized(size).at(sample(whole.frame(base)))

    return error
