"""Ranking by Laplace evidence, magnitudes with intervals, and what an effect does to the parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.judge import Judged
from birdstrike.inversion.diagnosis.linear import Linear
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.estimation.time_origin import NORMAL_95

SILENT = 1e-3
"""Standard errors by which a plausible size must stand out to be a signature; below it is rounding, however large."""


def stands_out(linear: Linear, effect: int) -> bool:
    """Whether the other unknowns cannot imitate an effect entirely."""
    return bool(linear.seen[effect] and linear.sizes[effect] > SILENT)


def log_evidence(fit: Fit) -> float:
    """log p(y | model) up to what all share: -|r|^2/2 - b^2/2 - log det(A^T A + prior of b)/2 - log |Sigma|/2.

    A holds the unknowns at a bound too. Prior of b: N(0, 1) in plausible sizes, half-normal (twice as dense) for a
    one-sided effect; at b = 0 only half of the peak lies inside, which takes the two back (Laplace's approximation:
    Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773, sect. 4.1). Models that a strike corrected have another Sigma.
    """
    prior = np.append(np.zeros(len(fit.x) - len(fit.own)), np.ones(len(fit.own)))
    hessian = fit.whole_design.T @ fit.whole_design + np.diag(prior)
    b, known = fit.magnitudes, [fit.problem.model.known[i] for i in fit.own]
    sides = sum(np.log(2.0) for one, size in zip(known, b, strict=True) if one.one_sided and size > 0.0)
    volume = np.linalg.slogdet(hessian)[1] + fit.problem.whitener.log_determinant
    return float(-0.5 * (fit.cost + b @ b + volume) + sides)


def magnitude(judged: Judged) -> tuple[float, tuple[float, float] | None]:
    """Magnitude of the model's first own effect in SI, with its 95 % interval inside its bounds.

    No interval where the largest magnitude that is looked at holds it: the data would have it larger.
    """
    fit = judged.fit
    known = fit.problem.model.known[fit.own[0]]
    b = float(fit.magnitudes[0])
    if fit.at_limit:
        return known.magnitude(b), None
    low, high = (float(end[0]) for end in magnitude_interval(fit, np.array([b])))
    return known.magnitude(b), (known.magnitude(low), known.magnitude(high))


def magnitude_interval(fit: Fit, b: Array) -> tuple[Array, Array]:
    """Ends (n,) of the 95 % intervals of the model's first own effect, estimated as b (n,), in plausible sizes.

    What the learnt response may be off by goes with the true magnitude, not with the estimate, which it may have made
    too small: all t with (b - t)^2 <= 1.96^2 (P + t^2 rho^2), P the estimate's variance by all else and rho^2 its
    relative one by the response (Fieller, J. R. Stat. Soc. B 16 (1954) 175). All magnitudes where the data do not tell
    the effect from nothing, or the response from none.
    """
    known, column = fit.problem.model.known[fit.own[0]], len(fit.x) - len(fit.own)
    whole = np.full(len(b), known.least), np.full(len(b), known.most)
    if not stands_out(without_own(fit), fit.own[0]):  # nothing is known of what nothing shows
        return whole
    rho = _relative(fit, known.name, column)
    kept = 1.0 - (NORMAL_95 * rho) ** 2
    if kept <= 0.0:
        return whole
    variance = max(fit.covariance()[column, column] - (float(fit.magnitudes[0]) * rho) ** 2, 0.0)
    half = NORMAL_95 * np.sqrt(kept * variance + (b * rho) ** 2) / kept
    return np.clip(b / kept - half, known.least, known.most), np.clip(b / kept + half, known.least, known.most)


def _relative(fit: Fit, name: str, column: int) -> float:
    """Standard deviation of the estimated magnitude, as a share of it, by what the learnt response may be off by."""
    model = fit.problem.model
    response = model.responses.get(name)
    if response is None or not len(response.spread):
        return 0.0
    off = fit.problem.whitener.apply(model.sample(response.spread))
    gain = fit.covariance()[column] @ fit.whole_design[: off.shape[1]].T
    return float(np.linalg.norm(off @ gain))


def parameter_intervals(fit: Fit) -> dict[str, tuple[float, tuple[float, float]]]:
    """Every parameter in SI with its 95 % interval inside the box."""
    coordinates = fit.problem.model.coordinates
    spread = NORMAL_95 * np.sqrt(np.diag(fit.covariance())[: len(fit.z)])
    low, high = (np.clip(fit.z + sign * spread, fit.box.lows, fit.box.highs) for sign in (-1.0, 1.0))
    ends = [coordinates.theta(z[None], fit.box)[0] for z in (fit.z, low, high)]
    return {
        name: (float(ends[0][i]), (float(ends[1][i]), float(ends[2][i]))) for i, name in enumerate(coordinates.names)
    }


def twins(judged: Judged, least: float = 0.9) -> dict[str, float]:
    """Effects whose signature looks like this model's own, with the cosine, all else free."""
    fit = judged.fit
    names, own = fit.problem.names, fit.own[0]
    linear = without_own(fit)
    cosines = linear.cosines()[own]
    found = {name: float(cosines[i]) for i, name in enumerate(names) if i != own and abs(cosines[i]) >= least}
    return dict(sorted(found.items(), key=lambda pair: -abs(pair[1])))


def without_own(fit: Fit) -> Linear:
    """The fit's linearisation with its own effects no longer free."""
    linear = fit.linear
    free_own = int((~fit.at_bound[len(fit.x) - len(fit.own) :]).sum()) if fit.own else 0
    design = linear.design[:, : linear.design.shape[1] - free_own]
    return replace(linear, design=design)


def biases(fit: Fit) -> Array:
    """(m, k) shift of every parameter, in shares of its range, by an effect of plausible size that no model has.

    A^+ g: what the calibration would believe.
    """
    linear = fit.linear
    free = np.flatnonzero(~fit.at_bound)
    shift = np.zeros((len(fit.x), linear.effects.shape[1]))
    shift[free] = np.linalg.pinv(linear.design) @ linear.effects
    return shift[: len(fit.z)].T
