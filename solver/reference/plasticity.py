"""Plasticity in closed form: proportional paths with linear hardening, rate dependence, plates under an impulse."""

from __future__ import annotations

import math


def shear_stress(young: float, poisson: float, yield_stress: float, plastic_modulus: float, gamma: float) -> float:
    """Stress tau [Pa] in pure shear `gamma` beyond yield, sqrt3 tau = Y + Ep (gamma - tau/G)/sqrt3.

    young, yield_stress and plastic_modulus (Ep, stress over plastic strain) in Pa.
    """
    shear = young / (2.0 * (1.0 + poisson))
    root = math.sqrt(3.0)
    return (yield_stress + plastic_modulus * gamma / root) / (root + plastic_modulus / (root * shear))


def biaxial_stress(young: float, poisson: float, yield_stress: float, plastic_modulus: float, strain: float) -> float:
    """Stress sigma [Pa] in equal biaxial tension beyond yield, sigma = Y + 2 Ep (strain - (1 - nu) sigma/E)."""
    return (yield_stress + 2.0 * plastic_modulus * strain) / (1.0 + 2.0 * plastic_modulus * (1.0 - poisson) / young)


def cowper_symonds_shear_stress(yield_stress: float, rate_c: float, rate_p: float, rate: float) -> float:
    """Stress [Pa] of a perfectly plastic material in steady engineering shear `rate` [1/s]; rate_c [1/s], 0 is off.

    The whole rate is plastic once the stress stands: the plastic rate is rate/sqrt3, and the factor on the static
    stress 1 + (rate/(sqrt3 C))^(1/P). G. R. Cowper & P. S. Symonds (1957).
    """
    factor = 1.0
    if rate_c > 0.0:
        factor += (rate / (math.sqrt(3.0) * rate_c)) ** (1.0 / rate_p)
    return factor * yield_stress / math.sqrt(3.0)


def nurick_deflection(number: float) -> float:
    """Permanent deflection over thickness of a quadrangular plate under an impulse phi, 0.471 phi + 0.001.

    A correlation of experiments that scatter by one thickness: G. N. Nurick & J. B. Martin, Int. J. Impact Engng 8
    (1989) 171; quoted from memory.
    """
    return 0.471 * number + 0.001


def jones_deflection(number: float, factor: float = 1.0) -> float:
    """Rigid-plastic deflection over thickness of a clamped square plate; N. Jones, Structural Impact (1989), chapter 7.

    w/H = sqrt(1 + lambda/6) - 1 with lambda = 4 phi^2: yield surface of N and M circumscribed as a square (factor 1) or
    inscribed (factor 0.618 on the yield stress). The two bracket the exact yield surface's answer.
    """
    return math.sqrt(1.0 + 4.0 * number**2 / (6.0 * factor)) - 1.0
