"""The page in a real browser, offline: no console message, every figure drawn, switches, pointer and player at work."""

from __future__ import annotations

import html
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import matplotlib.image as images
import numpy as np
import pytest

from birdstrike.reports.blocks import Lines, Paragraph, Picture, Section, Table, Warnings
from birdstrike.reports.page.render import rendered
from tests.reports.explore.browser import BROWSER, Browser

OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --hide-scrollbars --enable-logging=stderr --v=0 --window-size=1200,6000"
)
PROBE = Path(__file__).with_name("probe.js")

pytestmark = pytest.mark.skipif(not BROWSER, reason="no chromium or google-chrome on the PATH")


def browse(page: Path, folder: Path, *options: str) -> tuple[list[str], str]:
    """Console lines and standard output of a visit to a page."""
    command = [BROWSER, *OPTIONS.split(), f"--user-data-dir={folder / 'profile'}", *options, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return [line for line in done.stderr.splitlines() if "CONSOLE" in line], done.stdout


@pytest.fixture(scope="module")
def probed(page: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a reader's script found in the page, its console lines included."""
    folder = tmp_path_factory.mktemp("probe")
    copy = folder / "page.html"
    script = f"<script>{PROBE.read_text(encoding='utf-8')}</script></body>"
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", script), encoding="utf-8")
    console, dom = browse(copy, folder, "--virtual-time-budget=5000", "--dump-dom")
    answer = re.search(r'<pre id="answer">(.*?)</pre>', dom, re.DOTALL)
    assert answer, f"the probe did not finish: {console}"
    return {**json.loads(html.unescape(answer[1])), "console": console}


def test_the_console_is_heard(tmp_path: Path) -> None:
    broken = tmp_path / "broken.html"
    broken.write_text("<!doctype html><script>undefinedName()</script>")
    console, _ = browse(broken, tmp_path, f"--screenshot={tmp_path / 'shot.png'}")
    assert re.search("undefinedName is not defined", "\n".join(console))


def test_the_page_opens_without_a_console_message(page: Path, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    console, _ = browse(page, tmp_path, f"--screenshot={shot}")
    assert console == []
    pixels = images.imread(shot)[..., :3]
    ink = np.any(pixels < 0.9, axis=-1)
    assert pixels.shape[:2] == (6000, 1200)
    screens = ink.reshape(6, 1000, 1200).mean(axis=(1, 2))
    assert np.all(screens > 0.005), f"an empty stretch of page: {screens}"


def test_nothing_goes_wrong_while_the_page_is_used(probed: dict[str, Any]) -> None:
    assert probed["console"] == []
    assert probed["errors"] == []


def test_every_figure_is_drawn(probed: dict[str, Any]) -> None:
    assert len(probed["figures"]) == 15
    for name, figure in probed["figures"].items():
        assert figure["width"] > 300, name
        assert figure["height"] > 60, name
        assert figure["content"] > 20, name


def test_every_switch_acts_on_every_figure_that_has_its_curve(probed: dict[str, Any]) -> None:
    models = [f"figure-models-{sensor}" for sensor in ("displacement_centre", "contact_force", "reaction_force")]
    comparison, prior = "figure-comparison-displacement_centre", "figure-prior-predictive-displacement_centre"
    figures = {key: set(entry["figures"]) for key, entry in probed["switches"].items()}
    assert figures.pop("record") == {models[0], comparison, prior}
    assert figures.pop("campaign") == {prior}
    assert figures.pop("emulator") == {*models, comparison}
    assert figures.pop("network") == {comparison}
    assert figures == {key: set(models) for key in ("elastic", "plastic_kinematic", "hydrodynamic")}
    for key, entry in probed["switches"].items():
        assert entry["before"] == entry["after"] == entry["parts"] > 0, key
        assert entry["off"] == 0, key
    assert (probed["none"], probed["every"]) == (0, True)


def test_the_pointer_reads_values_of_the_models_that_are_shown(probed: dict[str, Any]) -> None:
    assert len(probed["pointer"]) == 5
    for name, entry in probed["pointer"].items():
        assert re.match(r"\d\.\d{3} ms, \w.* \[(mm|kN|N s)\]", entry["text"]), name
        assert entry["gone"], name
        if "models" in name:
            assert re.search(r"^elastic −?[\d.]+(e-\d+)?$", entry["text"], re.MULTILINE), entry["text"]
            assert "inverted NULL" in entry["without"]
            assert "elastic" not in entry["without"]


def test_the_strike_moves_and_every_model_has_its_own(probed: dict[str, Any]) -> None:
    seen = probed["animation"]
    assert seen["start"] != seen["end"]
    assert len(set(seen["models"])) == 4
    assert seen["played"] > 0
    assert seen["frames"] > 8


def test_a_long_name_without_a_blank_stays_on_the_page(tmp_path: Path) -> None:
    """A case's name of 120 letters made a phone's page three times as wide as the phone."""
    name = "panel_" * 20
    picture = Picture("long", "<svg></svg>", f"Caption of {name}", 300)
    blocks = Paragraph(name), Lines((name,)), Warnings((name,)), Table(("a", "b"), ((name, name),), name), picture
    page = tmp_path / "page.html"
    page.write_text(rendered(name, name, [Section("one", name, blocks)]), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        browser.resize(360, 740)
        browser.ask("Page.navigate", url=page.as_uri())
        browser.until("document.readyState === 'complete' && document.querySelector('h1')")
        assert browser.run("document.documentElement.scrollWidth") <= 360
        wide = "[...document.querySelectorAll('h1, h2, p, li, nav a, caption, figcaption, .scroll')].filter((one) => "
        assert browser.run(f"{wide}one.getBoundingClientRect().right > 360).map((one) => one.tagName)") == []


def test_a_jump_ends_below_the_row_of_switches_however_many_lines_that_has(tmp_path: Path) -> None:
    """In a narrow window the row has several lines, and covered the heading."""
    look = {"title": "a long name of a model", "colour": "#000", "dashes": "none", "width": "2"}
    switches = [{"key": f"k{i}", **look} for i in range(6)]
    sections = [Section(f"part{i}", f"Part {i}", tuple(Paragraph("Text.") for _ in range(60))) for i in range(3)]
    page = tmp_path / "page.html"
    page.write_text(rendered("Title", "", sections, switches), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        browser.resize(360, 740)
        browser.ask("Page.navigate", url=page.as_uri())
        browser.until("document.readyState === 'complete' && document.querySelector('#part1')")
        browser.until("getComputedStyle(document.documentElement).getPropertyValue('--bar')")
        top, bar = browser.run(
            "(() => { document.querySelector('nav a[href=\"#part1\"]').click(); "
            "return [document.querySelector('#part1 h2'), document.getElementById('switches')].map("
            "(one) => one.getBoundingClientRect()).map((box, i) => i ? box.bottom : box.top); })()"
        )
    assert bar > 60.0
    assert bar < top < bar + 80.0
