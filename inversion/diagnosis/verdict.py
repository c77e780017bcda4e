"""The verdict: which effects the data allow, in four kinds, at a stated error rate."""

from __future__ import annotations

from collections.abc import Mapping

NONE = "none"
NO_RESIDUAL, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_significant_residual", "attributed", "ambiguous", "unexplained"
UNSEEN, AT_LIMIT = "unseen", "at_limit"
"""Why an effect that is alone in the confidence set is not named."""
ALPHA = 0.05


def confidence_set(p: Mapping[str, float], alpha: float) -> tuple[str, ...]:
    """C = {k : p_k >= alpha}, the most consistent first."""
    return tuple(sorted((k for k in p if p[k] >= alpha), key=lambda k: (k != NONE, -p[k])))


def verdict(allowed: tuple[str, ...], inferred: bool = False, nameable: bool = True) -> str:
    """One of four: no significant residual, attributed, ambiguous, unexplained.

    inferred: the noise level comes from the fit itself, by which no miss can be called unexplained: it is ambiguous.
    nameable: whether the effect, if it is alone, may be named; one that a limit of the search holds may not.
    """
    if NONE in allowed:
        return NO_RESIDUAL
    if not allowed:
        return AMBIGUOUS if inferred else UNEXPLAINED
    return ATTRIBUTED if len(allowed) == 1 and nameable else AMBIGUOUS
