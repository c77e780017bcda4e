"""The report: one self-contained HTML page about a finished folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from birdstrike.data.files import write_atomically
from birdstrike.reports.blocks import Picture, Section
from birdstrike.reports.comparison.models import run_models
from birdstrike.reports.explore.explore import PAGE as EXPLORE
from birdstrike.reports.figures.switches import CAMPAIGN, COLOURS, DASHES, RECORD
from birdstrike.reports.page.diagnosis import SECTIONS as DIAGNOSIS_SECTIONS
from birdstrike.reports.page.diagnosis import in_report
from birdstrike.reports.page.render import rendered
from birdstrike.reports.results.measurement import origin, short_name
from birdstrike.reports.results.reading import read_results
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

Maker = Callable[[Results], Section | None]

DIAGNOSIS: tuple[Maker, ...] = tuple(in_report(make) for make in DIAGNOSIS_SECTIONS)
SECTIONS: tuple[Maker, ...] = (
    summary.section,
    setup.section,
    models.section,
    pictures.section,
    record.section,
    curves.section,
    parameters.section,
    identifiability.section,
    *DIAGNOSIS,
    campaign.section,
    surrogates.section,
    method_comparison.section,
    energy_balance.section,
    reproducibility.section,
)
"""What the page is made of, in order; a section that has nothing to say of a folder returns None and is left out."""

SIMULATIONS = 0.8  # share of the progress that the bird models' simulations take, where they are due


def report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    models: bool = True,
    diagnosed: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write the page about `folder` (default `folder/report.html`) and return its path; raises UserError.

    diagnosed: show what lies in `folder/diagnosis`, where there is one. models: also simulate the standard birds, and
    the inverted one at all instants of the animation; each simulation is kept in `folder/models/runs/` and runs once.
    """
    path = Path(out) if out is not None else Path(folder) / "report.html"
    return write_page(read_results(Path(folder)), path, progress, models=models, diagnosed=diagnosed)


def write_page(
    results: Results,
    path: Path,
    progress: Callable[[float], None] | None = None,
    *,
    models: bool = True,
    diagnosed: bool = True,
) -> Path:
    """Write the page about results at hand, the bird models' simulations added where asked for; its path.

    It links to the page of `explore` where that lies beside it.
    """
    report_share = progress or (lambda _: None)
    if models:
        results = run_models(results, lambda share: report_share(SIMULATIONS * share))
    begun = SIMULATIONS if models else 0.0
    made = SECTIONS if diagnosed else tuple(make for make in SECTIONS if make not in DIAGNOSIS)
    beside = EXPLORE if (path.parent / EXPLORE).is_file() else ""
    text = page(results, lambda share: report_share(begun + (1.0 - begun) * share), made, beside)
    write_atomically(path, text)
    return path


def page(
    results: Results,
    progress: Callable[[float], None] | None = None,
    makers: Sequence[Maker] = SECTIONS,
    beside: str = "",
) -> str:
    """The page as HTML text; nothing in it points outside. beside: name of the page of `explore`, to link to."""
    sections: list[Section] = []
    for done, make in enumerate(makers, 1):
        if (section := make(results)) is not None:
            sections.append(section)
        if progress:
            progress(done / len(makers))
    return rendered(
        title=f"Bird strike {results.case_name}: parameters from the record {short_name(results.record)}",
        subtitle=f"The record is {origin(results.record)}; every model curve is simulated by birdstrike.",
        sections=sections,
        switches=switches(results, sections),
        beside=beside,
    )


def switches(results: Results, sections: Sequence[Section]) -> list[dict[str, str]]:
    """The row of switches: every curve that a figure of the page can hide, with its title, colour and dashes."""
    pictures = (block for section in sections for block in section.blocks if isinstance(block, Picture))
    found = {key for picture in pictures for key in picture.switches}
    titles = {
        RECORD: f"record ({origin(results.record)})",
        CAMPAIGN: "campaign's simulations",
        **{method: titled(method, results.case) for method in results.finished},
        **{key: model.title for key, model in results.models.items()},
    }
    return [
        {"key": key, "title": titles[key], "colour": COLOURS[key], "dashes": _dashes(key)}
        for key in COLOURS
        if key in found
    ]


def _dashes(key: str) -> str:
    """A curve's dashes as SVG has them, short enough for a switch to show them."""
    dashes = DASHES.get(key, "-")
    return "none" if isinstance(dashes, str) else " ".join(f"{1.2 * length:.3g}" for length in dashes[1])
