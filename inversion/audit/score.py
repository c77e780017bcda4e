"""The score of one experiment: what the diagnosis says over many draws of the noise, against the sealed truth.

The models are refitted at the noise-free record and the draws answered by their linearisation there, in whitened rows;
the truth's curve is the solver's own, on a finer mesh, so that numerical error counts in full.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from data.histories import Array
from inversion.diagnosis.judge import Judge, Judged
from inversion.diagnosis.record import averaged
from inversion.diagnosis.refit import bounds
from inversion.diagnosis.verdict import NONE, confidence_set, verdict
from inversion.identifiability import NEWS
from inversion.time_origin import NORMAL_95

DRAWS = 200


@dataclass(frozen=True)
class Draws:
    """Answers over draws of the noise: confidence set of each; x: model -> (draws, q) refitted unknowns."""

    sets: tuple[tuple[str, ...], ...]
    unknowns: Mapping[str, Array]

    @property
    def verdicts(self) -> list[str]:
        """Verdict of each draw."""
        return [verdict(one) for one in self.sets]

    def share(self, of: Sequence[bool]) -> Array:
        """Yes and no as (draws,) figures."""
        return np.asarray(of, float)

    def holds(self, name: str) -> Array:
        """(draws,) whether a model is in the set."""
        return self.share([name in one for one in self.sets])

    def unique(self, name: str) -> Array:
        """(draws,) whether the set is this effect alone."""
        return self.share([one == (name,) for one in self.sets])

    def unique_other(self, names: Sequence[str]) -> Array:
        """(draws,) whether the set is one effect alone, and none of `names`."""
        return self.share([len(one) == 1 and one[0] not in names and one[0] != NONE for one in self.sets])


@dataclass(frozen=True)
class Noises:
    """How the noise is drawn: white of the stated level, or otherwise while the diagnosis believes the statement.

    level: factor on the stated one; rho: AR(1) correlation between raw samples; outliers: share of raw samples off by
    8 standard deviations.
    """

    level: float = 1.0
    rho: float = 0.0
    outliers: float = 0.0
    name: str = field(default="as stated")

    def draw(self, judge: Judge, draws: int, seed: int) -> Array:
        """(draws, n) on the record's points."""
        rng = np.random.default_rng(seed)
        parts: list[Array] = []
        for trace in judge.record.traces:
            noise = rng.standard_normal((draws, len(trace.times)))
            if self.rho:
                noise = np.asarray(
                    lfilter([np.sqrt(1.0 - self.rho**2)], [1.0, -self.rho], noise, axis=1), dtype=np.float64
                )
            hit = rng.random(noise.shape) < self.outliers
            noise = noise + 8.0 * hit * rng.choice([-1.0, 1.0], noise.shape)
            parts.append(averaged(self.level * trace.noise.level * noise, trace.block))
        return np.hstack(parts)


def answer(models: Mapping[str, Judged], noise: Array, alpha: float) -> Draws:
    """Confidence sets of draws (draws, n) of the noise added to the record that the models were fitted to."""
    p: dict[str, Array] = {}
    unknowns: dict[str, Array] = {}
    for name, one in models.items():
        linear, whitener = one.fit.linear, one.fit.problem.whitener
        whitened = whitener.apply(noise)
        rows = np.hstack([whitened, np.zeros((len(noise), len(linear.residual) - whitened.shape[1]))])
        remainders = linear.remainder + linear.project(rows.T).T
        remainders = _bounded(one, remainders)
        p[name] = one.reference.p_values(remainders)
        unknowns[name] = _refitted(one, rows)
    sets = [confidence_set({n: float(v[i]) for n, v in p.items()}, alpha) for i in range(len(noise))]
    return Draws(tuple(sets), unknowns)


def _bounded(one: Judged, remainders: Array) -> Array:
    """Of an effect held at b = 0: what b > 0 explains in a draw is gone."""
    held = one.fit.linear.held
    if held is None:
        return remainders
    own = one.fit.linear.signatures[:, held]
    return remainders - np.maximum(remainders @ own, 0.0)[:, None] * own


def _refitted(one: Judged, rows: Array) -> Array:
    """(draws, q) unknowns of the linearised refit; those held by a bound stay there."""
    free = ~one.fit.at_bound
    x = np.tile(one.fit.x, (len(rows), 1))
    x[:, free] += rows @ np.linalg.pinv(one.fit.linear.design).T
    return x


def covered(judge: Judge, one: Judged, draws: Draws, parameters: Mapping[str, float], b: float) -> dict[str, Array]:
    """(draws,) whether the 95 % interval holds the truth: of identified parameters, and of the effect as `b`."""
    fit, coordinates = one.fit, judge.groundwork.coordinates
    spread = NORMAL_95 * np.sqrt(np.diag(fit.covariance()))
    least, most = bounds(fit.problem, fit.own, fit.box)
    x = np.clip(draws.unknowns[one.name], least, most)
    ends = np.clip(x - spread, least, most), np.clip(x + spread, least, most)
    low, high = judge.groundwork.dataset.lows, judge.groundwork.dataset.highs
    prior = coordinates.prior_width()
    found: dict[str, Array] = {}
    for i, name in enumerate(coordinates.names):
        if name in parameters and 2.0 * spread[i] < NEWS * prior[i]:
            found[name] = _holds(ends, i, (parameters[name] - low[i]) / (high[i] - low[i]))
    if fit.own:
        found["b"] = _holds(ends, -1, b)
    return found


def _holds(ends: tuple[Array, Array], i: int, truth: float) -> Array:
    """(draws,) whether an unknown's interval holds the truth, up to rounding at a bound."""
    return ((ends[0][:, i] <= truth + 1e-9) & (truth <= ends[1][:, i] + 1e-9)).astype(float)


def signal(judge: Judge, base: Judged, name: str, b: float) -> float:
    """|P_0 g b|: standard errors by which the planted effect stands out of the model without it."""
    fit = base.fit
    index = fit.problem.index(name)
    acting = fit.b.copy()
    acting[index] += b
    place = replace(fit.place, b=acting[None])
    change = fit.problem.model.points(place, fit.box)[0] - fit.curve
    rows = np.concatenate(
        [fit.problem.whitener.apply(change), np.zeros(fit.linear.design.shape[0] - int(judge.used.sum()))]
    )
    return float(np.linalg.norm(fit.linear.project(rows)))


def at_signal(judge: Judge, base: Judged, name: str, b: float, wanted: float, alpha: float, seed: int) -> Array | None:
    """(draws,) whether none is rejected when the measurement noise is scaled until the effect stands out by `wanted`.

    None where no scale from 1/30 to 30 does it, because numerical error sets the limit.
    """
    low, high = np.log(1.0 / 30.0), np.log(30.0)
    if (
        not _scaled_signal(judge, base, name, b, np.exp(high))
        < wanted
        < _scaled_signal(judge, base, name, b, np.exp(low))
    ):
        return None
    for _ in range(12):
        middle = 0.5 * (low + high)
        above = _scaled_signal(judge, base, name, b, np.exp(middle)) > wanted
        low, high = (middle, high) if above else (low, middle)
    scale = float(np.exp(low))
    rescaled = replace(judge, measurement=scale**2 * judge.measurement)
    fit = rescaled.start()[0]
    one = rescaled.judged(NONE, fit)
    noise = scale * Noises().draw(judge, DRAWS, seed)
    draws = answer({NONE: one}, noise, alpha)
    return 1.0 - draws.holds(NONE)


def _scaled_signal(judge: Judge, base: Judged, name: str, b: float, scale: float) -> float:
    """Signal at another noise level, at the same fit."""
    from inversion.diagnosis.groundwork import emulator_error

    rescaled = replace(judge, measurement=scale**2 * judge.measurement)
    whitener = rescaled.whitener(emulator_error(base.fit.problem.model, base.fit.theta))
    fit = replace(base.fit, problem=replace(base.fit.problem, whitener=whitener))
    return signal(rescaled, Judged(base.name, fit, base.reference, base.consistency, False), name, b)
