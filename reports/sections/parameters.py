"""The inverted parameters: range, value, 95 % interval, and whether the record tells them at all."""

from __future__ import annotations

from reports.blocks import Paragraph, Section, Table, drawing
from reports.figures.parameters import Estimate, ParameterRow, parameters_figure
from reports.figures.quantities import bound, parameter_label, quantity, symbol
from reports.results import Method, ParameterEstimate, Results


def section(results: Results) -> Section:
    """Figure and one table; a parameter that is not identified shows its range and no digits."""
    words = (
        "An interval is what the record leaves possible, not what the method prefers. Where the record does not tell a "
        "parameter, no number is given: any value of the range would have done."
    )
    blocks = (Paragraph(words), drawing("parameters", parameters_figure(_rows(results)), _caption(results)))
    return Section("parameters", "Inverted parameters", (*blocks, _table(results)))


def _rows(results: Results) -> list[ParameterRow]:
    dataset = results.dataset
    ranges = zip(dataset.names, dataset.units, dataset.lows, dataset.highs, strict=True)
    return [
        ParameterRow(name, unit, float(low), float(high), {m.name: _drawn(m, name) for m in results.methods.values()})
        for name, unit, low, high in ranges
    ]


def _drawn(method: Method, name: str) -> Estimate:
    """Nothing to draw where the parameter is not identified."""
    estimate = method.parameters[name]
    return Estimate(estimate.value, estimate.interval) if estimate.identified else Estimate(None, None)


def _caption(results: Results) -> str:
    told = {
        method.name: [symbol(name) for name, estimate in method.parameters.items() if estimate.identified]
        for method in results.methods.values()
    }
    texts = [f"the {name} identifies {', '.join(names) if names else 'none'}" for name, names in told.items()]
    return f"Each bar is a parameter's range: {'; '.join(texts)}. Hatched: identified by no method."


def _table(results: Results) -> Table:
    head = ("parameter", "case key", "range", "method", "value", "95 % interval", "identified", "reason")
    rows = [
        (parameter_label(row.name), row.name, f"{bound(row.low, row.unit)} to {bound(row.high, row.unit)}", *cells)
        for row in _rows(results)
        for method in results.methods.values()
        for cells in [(method.name, *_cells(method.parameters[row.name], row))]
    ]
    return Table(head, tuple(rows), "The parameters by each method.", frozenset({4}))


def _cells(estimate: ParameterEstimate, row: ParameterRow) -> tuple[str, str, str, str]:
    """Value, interval, identified, reason."""
    if not estimate.identified or estimate.value is None:
        return "–", "whole range", "no", estimate.reason
    interval = "–"
    if estimate.interval is not None:
        interval = " to ".join(quantity(end, row.unit) for end in estimate.interval)
    return quantity(estimate.value, row.unit), interval, "yes", estimate.reason
