"""The picture of a target: what it shows lies where the case says, and `check --picture` writes it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.reports.figures.target import axes_of_view, drawn_target, hidden_from, target_figure
from birdstrike.solver.case.case import load_case
from tests.solver.test_struck_plane import strike

COARSE = {"target.generator.element_size": "25 mm", "bird.particles": "300"}


def test_bird_sensors_supports_and_rivets_stand_where_the_case_says():
    case = load_case("sidewall_004", COARSE)
    shown = drawn_target(case)
    assert shown.names == ("skin", "skin_2", "pad", "stiffeners")
    assert np.linalg.norm(shown.sensors["S1"] - [-0.012, 0.04, -0.06]) < 2e-3
    height = np.hypot(shown.bird[:, 0], shown.bird[:, 2] + 1.2) - 1.2
    flown = case.impact.standoff * np.sin(case.impact.angle)
    clear = height.min() - 0.5 * case.plate.thickness
    assert 0.9 * flown < clear < 1.5 * flown, "a stand-off before the skin, along the flight"
    way = np.array(case.impact.point) - shown.centre
    assert np.linalg.norm(np.cross(way, shown.velocity)) < 1e-6
    edges = shown.supports["edges"]
    assert np.isclose(np.abs(edges[:, 1]).max(), 0.35)
    assert len(shown.rivets) == 174
    legend = target_figure(shown).legends[0]
    told = [text.get_text() for text in legend.get_texts()]
    assert told[:4] == ["skin", "skin 2", "pad", "stiffeners"]
    assert told[4:] == ["held: edges", "rivets (174)", "sensors", "hollow: behind a shell"]


@pytest.mark.parametrize(
    ("case", "changes"), [("openradioss_panel", {}), ("openradioss_panel", {"bird.length": "600 mm"}), ("demo_rig", {})]
)
def test_both_views_are_to_one_scale_and_hold_their_names(case: str, changes: dict[str, str]):
    """Also where a long bird makes the one higher than the other, and where a sensor's name is long."""
    coarse = COARSE if case == "openradioss_panel" else {}
    figure = target_figure(drawn_target(load_case(case, coarse | changes)))
    figure.draw_without_rendering()
    boxes = [axes.get_window_extent() for axes in figure.axes]
    sizes = [box.width / np.ptp(axes.get_xlim()) for box, axes in zip(boxes, figure.axes, strict=True)]
    heights = [box.height / np.ptp(axes.get_ylim()) for box, axes in zip(boxes, figure.axes, strict=True)]
    assert np.allclose([*sizes, *heights], sizes[0], rtol=1e-3)
    texts = [text for axes in figure.axes for text in axes.texts if text.get_text()]
    assert max(text.get_window_extent().x1 for text in texts) <= figure.bbox.x1


def test_what_lies_behind_a_shell_is_known_from_either_side():
    """A sensor on a blade is hidden from the impact side alone, one on the skin from neither."""
    shown = drawn_target(load_case("openradioss_panel", COARSE))
    points = np.array([shown.sensors["u_blade"], shown.sensors["w_x60"]])
    front, back = (hidden_from(shown, points, axes_of_view(shown, behind)) for behind in (False, True))
    assert front.tolist() == [True, False]
    assert back.tolist() == [False, False]
    bare = drawn_target(load_case("flat_plate_002", COARSE))
    assert "hollow: behind a shell" not in [t.get_text() for t in target_figure(bare).legends[0].get_texts()]


@pytest.mark.parametrize("turn", [-50.0, 50.0, 90.0])
def test_a_turned_plate_is_seen_from_its_impact_side_as_a_level_one(tmp_path: Path, turn: float):
    """One that rises along the flight was seen from its back under the title "from the impact side"."""
    seen = []
    for degrees in (0.0, turn):
        shown = drawn_target(strike(tmp_path, degrees))
        front, back = (axes_of_view(shown, behind) @ shown.plane[2] for behind in (False, True))
        assert front[2] > 0.5
        assert back[2] < -0.5
        seen.append(shown.nodes @ axes_of_view(shown, behind=False).T)
    assert seen[1] == pytest.approx(seen[0], abs=1e-9)


def test_names_of_supports_at_one_place_stand_below_each_other(tmp_path: Path):
    shown = drawn_target(strike(tmp_path, 0.0))
    rim = shown.supports["rim"]
    figure = target_figure(replace(shown, supports={"left": rim, "ends": rim[:-1], "far": rim[rim[:, 0] > 0.09]}))
    assert {"left\nends", "far"} <= {text.get_text() for text in figure.axes[0].texts}


@pytest.mark.parametrize("case", ["flat_plate_002", "reference_strike"])
def test_check_writes_the_picture(case: str, tmp_path: Path):
    coarse = ["--set", "bird.particles=200"]
    if case != "reference_strike":
        coarse += ["--set", "target.generator.element_size=50 mm"]
    for name, start in (("shot.png", b"\x89PNG"), ("shot.svg", b"<?xml"), ("shot.pdf", b"%PDF")):
        done = CliRunner().invoke(app, ["check", case, *coarse, "--picture", str(tmp_path / name)])
        assert done.exit_code == 0, done.output
        assert (tmp_path / name).read_bytes().startswith(start)
    wrong = CliRunner().invoke(app, ["check", case, *coarse, "--picture", str(tmp_path / "shot.jpg")])
    assert wrong.exit_code != 0
    assert "a picture ends in .png, .svg, .pdf" in " ".join(wrong.output.split())
    assert "No errors" not in wrong.output


def test_several_supports_such_as_load_cells_are_named_where_they_hold():
    """Eight cells were told apart by the shape of marks a millimetre wide alone."""
    shown = drawn_target(load_case("openradioss_panel", COARSE))
    cells = {"cell_1": shown.nodes[:5], "cell_2": shown.nodes[-5:]}
    views = target_figure(replace(shown, supports=cells)).axes
    names = [[text.get_text() for text in axes.texts if text.get_text().startswith("cell")] for axes in views]
    assert names == [["cell 1", "cell 2"]] * 2
