"""The page with sliders: its size, its start and its redraws, in processor time of the browser's thread. `make bench`.

Four channels of 600 instants over 25 runs of four parameters. The wall means something on an idle machine only, so
the processor time of the page's thread is read; what an empty call costs is taken off a redraw. Script
alone: ten redraws in one task, of which the browser paints the last.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birdstrike.reports.explore.explore import LARGEST, page
from birdstrike.reports.explore.view import View, channel, parameter, preset, record, runs
from birdstrike.surrogate.emulator import CurveEmulator, Emulator, jointly
from birdstrike.surrogate.features import Region
from birdstrike.surrogate.gaussian_process import kernel_of
from birdstrike.surrogate.scaling import Scaling
from birdstrike.surrogate.weights import emulator_table
from tests.reports.explore.browser import BROWSER, Browser

RUNS, INSTANTS, SENSORS, REDRAWS, AT_ONCE, COMPONENTS = 25, 600, 4, 150, 10, 5
NAMES = tuple(f"bird.material.{key}" for key in ("viscosity", "pressure_cutoff", "eos.C", "eos.S1"))

pytestmark = pytest.mark.skipif(not BROWSER, reason="no chromium or google-chrome on the PATH")


def view() -> View:
    """Curves of smooth shapes at random points, with fixed hyperparameters."""
    rng, time = np.random.default_rng(0), np.linspace(0.0, 3e-3, INSTANTS)
    theta = rng.uniform(size=(RUNS, len(NAMES)))
    shapes = np.array([np.sin((k + 1) * 1e3 * time) for k in range(COMPONENTS)])
    weights = np.array([np.sin((k + 1) * theta @ rng.uniform(size=4)) / (k + 1) for k in range(COMPONENTS)]).T
    curves = {f"sensor_{i}": 1e-3 * (5.0 + i + weights) @ shapes for i in range(SENSORS)}
    kernel = kernel_of(len(NAMES), np.log([1.0, *[1.0] * len(NAMES), 1e-4]))
    fitted = {name: CurveEmulator.fit(time, y, theta, kernels=[kernel] * COMPONENTS) for name, y in curves.items()}
    box = (Region(np.zeros(4), np.ones(4), np.zeros(4, dtype=bool)),)
    emulator = Emulator(NAMES, tuple(range(RUNS)), box, Scaling(np.zeros(4), np.ones(4)), jointly(fitted))
    noise = np.full(INSTANTS, 3e-5)
    sensors = [
        channel(name, "m", 3e-5, record(time, y[0] + 3e-5 * rng.normal(size=INSTANTS), noise, "a record"))
        for name, y in curves.items()
    ]
    return View(
        title="Bench",
        parameters=[parameter(name, "Pa s", 0.0, 1.0) for name in NAMES],
        systems=[emulator_table(emulator)],
        shots=[{"name": "shot", "system": 0, "channels": sensors}],
        answers=[],
        presets=[preset("middle", [0.5] * 4)],
        runs=runs(theta, time, curves),
        case="case.toml",
    )


REDRAW = """(i) => {
  const { state, draw } = window.explore;
  state.point.theta = state.point.theta.map((_, j) => 0.5 + 0.4 * Math.sin(0.1 * i + j));
  draw();
}"""


def spent(browser: Browser, script: str) -> np.ndarray:
    """Processor time [s] of each of many calls of a function of the call's number."""
    marks = [browser.processor()]
    for i in range(REDRAWS):
        browser.run(f"({script})({i})")
        marks.append(browser.processor())
    return np.diff(marks)


def test_the_page_to_play_with(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "explore.html"
    path.write_text(page([view()], "bench"), encoding="utf-8")
    with Browser(tmp_path / "profile") as browser:
        idle = browser.processor()
        browser.open(path)
        start = browser.processor() - idle
        browser.until(
            "window.explore.state.profile.values && window.explore.state.map.rows && window.explore.state.best"
        )
        settled = browser.processor() - idle
        nothing = np.median(spent(browser, "() => {}"))
        painted = 1e3 * (spent(browser, REDRAW) - nothing)
        several = f"(i) => {{ for (let j = 0; j < {AT_ONCE}; j += 1) ({REDRAW})({AT_ONCE} * i + j); }}"
        script = 1e3 * (spent(browser, several) - nothing) / AT_ONCE
    with capsys.disabled():
        print(  # noqa: T201
            f"\nexplore.html: {path.stat().st_size / 1e6:.2f} MB of at most {LARGEST / 1e6:.0f}; start {start:.2f} s; "
            f"map, profile and best fit {settled - start:.2f} s; a redraw of {SENSORS} channels of {INSTANTS} points: "
            f"script {np.median(script):.1f} ms (median), {np.quantile(script, 0.95):.1f} ms (95 %), with painting "
            f"{np.median(painted):.1f} and {np.quantile(painted, 0.95):.1f} ms"
        )
