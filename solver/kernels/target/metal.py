"""Laws of metals: flow stress by hardening, strain rate and heat, and the damage that ends it.

A law is one row of constants (`ROW` doubles, the places below); its parts combine freely.

    hardening: linear, y0 + H eps_p; power, a + b eps_p^n; table, pieces between points of plastic strain and stress
    rate: Cowper-Symonds, 1 + (rate/C)^(1/P); logarithmic, 1 + C ln(rate/rate0) above rate0 (Johnson-Cook)
    heat: 1 - T*^m with T* = (T - T_ref)/(T_melt - T_ref), T by the plastic work, adiabatic
    damage: begins at a plastic strain, or by Johnson-Cook's sum; then at once, or by the fracture energy, the end

G. R. Johnson & W. H. Cook, Proc. 7th Int. Symp. Ballistics (1983) 541; Eng. Fract. Mech. 21 (1985) 31. A. Hillerborg,
M. Modeer & P.-E. Petersson, Cem. Concr. Res. 6 (1976) 773: softening over a displacement, not a strain, spends the
same energy per area of crack on every mesh.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

YOUNG, POISSON, KINEMATIC, HARDENING, YIELD = 0, 1, 2, 3, 4
RATE, RATE_C, RATE_P = 5, 6, 7
HEATING, START_HEAT, MELT_SPAN, MELT_POWER = 8, 9, 10, 11
FAILURE, FRACTURE_ENERGY, DAMAGE, D1, DAMAGE_RATE = 12, 13, 14, 15, 20
POINTS, RETURN, CONSTANTS = 21, 22, 23
MOST_POINTS = 32
ROW = CONSTANTS + 2 * MOST_POINTS
"""Places in a row: E, nu, kinematic modulus [Pa], kind of hardening, first yield stress [Pa]; kind of rate factor, C,
and 1/P of Cowper-Symonds or rate0 [1/s]; kelvins per plastic work [K m^3/J], T0 - T_ref, T_melt - T_ref [K], m;
failure strain, fracture energy [J/m^2] (0: at once), kind of damage, D1 .. D5, its rate0 [1/s]; points of the table;
how a stress returns to the yield surface; the hardening's constants."""

LINEAR, POWER, TABLE = 0.0, 1.0, 2.0
COWPER_SYMONDS, LOGARITHMIC = 0.0, 1.0
STRAIN_LIMIT, JOHNSON_COOK = 0.0, 1.0
CLOSEST_POINT, RADIAL = 0.0, 1.0
EPS_P, FLOW, HEAT, WEAR, SOFTENING = 0, 1, 2, 3, 4
MEMORY = 5
"""A layer's memory: plastic strain, its static flow stress [Pa], rise of temperature [K], Johnson-Cook's damage sum,
plastic work of the unsoftened stress since softening began [J/m^2]."""


@njit(cache=True)
def hardened(row, eps_p):
    """Static flow stress [Pa] at a plastic strain, and its slope [Pa]."""
    kind = row[HARDENING]
    if kind == LINEAR:
        return row[CONSTANTS] + row[CONSTANTS + 1] * eps_p, row[CONSTANTS + 1]
    if kind == POWER:
        a, b, n = row[CONSTANTS], row[CONSTANTS + 1], row[CONSTANTS + 2]
        if eps_p <= 0.0:
            return a, 0.0
        grown = b * eps_p**n
        return a + grown, n * grown / eps_p
    return tabulated(row, eps_p)


@njit(cache=True)
def tabulated(row, eps_p):
    """Between the points of a table; beyond the last its stress stays."""
    points = int(row[POINTS])
    for i in range(1, points):
        left, right = CONSTANTS + 2 * (i - 1), CONSTANTS + 2 * i
        if eps_p < row[right]:
            slope = (row[right + 1] - row[left + 1]) / (row[right] - row[left])
            return row[left + 1] + slope * (eps_p - row[left]), slope
    return row[CONSTANTS + 2 * points - 1], 0.0


@njit(cache=True, inline="always")
def rate_factor(row, growth, growth_change, dt):
    """Factor of a plastic strain that grows by `growth` in dt [s], and its derivative where growth has its own."""
    scale = row[RATE_C] * dt
    if not (scale > 0.0 and growth > 0.0):
        return 1.0, 0.0
    if row[RATE] == COWPER_SYMONDS:
        dynamic = (growth / scale) ** row[RATE_P]
        return 1.0 + dynamic, dynamic * row[RATE_P] * growth_change / growth
    above = growth / (row[RATE_P] * dt)
    if above <= 1.0:
        return 1.0, 0.0
    return 1.0 + row[RATE_C] * math.log(above), row[RATE_C] * growth_change / growth


@njit(cache=True)
def hotness(row, memory):
    """T*, of a metal that melts: 0 up to the reference temperature, 1 from the melting temperature on."""
    return min(max((row[START_HEAT] + memory[HEAT]) / row[MELT_SPAN], 0.0), 1.0)


@njit(cache=True)
def remaining(row, memory):
    """Share of the flow stress that heat and softening leave."""
    share = softened(row, memory[SOFTENING])
    if row[MELT_SPAN] > 0.0:
        share *= 1.0 - hotness(row, memory) ** row[MELT_POWER]
    return share


@njit(cache=True)
def softened(row, spent):
    """Share of the stress that is left once the unsoftened stress has done so much plastic work [J/m^2] per area.

    1 - W/2G: its integral over W, up to where nothing is left, is the fracture energy G, whatever the metal hardens.
    """
    return max(1.0 - 0.5 * spent / row[FRACTURE_ENERGY], 0.0) if spent > 0.0 else 1.0


def first_flow(row):
    """Flow stress [Pa] of a layer that has not yielded yet, at the temperature at which it starts."""
    return hardened(row, 0.0)[0] * remaining(row, np.zeros(MEMORY))


@njit(cache=True)
def von_mises(stress):
    """Von Mises stress of a plane stress xx, yy, xy [Pa]."""
    sx, sy, sxy = stress[0], stress[1], stress[2]
    return math.sqrt(sx * sx - sx * sy + sy * sy + 3.0 * sxy * sxy)


@njit(cache=True)
def strain_at_fracture(row, stress, rate, memory):
    """Johnson-Cook's strain at fracture under plane stress (3,) [Pa]: triaxiality is mean over von Mises stress."""
    mises = von_mises(stress)
    triaxiality = (stress[0] + stress[1]) / (3.0 * mises) if mises > 0.0 else 0.0
    strain = row[D1] + row[D1 + 1] * math.exp(row[D1 + 2] * triaxiality)
    strain *= 1.0 + row[D1 + 3] * math.log(max(rate / row[DAMAGE_RATE], 1.0))
    if row[MELT_SPAN] > 0.0:
        strain *= 1.0 + row[D1 + 4] * hotness(row, memory)
    return strain


@njit(cache=True)
def crack_band(row, size, stress):
    """Width [m] of an element across a crack that the larger principal stress of a plane stress (3,) [Pa] opens.

    size (4,): root of the area h [m], and g - 1 of the symmetric g = J J^T/h^2, xx yy xy, J the element's mid-lines:
    along n it is h sqrt(n.g n) wide, h^2 over the length of the crack in it: of a rectangle its length or its width, of
    a parallelogram its height over a side, of a square h in any direction. A crack band as wide as that spends the same
    energy per area of crack in elements of any shape (Z. P. Bazant & B. H. Oh, Mater. Struct. 16 (1983) 155; J. Oliver,
    Int. J. Numer. Methods Eng. 28 (1989) 461).
    """
    if row[FRACTURE_ENERGY] <= 0.0:
        return size[0]
    half, shear = 0.5 * (stress[0] - stress[1]), stress[2]
    radius = math.sqrt(half * half + shear * shear)
    along = 1.0 + 0.5 * (size[1] + size[2])
    if radius > 0.0:
        along += (0.5 * (size[1] - size[2]) * half + size[3] * shear) / radius
    return size[0] * math.sqrt(along)


@njit(cache=True)
def worn_out(row, stress, memory, growth, size, dt):
    """Age a layer by the growth of its plastic strain in dt [s]; whether it has failed.

    Once softening has begun the plastic work of the unsoftened stress adds up, per area of a crack across an element of
    this size [m]; with what rate and history add to that stress.
    """
    if row[DAMAGE] == STRAIN_LIMIT:
        begun = memory[EPS_P] >= row[FAILURE]
    else:
        if growth > 0.0:
            fracture = strain_at_fracture(row, stress, growth / dt, memory)
            memory[WEAR] += growth / max(fracture, 1e-6)
        begun = memory[WEAR] >= 1.0
    if not begun or row[FRACTURE_ENERGY] <= 0.0:
        return begun
    left = softened(row, memory[SOFTENING])
    if left > 0.0:
        memory[SOFTENING] += size * von_mises(stress) * growth / left
    return softened(row, memory[SOFTENING]) <= 0.0
