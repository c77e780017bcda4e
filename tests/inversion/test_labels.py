"""Labels of effects whose sets of nodes and shots have names with dots, dashes and blanks in them."""

from __future__ import annotations

import json
import shutil
import subprocess
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.inversion.audit.draws import label_of, sensor_of
from birdstrike.inversion.audit.records import Truth, truth_text
from birdstrike.inversion.diagnosis.conclusions.answer import _meaning
from birdstrike.inversion.diagnosis.conclusions.next_measurement import _response
from birdstrike.inversion.labels import in_words, label_parts
from birdstrike.inversion.prediction.budget import _dominant, _remedy
from birdstrike.reports.explore import explore
from birdstrike.reports.explore.kinds.diagnosis import _effect
from birdstrike.solver.case.case import load_case
from tests.diagnoses import effect

LABELS = {
    "clamp_rotation.left edge.2": ("clamp_rotation", "left edge.2", ""),
    "sensor_gain.displacement_centre": ("sensor_gain", "displacement_centre", ""),
    "impact_speed@speed_91.1": ("impact_speed", "", "speed_91.1"),
    "time_offset@speed_91.1": ("time_offset", "", "speed_91.1"),
    "none": ("none", "", ""),
}


@pytest.mark.parametrize("label", LABELS)
def test_parts_of_a_label(label: str) -> None:
    assert label_parts(label) == LABELS[label]


def test_a_label_in_words() -> None:
    assert in_words("clamp_rotation.left edge.2+impact_speed@speed_91.1") == (
        "clamp rotation, left edge.2 + impact speed, shot speed 91.1"
    )
    assert _meaning("impact_speed@speed_91.1", "impact_speed").endswith(", in shot speed_91.1 alone")
    assert _meaning("clamp_rotation.left edge.2", "clamp_rotation.left edge.2").endswith(": left edge.2 alone")


def test_a_clock_of_one_shot_is_that_of_a_further_sensor_too() -> None:
    """Whatever the shot is called; that of one sensor is not."""
    t = np.linspace(0.0, 1.0, 11)
    member = SimpleNamespace(name="time_offset", shots=("a_1.5",), response=None, size=0.1)

    def response(label: str) -> np.ndarray:
        ranking: Any = SimpleNamespace(models={label: SimpleNamespace(members=(member,))})
        candidate: Any = SimpleNamespace(shot=SimpleNamespace(name="a_1.5"), t=t, curve=t)
        return _response(ranking, candidate, label, {})

    assert response("time_offset@a_1.5") == pytest.approx(-0.1)
    assert response("time_offset.displacement_centre") == pytest.approx(0.0)


def slider(label: str, name: str, sensors: list[str] | None) -> dict[str, Any]:
    """On the page to explore."""
    one = {"label": label, "name": name, "family": "", "size": 1e-5, "low": -1e-4, "high": 1e-4, "shots": ["a_1.5"]}
    return _effect(
        {**one, "sensors": sensors, "unit": "s"}, effect(label, 1e-5), {"a_1.5": load_case("virtual_strike")}
    )


def test_a_slider_of_one_shot_s_clock_is_of_no_single_sensor() -> None:
    found = slider("time_offset@a_1.5", "time_offset", ["displacement_centre", "force"])
    assert found["single"] is None
    assert found["title"] == "time offset, shot a_1.5 alone"
    found = slider("time_offset.displacement_centre", "time_offset", ["displacement_centre"])
    assert (found["single"], found["title"]) == ("displacement_centre", "time offset, displacement centre")
    assert slider("clamp_rotation.left edge", "clamp_rotation.left edge", None)["title"] == "clamp rotation, left edge"


def test_what_is_to_be_determined_better_is_named_with_its_effect() -> None:
    rng = np.random.default_rng(0)
    values = {"effects.clamp_rotation.cell_3": rng.normal(size=50), "bird.material.viscosity": rng.normal(size=50)}
    for key, said in {"effects.clamp_rotation.cell_3": "clamp rotation, cell 3", [*values][1]: "viscosity"}.items():
        draws: Any = SimpleNamespace(sample=SimpleNamespace(values=values), nominal=values[key])
        assert _dominant(draws) == said
    learnt: Any = SimpleNamespace(source="diagnose", next_measurement="")
    assert _remedy("tolerances", draws, learnt, ["impact.speed", "effects.clamp_rotation.cell_3"], "") == (
        "measure speed and clamp rotation, cell 3 of the new shot"
    )


def test_an_audit_plants_no_set_whose_name_a_label_cannot_hold() -> None:
    clean = load_case("flat_plate_002")
    assert clean.target is not None
    case = clean.model_copy(update={"target": clean.target.model_copy(update={"supports": {
        f"{name}@1" if name == "cell_1" else name: held for name, held in clean.target.supports.items()
    }})})  # fmt: skip
    drawn = {label_of(case, np.random.default_rng(seed)) for seed in range(300)}
    assert any(label.startswith("clamp_rotation.cell_") for label in drawn)
    assert not any(label.endswith("cell_1@1") for label in drawn)
    assert {sensor_of(label) for label in drawn if label.startswith("clamp_rotation")} == {""}


def test_a_truth_with_a_quoted_set_is_read_back() -> None:
    label = 'clamp_rotation.a "left\\edge"'
    truth = Truth("single", "d", "own", "", {label: 1e-6}, {}, np.zeros(0), {}, {})
    assert tomllib.loads(truth_text(truth, "c.csv"))["effects"] == {label: 1e-6}


@pytest.mark.skipif(shutil.which("node") is None, reason="the page's scripts run in node here")
def test_what_is_copied_from_the_page_is_a_case_s_table() -> None:
    """Of one set of nodes and of all of them, and the command that says the same."""
    names = ["clamp_rotation", "clamp_rotation.cell_3", "clamp_rotation.left edge"]
    common = {"factor": 1.0, "unit": "rad/N", "single": None, "elsewhere": {}, "shots": ["one"]}
    effects = [{"label": name, "name": name, **common} for name in names]
    axis = {"key": "target.supports.left edge.rotational", "unit": "", "factor": 1.0}
    view = {"parameters": [axis], "effects": effects, "case": "flat_plate_002", "shots": [{"name": "one"}]}
    point = {"theta": [2.0], "effects": {name: 1e-6 * (i + 1) for i, name in enumerate(names)}}
    page = Path(explore.__file__).parent / "page"
    script = "".join((page / name).read_text(encoding="utf-8") for name in ("numbers.js", "copy.js"))
    script += f"const view = {json.dumps(view)}, point = {json.dumps(point)};"
    script += "console.log(JSON.stringify([tomlOf(view, point), commandOf(view, point)]));"
    done = subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True)
    toml, command = json.loads(done.stdout)
    table = tomllib.loads(toml)
    assert table["target"]["supports"]["left edge"] == {"rotational": 2.0}
    assert table["effects"] == {"clamp_rotation": "0.000001 rad/N",
        "clamp_rotation.cell_3": "0.000002 rad/N", "clamp_rotation.left edge": "0.000003 rad/N"
    }  # fmt: skip
    assert "'effects.\"clamp_rotation.left edge\"=0.000003 rad/N'" in command
    magnitudes = {f'effects."{name}"': table["effects"][name] for name in names[:2]}
    assert set(load_case("flat_plate_002", magnitudes).effects) == set(names[:2])
