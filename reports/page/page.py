"""The report: one self-contained HTML page about a finished folder, or about the parts of the flow that exist."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from birdstrike.data.curves import shot_names
from birdstrike.data.formatting import listing
from birdstrike.data.progress import Progress, part_of, silent
from birdstrike.data.storage.files import write_atomically
from birdstrike.doe.solvers import simulated_by
from birdstrike.inversion.labels import provenance
from birdstrike.reports.blocks import Picture, Section
from birdstrike.reports.comparison.models import run_models
from birdstrike.reports.explore.explore import PAGE as EXPLORE
from birdstrike.reports.figures.switches import CAMPAIGN, COLOURS, RECORD, switch
from birdstrike.reports.page.diagnosis import SECTIONS as DIAGNOSIS_SECTIONS
from birdstrike.reports.page.diagnosis import in_report
from birdstrike.reports.page.render import rendered
from birdstrike.reports.results.measurement import named, origin, origins, program_in, simulated_curves
from birdstrike.reports.results.parts import Parts, find_parts
from birdstrike.reports.results.reading import read_campaign, read_inversion, read_results
from birdstrike.reports.results.results import Results, titled
from birdstrike.reports.sections import (
    campaign,
    curves,
    energy_balance,
    identifiability,
    method_comparison,
    models,
    parameters,
    pictures,
    record,
    reproducibility,
    setup,
    summary,
    surrogates,
)
from birdstrike.reports.sections.diagnosis import read_diagnosis
from birdstrike.reports.sections.parts import (
    campaign_curves,
    campaign_findings,
    campaign_section,
    inversion_findings,
    inversion_section,
    missing_section,
)

Maker = Callable[[Results], Section | None]

DIAGNOSIS: tuple[Maker, ...] = tuple(in_report(make) for make in DIAGNOSIS_SECTIONS)
FIRST_SCREEN, *DIAGNOSIS_IN_FULL = DIAGNOSIS
SECTIONS: tuple[Maker, ...] = (
    FIRST_SCREEN,
    summary.section,
    setup.section,
    models.section,
    pictures.section,
    record.section,
    curves.section,
    parameters.section,
    identifiability.section,
    *DIAGNOSIS_IN_FULL,
    campaign.section,
    surrogates.section,
    method_comparison.section,
    energy_balance.section,
    reproducibility.section,
)
"""What the page is made of, in order; a section that has nothing to say of a folder returns None and is left out."""

INVERSION_ALONE = (
    inversion_section,
    curves.comparisons,
    parameters.section,
    identifiability.section,
    surrogates.section,
)
"""Of a page about an inversion without its campaign."""

CAMPAIGN_ALONE = (
    campaign_section,
    setup.of_case,
    campaign_curves,
    campaign.without_inversion,
    energy_balance.section,
)
"""Of a page about a campaign with which no record has been inverted."""

PARTS = ("inversion", "diagnosis", "campaign")

SIMULATIONS = 0.8  # share of the progress that the bird models' simulations take, where they are due


def report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    doe: str | Path | None = None,
    diagnosis: str | Path | None = None,
    models: bool = True,
    diagnosed: bool = True,
    progress: Progress = silent,
) -> Path:
    """Write the page about `folder` (default `folder/report.html`) and return its path; raises UserError.

    folder: of close-the-loop, run-doe, train-and-invert or diagnose; the page shows the parts that exist and names the
    others. doe, diagnosis: folders of these parts where they lie elsewhere. diagnosed: show the diagnosis, where there
    is one. models: also simulate the standard birds, and the inverted one at all instants of the animation; each
    simulation is kept in `folder/models/runs/` and runs once.
    """
    campaign, diagnoses = (Path(one) if one is not None else None for one in (doe, diagnosis))
    path = Path(out) if out is not None else Path(folder) / "report.html"
    parts = find_parts(Path(folder), campaign, diagnoses)
    if is_whole(parts):
        return write_page(read_results(parts), path, progress, models=models, diagnosed=diagnosed)
    return write_part_page(parts, path, progress)[0]


def is_whole(parts: Parts) -> bool:
    """Whether there are campaign and inversion, on which the whole page rests."""
    return parts.doe is not None and parts.inversion is not None


def write_part_page(parts: Parts, path: Path, progress: Progress = silent) -> tuple[Path, tuple[str, ...]]:
    """Write a page of the parts that exist; its path, and what was found in a few sentences. Raises UserError."""
    made: list[Section] = []
    findings, name = tuple[str, ...](), parts.folder.absolute().name
    if parts.inversion is not None:
        inverted = read_inversion(parts, parts.inversion)
        findings += inversion_findings(inverted)
        made += [make(inverted) for make in INVERSION_ALONE]
    if parts.diagnosis is not None:
        found = read_diagnosis(parts.diagnosis)
        findings += (f"Diagnosis: {found.found.sentence}.",)
        made += [make(found) for make in DIAGNOSIS_SECTIONS]
    if parts.doe is not None:
        simulated = read_campaign(parts, parts.doe)
        findings, name = findings + campaign_findings(simulated), simulated.case_name
        made += [make(simulated) for make in CAMPAIGN_ALONE]
    progress(1.0)
    shown = [part for part, there in zip(PARTS, (parts.inversion, parts.diagnosis, parts.doe), strict=True) if there]
    source = next(place for place in (parts.inversion, parts.diagnosis, parts.doe) if place is not None)
    subtitle = f"Every model curve is simulated by {program_in(source)}."
    title = f"Bird strike {name}: {' and '.join(shown)}"
    write_atomically(path, rendered(title, subtitle, [*made, missing_section(parts)]))
    return path, findings


def write_page(
    results: Results,
    path: Path,
    progress: Progress = silent,
    *,
    models: bool = True,
    diagnosed: bool = True,
) -> Path:
    """Write the page about results at hand, the bird models' simulations added where asked for; its path.

    It links to the page of `explore` where that lies beside it.
    """
    if models:
        results = run_models(results, part_of(progress, 0.0, SIMULATIONS))
    begun = SIMULATIONS if models else 0.0
    made = SECTIONS if diagnosed else tuple(make for make in SECTIONS if make not in DIAGNOSIS)
    beside = EXPLORE if (path.parent / EXPLORE).is_file() else ""
    text = page(results, part_of(progress, begun, 1.0), made, beside)
    write_atomically(path, text)
    return path


def page(
    results: Results,
    progress: Progress = silent,
    makers: Sequence[Maker] = SECTIONS,
    beside: str = "",
) -> str:
    """The page as HTML text; nothing in it points outside. beside: name of the page of `explore`, to link to."""
    sections, program = list[Section](), simulated_by(results.case)
    for done, make in enumerate(makers, 1):
        if (section := make(results)) is not None:
            sections.append(section)
        progress(done / len(makers))
    return rendered(
        title=f"Bird strike {results.case_name}: parameters from {_named(results)}",
        subtitle=f"{_provenance(results)}; every model curve is simulated by {program}.",
        sections=sections,
        switches=switches(results, sections),
        simulated=simulated_curves(results.records),
        beside=beside,
    )


def _named(results: Results) -> str:
    """`the record shot7`, and of several shots `the records shot7 and shot8`."""
    every = results.records
    return named(every[0]) if len(every) == 1 else f"the records {listing(shot_names(every))}"


def _provenance(results: Results) -> str:
    """Whether the records are measured, and of several which are simulated."""
    if len(results.records) == 1:
        return f"The record is {origin(results.record)}"
    names = shot_names(results.records)
    return provenance(names, [name for name, one in zip(names, results.records, strict=True) if one.simulated])


def switches(results: Results, sections: Sequence[Section]) -> list[dict[str, str]]:
    """The row of switches: every curve that a figure of the page can hide, with its title and line."""
    pictures = (block for section in sections for block in section.blocks if isinstance(block, Picture))
    found = {key for picture in pictures for key in picture.switches}
    titles = {
        RECORD: f"record ({origins(results.records)})",
        CAMPAIGN: "campaign's simulations",
        **{method: titled(method, results.case) for method in results.finished},
        **{key: model.title for key, model in results.models.items()},
    }
    return [switch(key, titles[key]) for key in COLOURS if key in found]
