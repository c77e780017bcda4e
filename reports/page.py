"""The report: one self-contained HTML page about a finished folder."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from data.files import write_atomically
from reports.blocks import Section
from reports.diagnosis import read_diagnosis
from reports.folder import read_results
from reports.record import origin, short_name
from reports.results import Results
from reports.sections import books, campaign, curves, parameters, reproducibility, setup, strike, summary, surrogates
from reports.sections.diagnosis import DiagnosisResults, effects_section, verdict_section
from reports.sections.reproducibility import installed

SECTIONS: tuple[Callable[[Results], Section], ...] = (
    summary.section,
    setup.section,
    curves.section,
    parameters.section,
    strike.section,
    campaign.section,
    surrogates.section,
    books.section,
    reproducibility.section,
)
DIAGNOSIS_AFTER = 4  # sections: behind the inverted parameters


def report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    progress: Callable[[float], None] | None = None,
    diagnosis: Path | None = None,
) -> Path:
    """Write the page about `folder` (default `folder/report.html`) and return its path; raises UserError.

    diagnosis: folder of a diagnosis to put into it; by default `folder/diagnosis`, where there is one.
    """
    path = Path(out) if out is not None else Path(folder) / "report.html"
    place = diagnosis or Path(folder) / "diagnosis"
    found = read_diagnosis(place) if (place / "diagnosis.json").is_file() else None
    return write_page(read_results(Path(folder)), path, progress, found)


def write_page(
    results: Results,
    path: Path,
    progress: Callable[[float], None] | None = None,
    diagnosis: DiagnosisResults | None = None,
) -> Path:
    """Write the page about results at hand; its path."""
    write_atomically(path, page(results, progress, diagnosis))
    return path


def page(
    results: Results, progress: Callable[[float], None] | None = None, diagnosis: DiagnosisResults | None = None
) -> str:
    """The page as HTML text; nothing in it points outside."""
    sections = []
    for done, make in enumerate(SECTIONS, 1):
        sections.append(make(results))
        if progress:
            progress(done / len(SECTIONS))
    if diagnosis is not None:
        sections[DIAGNOSIS_AFTER:DIAGNOSIS_AFTER] = [verdict_section(diagnosis), effects_section(diagnosis)]
    environment = Environment(
        loader=PackageLoader("reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("template.html.j2").render(
        title=f"Bird strike {results.case_name}: parameters from the record {short_name(results.record)}",
        subtitle=f"The record is {origin(results.record)}; every model curve is simulated by birdstrike.",
        sections=sections,
        version=installed("birdstrike"),
        footer=f"Written by birdstrike {installed('birdstrike')} on {datetime.now(UTC):%Y-%m-%d %H:%M} UTC.",
    )
