"""Rayleigh-Ritz frequencies of Mindlin's rectangular plate: clamped or on rotational edge springs, with a preload.

Deflection and both rotations are products of Legendre polynomials, times the factors that make them vanish where the
edge holds them. Independent of the shells: no mesh, exact quadrature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy.linalg import eigh

Array = np.ndarray
SHEAR_FACTOR = 5.0 / 6.0


@dataclass(frozen=True)
class RitzPlate:
    """Rectangular plate; SI. rotational [N m/rad per m]: springs on all four edges, infinite: clamped.

    tension [Pa]: initial stress along length and along width.
    """

    length: float
    width: float
    thickness: float
    young: float
    poisson: float
    density: float
    rotational: float = np.inf
    tension: tuple[float, float] = (0.0, 0.0)


def polynomials(count: int, held: bool) -> list[Polynomial]:
    """Legendre polynomials on -1 .. 1, times (1 - x^2) where they must vanish at both ends."""
    factor = Polynomial([1.0, 0.0, -1.0]) if held else Polynomial([1.0])
    return [factor * Legendre.basis(i).convert(kind=Polynomial) for i in range(count)]


def ritz_frequencies(plate: RitzPlate, count: int = 3, terms: int = 10) -> Array:
    """Lowest `count` frequencies [Hz], each from above as `terms` polynomials a direction and field grow."""
    points, weights = np.polynomial.legendre.leggauss(terms + 4)
    a, b, h = 0.5 * plate.length, 0.5 * plate.width, plate.thickness
    area = np.outer(weights, weights).ravel() * a * b
    clamped = np.isinf(plate.rotational)
    deflection = Field(polynomials(terms, True), points, a, b)
    rotation = Field(polynomials(terms, clamped), points, a, b)
    n = terms * terms
    zero = np.zeros_like(rotation.value)

    def assembled(parts: tuple[Array, Array, Array], weight: Array | float) -> Array:
        rows = np.concatenate(parts)
        return (rows * weight * area) @ rows.T

    nu = plate.poisson
    rigidity = plate.young * h**3 / (12.0 * (1.0 - nu**2))
    shear = SHEAR_FACTOR * plate.young / (2.0 * (1.0 + nu)) * h
    none = np.zeros_like(deflection.value)
    kx, ky = (none, rotation.dx, zero), (none, zero, rotation.dy)
    both = (none, rotation.dx, rotation.dy)
    stiffness = rigidity * (nu * assembled(both, 1.0) + (1.0 - nu) * (assembled(kx, 1.0) + assembled(ky, 1.0)))
    stiffness += 0.5 * rigidity * (1.0 - nu) * assembled((none, rotation.dy, rotation.dx), 1.0)
    stiffness += shear * assembled((deflection.dx, -rotation.value, zero), 1.0)
    stiffness += shear * assembled((deflection.dy, zero, -rotation.value), 1.0)
    stiffness += h * plate.tension[0] * assembled((deflection.dx, zero, zero), 1.0)
    stiffness += h * plate.tension[1] * assembled((deflection.dy, zero, zero), 1.0)
    if not clamped:
        spring = plate.rotational * rotation.along_edges(weights, a, b)
        stiffness[n : 2 * n, n : 2 * n] += spring
        stiffness[2 * n :, 2 * n :] += spring
    mass = plate.density * h * assembled((deflection.value, zero, zero), 1.0)
    mass += plate.density * h**3 / 12.0 * assembled((none, rotation.value, zero), 1.0)
    mass += plate.density * h**3 / 12.0 * assembled((none, zero, rotation.value), 1.0)
    squared = eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, count - 1])
    return np.sqrt(squared) / (2.0 * np.pi)


class Field:
    """Products of one family of polynomials at the quadrature points: value, dx, dy, each (terms^2, points^2)."""

    def __init__(self, family: list[Polynomial], points: Array, a: float, b: float) -> None:
        f = np.array([p(points) for p in family])
        d = np.array([p.deriv()(points) for p in family])
        self.value, self.dx, self.dy = outer(f, f), outer(d / a, f), outer(f, d / b)
        self.at_ends = np.array([[p(-1.0), p(1.0)] for p in family])
        self.along = f

    def along_edges(self, weights: Array, a: float, b: float) -> Array:
        """Integral of products of two functions along all four edges, (terms^2, terms^2)."""
        result = 0.0
        for end in (0, 1):
            stop = self.at_ends[:, end : end + 1]
            for rows, half in ((outer(stop, self.along), b), (outer(self.along, stop), a)):
                result = result + (rows * weights * half) @ rows.T
        return np.asarray(result)


def outer(f: Array, g: Array) -> Array:
    """Products of all pairs of functions (i along x, j along y) at all pairs of points."""
    return np.einsum("ip,jq->ijpq", f, g).reshape(len(f) * len(g), -1)
