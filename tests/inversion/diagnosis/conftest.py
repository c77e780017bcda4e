"""One diagnosis of a tiny rig through the command line, for all tests that read what it leaves."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.inversion.diagnosis.answer import Diagnosis
from birdstrike.inversion.diagnosis.diagnose import write
from birdstrike.inversion.diagnosis.model_file import model_table
from birdstrike.inversion.diagnosis.plan import make_plan
from birdstrike.inversion.diagnosis.ranking import Ranking
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.solver.case.write import case_toml
from birdstrike.solver.effects.registry import effects
from tests.inversion.diagnosis.rig import PARTICLES, SOUGHT, shot, tiny


def command(folder: Path, out: str, *words: str) -> Result:
    """`birdstrike diagnose` of the folder's case, with simulations that lie in `out/`."""
    given = ["--out", str(folder / out), "--doe", str(folder / "out"), "--workers", "1", *words]
    return CliRunner().invoke(app, ["diagnose", str(folder / "case.toml"), *given], env={"COLUMNS": "200"})


@dataclass(frozen=True)
class Laboratory:
    """Folder with case.toml, clean.csv and loose.csv (edges that let go), and the command's first result.

    answered: what the answer was made of, ranking and measured shots, for each diagnosis; diagnoses: the answers.
    """

    folder: Path
    first: Result
    answered: list[tuple[Ranking, tuple[Shot, ...]]]
    diagnoses: list[Diagnosis]

    def diagnose(self, out: str, *words: str) -> Result:
        """`birdstrike diagnose` with the first call's simulations at hand."""
        return command(self.folder, out, *words)

    def content(self, out: str = "out") -> dict[str, Any]:
        """diagnosis.json."""
        return json.loads((self.folder / out / "diagnosis.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    """Diagnosed beside a baseline; simulations on threads, because processes would load all anew."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "case.toml").write_text(case_toml(tiny()), encoding="utf-8")
    shot(folder, "clean", 1)
    shot(folder, "loose", 2, plate={"edges": "pinned"})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.inversion.diagnosis.simulations.process_pool", ThreadPoolExecutor)
        sought = {name: effects()[name] for name in SOUGHT}
        patch.setattr("birdstrike.inversion.diagnosis.plan.effects", lambda: sought)
        patch.setattr("birdstrike.inversion.diagnosis.plan.COARSE_PARTICLES", PARTICLES)
        patch.setattr("birdstrike.inversion.diagnosis.plan.FINE_RUNS", 5)
        patch.setattr("birdstrike.inversion.diagnosis.solver_update.MOST", 1)
        patch.setattr("birdstrike.inversion.diagnosis.solver_update.REPLICATES", 2)
        patch.setattr(
            "birdstrike.inversion.diagnosis.diagnose.make_plan", lambda case, _, seed: make_plan(case, 9, seed)
        )
        answered, diagnoses = list[Any](), list[Diagnosis]()

        def kept(ranking: Ranking, shots: tuple[Shot, ...], fits: dict[str, str]) -> dict[str, Any]:
            answered.append((ranking, shots))
            return model_table(ranking, shots, fits)

        def written(found: Diagnosis, out: Path) -> Diagnosis:
            diagnoses.append(write(found, out))
            return diagnoses[-1]

        patch.setattr("birdstrike.inversion.diagnosis.pipeline.model_table", kept)
        patch.setattr("birdstrike.inversion.diagnosis.diagnose.write", written)
        records = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
        yield Laboratory(folder, command(folder, "out", *records), answered, diagnoses)
