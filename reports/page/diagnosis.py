"""The page of a diagnosis: before and after, the confidence set, and the sentence for a test report."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from birdstrike.data.errors import UserError
from birdstrike.data.files import write_atomically
from birdstrike.reports.blocks import Section
from birdstrike.reports.figures.diagnosis import before_after_figure, consistency_figure
from birdstrike.reports.figures.style import png
from birdstrike.reports.page.render import rendered
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.diagnosis import DiagnosisResults, effects_section, verdict_section
from birdstrike.reports.sections.diagnosis_trust import trust_section


def read_diagnosis(folder: Path) -> DiagnosisResults:
    """diagnosis.json and diagnosis.csv of a folder; raises UserError where they are missing or damaged."""
    path = folder / "diagnosis.json"
    if not path.is_file() or not (folder / "diagnosis.csv").is_file():
        raise UserError(
            f"no diagnosis in {folder}; make it with: birdstrike diagnose CASE --measured CSV --out {folder}"
        )
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UserError(f"{path} is damaged; repeat birdstrike diagnose") from error
    return DiagnosisResults(content, pd.read_csv(folder / "diagnosis.csv"))


def in_report(make: Callable[[DiagnosisResults], Section]) -> Callable[[Results], Section | None]:
    """A section of a diagnosis as one of a loop's page: None where its folder holds no diagnosis."""

    def section(results: Results) -> Section | None:
        place = results.folder / "diagnosis"
        return make(read_diagnosis(place)) if (place / "diagnosis.json").is_file() else None

    return section


def write_diagnosis_page(folder: str | Path) -> Path:
    """Write `diagnosis.html` and the two figures as PNG beside diagnosis.json; the page's path."""
    place = Path(folder)
    results = read_diagnosis(place)
    for name, figure in (
        ("before_after.png", before_after_figure(results.curves, results.units)),
        ("effects.png", consistency_figure(results.content["effects"], results.content["alpha"])),
    ):
        (place / name).write_bytes(png(figure))
    write_atomically(place / "diagnosis.html", page(results))
    return place / "diagnosis.html"


def page(results: DiagnosisResults) -> str:
    """The page as HTML text; nothing in it points outside."""
    made: list[Section] = [verdict_section(results), effects_section(results), trust_section(results)]
    record = Path(results.content["record"]["path"]).stem or "record"
    kind = "simulated, not measured" if results.content["record"]["simulated"] else "measured"
    return rendered(
        title=f"Diagnosis of the record {record}",
        subtitle=f"The record is {kind}; every model curve is simulated by birdstrike.",
        sections=made,
    )
