"""Sobol indices over time: which parameter's range makes the curve vary, at each instant; by SALib on the emulator.

Saltelli et al., Computer Physics Communications 181 (2010) 259. First order: the share of the variance that goes with a
parameter alone; total: with it and all its interactions.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.surrogate.emulator import Emulator

BASE = 256
INSTANTS = 40


@dataclass(frozen=True)
class SobolIndices:
    """One channel: times (t,) [s]; sd (t,) SI of the curve over the ranges; first, total: (k, t), NaN where sd is 0."""

    times: Array
    sd: Array
    first: Array
    total: Array


def sobol_indices(
    emulator: Emulator, channel: str, instants: int = INSTANTS, seed: int = 0, base: int = BASE
) -> SobolIndices:
    """Indices of one channel, each parameter uniform over the parts of its range that the emulator covers.

    In the scale of the range: of a logarithmic one the logarithm is uniform, as its design spreads the runs.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SALib divides by a variance of 0 where nothing has moved yet
        from SALib.analyze import sobol as analyse  # with multiprocess behind it, so only who asks waits for it
        from SALib.sample import sobol as saltelli

        k = len(emulator.names)
        problem = {"num_vars": k, "names": list(emulator.names), "bounds": [[0.0, 1.0]] * k}
        unit = saltelli.sample(problem, base, calc_second_order=False, seed=seed)
        curve = emulator.channels[channel]
        times = curve.time[np.linspace(0, len(curve.time) - 1, min(instants, len(curve.time))).round().astype(int)]
        values = curve.curves(emulator.inputs(_spread(emulator, unit)), times)
        sd = values.std(axis=0)
        moving = sd > 1e-3 * sd.max()
        first, total = np.full((k, len(times)), np.nan), np.full((k, len(times)), np.nan)
        for j in np.flatnonzero(moving):
            found = analyse.analyze(problem, values[:, j], calc_second_order=False, num_resamples=2, seed=seed)
            first[:, j], total[:, j] = found["S1"], found["ST"]
    return SobolIndices(times, sd, first, total)


def _spread(emulator: Emulator, unit: Array) -> Array:
    """(n, k) SI: 0..1 spread over the parts of every range that a box of the emulator covers, end to end."""
    lows, highs = (np.array([getattr(r, end) for r in emulator.regions]) for end in ("lows", "highs"))
    low, high = lows.min(axis=0), np.maximum(highs.max(axis=0), np.nextafter(lows.min(axis=0), np.inf))
    space = ParameterSpace(emulator.names, ("",) * len(emulator.names), low, high, emulator.scales)
    begin, end, place = space.to_unit(lows), space.to_unit(highs), np.empty_like(unit)
    for i in range(unit.shape[1]):
        pieces = sorted(set(zip(begin[:, i].tolist(), end[:, i].tolist(), strict=True)))
        lengths = np.array([b - a for a, b in pieces])
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        along = unit[:, i] * ends[-1]
        j = np.clip(np.searchsorted(ends, along, side="right") - 1, 0, len(pieces) - 1)
        place[:, i] = np.array([a for a, _ in pieces])[j] + along - ends[j]
    return space.to_physical(place)
