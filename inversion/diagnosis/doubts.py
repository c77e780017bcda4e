"""Why a diagnosis should not be believed: bounds, inflated variances, a residual that is no noise, changed minds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.evidence import SILENT
from birdstrike.inversion.diagnosis.heldout import NOT_REPEATED, HeldOut
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.restrike import Struck
from birdstrike.inversion.diagnosis.verdict import ATTRIBUTED, NONE

INFLATED = 10.0
WHITE = 4.0
OFF = 1.0 / 3.0  # standard deviations by which the solver's curve may lie off the fitted one


def doubts(judge: Judge, judged: Judged, base: Judged) -> list[str]:
    """Why a fit should not be believed: bounds, inflated variances, a residual that is not the assumed noise."""
    found: list[str] = []
    names = [name.rsplit(".", 1)[-1] for name in judge.groundwork.coordinates.names]
    for name, hit, flat in zip(names, judged.fit.at_bound, judged.fit.box.flat, strict=False):
        if hit and not flat:
            found.append(f"model {judged.name}: {name} is held by an end of its range")
    if judged.fit.own and judged.fit.at_bound[-1] and judged.fit.magnitudes[-1]:
        found.append(f"model {judged.name}: its magnitude is held by the largest that was looked at")
    if judged.name != NONE:
        ratio = _inflation(judged, base)
        worst = int(np.argmax(ratio)) if len(ratio) else 0
        if len(ratio) and ratio[worst] > INFLATED:
            found.append(
                f"model {judged.name}: the effect inflates the variance of {names[worst]} {ratio[worst]:.0f} times; "
                "the two can hardly be told apart"
            )
    return found + _residual_noise(judge, judged)


def _inflation(judged: Judged, base: Judged) -> Array:
    """Variance of each parameter with the effect free over that without."""
    r = len(judged.fit.z)
    with_effect, without = np.diag(judged.fit.covariance())[:r], np.diag(base.fit.covariance())[:r]
    return np.where(without > 0.0, with_effect / np.where(without > 0.0, without, 1.0), 1.0)


def _residual_noise(judge: Judge, judged: Judged) -> list[str]:
    """The whitened residual of a model in the confidence set should be white and of size 1."""
    n = int(judge.used.sum())
    residual = judged.fit.linear.residual[:n]
    channel = judge.record.channel[judge.used]
    found: list[str] = []
    for i, trace in enumerate(judge.record.traces):
        part = residual[channel == i]
        if len(part) < 20:
            continue
        rho = float(part[1:] @ part[:-1] / (part @ part)) * np.sqrt(len(part))
        size = float((part @ part - len(part)) / np.sqrt(2.0 * len(part)))
        if abs(rho) > WHITE or abs(size) > WHITE:
            rms = np.sqrt(np.mean(part**2))
            found.append(
                f"model {judged.name}: the whitened residual of {trace.name} is not the noise that was assumed (RMS "
                f"{rms:.2f}, 1 expected; correlation of neighbours {rho / np.sqrt(len(part)):.2f}); p-values lean on it"
            )
    return found


def strayed(struck: Mapping[str, Struck], failed: Mapping[str, str]) -> list[str]:
    """Where the solver's own curve is not the fitted one."""
    return [
        f"{label}: one strike of the solver lies {one.off:.1f} standard deviations (RMS) off the fitted curve; the "
        f"error {label} is that of the strike"
        for label, one in struck.items()
        if one.off > OFF
    ] + [f"{label}: the error is the fitted one, no strike's: {reason}" for label, reason in failed.items()]


def changed_minds(held: Mapping[str, HeldOut], kind: str, chosen: Judged | None) -> list[str]:
    """Parts of the data without which the verdict is another."""
    found: list[str] = []
    for name, one in held.items():
        other = kind == ATTRIBUTED and one.chosen not in (None, chosen.name if chosen else None)
        if one.verdict not in (NOT_REPEATED, kind) or other:
            what = f"{one.verdict}{f' ({one.chosen})' if one.chosen else ''}"
            found.append(f"without the held-out {name.replace('_', ' ')} the verdict is {what}")
    return found


def unheard(base: Judged) -> list[str]:
    """Effects that this strike does not feel."""
    sizes = np.linalg.norm(base.fit.linear.effects, axis=0)
    names = [n for n, size in zip(base.fit.problem.names, sizes, strict=True) if size < SILENT]
    return [f"at a plausible size these change nothing in this strike: {', '.join(names)}"] if names else []
