"""What a model of the diagnosis does not know of the solver: errors of emulator and responses, a strike's roughness."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.following import followed
from birdstrike.inversion.diagnosis.model import Model


def emulator_error(model: Model, theta: Array, b: Array) -> Array:
    """(n, n) covariance of the emulator's error at theta (k,) on the record's points, read through effects b (m,).

    What a new run has beyond all components is taken whole at every point: means over a block do not lower it, because
    how it hangs together between neighbours is not known.
    """
    u = model.emulator.inputs(theta[None])[0]
    emulators = [model.emulator.channels[c] for c in model.clock.channels]
    factor = model.through(np.asarray(block_diag(*(e.error_factor(u, model.clock.time) for e in emulators))).T, b)
    outside = np.concatenate([e.outside_at(model.clock.time) for e in emulators])
    return factor.T @ factor + np.diag(np.maximum(model.through(outside[None], b)[0], 0.0))


def response_error(model: Model, b: Array) -> Array | float:
    """(n, n) covariance, on the record's points, of what learnt responses are off by where effects b (m,) act."""
    acting = [
        (model.responses[k.name], size) for k, size in zip(model.known, b, strict=True) if k.name in model.responses
    ]
    rows = [size * response.spread for response, size in acting if size and len(response.spread)]
    if not rows:
        return 0.0
    factor = model.through(np.vstack(rows), b)
    return factor.T @ factor


def rough(model: Model) -> Array:
    """(grid,) variance by which a strike leaves what is smooth in its parameters, one value a channel."""
    sizes = [model.emulator.channels[c].rough() for c in model.clock.channels]
    return np.repeat(sizes, len(model.clock.time))


def doubted(model: Model, theta: Array, off: Array) -> Array:
    """(grid,) share of a strike's difference off (grid,) from the emulator that is the emulator's error; by channel.

    The rest is the strike's own roughness.
    """
    u = model.emulator.inputs(theta[None])[0]
    emulators = [model.emulator.channels[name] for name in model.clock.channels]
    smooth = [
        (one.error_factor(u, one.time) ** 2).sum(axis=1).mean() + one.outside.mean() - one.rough() for one in emulators
    ]
    return followed(np.repeat(np.maximum(smooth, 0.0), len(model.clock.time)), rough(model), off, len(emulators))
