"""The summary begins with what the model lacks, where a diagnosis was made."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from birdstrike.reports.blocks import Lines, Paragraph
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.summary import section


def test_the_diagnosis_comes_first(results: Results, tmp_path: Path) -> None:
    assert isinstance(section(replace(results, diagnosis=None)).blocks[0], Lines)
    content = {"verdict": "attributed", "sentence": "The model lacks a faster bird", "record": {"shots": []}}
    (tmp_path / "diagnosis.json").write_text(json.dumps(content))
    (tmp_path / "diagnosis.csv").write_text("channel,time_s\n")
    first, second, *_ = section(replace(results, diagnosis=tmp_path)).blocks
    assert first == Paragraph("Diagnosis. Attributed. The model lacks a faster bird.")
    assert isinstance(second, Lines)
