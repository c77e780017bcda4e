"""The inverted parameters: range, value, 95 % interval, and whether this record identifies them."""

from __future__ import annotations

from birdstrike.inversion.results.estimates import Estimate
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, drawing
from birdstrike.reports.figures.parameters import Mark, ParameterRow, parameters_figure
from birdstrike.reports.figures.quantities import bound, parameter_label, quantity, symbol
from birdstrike.reports.results.results import InversionResults

WORDS = (
    "A value is given only for a parameter that is identifiable from this record. Any other parameter may lie anywhere "
    "in its range; the verification ran at one point of it, which is not an estimate."
)


def section(results: InversionResults) -> Section:
    """Figure and one table; a parameter that is not identified shows its range and no digits."""
    rows = parameter_rows(results)
    blocks: list[Block] = [Paragraph(WORDS), drawing("parameters", parameters_figure(rows), _caption(results))]
    for method in results.finished:
        if (combination := results.inversion.methods[method].combination) is not None:
            blocks.append(Paragraph(f"By the {method}: {combination.sentence}"))
    return Section("parameters", "Inverted parameters", (*blocks, _table(results, rows)))


def parameter_rows(results: InversionResults) -> list[ParameterRow]:
    """The parameters with their ranges, SI, and each method's value and interval."""
    found, units = results.inversion, results.units
    return [
        ParameterRow(name, units[name], low, high, _marks(results, name), name in found.logarithmic)
        for name, (low, high) in found.ranges.items()
    ]


def _marks(results: InversionResults, name: str) -> dict[str, Mark]:
    """Nothing to draw where the parameter is not identified."""
    found = {method: results.inversion.methods[method].parameters[name] for method in results.finished}
    return {m: Mark(e.value, e.interval_95) if e.identified else Mark(None, None) for m, e in found.items()}


def _caption(results: InversionResults) -> str:
    texts = []
    for method in results.finished:
        parameters = results.inversion.methods[method].parameters
        found = [symbol(name, parameters) for name, estimate in parameters.items() if estimate.identified]
        texts.append(f"the {method} identifies {', '.join(found) if found else 'none'}")
    scale = ", in its logarithm where it spans decades" if results.inversion.logarithmic else ""
    return f"Each bar is a parameter's range{scale}: {'; '.join(texts)}. Hatched: identified by no method."


def _table(results: InversionResults, rows: list[ParameterRow]) -> Table:
    head = ("parameter", "range", "method", "value", "95 % interval", "identified", "reason")
    cells = [
        (
            *(_named(row, rows) if method == results.best else ("", "")),
            method,
            *_estimate(results.inversion.methods[method].parameters[row.name], row),
        )
        for row in rows
        for method in results.finished
    ]
    names = [row.name for row in rows]
    keys = ", ".join(f"{symbol(row.name, names)} = {row.name}" for row in rows)
    return Table(head, tuple(cells), f"The parameters by each method. Case keys: {keys}.", frozenset({3}))


def _named(row: ParameterRow, rows: list[ParameterRow]) -> tuple[str, str]:
    """The parameter and its range, said once for all methods."""
    label = parameter_label(row.name, [one.name for one in rows])
    return label, f"{bound(row.low, row.unit)} to {bound(row.high, row.unit)}"


def _estimate(estimate: Estimate, row: ParameterRow) -> tuple[str, str, str, str]:
    """Value, interval, identified, reason; the interval of what is not identified is its range or its stated prior."""
    interval = "–"
    if estimate.interval_95 is not None:
        interval = " to ".join(quantity(end, estimate.unit) for end in estimate.interval_95)
    if not estimate.identified or estimate.value is None:
        narrower = estimate.interval_95 not in (None, (row.low, row.high))
        return "–", interval if narrower else "whole range", "no", estimate.reason
    return quantity(estimate.value, estimate.unit), interval, "yes", estimate.reason
