"""Reading a finished folder: runs that are whole and damaged ones, and the damaged tables of an answer."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from birdstrike.data.errors import UserError
from birdstrike.data.storage.store import RunStore
from birdstrike.inversion.results.diagnosis_files import COLUMNS, read_curves
from birdstrike.reports.explore.explore import explore
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


MEASURED = "measured_displacement_centre_m"


@pytest.mark.parametrize(
    ("name", "damage", "why"),
    [
        ("verification.csv", lambda table: table.drop(columns=MEASURED), f"no column {MEASURED}"),
        ("verification.csv", lambda table: table.assign(**{MEASURED: np.nan}), f"{MEASURED} has no value"),
        ("verification.csv", lambda table: table.assign(**{MEASURED: 0.0}), f"{MEASURED} has no value other than 0"),
        ("verification.csv", lambda table: table.assign(**{MEASURED: "scrambled"}), "scrambled"),
        ("training.csv", lambda table: table.drop(columns="mse"), "no column mse"),
        ("posterior.csv", lambda table: table.iloc[:, :1], "no column bird.material"),
    ],
)
def test_a_damaged_table_of_an_answer_is_named_with_what_to_do(
    finished: Path, tmp_path: Path, name: str, damage: Callable[[pd.DataFrame], pd.DataFrame], why: str
) -> None:
    """They ended in a KeyError, a ValueError of argmax or a ZeroDivisionError."""
    for part in ("doe", "inversion"):
        shutil.copytree(finished / part, tmp_path / part)
    path = tmp_path / "inversion" / name
    damage(pd.read_csv(path)).to_csv(path, index=False)
    expected = rf"{name} is damaged or of another version \(.*{why}.*\); repeat train-and-invert"
    with pytest.raises(UserError, match=expected):
        read_results(tmp_path)
    if name == "verification.csv":
        with pytest.raises(UserError, match=expected):
            explore(tmp_path)


def test_damaged_curves_of_a_diagnosis_are_named_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "diagnosis.csv").write_text(f"channel,time_s,{','.join(COLUMNS[1:])}\n")
    with pytest.raises(UserError, match=r"diagnosis.csv is damaged .*no column measured\); repeat birdstrike diagnose"):
        read_curves(tmp_path / "diagnosis.csv")
