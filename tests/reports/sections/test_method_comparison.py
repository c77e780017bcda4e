"""The table of methods side by side, as it lands in the report."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

from birdstrike.data.storage.files import write_json
from birdstrike.inversion.identifiability.coverage import Coverage
from birdstrike.inversion.method_comparison import ABOVE, ALLOWED, MethodScore
from birdstrike.reports.blocks import Table
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections import method_comparison

VISCOSITY = "bird.material.viscosity"


def test_without_a_comparison_there_is_no_section(results: Results) -> None:
    assert method_comparison.section(results) is None


def test_methods_stand_under_what_their_condition_allows_which_is_no_bound_of_one_error(
    results: Results, tmp_path: Path
) -> None:
    clean = MethodScore("no noise", "network LM", {VISCOSITY: 0.2}, None, 1.5, 25, 0.1, None)
    noisy = [
        MethodScore("noise", method, {VISCOSITY: 0.1}, 0.7, 1.2, 25, 3.0, {VISCOSITY: 0.04}) for method in ("LM", "MAP")
    ]
    same = {VISCOSITY: 0.5}
    covered = Coverage("solver", 20, {VISCOSITY: 0.25}, {VISCOSITY: 0.4}, same, same, same, same, 0)
    content = {
        "campaign_runs": 25,
        "truth": {VISCOSITY: 420.0},
        "table": [asdict(row) for row in (clean, *noisy)],
        "coverage": {"noise": [asdict(covered)]},
    }
    write_json(tmp_path / method_comparison.FILE, content)
    found = method_comparison.section(replace(results, folder=tmp_path))
    assert found is not None
    methods, coverage = (block for block in found.blocks if isinstance(block, Table))
    assert [row[1] for row in methods.rows] == ["network LM", ALLOWED, "LM", "MAP"]
    assert ABOVE in str(found.blocks[0])
    assert "may lie below" in ABOVE
    assert "bound" not in str(found)
    assert methods.rows[0][2:5] == ("20", "–", "1.50")
    assert methods.rows[1][2] == "4"
    assert coverage.rows == (("20 made by the solver", "40 % (identified in 25 %)"),)
