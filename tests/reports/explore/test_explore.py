"""The page with sliders, in a real browser: its curves are Python's, its rules are the command's, nothing leaves it."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import matplotlib.image as images
import numpy as np
import pytest
from typer.testing import CliRunner

import birdstrike.reports.explore.explore
from birdstrike.cli.app import app
from birdstrike.data.curves import Measured, read_measured, write_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.reports.explore.explore import LARGEST, SCRIPTS, explore
from birdstrike.reports.explore.kinds.inversion import read
from birdstrike.solver.case.case import load_case
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.files import load_emulator
from tests.diagnoses import written_diagnosis
from tests.reports.explore.browser import Browser
from tests.reports.explore.conftest import NOISE, TIME, inverted, rig, strike
from tests.reports.explore.exactness import EXACT, drawn, errors_at, off

LABELS = """() => {
  const texts = [], pen = document.createElement("canvas").getContext("2d"), write = pen.fillText.bind(pen);
  pen.font = '11px "Liberation Sans", Arial, sans-serif';
  pen.fillText = (text, x, y) => {
    const box = pen.measureText(text);
    texts.push([text, x - box.actualBoundingBoxLeft, x + box.actualBoundingBoxRight]);
    write(text, x, y);
  };
  const frames = framesOf(600, 240, { x: [0, 2.6], y: [-0.0009, 0.0025], reach: 0.0003 });
  drawAxes(pen, frames.upper);
  drawAxes(pen, frames.lower, { rows: 2 });
  return texts;
}"""
"""Labels of a strain's axes on a canvas 600 pixels wide: text, left and right end."""

DROP = """async (text, name) => {
  const given = new DataTransfer();
  given.items.add(new File([text], name, { type: "text/csv" }));
  document.getElementById("dropped").textContent = "";
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: given, bubbles: true, cancelable: true }));
  for (let i = 0; i < 400 && !document.getElementById("dropped").textContent.includes(name); i += 1) {
    await new Promise((done) => setTimeout(done, 10));
  }
  return {
    said: document.getElementById("dropped").textContent,
    errors: [...document.querySelectorAll("#errors li")].map((line) => line.textContent),
  };
}"""


def drop(browser: Browser, text: str, name: str) -> dict[str, Any]:
    """What the page says of a file that is dropped on it."""
    return browser.run(f"({DROP})({json.dumps(text)}, {json.dumps(name)})")


def held_against(browser: Browser, emulator: Emulator, channels: list[str]) -> None:
    """Every drawn curve, and every band where a run stands behind the point, against the emulator's."""
    inside = 0
    for one in drawn(browser):
        u = emulator.inputs(one.theta[None])
        for name, curve, error in zip(channels, one.curves, one.errors, strict=True):
            channel = emulator.channels[name]
            assert off(curve, channel.curves(u, channel.time)[0]) < EXACT, name
            assert off(error, error_of(emulator, name, one.theta)) < 1e-3, name
        inside += 1
    assert inside == 50


def error_of(emulator: Emulator, name: str, theta: np.ndarray) -> np.ndarray:
    """(m,) SI, standard deviation of the emulator's error at theta (k,) SI."""
    channel, u = emulator.channels[name], emulator.inputs(theta[None])
    variance = (channel.error_factor(u[0], channel.time) ** 2).sum(axis=1) + channel.outside_at(channel.time)
    return np.sqrt(variance)


def test_curves_of_a_campaign_are_those_of_its_emulator(browser: Browser, campaign_page: Path, loop: Path) -> None:
    browser.open(campaign_page)
    dataset = load_dataset(loop / "doe")
    held_against(browser, fit_emulator(dataset, tuple(dataset.curves)), list(dataset.curves))


def test_curves_of_an_inversion_are_those_of_its_emulator(browser: Browser, loop: Path, tmp_path: Path) -> None:
    browser.open(explore(loop / "inversion", tmp_path / "page.html"))
    emulator = load_emulator(loop / "inversion" / "emulator.npz")
    held_against(browser, emulator, ["displacement_centre", "displacement_side"])


def test_far_from_every_run_the_error_is_that_of_the_emulator(browser: Browser, loop: Path, tmp_path: Path) -> None:
    """The runs' weights squared to 0 there, and the band was 0/0."""
    browser.open(explore(loop / "inversion", tmp_path / "page.html"))
    emulator = load_emulator(loop / "inversion" / "emulator.npz")
    far = np.array(
        browser.run("window.explore.state.view.parameters.map(({ low, high }) => high + 1e4 * (high - low))")
    )
    names = browser.run("window.explore.state.panels.map((panel) => panel.channel.name)")
    for name, error in zip(names, errors_at(browser, far), strict=True):
        assert off(error, error_of(emulator, name, far)) < 1e-3, name


def test_the_page_of_a_campaign_is_called_after_its_case(campaign_page: Path) -> None:
    """In the campaign's folder the case is a file `case.toml`."""
    assert "<title>Explore doe: rig</title>" in campaign_page.read_text(encoding="utf-8")


def test_the_first_screen_says_what_fits_and_what_is_not_identifiable(browser: Browser, page: Path, loop: Path) -> None:
    found = json.loads((loop / "inversion" / "inversion.json").read_text())["methods"]["emulator"]["parameters"]
    browser.open(page)
    seen = browser.run(
        "[...document.querySelectorAll('.answer:not([hidden]) dl > div')].filter((part) => "
        "part.getBoundingClientRect().bottom < innerHeight).map((part) => part.innerText)"
    )
    lines = {text.split("\n")[0].lower(): text for text in seen}
    viscosity = found["bird.material.viscosity"]
    assert viscosity["identified"]
    assert f"{viscosity['value']:.3g} Pa s" in lines["viscosity"]
    numbers = [float(n) for n in re.findall(r"[\d.]+", lines["viscosity"].split("interval")[1].replace("..", " "))]
    assert numbers == pytest.approx(viscosity["interval_95"], rel=5e-3)
    for name, estimate in found.items():
        assert ("not identifiable" in lines[name.split(".")[-1].replace("_", " ")]) == (not estimate["identified"])
    assert not all(estimate["identified"] for estimate in found.values())


def test_nothing_leaves_the_page_and_nothing_is_said_to_the_console(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("document.getElementById('copy-toml').click()")
    drop(browser, "time [ms],displacement_centre [mm]\n0,0\n1,2\n2,3\n", "shot.csv")
    assert browser.requests == [page.as_uri()]
    assert browser.messages == []
    refused = browser.run("fetch('https://example.org').then(() => 'sent', () => 'refused')")
    assert refused == "refused"


def test_a_name_with_a_tag_in_it_is_text(browser: Browser, loop: Path, tmp_path: Path) -> None:
    text = (loop / "inversion" / "inversion.json").read_text()
    evil = "<script>window.taken = 1</script><img src=x onerror='window.taken = 1'>"
    folder = tmp_path / "inversion"
    folder.mkdir()
    for name in ("emulator.npz", "verification.csv", "case.toml"):
        (folder / name).write_bytes((loop / "inversion" / name).read_bytes())
    content = json.loads(text)
    content["warnings"] = [evil]
    content["measured"]["path"] = f"{evil}.csv"
    content["methods"]["emulator"]["parameters"]["bird.material.viscosity"]["reason"] = evil
    (folder / "inversion.json").write_text(json.dumps(content))
    browser.open(explore(folder))
    drop(browser, "time [ms],displacement_centre [mm]\n0,<script>window.taken = 1</script>\n", evil)
    assert evil in browser.run("document.querySelector('.answer details').textContent")
    assert browser.run("window.taken") is None
    assert browser.requests == [(folder / "explore.html").as_uri()]


GOOD = "# shot 8\ntime [us],displacement_centre [um],displacement_centre_sigma [mm]\n" + "".join(
    f"{t},{'' if t == 500 else 2000 * np.sin(t / 900) ** 2:.6},0.05\n" if t != 500 else "500,,\n"
    for t in range(0, 900, 50)
)


def test_a_dropped_record_is_scored_as_python_scores_it(
    browser: Browser, page: Path, loop: Path, tmp_path: Path
) -> None:
    browser.open(page)
    assert drop(browser, GOOD, "shot8.csv")["errors"] == []
    (tmp_path / "shot8.csv").write_text(GOOD)
    record, emulator = read_measured(tmp_path / "shot8.csv"), load_emulator(loop / "inversion" / "emulator.npz")
    theta = np.array(browser.run("[...window.explore.state.point.theta]"))
    times, values = record.points("displacement_centre")
    clock = browser.run("window.explore.state.point.clock")
    curve = emulator.channels["displacement_centre"].curves(emulator.inputs(theta[None]), times - clock)[0]
    expected = np.sqrt(np.mean(((values - curve) / 5e-5) ** 2))
    browser.run("window.explore.draw()")
    assert browser.run("window.explore.state.panels[0].score") == pytest.approx(expected, rel=1e-4)
    browser.until("document.getElementById('dropped').textContent.includes('best fit')")
    assert "viscosity" in browser.run("document.getElementById('dropped').innerText")
    assert browser.run("window.explore.state.best.misfit") < 1.0001 * expected


def test_readings_before_the_simulation_begins_are_not_scored(browser: Browser, page: Path) -> None:
    """They lie on the model's rest, and diluted the misfit."""
    head, *rows = GOOD.splitlines(keepends=True)[1:]
    browser.open(page)
    drop(browser, head + "".join(rows), "shot8.csv")
    browser.run("window.explore.draw()")
    alone = browser.run("window.explore.state.panels[0].score")
    drop(browser, head + "".join(f"{t},0,0.05\n" for t in range(-900, 0, 50)) + "".join(rows), "shot8.csv")
    browser.run("window.explore.setPoint(window.explore.state.view.presets[0]); window.explore.draw()")
    assert browser.run("window.explore.state.panels[0].score") == pytest.approx(alone, rel=1e-9)


def clipped_record(path: Path) -> Path:
    """A record at 400 Pa s that begins before the simulation, and whose amplifier ends at 60 % of the peak."""
    time = np.arange(-0.3e-3, 0.9e-3, 5e-6)
    curve = strike(rig().with_values({"bird.material.viscosity": 400.0})).channels["displacement_centre"]
    values = np.interp(time, TIME, curve, left=0.0) + NOISE * np.random.default_rng(1).normal(size=len(time))
    values = np.minimum(values, 0.6 * curve.max())
    write_measured(path, Measured(time, {"displacement_centre": values}, {}, {"displacement_centre": "m"}))
    return path


def test_the_misfit_is_of_the_points_that_the_fit_has_used(browser: Browser, loop: Path, tmp_path: Path) -> None:
    """The page scored clipped readings and those before contact: 32 where the fit was as good as noise allows."""
    folder = inverted(loop, clipped_record(tmp_path / "clipped.csv"), tmp_path / "inversion")
    content = json.loads((folder / "inversion.json").read_text())["measured"]
    (view,) = read(folder)
    record = view.shots[0]["channels"][0]["record"]
    (cut,) = content["cuts"]["displacement_centre"].values()
    assert len(record["time"]) == content["points"]["displacement_centre"]
    assert not np.isin(np.round(record["time"], 9), np.round(cut, 9)).any()
    assert len(cut) > 20
    assert record["time"][0] >= 0.0
    assert {*np.round(cut, 9)} <= {*np.round(record["left_out"]["time"], 9)}
    browser.open(explore(folder, tmp_path / "page.html"))
    browser.run("window.explore.draw()")
    assert float(browser.run("document.getElementById('misfit').textContent")) < 2.0
    assert "left out of the fit" in browser.run("document.querySelector('.legend').innerText")
    browser.open(explore(loop / "doe", tmp_path / "campaign.html"))
    assert "left out of the fit" not in browser.run("document.querySelector('.legend').innerText")


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("time [ms],displacement_centre\n0,0\n1,1\n", 'line 1: "displacement_centre" needs a name and a unit'),
        ("time [s],displacement_centre [mm]\n0,0\n1,nan\n2,1\n", 'line 3: displacement_centre = "nan" is not a finite'),
        ("time [ms],displacement_centre [mm]\n0,0\n2,1\n1,2\n", "line 4: the time 1 does not increase"),
        ("time [ms],displacement_centre [mm]\n0,0\n1,2,3\n", "line 3: 3 cells where the header has 2"),
        ("displacement_centre [mm],time [ms]\n0,0\n1,1\n", "line 1: the first column is"),
    ],
)
def test_a_bad_record_is_refused_in_the_words_of_the_command(
    browser: Browser, page: Path, tmp_path: Path, text: str, where: str
) -> None:
    if not browser.requests or browser.requests[0] != page.as_uri():
        browser.open(page)
    found = drop(browser, text, "bad.csv")
    assert found["said"] == "bad.csv cannot be used:"
    assert where in found["errors"][0]
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(MeasuredError) as refused:
        read_measured(tmp_path / "bad.csv")
    told = [line for line in refused.value.errors if line.startswith(f"{tmp_path / 'bad.csv'}, line")]
    assert found["errors"] == [line.split(", ", 1)[1] for line in told]


def test_a_sensor_that_the_page_has_not_is_named(browser: Browser, page: Path) -> None:
    browser.open(page)
    found = drop(browser, "time [ms],strain_9 [um/m]\n0,0\n1,1\n2,3\n", "other.csv")
    assert found["errors"] == [
        '"strain_9" is no sensor of this page; its sensors: displacement_centre, displacement_side'
    ]


def test_mouse_finger_and_keys_move_a_slider(browser: Browser, page: Path) -> None:
    """Of the viscosity, whose range is logarithmic: so is its slider."""
    browser.open(page)
    place = browser.run(
        "(() => { const box = document.querySelectorAll('#sliders input[type=range]')[0].getBoundingClientRect(); "
        "return [box.left, box.top + box.height / 2, box.width]; })()"
    )
    left, middle, width = place
    value = "window.explore.state.point.theta[0]"
    browser.mouse("mousePressed", left + 0.5 * width, middle, pressed=True)
    browser.mouse("mouseMoved", left + 0.8 * width, middle, pressed=True)
    browser.mouse("mouseReleased", left + 0.8 * width, middle)
    low, high = browser.run("(({low, high}) => [low, high])(window.explore.state.view.parameters[0])")

    def share() -> float:
        return float(np.log(browser.run(value) / low) / np.log(high / low))

    assert (by_mouse := share()) == pytest.approx(0.8, abs=0.03)
    browser.press("ArrowLeft", 37)
    assert share() == pytest.approx(by_mouse - 0.01, rel=1e-9)
    browser.resize(360, 740, touch=True)
    left, middle, width = browser.run(
        "(() => { const slider = document.querySelectorAll('#sliders input[type=range]')[0]; "
        "slider.scrollIntoView({ block: 'end' }); const box = slider.getBoundingClientRect(); "
        "return [box.left, box.top + box.height / 2, box.width]; })()"
    )
    browser.touch("touchStart", (left + 0.6 * width, middle))
    browser.touch("touchMove", (left + 0.3 * width, middle))
    browser.touch("touchEnd")
    assert share() == pytest.approx(0.3, abs=0.05)


def test_what_is_copied_makes_the_point_in_the_solver(browser: Browser, page: Path, loop: Path, tmp_path: Path) -> None:
    browser.open(page)
    drawn(browser, seed=3, points=1)
    browser.run("document.getElementById('copy-toml').click()")
    toml = browser.run("document.querySelector('#copied textarea').value")
    (tmp_path / "what_if.toml").write_text(f'extends = "{loop / "doe" / "case.toml"}"\n\n{toml}')
    theta = browser.run("[...window.explore.state.point.theta]")
    material = load_case(tmp_path / "what_if.toml").bird.material
    found = [material.viscosity, material.pressure_cutoff, material.tension_erosion]
    assert found == pytest.approx(theta, rel=1e-9)
    browser.run("document.getElementById('copy-command').click()")
    words = shlex.split(browser.run("document.querySelector('#copied textarea').value"))
    assert words[:3] == ["birdstrike", "simulate", str(loop / "doe" / "case.toml")]
    settings = dict(words[i + 1].split("=", 1) for i, word in enumerate(words) if word == "--set")
    assert load_case(words[2], settings).bird.material == material


def test_the_page_fits_every_window(browser: Browser, page: Path, tmp_path: Path) -> None:
    for width, height, dark in ((360, 740, False), (1280, 900, True), (3840, 2160, False)):
        browser.open(page, width, height, dark)
        assert browser.run("document.documentElement.scrollWidth") <= width
        pixels = images.imread(browser.picture(tmp_path / f"{width}.png"))[..., :3]
        assert pixels.shape[:2] == (height, width)
        assert (pixels.mean() < 0.4) == dark
        paper = np.median(pixels.reshape(-1, 3), axis=0)
        assert (np.abs(pixels - paper).max(axis=-1) > 0.25).mean() > 0.005, "an empty window"
    assert browser.print(tmp_path / "page.pdf").stat().st_size > 10_000


def test_labels_of_small_strains_and_of_the_last_instant_stand_whole_on_the_picture(
    browser: Browser, page: Path
) -> None:
    browser.open(page, 1280, 900)
    found = browser.run(f"(() => {{ {scripts()} readTheme(); return ({LABELS})(); }})()")
    ends = {text: (left, right) for text, left, right in found}
    assert {"−0.0002", "2.6"} <= ends.keys()
    assert all(left >= 0.0 and right <= 600.0 for left, right in ends.values()), ends


def scripts() -> str:
    """All of the page's own but the one that starts it."""
    own = Path(birdstrike.reports.explore.explore.__file__).parent / "page"
    return "".join((own / script).read_text(encoding="utf-8") for script in SCRIPTS if script != "main.js")


def test_residuals_have_a_scale_whatever_they_reach(browser: Browser, page: Path) -> None:
    """Three of four panels of the demo had a single tick, 0."""
    browser.open(page)
    reaches = [float(reach) for reach in np.geomspace(0.1, 1.0, 60)]
    found = browser.run(
        f"(() => {{ {scripts()} return {reaches}.map((r) => ticksOf([-r, r], RESIDUAL_ROWS).length); }})()"
    )
    assert min(found) >= 3
    assert max(found) <= 5


def test_what_is_copied_says_of_which_shots_it_is(browser: Browser, page: Path) -> None:
    """The command for the first shot's case had the effect of another shot alone, and an instrument that is stated
    otherwise in another shot's case was not told."""
    browser.open(page)
    stated = {"gain": 1, "time_offset": 0, "drift": 0, "bandwidth": None}
    gain = {"name": "sensor_gain", "single": "w", "stated": stated, "elsewhere": {"fast": {**stated, "gain": 1.5}}}
    effects = [
        {**gain, "label": "sensor_gain.w", "shots": ["slow", "fast"]},
        {"name": "impact_speed", "label": "impact_speed@fast", "shots": ["fast"], "single": None, "unit": ""},
    ]
    view = json.dumps({"parameters": [], "effects": effects, "case": "case.toml", "shots": [{"name": "slow"}]})
    point = '{"theta": [], "effects": {"sensor_gain.w": 0.02, "impact_speed@fast": 0.05}}'
    toml, command = browser.run(
        f"(() => {{ {scripts()} return [tomlOf, commandOf].map((of) => of({view}, {point})); }})()"
    )
    assert "gain = 1.02 # of shot fast: 1.53\n" in toml
    assert "impact_speed = 0.05 # of shot fast alone\n" in toml
    assert command == "birdstrike simulate case.toml --set instrument.w.gain=1.02 --out what_if"


def test_probabilities_read_as_in_the_sentence_of_a_diagnosis(browser: Browser, page: Path) -> None:
    browser.open(page)
    found = browser.run(f"(() => {{ {scripts()} return [1 - 1e-9, 0.0096, 2e-9].map(probabilityText); }})()")
    assert found == ["1.00", "0.01", "< 0.01"]


def test_a_screen_reader_is_told_of_every_part(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.until("document.querySelector('.panel canvas').getAttribute('aria-label')")
    parts = browser.tree()
    sliders = [part for part in parts if part["role"] == "slider"]
    assert len(sliders) == browser.run("window.explore.state.view.parameters.length") + 1  # the time origin
    assert {"viscosity", "pressure cutoff"} <= {part["name"].lower() for part in sliders}
    for role in ("slider", "button", "combobox", "spinbutton", "image"):
        unnamed = [part for part in parts if part["role"] == role and not part["name"]]
        assert not unnamed, role
    assert browser.run("document.querySelector('#sliders input[type=range]').getAttribute('aria-valuetext')")


def test_the_map_shows_what_is_not_identifiable_as_a_valley(browser: Browser, page: Path) -> None:
    """The formula feels viscosity, the cutoff hardly: along the latter the misfit is flat."""
    browser.open(page)
    browser.until("window.explore.state.profile.values && window.explore.state.map.rows")
    rows = "window.explore.state.map.rows.map((row) => [...row])"
    across, up = browser.run("[window.explore.state.map.across.id, window.explore.state.map.up.id]")
    assert {across, up} == {"bird.material.viscosity", "bird.material.pressure_cutoff"}
    found = np.array(browser.run(rows), dtype=float)
    assert np.nanmax(found) > 5 * np.nanmin(found)
    browser.run(
        "(() => { const select = document.getElementById('profile-axis'); select.value = [...select.options].findIndex("
        "(option) => option.textContent === 'pressure cutoff'); select.dispatchEvent(new Event('change')); })()"
    )
    browser.until(
        "window.explore.state.profile.axis.title === 'pressure cutoff' && window.explore.state.profile.values"
    )
    assert "hardly tells" in browser.run("document.getElementById('profile-words').textContent")


BESIDE = """() => {
  const { state, draw } = window.explore, map = document.getElementById("map"), axes = state.view.parameters;
  const seen = (best) => {
    state.best = best; draw();
    const { left, top, height } = state.map.frame, ratio = map.width / map.clientWidth;
    const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
    canvas.width = 12; canvas.height = 12;
    pen.fillStyle = "#ffffff"; pen.fillRect(0, 0, 12, 12);
    pen.drawImage(map, ratio * (left - 12), ratio * (top + height), ratio * 12, ratio * 12, 0, 0, 12, 12);
    return pen.getImageData(0, 0, 12, 12).data;
  };
  const bare = seen(null), theta = axes.map(({ low }) => low);
  return Math.max(...seen({ point: { theta, effects: {}, clock: 0 }, misfit: 1 }).map((v, i) => Math.abs(v - bare[i])));
}"""
"""Largest change of a pixel's red, green or blue left of the map's lower left corner when the best point lies there."""


def test_the_best_point_is_seen_on_the_page_beside_the_map(browser: Browser, page: Path) -> None:
    """At the edge of the map its ring was white on white."""
    browser.open(page)
    browser.until("window.explore.state.best && window.explore.state.map.frame")
    assert browser.run(f"({BESIDE})()") > 150


def test_the_command_writes_a_small_page_and_says_where(loop: Path, tmp_path: Path) -> None:
    found = CliRunner().invoke(app, ["explore", str(loop), "--out", str(tmp_path / "what_if.html"), "--json"])
    assert found.exit_code == 0, found.output
    told = json.loads(found.stdout.splitlines()[-1])
    assert told["bytes"] == (tmp_path / "what_if.html").stat().st_size < LARGEST
    for tag in re.findall(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=\S+", (tmp_path / "what_if.html").read_text()):
        assert "data:," in tag


def test_a_loop_that_has_adopted_its_campaign_is_explored(loop: Path, tmp_path: Path) -> None:
    """Its campaign lies elsewhere: there is no folder doe."""
    shutil.copytree(loop / "inversion", tmp_path / "loop" / "inversion")
    assert "Calibration" in explore(tmp_path / "loop").read_text(encoding="utf-8")


def test_a_loop_is_explored_without_a_diagnosis_of_another_record(loop: Path, tmp_path: Path) -> None:
    shutil.copytree(loop / "inversion", tmp_path / "loop" / "inversion")
    (tmp_path / "loop" / "diagnosis").mkdir()
    record = {"path": "shot6.csv", "simulated": False, "shots": ["shot6"], "files": ["shot6.csv"]}
    written_diagnosis(tmp_path / "loop" / "diagnosis", record=record)
    text = explore(tmp_path / "loop").read_text(encoding="utf-8")
    assert "is of shot6.csv, not of shot7.csv, the record of the inversion" in text


def test_a_folder_without_results_names_the_commands(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="close-the-loop, calibrate-models, diagnose, train-and-invert, run-doe"):
        explore(tmp_path)
