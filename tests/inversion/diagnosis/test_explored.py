"""The page of a diagnosis: its curves are those by which the diagnosis judges, effects and instruments included."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot as plt

from birdstrike.data.storage.tree import load_tree, save_tree
from birdstrike.inversion.diagnosis.conclusions.before_and_after import predicted
from birdstrike.inversion.diagnosis.inference.hypotheses import Hypothesis
from birdstrike.inversion.diagnosis.preparation.shots import fault_named, with_faults
from birdstrike.inversion.results.diagnosis_files import MODEL
from birdstrike.reports.explore.explore import explore
from birdstrike.solver.case.case import load_case
from tests.inversion.diagnosis.conftest import Laboratory
from tests.reports.explore.browser import BROWSER, Browser
from tests.reports.explore.exactness import EXACT, POINTS, drawn, off


@pytest.fixture(scope="module")
def browser(laboratory: Laboratory, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser with the page of the diagnosis open."""
    if not BROWSER:
        pytest.skip("no chromium or google-chrome on the PATH")
    with Browser(tmp_path_factory.mktemp("browser")) as started:
        started.open(explore(laboratory.folder / "out"))
        yield started


def test_curves_with_all_effects_are_those_of_the_diagnosis(browser: Browser, laboratory: Laboratory) -> None:
    ranking, (shot, *_) = laboratory.answered[0]
    every = Hypothesis("all", ranking.problem.found, 0.0, "")
    seen = drawn(browser)
    assert len(seen) == POINTS
    for one in seen:
        z = shot.setup.plan.space.to_unit(one.theta[None])[0]
        assert set(one.effects) == {member.label for member in every.members}
        sizes = {
            m.label: m.response.h(one.effects[m.label] / m.size) if m.response else one.effects[m.label] / m.size
            for m in every.members
        }
        expected = predicted(shot, every, z, sizes)
        for i, (trace, curve) in enumerate(zip(shot.record.traces, one.curves, strict=True)):
            assert trace.block == 1
            at_record = np.interp(trace.times, shot.setup.time, curve)
            assert off(at_record, expected[shot.record.channel == i]) < EXACT, trace.name


def test_before_has_the_misfit_that_the_answer_states(browser: Browser, laboratory: Laboratory) -> None:
    found = laboratory.content()
    pressed = "[...document.querySelectorAll('#presets button')].find((one) => one.textContent === '{}').click()"
    for name in ("before", "after") if found["after"] else ("before",):
        browser.run(pressed.format(name))
        browser.run("window.explore.draw()")
        assert float(browser.run("document.getElementById('misfit').textContent")) == pytest.approx(
            found[name]["raw"], rel=6e-3
        )


SCORES = """(name) => {
  window.explore.setPoint(window.explore.state.view.presets.find((one) => one.name === name));
  window.explore.draw();
  return window.explore.state.panels.map((panel) => panel.score);
}"""


def test_a_record_of_means_is_held_against_the_means_of_the_curve(
    browser: Browser, laboratory: Laboratory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page took the curve at the middle of the averaged instants: its misfit was not that of diagnosis.csv."""
    monkeypatch.setattr("birdstrike.inversion.diagnosis.preparation.shots.MOST_POINTS", 18)
    assert laboratory.diagnose("means", "--measured", str(laboratory.folder / "loose.csv")).exit_code == 0
    folder = laboratory.folder / "means"
    table = pd.read_csv(folder / "diagnosis.csv")
    model = load_tree(folder / MODEL)
    channels = model["shots"][0]["channels"]
    assert all(one["block"] > 4 for one in channels)
    shutil.copytree(folder, tmp_path / "earlier")
    for one in channels:
        del one["block"], one["instants"]
    save_tree(tmp_path / "earlier" / MODEL, model)
    expected = [
        np.sqrt((((own["measured"] - own["before"]) / own["sigma"]) ** 2).mean())
        for _, own in table.groupby("channel", sort=False)
    ]
    for place in (folder, tmp_path / "earlier"):
        browser.open(explore(place, tmp_path / "page.html"))
        assert browser.run(f"({SCORES})('before')") == pytest.approx(expected, rel=1e-3)
    browser.open(explore(laboratory.folder / "out"))


def test_effects_are_sliders_the_likeliest_first(browser: Browser, laboratory: Laboratory) -> None:
    told = {one["name"]: one["probability"] for one in laboratory.content()["effects"]}
    labels = browser.run("window.explore.state.view.effects.map((one) => one.label)")
    assert set(labels) == set(told) - {"none", "something_else"}
    shares = [told[label] for label in labels]
    assert shares == sorted(shares, reverse=True)
    assert "clamp rotation" in browser.run("document.getElementById('sliders').innerText").lower()
    assert laboratory.content()["sentence"] in browser.run("document.querySelector('.answer').innerText")


def test_a_point_with_effects_is_a_case(browser: Browser, laboratory: Laboratory, tmp_path: Path) -> None:
    browser.run("window.explore.setPoint(window.explore.state.view.presets[0])")
    magnitudes = {"clamp_rotation": 2e-6, "sensor_gain.displacement_side": 0.02}
    point = "{ ...window.explore.state.point, effects: " + json.dumps(magnitudes) + " }"
    browser.run(f"window.explore.setPoint({point})")
    browser.run("document.getElementById('copy-toml').click()")
    text = browser.run("document.querySelector('#copied textarea').value")
    (tmp_path / "what_if.toml").write_text(f'extends = "{laboratory.folder / "out" / "case.toml"}"\n\n{text}')
    case = load_case(tmp_path / "what_if.toml")
    assert case.effects["clamp_rotation"] == pytest.approx(2e-6)
    assert case.instrument["displacement_side"].gain == pytest.approx(1.02)


def test_a_slower_sensor_has_both_time_constants_in_the_copied_case(
    browser: Browser, laboratory: Laboratory, tmp_path: Path
) -> None:
    """Of 5 kHz declared and 30 us more the copied case had 5305 Hz, the solver has 2574 Hz."""
    folder = tmp_path / "out"
    shutil.copytree(laboratory.folder / "out", folder)
    with (folder / "case.toml").open("a") as file:
        file.write('\n[instrument.displacement_side]\nbandwidth = "5 kHz"\n')
    browser.open(explore(folder))
    point = "{ ...window.explore.state.point, effects: { 'sensor_bandwidth.displacement_side': 3e-5 } }"
    browser.run(f"window.explore.setPoint({point})")
    browser.run("document.getElementById('copy-toml').click()")
    text = browser.run("document.querySelector('#copied textarea').value")
    (tmp_path / "what_if.toml").write_text(f'extends = "{folder / "case.toml"}"\n\n{text}')
    fault = ("displacement_side", "sensor_bandwidth", 3e-5)
    expected = with_faults(load_case(folder / "case.toml"), [fault]).instrument["displacement_side"].bandwidth
    assert expected == pytest.approx(2574.0, rel=1e-3)
    assert load_case(tmp_path / "what_if.toml").instrument["displacement_side"].bandwidth == pytest.approx(expected)


SLIDERS = """(effects) => {
  const { state, setPoint, draw } = window.explore;
  setPoint({ ...state.view.presets[0], effects });
  draw();
  return state.panels.map((panel) => [...panel.curve]);
}"""
FOUND = {"sensor_gain": 0.2, "time_offset": 6e-5, "sensor_bandwidth": 3e-5, "sensor_drift": -0.4}


def test_a_fault_beside_a_declared_instrument_is_that_of_the_diagnosis(
    browser: Browser, laboratory: Laboratory, tmp_path: Path
) -> None:
    """The page read the curve as if nothing were declared: 30 us beside 2 kHz were off by 45 % of their change, a gain
    beside a drift of 0.6 m/s by 25 %."""
    folder = shutil.copytree(laboratory.folder / "out", tmp_path / "out")
    declared = 'gain = 1.5\ntime_offset = "50 us"\nbandwidth = "2 kHz"\ndrift = "0.6 m/s"\n'
    with (folder / "case.toml").open("a") as file:
        file.write(f"\n[instrument.displacement_side]\n{declared}\n[effects]\nsensor_gain = 0.1\n")
    case, time = load_case(folder / "case.toml"), load_tree(folder / MODEL)["systems"][0]["time"]
    browser.open(explore(folder))
    bare = np.array(browser.run(f"({SLIDERS})({{}})"))
    for name, size in FOUND.items():
        label = f"{name}.displacement_side"
        seen = np.array(browser.run(f"({SLIDERS})({json.dumps({label: size})})"))
        expected = fault_named(name).change(size, time, bare[1], case.instrument["displacement_side"])
        assert off(seen[1] - bare[1], expected) < EXACT, name
        assert seen[0] == pytest.approx(bare[0])
    every = json.dumps(
        {"sensor_gain": 0.2, "sensor_drift.displacement_side": -0.4, "sensor_gain.displacement_side": 0.1}
    )
    browser.run(f"({SLIDERS})({every})")
    browser.run("document.getElementById('copy-toml').click()")
    text = browser.run("document.querySelector('#copied textarea').value")
    (tmp_path / "what_if.toml").write_text(f'extends = "{folder / "case.toml"}"\n\n{text}')
    copied = load_case(tmp_path / "what_if.toml")
    assert copied.effects["sensor_gain"] == pytest.approx(1.1 * 1.2 - 1.0)
    assert copied.instrument["displacement_side"].drift == pytest.approx(0.2)
    assert copied.instrument["displacement_side"].gain == pytest.approx(1.5 * 1.1 * 1.1 * 1.2)


MOVED = """(size) => {
  const { state, setPoint, draw } = window.explore;
  setPoint({ ...state.point, effects: size ? { plate_thickness: size } : {} });
  draw();
  return [...state.panels[0].curve];
}"""


def test_each_sense_of_an_effect_has_its_own_curves_on_the_page(
    browser: Browser, laboratory: Laboratory, tmp_path: Path
) -> None:
    """Of a thinner plate, whose response is made twice that of a thicker one."""
    folder = tmp_path / "out"
    shutil.copytree(laboratory.folder / "out", folder)
    model = load_tree(folder / MODEL)
    response = model["systems"][0]["responses"]["plate_thickness"]
    twice = {key: {name: 2.0 * rows for name, rows in response[key].items()} for key in ("signature", "slopes")}
    model["systems"][0]["responses"]["plate_thickness"] = {**response, "negative": twice}
    save_tree(folder / MODEL, model)
    curves = []
    for place in (laboratory.folder / "out", folder):
        browser.open(explore(place))
        bare, thicker, thinner = (np.array(browser.run(f"({MOVED})({size})")) for size in (0.0, 1e-4, -1e-4))
        curves.append((thicker - bare, thinner - bare))
    (thicker, thinner), (again, doubled) = curves
    np.testing.assert_allclose(thinner, -thicker, atol=1e-6 * np.abs(thicker).max())
    np.testing.assert_allclose(again, thicker)
    np.testing.assert_allclose(doubled, 2.0 * thinner, atol=1e-6 * np.abs(thicker).max())


def test_a_diagnosis_shows_itself(laboratory: Laboratory) -> None:
    found, content = laboratory.diagnoses[0], laboratory.content()
    assert repr(found).startswith("<Diagnosis: ")
    assert content["sentence"] in repr(found)
    table = found.to_dataframe().set_index("name")
    assert table["probability"].to_dict() == pytest.approx(
        {one["name"]: one["probability"] for one in content["effects"]}
    )
    bars, curves = found.plot(), found.plot("displacement_centre")
    widest = max(bar.get_extents().width for bar in bars.patches) / bars.get_window_extent().width
    assert widest == pytest.approx(table["probability"].max(), rel=1e-6)
    assert curves.get_ylabel() == "displacement centre [mm]"
    assert {"measured", "before"} <= {line.get_label() for line in curves.lines}
    assert "data:image/png;base64," in found._repr_html_()
    plt.close("all")
