"""The page begins with what the model lacks, where a diagnosis was made, and with the summary where none was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from birdstrike.reports.blocks import Paragraph, Picture, Warnings
from birdstrike.reports.page.page import SECTIONS
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections import diagnosis, summary
from tests.diagnoses import effect, written_diagnosis

WARNINGS = tuple(f"warning {number}" for number in range(7))


def test_what_the_model_lacks_comes_first(results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written_diagnosis(tmp_path, effect("impact_speed"), sentence="The model lacks a faster bird", warnings=WARNINGS)
    (tmp_path / "diagnosis.csv").write_text("channel,time_s\n")
    for name in ("probability_figure", "residual_figure"):
        monkeypatch.setattr(diagnosis, name, lambda *_: Figure())
    begins = SECTIONS[0](replace(results, diagnosis=tmp_path))
    assert begins is not None
    said, step, likely, residuals, warned, further = begins.blocks
    assert said == Paragraph("Attributed. The model lacks a faster bird.")
    assert isinstance(step, Paragraph)
    assert step.text.startswith("What to do: check at the rig: impact speed; ")
    assert isinstance(likely, Picture)
    assert isinstance(residuals, Picture)
    assert warned == Warnings(WARNINGS[:5])
    assert further == Paragraph("Further warnings: 2, under `warnings` in diagnosis.json.")
    assert SECTIONS[0](replace(results, diagnosis=None)) is None
    assert SECTIONS[1] is summary.section
