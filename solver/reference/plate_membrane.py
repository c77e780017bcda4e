"""Large static deflection of a clamped plate whose edge gives way in its plane: shells against von Karman's plate.

The truth is a Ritz minimisation of von Karman's energy with in-plane edge springs: for a given deflection the in-plane
displacements are a linear problem, and the deflection's few coefficients are found by minimisation.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy.optimize import minimize

from birdstrike.data.histories import Array
from birdstrike.solver.reference.plate_ritz import outer
from birdstrike.solver.target.section import ShellMaterial

LENGTH, WIDTH, THICKNESS = 0.525, 0.430, 0.004
ALUMINIUM = ShellMaterial(71e9, 0.3, 2780.0)


def derivatives(family: list[Polynomial], points: Array) -> tuple[Array, Array, Array]:
    """Values, first and second derivatives of polynomials at points, each (functions, points)."""
    return tuple(np.array([p.deriv(k)(points) if k else p(points) for p in family]) for k in range(3))  # type: ignore


def von_karman_deflection(pressure: float, in_plane: float, terms: int = 4) -> float:
    """Centre deflection [m] under a uniform pressure [Pa]; in_plane [N/m per m]: springs, infinite held rigidly."""
    points, weights = np.polynomial.legendre.leggauss(3 * terms + 8)
    a, b = 0.5 * LENGTH, 0.5 * WIDTH
    area = np.outer(weights, weights).ravel() * a * b
    young, nu = ALUMINIUM.elastic
    stretch = young * THICKNESS / (1.0 - nu**2)
    clamp = Polynomial([1.0, 0.0, -1.0]) ** 2
    stop = Polynomial([1.0, 0.0, -1.0]) if np.isinf(in_plane) else Polynomial([1.0])
    legendre = [Legendre.basis(i).convert(kind=Polynomial) for i in range(2 * terms)]
    w, w1, w2 = derivatives([clamp * p for p in legendre[: 2 * terms - 2 : 2]], points)
    even, even1, _ = derivatives([stop * p for p in legendre[0::2]], points)
    odd, odd1, _ = derivatives([stop * p for p in legendre[1::2]], points)
    wx, wy = outer(w1 / a, w), outer(w, w1 / b)
    laplacian = outer(w2 / a**2, w) + outer(w, w2 / b**2)
    none = np.zeros((len(odd) ** 2, len(area)))
    exx = np.concatenate([outer(odd1 / a, even), none])
    eyy = np.concatenate([none, outer(even, odd1 / b)])
    exy = np.concatenate([outer(odd, even1 / b), outer(even1 / a, odd)])

    def stiff(x: Array, y: Array, s: Array) -> tuple[Array, Array, Array]:
        return stretch * (x + nu * y), stretch * (y + nu * x), 0.5 * stretch * (1.0 - nu) * s

    nx, ny, nxy = stiff(exx, eyy, exy)
    membrane = (nx * area) @ exx.T + (ny * area) @ eyy.T + (nxy * area) @ exy.T
    if not np.isinf(in_plane):
        membrane += in_plane * edge_squares(stop, legendre, weights, a, b)
    inverse = np.linalg.inv(membrane)
    load = pressure * (outer(w, w) @ area)
    bending = stretch * THICKNESS**2 / 12.0 * (laplacian * area) @ laplacian.T

    def energy(scaled: Array) -> float:
        c = THICKNESS * scaled
        fx, fy = c @ wx, c @ wy
        own = (0.5 * fx**2, 0.5 * fy**2, fx * fy)
        tx, ty, txy = stiff(*own)
        coupling = (exx * area) @ tx + (eyy * area) @ ty + (exy * area) @ txy
        alone = 0.5 * ((own[0] * tx + own[1] * ty + own[2] * txy) @ area)
        relaxed = alone - 0.5 * coupling @ inverse @ coupling
        return float(0.5 * c @ bending @ c + relaxed - load @ c)

    start = np.zeros(len(load))
    scale = abs(pressure) * LENGTH * WIDTH * THICKNESS
    found = minimize(lambda c: energy(c) / scale, start, method="BFGS", options={"gtol": 1e-8, "maxiter": 500})
    middle = derivatives([clamp * p for p in legendre[: 2 * terms - 2 : 2]], np.array([0.0]))[0]
    return float(THICKNESS * found.x @ outer(middle, middle)[:, 0])


def edge_squares(stop: Polynomial, legendre: list[Polynomial], weights: Array, a: float, b: float) -> Array:
    """Integral along the edges of products of the in-plane functions, u odd-even then v even-odd."""
    points = np.polynomial.legendre.leggauss(len(weights))[0]
    even, odd = ([stop * p for p in legendre[i::2]] for i in (0, 1))

    def along(first: list[Polynomial], second: list[Polynomial]) -> Array:
        result = 0.0
        ends = np.array([-1.0, 1.0])
        f, g = (np.array([p(points) for p in family]) for family in (first, second))
        fe, ge = (np.array([p(ends) for p in family]) for family in (first, second))
        for end in (0, 1):
            for rows, half in ((outer(fe[:, end : end + 1], g), b), (outer(f, ge[:, end : end + 1]), a)):
                result = result + (rows * weights * half) @ rows.T
        return np.asarray(result)

    u, v = along(odd, even), along(even, odd)
    none = np.zeros_like(u)
    return np.block([[u, none], [none, v]])
