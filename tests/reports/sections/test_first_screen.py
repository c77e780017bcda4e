"""The page begins with what the model lacks, where a diagnosis was made, and with the summary where none was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from birdstrike.inversion.results.diagnosis_files import COLUMNS
from birdstrike.inversion.results.fit import TimeOrigin
from birdstrike.reports.blocks import Paragraph, Picture, Table, Warnings
from birdstrike.reports.page.page import SECTIONS
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections import diagnosis, energy_balance, summary
from tests.diagnoses import effect, written_diagnosis

WARNINGS = tuple(f"warning {number}" for number in range(7))


def test_what_the_model_lacks_comes_first(results: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written_diagnosis(tmp_path, effect("impact_speed"), sentence="The model lacks a faster bird", warnings=WARNINGS)
    (tmp_path / "diagnosis.csv").write_text(f"channel,time_s,{','.join(COLUMNS)}\n")
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
    assert further == Paragraph("Further warnings: 2, in diagnosis.json.")
    assert SECTIONS[0](replace(results, diagnosis=None)) is None
    assert SECTIONS[1] is summary.section


def test_the_diagnosis_s_own_simulations_are_not_claimed_to_be_listed(results: Results, tmp_path: Path) -> None:
    """ "This report rests on 31 simulations" stood below a diagnosis that had run 145 more."""

    def said(one: Results) -> str:
        first = energy_balance.section(one).blocks[0]
        assert isinstance(first, Paragraph)
        return first.text

    assert said(results).startswith(f"Listed: {len(results.every_summary)} simulations. ")
    table = energy_balance.section(results).blocks[-1]
    assert isinstance(table, Table)
    assert "< 10⁻⁷ %" in {row[2] for row in table.rows}, "4.3e-16"
    diagnosed = said(replace(results, diagnosis=tmp_path))
    assert "simulations; those that the diagnosis has run besides are not among them. " in diagnosed


def test_a_difference_has_two_digits_and_no_bare_point() -> None:
    """-4 % stood below -5.2 %."""
    assert [summary.signed(x, "%") for x in (-4.0, 12.4, 0.0, 118.0, 7.38, 99.6)] == [
        "−4.0 %",
        "+12 %",
        "+0.0 %",
        "+118 %",
        "+7.4 %",
        "+100 %",
    ]


def test_errors_without_a_shift_of_clocks_are_told_only_where_there_is_one(results: Results) -> None:
    inversion = results.inversion
    fixed, fitted = (replace(inversion, time_offset=TimeOrigin(0.0, sigma, None)) for sigma in (None, 1e-6))
    assert "RMS, clocks not shifted" in summary.methods_table(replace(results, inversion=fitted)).head
    table = summary.methods_table(replace(results, inversion=fixed))
    assert "RMS, clocks not shifted" not in table.head
    assert {len(row) for row in table.rows} == {len(table.head)}
