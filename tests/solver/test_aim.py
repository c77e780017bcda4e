"""Aim in space: the bird flies through its point along its direction, its axis turned by yaw and pitch."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.build import build_bird, direction_of, surface_in_flight, turned
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.simulate import simulate

DIRECTION = (0.6, 0.3, -0.5)
SQUARE = {
    "plate.length": "300 mm",
    "plate.width": "300 mm",
    "plate.elements": "[10, 10]",
    "bird.particles": "300",
    "time.end": "0.8 ms",
    "time.snapshots": "[]",
    "impact.aim": "axis",
}


def aimed(**impact: object):
    table = load_case("reference_strike", SQUARE).table
    del table["impact"]["angle"]
    table["impact"] |= {"direction": list(DIRECTION), "standoff": "20 mm"} | impact
    return load_case(table)


def frame(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre of points and the direction in which they are longest."""
    middle = x.mean(axis=0)
    return middle, np.linalg.svd(x - middle, full_matrices=False)[2][0]


def test_the_axis_flies_through_the_point_along_the_direction():
    case = aimed(point=["40 mm", "-30 mm", "5 mm"])
    (bird, _), unit = build_bird(case), np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    assert np.allclose(bird.v[: bird.n], case.impact.speed * unit, atol=1e-9)
    middle, axis = frame(bird.x[: bird.n])
    way = np.array([0.04, -0.03, 0.005]) - middle
    assert np.linalg.norm(np.cross(way, unit)) < 1e-6, "the centre flies through the point"
    assert abs(axis @ unit) == pytest.approx(1.0, abs=1e-9)
    assert case.normal_speed == pytest.approx(-case.impact.speed * unit[2])


@pytest.mark.parametrize(("turn", "toward"), [("yaw", "across"), ("pitch", "up")])
def test_yaw_and_pitch_turn_the_axis_and_not_the_velocity(turn, toward):
    case = aimed(**{turn: "20 deg"})
    (bird, _), velocity = build_bird(case), direction_of(case.impact)
    axis = frame(bird.x[: bird.n])[1]
    axis = axis * np.sign(axis @ velocity)
    across = np.cross([0.0, 0.0, 1.0], velocity) / np.linalg.norm(velocity[:2])
    side = {"across": across, "up": np.cross(velocity, across)}[toward]
    assert axis == pytest.approx(np.cos(np.deg2rad(20.0)) * velocity + np.sin(np.deg2rad(20.0)) * side, abs=1e-9)
    assert np.allclose(bird.v[: bird.n], case.impact.speed * velocity)


def test_a_strike_turned_by_a_right_angle_gives_the_same_curves_at_the_turned_places():
    """Square plate; deflection beside the centre, and effective and principal strain, which know no direction."""
    runs = []
    for direction, place in (((0.7, 0.0, -0.7), ["50 mm", "10 mm"]), ((0.0, 0.7, -0.7), ["-10 mm", "50 mm"])):
        table = aimed(direction=list(direction)).table
        table["sensors"] = {"beside": {"kind": "displacement", "at": place}}
        for measure in ("principal", "effective"):
            table["sensors"][measure] = {"kind": "strain", "at": place, "measure": measure}
        turned = {"kind": "strain", "at": place, "direction": "30 deg" if direction[0] else "120 deg"}
        runs.append(simulate(load_case(table | {"sensors": table["sensors"] | {"gauge": turned}})))
    for name in runs[0].channels:
        one, other = (run.channels[name] for run in runs)
        rounding = 2e-3 if name == "beside" else 2e-2  # which grows in 300 particles
        assert np.abs(one - other).max() < rounding * np.abs(one).max(), name
    principal, gauge = runs[0].channels["principal"], runs[0].channels["gauge"]
    assert (principal >= gauge - 1e-9).all(), "no gauge reads more than the principal strain"


def test_a_direction_beside_the_length_axis_changes_the_hash_and_offset_counts_from_the_point():
    plain, turned = aimed(direction=[0.7, 0.0, -0.7]), aimed(direction=[0.7, 0.1, -0.7])
    assert case_hash(plain) != case_hash(turned)
    first, second = (
        build_bird(aimed(**aim))[0].x for aim in ({"point": ["30 mm", "0 mm", "0 mm"]}, {"offset": ["30 mm", "0 mm"]})
    )
    assert np.allclose(first, second, atol=1e-12)


def test_an_angle_beyond_the_normal_is_a_bird_from_the_other_side():
    """Which a shot at 90 degrees needs for an error of its angle in either sense."""
    normal = load_case("flat_plate_002", {"target.generator.element_size": "50 mm", "bird.particles": "200"})
    less, more = (normal.with_effects({"impact_angle": np.deg2rad(x)}).resolved() for x in (-2.0, 2.0))
    one, other = direction_of(less.impact), direction_of(more.impact)
    assert one == pytest.approx([np.sin(np.deg2rad(2.0)), 0.0, -np.cos(np.deg2rad(2.0))], abs=1e-12)
    assert other == pytest.approx(one * [-1.0, 1.0, 1.0], abs=1e-12)
    assert less.normal_speed == pytest.approx(more.normal_speed)


@pytest.mark.parametrize(
    ("impact", "message"),
    [
        ({"direction": [0.1, 0.2, 0.5]}, "third is negative"),
        ({"direction": "down"}, "write three numbers"),
        ({"aim": "first_touch"}, "knows no direction"),
    ],
)
def test_directions_that_are_none_are_refused(impact, message):
    with pytest.raises(CaseError) as error:
        aimed(**impact)
    assert any(message in line for line in error.value.errors), error.value.errors


def test_a_direction_laid_over_an_inherited_angle_is_the_one_that_is_flown():
    case = load_case("flat_plate_002", {"impact.direction": "[0.8, 0.3, -0.6]"})
    assert direction_of(case.impact) == pytest.approx(np.array([0.8, 0.3, -0.6]) / np.sqrt(1.09), abs=1e-12)
    extended = load_case({"extends": "flat_plate_002", "impact": {"direction": [0.8, 0.3, -0.6]}})
    assert extended.impact == case.impact


def test_an_angle_laid_over_a_direction_changes_its_slope_and_keeps_its_way():
    case = load_case("flat_plate_002", {"impact.direction": "[0.8, 0.3, -0.6]"})
    effect = case.with_effects({"impact_angle": np.deg2rad(2.0)}).resolved()
    sought = case.with_values({"impact.angle": case.impact.angle + np.deg2rad(2.0)})
    for one in (effect, sought, load_case(sought.table)):
        assert one.impact.angle == pytest.approx(case.impact.angle + np.deg2rad(2.0))
        assert one.impact.heading == pytest.approx(case.impact.heading, abs=1e-12)
        assert one.impact.direction == pytest.approx(direction_of(one.impact), abs=1e-12)
    upright = case.with_values({"impact.angle": 0.5 * np.pi}).with_values({"impact.angle": 1.0})
    assert upright.impact.heading == pytest.approx(case.impact.heading, abs=1e-9)


def test_a_direction_and_an_angle_of_one_file_agree_or_are_refused():
    table = load_case("flat_plate_002").table
    table["impact"] |= {"direction": [0.8, 0.3, -0.6], "angle": "90 deg"}
    with pytest.raises(CaseError, match=r"makes an angle of 35.08 deg .* impact.angle = 90 deg .* leave impact.angle"):
        load_case(table)
    table["impact"]["angle"] = "35.1 deg"
    assert load_case(table).impact.angle == pytest.approx(np.deg2rad(35.1))
    with pytest.raises(CaseError, match=r"--set impact.direction is undone by another --set"):
        load_case("flat_plate_002", {"impact.direction": "[0.8, 0.3, -0.6]", "impact.angle": "60 deg"})


@pytest.mark.parametrize("direction", ["[-1.0, 0.0, 0.0]", "[-1.0, 0.0, -0.01]", "[0.0, 0.0, 1.0]", "[0.8, -0.6]"])
def test_a_direction_that_is_not_towards_the_target_is_told_by_its_own_name(direction):
    """One of less than a degree was refused as `impact.angle`, which the case does not have."""
    with pytest.raises(CaseError, match=r"impact has direction = \[.* at 1 deg or more .* must be turned in its file"):
        load_case("flat_plate_002", {"impact.direction": direction})


@pytest.mark.parametrize("turn", [(40, 40), (40, -20), (0, 30), (25, 0)])
def test_a_turned_birds_lowest_point_is_one_of_its_outline(turn):
    """Of a cylinder's ends the lowest point lies r times the upright part of the ring's plane below the centre."""
    yaw, pitch = turn
    settings = {"bird.shape": "cylinder", "impact.angle": "60 deg", "impact.yaw": f"{yaw} deg"}
    case = load_case("reference_strike", {**settings, "impact.pitch": f"{pitch} deg"})
    axis = turned(np.array([[1.0, 0.0, 0.0]]), case.impact)[0]
    exact = -0.5 * case.bird.length * abs(axis[2]) - 0.5 * case.bird.diameter * np.hypot(axis[0], axis[1])
    assert surface_in_flight(case)[:, 2].min() == pytest.approx(exact, abs=1e-12)
