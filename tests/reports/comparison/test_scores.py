"""Errors and ratings of curves against closed forms and against another program's figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Histories, Snapshot
from birdstrike.reports.comparison.clock import best_offset
from birdstrike.reports.comparison.end_state import penetration, residual_deflection, sensor_of_kind, share_behind
from birdstrike.reports.comparison.iso18571 import SAMPLES, magnitude_score, rate
from birdstrike.reports.comparison.other_code import curve_pairs
from birdstrike.reports.comparison.scores import score, sprague_geers
from birdstrike.reports.results.results import Results
from birdstrike.reports.sections.models import _cells, sound_channel
from birdstrike.solver.case.case import load_case
from birdstrike.solver.estimate import first_period
from birdstrike.solver.sensors.sensor import torn
from tests.reports.synthetic import RECORD_TIMES, displacement, strike
from tests.solver.test_struck_plane import about_y
from tests.solver.test_struck_plane import strike as aslant_strike

TIME = np.linspace(0.0, 1.0, SAMPLES)
BUMP = np.sin(np.pi * TIME) ** 2

# objective_rating_metrics 1.3 (VSI TU Graz), unrounded: corridor, phase, magnitude, slope, overall.
ISO_18571 = {
    "scaled": (1.1 * BUMP, (0.9325210413337112, 1.0, 0.9581306732257295, 0.95, 0.9546345511786305)),
    "late": (
        np.sin(np.pi * np.clip(TIME - 0.04, 0.0, 1.0)) ** 2,
        (0.8500422945149672, 0.800498753117207, 1.0, 1.0, 0.9001166684294281),
    ),
    "rippled": (
        BUMP + 0.08 * np.sin(18.0 * np.pi * TIME),
        (0.951463142359795, 1.0, 0.9515198686744764, 0.3250554346019988, 0.8359003175992131),
    ),
    "another": (
        0.7 * np.sin(np.pi * np.clip(1.25 * TIME - 0.1, 0.0, 1.0)) ** 2,
        (0.43130119919055415, 0.9002493765586035, 0.661240254146032, 0.8407677460633728, 0.6529719550298233),
    ),
}


@pytest.mark.parametrize("name", ISO_18571)
def test_iso_18571_agrees_with_another_implementation(name: str) -> None:
    curve, expected = ISO_18571[name]
    rating = rate(BUMP, curve)
    found = (rating.corridor, rating.phase, rating.magnitude, rating.slope, rating.overall)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize(("curve", "slope"), [(np.full(SAMPLES, 2.0), 1.0), (BUMP, 0.0)])
def test_a_constant_record_has_a_score_of_its_slope(curve: np.ndarray, slope: float) -> None:
    with np.errstate(all="raise"):
        found = rate(np.full(SAMPLES, 2.0), curve)
    assert found.slope == slope
    assert 0.0 <= found.overall <= 1.0


def test_a_record_that_is_zero_where_both_overlap_has_a_magnitude() -> None:
    none = np.zeros(SAMPLES)
    with np.errstate(all="raise"):
        assert (magnitude_score(none, none), magnitude_score(none, BUMP)) == (1.0, 0.0)


def test_iso_18571_grades_as_the_standard_does() -> None:
    assert (rate(BUMP, BUMP).overall, rate(BUMP, BUMP).grade) == (1.0, "excellent")
    assert rate(BUMP, ISO_18571["late"][0]).grade == "good"
    assert rate(BUMP, ISO_18571["another"][0]).grade == "fair"
    assert rate(BUMP, -BUMP).grade == "poor"


def test_sprague_geers_of_a_scaled_and_of_a_shifted_sine() -> None:
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    magnitude, phase = sprague_geers(np.sin(t), 1.2 * np.sin(t))
    assert (magnitude, phase) == pytest.approx((0.2, 0.0), abs=1e-7)
    magnitude, phase = sprague_geers(np.sin(t), np.sin(t - 0.3))
    assert (magnitude, phase) == pytest.approx((0.0, 0.3 / np.pi), abs=1e-6)


def test_errors_of_a_curve_that_is_a_tenth_too_high() -> None:
    run, dense = strike(5.5e-3), np.linspace(0.0, 2.6e-3, 400)
    record = displacement(dense, 5.0e-3)
    found = score(dense, record, run, "displacement_centre", 0.0)
    assert found is not None
    assert found.share == pytest.approx(0.1 * np.sqrt(np.mean(record**2)) / 5.0e-3, rel=1e-3)
    assert (found.peak, found.peak_share) == pytest.approx((0.5e-3, 0.1), rel=1e-3)
    assert (found.peak_time, found.magnitude) == pytest.approx((0.0, 0.1), abs=1e-4)
    assert found.phase == pytest.approx(0.0, abs=1e-3)


def test_a_late_record_is_met_by_the_clock_and_not_charged_to_the_model(results: Results) -> None:
    """The record is the run 0.05 ms late; the trigger, known to 0.1 ms, pulls the offset to 0 by very little."""
    run, late = strike(5.5e-3), displacement(RECORD_TIMES - 0.05e-3, 5.5e-3)
    record = Measured(RECORD_TIMES, {"displacement_centre": late}, {}, {"displacement_centre": "m"})
    assert best_offset(replace(results, record=record), run) == pytest.approx(0.05e-3, abs=2e-6)


def test_a_plate_that_yielded_keeps_the_mean_of_its_last_swing(results: Results) -> None:
    """Swings about 2 mm after a short push, with the bird gone."""
    period = first_period(results.case)
    assert period is not None
    time = np.linspace(0.0, 8e-3, 1601)
    swing = 2e-3 + 1e-3 * np.sin(2 * np.pi * time / period)
    force = np.where(time < 1e-3, 1e4, 0.0)
    run = replace(
        strike(),
        time=time,
        channels={"displacement_centre": swing, "contact_force": force},
        summary={"largest_plastic_strain": 0.01},
    )
    found, _ = residual_deflection(results.case, run, "displacement_centre")
    assert found == pytest.approx(2e-3, rel=1e-2)
    short = replace(run, time=time[:300], channels={name: values[:300] for name, values in run.channels.items()})
    found, why = residual_deflection(results.case, short, "displacement_centre")
    assert found is None
    assert "time.end" in why
    assert residual_deflection(results.case, strike(), "displacement_centre")[0] == 0.0


def test_a_cell_under_one_support_or_along_another_axis_is_not_the_frame_s_force() -> None:
    """The impulse of one set of nodes was shown as that on the frame, and one along y as a share of it."""
    sensors = {
        "cell": {"kind": "reaction_force", "support": "edges"},
        "across": {"kind": "reaction_force", "support": "edges", "along": [0.0, 1.0, 0.0]},
        "sideways": {"kind": "reaction_force", "along": [0.0, 1.0, 0.0]},
        "frame": {"kind": "reaction_force"},
    }
    case = load_case("openradioss_panel", {"target.generator.element_size": "50 mm"}).overlaid({"sensors": sensors})
    time = np.linspace(0.0, 1e-3, 5)
    channels = {"cell": time, "across": time, "sideways": time, "frame": 3.0 * time}
    run = replace(strike(), time=time, channels=channels)
    assert sensor_of_kind(case, run, "reaction_force") == "frame"
    assert sensor_of_kind(case, replace(run, channels={"cell": time}), "reaction_force") is None
    shown: Any = SimpleNamespace(case=case, best="inverted", models={"inverted": SimpleNamespace(run=run)})
    assert _cells(shown) == ("cell",)


def test_a_residual_deflection_that_is_not_known_has_one_reason(results: Results) -> None:
    run = replace(strike(), summary={"largest_plastic_strain": 0.01})
    panel = load_case("openradioss_panel", {"target.generator.element_size": "50 mm"})
    blind = replace(run, channels={"displacement_centre": run.channels["displacement_centre"]})
    assert residual_deflection(results.case, blind, "displacement_centre") == (
        None, "no contact force sensor shows when the bird has left",
    )  # fmt: skip
    found = residual_deflection(panel, run, "displacement_centre")
    assert found == (None, "the first period of such a structure is not known")


def test_a_bird_behind_a_torn_plate_has_gone_through(results: Results) -> None:
    run = strike(summary={"eroded_shells": 9})
    assert penetration(results.case, strike()) == "no"
    assert penetration(results.case, run) == "no, but 9 shells torn"
    first, last = run.snapshots[0], run.snapshots[-1]
    half = np.arange(len(last.particles)) % 2 == 0
    moved = np.where(half[:, None], [0.0, 0.0, -0.2], last.particles)
    back = replace(last, particles=moved, velocity=-last.velocity, eroded=np.zeros(len(half), bool))
    through = replace(run, snapshots=(first, back))
    assert penetration(results.case, through) == "yes, 50 % of the bird"


def test_peaks_are_compared_on_the_side_of_the_record_s() -> None:
    """A simulation that swings farther the other way had its own peak compared, of the opposite sign and 1 ms away."""
    time = np.linspace(0.0, 3e-3, 301)
    swing = np.sin(2.0 * np.pi * time / 3e-3)
    curve = np.where(swing > 0.0, 4e-3 * swing, 6e-3 * swing)
    run = Histories(time, {"w": curve}, {"w": "m"})
    found = score(time, np.where(swing > 0.0, 5e-3 * swing, 3e-3 * swing), run, "w", 0.0)
    assert found is not None
    assert (found.peak, found.peak_share) == pytest.approx((-1e-3, -0.2), rel=1e-3)
    assert found.peak_time == pytest.approx(0.0, abs=1e-6)


def test_a_sensor_that_tore_away_does_not_rank_the_models(results: Results) -> None:
    run = strike(summary={"warnings": [torn("displacement_centre")]})
    force = {"displacement_centre": results.record.channels["displacement_centre"], "contact_force": RECORD_TIMES}
    both = replace(results, record=replace(results.record, channels=force))
    model = next(iter(results.models.values()))
    torn_away = {"elastic": replace(model, run=run)}
    assert sound_channel(both) == "displacement_centre"
    assert sound_channel(replace(both, simulated_models=torn_away)) == "contact_force"
    assert sound_channel(replace(results, simulated_models=torn_away)) == "displacement_centre"


def test_another_code_s_peak_is_compared_on_its_own_side() -> None:
    time = np.linspace(0.0, 3e-3, 301)
    swing = np.sin(2.0 * np.pi * time / 3e-3)
    ours = Histories(time, {"w": np.where(swing > 0.0, 4e-3 * swing, 6e-3 * swing)}, {"w": "m"})
    theirs = Histories(time, {"w": np.where(swing > 0.0, 5e-3 * swing, 3e-3 * swing)}, {"w": "m"})
    (pair,) = curve_pairs(ours, theirs)
    found = pair.figures()
    assert (found["peak_ours"], found["peak_theirs"]) == pytest.approx((4e-3, 5e-3), rel=1e-3)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0])
def test_a_bird_is_through_a_plate_however_it_lies(tmp_path: Path, degrees: float) -> None:
    """Of three pieces one is 20 mm behind it, one before it, one has flown past its rim.

    Counted along z, a bird that was through a plate aslant was not.
    """
    case, turn = aslant_strike(tmp_path, degrees), about_y(degrees)
    assert case.target is not None
    mesh = case.target.source.mesh()
    first = np.array([[0.0, 0.0, 0.03], [0.05, 0.0, 0.03], [0.2, 0.0, 0.03]]) @ turn.T
    last = np.array([[-0.08, 0.0, -0.02], [0.08, 0.0, 0.02], [0.2, 0.0, -0.02]]) @ turn.T
    none, cells = np.zeros(3), np.empty((0, 8), np.int64)
    seen = [
        Snapshot(t, x, none, 0.0 * x, none > 0.0, none, cells, mesh.nodes, mesh.quads, np.zeros(len(mesh.quads)))
        for t, x in ((0.0, first), (1e-3, last))
    ]
    assert share_behind(case, seen) == pytest.approx(1.0 / 3.0)
