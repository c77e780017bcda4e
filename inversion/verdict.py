"""Which method's answer the solver confirms best, in one sentence."""

from __future__ import annotations

from inversion.inversion import Answer, Inversion
from inversion.words import quantity


def verdict(inversion: Inversion) -> str:
    """The verified errors side by side, the best first; in the channel's unit, and in per cent of the peaks."""
    if inversion.best is None:
        return "no verification run finished, so no answer is confirmed"
    winner = f"the {inversion.best} ({error_words(inversion.methods[inversion.best])})"
    others = [f"the {m} ({error_words(a)})" for m, a in inversion.methods.items() if m != inversion.best]
    if not others:
        return f"verified by the solver: {winner}"
    return f"better verified by the solver: {winner}, against {' and '.join(others)}"


def error_words(answer: Answer) -> str:
    """ "0.31 mm RMS, 5.4 % of the peak", "4.1 % RMS of the 3 channels' peaks", or why there is none."""
    if answer.verified_rmse is None or answer.verified_relative is None:
        return f"its run failed: {answer.failure}"
    share = 100 * answer.verified_relative
    if len(answer.channels) > 1:
        return f"{share:.1f} % RMS of the {len(answer.channels)} channels' peaks"
    first = next(iter(answer.channels.values()))
    return f"{quantity(answer.verified_rmse, first.unit)} RMS, {share:.1f} % of the peak"
