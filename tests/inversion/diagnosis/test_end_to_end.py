"""A tiny rig from nothing: edges that let go are found beside a baseline; the second call pays for no simulation."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose, named_records
from birdstrike.reports.page.diagnosis import write_diagnosis_page
from birdstrike.solver.case.case import Case, case_from_table
from birdstrike.solver.case.effects import magnitude_text
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.simulate import simulate

NOISE = 2e-5
SOUGHT = ("clamp_rotation", "plate_thickness", "impact_speed", "bird_friction", "time_offset", "sensor_gain")


def tiny() -> Case:
    return case_from_table(
        {
            "plate": {
                "length": "300 mm", "width": "300 mm", "thickness": "6 mm", "elements": [10, 8], "edges": "clamped",
                "material": {"young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "690 MPa"},
            },
            "bird": {
                "shape": "hemispherical_cylinder", "diameter": "60 mm", "length": "110 mm", "density": "938 kg/m^3",
                "method": "sph", "particles": 120,
                "material": {
                    "model": "null", "pressure_cutoff": "-0.4 MPa", "viscosity": "400 Pa s",
                    "eos": {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48},
                },
            },
            "impact": {"speed": "80 m/s", "angle": "45 deg", "standoff": "1 mm"},
            "time": {"end": "0.9 ms", "output_interval": "10 us"},
            "sensors": {
                "displacement_centre": {"kind": "displacement", "noise": "0.02 mm"},
                "displacement_side": {"kind": "displacement", "at": ["75 mm", "0 mm"], "noise": "0.02 mm"},
            },
            "effects": {name: magnitude_text(one, 0.0) for name, one in effects().items() if name not in SOUGHT},
            "inversion": {"parameters": {"bird.material.viscosity": {"range": ["100 Pa s", "1000 Pa s"]}}},
        },
        "tiny",
    )  # fmt: skip


def shot(folder: Path, name: str, seed: int, **changes: dict) -> Path:  # pyright: ignore[reportMissingTypeArgument]
    """A record by a mesh that the diagnosis does not have."""
    case = tiny().with_mesh(960, (20, 16)).overlaid({"bird": {"jitter": 0.05}, **changes})
    found, rng = simulate(case), np.random.default_rng(seed)
    time = found.time[::2]
    channels = {k: v[::2] + NOISE * rng.standard_normal(len(time)) for k, v in found.channels.items()}
    write_measured(folder / f"{name}.csv", Measured(time, channels, {}, dict.fromkeys(channels, "m"), ("SIMULATED",)))
    return folder / f"{name}.csv"


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("diagnosis")
    clean = shot(folder, "clean", 1)
    loose = shot(folder, "loose", 2, plate={"edges": "pinned"})
    options = DiagnosisOptions(workers=1, runs=9)
    found = diagnose(tiny(), loose, folder / "out", options=options, baseline=[clean])
    return folder, loose, clean, options, found


def test_edges_that_let_go_raise_the_alarm_and_are_in_the_credible_set(answered) -> None:
    *_, found = answered
    assert found.alarm < 0.05
    assert any("clamp_rotation" in name for name in found.confidence_set)
    magnitude = found.named("clamp_rotation").magnitude
    assert magnitude is not None
    assert magnitude > 0.0


def test_the_format_keeps_its_keys(answered) -> None:
    folder, *_ = answered
    content = json.loads((folder / "out" / "diagnosis.json").read_text())
    keys = {
        "schema_version", "alpha", "verdict", "confidence_set", "effects", "before", "after", "minimum_detectable",
        "next_measurement", "pairs", "remainder", "noise", "nuisance", "case_after", "strikes", "warnings",
        "families", "required_discrepancy", "baseline", "shots",
    }  # fmt: skip
    assert keys <= set(content)
    assert {"name", "magnitude", "unit", "interval_95", "p_consistent", "log_evidence", "twins", "probability"} <= set(
        content["effects"][0]
    )
    assert content["baseline"]["shots"] == ["baseline clean"]
    assert sum(content["families"].values()) == pytest.approx(1.0, abs=1e-6)
    assert (folder / "out" / content["case_after"]).is_file()


def test_the_second_call_simulates_nothing_and_says_the_same(answered) -> None:
    folder, loose, clean, options, found = answered
    again = diagnose(tiny(), loose, folder / "out", options=options, baseline=[clean])
    assert again.strikes["paid"] == 0
    assert again.confidence_set == found.confidence_set


def test_a_baseline_that_cannot_serve_is_named_and_the_rest_goes_on(answered) -> None:
    folder, loose, clean, options, _ = answered
    text = clean.read_text().splitlines()
    (folder / "short.csv").write_text("\n".join(text[:25]) + "\n")
    found = diagnose(tiny(), loose, folder / "out", options=options, baseline=[folder / "short.csv"])
    assert any("short is left out: it ends at" in line for line in found.warnings)


def test_the_page_is_written_and_points_nowhere(answered) -> None:
    folder, *_ = answered
    text = write_diagnosis_page(folder / "out").read_text()
    assert "What is missing" in text
    assert "https://" not in text.replace("http://www.w3.org", "")


def test_records_and_cases_must_fit() -> None:
    record = Measured(np.array([0.0, 1e-3]), {"displacement_centre": np.array([0.0, 1e-3])}, {}, {"displacement_centre": "m"})
    with pytest.raises(UserError, match="one case, or one for each"):
        named_records([tiny(), tiny()], [record, record, record])


def test_an_unknown_channel_is_refused_before_anything_is_simulated(tmp_path: Path) -> None:
    record = Measured(np.linspace(0, 1e-3, 50), {"other": np.linspace(0, 1e-3, 50)}, {}, {"other": "m"})
    with pytest.raises(MeasuredError, match="no sensor of case"):
        diagnose(tiny(), record, tmp_path / "out")
