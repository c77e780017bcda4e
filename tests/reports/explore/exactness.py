"""The page's curves at random points of its sliders, to be held against the emulator in Python."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.reports.explore.browser import Browser

POINTS, EXACT = 50, 1e-4  # random points; largest difference, as a share of the curve's peak

MOVE = """(shares) => shares.map((row) => {
  const sliders = [...document.querySelectorAll("#sliders input[type=range]")];
  row.forEach((share, i) => { sliders[i].value = share; sliders[i].dispatchEvent(new Event("input")); });
  window.explore.draw();
  const { point, panels } = window.explore.state;
  return {
    theta: [...point.theta], effects: { ...point.effects }, clock: point.clock,
    curves: panels.map((panel) => [...panel.curve]), errors: panels.map((panel) => [...panel.error]),
  };
})"""


FAR = """(theta) => {
  const { state, draw, setPoint } = window.explore;
  setPoint({ ...state.point, theta });
  draw();
  const errors = state.panels.map((panel) => [...panel.error]);
  setPoint(state.view.presets[0]);
  return errors;
}"""


@dataclass(frozen=True)
class Drawn:
    """theta (k,), effects by label, SI; curves and errors: (channels, m) SI as the page drew them."""

    theta: np.ndarray
    effects: dict[str, float]
    curves: np.ndarray
    errors: np.ndarray


def drawn(browser: Browser, seed: int = 0, points: int = POINTS) -> list[Drawn]:
    """The curves at random places of all sliders of the page that is open."""
    count = browser.run("document.querySelectorAll('#sliders input[type=range]').length")
    shares = np.random.default_rng(seed).uniform(size=(points, count))
    found = browser.run(f"({MOVE})({shares.round(6).tolist()})")
    return [
        Drawn(np.array(one["theta"]), one["effects"], np.array(one["curves"]), np.array(one["errors"])) for one in found
    ]


def errors_at(browser: Browser, theta: np.ndarray) -> np.ndarray:
    """(channels, m) SI, the errors that the page draws at theta (k,) SI, which no slider needs to reach."""
    return np.array(browser.run(f"({FAR})({theta.tolist()})"), dtype=float)


def off(drawn_curve: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference over the peak."""
    return float(np.abs(drawn_curve - expected).max() / np.abs(expected).max())
