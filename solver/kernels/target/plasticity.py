"""Plane-stress J2 plasticity with combined isotropic and kinematic hardening: elastic law and radial return.

J. C. Simo & T. J. R. Hughes, Computational Inelasticity (1998), section 3.4: the yield function is diagonal in the
sum, the difference and the shear of the relative stress, which leaves one scalar equation for the multiplier.
A law can ask for the return that scales the whole trial stress instead, as other codes' shells do by default.
The factor of the strain rate (G. R. Cowper & P. S. Symonds, Brown University report 28, 1957; Johnson & Cook) is that
of the very step (backward Euler), not an older one; heat and softening are those at the step's beginning.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from birdstrike.solver.kernels.target.metal import (
    CONSTANTS,
    DAMAGE,
    EPS_P,
    FLOW,
    FRACTURE_ENERGY,
    HARDENING,
    HEAT,
    HEATING,
    KINEMATIC,
    LINEAR,
    MELT_SPAN,
    POISSON,
    RADIAL,
    RATE_C,
    RETURN,
    SOFTENING,
    STRAIN_LIMIT,
    YIELD,
    YOUNG,
    hardened,
    rate_factor,
    remaining,
    softened,
    worn_out,
)

ROOT_TWO_THIRDS = math.sqrt(2.0 / 3.0)
TOLERANCE = 1e-13  # of the first yield stress
CONCAVE = 1e-12  # the same of hardening that is no straight line
LANES = 8  # layers that are returned together
QUEUED = 11 * LANES
PLUS, MINUS, SHEAR, SLOPE_PLUS, SLOPE_REST, STRAIN, SHARE, STATIC, SLOPE, ENOUGH, MULTIPLIER = (
    np.uint64(i * LANES) for i in range(11)
)
NEW_PLUS, NEW_MINUS, NEW_SHEAR, NEW_NORM, GROWTH = STRAIN, SHARE, STATIC, SLOPE, ENOUGH
"""Places of a queue, LANES layers side by side: plus, minus, shear of the trial stress, slopes of its divisors, plastic
strain, share of the flow stress, straight hardening's flow stress without strain [Pa] and modulus [Pa], tolerance [Pa],
multiplier [1/Pa]; once returned: plus, minus, shear, norm of the stress [Pa], and the growth of the plastic strain."""


@njit(cache=True, error_model="numpy", inline="always")
def relative_norm_squared(plus, minus, shear):
    """xi^T P xi [Pa^2] from (xx + yy)/sqrt2, (yy - xx)/sqrt2 and xy: 2/3 of the squared equivalent stress."""
    return plus * plus / 3.0 + minus * minus + 2.0 * shear * shear


@njit(cache=True, error_model="numpy", inline="always")
def slopes(row):
    """Growth [Pa] of the return's divisors with the multiplier: of the sum, and of the difference and the shear.

    A radial return divides all alike, by what the shear is divided by: trial stress less 3 G times the growth of the
    plastic strain.
    """
    young, nu = row[YOUNG], row[POISSON]
    kinematic = 2.0 * row[KINEMATIC] / 3.0
    rest = young / (1.0 + nu) + kinematic
    return rest if row[RETURN] == RADIAL else young / (3.0 * (1.0 - nu)) + kinematic, rest


@njit(cache=True, error_model="numpy", inline="always")
def returned_norm(multiplier, plus, minus, shear, slope_plus, slope_rest):
    """Norm of the returned stress [Pa], and its derivative by the multiplier."""
    c1, c2 = 1.0 + multiplier * slope_plus, 1.0 + multiplier * slope_rest
    norm = math.sqrt(relative_norm_squared(plus / c1, minus / c2, shear / c2))
    change = -(plus * plus / (3.0 * c1**3) * slope_plus + (minus**2 + 2.0 * shear**2) / c2**3 * slope_rest) / norm
    return norm, change


@njit(cache=True, error_model="numpy", inline="always")
def growth_of_strain(multiplier, norm, change):
    """Growth of the plastic strain, and its derivative by the multiplier."""
    return ROOT_TWO_THIRDS * multiplier * norm, ROOT_TWO_THIRDS * (norm + multiplier * change)


@njit(cache=True, error_model="numpy")
def overstress(multiplier, trial, slopes, eps_p, share, row, dt):
    """Distance of the returned stress from the yield surface [Pa], and its derivative by the multiplier.

    trial: plus, minus and shear of the trial stress; share: of the flow stress that heat and softening leave.
    """
    norm, change = returned_norm(multiplier, trial[0], trial[1], trial[2], slopes[0], slopes[1])
    growth, growth_change = growth_of_strain(multiplier, norm, change)
    static, slope = hardened(row, eps_p + growth)
    static, slope = share * static, share * slope
    static_change = slope * growth_change
    factor, factor_change = rate_factor(row, growth, growth_change, dt)
    residual = norm - ROOT_TWO_THIRDS * factor * static
    return residual, change - ROOT_TWO_THIRDS * (factor * static_change + factor_change * static)


@njit(cache=True, error_model="numpy")
def plastic_multiplier(multiplier, trial, slopes, eps_p, share, row, dt):
    """Multiplier [1/Pa] at which the returned stress lies on the yield surface, from that of `return_queue`.

    Rate factors and curved hardening can have infinite slopes at rest: the answer without them bounds the iteration,
    which bisects where Newton leaves the bounds.
    """
    straight = row[HARDENING] == LINEAR
    if straight and row[RATE_C] <= 0.0:
        return multiplier
    accuracy = (TOLERANCE if straight else CONCAVE) * row[YIELD]
    low, high = 0.0, multiplier
    for _ in range(200):
        residual, slope = overstress(multiplier, trial, slopes, eps_p, share, row, dt)
        if abs(residual) < accuracy:
            break
        if residual > 0.0:
            low = multiplier
        else:
            high = multiplier
        multiplier -= residual / slope
        if not low < multiplier < high:
            multiplier = 0.5 * (low + high)
    return multiplier


@njit(cache=True, error_model="numpy", inline="always")
def parts(xi_x, xi_y, shear):
    """Sum (xx + yy)/sqrt2, difference (yy - xx)/sqrt2 and shear of a relative stress xx yy xy [Pa]."""
    root = math.sqrt(0.5)
    return root * (xi_x + xi_y), root * (xi_y - xi_x), shear


@njit(cache=True, error_model="numpy", inline="always")
def within_yield(xi_x, xi_y, shear, flow):
    """Whether a relative stress xx yy xy [Pa] lies within the yield surface of a flow stress [Pa]."""
    plus, minus, shear = parts(xi_x, xi_y, shear)
    radius = ROOT_TWO_THIRDS * flow
    return relative_norm_squared(plus, minus, shear) <= radius * radius


@njit(cache=True, error_model="numpy", inline="always")
def place_of(entry):
    """Where an entry's first constant stands in a queue; the others see below LANES."""
    lanes = np.uint64(LANES)
    return np.uint64(entry) // lanes * np.uint64(QUEUED) + np.uint64(entry) % lanes


@njit(cache=True, error_model="numpy", inline="always")
def queue_length(entries):
    """Doubles that a queue of so many entries takes."""
    return (entries + LANES - 1) // LANES * QUEUED


@njit(cache=True, error_model="numpy", inline="always")
def is_plain(row):
    """Whether a law is linear hardening alone: no rate, heat, softening or damage sum, an end at once if any."""
    straight = row[HARDENING] == LINEAR and not row[RATE_C] > 0.0
    return straight and row[MELT_SPAN] == 0.0 and row[DAMAGE] == STRAIN_LIMIT and not row[FRACTURE_ENERGY] > 0.0


@njit(cache=True, error_model="numpy")
def hardening_bound(row, memory):
    """Of a law that is not plain: share of the flow stress that heat and softening leave, and a straight hardening.

    Where hardening is no straight line, the flow stress as it is now takes its place.
    """
    share = remaining(row, memory)
    if row[HARDENING] == LINEAR:
        return share, row[CONSTANTS], row[CONSTANTS + 1]
    return share, hardened(row, memory[EPS_P])[0], 0.0


@njit(cache=True, error_model="numpy", inline="always")
def enqueue(queue, entry, trial, divisors, eps_p, bound, first_yield):
    """Put a layer beyond yield into a queue.

    trial: plus, minus, shear [Pa] of its relative stress; divisors: `slopes`; bound: share, flow stress without plastic
    strain [Pa] and modulus [Pa] of a straight hardening; first_yield [Pa].
    """
    at = place_of(entry)
    queue[at + PLUS], queue[at + MINUS], queue[at + SHEAR] = trial
    queue[at + SLOPE_PLUS], queue[at + SLOPE_REST] = divisors
    queue[at + STRAIN] = eps_p
    queue[at + SHARE], queue[at + STATIC], queue[at + SLOPE] = bound
    queue[at + ENOUGH] = TOLERANCE * first_yield


@njit(cache=True, error_model="numpy")
def return_queue(queue, entries):
    """Multipliers [1/Pa] of a queue without the rate's factor, by Newton's method, and the stresses that they return.

    LANES entries are iterated together, in vectors, each until it has converged by itself.
    """
    if entries == 0:
        return
    last = place_of(entries - 1)
    for spare in range(entries, (entries + LANES - 1) // LANES * LANES):
        at = place_of(spare)
        for i in range(0, QUEUED, LANES):
            queue[at + np.uint64(i)] = queue[last + np.uint64(i)]
    for group in range(np.uint64((entries + LANES - 1) // LANES)):
        start = group * np.uint64(QUEUED)
        for i in range(np.uint64(LANES)):
            queue[start + i + MULTIPLIER] = 0.0
        for _ in range(50):
            pending = 0
            for i in range(np.uint64(LANES)):
                at = start + i
                multiplier = queue[at + MULTIPLIER]
                plus, minus, shear = queue[at + PLUS], queue[at + MINUS], queue[at + SHEAR]
                slope_plus, slope_rest = queue[at + SLOPE_PLUS], queue[at + SLOPE_REST]
                eps_p, share = queue[at + STRAIN], queue[at + SHARE]
                static, slope = queue[at + STATIC], queue[at + SLOPE]
                norm, change = returned_norm(multiplier, plus, minus, shear, slope_plus, slope_rest)
                growth, growth_change = growth_of_strain(multiplier, norm, change)
                residual = norm - ROOT_TWO_THIRDS * (share * (static + slope * (eps_p + growth)))
                change -= ROOT_TWO_THIRDS * (share * slope * growth_change)
                converged = abs(residual) < queue[at + ENOUGH]
                pending += not converged
                better = multiplier - residual / change
                queue[at + MULTIPLIER] = multiplier if converged else better
            if pending == 0:
                break
        for i in range(np.uint64(LANES)):
            at = start + i
            multiplier = queue[at + MULTIPLIER]
            plus, minus, shear = queue[at + PLUS], queue[at + MINUS], queue[at + SHEAR]
            slope_plus, slope_rest = queue[at + SLOPE_PLUS], queue[at + SLOPE_REST]
            plus, minus, shear, norm, growth = returned(multiplier, plus, minus, shear, slope_plus, slope_rest)
            queue[at + NEW_PLUS], queue[at + NEW_MINUS], queue[at + NEW_SHEAR] = plus, minus, shear
            queue[at + NEW_NORM], queue[at + GROWTH] = norm, growth


@njit(cache=True, error_model="numpy", inline="always")
def returned(multiplier, plus, minus, shear, slope_plus, slope_rest):
    """Plus, minus, shear of the returned stress [Pa], its norm [Pa], and the growth of the plastic strain."""
    plus /= 1.0 + multiplier * slope_plus
    minus /= 1.0 + multiplier * slope_rest
    shear /= 1.0 + multiplier * slope_rest
    norm = math.sqrt(relative_norm_squared(plus, minus, shear))
    return plus, minus, shear, norm, ROOT_TWO_THIRDS * multiplier * norm


@njit(cache=True, error_model="numpy")
def return_by_law(queue, at, row, memory, dt):
    """Return a queued layer whose law is not plain by the whole of its law; at: `place_of` its entry."""
    trial = (queue[at + PLUS], queue[at + MINUS], queue[at + SHEAR])
    divisors = (queue[at + SLOPE_PLUS], queue[at + SLOPE_REST])
    share = remaining(row, memory)
    multiplier = queue[at + MULTIPLIER]
    multiplier = plastic_multiplier(multiplier, trial, divisors, memory[EPS_P], share, row, dt)
    plus, minus, shear, norm, growth = returned(multiplier, trial[0], trial[1], trial[2], divisors[0], divisors[1])
    queue[at + MULTIPLIER] = multiplier
    queue[at + NEW_PLUS], queue[at + NEW_MINUS], queue[at + NEW_SHEAR] = plus, minus, shear
    queue[at + NEW_NORM], queue[at + GROWTH] = norm, growth
    memory[HEAT] += row[HEATING] * norm / ROOT_TWO_THIRDS * growth


@njit(cache=True, error_model="numpy", inline="always")
def relative_stress(queue, at, kinematic):
    """Of a returned layer: xx, yy, xy relative to the back stress, and of the back stress's growth [Pa]."""
    root = math.sqrt(0.5)
    plus, minus, shear = queue[at + NEW_PLUS], queue[at + NEW_MINUS], queue[at + NEW_SHEAR]
    xi_x, xi_y = root * (plus - minus), root * (plus + minus)
    shift = queue[at + MULTIPLIER] * (2.0 / 3.0 * kinematic)
    return xi_x, xi_y, shear, shift * xi_x, shift * xi_y, shift * shear


@njit(cache=True, error_model="numpy")
def age(row, stress, back, moved, memory, growth, size, dt):
    """Failure and flow stress of a layer whose law is not plain, after its strain has grown; whether it has failed.

    moved: by what the back stress has just moved, xx yy xy [Pa]. It softens as the flow stress does, and the stress
    with it.
    """
    before = softened(row, memory[SOFTENING])
    failed = worn_out(row, stress, memory, growth, size, dt)
    if row[KINEMATIC] > 0.0 and memory[SOFTENING] > 0.0:
        left = softened(row, memory[SOFTENING])
        kept = left / before if before > 0.0 else 0.0
        for i in range(3):
            lost = (1.0 - kept) * (back[i] - moved[i]) + (1.0 - left) * moved[i]
            stress[i] -= lost
            back[i] -= lost
    memory[FLOW] = remaining(row, memory) * hardened(row, memory[EPS_P])[0]
    return failed


@njit(cache=True, error_model="numpy")
def return_to_yield(stress, back, memory, row, size, dt):
    """Radial return of a trial stress, and the layer's ageing; whether it has failed.

    stress, back: (3,) xx yy xy [Pa], memory: (MEMORY,), all in place; size [m]: of the element; dt: the step [s].
    The relative stress xi = stress - back obeys xi^T P xi <= 2/3 flow^2.
    """
    xi_x, xi_y, shear = stress[0] - back[0], stress[1] - back[1], stress[2] - back[2]
    if within_yield(xi_x, xi_y, shear, memory[FLOW]):
        return False
    queue = np.empty(queue_length(1))
    bound = hardening_bound(row, memory)
    enqueue(queue, 0, parts(xi_x, xi_y, shear), slopes(row), memory[EPS_P], bound, row[YIELD])
    return_queue(queue, 1)
    at = place_of(0)
    return_by_law(queue, at, row, memory, dt)
    xi_x, xi_y, shear, back_x, back_y, back_xy = relative_stress(queue, at, row[KINEMATIC])
    back[0] += back_x
    back[1] += back_y
    back[2] += back_xy
    stress[0], stress[1], stress[2] = back[0] + xi_x, back[1] + xi_y, back[2] + shear
    memory[EPS_P] += queue[at + GROWTH]
    return age(row, stress, back, (back_x, back_y, back_xy), memory, queue[at + GROWTH], size, dt)
