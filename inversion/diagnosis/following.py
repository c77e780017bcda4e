"""How far an estimate follows what a single, rough strike says of it."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array

REFUTED = 4.0  # times the expected square: a difference that the errors stated do not allow


def followed(known: Array, rough: Array, off: Array, channels: int) -> Array:
    """(grid,) by how much an estimate of variance `known` follows a strike that differs by `off`, as rough as `rough`.

    The usual weight known / (known + rough); but a difference beyond twice what both allow shows that `known` is too
    small, and is followed as far as it stands above the roughness. One weight a channel.
    """
    weights: list[Array] = []
    for one, own, seen in zip(*(np.split(part, channels) for part in (known, rough, off)), strict=True):
        expected, found, quiet = one.mean() + own.mean(), float(np.mean(seen**2)), own.mean()
        weight = 1.0 - quiet / found if found > REFUTED * expected else one.mean() / max(expected, 1e-300)
        weights.append(np.full(len(seen), weight))
    return np.concatenate(weights)


def by_channel(values: Array, channels: int) -> Array:
    """(grid,) the mean of values (grid,) over every channel."""
    return np.concatenate([np.full(len(part), part.mean()) for part in np.split(values, channels)])
