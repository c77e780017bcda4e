"""Responses of the curves to effects of the solver, learnt from the two-level design, with what is not known of them.

change(b) = h(b) S on the grid, b the magnitude in plausible sizes. S is the least-squares slope of the half differences
of folded-over pairs; what the regression leaves, spread by its covariance, is the uncertainty of S (Box, Hunter & Hunter,
Statistics for Experimenters, 2nd ed. 2005, ch. 6 and 10). h(b) = b until simulations elsewhere show that the response
bends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.plan import WIDEST, Known, Plan, slope

LINEAR = ((-WIDEST, -WIDEST), (WIDEST, WIDEST))
FEWEST_LEFT = 3  # degrees of freedom that the regression must leave


@dataclass(frozen=True)
class Response:
    """One effect's response.

    signature: (grid,) SI for h = 1; doubt: (q, grid) directions of its error, one standard deviation each, for h = 1;
    knots: magnitude in plausible sizes -> size h of the response, both increasing, linear between; reach: plausible
    sizes up to which it was simulated.
    """

    known: Known
    signature: Array
    doubt: Array
    knots: tuple[tuple[float, float], ...] = LINEAR
    reach: float = 1.0

    def h(self, b: float) -> float:
        """Size of the response of a magnitude in plausible sizes."""
        return _through(b, *zip(*self.knots, strict=True))

    def b(self, h: float) -> float:
        """The magnitude in plausible sizes of a response of size h."""
        magnitudes, sizes = zip(*self.knots, strict=True)
        return _through(h, sizes, magnitudes)

    @property
    def limits(self) -> tuple[float, float]:
        """h of the smallest and the largest magnitude that are looked for."""
        return (0.0 if self.known.one_sided else self.h(self.known.least)), self.knots[-1][1]


def _through(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Piecewise linear through increasing knots, the last pieces continued."""
    i = int(np.clip(np.searchsorted(xs, x) - 1, 0, len(xs) - 2))
    return float(ys[i] + (x - xs[i]) * (ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i]))


def learn_responses(plan: Plan, stacks: Mapping[str, Array]) -> tuple[dict[str, Response], dict[str, str]]:
    """Every effect's response, and why the others have none; stacks: (grid,) curves by label."""
    kept = [i for i in range(len(plan.signs)) if all(f"pair {i} {s:+d}" in stacks for s in (1, -1))]
    freedom = len(kept) - len(plan.known)
    if freedom < FEWEST_LEFT:
        return {}, {known.name: "its simulations failed" for known in plan.known}
    half = np.array([0.5 * (stacks[f"pair {i} +1"] - stacks[f"pair {i} -1"]) for i in kept])
    x = plan.signs[kept] * [slope(known) for known in plan.known]
    signatures = np.linalg.lstsq(x, half, rcond=None)[0]
    left = np.linalg.svd(half - x @ signatures, full_matrices=False)
    directions = (left[1][:freedom, None] * left[2][:freedom]) / np.sqrt(freedom)
    spread = np.sqrt(np.diag(np.linalg.inv(x.T @ x)))
    return {
        known.name: Response(known, signature, own * directions, reach=2.0 * slope(known) if known.one_sided else slope(known))
        for known, signature, own in zip(plan.known, signatures, spread, strict=True)
    }, {}


def updated(response: Response, b: float, changes: Array) -> Response:
    """The response after simulations with and without b sizes of it where it matters; changes: (pairs, grid).

    The signature follows them as far as they are surer than the regression: the mean of both, weighed by their variances,
    the scatter of the changes told by all pairs together.
    """
    change, count = changes.mean(axis=0), len(changes)
    weight = 1.0 / np.maximum(_variance(response.doubt, changes), 1e-300)
    power = float((weight * response.signature) @ response.signature)
    h = float((weight * change) @ response.signature) / power if power else 0.0
    if abs(h) < 1e-3 or np.sign(h) != np.sign(b):
        return response
    left = (changes - change) / (h * np.sqrt(max(count - 1.0, 1.0) * count))
    return replace(response, signature=change / h, doubt=left, knots=_with_knot(response, b, h), reach=max(response.reach, abs(b)))


def _variance(doubt: Array, changes: Array) -> Array:
    """(grid,) variance of a signature's points, equal within a channel's neighbourhood: the mean of both sources."""
    return (doubt**2).sum(axis=0) + changes.var(axis=0)


def _with_knot(response: Response, b: float, h: float) -> tuple[tuple[float, float], ...]:
    """The knots with what the simulations showed at b: nearer ones are scaled to it, farther ones continue from there."""
    expected = response.h(b)
    ratio = h / expected if expected else 1.0
    knots = {x: y * (1.0 + (ratio - 1.0) * min(abs(x / b), 1.0) * (x * b > 0)) for x, y in response.knots if abs(x) < abs(b)}
    far = {x: y + (h - expected) for x, y in response.knots if abs(x) > abs(b) and x * b > 0}
    other = {x: y for x, y in response.knots if abs(x) >= abs(b) and x * b <= 0}
    found = sorted({**knots, **far, **other, 0.0: 0.0, b: h}.items())
    kept = [found[0]]
    for x, y in found[1:]:
        if y > kept[-1][1] + 1e-6 and x > kept[-1][0] + 1e-9:
            kept.append((x, y))
    return tuple(kept)
