"""A clipped record with pre-trigger and spikes: what a report compares, it compares at the points that were used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured, write_measured
from birdstrike.inversion.observations.reader import CLIPPED, OUTLIER
from birdstrike.inversion.prediction.from_inversion import CALIBRATED
from birdstrike.inversion.prediction.reading import read_learnt
from birdstrike.reports.comparison.clock import best_offset
from birdstrike.reports.page.page import report
from birdstrike.reports.results.findings import findings
from birdstrike.reports.results.measurement import peak, record_peak, record_position, residual
from birdstrike.reports.results.reading import read_results
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.curves import comparisons, record_curve
from birdstrike.reports.sections.models import nearest
from birdstrike.reports.sections.models_tables import errors_table, scores
from birdstrike.reports.sections.record import section
from birdstrike.reports.sections.summary import methods_table
from tests.reports.synthetic import displacement, finished_folder, strike

CHANNEL = "displacement_centre"
LIMIT = 4.0e-3
SPIKES = (100, 150)


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a record that the stand-in can produce, but for its amplifier's end at 4 mm and two spikes."""
    folder = tmp_path_factory.mktemp("clipped")
    time = np.linspace(-0.3e-3, 2.3e-3, 521)
    values = displacement(time, 5.5e-3, 2.38e-3) + 3e-5 * np.random.default_rng(1).normal(size=time.size)
    values[list(SPIKES)] = 3.0e-3
    record = {CHANNEL: np.minimum(values, LIMIT)}
    write_measured(folder / "shot.csv", Measured(time, record, {CHANNEL: np.full(521, 3e-5)}, {CHANNEL: "m"}))
    with pytest.MonkeyPatch.context() as patch:
        finished_folder(folder, folder / "shot.csv", patch, runs=12, posterior=False)
    return folder


@pytest.fixture(scope="module")
def clipped(loop: Path) -> Results:
    return read_results(loop)


def test_the_points_used_are_those_of_the_inversion(clipped: Results) -> None:
    used, cuts = clipped.used.channels[CHANNEL], clipped.inversion.measured.cuts[CHANNEL]
    assert np.isfinite(used).sum() == clipped.inversion.measured.points[CHANNEL]
    assert len(cuts[CLIPPED]) > 100
    assert len(cuts[OUTLIER]) == len(SPIKES)
    assert not np.isfinite(used[clipped.record.time < 0.0]).any()
    assert not np.isfinite(used[list(SPIKES)]).any()
    assert np.nanmax(used) < LIMIT


def test_a_model_is_scored_by_what_the_inversion_compared(clipped: Results) -> None:
    """The inverted bird scored 0.84 mm on a page whose summary said 0.20 mm, and the models' ranks turned round."""
    verified = clipped.answer.channels[CHANNEL]
    entry = scores(clipped)[clipped.best, CHANNEL]
    assert entry.rms == pytest.approx(verified.verified_rmse, rel=1e-6)
    assert entry.share == pytest.approx(verified.verified_relative, rel=1e-6)


def test_a_prediction_learns_the_model_s_error_from_the_points_used_alone(clipped: Results, loop: Path) -> None:
    """A clipped peak and two spikes were a model error of 14 % of the peak."""
    (shot,), own = read_learnt(loop).shots, clipped.inversion.measured
    error = shot.errors[CHANNEL]
    assert len(error.times) == own.points[CHANNEL]
    assert error.peak < LIMIT
    assert error.sigma == pytest.approx(own.noise[CHANNEL])
    assert np.sqrt(error.excess(CALIBRATED)) < 0.01


def test_the_right_bird_is_nearest_though_its_peak_was_clipped(clipped: Results) -> None:
    """A soft bird whose own peak is the amplifier's end came before the right one."""
    key, model = next(iter(clipped.models.items()))
    wrong = replace(model, key="elastic", title="elastic", run=strike(4.0e-3, steps=601, period=2.38e-3))
    ranked = replace(clipped, simulated_models={"elastic": wrong, key: model})
    assert f"nearest is {model.title}" in nearest(ranked)


def test_the_clock_of_a_model_follows_the_used_points_alone(clipped: Results) -> None:
    run, inversion = strike(5.5e-3, steps=601, period=2.38e-3), clipped.inversion
    free = replace(clipped, inversion=replace(inversion, time_offset=replace(inversion.time_offset, sigma=1e-4)))
    assert best_offset(free, run) == pytest.approx(0.0, abs=2e-6)


def test_a_clipped_peak_is_told_as_a_bound(clipped: Results) -> None:
    top = record_peak(clipped, CHANNEL)
    assert top.clipped
    assert top.value == pytest.approx(LIMIT)
    assert "(peak ≥ 4.00 mm, clipped from " in findings(clipped)[0]
    assert f"{clipped.inversion.measured.points[CHANNEL]} used points" in findings(clipped)[0]
    assert all(row[-2:] == ("–", "–") for row in methods_table(clipped).rows)
    assert all(row[3:5] == ("–", "–") for row in errors_table(clipped).rows)
    assert "(displacement centre ≥ 4.00 mm)" in methods_table(clipped).caption


def test_a_curve_with_a_stretch_left_out_has_no_rating_of_its_shape(clipped: Results) -> None:
    assert scores(clipped, shaped=True)[clipped.best, CHANNEL].rating is None


def test_a_sensor_clipped_on_the_other_side_keeps_its_peak(clipped: Results) -> None:
    record = clipped.record.channels[CHANNEL]
    shifted = np.where(record >= LIMIT, -2.0e-3, record)
    found = replace(clipped, record=replace(clipped.record, channels={CHANNEL: shifted}))
    top = record_peak(found, CHANNEL)
    assert not top.clipped
    assert 3.5e-3 < top.value < LIMIT


def test_a_simulated_peak_is_read_on_the_record_s_side(clipped: Results) -> None:
    """A caption had a strain's peak of +0.0051 beside the record's of -0.0050."""
    time, values = np.array([0.0, 1.0, 2.0]), np.array([0.0, -3.0, 4.0])
    assert peak(time, values) == (2.0, 4.0)
    assert peak(time, values, -1.0) == (1.0, -3.0)
    run = clipped.verified[clipped.best]
    swing = replace(run, channels={CHANNEL: np.where(np.arange(run.time.size) == 5, -1.0, run.channels[CHANNEL])})
    caption = comparisons(replace(clipped, verified={clipped.best: swing})).blocks[0].caption  # type: ignore[union-attr]
    top = record_peak(clipped, CHANNEL)
    assert top.side == 1.0
    assert "peak −" not in caption


def test_neither_residual_nor_range_counts_a_point_left_out(clipped: Results) -> None:
    assert abs(residual(clipped, CHANNEL, clipped.best).worst[1]) < 3e-4
    assert record_position(clipped, CHANNEL).points == clipped.inversion.measured.points[CHANNEL]


def test_points_left_out_are_drawn_apart(clipped: Results, loop: Path) -> None:
    curve, used = record_curve(clipped, CHANNEL), clipped.used.channels[CHANNEL]
    assert curve.left_out is not None
    assert not (np.isfinite(curve.left_out) & np.isfinite(used)).any()
    assert curve.read.all()
    assert curve.clipped == (record_peak(clipped, CHANNEL).time, pytest.approx(LIMIT))
    text = report(loop, models=False).read_text(encoding="utf-8")
    assert text.count("record, left out of the fit") == 3  # models, comparison, prior predictive
    assert "peak ≥ 4.00 mm, clipped from" in text


def test_the_record_as_it_was_read_says_how_much_lies_outside_the_simulated_record(clipped: Results) -> None:
    caption = section(clipped).blocks[0].caption  # type: ignore[union-attr]
    before = int((clipped.record.time < 0.0).sum())
    assert f"{before} points left out, outside the simulated record" in caption
