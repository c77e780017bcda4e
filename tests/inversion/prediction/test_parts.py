"""What a prediction is made of: effects by scope, the model's error far and near, draws by probability."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import truncnorm
from sklearn.gaussian_process.kernels import Matern

from birdstrike.data.errors import UserError
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.effects import Effect, register, unregister
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.prediction.answer import share_of
from birdstrike.inversion.prediction.carry_over import (
    carried_effects,
    drawn_instead,
    refuse_another_bird,
    refuse_other_sensors,
    same_sensor,
)
from birdstrike.inversion.prediction.discrepancy import Records, _conditioned, realisations
from birdstrike.inversion.prediction.distance import distance
from birdstrike.inversion.prediction.from_diagnosis import _explanation
from birdstrike.inversion.prediction.from_inversion import rough_draws
from birdstrike.inversion.prediction.learnt import Explanation, Learnt, LearntShot, SensorError
from birdstrike.inversion.prediction.predict import other_mesh, tears
from birdstrike.inversion.prediction.sample import affordable, draw, shares_of, tolerances_of
from birdstrike.inversion.results.estimates import Estimate
from birdstrike.solver.case.case import Case, case_from_table, load_case
from birdstrike.solver.case.settings import Prior
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


def test_a_simulated_effect_of_a_sensor_is_carried_to_the_rig_that_has_the_sensors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was left behind wherever it went, because no instrument's fault has its name."""
    monkeypatch.setitem(LABELS, "gauge_place", 5e-3)
    move = {"sensors": {"displacement_side": {"at": ["5 mm", "0 mm"]}}}
    register(Effect("gauge_place", "a gauge elsewhere", "m", lambda *_: move, lambda _: 5e-3, scope="sensor"))
    try:
        known = learnt(("gauge_place", 1.0))
        elsewhere = tiny().overlaid({"sensors": {"displacement_side": {"at": ["60 mm", "0 mm"]}}})
        found = [carried_effects(known, case)["gauge_place"].how for case in (tiny(), elsewhere)]
    finally:
        unregister("gauge_place")
    assert found == ["carried", "drawn anew"]


def test_a_structure_without_the_effect_s_part_is_refused_by_name_unless_it_is_left_behind() -> None:
    free = tiny().overlaid({"plate": {"edges": "free"}})
    with pytest.raises(UserError, match=r"cannot carry clamp_rotation.*--leave-behind clamp_rotation"):
        carried_effects(every(), free)
    assert carried_effects(every(), free, ["clamp_rotation"])["clamp_rotation"].how == "left behind"


@pytest.mark.parametrize("word", ["clamp_rotation", "clamp_rotation.left"])
def test_leaving_an_effect_behind_takes_that_of_one_set_of_nodes(word: str) -> None:
    known, label = learnt(("clamp_rotation", 1.0)), ("clamp_rotation.left",)
    known = replace(known, explanations=(replace(known.explanations[0], members=label, effects=label),))
    with pytest.raises(UserError, match=r"--leave-behind clamp_rotation\.left"):
        carried_effects(known, tiny())
    assert carried_effects(known, tiny(), [word])["clamp_rotation.left"].how == "left behind"
    with pytest.raises(UserError, match="no explanation holds it"):
        carried_effects(known, tiny(), [word, "clamp_rotation.right"])


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


@pytest.mark.parametrize(
    ("stated", "given"),
    [({"mass": "10 g"}, {}), ({}, {"bird.density": "5 kg/m^3"}), ({"mass": "10 g"}, {"bird.mass": "10 g"})],
)
def test_the_mass_of_a_bird_of_stated_density_is_drawn_once(stated: dict[str, str], given: dict[str, str]) -> None:
    """With its density or its mass as the uncertain quantity, whichever of the two the case gives."""
    case = tiny().overlaid({"inversion": {"nuisance": stated}})
    assert case.bird.mass is None
    known = learnt(("impact_speed", 1.0))
    mass = replace(known.explanations[0], members=("bird_mass",), effects=("bird_mass",), sizes=(0.07,))
    known = replace(known, explanations=(mass,))
    found = tolerances_of(case, given, known)
    assert len(found) == 1
    values = draw(known, carried_effects(known, case), found, [100], 0).values
    assert "effects.bird_mass" not in values
    assert len({"bird.mass", "bird.density"} & set(values)) == 1


def test_a_struck_part_s_thickness_takes_the_place_of_the_effect_on_it() -> None:
    case = load_case("openradioss_panel")
    assert case.target is not None
    key, known = f"target.parts.{case.target.struck_name}.thickness", learnt(("plate_thickness", 1.0))
    found = tolerances_of(case, {key: "0.1 mm"}, known)
    assert "effects.plate_thickness" not in draw(known, carried_effects(known, case), found, [100], 0).values


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"time.end": "0.1 ms"}, "--tolerance time.end: time has no tolerance, only quantities of bird, impact"),
        ({"bird.mass": "10 g", "bird.density": "5 kg/m^3"}, r"are one quantity \(bird_mass\); state one"),
    ],
)
def test_tolerances_of_no_part_of_the_shot_or_of_one_quantity_twice_are_refused(
    given: dict[str, str], words: str
) -> None:
    with pytest.raises(UserError, match=words):
        tolerances_of(tiny(), given, learnt(("none", 1.0)))


def parts_at(known: Learnt, case: Case, finer: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
    """Of 500 draws of the first explanation: the error that the records let expect, deviations of it, of the mesh."""
    where, rng = distance(known, case), np.random.default_rng(0)
    one, errors = known.explanations[0], [shot.errors["displacement_centre"] for shot in known.shots]
    rows, none = np.arange(500) % len(one.parameters), np.zeros(len(TIME))
    return realisations(one, rows, errors, "displacement", TIME, none if finer is None else finer, where, rng)


def error_at(speed: float, **changes: dict[str, object]) -> tuple[np.ndarray, float]:
    """Draws of the model's error over the peak, and its growth."""
    known, case = learnt(("none", 1.0)), tiny().overlaid({"impact": {"speed": f"{speed} m/s"}, **changes})
    mean, deviation, _ = parts_at(known, case)
    return mean + deviation, distance(known, case).growth


def with_error(known: Learnt, **changes: Any) -> Learnt:
    """The first shot's centre with another error."""
    shot = known.shots[0]
    errors = {**shot.errors, "displacement_centre": replace(shot.errors["displacement_centre"], **changes)}
    return replace(known, shots=(replace(shot, errors=errors),))


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


def test_growth_in_time_is_counted_once() -> None:
    """A residual of 2 % of the peak at contact that triples until the end is an error of 2 % that triples."""
    grown = np.linspace(1.0, 3.0, len(TIME))
    residual = 0.02 * 5e-3 * np.sqrt(2.0) * np.sin(3e5 * TIME) * grown
    known = with_error(learnt(("none", 1.0)), residual={"none": residual[None]}, growth_times=TIME, growth=grown)
    stated = {"displacement": np.full(200, 1e-4)}
    known = replace(known, explanations=(replace(known.explanations[0], amplitude=stated),))
    assert known.shots[0].errors["displacement_centre"].excess("none") == pytest.approx(0.02**2, rel=0.05)
    elsewhere = tiny().overlaid({"plate": {"width": "400 mm"}})  # nothing is known of the error but its size
    _, deviation, _ = parts_at(known, elsewhere)
    growth = distance(known, elsewhere).growth
    for at in (45, 89):
        assert deviation[:, at].std() == pytest.approx(0.02 * growth * grown[at], rel=0.15)


def test_an_explanation_s_error_follows_its_own_residual_and_no_other_s() -> None:
    both = learnt(("none", 0.5), ("clamp_rotation", 0.5))
    known = with_error(both, residual={"none": LEFT[None], "clamp_rotation": -0.5 * LEFT[None]})
    swapped = replace(known, explanations=known.explanations[::-1])
    first, second = (parts_at(one, tiny())[0].mean(axis=0) for one in (known, swapped))
    assert first[10:] == pytest.approx(LEFT[10:] / 5e-3, abs=2e-3)
    assert second[10:] == pytest.approx(-0.5 * LEFT[10:] / 5e-3, abs=2e-3)
    alone = with_error(both, residual={"clamp_rotation": LEFT[None]})  # nothing is known of what `none` leaves
    expected, deviation, _ = parts_at(alone, tiny())
    assert not expected.any()
    assert deviation[:, 45].std() == pytest.approx(0.02, rel=0.15)


def test_a_draw_whose_curve_lies_high_has_an_error_that_lies_low() -> None:
    """What the parameters leave open where the record has settled it is no width of a prediction there."""
    above = 2e-4 * np.random.default_rng(1).standard_normal((200, 1)) * np.sin(3e3 * TIME)  # m, of each draw's curve
    known = with_error(learnt(("none", 1.0)), residual={"none": LEFT - above})
    expected, _, _ = parts_at(known, tiny())
    of_draw = above[np.arange(500) % 200] / 5e-3
    whole = of_draw + expected
    assert whole[:, 45].std() < 0.1 * of_draw[:, 45].std()
    assert whole.mean(axis=0)[10:] == pytest.approx(LEFT[10:] / 5e-3, abs=2e-3)


def test_two_learnt_speeds_leave_less_open_between_them_than_one() -> None:
    known = learnt(("none", 1.0))
    case = tiny().overlaid({"impact": {"speed": "90 m/s"}})
    faster = conditions(tiny().overlaid({"impact": {"speed": "100 m/s"}}))
    both = replace(known, shots=(*known.shots, LearntShot("fast", faster, known.shots[0].errors)))
    one, two = (parts_at(several, case)[1][:, 45].std() for several in (known, both))
    assert two < 0.6 * one


def test_what_a_finer_mesh_would_add_is_in_the_record_of_the_same_rig_and_in_none_of_another() -> None:
    size = 0.03 * np.sin(3e3 * TIME)  # of the peak
    known = with_error(learnt(("none", 1.0)), finer=5e-3 * size)
    here = parts_at(known, tiny(), size)[2][:, 45].std()
    elsewhere = parts_at(known, tiny().overlaid({"plate": {"width": "400 mm"}}), size)[2][:, 45].std()
    assert here < 0.2 * abs(size[45])
    assert elsewhere == pytest.approx(abs(size[45]), rel=0.1)


def test_what_the_records_leave_of_the_error_is_a_standard_deviation_that_growth_multiplies() -> None:
    known, case = learnt(("none", 1.0)), tiny().overlaid({"impact": {"speed": "100 m/s"}})
    where = distance(known, case)
    assert 0.5 < where.correlation < 1.0
    records = Records.of([(0, known.shots[0].errors["displacement_centre"])])
    one, twice = (
        _conditioned(0.02, 0.005, records, None, TIME, np.zeros(len(TIME)), replace(where, growth=growth))[1]
        for growth in (1.0, 2.0)
    )
    assert np.sqrt(np.diag(twice)) == pytest.approx(2.0 * np.sqrt(np.diag(one)))


def test_model_error_and_mesh_error_of_a_new_shot_are_one_gaussian_given_the_record() -> None:
    """Against the joint covariance of record and new curve in full, the mesh's error one unknown that both share."""
    known, case = learnt(("none", 1.0)), tiny().overlaid({"impact": {"speed": "100 m/s"}})
    where = replace(distance(known, case), growth=1.0)
    finer, there = 0.03 * np.sin(3e3 * TIME), 0.02 * np.sin(2e3 * TIME)
    error = replace(known.shots[0].errors["displacement_centre"], finer=5e-3 * there, sigma=np.full(len(TIME), 1e-5))
    a, b, t = 0.02, 0.005, TIME[1:]  # at contact the process is 0
    records = Records.of([(0, error)])
    gain, covariance, mesh = _conditioned(a, b, records, error, t, finer[1:], where)
    instants = np.concatenate([[0.0], TIME, t])
    process: np.ndarray = np.asarray(Matern(error.length, nu=2.5)(instants[:, None]))
    process = process[1:, 1:] - np.outer(process[1:, 0], process[1:, 0])  # given that it is 0 at contact
    new = np.arange(len(process)) >= len(TIME)
    alike = np.where(new[:, None] == new, a**2 + b**2, where.correlation * a**2)
    shared = np.concatenate([there, finer[1:]])
    joint = alike * process + np.outer(shared, shared) + np.diag(np.where(new, 0.0, (1e-5 / 5e-3) ** 2 + 1e-10))
    expected = np.linalg.solve(joint[np.ix_(~new, ~new)], joint[np.ix_(~new, new)]).T
    np.testing.assert_allclose(gain @ LEFT, expected @ LEFT, rtol=0.0, atol=1e-4 * np.abs(LEFT).max())
    rest = joint[np.ix_(new, new)] - expected @ joint[np.ix_(~new, new)]
    np.testing.assert_allclose(covariance + np.outer(mesh, mesh), rest, rtol=0.0, atol=1e-6 * rest.max())


@pytest.mark.parametrize(
    "changes",
    [{"impact": {"speed": "240 m/s"}}, {"bird": {"density": "234.5 kg/m^3"}}, {"plate": {"thickness": "12 mm"}}],
    ids=["speed", "mass", "thickness"],
)
def test_three_times_the_speed_a_quarter_of_the_mass_or_twice_the_thickness_is_one_length(
    changes: dict[str, dict[str, str]],
) -> None:
    """Matern 5/2 at one length is 0.5240, and the error is twice as large; the mass is the same at every speed."""
    where = distance(learnt(("none", 1.0)), tiny().overlaid(changes))
    assert where.correlation == pytest.approx(0.5240, abs=1e-4)
    assert where.growth == pytest.approx(2.0)


@pytest.mark.parametrize("fails", [False, True])
def test_tearing_of_an_assembly_is_modelled_where_a_part_s_material_fails(fails: bool) -> None:
    table = dict(load_case("flat_plate_002", {"target.generator.element_size": "60 mm"}).table)
    metal = {key: value for key, value in table["target"]["materials"]["LY12"].items() if key != "failure_strain"}
    metal |= {"failure_strain": 0.3} if fails else {}
    table["target"] = {**table["target"], "materials": {"LY12": metal}}
    assert tears(case_from_table(table, "assembly")) is fails


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


def test_rough_draws_keep_to_where_an_answer_was_sought() -> None:
    """What is identified is normal about its value, what is not has its prior in the searched part of its range."""
    space = ParameterSpace.of_case(load_case("synthetic_strike"))
    ranges = np.stack([space.lows, space.highs])
    searched = ranges.copy()
    searched[1] = space.lows + 0.6 * (space.highs - space.lows)
    known, *vague = space.names
    middle, width = space.lows[0] + 0.4 * np.ptp(ranges[:, 0]), 0.1 * np.ptp(ranges[:, 0])
    estimates = {name: Estimate(float(space.lows[j]), None, "", False, "") for j, name in enumerate(space.names)}
    estimates[known] = Estimate(float(middle), (middle - width, middle + width), "", True, "")
    draws = rough_draws(space, estimates, searched, NormalPrior.of_ranges(len(space.names)), 0)
    assert (draws >= searched[0]).all()
    assert (draws <= searched[1]).all()
    assert draws[:, 0].mean() == pytest.approx(middle, abs=float(0.2 * width))
    assert draws[:, 0].std() == pytest.approx(width / 1.96, rel=0.1)
    shares = (draws[:, 1:] - space.lows[1:]) / np.ptp(ranges[:, 1:], axis=0)
    low, high = np.sqrt(12.0) * (np.array([0.0, 0.6]) - 0.5)
    assert vague
    assert shares.mean(axis=0) == pytest.approx(
        np.full(len(vague), truncnorm.mean(low, high, 0.5, 12.0**-0.5)), abs=0.04
    )
    assert shares.std(axis=0) == pytest.approx(np.full(len(vague), truncnorm.std(low, high, 0.5, 12.0**-0.5)), rel=0.1)
    end = float(space.highs[0])
    estimates[known] = Estimate(end, (end, end), "", True, "")
    mean, sd = space.lows[1] + np.ptp(ranges[:, 1]) * np.array([0.4, 0.05])
    sd -= space.lows[1]
    stated = NormalPrior.of({vague[0]: Prior(mean=float(mean), sd=float(sd))}, space)
    draws = rough_draws(space, estimates, ranges, stated, 0)
    assert (draws[:, 0] == space.highs[0]).all(), "an interval without width"
    assert draws[:, 1].mean() == pytest.approx(mean, abs=0.1 * sd)
    assert draws[:, 1].std() == pytest.approx(sd, rel=0.1)


@pytest.mark.parametrize("corrected", [False, True])
def test_another_mesh_is_told_after_a_diagnosis_too(corrected: bool) -> None:
    known = replace(learnt(("none", 1.0)), corrected=corrected, diagnosed=corrected)
    assert other_mesh(known, tiny()) == []
    assert other_mesh(known, tiny().overlaid({"impact": {"speed": "70 m/s"}})) == []
    nx, ny = (3 * n for n in tiny().plate.elements)
    finer = tiny().with_mesh(27 * tiny().bird.particles, (nx, ny))
    (line,) = other_mesh(known, finer)
    assert ("coarse or fine, than those of diagnose" in line) is corrected


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


@pytest.mark.parametrize(
    ("key", "value"), [("cell_1.support", "cell_2"), ("displacement_along.point", '["100 mm", "0 mm", "5 mm"]')]
)
def test_a_sensor_of_another_support_or_at_another_height_is_another_sensor(key: str, value: str) -> None:
    one, name = load_case("flat_plate_002"), key.split(".")[0]
    assert same_sensor(
        one, load_case("flat_plate_002", {f"sensors.{name}.noise": "9 kN" if "cell" in name else "9 mm"}), name
    )
    assert not same_sensor(one, load_case("flat_plate_002", {f"sensors.{key}": value}), name)


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
    thicker = tiny().overlaid({**changes, "bird": {"material": {"viscosity": "500 Pa s"}}})
    refuse_another_bird(known, thicker)  # sought
    (told,) = drawn_instead(known, thicker)
    assert told.startswith("bird.material.viscosity is 500 Pa s in")
    assert not drawn_instead(known, tiny().overlaid(changes))
    refuse_another_bird(known, tiny().overlaid(changes))
    with pytest.raises(UserError, match=r"bird\.method.*hexahedra.*the same bird\.method"):
        refuse_another_bird(known, tiny().overlaid({"bird": {"method": "hexahedra"}}))


def test_explanations_that_the_simulations_do_not_suffice_for_are_warned_of() -> None:
    """43 % of the probability was left out by a line among what had been used, at the foot of the page."""
    many = learnt(("none", 0.5), ("clamp_rotation", 0.3), ("plate_thickness", 0.2))
    kept = affordable(many, 8)
    assert [one.label for one in kept.explanations] == ["none", "clamp_rotation"]
    assert kept.said == many.said
    of_set = replace(many, set_size=len(many.explanations), set_said="models of the set, 400 draws of each")
    (before,), (after,) = of_set.posterior, replace(of_set, explanations=kept.explanations).posterior
    assert before.startswith(f"{len(many.explanations)} models of the set")
    assert after.startswith(f"{len(kept.explanations)} of {len(many.explanations)} models of the set")
    assert kept.warnings == (
        "the bands rest on the likeliest 2 of 3 explanations; the others, with 20 % of the probability, need more "
        "simulations than were allowed: --budget 12 takes all",
    )
    assert affordable(many, 12).warnings == ()


def test_sensors_that_were_not_learnt_are_warned_of_together() -> None:
    known = learnt(("none", 1.0))
    name = next(iter(known.sensors))
    sensor = known.case.sensors[name]
    new = known.case.model_copy(update={"sensors": {name: sensor, "first": sensor, "second": sensor}})
    (said,) = refuse_other_sensors(known, new)
    assert said == (
        "first and second were not learnt from, or sit elsewhere: the model error of each is that of its kind of "
        "sensor, not of its own record; their bands are wider than records of them would make them"
    )


def test_an_error_that_no_baseline_shows_is_split_as_the_diagnosis_split_it() -> None:
    """Half of its variance is a shot's own; beside a baseline the shared part is fixed, and the own one fitted."""
    one = {
        "label": "none",
        "share": 1.0,
        "parameters": np.zeros((1, 1)),
        "members": (),
        "names": (),
        "sizes": (),
        "magnitudes": np.zeros((1, 0)),
        "amplitude": {"displacement": [0.05], "strain": [0.08]},
    }
    shape = {"fixed": {"displacement": 0.01, "strain": 0.02}, "own_is_free": ["strain"]}
    found = _explanation(one, {"parameters": [{"name": "bird.material.viscosity"}]}, shape)
    assert found.amplitude["displacement"] == pytest.approx(0.05 / 2.0**0.5)
    assert found.own["displacement"] == pytest.approx((0.05**2 / 2.0 + 0.01**2) ** 0.5)
    assert (found.amplitude["strain"], found.own["strain"]) == (pytest.approx(0.02), pytest.approx(0.08))
