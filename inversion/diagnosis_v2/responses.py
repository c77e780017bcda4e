"""Responses of the curves to effects of the solver, with what is not known of them.

change(b) = h(b) S on the grid, b the magnitude in plausible sizes. Two-sided effects: h(b) = b, S by regression of half
differences of folded-over pairs. One-sided ones: S through the largest magnitude, h from two magnitudes, so that an
effect that saturates (a clamp that lets go) does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from data.histories import Array
from inversion.diagnosis_v2.plan import ONE_SIDED, WIDEST, Known, Plan, level

LEAST_SPREAD = 0.02  # share of a signature: two points cannot tell a smaller change from place to place
INDEPENDENT = 10.0  # instants of a record whose scatter is independent (emulator's components with weight)
LARGEST_WARP, LEAST_WARP = 2.5, 0.5  # of the ratio of secants at 1 and 3 sizes: beyond, it is scatter or another law


@dataclass(frozen=True)
class Response:
    """One effect's response.

    signature: (grid,) SI for one plausible size (h = 1); warp: secant at 1 size over secant at 3 (1: linear); scatter:
    variance of the signature from the particles' scatter, in units of a single run's; spread: (channels,) share of the signature by which
    it changes with parameters, other effects and mesh (1 standard deviation).
    """

    known: Known
    signature: Array
    warp: float
    scatter: float
    spread: Array

    def h(self, b: float) -> float:
        """Size of the response over that of one linear size; h(3) = 3."""
        if self.warp <= 1.0:
            return b * (self.warp + (1.0 - self.warp) * b / 3.0)
        b0 = (3.0 - self.warp) / (self.warp - 1.0)
        return b * (1.0 + 3.0 / b0) / (1.0 + b / b0)

    def b(self, h: float) -> float:
        """The magnitude in plausible sizes of a response of size h; infinite beyond what the effect can do."""
        r = self.warp
        if r == 1.0:
            return h
        if r < 1.0:
            curvature = (1.0 - r) / 3.0
            return float((np.sqrt(max(r * r + 4.0 * curvature * h, 0.0)) - r) / (2.0 * curvature))
        b0 = (3.0 - r) / (r - 1.0)
        left = 1.0 + 3.0 / b0 - h / b0
        return float(h / left) if left > 0.0 else np.inf

    @property
    def limits(self) -> tuple[float, float]:
        """h of the smallest and the largest magnitude that are looked for."""
        return (0.0 if self.known.one_sided else self.known.least), self.h(WIDEST)

    def spread_more(self, share: Array) -> Response:
        """With a further, independent spread (channels,)."""
        return replace(self, spread=np.sqrt(self.spread**2 + share**2))


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
        known.name: Response(known, slope, 1.0, 0.5 * float(own), spread)
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
    off = 0.5 * (far[0] - far[-1])  # of two: the standard error of their mean
    spread = np.maximum(_relative(off**2, signature**2, scatter * rough), LEAST_SPREAD)
    return Response(known, signature, warp, scatter, spread)


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
