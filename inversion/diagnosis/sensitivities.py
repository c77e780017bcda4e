"""How one strike's channels answer to parameters, effects and nuisances: derivatives from strikes of the solver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.errors import CaseError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.groundwork import CENTRE, Groundwork
from birdstrike.inversion.diagnosis.record import Record, averaged
from birdstrike.inversion.diagnosis.responses import Known, label
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.instrument import transducers

STEP = 0.2  # of a parameter's range, to either side of the centre
SPEED = "impact.speed"


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of a strike's channels at the campaign's centre, on the model's clock.

    time: (m,) [s]; channels: names, in the order of the axis c; curves: (c, m) SI; theta: (r, c, m) per range of each
    parameter; effects: name -> (c, m) per plausible size, those of the nuisances among them; doubts: name -> (c, m) an
    error such as each of these may have.
    """

    time: Array
    channels: tuple[str, ...]
    curves: Array
    theta: Array
    effects: Mapping[str, Array]
    doubts: Mapping[str, Array]

    def of(self, channels: Sequence[str]) -> Sensitivities:
        """Of some channels, in their order."""
        at = [self.channels.index(name) for name in channels]
        effects, doubts = ({name: y[at] for name, y in own.items()} for own in (self.effects, self.doubts))
        return Sensitivities(self.time, tuple(channels), self.curves[at], self.theta[:, at], effects, doubts)


def sampled(record: Record, time: Array, curves: Array) -> Array:
    """(q, n) on a record's points of curves (q, channels, m) at the instants time (m,), as `Model.sample` has it."""
    parts = [
        averaged(np.stack([np.interp(trace.times, time, row) for row in curves[:, i]]), trace.block)
        for i, trace in enumerate(record.traces)
        if len(curves)
    ]
    return np.concatenate(parts, axis=1) if parts else np.zeros((0, len(record.values)))


def sensitivities(
    groundwork: Groundwork, wanted: Sequence[Known], strikes: Strikes, speed: float | None = None
) -> Sensitivities | None:
    """Derivatives by all channels of the probed case; speed: of another shot [m/s]; None where a strike failed.

    A parameter costs two strikes, one to either side. At the case's own speed the effects cost none: the strikes that
    taught their responses are read again; at another, one each.
    """
    values = dict(groundwork.theta) | ({} if speed is None else {SPEED: speed})
    steps = _steps(groundwork)
    try:
        base = groundwork.probed.with_values(values)
        due = _parameter_cases(base, steps)
        if speed is not None:
            due |= {CENTRE: base} | _effect_cases(base, wanted)
    except CaseError:
        return None
    found = strikes.run(due)
    if len(found) < len(due) or not all(_taught(known, groundwork) for known in wanted):
        return None
    runs = found if speed is not None else {**groundwork.runs, **found}
    return _derivatives(groundwork, wanted, runs, steps)


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


def _taught(known: Known, groundwork: Groundwork) -> bool:
    """Whether both strikes of an effect stand."""
    return known.of_record or all(label(known.name, b) in groundwork.runs for b in known.learnt_at())


def _parameter_cases(base: Case, steps: Mapping[str, tuple[float, float]]) -> dict[str, Case]:
    ends = {f"{name} {end}": (name, both[i]) for name, both in steps.items() for i, end in enumerate(("low", "high"))}
    return {text: base.with_values({name: value}) for text, (name, value) in ends.items()}


def _effect_cases(base: Case, wanted: Sequence[Known]) -> dict[str, Case]:
    """One strike for every effect that acts on the strike, at the largest magnitude at which responses are learnt."""
    striking = [(known, known.learnt_at()[-1]) for known in wanted if not known.of_record]
    return {
        label(known.name, b): base.with_effects({**base.effects, known.name: known.magnitude(b)})
        for known, b in striking
    }


def _derivatives(
    groundwork: Groundwork,
    wanted: Sequence[Known],
    runs: Mapping[str, Histories],
    steps: Mapping[str, tuple[float, float]],
) -> Sensitivities:
    channels, time = tuple(groundwork.probed.sensors), groundwork.clock.time
    clock = replace(groundwork.clock, channels=channels)

    def shaped(of: Mapping[str, Histories]) -> dict[str, Array]:
        return {name: clock.stack(run).reshape(len(channels), len(time)) for name, run in of.items()}

    found, taught = shaped(runs), shaped(groundwork.runs)
    dataset, base = groundwork.dataset, found[CENTRE]
    spans = dict(zip(dataset.names, dataset.highs - dataset.lows, strict=True))
    theta = [(found[f"{n} high"] - found[f"{n} low"]) * spans[n] / (high - low) for n, (low, high) in steps.items()]
    exact = {known.name: _of_record(known, groundwork, time, base) for known in wanted if known.of_record}
    striking = [known for known in wanted if not known.of_record]
    effects = exact | {known.name: _slope(_changes(known, found)) for known in striking}
    doubts = {name: np.zeros_like(base) for name in exact} | {
        known.name: _scatter(_changes(known, taught)) * _error(_changes(known, found)) for known in striking
    }
    return Sensitivities(time, channels, base, np.stack(theta), effects, doubts)


Changes = dict[float, Array]


def _changes(known: Known, shaped: Mapping[str, Array]) -> Changes:
    """Magnitude b -> change (c, m) of an effect's strikes."""
    texts = {b: label(known.name, b) for b in known.learnt_at()}
    return {b: shaped[text] - shaped[CENTRE] for b, text in texts.items() if text in shaped}


def _slope(changes: Changes) -> Array:
    """(c, m) change by one plausible size, by least squares through b = 0."""
    return np.asarray(sum(b * y for b, y in changes.items())) / sum(b * b for b in changes)


def _error(changes: Changes) -> float:
    """Standard error of that slope per scatter of one strike, the base's own being common to all changes."""
    square = sum(b * b for b in changes)
    return float(np.hypot(square**-0.5, sum(changes) / square))


def _scatter(changes: Changes) -> Array:
    """(c, m) by what two strikes of an effect disagree on its slope, as scatter of one strike.

    Its curvature is in there too: what is not linear in the magnitude is no signature that a straight line may claim.
    """
    (b1, b2), (y1, y2) = changes.keys(), changes.values()
    return (y2 / b2 - y1 / b1) / np.sqrt(b1**-2 + b2**-2 + (1.0 / b1 - 1.0 / b2) ** 2)


def _of_record(known: Known, groundwork: Groundwork, time: Array, curves: Array) -> Array:
    """(c, m) change by one plausible size of an instrument's effect, exact to first order, without a strike.

    The trigger moves all channels. What acts on the case's transducers acts on a new sensor of their kind too, as it
    would if the case declared it.
    """
    rate = np.gradient(curves, time, axis=1)
    if known.name == "time_offset":
        return -known.size * rate
    sensors = groundwork.probed.sensors
    kinds = {sensors[name].kind for name in transducers(groundwork.case)}
    acts = np.array([sensor.kind in kinds for sensor in sensors.values()])[:, None]
    own = {"sensor_gain": curves, "sensor_bandwidth": -rate, "sensor_drift": np.broadcast_to(time, curves.shape)}
    return known.size * acts * own[known.name]
