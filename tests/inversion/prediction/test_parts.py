"""What a prediction is made of: effects by scope, the model's error far and near, draws by probability."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.prediction.answer import share_of
from birdstrike.inversion.prediction.carry_over import carried_effects, refuse_another_bird, same_sensor
from birdstrike.inversion.prediction.discrepancy import realisations
from birdstrike.inversion.prediction.distance import distance
from birdstrike.inversion.prediction.learnt import Explanation, Learnt, LearntShot, SensorError
from birdstrike.inversion.prediction.sample import draw, shares_of, tolerances_of
from tests.inversion.diagnosis.rig import tiny

TIME = np.linspace(0.0, 0.9e-3, 91)
LABELS = {
    "clamp_rotation": 1e-4,
    "plate_thickness": 1.2e-4,
    "impact_speed": 1.6,
    "sensor_gain.displacement_side": 0.03,
}
LEFT = 3e-4 * np.sin(4e3 * TIME)  # m: what the model leaves of the record


def explanation(label: str, share: float, rows: int = 200) -> Explanation:
    rng = np.random.default_rng(0)
    members = () if label == "none" else (label,)
    return Explanation(
        label,
        share,
        ("bird.material.viscosity",),
        rng.uniform(200.0, 400.0, (rows, 1)),
        members,
        tuple(name.split(".")[0] for name in members),
        tuple(LABELS[name] for name in members),
        np.full((rows, len(members)), 2.0) * [LABELS[name] for name in members],
        {"displacement": np.full(rows, 0.02)},
        {"displacement": np.full(rows, 1e-6)},
    )


def learnt(*shares: tuple[str, float]) -> Learnt:
    case = tiny()
    explanations = tuple(explanation(label, share) for label, share in shares)
    residual = {one.label: LEFT[None] for one in explanations}
    flat = np.ones(2)
    error = SensorError(TIME, residual, np.full(len(TIME), 1e-6), 5e-3, 1.5e-4, TIME[[0, -1]], flat)
    errors = {"displacement_centre": error, "displacement_side": error}
    shot = LearntShot("shot", conditions(case), errors)
    return Learnt("diagnose", Path("diagnosis"), case, (shot,), explanations, False, False, ())


def every() -> Learnt:
    return learnt(("none", 0.2), *((label, 0.2) for label in LABELS))


def test_effects_go_where_they_belong() -> None:
    known, faster = every(), tiny().overlaid({"impact": {"speed": "100 m/s"}})
    same_rig = {label: one.how for label, one in carried_effects(known, faster).items()}
    assert same_rig == {
        "clamp_rotation": "carried",
        "plate_thickness": "carried",
        "impact_speed": "drawn anew",
        "sensor_gain.displacement_side": "carried",
    }
    other = tiny().overlaid(
        {"plate": {"thickness": "8 mm"}, "sensors": {"displacement_side": {"at": ["60 mm", "0 mm"]}}}
    )
    elsewhere = {label: one.how for label, one in carried_effects(known, other).items()}
    assert elsewhere["clamp_rotation"] == "carried"
    assert elsewhere["plate_thickness"] == "drawn anew"
    assert elsewhere["sensor_gain.displacement_side"] == "left behind"
    wider = carried_effects(known, tiny().overlaid({"plate": {"width": "400 mm"}}))
    assert wider["clamp_rotation"].how == "drawn anew"


def test_a_structure_without_the_effect_s_part_is_refused_by_name_unless_it_is_left_behind() -> None:
    free = tiny().overlaid({"plate": {"edges": "free"}})
    with pytest.raises(UserError, match=r"cannot carry clamp_rotation.*--leave-behind clamp_rotation"):
        carried_effects(every(), free)
    assert carried_effects(every(), free, ["clamp_rotation"])["clamp_rotation"].how == "left behind"


def test_draws_have_the_probabilities_of_their_explanations_and_the_stated_tolerance() -> None:
    known, case = learnt(("none", 0.7), ("clamp_rotation", 0.3)), tiny()
    tolerances = tolerances_of(case, {"impact.speed": "2 m/s"}, known)
    found = draw(known, carried_effects(known, case), tolerances, shares_of(known.explanations, 1000), 0)
    there = found.values["effects.clamp_rotation"] > 0.0
    assert there.mean() == pytest.approx(0.3)
    assert found.values["impact.speed"].std() == pytest.approx(2.0, rel=0.05)
    assert found.values["bird.material.viscosity"].mean() == pytest.approx(300.0, rel=0.03)
    few = draw(known, carried_effects(known, case), tolerances, shares_of(known.explanations, 8, 3), 0)
    assert few.weights[few.explanation == 1].sum() == pytest.approx(0.3)


def test_a_shot_s_effect_is_drawn_anew_about_zero() -> None:
    known, case = learnt(("impact_speed", 1.0)), tiny()
    found = draw(known, carried_effects(known, case), {}, [1000], 0)
    assert found.values["effects.impact_speed"].mean() == pytest.approx(0.0, abs=0.1)
    assert found.values["effects.impact_speed"].std() == pytest.approx(LABELS["impact_speed"], rel=0.05)
    stated = tolerances_of(case, {"impact.speed": "1 m/s"}, known)  # what is stated takes its place
    assert "effects.impact_speed" not in draw(known, carried_effects(known, case), stated, [100], 0).values


def error_at(speed: float, **changes: dict[str, object]) -> tuple[np.ndarray, float]:
    """Draws of the model's error over the peak, and its growth."""
    known = learnt(("none", 1.0))
    where = distance(known, tiny().overlaid({"impact": {"speed": f"{speed} m/s"}, **changes}))
    rng = np.random.default_rng(0)
    one, error = known.explanations[0], known.shots[0].errors["displacement_centre"]
    rows, finer = np.zeros(500, dtype=int), np.zeros(len(TIME))
    mean, deviation, _ = realisations(one, rows, [error], "displacement", TIME, finer, where, rng)
    return mean + deviation, where.growth


def test_the_model_errs_again_as_it_did_where_the_new_shot_is_the_learnt_one() -> None:
    draws, growth = error_at(80.0)
    assert growth == 1.0
    assert draws.mean(axis=0)[10:] == pytest.approx(LEFT[10:] / 5e-3, abs=2e-3)
    assert draws.std(axis=0).max() < 0.1 * 0.06


def test_the_model_s_error_grows_and_is_forgotten_with_the_distance() -> None:
    near, far = error_at(90.0), error_at(160.0)
    assert far[0].std(axis=0)[50] > 2.0 * near[0].std(axis=0)[50]
    assert np.abs(far[0].mean(axis=0)).max() < np.abs(near[0].mean(axis=0)).max()
    amplitude = np.sqrt(np.mean(LEFT**2)) / 5e-3  # larger than the posterior's: the residual shows it
    other, growth = error_at(80.0, plate={"width": "400 mm"})
    assert growth == 2.0
    assert other.mean(axis=0) == pytest.approx(0.0, abs=5.0 * growth * amplitude / np.sqrt(500))
    assert other.std(axis=0)[50] == pytest.approx(growth * amplitude, rel=0.1)


def test_distance_is_measured_from_the_range_of_all_shots() -> None:
    known = learnt(("none", 1.0))
    faster = conditions(tiny().overlaid({"impact": {"speed": "120 m/s"}}))
    both = replace(known, shots=(*known.shots, LearntShot("fast", faster, known.shots[0].errors)))
    between = distance(both, tiny().overlaid({"impact": {"speed": "100 m/s"}}))
    assert between.sentences == ()
    assert between.growth == 1.0
    beyond = distance(both, tiny().overlaid({"impact": {"speed": "150 m/s"}}))
    assert beyond.reaches["speed"].outside == pytest.approx(0.25)
    assert beyond.reaches["energy"].outside == pytest.approx(0.5625)
    assert beyond.nearest.name == "fast"


def test_interval_of_no_hit_in_ten_draws() -> None:
    share, (low, high) = share_of(np.zeros(10, dtype=bool), 10.0)
    assert (share, low) == (0.0, 0.0)
    assert high == pytest.approx(0.2172, abs=1e-4)  # Brown, Cai & DasGupta 2001, Jeffreys' interval


def test_draws_of_the_angle_stay_within_its_range_at_normal_impact() -> None:
    known, case = learnt(("none", 1.0)), tiny().overlaid({"impact": {"angle": "90 deg"}})
    stated = tolerances_of(case, {"impact.angle": "1 deg", "impact.yaw": "1 deg"}, known)  # a yaw of 0 has one as well
    angles = np.degrees(draw(known, {}, stated, [200], 0).values["impact.angle"])
    assert angles.max() <= 90.0 + 1e-9
    assert 90.0 - angles.min() == pytest.approx(3.0, abs=0.6)


def test_a_strain_gauge_in_another_direction_is_another_sensor() -> None:
    gauge = {"kind": "strain", "at": ["20 mm", "0 mm"], "direction": "0 deg", "side": "back"}
    one = tiny().overlaid({"sensors": {"gauge": gauge}})
    assert same_sensor(one, one, "gauge")
    assert not same_sensor(one, tiny().overlaid({"sensors": {"gauge": {**gauge, "direction": "90 deg"}}}), "gauge")


def test_an_effect_that_is_left_behind_need_not_be_registered() -> None:
    known = learnt(("none", 0.5), ("clamp_rotation", 0.5))
    gone = replace(known.explanations[1], members=("of_mine",), effects=("of_mine",))
    found = carried_effects(replace(known, explanations=(known.explanations[0], gone)), tiny(), ["of_mine"])
    assert found["of_mine"].how == "left behind"


def test_interval_of_weighted_draws_holds_their_share() -> None:
    share, (low, high) = share_of(np.array([True, False, False]), 1.5, np.array([0.8, 0.1, 0.1]))
    assert share == pytest.approx(0.8)
    assert low < share < high


def test_only_a_bird_of_other_constants_is_refused() -> None:
    known = learnt(("none", 1.0))
    changes = {"impact": {"speed": "120 m/s"}, "plate": {"thickness": "8 mm"}, "bird": {"particles": 400}}
    refuse_another_bird(known, tiny().overlaid({**changes, "bird": {"material": {"viscosity": "500 Pa s"}}}))  # sought
    refuse_another_bird(known, tiny().overlaid(changes))
    with pytest.raises(UserError, match=r"bird\.method.*hexahedra.*the same bird\.method"):
        refuse_another_bird(known, tiny().overlaid({"bird": {"method": "hexahedra"}}))
