"""Figures of the audit: what was planted against what was answered, and power against signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.figures.style import BLUE, GREY, VERMILION, WIDE, styled

LAST = ("none needed", "ambiguous, truth among them", "ambiguous, truth not among them", "unexplained")


@styled
def confusion_figure(confusion: Mapping[str, Mapping[str, float]]) -> Figure:
    """Rows: what was planted; columns: the answer; shares of the noise draws."""
    answers = sorted({a for row in confusion.values() for a in row if a not in LAST}) + list(LAST)
    matrix = np.array([[row.get(answer, 0.0) for answer in answers] for row in confusion.values()])
    figure = Figure(figsize=(WIDE, 0.3 * len(matrix) + 2.6), layout="constrained")
    axes = figure.subplots()
    axes.imshow(matrix, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.grid(visible=False)
    axes.set_xticks(range(len(answers)), answers, rotation=40, ha="right")
    axes.set_yticks(range(len(matrix)), [_short(name) for name in confusion])
    for i, row in enumerate(matrix):
        for j, share in enumerate(row):
            if share >= 0.005:
                axes.text(
                    j, i, f"{100 * share:.0f}", ha="center", va="center", color="w" if share > 0.6 else "k", size=7
                )
    axes.set_title("answers in % of the noise draws (rows: planted, columns: answered)")
    return figure


def _short(name: str) -> str:
    return name if len(name) <= 48 else f"{name[:46]}…"


@styled
def power_figure(power: Sequence[Mapping[str, Any]], alpha: float) -> Figure:
    """Probability that the model without effects is rejected, one line an experiment, and their mean."""
    figure = Figure(figsize=(WIDE, 3.4), layout="constrained")
    axes = figure.subplots()
    for name in dict.fromkeys(one["experiment"] for one in power):
        part = [one for one in power if one["experiment"] == name]
        axes.plot([one["signal"] for one in part], [one["power"] for one in part], color=GREY, lw=0.7)
    signals = sorted({one["signal"] for one in power})
    means = [np.mean([one["power"] for one in power if one["signal"] == s]) for s in signals]
    axes.plot(signals, means, "o-", color=BLUE, label="mean over the curves")
    axes.axhline(alpha, color=VERMILION, lw=0.8, label=f"{alpha:g}")
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel("signal |P g b| in standard errors, set by scaling the noise")
    axes.set_ylabel("power")
    axes.legend()
    return figure
