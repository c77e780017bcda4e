"""The verdict: which effects the data allow, in four kinds, at a stated error rate."""

from __future__ import annotations

from collections.abc import Mapping

NONE = "none"
NO_RESIDUAL, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_significant_residual", "attributed", "ambiguous", "unexplained"
ALPHA = 0.05


def confidence_set(p: Mapping[str, float], alpha: float) -> tuple[str, ...]:
    """C = {k : p_k >= alpha}, the most consistent first."""
    return tuple(sorted((k for k in p if p[k] >= alpha), key=lambda k: (k != NONE, -p[k])))


def verdict(allowed: tuple[str, ...], inferred: bool = False) -> str:
    """One of four: no significant residual, attributed, ambiguous, unexplained.

    inferred: the noise level comes from the fit itself, by which no miss can be called unexplained: it is ambiguous.
    """
    if NONE in allowed:
        return NO_RESIDUAL
    if not allowed and inferred:
        return AMBIGUOUS
    return {0: UNEXPLAINED, 1: ATTRIBUTED}.get(len(allowed), AMBIGUOUS)
