"""Stress through the shell's thickness: plane-stress layers, elastic transverse shear, and their resultants."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from birdstrike.solver.kernels.target.metal import (
    CONSTANTS,
    EPS_P,
    FAILURE,
    FLOW,
    KINEMATIC,
    POISSON,
    YIELD,
    YOUNG,
    crack_band,
)
from birdstrike.solver.kernels.target.plasticity import (
    GROWTH,
    age,
    enqueue,
    hardening_bound,
    is_plain,
    parts,
    place_of,
    queue_length,
    relative_stress,
    return_by_law,
    return_queue,
    slopes,
    within_yield,
)
from birdstrike.solver.kernels.target.shell import SHEAR_FACTOR

BLOCK = 32  # elements whose yielding layers are returned together


@njit(cache=True, error_model="numpy")
def moduli(law):
    """Of every layer (l,) from the rows of their laws: E/(1 - nu^2), shear modulus, `slopes` [Pa]; `is_plain`."""
    plane, shear, slope = np.empty(law.shape[0]), np.empty(law.shape[0]), np.empty((law.shape[0], 2))
    plain = np.empty(law.shape[0], np.bool_)
    for layer in range(law.shape[0]):
        young, nu = law[layer, YOUNG], law[layer, POISSON]
        plane[layer] = young / (1.0 - nu * nu)
        shear[layer] = young / (2.0 * (1.0 + nu))
        slope[layer, 0], slope[layer, 1] = slopes(law[layer])
        plain[layer] = is_plain(law[layer])
    return plane, shear, slope, plain


@njit(cache=True, error_model="numpy")
def try_layers(begin, end, strain, alive, sections, moduli, layers, queue, beyond, weights):
    """Elastic trial of the layers of these elements; those beyond yield are queued. Returns how many.

    out: beyond (q, 2), element and layer of each that is queued; weights (end - begin, 3): of the layers that stand,
    none as yet of those that fail, and the transverse shear modulus [Pa] of the last layer.
    """
    section, first, height, law = sections
    plane, shear, slope, plain = moduli
    stress, back, memory, gone = layers
    queued = 0
    for e in range(begin, end):
        if not alive[e]:
            continue
        d0, d1, d2, d3, d4, d5 = strain[e, 0], strain[e, 1], strain[e, 2], strain[e, 3], strain[e, 4], strain[e, 5]
        whole = stiff = 0.0
        bottom = first[section[e]]
        for k in range(np.uint64(first[section[e] + 1] - bottom)):
            if gone[e, k]:
                continue
            layer = bottom + k
            z, nu = height[layer, 0], law[layer, POISSON]
            stiff = SHEAR_FACTOR * shear[layer]
            whole += height[layer, 1]
            dx, dy, dxy = d0 + z * d3, d1 + z * d4, d2 + z * d5
            xx = stress[e, k, 0] + plane[layer] * (dx + nu * dy)
            yy = stress[e, k, 1] + plane[layer] * (dy + nu * dx)
            xy = stress[e, k, 2] + shear[layer] * dxy
            stress[e, k, 0], stress[e, k, 1], stress[e, k, 2] = xx, yy, xy
            xi_x, xi_y, xi_xy = xx - back[e, k, 0], yy - back[e, k, 1], xy - back[e, k, 2]
            if within_yield(xi_x, xi_y, xi_xy, memory[e, k, FLOW]):
                continue
            bound = (1.0, law[layer, CONSTANTS], law[layer, CONSTANTS + 1])
            if not plain[layer]:
                bound = hardening_bound(law[layer], memory[e, k])
            trial, divisors = parts(xi_x, xi_y, xi_xy), (slope[layer, 0], slope[layer, 1])
            enqueue(queue, queued, trial, divisors, memory[e, k, EPS_P], bound, law[layer, YIELD])
            beyond[queued, 0], beyond[queued, 1] = e, k
            queued += 1
        weights[e - begin, 0], weights[e - begin, 1], weights[e - begin, 2] = whole, 0.0, stiff
    return queued


@njit(cache=True, error_model="numpy")
def settle_layers(begin, queued, sections, plain, layers, size, dt, queue, beyond, weights):
    """State of the layers that were returned, and the weight of those that fail.

    Views of arrays are made for laws that are not plain alone: counting them takes longer than the arithmetic.
    """
    section, first, height, law = sections
    stress, back, memory, gone = layers
    for entry in range(queued):
        e, k, at = beyond[entry, 0], beyond[entry, 1], place_of(entry)
        layer = first[section[e]] + k
        if not plain[layer]:
            return_by_law(queue, at, law[layer], memory[e, k], dt)
        xx, yy, xy, back_x, back_y, back_xy = relative_stress(queue, at, law[layer, KINEMATIC])
        back[e, k, 0] += back_x
        back[e, k, 1] += back_y
        back[e, k, 2] += back_xy
        stress[e, k, 0] = back[e, k, 0] + xx
        stress[e, k, 1] = back[e, k, 1] + yy
        stress[e, k, 2] = back[e, k, 2] + xy
        growth = queue[at + GROWTH]
        eps_p = memory[e, k, EPS_P] + growth
        memory[e, k, EPS_P] = eps_p
        if plain[layer]:
            memory[e, k, FLOW] = law[layer, CONSTANTS] + law[layer, CONSTANTS + 1] * eps_p
            failed = eps_p >= law[layer, FAILURE]
        else:
            moved = (back_x, back_y, back_xy)
            band = crack_band(law[layer], size[e], stress[e, k])
            failed = age(law[layer], stress[e, k], back[e, k], moved, memory[e, k], growth, band, dt)
        if failed:
            gone[e, k] = True
            stress[e, k, 0] = stress[e, k, 1] = stress[e, k, 2] = 0.0
            weights[e - begin, 1] += height[layer, 1]


@njit(cache=True, error_model="numpy")
def sum_layers(begin, end, strain, area, alive, sections, stress, weights, resultant, work):
    """Resultants of these elements, and the work of the step, trapezoidal; a layer that is gone carries nothing."""
    section, first, height, _ = sections
    for e in range(begin, end):
        work[e] = 0.0
        if not alive[e]:
            continue
        before = 0.0
        for i in range(8):
            before += resultant[e, i] * strain[e, i]
        n1 = n2 = n3 = m1 = m2 = m3 = 0.0
        bottom = first[section[e]]
        for k in range(np.uint64(first[section[e] + 1] - bottom)):
            z, weight = height[bottom + k, 0], height[bottom + k, 1]
            xx, yy, xy = stress[e, k, 0], stress[e, k, 1], stress[e, k, 2]
            n1 += weight * xx
            n2 += weight * yy
            n3 += weight * xy
            m1 += weight * z * xx
            m2 += weight * z * yy
            m3 += weight * z * xy
        resultant[e, 0], resultant[e, 1], resultant[e, 2] = n1, n2, n3
        resultant[e, 3], resultant[e, 4], resultant[e, 5] = m1, m2, m3
        whole, lost, stiff = weights[e - begin, 0], weights[e - begin, 1], weights[e - begin, 2]
        remaining = (whole - lost) / whole if whole > 0.0 else 0.0
        resultant[e, 6] = remaining * (resultant[e, 6] + stiff * whole * strain[e, 6])
        resultant[e, 7] = remaining * (resultant[e, 7] + stiff * whole * strain[e, 7])
        after = 0.0
        for i in range(8):
            after += resultant[e, i] * strain[e, i]
        work[e] = 0.5 * area[e] * (before + after)


@njit(cache=True, parallel=True)
def update_shell_stress(strain, area, alive, sections, size, dt, layers, resultant, work):
    """Stress of every layer after the strain increments, the resultants, and the work of the step.

    strain: (e, 8) increments; area: (e,) [m^2]; sections: of each element (e,), first layer of each (s + 1,), heights
    and weights of the layers (l, 2) [m], rows of their laws (l, ROW); size: (e, 4), see `metal.crack_band`; dt [s];
    layers: stress, back (e, k, 3) [Pa], memory (e, k, MEMORY), gone (e, k), in and out; resultant (e, 8); out: work
    (e,) [J].
    A layer that fails carries nothing from then on, and takes its share of the transverse shear with it.
    """
    of_layers = moduli(sections[3])
    elements, most = strain.shape[0], layers[0].shape[1]
    for block in prange((elements + BLOCK - 1) // BLOCK):
        begin, end = block * BLOCK, min((block + 1) * BLOCK, elements)
        queue, beyond = np.empty(queue_length(BLOCK * most)), np.empty((BLOCK * most, 2), np.int64)
        weights = np.empty((BLOCK, 3))
        queued = try_layers(begin, end, strain, alive, sections, of_layers, layers, queue, beyond, weights)
        return_queue(queue, queued)
        settle_layers(begin, queued, sections, of_layers[3], layers, size, dt, queue, beyond, weights)
        sum_layers(begin, end, strain, area, alive, sections, layers[0], weights, resultant, work)
