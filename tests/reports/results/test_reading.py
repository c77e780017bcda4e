"""Reading a finished folder: what a run's file that is whole, and one that is damaged, gives for its energy balance."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from birdstrike.data.store import RunStore
from birdstrike.reports.results.reading import read_results


def test_a_damaged_run_counts_by_the_campaigns_own_entry(finished: Path, tmp_path: Path) -> None:
    """Steps stand in the run's file alone, the energy error in the campaign's summary too."""
    for part in ("doe", "inversion"):
        shutil.copytree(finished / part, tmp_path / part)
    first, second = json.loads((tmp_path / "doe" / "summary.json").read_text())["runs"][:2]
    store = RunStore(tmp_path / "doe" / "runs")
    with store.path(first["key"]).open("r+b") as file:
        file.truncate(500)
    with pytest.warns(UserWarning, match="is damaged"):
        summaries = read_results(tmp_path).summaries
    assert "steps" not in summaries[f"run {first['run']}"]
    assert summaries[f"run {first['run']}"]["energy_error"] == first["energy_error"]
    whole = store.look_up(second["key"])
    assert whole is not None
    assert summaries[f"run {second['run']}"] == {**second, **whole.summary}
