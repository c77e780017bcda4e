"""Responses of the curves to effects of the solver, with what is not known of them.

change(b) = h(b) S on the grid, b the magnitude in plausible sizes. Two-sided effects: h(b) = b, S by regression of half
differences of folded-over pairs. One-sided ones: S through the largest magnitude, h from two magnitudes, so that an
effect that saturates (a clamp that lets go) does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis_v2.plan import ONE_SIDED, WIDEST, Known, Plan, level

LEAST_SPREAD = 0.02  # share of a signature: two points cannot tell a smaller change from place to place
INDEPENDENT = 10.0  # instants of a record whose scatter is independent (emulator's components with weight)
LARGEST_WARP, LEAST_WARP = 2.5, 0.5  # of the ratio of secants at 1 and 3 sizes: beyond, it is scatter or another law


@dataclass(frozen=True)
class Response:
    """One effect's response.

    signature: (grid,) SI for h = 1; knots: magnitude in plausible sizes -> size h of the response, both increasing, linear
    between; scatter: variance of the signature from the particles' scatter, in units of a single run's; spread:
    (channels,) share of the signature by which it changes with parameters, other effects and mesh (1 standard deviation).
    """

    known: Known
    signature: Array
    knots: tuple[tuple[float, float], ...]
    scatter: float
    spread: Array

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


LINEAR = ((-WIDEST, -WIDEST), (WIDEST, WIDEST))


def bent(ratio: float) -> tuple[tuple[float, float], ...]:
    """Knots of a one-sided response whose secant at 1 size is `ratio` times that at 3.

    Saturating as b / (1 + b / b0) for a ratio above 1, as compliances do; quadratic below.
    """
    b = np.linspace(0.0, WIDEST, 11)
    if ratio <= 1.0:
        h = b * (ratio + (1.0 - ratio) * b / 3.0)
    else:
        b0 = (3.0 - ratio) / (ratio - 1.0)
        h = b * (1.0 + 3.0 / b0) / (1.0 + b / b0)
    return tuple(zip(map(float, b), map(float, h), strict=True))


def updated(response: Response, b: float, change: Array, rough: Array, replicates: int) -> Response:
    """The response after solver runs with and without b sizes of it at the place where it matters.

    change: (grid,) mean difference of the runs; rough: (channels,) variance of a run's scatter. What the runs show is
    followed by its share of certainty: doubt of the signature over doubt and the runs' scatter, channel by channel.
    """
    old, channels = response.signature, len(rough)
    weigh = 1.0 / np.repeat(np.maximum(rough, 1e-300), len(old) // channels)
    power = float((weigh * old) @ old)
    if not power:
        return response
    h = float((weigh * change) @ old) / power
    if abs(h) < 1e-3 or np.sign(h) != np.sign(b):
        return response
    parts, spread = [], response.spread.copy()
    for i, (part, new) in enumerate(zip(np.split(old, channels), np.split(change / h, channels), strict=True)):
        noise = 2.0 * rough[i] / (h * h * replicates)
        known = response.spread[i] ** 2 * float((part**2).mean()) + response.scatter * rough[i]
        seen = float(((new - part) ** 2).mean()) - noise
        doubt = max(known, seen, 0.0)
        weight = doubt / max(doubt + noise, 1e-300)
        parts.append(part + weight * (new - part))
        spread[i] = max(np.sqrt(1.0 - weight) * response.spread[i], LEAST_SPREAD)
    return replace(response, signature=np.concatenate(parts), knots=_with_knot(response, b, h), spread=spread)


def _with_knot(response: Response, b: float, h: float) -> tuple[tuple[float, float], ...]:
    """The knots with what the runs showed at b: nearer ones are scaled to it, farther ones continue from there."""
    expected = response.h(b)
    ratio = h / expected if expected else 1.0
    knots = {x: y * (1.0 + (ratio - 1.0) * min(abs(x / b), 1.0) * (x * b > 0)) for x, y in response.knots if abs(x) < abs(b)}
    far = {x: y + (h - expected) for x, y in response.knots if abs(x) > abs(b) and x * b > 0}
    other = {x: y for x, y in response.knots if abs(x) >= abs(b) and x * b <= 0}
    found = sorted({**knots, **far, **other, b: h}.items())
    kept = [found[0]]
    for x, y in found[1:]:
        if y > kept[-1][1] + 1e-6 and x > kept[-1][0] + 1e-9:
            kept.append((x, y))
    return tuple(kept)


def learn_responses(
    plan: Plan, stacks: Mapping[str, Array], rough: Array
) -> tuple[dict[str, Response], dict[str, str]]:
    """Every effect's response, and why the others have none.

    stacks: (grid,) curves by label; rough: (channels,) variance by which a run leaves what is smooth in its inputs.
    """
    two, lost = _two_sided(plan, stacks, rough)
    found = dict(two)
    for known in plan.one_sided:
        response = _one_sided(plan, known, stacks, rough)
        if response is None:
            lost[known.name] = "its simulations failed"
        else:
            found[known.name] = response
    return {known.name: found[known.name] for known in plan.known if known.name in found}, lost


def _two_sided(
    plan: Plan, stacks: Mapping[str, Array], rough: Array
) -> tuple[dict[str, Response], dict[str, str]]:
    """Least squares of half differences (pairs, grid) on the design, its residual for what is not linear."""
    kept = [i for i in range(len(plan.signs)) if all(f"pair {i} {s:+d}" in stacks for s in (1, -1))]
    effects = plan.two_sided
    if len(kept) <= len(effects):
        return {}, {known.name: "its simulations failed" for known in effects}
    half = np.array([0.5 * (stacks[f"pair {i} +1"] - stacks[f"pair {i} -1"]) for i in kept])
    x = plan.signs[kept] * [level(known) for known in effects]
    slopes = np.linalg.lstsq(x, half, rcond=None)[0]
    freedom = len(kept) - len(effects)
    residual = half - x @ slopes
    spread = _relative((residual**2).sum(axis=0) / freedom, ((x @ slopes) ** 2).mean(axis=0), 0.5 * rough)
    inverse = np.diag(np.linalg.inv(x.T @ x))
    found = {
        known.name: Response(known, slope, LINEAR, 0.5 * float(own), spread)
        for known, slope, own in zip(effects, slopes, inverse, strict=True)
    }
    return found, {}


def _relative(left: Array, held: Array, rough: Array) -> Array:
    """(channels,) RMS of what the linear model leaves beyond the runs' own scatter, over RMS of what it holds.

    left, held: (grid,) mean squares; rough: (channels,) variance of the scatter in what is left.
    """
    off = [max(float(part.mean()) - own, 0.0) for part, own in zip(np.split(left, len(rough)), rough, strict=True)]
    size = [float(part.mean()) for part in np.split(held, len(rough))]
    return np.sqrt(np.array(off) / np.maximum(size, 1e-300))


def _one_sided(plan: Plan, known: Known, stacks: Mapping[str, Array], rough: Array) -> Response | None:
    """Through runs at 1 and 3 sizes at one point, and at 3 sizes at another."""
    changes = {
        (b, point): stacks[label] - stacks[base]
        for b, point in ONE_SIDED
        if (label := f"{known.name} {b:g} {point}") in stacks
        and (base := f"coarse {plan.near_centre(point)}") in stacks
    }
    far = [change / 3.0 for (b, _), change in changes.items() if b == 3.0]
    if not far:
        return None
    signature = np.mean(far, axis=0)
    near, reference = changes.get((1.0, 0)), changes.get((3.0, 0))
    warp = 1.0 if near is None or reference is None else _warp(near, reference / 3.0, rough)
    scatter = 2.0 / 9.0 / len(far)  # of a difference of two runs over three sizes, averaged
    off = np.var(far, axis=0, ddof=1) if len(far) > 1 else np.zeros_like(signature)  # at another place
    spread = np.maximum(_relative(off, signature**2, 2.0 / 9.0 * rough), LEAST_SPREAD)
    return Response(known, signature, bent(warp), scatter, spread)


def _warp(near: Array, far: Array, rough: Array) -> float:
    """Ratio of the secants at 1 and 3 sizes, channels weighed by their scatter, shrunk by what scatter makes of it."""
    weight = 1.0 / np.repeat(np.maximum(rough, 1e-300), len(far) // len(rough))
    power = float((weight * far) @ far)
    if not power:
        return 1.0
    excess = float((weight * near) @ far) / power - 1.0
    scatter = 2.0 * len(far) / power / INDEPENDENT
    share = max(0.0, 1.0 - scatter / excess**2) if excess else 0.0  # James & Stein, Berkeley Symp. 4 (1961) 361
    return float(np.clip(1.0 + share * excess, LEAST_WARP, LARGEST_WARP))
