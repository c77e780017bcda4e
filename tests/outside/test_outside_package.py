"""A package outside the tree adds a bird material, a sensor and an effect, and every command works with them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = Path(__file__).parent / "gelatine"
CASE = """
[plate]
length = "300 mm"
width = "240 mm"
thickness = "4 mm"
elements = [6, 5]
material = {young = "200 GPa", poisson = 0.3, density = "7800 kg/m^3", yield_stress = "900 MPa"}
[bird]
shape = "cylinder"
diameter = "60 mm"
length = "110 mm"
density = "950 kg/m^3"
particles = 150
material = {model = "gelatine", bulk = "2000 MPa", viscosity = "300 Pa s"}
[impact]
speed = "60 m/s"
angle = "70 deg"
standoff = "3 mm"
[time]
end = "0.4 ms"
output_interval = "8 us"
[sensors.mean]
kind = "mean_deflection"
noise = "0.01 mm"
[sensors.force]
kind = "contact_force"
[inversion.parameters."bird.material.bulk"]
range = ["1000 MPa", "4000 MPa"]
"""
COMMANDS = """
import sys
from contextlib import nullcontext

import numpy as np
import pandas as pd

from birdstrike.cli.app import app

SOUGHT = ("paint", "impact_speed", "plate_thickness")

if __name__ == "__main__":
    from tests.inversion.diagnosis.rig import few_simulations

    for command in sys.argv[1:]:
        with few_simulations(150, SOUGHT) if command.startswith("diagnose") else nullcontext():
            try:
                app(command.split())
            except SystemExit as end:
                if end.code:
                    raise
        if command.startswith("simulate"):
            painted = pd.read_csv("painted/histories.csv")
            noisy = painted["mean_m"] + 1e-5 * np.random.default_rng(1).standard_normal(len(painted))
            pd.DataFrame({"time [s]": painted["time_s"], "mean [m]": noisy}).to_csv("record.csv", index=False)
"""
KEYS = """
from birdstrike.data.storage.store import run_key
from birdstrike.solver.case.case import case_hash, load_case

uses = {
    "material": {"bird.material": '{model = "gelatine", bulk = "2000 MPa"}'},
    "sensor": {"sensors.mean.kind": "mean_deflection"},
    "effect": {"effects.paint": "100 kg/m^3"},
    "nothing": {},
}
for name, settings in uses.items():
    case = load_case("demo", settings)
    print(name, run_key(case.canonical(), "0") + "/" + case_hash(case))
"""


class Laboratory:
    """A folder with the package installed in it, a case that uses it, and commands run there in processes."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.site = folder, folder / "site"
        shutil.copytree(PACKAGE, self.site)
        points = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]["entry-points"]
        metadata = self.site / "birdstrike_gelatine-1.0.dist-info"  # as pip leaves it
        metadata.mkdir()
        (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: birdstrike-gelatine\nVersion: 1.0\n")
        lines = [
            line for group, own in points.items() for line in (f"[{group}]", *(f"{k} = {v}" for k, v in own.items()))
        ]
        (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n")
        (folder / "case.toml").write_text(CASE)

    def python(self, *args: str, timeout: float = 600.0) -> str:
        """What a Python with the package on its path prints."""
        path = os.pathsep.join((str(ROOT), str(self.site)))
        run = subprocess.run(
            [sys.executable, *args],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": path, "COLUMNS": "200"},
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
        assert run.returncode == 0, run.stdout + run.stderr
        return run.stdout

    def birdstrike(self, *commands: str) -> None:
        """Run commands one after the other in one process; a campaign's workers read the same script."""
        (self.folder / "commands.py").write_text(COMMANDS)
        self.python("commands.py", *commands)

    def keys(self) -> dict[str, str]:
        """Key of a run, "/" and hash, of cases that each use one thing of the package, and of one without."""
        return dict(line.split() for line in self.python("-c", KEYS).splitlines())

    def write(self, name: str, text: str) -> None:
        """Change a file of the package."""
        (self.site / "birdstrike_gelatine" / name).write_text(text)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Laboratory:
    return Laboratory(tmp_path_factory.mktemp("laboratory"))


def test_every_command_works_with_the_package_s_material_sensor_and_effect(laboratory: Laboratory) -> None:
    """A record of a painted plate: the campaign, the inversion and the diagnosis know all three by their names."""
    folder = laboratory.folder
    laboratory.birdstrike(
        "simulate case.toml --out painted --set effects.paint=800kg/m^3",
        "run-doe case.toml --out doe --runs 6 --workers 1",
        "train-and-invert doe --measured record.csv --out inversion --method emulator --refine 0",
        "diagnose case.toml --measured record.csv --doe doe --out diagnosis --workers 1",
    )
    campaign = (folder / "doe" / "curves.csv").read_text().splitlines()[0]
    assert campaign == "run,time_s,mean_m,force_N"
    inversion = json.loads((folder / "inversion" / "inversion.json").read_text())
    assert list(inversion["methods"]["emulator"]["parameters"]) == ["bird.material.bulk"]
    diagnosis = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())
    (paint,) = [effect for effect in diagnosis["effects"] if effect["name"] == "paint"]
    assert paint["unit"] == "kg/m^3"
    assert paint["plausible_size"] > 0.0
    low, high = paint["interval_95"]  # the record is short and of one sensor without a baseline: no narrow interval
    assert low < paint["magnitude"] < high
    assert "paint" in diagnosis["confidence_set"]


def test_a_change_of_the_package_s_sources_changes_the_keys_of_the_runs_that_use_it(tmp_path: Path) -> None:
    laboratory = Laboratory(tmp_path)
    before = laboratory.keys()
    laboratory.write("law.py", "STIFFENING = 3.0\n")
    after = laboratory.keys()
    keys, hashes = zip(*(key.split("/") for key in before.values()), strict=True)
    keys_after, hashes_after = zip(*(key.split("/") for key in after.values()), strict=True)
    changed = {name for name, old, new in zip(before, keys, keys_after, strict=True) if old != new}
    assert changed == {"material", "sensor", "effect"}
    assert hashes_after == hashes  # the same cases: a campaign's folder of before the upgrade is not refused


def test_a_package_that_cannot_be_loaded_is_named(tmp_path: Path) -> None:
    laboratory = Laboratory(tmp_path)
    laboratory.write("sensor.py", "import no_such_module\n")
    with pytest.raises(
        AssertionError, match=r"UserError: the sensor kind birdstrike_gelatine.sensor:MeanDeflection of "
    ):
        laboratory.python("-c", KEYS)
