"""All inversion methods on records of known truth, where `birdstrike compare-methods` has written its table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from birdstrike.data.storage.files import read_json
from birdstrike.inversion.method_comparison import ABOVE, ALLOWED
from birdstrike.reports.blocks import Paragraph, Section, Table
from birdstrike.reports.figures.quantities import symbol
from birdstrike.reports.results.results import Results

FILE = "comparison/comparison.json"


def section(results: Results) -> Section | None:
    """From `comparison/` in the folder; None where there is none."""
    path = results.folder / FILE
    if not path.is_file():
        return None
    content = read_json(path)
    truth = ", ".join(f"{symbol(name, content['truth'])} {value:.4g}" for name, value in content["truth"].items())
    intro = (
        f"Simulated records of known truth ({truth}, SI) from a campaign of {content['campaign_runs']} simulations: "
        f"the error of each method. {ABOVE}"
    )
    return Section("method_comparison", "Comparison of the inversion methods", (Paragraph(intro), *_tables(content)))


def _tables(content: Mapping[str, Any]) -> Iterator[Table]:
    rows = content["table"]
    if rows:
        names = tuple(rows[0]["errors"])
        head = ("condition", "method", *map(symbol, names), "emulated curve", "verified curve", "runs", "seconds")
        caption = (
            "Errors of the parameters in % of their ranges; of the curves in units of the smallest noise (0.02 mm and "
            "its like), by the emulator and by the solver."
        )
        yield Table(head, tuple(_lines(rows, names)), caption, frozenset(range(2, len(head))))
    for condition, entries in content["coverage"].items():
        names = tuple(entries[0]["hits_all"]) if entries else ()
        cells = tuple(
            (f"{e['truths']} made by the {e['made_by']}", *(_held(e, name) for name in names)) for e in entries
        )
        caption = (
            f"Share of the truths that the 95 % intervals held where the parameter was called identified: {condition}."
        )
        yield Table(("truths", *map(symbol, names)), cells, caption, frozenset(range(1, len(names) + 1)))


def _held(entry: Mapping[str, Any], name: str) -> str:
    """Hits among the identified, and how many those are."""
    hits, identified = entry["hits"][name], 100.0 * entry["identified"][name]
    return "never identified" if hits is None else f"{100.0 * hits:.0f} % (identified in {identified:.0f} %)"


def _lines(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """One line a method; before the first of a condition the standard deviation that this allows, where it has one."""
    before = None
    for row in rows:
        if row["bounds"] and row["condition"] != before:
            bound = (f"{100 * row['bounds'][name]:.2g}" for name in names)
            yield (row["condition"], ALLOWED, *bound, "", "", "", "")
        before = row["condition"]
        errors = (f"{100 * row['errors'][name]:.2g}" for name in names)
        predicted = "–" if row["predicted"] is None else f"{row['predicted']:.2f}"
        figures = (predicted, f"{row['verified']:.2f}", str(row["runs"]), f"{row['seconds']:.1f}")
        yield (row["condition"], row["method"], *errors, *figures)
