"""Linear hardening, as bird and target have it."""

from __future__ import annotations


def hardening_moduli(young: float, tangent: float, beta: float = 1.0) -> tuple[float, float]:
    """Isotropic and kinematic moduli [Pa], stress over plastic strain: beta Ep and (1 - beta) Ep, Ep = E Et/(E - Et).

    young, tangent: slopes E and Et [Pa] of the stress-strain curve before and beyond yield, Et < E.
    """
    modulus = young * tangent / (young - tangent)
    return beta * modulus, (1.0 - beta) * modulus
