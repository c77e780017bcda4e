"""Figures of the audit: what was planted against what was answered, and stated probabilities against frequencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from birdstrike.inversion.labels import in_words
from birdstrike.reports.figures.style import BLUE, GREY, VERMILION, WIDE, styled

LAST = ("none needed", "ambiguous, truth among them", "ambiguous, truth not among them", "unexplained")


@styled
def confusion_figure(confusion: Mapping[str, Mapping[str, float]]) -> Figure:
    """Rows: what was planted; columns: the answer; shares of the records."""
    answers = sorted({a for row in confusion.values() for a in row if a not in LAST}) + list(LAST)
    matrix = np.array([[row.get(answer, 0.0) for answer in answers] for row in confusion.values()])
    figure = Figure(figsize=(WIDE, 0.3 * len(matrix) + 2.6), layout="constrained")
    axes = figure.subplots()
    axes.imshow(matrix, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.grid(visible=False)
    axes.set_xticks(range(len(answers)), [_short(name) for name in answers], rotation=40, ha="right")
    axes.set_yticks(range(len(matrix)), [_short(name) for name in confusion])
    for i, row in enumerate(matrix):
        for j, share in enumerate(row):
            if share >= 0.005:
                axes.text(
                    j, i, f"{100 * share:.0f}", ha="center", va="center", color="w" if share > 0.6 else "k", size=7
                )
    axes.set_title("answers in % of the records (rows: planted, columns: answered)")
    return figure


def _short(name: str) -> str:
    """`bird_yaw + impact_offset@shot1` as words, cut where it is long; an answer that is a sentence stays as it is."""
    words = name if name in LAST else " + ".join(in_words(one) for one in name.split(" + "))
    return words if len(words) <= 48 else f"{words[:46]}…"


@styled
def reliability_figure(deciles: Sequence[Mapping[str, Any]]) -> Figure:
    """How often what is stated with a probability is true, with 95 % intervals; on the diagonal it is as stated."""
    figure = Figure(figsize=(0.55 * WIDE, 0.55 * WIDE), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], color=GREY, lw=0.8)
    for one in deciles:
        if one["truths"]:
            colour = BLUE if one["within"] else VERMILION
            axes.plot([one["stated"]] * 2, one["interval_95"], color=colour, lw=1.2)
            axes.plot(one["stated"], one["true"], "o", color=colour, ms=4.0)
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel("stated probability")
    axes.set_ylabel("share that is true")
    axes.set_title("reliability of the stated probabilities")
    return figure
