"""Erosion of shells: an element goes when every layer through its thickness has failed."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def erode_shells(layers, gone_layers, area, strain, hourglass_strain, alive, resultant, hourglass, work, taken):
    """Take away the elements whose layers have all failed; their mass stays at their nodes.

    layers: (e,) how many each has; gone_layers: (e, k) which have failed; area (e,) [m^2]; strain (e, 8),
    hourglass_strain (e, h): increments of the step; in and out: alive (e,), resultant (e, 8), hourglass (e, h), work
    (2, e): of the step, stress and hourglass [J]; taken (2, e): the same summed over time [J]. An element's force
    is zero at the end of the step in which it goes, so the end's half of the trapezoidal work is taken back.
    Returns how many elements went, and what their stresses and hourglass forces had taken in [J].
    """
    gone = 0
    frozen, frozen_hourglass = 0.0, 0.0
    for e in range(gone_layers.shape[0]):
        if not alive[e]:
            continue
        failed = True
        for k in range(layers[e]):  # in a sound element the first layer already answers
            if not gone_layers[e, k]:
                failed = False
                break
        if failed:
            for i in range(8):
                work[0, e] -= 0.5 * area[e] * resultant[e, i] * strain[e, i]
                resultant[e, i] = 0.0
            for i in range(hourglass.shape[1]):
                work[1, e] -= 0.5 * hourglass[e, i] * hourglass_strain[e, i]
                hourglass[e, i] = 0.0
            alive[e] = False
            gone += 1
        taken[0, e] += work[0, e]
        taken[1, e] += work[1, e]
        if failed:
            frozen += taken[0, e]
            frozen_hourglass += taken[1, e]
    return gone, frozen, frozen_hourglass
