"""The page of a diagnosis: what is missing, how sure that is, what to do next; then what it rests on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from birdstrike.data.storage.files import write_atomically
from birdstrike.reports.blocks import Section
from birdstrike.reports.figures.diagnosis import probability_figure, residual_figure
from birdstrike.reports.figures.style import png
from birdstrike.reports.page.render import rendered
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.diagnosis import (
    DiagnosisResults,
    basis_section,
    effects_section,
    errors_section,
    read_diagnosis,
    verdict_section,
)

SECTIONS = (verdict_section, errors_section, effects_section, basis_section)
"""What the page is made of, in order; a loop's page shows the same."""


def in_report(make: Callable[[DiagnosisResults], Section]) -> Callable[[Results], Section | None]:
    """A section of a diagnosis as one of a loop's page: None where there is no diagnosis."""

    def section(results: Results) -> Section | None:
        return make(read_diagnosis(results.diagnosis)) if results.diagnosis is not None else None

    return section


def write_diagnosis_page(folder: str | Path) -> Path:
    """Write `diagnosis.html` and two figures as PNG beside diagnosis.json; the page's path."""
    place = Path(folder)
    results = read_diagnosis(place)
    first = next(iter(results.curves.values()))
    (place / "before_after.png").write_bytes(png(residual_figure(first, results.found.units)))
    (place / "effects.png").write_bytes(png(probability_figure(results.found)))
    write_atomically(place / "diagnosis.html", page(results))
    return place / "diagnosis.html"


def page(results: DiagnosisResults) -> str:
    """The page as HTML text; nothing in it points outside."""
    made: list[Section] = [make(results) for make in SECTIONS]
    record = ", ".join(results.curves)
    return rendered(
        title=f"Diagnosis of {record}",
        subtitle=f"{results.found.provenance}; every model curve is simulated by {results.program}.",
        sections=made,
    )
