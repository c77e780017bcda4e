"""How far a planted effect stands out, and how often the model without effects is then rejected.

Two signals: |P_0 g b| by the learnt response, which is what the diagnosis itself can promise; and |P_0 r|, what the
noise-free record itself shows beyond the model without effects, the error of the mesh included.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.verdict import NONE
from scipy.optimize import brentq

from birdstrike.data.histories import Array
from birdstrike.inversion.audit.carried import covariance_of
from birdstrike.inversion.audit.draws import Noises, answer
from birdstrike.inversion.diagnosis.ranking import Fit, again

SIGNALS = (2.0, 3.0, 4.0, 5.0, 6.0)
FARTHEST = np.log(30.0)  # of the factor on the measurement noise


@dataclass(frozen=True)
class Power:
    """At a signal: factor on the noise that makes it, what the record itself shows there, and (draws,) rejected.

    along: how much of what is shown lies along the learnt signature of one effect, the best: sqrt(S) without noise.
    """

    signal: float
    scale: float
    shown: float
    along: float
    rejected: Array


def signal(fit: Fit, name: str, b: float) -> float:
    """|P_0 g b|: standard errors by which the effect, as learnt, stands out of the model without it."""
    acting = fit.b.copy()
    acting[fit.problem.index(name)] += b
    change = fit.problem.model.points(replace(fit.place, b=acting[None]), fit.box)[0] - fit.curve
    rows = fit.problem.whitener.apply(change)
    priors = np.zeros(len(fit.linear.residual) - len(rows))
    return float(np.linalg.norm(fit.linear.project(np.concatenate([rows, priors]))))


def shown(fit: Fit) -> float:
    """|P_0 r|: standard errors by which the record to which it was fitted misses the model without effects."""
    return float(np.linalg.norm(fit.linear.remainder))


def along(base: Judged) -> float:
    """sqrt(S): the same along the best effect's learnt signature."""
    return float(np.sqrt(max(base.consistency.directed, 0.0)))


@dataclass(frozen=True)
class Rescaled:
    """The model without effects at the noise-free record, with the measurement noise at any level.

    rest: (n, n) of Sigma that is not measurement noise; name, b: the planted effect.
    """

    judge: Judge
    base: Fit
    rest: Array
    name: str
    b: float

    @classmethod
    def of(cls, judge: Judge, base: Judged, name: str, b: float) -> Rescaled:
        """From the fit at the stated noise."""
        return cls(judge, base.fit, covariance_of(base.fit.problem.whitener) - judge.measurement, name, b)

    def fit(self, scale: float) -> Fit:
        """Made again with `scale` times the noise: Sigma changes, hence the fit."""
        whitener = Whitener.of(self.rest + scale**2 * self.judge.measurement)
        return again(self.base, replace(self.base.problem, whitener=whitener))

    def log_signal(self, log_scale: float) -> float:
        """Logarithm of the signal at a level."""
        return float(np.log(max(signal(self.fit(float(np.exp(log_scale))), self.name, self.b), 1e-12)))

    def scale(self, wanted: float) -> float | None:
        """Level that makes the signal the wanted one, None where none from 1/30 to 30 does."""

        def off(log_scale: float) -> float:
            return self.log_signal(log_scale) - np.log(wanted)

        if off(-FARTHEST) <= 0.0 or off(FARTHEST) >= 0.0:
            return None
        return float(np.exp(brentq(off, -FARTHEST, FARTHEST, xtol=0.01)))  # pyright: ignore[reportArgumentType, reportCallIssue]

    def power(self, wanted: float, scale: float, alpha: float, draws: int, seed: int) -> Power:
        """Share of draws at that level in which the model without effects is rejected."""
        fit = self.fit(scale)
        louder = replace(self.judge, measurement=scale**2 * self.judge.measurement)
        noise = scale * Noises().draw(self.judge.record.traces, draws, seed)
        base = louder.judged(NONE, fit)
        held = answer(louder, {NONE: base}, noise, alpha).holds(NONE)
        return Power(wanted, scale, shown(fit), along(base), 1.0 - held)


def power(judge: Judge, base: Judged, name: str, b: float, alpha: float, draws: int, seed: int) -> list[Power]:
    """At every signal that some level of the measurement noise reaches, numerical error staying as it is.

    judge, base: the noise-free record and the model without effects there.
    """
    rescaled = Rescaled.of(judge, base, name, b)
    scales = {wanted: rescaled.scale(wanted) for wanted in SIGNALS}
    return [rescaled.power(wanted, scale, alpha, draws, seed) for wanted, scale in scales.items() if scale is not None]
