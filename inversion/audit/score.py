"""An answer against its truth: alarm, the truth's place in it, coverage, the error that remains, the signal.

The signal is the change that the effect makes between two simulations of the truth, one with and one without it on the
same lattice, whitened by the errors that the answer states, less what the calibrated parameters imitate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_triangular

from birdstrike.data.curves import Measured
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.audit.draws import (
    CLEAN,
    HELDOUT,
    OWN,
    SHOTS,
    SINGLE,
    WITHOUT,
    name_of,
    sensor_of,
    with_effects_of,
)
from birdstrike.inversion.audit.records import NO_BASELINE, Truth
from birdstrike.inversion.diagnosis.inference.hypotheses import family_of
from birdstrike.inversion.diagnosis.preparation.discrepancy import matern52
from birdstrike.inversion.results.diagnosis import ATTRIBUTED, NONE, SOMETHING_ELSE
from birdstrike.solver.case.case import Case

Simulate = Callable[[Mapping[str, Case]], dict[str, Histories]]
CORRELATION = 0.1
"""Of the record: correlation time of the errors that are not noise, of which an answer states the standard deviation;
the middle, in logarithm, of what a diagnosis allows (0.02 to 0.25), with a Matern 5/2 process."""
NOT_SINGLES = (NONE, SOMETHING_ELSE)


@dataclass(frozen=True)
class Score:
    """One answer to one record.

    draw: the truth that it shares with others; baseline: one of BASELINES; p: of the alarm; rank, family_rank: of the
    true effect among the single effects and of its family among the families, 1 the likeliest; named: the effect that
    is attributed; probabilities: (stated probability, whether it is the truth) of every model listed; parameters: name
    -> whether its 95 % interval holds the truth; magnitude: the same of the effect; error: RMS errors before and after,
    and of the true parameters and effect, held out, in units of the noise; signal: see above.
    """

    name: str
    draw: str
    channels: tuple[str, ...]
    shots: int
    baseline: str
    form: str
    kind: str
    what: str
    planted: Mapping[str, float]
    verdict: str
    p: float
    alarm: bool
    confidence_set: tuple[str, ...]
    in_set: bool
    rank: int | None = None
    family_rank: int | None = None
    named: str = ""
    probability: float | None = None
    probabilities: tuple[tuple[float, bool], ...] = ()
    parameters: Mapping[str, bool] = field(default_factory=dict)
    magnitude: bool | None = None
    error: tuple[float, float, float] | None = None
    signal: float | None = None

    @property
    def attributed(self) -> bool:
        """Whether one effect is named."""
        return self.verdict == ATTRIBUTED

    @property
    def right(self) -> bool:
        """Whether the named effect is there."""
        return any(equivalent(self.named, one, self.channels, self.shots) for one in self.planted)

    @property
    def excess(self) -> float | None:
        """(after^2 - oracle^2) / (before^2 - oracle^2); None where the oracle is no better than before."""
        if self.error is None:
            return None
        before, after, oracle = (one**2 for one in self.error)
        return None if before <= oracle else float((after - oracle) / (before - oracle))


def equivalent(label: str, truth: str, channels: Sequence[str], shots: int) -> bool:
    """Whether two labels mean the same in a record: of one shot, and of one sensor, each is also the common one."""
    return reduced(label, channels, shots) == reduced(truth, channels, shots)


def listed(label: str, ranked: Sequence[str], channels: Sequence[str], shots: int) -> str:
    """A planted label as the answer lists it: where a fault can be of one sensor only, the common one stands for it."""
    known = any(equivalent(one, label, channels, shots) for one in ranked)
    return name_of(label) if not known and sensor_of(label) else label


def reduced(label: str, channels: Sequence[str], shots: int) -> str:
    """A label without the shot or the sensor that goes without saying."""
    base, _, shot = label.partition("@")
    base = name_of(base) if len(channels) == 1 and sensor_of(base) else base
    return f"{base}@{shot}" if shot and shots > 1 else base


def score(
    name: str,
    answer: Mapping[str, Any],
    truth: Truth,
    case: Case,
    simulate: Simulate | None = None,
    baseline: str = NO_BASELINE,
    heldout: Measured | None = None,
) -> Score:
    """The answer of one record; simulate: for the error that remains, which is left out without it."""
    found = answer["diagnosis"]
    shots, channels = len(found["shots"]), (*found["noise"]["sensors"], *found.get("left_out", {}))
    ranked = single_ranks(found)
    same = [listed(label, ranked, channels, shots) for label in truth.effects]

    def true(label: str) -> bool:
        parts = label.split("+")
        return len(parts) == len(same) and all(
            any(equivalent(part, one, channels, shots) for part in parts) for one in same
        )

    believed = {CLEAN: lambda label: label == NONE, "outside": lambda label: label == SOMETHING_ELSE}.get(
        truth.kind, true
    )
    single = next((label for label in ranked if true(label)), None) if truth.kind == SINGLE else None
    named = ranked[0] if found["verdict"] == ATTRIBUTED and ranked else ""
    return Score(
        name=name,
        draw=truth.draw,
        channels=channels,
        shots=shots,
        baseline=baseline,
        form=truth.form,
        kind=truth.kind,
        what=truth.what,
        planted=dict(zip(same, truth.effects.values(), strict=True)),
        verdict=found["verdict"],
        p=found["alarm"],
        alarm=found["alarm"] < found["alpha"],
        confidence_set=tuple(found["confidence_set"]),
        in_set=any(believed(label) for label in found["confidence_set"]),
        rank=ranked.index(single) + 1 if single else None,
        family_rank=family_rank(found, family_of(name_of(single))) if single else None,
        named=named,
        probability=next((p for label, p in found["probabilities"].items() if believed(label)), None),
        probabilities=tuple((float(p), bool(believed(label))) for label, p in found["probabilities"].items()),
        parameters=parameters_covered(found, truth, single),
        magnitude=magnitude_covered(found, truth, single),
        error=remaining_error(found, truth, case, simulate, channels, heldout) if named and simulate else None,
        signal=signal(answer["stated"], truth, case, shots) if truth.kind == SINGLE else None,
    )


def single_ranks(found: Mapping[str, Any]) -> list[str]:
    """Single effects, the likeliest first."""
    return [one["name"] for one in found["effects"] if one["name"] not in NOT_SINGLES]


def family_rank(found: Mapping[str, Any], family: str) -> int | None:
    """Place of a family among the library's families by their probability."""
    others = (NONE, SOMETHING_ELSE, "pairs")
    ordered = sorted((name for name in found["families"] if name not in others), key=lambda n: -found["families"][n])
    return ordered.index(family) + 1 if family in ordered else None


def magnitude_covered(found: Mapping[str, Any], truth: Truth, label: str | None) -> bool | None:
    """Whether the 95 % interval holds the planted magnitude; None where there is none to hold."""
    if label is None:
        return None
    interval = next(one["interval_95"] for one in found["effects"] if one["name"] == label)
    (value,) = truth.effects.values()
    return None if interval is None else bool(interval[0] <= value <= interval[1])


def parameters_covered(found: Mapping[str, Any], truth: Truth, label: str | None) -> dict[str, bool]:
    """Identified parameter -> whether its interval holds the truth, where the answer has a fit of the true model.

    Parameters of another model than the declared one have no true value.
    """
    after = found["after"]
    state = found["before"] if truth.kind == CLEAN else after if after and after["model"] == label else None
    if state is None or truth.form != OWN:
        return {}
    return {
        name: bool(one["interval_95"][0] <= truth.parameters[name] <= one["interval_95"][1])
        for name, one in state["parameters"].items()
        if name in truth.parameters and one.get("identified", True)
    }


def remaining_error(
    found: Mapping[str, Any],
    truth: Truth,
    case: Case,
    simulate: Simulate,
    channels: Sequence[str],
    heldout: Measured | None,
) -> tuple[float, float, float] | None:
    """RMS errors of the declared model before, after, and with the true parameters and effects, in units of the noise.

    Held out: a repeat of the first shot where the truth has one, else the sensors that the record does not have, else
    a record held out. None where there is nothing, and where a simulation fails.
    """
    target = _target(truth, channels, heldout)
    after, parameters = found["after"], found["before"]["parameters"]
    if target is None or after is None or truth.form != OWN:
        return None
    time, curves = target
    one = next(entry for entry in found["effects"] if entry["name"] == after["model"])
    fitted = {name: entry["value"] for name, entry in parameters.items()}
    corrected = {name: entry["value"] for name, entry in after["parameters"].items()}
    try:
        cases = {
            "before": case.with_values(fitted),
            "after": with_effects_of(case.with_values(corrected), {one["name"]: one["magnitude"]}, SHOTS[0]),
            "oracle": with_effects_of(case.with_values(truth.parameters), truth.effects, SHOTS[0]),
        }
        histories = simulate(cases)
    except (UserError, RunFailed):
        return None
    if any(label not in histories for label in cases):
        return None
    errors = [_rms(histories[label], time, curves, case) for label in cases]
    return errors[0], errors[1], errors[2]


def _target(
    truth: Truth, channels: Sequence[str], heldout: Measured | None
) -> tuple[Array, Mapping[str, Array]] | None:
    """Clock and curves that nothing was fitted to."""
    if HELDOUT in truth.curves:
        return truth.time, truth.curves[HELDOUT]
    others = {name: v for name, v in truth.curves.get(SHOTS[0], {}).items() if name not in channels}
    if others:
        return truth.time, others
    return None if heldout is None else (heldout.time, heldout.channels)


def _rms(histories: Histories, time: Array, curves: Mapping[str, Array], case: Case) -> float:
    """Of all sensors, from contact on, each in units of its noise (without one: of 1 % of its peak)."""
    of = (time >= 0.0) & (time <= case.time.end)
    parts = []
    for name, values in curves.items():
        scale = case.sensors[name].noise or 0.01 * float(np.nanmax(np.abs(values)))
        off = np.interp(time[of], histories.time, histories.channels[name]) - values[of]
        parts.append(np.nanmean((off / scale) ** 2))
    return float(np.sqrt(np.mean(parts)))


def signal(stated: Mapping[str, Any], truth: Truth, case: Case, shots: int) -> float | None:
    """The effect's change in the record, whitened, less what the parameters imitate; None without paired simulations.

    An effect of one shot is in that shot alone; a change of the rig and a fault of a sensor are in every shot.
    """
    if WITHOUT not in truth.curves or SHOTS[0] not in stated:
        return None
    changed, slopes, factors = [], [], []
    for shot in list(stated)[:shots]:
        acts = any(label.partition("@")[2] in ("", shot) for label in truth.effects)
        part, own = [], []
        for name, one in stated[shot].items():
            t = np.asarray(one["time"])
            off = truth.curves[SHOTS[0]][name] - truth.curves[WITHOUT][name] if acts else np.zeros_like(truth.time)
            part.append(np.interp(t, truth.time, off))
            own.append([np.interp(t, truth.time, slope[name]) for slope in truth.slopes.values()])
            factors.append(cholesky(covariance(t, one["sigma"], one["error"], case.time.end), lower=True))
        changed += part
        slopes.append(np.concatenate([np.reshape(one, (len(truth.slopes), -1)) for one in own], axis=1))
    factor = block_diag(*factors)
    d = solve_triangular(factor, np.concatenate(changed), lower=True)
    g = solve_triangular(factor, np.concatenate(slopes, axis=1).T, lower=True)
    if g.shape[1]:
        d = d - g @ np.linalg.lstsq(g, d, rcond=None)[0]
    return float(np.linalg.norm(d))


def covariance(time: Array, sigma: Sequence[float], error: Sequence[float], end: float) -> Array:
    """White noise beside a Matern 5/2 process that has the rest of the stated variance."""
    noise, whole = np.asarray(sigma, dtype=float), np.asarray(error, dtype=float)
    rest = np.sqrt(np.maximum(whole**2 - noise**2, 0.0))
    correlation = matern52(np.abs(time[:, None] - time) / (CORRELATION * end))
    return np.diag(noise**2 + 1e-8 * whole**2) + rest[:, None] * rest * correlation
