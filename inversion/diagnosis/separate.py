"""The next measurement: the channel, or the second shot, that would tell rival effects apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.stats import ncx2

from data.histories import Array, Histories
from inversion.diagnosis.groundwork import CENTRE, Groundwork
from inversion.diagnosis.judge import Judge, Judged
from inversion.diagnosis.numerical import Numerical

UNSEEN = 2.0
from inversion.diagnosis.probes import PREFIX, SHARE
from inversion.diagnosis.responses import Known, label

UNSEEN = 2.0
from inversion.diagnosis.strikes import Strikes
from solver.case import Case

SPEEDS = (0.8, 1.2)
STEP = 0.2  # of a parameter's range, to either side of the centre
RIVALS = 6
REJECTED = 3.84  # chi-square with one degree of freedom, 5 %


@dataclass(frozen=True)
class Proposal:
    """A measurement: its name, what it separates, and the expected chance that rivals still stand beside each other."""

    channel: str
    separates: tuple[str, ...]
    ambiguous: float
    ambiguous_now: float
    speed: float | None = None

    @property
    def sentence(self) -> str:
        """For the user."""
        what = self.channel.removeprefix(PREFIX).replace("_", " ")
        where = (
            f"a second shot at {self.speed:.4g} m/s, with the same sensors" if self.speed else f"a sensor more: {what}"
        )
        rivals = ", ".join(self.separates)
        return f"{where}; of those tried it is expected to tell {rivals} apart best, by the linearised model"


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of one strike's channels: theta (r, m) per range, effects (m,) per plausible size by name.

    numerical: (d, m) changes by numerical choices, at the campaign's centre.
    """

    theta: dict[str, Array]
    numerical: dict[str, Array]
    effects: dict[str, dict[str, Array]]
    peak: dict[str, float]


def sensitivities(
    groundwork: Groundwork, rivals: tuple[Known, ...], strikes: Strikes, speed: float | None = None
) -> Sensitivities | None:
    """By central differences of the solver at the campaign's centre; speed: of another shot [m/s].

    None where a strike failed.
    """
    base_values = dict(groundwork.theta) | ({"impact.speed": speed} if speed else {})
    base = groundwork.probed.with_values(base_values)
    cases, steps = {CENTRE: base}, _steps(groundwork)
    for name, (low, high) in steps.items():
        cases |= {f"{name} low": base.with_values({name: low}), f"{name} high": base.with_values({name: high})}
    striking = [known for known in rivals if not known.of_record]
    for known in striking:
        b = known.learnt_at()[-1]
        cases[label(known.name, b)] = base.with_effects({**base.effects, known.name: known.magnitude(b)})
    runs = strikes.run(cases)
    if len(runs) < len(cases):
        return None
    return _derivatives(groundwork, rivals, runs, steps)


def _steps(groundwork: Groundwork) -> dict[str, tuple[float, float]]:
    """Two values of every parameter about the centre, inside its box."""
    dataset, coordinates = groundwork.dataset, groundwork.coordinates
    box = max(coordinates.boxes, key=lambda b: float(np.prod(b.highs - b.lows)))
    found: dict[str, tuple[float, float]] = {}
    for i, name in enumerate(dataset.names):
        if not box.flat[i]:
            middle, span = groundwork.theta[name], dataset.highs[i] - dataset.lows[i]
            low = max(middle - STEP * span, box.theta_lows[i])
            high = min(middle + STEP * span, box.theta_highs[i])
            found[name] = (float(low), float(high))
    return found


def _derivatives(
    groundwork: Groundwork,
    rivals: tuple[Known, ...],
    runs: Mapping[str, Histories],
    steps: Mapping[str, tuple[float, float]],
) -> Sensitivities:
    base = runs[CENTRE]
    spans = dict(zip(groundwork.dataset.names, groundwork.dataset.highs - groundwork.dataset.lows, strict=True))
    theta: dict[str, Array] = {}
    for channel in base.channels:
        rows = [
            (runs[f"{n} high"].channels[channel] - runs[f"{n} low"].channels[channel]) * spans[n] / (high - low)
            for n, (low, high) in steps.items()
        ]
        theta[channel] = np.stack(rows)
    effects: dict[str, dict[str, Array]] = {}
    for known in rivals:
        effects[known.name] = {c: _effect(known, base, runs, c) for c in base.channels}
    before, names = groundwork.runs[CENTRE], list(groundwork.numerical.directions)
    numerical: dict[str, Array] = {
        c: np.stack([groundwork.runs[n].channels[c] - before.channels[c] for n in names])
        if names
        else np.zeros((0, len(base.time)))
        for c in base.channels
    }
    return Sensitivities(theta, numerical, effects, {c: float(np.abs(y).max()) for c, y in base.channels.items()})


def _effect(known: Known, base: Histories, runs: Mapping[str, Histories], channel: str) -> Array:
    """Change of a channel by one plausible size; of the record's effects, exactly."""
    y, t = base.channels[channel], base.time
    if not known.of_record:
        b = known.learnt_at()[-1]
        return (runs[label(known.name, b)].channels[channel] - y) / b
    if known.name == "time_offset":
        return -known.size * np.gradient(y, t)
    if base.units[channel] != "m":
        return np.zeros_like(y)
    own = {"sensor_gain": y, "sensor_bandwidth": -np.gradient(y, t), "sensor_drift": t}
    return known.size * own[known.name]


def propose(judge: Judge, members: list[Judged], strikes: Strikes) -> Proposal | None:
    """The candidate with the lowest expected chance of an ambiguous verdict; None where there is none.

    Candidates: every sensor that the record does not have, beside the record, and a second shot at a speed 20 % lower
    or higher with the record's sensors. Noise of a new sensor: that of the record's sensor of its unit, else 1 % of its
    peak. A rival is rejected with the power of |P g b|^2 at 5 %.
    """
    groundwork = judge.groundwork
    rivals = tuple(one.fit.problem.model.known[one.fit.own[0]] for one in members[:RIVALS])
    sizes = {one.name: float(one.fit.magnitudes[0]) for one in members[:RIVALS]}
    here = sensitivities(groundwork, rivals, strikes)
    if here is None or len(rivals) < 2:
        return None
    own = [trace.name for trace in judge.record.traces]
    noise = {name: _noise(judge, groundwork.probed, here, name) for name in here.theta}
    now = _ambiguous([_rows(here, own, noise)], sizes)
    names = tuple(sizes)
    found = [
        Proposal(name, names, _ambiguous([_rows(here, [*own, name], noise)], sizes), now)
        for name in here.theta
        if name not in own and groundwork.probed.sensors[name].kind != "contact_force"
    ]
    for share in SPEEDS:
        speed = share * groundwork.case.impact.speed
        there = sensitivities(groundwork, rivals, strikes, speed)
        if there is not None:
            both = [_rows(here, own, noise), _rows(there, own, noise)]
            found.append(Proposal("second shot", names, _ambiguous(both, sizes), now, speed))
    return min(found, key=lambda one: one.ambiguous, default=None)


def _noise(judge: Judge, case: Case, here: Sensitivities, name: str) -> float:
    """Standard deviation of a channel's points: noise and, as white noise of the same worth, its numerical scatter.

    Scatter that hangs together over l tells a smooth signature as much as white noise sqrt(l sqrt(2 pi) / dt) larger.
    """
    kind, level = case.sensors[name].kind, SHARE * here.peak[name]
    for trace in judge.record.traces:
        if case.sensors[trace.name].kind == kind:
            level = trace.noise.level
            break
    runs, time = judge.groundwork.runs, judge.groundwork.clock.time
    changes = {n: runs[n].channels[name] - runs[CENTRE].channels[name] for n in judge.groundwork.numerical.directions}
    own = Numerical.of(changes, judge.groundwork.case, time, 1)
    worth = own.correlation[0] * np.sqrt(2.0 * np.pi) / float(time[1] - time[0])
    return float(np.hypot(level, np.sqrt(np.mean(own.scatter**2) * max(worth, 1.0))))


Rows = tuple[Array, Array, dict[str, Array]]


def _rows(found: Sensitivities, channels: list[str], noise: Mapping[str, float]) -> Rows:
    """Derivatives of several channels in units of their noise, side by side: parameters, numerical choices, effects."""
    theta = np.hstack([found.theta[c] / noise[c] for c in channels])
    numerical = UNSEEN * np.hstack([found.numerical[c] / noise[c] for c in channels])
    return (
        theta,
        numerical,
        {n: np.concatenate([found.effects[n][c] / noise[c] for c in channels]) for n in found.effects},
    )


def _ambiguous(shots: list[Rows], sizes: Mapping[str, float]) -> float:
    """Mean chance that a rival j is not rejected when i is true, over all ordered pairs.

    Parameters are shared by the shots and have their priors; numerical choices are shared with N(0, 1).
    """
    design = np.hstack([np.vstack([theta, numerical]) for theta, numerical, _ in shots]).T
    g = {name: np.concatenate([effects[name] for _, _, effects in shots]) for name in sizes}
    r = len(shots[0][0])
    prior = np.diag(np.append(np.full(r, np.sqrt(12.0)), np.ones(design.shape[1] - r)))
    kept: list[float] = []
    for i, j in permutations(sizes, 2):
        a = np.vstack([np.column_stack([design, g[j]]), np.column_stack([prior, np.zeros(len(prior))])])
        shift = np.concatenate([g[i] * sizes[i], np.zeros(len(prior))])
        left = shift - a @ np.linalg.lstsq(a, shift, rcond=1e-10)[0]
        kept.append(float(ncx2.cdf(REJECTED, 1, max(float(left @ left), 1e-12))))
    return float(np.mean(kept)) if kept else 1.0
