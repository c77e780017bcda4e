"""The page of calibrate-models: which bird model predicts best, calibrated beside published constants."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from birdstrike.data.curves import read_histories, read_measured
from birdstrike.data.formatting import many
from birdstrike.data.histories import Histories
from birdstrike.data.storage.files import write_atomically
from birdstrike.inversion.labels import provenance
from birdstrike.inversion.models.results import read_comparison
from birdstrike.reports.figures.switches import CALIBRATED, PUBLISHED, RECORD, switch
from birdstrike.reports.page.render import rendered
from birdstrike.reports.results.measurement import program_in, simulated_curves
from birdstrike.reports.sections.calibrated_models import (
    ModelsResults,
    answer_section,
    basis_section,
    constants_section,
    curves_section,
)

SECTIONS = (answer_section, constants_section, curves_section, basis_section)
"""What the page is made of, in order."""
SWITCHES = {RECORD: "record", CALIBRATED: "calibrated constants", PUBLISHED: "published constants"}


def read_models(folder: Path) -> ModelsResults:
    """models.json and the curves of a folder; raises UserError where they are missing or damaged."""
    comparison = read_comparison(folder)
    shots = list(comparison.speeds)
    records = {s: comparison.measured[s].above_rest(read_measured(folder / "records" / f"{s}.csv")) for s in shots}
    curves = {what: {s: _curves(folder, what, s, comparison.models) for s in shots} for what in (CALIBRATED, PUBLISHED)}
    program = program_in(folder / next(iter(comparison.models)) / shots[0])
    return ModelsResults(comparison, records, curves[CALIBRATED], curves[PUBLISHED], program)


def _curves(folder: Path, what: str, shot: str, names: Iterable[str]) -> dict[str, Histories]:
    files = {name: folder / name / f"{what}_{shot}.csv" for name in names}
    return {name: read_histories(path) for name, path in files.items() if path.is_file()}


def write_models_page(folder: str | Path) -> Path:
    """Write `models.html` beside models.json; its path."""
    place = Path(folder)
    write_atomically(place / "models.html", page(read_models(place)))
    return place / "models.html"


def page(results: ModelsResults) -> str:
    """The page as HTML text; nothing in it points outside."""
    simulated = [shot for shot, record in results.records.items() if record.simulated]
    known = provenance(list(results.records), simulated)
    return rendered(
        title=f"Bird models calibrated to {many(len(results.records), 'shot')}",
        subtitle=f"{known}; every model curve is simulated by {results.program}.",
        sections=[make(results) for make in SECTIONS],
        switches=[switch(key, title) for key, title in SWITCHES.items()],
        simulated=simulated_curves(list(results.records.values())),
    )
