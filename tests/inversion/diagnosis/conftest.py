"""One diagnosis of a tiny rig through the command line, for all tests that read what it leaves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.inversion.diagnosis.inference.ranking import Ranking
from birdstrike.inversion.diagnosis.model_file import model_table
from birdstrike.inversion.diagnosis.preparation.shots import Shot
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.diagnosis_files import write
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.write import case_toml
from tests.inversion.diagnosis.rig import few_simulations, shot, tiny

Answered = tuple[Ranking, tuple[Shot, ...]]


def command(folder: Path, answered: list[Answered], diagnoses: list[Diagnosis], out: str, *words: str) -> Result:
    """`birdstrike diagnose` of the folder's case, with simulations in `out/`; adds what it made to the lists."""

    def kept(ranking: Ranking, shots: tuple[Shot, ...], fits: dict[str, str]) -> dict[str, Any]:
        answered.append((ranking, shots))
        return model_table(ranking, shots, fits)

    def written(found: Diagnosis, place: Path, declared: Mapping[str, Case]) -> Diagnosis:
        diagnoses.append(write(found, place, declared))
        return diagnoses[-1]

    first = ["--doe", str(folder / "out")] if out != "out" else []
    given = ["--out", str(folder / out), *first, "--workers", "1", *words]
    with few_simulations() as patch:
        patch.setattr("birdstrike.inversion.diagnosis.pipeline.model_table", kept)
        patch.setattr("birdstrike.inversion.diagnosis.diagnose.write", written)
        return CliRunner().invoke(app, ["diagnose", str(folder / "case.toml"), *given], env={"COLUMNS": "200"})


@dataclass(frozen=True)
class Laboratory:
    """Folder with case.toml, clean.csv and loose.csv (edges that let go), and the command's first result.

    answered: what the answer was made of, ranking and measured shots, for each diagnosis; diagnoses: the answers.
    """

    folder: Path
    first: Result
    answered: list[Answered]
    diagnoses: list[Diagnosis]

    def diagnose(self, out: str, *words: str) -> Result:
        """`birdstrike diagnose` with the first call's simulations at hand."""
        return command(self.folder, self.answered, self.diagnoses, out, *words)

    def content(self, out: str = "out") -> dict[str, Any]:
        """diagnosis.json."""
        return json.loads((self.folder / out / "diagnosis.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Laboratory:
    """Diagnosed beside a baseline."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "case.toml").write_text(case_toml(tiny()), encoding="utf-8")
    shot(folder, "clean", 1)
    shot(folder, "loose", 2, plate={"edges": "pinned"})
    records = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    answered, diagnoses = list[Answered](), list[Diagnosis]()
    return Laboratory(folder, command(folder, answered, diagnoses, "out", *records), answered, diagnoses)
