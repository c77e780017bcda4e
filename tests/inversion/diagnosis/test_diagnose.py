"""`birdstrike diagnose` on a small case of its own: another plate, metal, angle, channel set and sampling rate."""

from __future__ import annotations

import html
import io
import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from birdstrike.data.curves import Measured, read_measured, write_measured
from birdstrike.data.errors import MeasuredError
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.diagnosis.choice import Choice
from birdstrike.inversion.diagnosis.diagnose import Study, Wishes, diagnose
from birdstrike.inversion.diagnosis.groundwork import prepare
from birdstrike.inversion.diagnosis.responses import library
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.diagnosis.write import write
from birdstrike.reports.page.diagnosis import write_diagnosis_page
from birdstrike.solver.case.case import load_case
from birdstrike.solver.simulate import simulate

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
PLANTED = {"clamp": {"clamp_rotation": 2.5e-5}, "drift": {"sensor_drift": 0.9}, "clean": {}}
"""Record -> what its strike has that the case does not declare: rad/N, m/s."""
FINER = {"bird.particles": "600", "bird.lattice": "cubic", "plate.elements": "[15, 12]"}
QUICK = Wishes(workers=1, runs=8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The declared case, and records of strikes on a finer mesh and another lattice."""
    place = tmp_path_factory.mktemp("diagnose")
    (place / "case.toml").write_text(CASE)
    finer = load_case(place / "case.toml", FINER)
    rng = np.random.default_rng(3)
    time = 8e-6 * np.arange(-70, 101)
    for name, effects in PLANTED.items():
        strike = simulate(finer.with_effects(effects).resolved(), threads=1)
        channels = {
            n: np.interp(time, strike.time, strike.channels[n]) + NOISE[n] * rng.standard_normal(len(time))
            for n in NOISE
        }
        measured = Measured(time, channels, {}, {n: strike.units[n] for n in NOISE}, ("SIMULATED, not measured",))
        write_measured(place / f"{name}.csv", measured)
        (place / f"{name}.truth.toml").write_text("not to be read")
    return place


@pytest.fixture(scope="module", autouse=True)
def on_threads() -> Iterator[None]:
    """Strikes on threads: processes would compile anew."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
        patch.setattr("birdstrike.inversion.diagnosis.strikes.process_pool", ThreadPoolExecutor)
        yield


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[str, Any]:
    """The soft clamp's diagnosis, made while any look at a truth file would have ended it."""
    opened = io.open

    def guarded(file: Any, *args: Any, **kwargs: Any) -> Any:
        if str(file).endswith(".truth.toml"):
            raise PermissionError(f"{file} is sealed")
        return opened(file, *args, **kwargs)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(io, "open", guarded)
        patch.setattr("builtins.open", guarded)
        with pytest.raises(PermissionError):
            (folder / "clamp.truth.toml").read_text()
        diagnose(folder / "case.toml", folder / "clamp.csv", folder / "out", wishes=QUICK)
    return json.loads((folder / "out" / "diagnosis.json").read_text())


@pytest.fixture(scope="module")
def study(folder: Path, found: dict[str, Any]) -> Iterator[Study]:  # noqa: ARG001 (its strikes)
    """The case made ready, from the strikes that the diagnosis before has paid for."""
    dataset = load_dataset(folder / "out" / "doe")
    with Strikes(folder / "out" / "runs", (folder / "out" / "doe" / "runs",), 1) as strikes:
        ground = prepare(load_case(folder / "case.toml"), dataset, tuple(NOISE), strikes, lambda _: None)
        yield Study(ground, strikes, QUICK)


@pytest.fixture(scope="module")
def drifted(folder: Path, study: Study) -> dict[str, Any]:
    """The diagnosis of a transducer that drifts, which no effect of plate or bird can look like before contact."""
    (folder / "drift").mkdir()
    write(study.diagnosis(read_measured(folder / "drift.csv"), read_measured(folder / "clean.csv")), folder / "drift")
    return json.loads((folder / "drift" / "diagnosis.json").read_text())


def test_a_soft_clamp_is_the_likeliest_on_a_case_that_nobody_prepared(found: dict[str, Any]) -> None:
    """300 particles reject the model without effects, and rank the soft clamp first.

    So far from its tangent its response bends, and on so coarse a mesh by more than the diagnosis knows: its magnitude
    comes out at half of the planted one, and whether it is in the set hangs on the noise.
    """
    effects = {one["name"]: one for one in found["effects"]}
    assert effects["none"]["p_consistent"] < 0.05
    clamp = found["effects"][0]  # the likeliest first
    assert clamp["name"] == "clamp_rotation"
    assert clamp["unit"] == "rad/N"
    assert clamp["log_evidence"] > 1.0
    assert clamp["p_consistent"] > 0.01
    assert clamp["interval_95"][0] > 0.0
    assert clamp["magnitude"] > PLANTED["clamp"]["clamp_rotation"] / 3.0


def test_a_drifting_transducer_is_attributed(drifted: dict[str, Any]) -> None:
    assert (drifted["verdict"], drifted["confidence_set"]) == ("attributed", ["sensor_drift"])
    assert drifted["unnamed"] is None
    (drift,) = (one for one in drifted["effects"] if one["name"] == "sensor_drift")
    assert drift["magnitude"] == pytest.approx(PLANTED["drift"]["sensor_drift"], rel=0.5)
    assert set(drifted["held_out"]) == {"time_block", "channel middle", "channel gauge", "shot"}
    channels = {drifted["held_out"][f"channel {n}"]["before"] for n in NOISE}
    assert drifted["before"]["heldout"]["channel"] in channels


def test_one_strike_of_the_written_case_is_the_error_and_the_curve_after(folder: Path, drifted: dict[str, Any]) -> None:
    path = folder / "drift" / drifted["case_after"]
    case = load_case(path)
    assert case.effects.keys() == {"sensor_drift"}
    assert case.impact.speed == pytest.approx(60.0 + drifted["nuisance"]["speed"]["value"], rel=1e-9) != 60.0
    assert "Fitted nuisances are written" in path.read_text()
    assert not {"impact_speed"} & library(case)[1].keys()  # the nuisance can be carried again
    strike = simulate(case.resolved(), threads=1)
    curves = pd.read_csv(folder / "drift" / "diagnosis.csv")
    assert drifted["after"]["solver"]["off"] < 1 / 3
    for name, rmse in drifted["after"]["solver"]["rmse"].items():
        here = curves[curves.channel == name]
        again = np.interp(here.time_s, strike.time, strike.channels[name])
        declared = drifted["after"]["solver"]["declared"][name]
        assert declared == pytest.approx(np.sqrt(np.mean((here.measured - again) ** 2)), rel=1e-6)
        assert rmse == pytest.approx(np.sqrt(np.mean((here.measured - here.after) ** 2)), rel=1e-6)
        assert drifted["before"]["solver"]["rmse"]["middle"] > 1.5 * drifted["after"]["solver"]["rmse"]["middle"]


def test_a_clean_record_needs_no_effect(folder: Path, study: Study) -> None:
    _, models = study.judgement(study.read(read_measured(folder / "clean.csv")))
    choice = Choice.of(models, QUICK.alpha)
    assert (choice.verdict, choice.chosen) == ("no_significant_residual", None)


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
        diagnose(folder / "case.toml", record, tmp_path / "out")
    assert not (tmp_path / "out").exists()
