"""Strength of the bird in three dimensions: objective stress rate and J2 plasticity, one material point at a time.

A symmetric tensor is six numbers xx, yy, zz, xy, yz, zx; a spin is three, w = curl v / 2 [rad/s], of which
W v = w x v. The pressure comes from the equation of state; here the deviator alone is integrated. A particle and
a finite element call the same functions.
"""

from __future__ import annotations

import math

from numba import njit

ROOT_TWO_THIRDS = math.sqrt(2.0 / 3.0)


@njit(cache=True, inline="always")
def contraction(a, b):
    """a : b of two symmetric tensors (6,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])


@njit(cache=True)
def rotate(tensor, wx, wy, wz, dt):
    """Q tensor Q^T in place, for the rotation of the step, Q = (I - W dt/2)^-1 (I + W dt/2).

    The Jaumann rate integrated with an exact rotation: a spin, however fast, changes no invariant (T. J. R. Hughes
    & J. Winget, Int. J. Numer. Meth. Eng. 15 (1980) 1862). tensor: (6,).
    """
    x, y, z = 0.5 * dt * wx, 0.5 * dt * wy, 0.5 * dt * wz  # the Rodrigues vector, tan(angle/2) along the axis
    squared = x * x + y * y + z * z
    if squared == 0.0:
        return
    f, s = 2.0 / (1.0 + squared), (1.0 - squared) / (1.0 + squared)
    q11, q22, q33 = s + f * x * x, s + f * y * y, s + f * z * z
    q12, q21 = f * (x * y - z), f * (x * y + z)
    q23, q32 = f * (y * z - x), f * (y * z + x)
    q31, q13 = f * (z * x - y), f * (z * x + y)
    xx, yy, zz, xy, yz, zx = tensor[0], tensor[1], tensor[2], tensor[3], tensor[4], tensor[5]
    a1, a2, a3 = q11 * xx + q12 * xy + q13 * zx, q11 * xy + q12 * yy + q13 * yz, q11 * zx + q12 * yz + q13 * zz
    b1, b2, b3 = q21 * xx + q22 * xy + q23 * zx, q21 * xy + q22 * yy + q23 * yz, q21 * zx + q22 * yz + q23 * zz
    c1, c2, c3 = q31 * xx + q32 * xy + q33 * zx, q31 * xy + q32 * yy + q33 * yz, q31 * zx + q32 * yz + q33 * zz
    tensor[0] = a1 * q11 + a2 * q12 + a3 * q13
    tensor[1] = b1 * q21 + b2 * q22 + b3 * q23
    tensor[2] = c1 * q31 + c2 * q32 + c3 * q33
    tensor[3] = a1 * q21 + a2 * q22 + a3 * q23
    tensor[4] = b1 * q31 + b2 * q32 + b3 * q33
    tensor[5] = c1 * q11 + c2 * q12 + c3 * q13


@njit(cache=True, inline="always")
def rate_factor(equivalent_rate, rate_c, rate_p):
    """Cowper-Symonds factor on the yield stress, 1 + (rate/C)^(1/P); 1 for C = 0. Rates in 1/s."""
    if rate_c <= 0.0:
        return 1.0
    return 1.0 + (equivalent_rate / rate_c) ** (1.0 / rate_p)


@njit(cache=True)
def return_to_yield_surface(stress, back, eps_p, shear_modulus, sigma_y, isotropic, kinematic):
    """Radial return of a trial deviator (6,) and its back stress (6,) [Pa], in place; returns the new eps_p.

    |stress - back| <= sqrt(2/3) (sigma_y + isotropic eps_p); linear hardening closes the multiplier in one step
    (J. C. Simo & T. J. R. Hughes, Computational Inelasticity (1998), box 3.1).
    """
    squared = 0.0
    for i in range(6):
        xi = stress[i] - back[i]
        squared += (1.0 if i < 3 else 2.0) * xi * xi
    radius = ROOT_TWO_THIRDS * (sigma_y + isotropic * eps_p)
    norm = math.sqrt(squared)
    if norm <= radius:
        return eps_p
    multiplier = (norm - radius) / (2.0 * shear_modulus + 2.0 / 3.0 * (isotropic + kinematic))
    for i in range(6):
        direction = (stress[i] - back[i]) / norm
        stress[i] -= 2.0 * shear_modulus * multiplier * direction
        back[i] += 2.0 / 3.0 * kinematic * multiplier * direction
    return eps_p + ROOT_TWO_THIRDS * multiplier


@njit(cache=True)
def update_deviator(stress, back, eps_p, rate, wx, wy, wz, dt, strength):
    """Deviator and back stress (6,) [Pa] over one step, in place; returns the new equivalent plastic strain.

    rate: (6,) rate of deformation D [1/s] (tensor shears); w: spin [rad/s], both at the middle of the step.
    strength: (6,) shear modulus G [Pa], yield stress [Pa] (inf: elastic), isotropic and kinematic modulus [Pa],
    Cowper-Symonds C [1/s] (0: off) and P. Ep = E Et/(E - Et) is split as isotropic = BETA Ep, kinematic =
    (1 - BETA) Ep; the rate factor, of sqrt(2/3 D':D'), scales the yield stress and its isotropic hardening as in
    LS-DYNA's *MAT_PLASTIC_KINEMATIC.
    """
    mean = (rate[0] + rate[1] + rate[2]) / 3.0
    squared = 0.0
    for i in range(6):  # half of the increment turns with the step: second order in dt
        deviator = rate[i] - (mean if i < 3 else 0.0)
        squared += (1.0 if i < 3 else 2.0) * deviator * deviator
        stress[i] += strength[0] * dt * deviator
    rotate(stress, wx, wy, wz, dt)
    rotate(back, wx, wy, wz, dt)
    for i in range(6):
        stress[i] += strength[0] * dt * (rate[i] - (mean if i < 3 else 0.0))
    factor = rate_factor(ROOT_TWO_THIRDS * math.sqrt(squared), strength[4], strength[5])
    return return_to_yield_surface(
        stress, back, eps_p, strength[0], factor * strength[1], factor * strength[2], strength[3]
    )
