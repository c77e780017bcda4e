"""What the discretisation does to the curves: bias directions and scatter, as a covariance of the model's error.

Each numerical choice (resolution of bird and plate, lattice, artificial viscosity, smoothing length; the contact's gap
goes with the particle spacing) is changed once, and the change d of the curves enters as d d^T: a direction that no
effect may claim for itself. What a change leaves beyond the span of the others is rough and short-lived; its size and
its correlation time give the rest of the covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from data.errors import CaseError
from data.histories import Array
from doe.deck import no_place
from solver.case import Case
from solver.case_overlay import Raw, overlay

FINER, WIDER = 2.0, 1.5  # particles, shells a side
SEEDS = (11, 12)
JITTER = 0.1  # of the spacing
UNSEEN = 2.0
"""A bias direction's standard deviation in units of the change that was seen: twice the particles lower the spacing by
a fifth, so that what a finer mesh still would change may be as large again and more (first order: 4.8 times in all)."""
OVERFITTED = 2.0
"""Factor on the rest: as many changes as the smooth part has dimensions leave too little of each other. Strikes on
finer meshes at other parameters left about twice as much (16 of them, apart from the shipped experiments)."""
DRAWN = "lattice jitter"


@dataclass(frozen=True)
class Choice:
    """One numerical choice changed: its name for the user, the keys that change it; scatter: one of several draws."""

    name: str
    changes: Raw
    scatter: bool = False


def choices(case: Case) -> tuple[Choice, ...]:
    """The choices that are changed for a case, one strike each.

    How a lattice comes to lie in the bird's outline and on the plate changes with every number of particles, finer or
    coarser: several numbers stand for that draw.
    """
    shells = {"elements": [max(2, round(WIDER * n)) for n in case.plate.elements]}
    many = _particles(case, FINER)
    shock = {"shock_linear": 0.5 * case.solver.shock_linear, "shock_quadratic": 0.5 * case.solver.shock_quadratic}
    found = [
        Choice("finer bird", {"bird": {"particles": many}}),
        Choice("artificial viscosity halved", {"solver": shock}),
    ]
    if not case.plate.rigid:
        found.append(Choice("finer plate", {"plate": shells}))
    if case.bird.method != "sph":
        between = Choice("bird between", {"bird": {"particles": _particles(case, 1.5)}})
        return (*found, between, Choice("finer bird and plate", {"plate": shells, "bird": {"particles": many}}))
    other = {"lattice": "cubic" if case.bird.lattice == "fcc" else "fcc"}
    finest = {
        "bird": {**other, "particles": _particles(case, 1.25 * FINER), "jitter": JITTER, "seed": 1},
        "plate": shells,
    }
    found += [
        Choice(f"{share:g} x the particles", {"bird": {"particles": _particles(case, share)}}) for share in (0.8, 1.3)
    ]
    found += [
        Choice(f"other lattice, {share:g} x the particles", {"bird": {**other, "particles": _particles(case, share)}})
        for share in (0.8, 1.0, 1.3, FINER)
    ]
    found += [
        Choice("other lattice, disturbed, finer bird and plate", finest),
        Choice("smoothing length", {"solver": {"smoothing": min(1.1 * case.solver.smoothing, 2.5)}}),
    ]
    return (*found, *(Choice(f"{DRAWN} {s}", {"bird": {"jitter": JITTER, "seed": s}}, True) for s in SEEDS))


def _particles(case: Case, share: float) -> int:
    return min(max(round(share * case.bird.particles), 100), 200_000)


def variants(case: Case, theta: Mapping[str, float]) -> dict[str, Case]:
    """The case at theta with each choice changed, by the choice's name; those that cannot be built are left out.

    So are those for which an external solver's deck has no place.
    """
    from solver.case import case_from_table

    base = case.with_values(theta)
    cases: dict[str, Case] = {}
    for choice in choices(case):
        try:
            changed = case_from_table(overlay(base._raw, choice.changes), base.name)
        except CaseError:
            continue
        if not no_place(base, changed):
            cases[choice.name] = changed
    return cases


@dataclass(frozen=True)
class Numerical:
    """Covariance of the model's numerical error on its clock, all channels stacked (grid,).

    directions: name -> change d (grid,) of the curves; scatter: (grid,) standard deviation of the rough rest;
    correlation: per channel, its correlation time [s].
    """

    directions: Mapping[str, Array]
    scatter: Array
    correlation: tuple[float, ...]

    @classmethod
    def of(cls, changes: Mapping[str, Array], case: Case, time: Array, channels: int) -> Numerical:
        """From the changes d (grid,) of the curves by choice."""
        if not changes:
            grid = channels * len(time)
            return cls({}, np.zeros(grid), (float(time[1] - time[0]),) * channels)
        draws = [choice.name for choice in choices(case) if choice.scatter and choice.name in changes]
        rest = np.stack([_beyond(name, changes) for name in changes])
        parts = np.split(rest, channels, axis=1)
        step = float(time[1] - time[0])
        scatter = OVERFITTED * np.concatenate([_envelope(part) for part in parts])
        correlation = tuple(_correlation_time(part, step) for part in parts)
        scale = {name: 1.0 / np.sqrt(len(draws)) if name in draws else 1.0 for name in changes}
        return cls({name: scale[name] * d for name, d in changes.items()}, scatter, correlation)

    def jitter_size(self, channels: int) -> tuple[float, ...]:
        """RMS of one run's own scatter, per channel."""
        draws = [d for name, d in self.directions.items() if name.startswith(DRAWN)]
        square = self.scatter**2 + sum((d**2 for d in draws), np.zeros_like(self.scatter))
        return tuple(float(np.sqrt(part.mean())) for part in np.split(square, channels))

    def jitter(self, sample: Callable[[Array], Array], times: Array, channel: np.ndarray) -> Array:
        """(n, n) of one run's own scatter: the rough rest and the draws of the lattice."""
        size = sample(self.scatter[None])[0]
        length = np.asarray(self.correlation)[channel]
        near = (channel[:, None] == channel) * np.exp(-0.5 * ((times[:, None] - times) / length) ** 2)
        rough = size[:, None] * near * size
        draws = [d for name, d in self.directions.items() if name.startswith(DRAWN)]
        return rough + _outer(sample, draws)

    def covariance(self, sample: Callable[[Array], Array], times: Array, channel: np.ndarray) -> Array:
        """(n, n) on the record's points; sample: curves (q, grid) to points (q, n); channel: of every point."""
        biases = [UNSEEN * d for name, d in self.directions.items() if not name.startswith(DRAWN)]
        return self.jitter(sample, times, channel) + _outer(sample, biases)


def _outer(sample: Callable[[Array], Array], directions: list[Array]) -> Array:
    """Sum of d d^T on the record's points."""
    if not directions:
        return np.zeros(())
    d = sample(np.stack(directions))
    return d.T @ d


def _beyond(name: str, changes: Mapping[str, Array]) -> Array:
    """What of a change the other changes do not span."""
    others = np.stack([d for other, d in changes.items() if other != name], axis=1) if len(changes) > 1 else None
    d = changes[name]
    if others is None:
        return d
    return d - others @ np.linalg.lstsq(others, d, rcond=1e-8)[0]


def _envelope(rest: Array) -> Array:
    """(m,) root mean square over the changes (c, m), smoothed over a twentieth of the record; each lost a freedom."""
    mean = uniform_filter1d((rest**2).mean(axis=0), max(3, rest.shape[1] // 20), mode="nearest")
    return np.sqrt(mean)


def _correlation_time(rest: Array, step: float) -> float:
    """Length l [s] of exp(-lag^2 / 2 l^2) that has the rest's lag-1 and lag-2 correlation."""
    total = float((rest**2).sum())
    if total == 0.0:
        return step
    rho = max(float((rest[:, 2:] * rest[:, :-2]).sum()) / total, 0.05)
    return 2.0 * step / np.sqrt(-2.0 * np.log(min(rho, 0.995)))
