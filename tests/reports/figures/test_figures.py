"""Every figure: ink on paper, units on the axes, no legend over data, and the same bytes for the same data."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO

import matplotlib.image as images
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.mesh_convergence.grid_convergence import grid_convergence
from birdstrike.inversion.observations.reader import HELD
from birdstrike.reports.comparison.end_state import impulse
from birdstrike.reports.figures.audit import confusion_figure
from birdstrike.reports.figures.calibrated_models import curves_figure as models_of_one_shot
from birdstrike.reports.figures.convergence import order_words
from birdstrike.reports.figures.curves import RecordCurve, VerifiedCurve, comparison_figure
from birdstrike.reports.figures.cut import Sheets
from birdstrike.reports.figures.design import design_figure
from birdstrike.reports.figures.diagnosis import residual_figure
from birdstrike.reports.figures.models import ModelCurve, models_figure, running_mean
from birdstrike.reports.figures.parameters import Mark, ParameterRow, parameters_figure
from birdstrike.reports.figures.posterior import corner_figure, sobol_figure
from birdstrike.reports.figures.prior_predictive import prior_predictive_figure
from birdstrike.reports.figures.quantities import shown_span
from birdstrike.reports.figures.record import DrawnChannel, record_figure
from birdstrike.reports.figures.setup import SetUp, bird_outline, setup_figure
from birdstrike.reports.figures.shapes import shapes_figure
from birdstrike.reports.figures.stress import stress_figure, stress_scales
from birdstrike.reports.figures.style import inline_svg, png
from birdstrike.reports.figures.switches import COLOURS, mark_legends, readings, switches_in, with_switches
from birdstrike.reports.figures.training import hidden_size_figure, training_figure
from birdstrike.reports.figures.views import Scene, mid_line, push_direction, window
from tests.reports.synthetic import RECORD_TIMES, contact_force, displacement, plate, strike

RUN = strike()
RESTING, QUADS = plate(0.0)
RECORD = displacement(RECORD_TIMES, 5.65e-3, 2.45e-3)
NAMES = ("bird.material.pressure_cutoff", "bird.material.viscosity", "bird.material.tension_erosion")


def comparison(time: np.ndarray = RECORD_TIMES, sigma: float | None = 5e-5) -> Figure:
    values = displacement(time, 5.65e-3, 2.45e-3)
    verified = {
        method: VerifiedCurve(run.time, run.channels["displacement_centre"], run.at("displacement_centre", time))
        for method, run in (("network", strike(5.3e-3)), ("emulator", strike(5.9e-3)))
    }
    noise = None if sigma is None else np.full(time.size, sigma)
    label = "record, simulated by LS-DYNA"
    return comparison_figure("displacement_centre", "m", RecordCurve(time, values, noise, label), verified)


def prior() -> Figure:
    curves = np.stack([displacement(RUN.time, peak) for peak in np.linspace(5.0e-3, 5.5e-3, 25)])
    smooth = np.arange(25) != 3
    outside = np.interp(RECORD_TIMES, RUN.time, curves.max(axis=0)) < RECORD
    record = RecordCurve(RECORD_TIMES, RECORD, None, "record, measured")
    return prior_predictive_figure("displacement_centre", "m", RUN.time, curves, smooth, record, outside)


def design() -> Figure:
    lows, highs = np.array([-1.25e6, 0.0, 0.05]), np.array([-5e4, 1500.0, 1.25])
    names = ("PC", "MU", "TEROD")
    space = ParameterSpace(names, ("Pa", "Pa s", ""), lows, highs)
    values = space.to_physical(np.random.default_rng(0).random((25, 3)))
    return design_figure(names, space, values, np.arange(25) % 5 == 0, {2: 1.0})


def small_design() -> Figure:
    """Of two parameters: its only axes leave no room for a legend."""
    return logarithmic_design(np.random.default_rng(0).random((25, 2)))


def logarithmic_design(unit: np.ndarray) -> Figure:
    """Over three decades of each, one below 0."""
    lows, highs = np.array([-1e6, 1.0]), np.array([-1e3, 1e3])
    space = ParameterSpace(("PC", "MU"), ("Pa", "Pa s"), lows, highs, ("logarithmic",) * 2)
    return design_figure(space.names, space, space.to_physical(unit), np.arange(len(unit)) % 5 == 0, {})


def parameters() -> Figure:
    rows = [
        ParameterRow(
            NAMES[0], "Pa", -1.25e6, -5e4, {"network": Mark(-4e5, (-6e5, -2e5)), "emulator": Mark(None, None)}
        ),
        ParameterRow(NAMES[2], "", 0.05, 1.25, {"network": Mark(None, None), "emulator": Mark(None, None)}),
    ]
    return parameters_figure(rows)


def models(channel: str = "displacement_centre") -> Figure:
    runs = {"elastic": strike(8e-3), "hydrodynamic": strike(4.8e-3), "emulator": strike(5.6e-3)}
    force = channel != "displacement_centre"
    curves = [
        ModelCurve(
            key,
            f"{key} bird",
            run.time,
            run.channels[channel],
            None if force else run.at(channel, RECORD_TIMES),
            impulse(run.time, run.channels[channel]) if force else None,
        )
        for key, run in runs.items()
    ]
    record = None if force else RecordCurve(RECORD_TIMES, RECORD, np.full(RECORD.size, 5e-5), "record, measured")
    return models_figure(channel, "N" if force else "m", curves, record, 45.5, (0.0, 2.4e-3))


SHEETS = Sheets(QUADS, np.zeros(len(QUADS), np.int64), ("plate",), np.full(len(QUADS), 0.01))
SCENE = Scene(RESTING, 0.01, 0.008, 1.0, SHEETS)
TITLES = ("elastic", "hydrodynamic")


def training() -> Figure:
    epoch = np.arange(200.0)
    return training_figure(epoch, 0.1 * np.exp(-epoch / 40) + 1e-3, 0.1 * np.exp(-epoch / 40) + 0.08, 1e-3)


SETUP = SetUp(
    0.525,
    0.43,
    0.01,
    "clamped",
    "hemispherical_cylinder",
    0.106,
    0.262,
    np.pi / 6,
    91.1,
    "axis",
    0.0077,
    {"w": (0.0, 0.0)},
)

FIGURES: dict[str, Callable[[], Figure]] = {
    "comparison": comparison,
    "comparison of a dense record": lambda: comparison(np.linspace(0.0, 2.4e-3, 400)),
    "comparison without known noise": lambda: comparison(sigma=None),
    "prior": prior,
    "design": design,
    "design of two parameters": small_design,
    "sobol": lambda: sobol_figure((0.0, 1e-3), dict.fromkeys(NAMES, (0.5, 0.6))),
    "parameters": parameters,
    "models": models,
    "models, force": lambda: models("contact_force"),
    "training": training,
    "hidden size": lambda: hidden_size_figure({7: (0.30, 0.05), 8: (0.25, 0.03), 9: (0.20, 0.02)}),
    "setup": lambda: setup_figure(SETUP),
    "stress": lambda: stress_figure(dict.fromkeys(TITLES, RUN.snapshots[2]), SCENE),
    "shapes": lambda: shapes_figure(dict.fromkeys(TITLES, RUN.snapshots), (5e-4, 1e-3), SCENE),
}

every_figure = pytest.mark.parametrize("draw", FIGURES.values(), ids=FIGURES.keys())


def laid_out(figure: Figure) -> Figure:
    """The figure after its layout has been worked out, as a page does it."""
    png(figure)
    return figure


def on_show(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.axison]


@every_figure
def test_figure_has_ink(draw: Callable[[], Figure]) -> None:
    pixels = images.imread(BytesIO(png(draw(), 60)))[..., :3]
    assert np.mean(np.any(pixels < 0.9, axis=-1)) > 0.01


@every_figure
def test_axes_say_their_units(draw: Callable[[], Figure]) -> None:
    labels = [text for axes in on_show(draw()) for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
    assert labels or draw is parameters  # its bars carry their units at their ends
    assert [text for text in labels if not re.search(r"\[.+\]$", text) and text != "Epoch"] == []


@every_figure
def test_no_legend_covers_data(draw: Callable[[], Figure]) -> None:
    figure = laid_out(draw())
    assert all(axes.get_legend() is None for axes in figure.axes)
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert box.width > 0
        assert [axes for axes in on_show(figure) if box.overlaps(axes.get_window_extent())] == []


@every_figure
def test_text_stays_inside_the_figure(draw: Callable[[], Figure]) -> None:
    figure = laid_out(draw())
    for legend in figure.legends:
        assert legend.get_window_extent().x1 <= figure.bbox.x1 + 1


def test_the_set_up_s_labels_are_whole_whatever_its_proportions() -> None:
    """ "y [mm]" was cut at the page's left edge where the bird starts close to the plate."""
    for standoff in (1e-3, 7.7e-3, 0.1):
        figure = laid_out(setup_figure(SetUp(**{**vars(SETUP), "standoff": standoff})))
        assert min(axes.yaxis.label.get_window_extent().x0 for axes in figure.axes) >= 0


def test_simulated_curves_and_records_say_so_in_the_legend() -> None:
    said = [text.get_text() for text in comparison().legends[0].get_texts()]
    assert said[0] == "record, simulated by LS-DYNA"
    assert all(text.startswith("simulated") for text in said[1:])
    assert not any("measured" in text for text in said)
    assert any(text.get_text() == "simulated" for text in prior().legends[0].get_texts())


def test_the_same_data_give_the_same_drawing() -> None:
    assert inline_svg(comparison(), "a") == inline_svg(comparison(), "a")


def test_a_drawing_for_the_page_refers_only_to_itself() -> None:
    svg = inline_svg(prior(), "prior")
    assert "<metadata" not in svg
    assert "<?xml" not in svg
    assert set(re.findall(r'id="([^"-]+)-', svg)) == {"prior"}
    assert all(name.startswith("#prior-") for name in re.findall(r'href="([^"]+)"', svg))
    assert all(name.startswith("prior-") for name in re.findall(r"url\(#([^)]+)\)", svg))


def test_sobol_indices_stay_apart_in_a_black_and_white_print() -> None:
    (axes,) = sobol_figure((0.0, 1e-3), dict.fromkeys(NAMES, (0.5, 0.6))).axes
    assert len({line.get_linestyle() for line in axes.lines}) == len(NAMES)


def test_unidentified_parameters_show_no_marker() -> None:
    (axes,) = parameters().axes
    drawn = [np.atleast_1d(np.asarray(line.get_ydata(), dtype=float)) for line in axes.lines]
    heights = [float(y[0]) for y in drawn if y.size]
    assert heights, "the identified one is drawn"
    assert all(abs(height) < 0.5 for height in heights), "nothing on the second parameter's bar"


def test_impulse_of_a_half_sine_is_its_area() -> None:
    time = np.linspace(0.0, 3e-3, 3001)
    assert impulse(time, contact_force(time, 46.0))[-1] == pytest.approx(46.0, rel=1e-5)


@pytest.mark.parametrize("shape", ["hemispherical_cylinder", "cylinder", "ellipsoid", "sphere"])
def test_bird_outline_hangs_the_standoff_above_the_plate(shape: str) -> None:
    setup = SetUp(**{**vars(SETUP), "bird_shape": shape})
    outline = bird_outline(setup, 4000)
    assert outline[:, 1].min() == pytest.approx(0.005 + 0.0077, abs=1e-6)
    centre = (outline.max(axis=0) + outline.min(axis=0)) / 2  # the outlines are symmetric about the bird's centre
    assert centre[1] / -centre[0] == pytest.approx(np.tan(np.pi / 6), rel=1e-3), "the axis meets the plate's centre"


def test_first_touch_falls_on_the_centre() -> None:
    setup = SetUp(**{**vars(SETUP), "aim": "first_touch"})
    outline = bird_outline(setup, 4000)
    lowest = outline[np.argmin(outline[:, 1]), 0]
    assert lowest + setup.standoff / np.tan(setup.angle) == pytest.approx(0.0, abs=2e-4)


def test_names_of_sensors_in_a_row_do_not_overlap() -> None:
    places = {"displacement_centre": 0.0, "displacement_x105": 0.105, "strain_aft": -0.105, "displacement_x210": 0.21}
    figure = setup_figure(SetUp(**{**vars(SETUP), "sensors": {name: (x, 0.0) for name, x in places.items()}}))
    figure.canvas.draw()
    shown = [text for text in figure.axes[1].texts if text.get_text() in {name.replace("_", " ") for name in places}]
    assert len(shown) == len(places)
    boxes = [text.get_window_extent() for text in shown]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


def test_the_bird_comes_from_above() -> None:
    assert push_direction(RUN.snapshots) == -1.0
    line = mid_line(RESTING)
    assert np.all(np.diff(RESTING[line, 0]) > 0)
    assert np.ptp(RESTING[line, 1]) < 1e-9
    assert len(line) == 51


def test_a_view_and_its_mid_line_move_with_the_plate() -> None:
    """A mesh from a file may begin at the origin."""
    away = np.array([0.4, 0.2, 0.0])
    moved = [replace(s, nodes=s.nodes + away, particles=s.particles + away) for s in RUN.snapshots]
    np.testing.assert_array_equal(mid_line(RESTING + away), mid_line(RESTING))
    (x, height), (x_there, height_there) = (
        window(RUN.snapshots, SCENE),
        window(moved, replace(SCENE, resting=RESTING + away)),
    )
    np.testing.assert_allclose(x_there, x + 1e3 * away[0], rtol=1e-12)
    np.testing.assert_array_equal(height_there, height)
    steep = replace(SCENE, resting=RESTING + np.outer(RESTING[:, 0], [0.0, 0.0, 2.0]))
    assert window(RUN.snapshots, steep)[1][1] > 1e3 * steep.resting[:, 2].max(), "the end of a steep plate was cut off"


def test_one_scale_of_stress_holds_all_models() -> None:
    gentle, hard = RUN.snapshots[2], replace(RUN.snapshots[2], bird_stress=30.0 * RUN.snapshots[2].bird_stress)
    together, alone = stress_scales([gentle, hard]), stress_scales([gentle])
    assert float(together.bird.vmax or 0.0) > 10.0 * float(alone.bird.vmax or np.inf)
    assert together.plate.vmax == alone.plate.vmax == pytest.approx(1e-6 * gentle.plate_stress.max())


def test_numbers_below_neighbouring_columns_do_not_touch() -> None:
    """The 300 of one plate and the -300 of the next were one number, `300-300`."""
    larger, snapshot = 1.143, RUN.snapshots[2]
    wide = replace(snapshot, nodes=larger * snapshot.nodes, particles=larger * snapshot.particles)
    figure = stress_figure({"a": wide, "b": wide}, replace(SCENE, resting=larger * RESTING))
    figure.draw_without_rendering()
    left, right = (axes for axes in figure.axes if axes.get_xlabel().startswith("x along"))
    ends = [[tick.label1.get_window_extent() for tick in axes.xaxis.get_major_ticks()] for axes in (left, right)]
    assert max(box.x1 for box in ends[0]) < min(box.x0 for box in ends[1])


def test_a_running_mean_keeps_a_line_and_delays_nothing() -> None:
    time = np.linspace(0.0, 2e-3, 401)
    np.testing.assert_allclose(running_mean(time, 3.0 * time)[20:-20], 3.0 * time[20:-20], rtol=1e-12)
    bump = np.exp(-(((time - 1e-3) / 2e-4) ** 2))
    assert time[np.argmax(running_mean(time, bump))] == pytest.approx(1e-3, abs=1e-9)


def test_a_curve_and_its_legend_share_one_switch() -> None:
    figure = models()
    mark_legends(figure)
    svg = with_switches(inline_svg(figure, "m"))
    assert switches_in(figure) == ("record", "elastic", "hydrodynamic", "emulator")
    for key in ("elastic", "hydrodynamic", "emulator"):
        assert svg.count(f'data-switch="{key}"') == 4, "curve, residual, legend's line, legend's words"
    assert "switch-" not in svg.replace("data-switch", "")


def test_the_pointer_reads_the_curves_where_they_are_drawn() -> None:
    """The value at an axes' pixel, found through box and span, is the curve's own."""
    figure = models()
    inline_svg(figure, "m")
    above, below = readings(figure)
    assert above["unit"] == below["unit"] == "ms"
    assert above["span"] == pytest.approx([0.0, 2.4])
    assert [curve["switch"] for curve in above["curves"]] == ["record", "elastic", "hydrodynamic", "emulator"]
    elastic = above["curves"][1]
    expected = 1e3 * strike(8e-3).at("displacement_centre", 1e-3 * np.array(elastic["x"]))
    np.testing.assert_allclose(elastic["y"], expected, rtol=1e-4, atol=1e-6)
    left, top, width, height = above["box"]
    whole = 72.0 * figure.get_size_inches()
    assert left > 20
    assert left + width <= whole[0]
    assert top + height < below["box"][1] + below["box"][3] <= whole[1]


def test_a_record_that_is_much_longer_than_the_impact_does_not_squeeze_it() -> None:
    """Of a logger's 100 ms about an impact of 2 ms the page showed 100 ms."""
    assert shown_span(np.array([-0.05, 0.05]), 2e-3) == pytest.approx((-0.25 * 2.5e-3, 1.04 * 2.5e-3))
    assert shown_span(np.array([-1e-4, 1.9e-3]), 2e-3) == pytest.approx((-1e-4, 1.04 * 1.9e-3))
    assert shown_span(np.array([1e-4, 1.9e-3]), 2e-3)[0] == 0.0


def test_curves_that_share_a_switch_are_read_one_by_one() -> None:
    """Of the bird models with calibrated constants the pointer read the first alone, in the colour of the switch."""
    record = RecordCurve(RECORD_TIMES, RECORD, None, "record, measured")
    runs = {"null": RUN, "elastic": strike(8e-3)}
    figure = models_of_one_shot({"displacement_centre": "m"}, {"displacement_centre": record}, runs, {}, list(runs))
    inline_svg(figure, "m")
    (axes,) = readings(figure)
    assert [one.get("title") for one in axes["curves"]] == ["null, calibrated", "elastic, calibrated", None]
    assert len({one["colour"] for one in axes["curves"][:2]} - {COLOURS["calibrated"]}) == 2
    assert axes["span"][1] > 1e3 * RECORD_TIMES[-1], "the last marker was cut in half"


def test_the_words_of_a_peak_at_a_record_s_end_stay_within_the_axes() -> None:
    """Behind the drop line they left the axes, which were then drawn narrower than those of the other sensors."""
    rising = 1e-3 * RECORD_TIMES / RECORD_TIMES[-1]
    short = RecordCurve(RECORD_TIMES, rising, None, "record, measured")
    end, logged = float(RUN.time[-1]), np.linspace(0.0, 0.1, 2001)  # shown to 1.3 times the simulation's end
    long = RecordCurve(logged, 1e-3 * np.exp(-(((logged - 1.2 * end) / 1e-3) ** 2)), None, "record, measured")
    run = VerifiedCurve(RUN.time, RUN.channels["displacement_centre"], np.zeros(len(logged)))
    for record, verified in ((short, {}), (long, {"emulator": run})):
        figure = comparison_figure("displacement_centre", "m", record, verified)
        figure.draw_without_rendering()
        above = figure.axes[0]
        (words,) = (text for text in above.texts if text.get_text().startswith("peak"))
        assert words.get_window_extent().x1 <= above.bbox.x1


def test_a_strain_has_its_unit_on_the_axis_and_residuals_say_their_sense() -> None:
    figure = comparison_figure("strain", "", RecordCurve(RECORD_TIMES, RECORD, None, "record, measured"), {})
    above, below = figure.axes[:2]
    (words,) = (text.get_text() for text in above.texts if text.get_text().startswith("peak"))
    assert words.startswith("peak 5622 µm/m at ")
    assert above.get_ylabel() == "Strain [µm/m]"
    assert below.get_ylabel() == "Simulated\n− record [µm/m]"
    assert [axes.get_ylabel() for axes in models().axes][1].startswith("Simulated")


def test_what_was_planted_and_answered_stands_in_words() -> None:
    confusion = {"bird_yaw + impact_offset@shot1": {"edge_slip": 0.5, "unexplained": 0.5}}
    (axes,) = confusion_figure(confusion).axes
    assert axes.get_yticklabels()[0].get_text() == "bird yaw + impact offset, shot1"
    names = [label.get_text() for label in axes.get_xticklabels()]
    assert names[:3] == ["edge slip", "none needed", "ambiguous, truth among them"]


def test_each_column_of_a_residual_figure_has_its_time_below() -> None:
    """Of three sensors the second column ends a row above the first."""
    names = ("displacement_centre", "displacement_quarter", "reaction_force")
    columns = ("measured", "sigma", "error", "baseline", "before", "after", "before_solver", "after_solver")
    table = [{"channel": name, "time_s": t} | dict.fromkeys(columns, 1.0) for name in names for t in RECORD_TIMES]
    figure = residual_figure(pd.DataFrame(table), dict(zip(names, ("m", "m", "N"), strict=True)))
    figure.draw_without_rendering()
    titled = [axes.get_xlabel() for axes in figure.axes[:3]]
    assert titled == ["", "time [ms]", "time [ms]"]
    assert [any(label.get_visible() for label in axes.get_xticklabels()) for axes in figure.axes[:3]] == [
        False,
        True,
        True,
    ]


def test_readings_between_repeated_ones_are_seen() -> None:
    """Each stands alone, so that a line through them draws nothing."""
    time = 1e-5 * np.arange(200)
    held = time[np.arange(200) % 5 != 0]
    drawn = DrawnChannel(
        "displacement_centre", "m", time, 1e-3 * np.sin(1e3 * time), {HELD: held}, None, 1e-5, "stated"
    )
    (used,) = (line for line in record_figure([drawn]).axes[0].get_lines() if line.get_label() == "used")
    assert used.get_marker() == "o"


def test_a_drawn_order_that_is_not_the_observed_one_is_told() -> None:
    """A title said order 10.57 above a curve of order 2, which passed by the coarsest value."""
    capped = grid_convergence([1.0, 1.3, 1.7], [38.3, 38.5, 40.7])
    assert capped.order is not None
    assert capped.order > 3.0
    assert order_words(capped) == f", observed order {capped.order:.2f}; curve: order {capped.order_used:.3g}"
    assert order_words(grid_convergence([1.0, 2.0, 4.0], [1.0, 2.0, 1.0])) == ""


def test_parameters_over_decades_stand_in_their_logarithm() -> None:
    """An answer at 1 of 0.01 .. 100 stood at the lower end of its bar, and its draws in one bin."""
    row = ParameterRow("MU", "Pa s", 0.01, 100.0, {"emulator": Mark(1.0, (0.1, 10.0))}, logarithmic=True)
    (axes,) = parameters_figure([row]).axes
    interval, value = (line.get_xdata() for line in axes.get_lines()[:2])
    np.testing.assert_allclose(np.concatenate([interval, value]), [0.25, 0.75, 0.5])
    draws = {"PC": -np.geomspace(1e3, 1e6, 900), "MU": np.linspace(1.0, 2.0, 900)}
    figure = corner_figure(draws, {"PC": "Pa", "MU": ""}, {"PC": -3e4, "MU": 1.5}, ["PC"])
    heights = [patch.get_height() for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]
    assert len(heights) > 5
    assert max(heights) - min(heights) <= 1.0
    shown = figure.axes[0].transScale.transform(np.array([[-1.0, 0], [-0.1, 0], [-0.01, 0], [-0.001, 0]]))[:, 0]
    np.testing.assert_allclose(np.diff(shown), np.diff(shown)[0])


def test_runs_over_decades_are_spread_over_the_picture_as_over_their_ranges() -> None:
    """On linear axes nine of ten runs lay in a tenth of the box."""
    unit = np.random.default_rng(0).random((25, 2))
    (axes,) = logarithmic_design(unit).axes
    for line, held in zip(axes.get_lines()[:2], (False, True), strict=True):
        drawn = axes.transLimits.transform(axes.transScale.transform(line.get_xydata()))
        wanted = (unit[(np.arange(25) % 5 == 0) == held] + 0.06) / 1.12
        np.testing.assert_allclose(drawn, wanted, atol=1e-6)
