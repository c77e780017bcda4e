"""`birdstrike diagnose` on a small case of its own: another plate, metal, angle, channel set and sampling rate."""

from __future__ import annotations

import html
import io
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from data.curves import Measured, write_measured
from data.errors import MeasuredError
from inversion.diagnosis.diagnose import Wishes, diagnose
from reports.diagnosis import write_diagnosis_page
from solver.case import load_case
from solver.simulate import simulate

CASE = """
[plate]
length = "300 mm"
width = "240 mm"
thickness = "4 mm"
elements = [10, 8]
[plate.material]
young = "200 GPa"
poisson = 0.3
density = "7800 kg/m^3"
yield_stress = "900 MPa"
[bird]
shape = "cylinder"
diameter = "60 mm"
length = "110 mm"
density = "950 kg/m^3"
particles = 300
[bird.material]
model = "null"
pressure_cutoff = "-0.3 MPa"
viscosity = "300 Pa s"
[bird.material.eos]
kind = "polynomial_k"
c0 = "1480 m/s"
k = 2.0
[impact]
speed = "60 m/s"
angle = "70 deg"
standoff = "6 mm"
[time]
end = "0.8 ms"
output_interval = "8 us"
[sensors.middle]
kind = "displacement"
[sensors.gauge]
kind = "strain"
at = ["60 mm", "0 mm"]
[inversion.parameters."bird.material.viscosity"]
range = ["0 Pa s", "800 Pa s"]
[inversion.parameters."bird.material.eos.c0"]
range = ["1000 m/s", "1800 m/s"]
[inversion.nuisance]
speed = "0.3 m/s"
"""
NOISE = {"middle": 5e-5, "gauge": 5e-5}
PLANTED = 3e-5  # rad/N


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The declared case and a record of a strike on a softer clamp, on a finer mesh and another lattice."""
    place = tmp_path_factory.mktemp("diagnose")
    (place / "case.toml").write_text(CASE)
    finer = {"bird.particles": "600", "bird.lattice": "cubic", "plate.elements": "[15, 12]"}
    truth = load_case(place / "case.toml", finer).with_effects({"clamp_rotation": PLANTED})
    strike = simulate(truth.resolved(), threads=1)
    time = 8e-6 * np.arange(-70, 101)
    rng = np.random.default_rng(3)
    channels = {
        name: np.interp(time, strike.time, strike.channels[name]) + NOISE[name] * rng.standard_normal(len(time))
        for name in NOISE
    }
    measured = Measured(time, channels, {}, {n: strike.units[n] for n in NOISE}, ("SIMULATED, not measured",))
    write_measured(place / "shot.csv", measured)
    (place / "shot.truth.toml").write_text("not to be read")
    return place


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[str, Any]:
    """The diagnosis's JSON, made while any look at the truth file would have ended it; strikes on threads."""
    opened = io.open

    def guarded(file: Any, *args: Any, **kwargs: Any) -> Any:
        if str(file).endswith(".truth.toml"):
            raise PermissionError(f"{file} is sealed")
        return opened(file, *args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("doe.campaign.process_pool", ThreadPoolExecutor)
        patch.setattr("inversion.diagnosis.strikes.process_pool", ThreadPoolExecutor)
        patch.setattr(io, "open", guarded)
        patch.setattr("builtins.open", guarded)
        with pytest.raises(PermissionError):
            (folder / "shot.truth.toml").read_text()
        diagnose(folder / "case.toml", folder / "shot.csv", folder / "out", wishes=Wishes(workers=1, runs=8))
    return json.loads((folder / "out" / "diagnosis.json").read_text())


def test_a_soft_clamp_is_found_on_a_case_that_nobody_prepared(folder: Path, found: dict[str, Any]) -> None:
    assert "none" not in found["confidence_set"]
    assert "clamp_rotation" in found["confidence_set"]
    (clamp,) = (one for one in found["effects"] if one["name"] == "clamp_rotation")
    assert clamp["unit"] == "rad/N"
    assert clamp["confirmed"]
    assert clamp["interval_95"][0] < clamp["magnitude"] < clamp["interval_95"][1]
    assert clamp["magnitude"] == pytest.approx(PLANTED, rel=0.5)
    assert found["after"]["weighted"] < found["before"]["weighted"]
    if found["case_after"]:
        assert load_case(folder / "out" / found["case_after"]).effects.keys() == {"clamp_rotation"}


def test_the_json_holds_what_other_programs_read(found: dict[str, Any]) -> None:
    assert found["noise"]["sensors"]["middle"]["source"] == "record before contact"
    assert found["noise"]["sensors"]["middle"]["sigma"] == pytest.approx(NOISE["middle"], rel=0.3)
    assert found["nuisance"]["speed"]["sigma"] == pytest.approx(0.3)
    assert {"alpha", "verdict", "minimum_detectable", "next_measurement", "pairs", "remainder", "strikes"} <= set(found)
    assert len(found["effects"]) == 20


def test_the_page_shows_before_and_after(folder: Path, found: dict[str, Any]) -> None:
    page = write_diagnosis_page(folder / "out").read_text(encoding="utf-8")
    assert found["sentence"] in html.unescape(page)
    assert "<svg" in page
    assert 'src="http' not in page


def test_a_channel_that_the_case_lacks_is_named_before_any_strike(folder: Path, tmp_path: Path) -> None:
    time = np.linspace(0.0, 1e-3, 50)
    record = Measured(time, {"elsewhere": time}, {}, {"elsewhere": "m"}, path="x.csv")
    with pytest.raises(MeasuredError, match="elsewhere"):
        diagnose(folder / "case.toml", replace(record), tmp_path / "out")
    assert not (tmp_path / "out").exists()
