"""The notebook of the tour does what its committed output shows: every cell runs, and the results show themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

from tests.docs.pages import ROOT

NOTEBOOK = json.loads((ROOT / "docs" / "tour.ipynb").read_text(encoding="utf-8"))
CELLS = [cell for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def test_every_cell_was_run_and_no_run_failed() -> None:
    for number, cell in enumerate(CELLS, 1):
        assert cell["execution_count"] == number, "run: make tour"
        assert not [one for one in cell["outputs"] if one["output_type"] == "error"]
    shown = [one["data"] for cell in CELLS for one in cell["outputs"] if one["output_type"] == "execute_result"]
    tables = ["".join(data["text/html"]) for data in shown if "text/html" in data]
    assert [text.split("</b>")[0].split("<b>")[1].split(" ")[0].rstrip(":") for text in tables] == [
        "Histories",
        "Dataset",
        "Inversion",
    ]
    for text in tables:
        assert "<table" in text
        assert "data:image/png;base64," in text


def test_the_cells_run_one_after_the_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a coarser mesh than the notebook's, with fewer runs."""
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    names: dict[str, Any] = {"__name__": "tour"}
    meshes = {'"bird.particles": 400': '"bird.particles": 200', "[16, 14]": "[12, 10]"}
    sources = ["".join(cell["source"]) for cell in CELLS]
    assert all(fine in sources[0] for fine in meshes)
    for fine, coarse in meshes.items():
        sources[0] = sources[0].replace(fine, coarse)
    assert any("runs=14" in source for source in sources)
    for source in (one.replace("runs=14", "runs=9") for one in sources):
        exec(compile(source, "docs/tour.ipynb", "exec"), names)
    found = names["inversion"].to_dataframe().set_index("parameter")
    assert list(found.index) == ["bird.material.pressure_cutoff", "bird.material.viscosity"]
    viscosity = found.loc["bird.material.viscosity"]
    assert viscosity["identified"]
    assert viscosity["low_95"] < 700.0 < viscosity["high_95"]
    assert names["posterior"].posterior.sizes["draw"] > 100
    assert (tmp_path / "inversion" / "explore.html").is_file()
