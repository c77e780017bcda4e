"""The plan's designs and the library of instrument faults."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.effects import Effect, register, unregister
from birdstrike.inversion.diagnosis.conclusions.next_measurement import described
from birdstrike.inversion.diagnosis.diagnose import NamedRecord, predicted_shots
from birdstrike.inversion.diagnosis.inference.hypotheses import Suspect, family_of, hypotheses
from birdstrike.inversion.diagnosis.preparation.instrument import change, instrument_effects, signature, with_faults
from birdstrike.inversion.diagnosis.preparation.plan import (
    PREFIX,
    Block,
    Known,
    candidates,
    levels,
    library,
    magnitude,
    make_plan,
    two_level,
    with_probes,
)
from birdstrike.inversion.diagnosis.preparation.responses import learn_responses
from birdstrike.inversion.diagnosis.preparation.setup import unpredictable
from birdstrike.inversion.estimation.mesh_correction import spread
from birdstrike.inversion.results.diagnosis import NONE
from birdstrike.solver.build import rest_mesh
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.sensors.instrument import Instrument, recorded
from birdstrike.solver.sensors.sensor import Placed
from birdstrike.solver.sensors.strain import Strain
from tests.inversion.diagnosis.rig import tiny
from tests.solver.test_setup_warnings import sheet_from_a_file
from tests.solver.test_struck_plane import about_y, strike


@pytest.mark.parametrize("more", [{}, {"bird.material.pressure_cutoff": {"range": ["-1 MPa", "-0.1 MPa"]}}])
def test_another_seed_simulates_anew_what_scatters(more: dict[str, Any]) -> None:
    """Of one parameter the points are the same for every seed, and so were the lattices: --seed changed nothing."""
    case = tiny().overlaid({"inversion": {"parameters": more}})
    plans = [make_plan(case, 9, seed) for seed in (0, 1, 10**12 + 7)]
    cases = [
        {case_hash(one) for part in (plan.lattices(), plan.responses()) for one in part.values()} for plan in plans
    ]
    assert all(len(a & b) == 0 for a, b in combinations(cases, 2))
    again = make_plan(case, 9, 1)
    assert {case_hash(one) for one in again.responses().values()} < cases[1]


def test_two_level_columns_are_orthogonal_and_balanced() -> None:
    signs = two_level(12)
    assert np.allclose(signs.T @ signs, len(signs) * np.eye(12))
    assert np.allclose(signs.sum(axis=0), 0.0)


def test_points_are_spread_from_the_middle_outwards() -> None:
    unit = np.array([[0.5, 0.5], [0.52, 0.5], [1.0, 1.0], [0.0, 0.0]])
    assert spread(unit)[0] == 0
    assert set(spread(unit)[1:3]) == {2, 3}


def test_the_fine_mesh_is_eight_times_the_campaign_and_never_coarser_than_declared() -> None:
    case = load_case("reference_strike")
    plan = make_plan(case, runs=9)
    assert plan.coarse.bird.particles == 1000
    assert plan.fine.bird.particles == 8000
    assert all(f >= d for f, d in zip(plan.fine.plate.elements, case.plate.elements, strict=True))


def test_another_lattice_is_tried_at_points_of_the_fine_mesh() -> None:
    plan = make_plan(load_case("reference_strike"), runs=9)
    fine, others = plan.meshes(), plan.lattices()
    assert len(others) == 4
    for label, case in others.items():
        same = fine[label.replace("lattice", "fine")]
        assert case.bird.lattice != same.bird.lattice
        assert case.bird.material == same.bird.material
        assert (case.bird.particles, case.plate.elements) == (same.bird.particles, same.plate.elements)
    hexahedra = load_case("reference_strike", {"bird.method": "hexahedra"})
    assert not make_plan(hexahedra, runs=9).lattices()


@pytest.mark.parametrize(
    ("displacement", "force", "left_out"),
    [
        (0.01, 0.06, {"reaction_force"}),
        (0.01, 0.025, set[str]()),  # as quiet as repeated shots are
        (0.03, 0.06, set[str]()),  # no sensor is much quieter
        (None, 0.06, set[str]()),  # the only one
    ],
)
def test_a_sensor_that_lattices_move_much_more_than_others_is_left_out(
    displacement: float | None, force: float, left_out: set[str]
) -> None:
    """Shares of the peak; half of them in waves that are as fast as the output, which do not count."""
    plan = make_plan(load_case("audit_strike"), runs=9)
    time = np.linspace(0.0, 1.0, 1001)
    curve, fast = np.sin(np.pi * time), np.resize([1.0, -1.0], len(time))
    moved = {"displacement_centre": displacement or 0.0, "reaction_force": force}

    def run(share: float) -> Any:
        return SimpleNamespace(channels={name: curve + share * s * (1.0 + fast) for name, s in moved.items()})

    measured = [name for name, share in moved.items() if share]
    runs = {label: run(0.0) for label in plan.meshes()} | {label: run(1.0) for label in plan.lattices()}
    found = unpredictable([(plan, runs)], measured)
    assert {name for name in found if name in measured} == left_out
    assert all(found[name] == pytest.approx(moved[name], rel=0.05) for name in found)
    assert not unpredictable([(plan, {label: run(0.0) for label in plan.meshes()})], measured)


def test_a_sensor_is_left_out_where_it_scatters_most_and_one_that_shows_nothing_is_not_compared() -> None:
    plan = make_plan(load_case("audit_strike"), runs=9)
    curve = np.sin(np.linspace(0.0, 3.0, 501))

    def runs(share: float, strain: float = 0.0) -> dict[str, Any]:
        shown = {"displacement_centre": 0.01, "reaction_force": share}
        fine, other = (
            SimpleNamespace(
                channels={n: (1.0 + s * x) * curve for n, s in shown.items()} | {"strain_back": strain * curve}
            )
            for x in (0.0, 1.0)
        )
        return dict.fromkeys(plan.meshes(), fine) | dict.fromkeys(plan.lattices(), other)

    measured = ["strain_back", "displacement_centre", "reaction_force"]
    assert set(unpredictable([(plan, runs(0.02)), (plan, runs(0.5))], measured)) == {"reaction_force"}
    assert not unpredictable([(plan, runs(0.02))], measured)
    assert set(unpredictable([(plan, runs(0.05))], measured)) == {"reaction_force"}, (
        "the dead gauge is not the quietest"
    )
    assert set(unpredictable([(plan, runs(0.05, strain=1.0))], measured)) == {"reaction_force"}


def test_a_shot_of_which_nothing_is_predicted_is_left_out_and_others_go_on() -> None:
    case = load_case("audit_strike")
    plan = make_plan(case, runs=9)
    setup: Any = SimpleNamespace(plan=plan, channels=("displacement_centre",), unpredictable={"reaction_force": 0.11})

    def record(name: str) -> Measured:
        return Measured(np.zeros(2), {name: np.zeros(2)}, {}, {name: ""}, (), "shot.csv")

    shots = [NamedRecord(name, case, record(name)) for name in ("displacement_centre", "reaction_force")]
    found, (lost,) = predicted_shots(shots, {case_hash(case): setup})
    assert [one.name for one in found] == ["displacement_centre"]
    assert "reaction_force by 11 % of the peak" in lost
    assert "raise bird.particles = 400 up to 1000" in lost
    with pytest.raises(MeasuredError, match="reaction_force"):
        predicted_shots(shots[1:], {case_hash(case): setup})


def test_the_scatter_of_runs_does_not_pass_for_a_signature() -> None:
    """Two effects, of which one moves nothing: its signature is less than the scatter, and less than its own error."""
    case, rng = load_case("audit_strike"), np.random.default_rng(3)
    known = tuple(Known(effects()[name], 1.0, -5.0) for name in ("plate_thickness", "plate_density"))
    signs = two_level(len(known))
    block, m = Block(case, known, signs), 200
    plan: Any = SimpleNamespace(blocks=(block,), unit=rng.random((len(signs), 2)), pair_point=lambda i: i)
    curve = np.sin(np.linspace(0.0, 3.0, m))
    waves = np.array([np.sin(f * np.linspace(0.0, 3.0, m) + f) for f in range(1, 7)])
    stacks = {
        block.label(i, sign): 2.0 * sign * signs[i, 0] * curve + 0.2 * rng.standard_normal(6) @ waves
        for i in range(len(signs))
        for sign in (1, -1)
    }
    found, lost = learn_responses(plan, stacks, 1)
    assert not lost
    strong, none = found["plate_thickness"], found["plate_density"]
    middle = np.full(2, 0.5)
    assert strong.at(middle) == pytest.approx(curve, abs=0.2)
    assert np.linalg.norm(none.at(middle)) < np.linalg.norm(none.error_at(middle))
    chance = 0.2 * np.sqrt(waves.shape[0] / 2.0) / np.sqrt(2.0 * len(signs)) / 2.0  # of half differences at two sizes
    assert np.sqrt((none.signature**2).mean()) < chance


@pytest.mark.parametrize("declared", [0.01, 0.15, 0.25, 1.0])
def test_an_effect_of_which_a_case_declares_little_is_learnt_from_what_adds_to_it(declared: float) -> None:
    """Friction of 0.01 was varied by half of that to both sides: its response drowned in the scatter."""
    case, rng = load_case("audit_strike", {"impact.friction": declared}), np.random.default_rng(3)
    friction = next(one for one in library(case, case)[0] if one.name == "bird_friction")
    block, m = Block(case, (friction,), two_level(1)), 200
    plan: Any = SimpleNamespace(blocks=(block,), unit=rng.random((len(block.signs), 2)), pair_point=lambda i: i)
    curve = np.sin(np.linspace(0.0, 3.0, m))
    waves = np.array([np.sin(f * np.linspace(0.0, 3.0, m) + f) for f in range(1, 7)])
    stacks = {
        block.label(i, sign): magnitude(friction, sign * signs[0]) * curve + 0.1 * rng.standard_normal(6) @ waves
        for i, signs in enumerate(block.signs)
        for sign in (1, -1)
    }
    assert learn_responses(plan, stacks, 1)[0]["bird_friction"].at(np.full(2, 0.5)) == pytest.approx(curve, abs=0.3)
    for code in (-1.0, 1.0):
        friction_there = case.with_effects({"bird_friction": friction.size * magnitude(friction, code)}).impact.friction
        assert friction_there >= 0.499 * declared


def test_an_effect_is_varied_alike_to_both_sides_where_the_case_declares_enough_of_it() -> None:
    assert levels(Known(effects()["bird_friction"], 0.1, -5.0)) == (-2.0, 2.0)
    assert levels(Known(effects()["bird_friction"], 0.1, -3.0)) == (-1.5, 1.5)
    assert levels(Known(effects()["bird_friction"], 0.1, -0.1)) == (-0.05, 2.0)
    assert levels(Known(effects()["bird_friction"], 0.1, 0.0)) == (0.0, 2.0)
    assert levels(Known(effects()["plate_preload"], 1.0, -5.0)) == (-0.5, 0.5)


def test_air_in_a_coarse_bird_is_simulated_on_a_finer_one_and_all_effects_once() -> None:
    coarse, declared = (make_plan(load_case(name), runs=9) for name in ("audit_strike", "reference_strike"))
    assert [one.base.bird.particles for one in coarse.blocks] == [1000, 3000]
    assert [one.base.bird.particles for one in declared.blocks] == [3000]
    assert [known.name for known in coarse.blocks[1].known] == ["bird_porosity"]
    names = [known.name for one in coarse.blocks for known in one.known]
    assert sorted(names) == sorted(known.name for known in declared.blocks[0].known)
    assert len(coarse.responses()) == sum(2 * len(one.signs) for one in coarse.blocks)
    for one in coarse.blocks:
        assert len(one.signs) >= len(one.known) + 3


TIME = np.linspace(0.0, 3e-3, 601)
CURVE = 5e-3 * np.sin(900.0 * TIME) ** 2
FAULTS = {"sensor_gain": 0.03, "time_offset": 2e-5, "sensor_bandwidth": 3e-5, "sensor_drift": 0.1}


def reading(name: str, magnitude: float) -> np.ndarray:
    """What the solver's instrument makes of the curve."""
    own = {
        "sensor_gain": {"gain": 1.0 + magnitude},
        "time_offset": {"time_offset": f"{magnitude} s"},
        "sensor_bandwidth": {"bandwidth": f"{1.0 / (2.0 * np.pi * (magnitude or 1e-9))} Hz"},
        "sensor_drift": {"drift": f"{magnitude} m/s"},
    }[name]
    return recorded(Instrument.model_validate(own), TIME, CURVE)


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("h", [0.7, 3.0, 8.0])
def test_a_fault_changes_a_curve_as_the_instrument_does(name: str, h: float) -> None:
    expected = reading(name, h * FAULTS[name]) - CURVE
    assert np.abs(change(name, h * FAULTS[name], TIME, CURVE) - expected).max() < 1e-6 * np.abs(CURVE).max()


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("h", [0.0, 1.0, 5.0])
def test_a_signature_is_the_slope_of_what_the_instrument_does(name: str, h: float) -> None:
    """Within the second difference over one plausible size, which no slope can show."""
    low, middle, high = (reading(name, x * FAULTS[name]) for x in (max(h - 0.5, 0.0), h, max(h + 0.5, 1.0)))
    slope, bent = high - low, np.abs(high - 2.0 * middle + low).max()
    error = np.abs(signature(name, FAULTS[name], TIME, CURVE, h) - slope)[5:-5].max()
    assert error < 0.02 * np.abs(slope).max() + (bent if h == 0.0 else 0.0)


def test_a_slow_sensor_is_written_into_the_case_beside_the_bandwidth_that_it_declares() -> None:
    """Time constants add, for one sensor as for all."""
    sensor = "displacement_centre"
    case = load_case("virtual_strike", {f"instrument.{sensor}.bandwidth": "10 kHz"})
    tau = 3e-5 + 1.0 / (2.0 * np.pi * 10e3)
    for slow in (
        with_faults(case, [(sensor, "sensor_bandwidth", 3e-5)]),
        case.with_effects({"sensor_bandwidth": 3e-5}),
    ):
        assert slow.instrument[sensor].bandwidth == pytest.approx(1.0 / (2.0 * np.pi * tau))
    assert with_faults(case, [(sensor, "sensor_bandwidth", 0.0)]).instrument[sensor].bandwidth == pytest.approx(10e3)


def test_a_record_that_is_early_goes_on_straight_beyond_the_simulation() -> None:
    early = CURVE + change("time_offset", -1e-4, TIME, CURVE)
    known = TIME[-1] - 1e-4 > TIME
    assert early[known] == pytest.approx(np.interp(TIME[known] + 1e-4, TIME, CURVE))
    assert np.diff(early[~known]) == pytest.approx(np.gradient(CURVE, TIME)[-1] * 5e-6, rel=1e-3)


def test_each_sensor_may_have_a_fault_of_its_own() -> None:
    case = load_case("virtual_strike")
    labels = [one.label for one in instrument_effects(case, ("displacement_centre", "displacement_quarter"))]
    assert "sensor_gain" in labels
    assert "sensor_gain.displacement_centre" in labels
    alone = [one.label for one in instrument_effects(case, ("displacement_centre",))]
    assert "sensor_gain.displacement_centre" not in alone


def test_priors_sum_to_one_and_families_share_alike() -> None:
    found = [
        Suspect(n, n, f, ("shot",))
        for n, f in (("impact_speed", "impact"), ("plate_modulus", "plate"), ("plate_density", "plate"))
    ]
    models = hypotheses(found)
    assert sum(one.prior for one in models) == pytest.approx(1.0)
    prior = {one.label: one.prior for one in models}
    assert prior[NONE] == 0.5
    assert prior["impact_speed"] == pytest.approx(prior["plate_modulus"] + prior["plate_density"])


def test_an_effect_shares_its_prior_among_the_sets_of_nodes_that_it_may_have_alone() -> None:
    labels = ("edge_slip", "clamp_rotation", "clamp_rotation.left", "clamp_rotation.right")
    found = [Suspect(n, n, family_of(n), ("shot",)) for n in labels]
    models = {one.label: one.prior for one in hypotheses(found)}
    clamp = [models[n] for n in labels[1:]]
    assert clamp == pytest.approx([models["edge_slip"] / 3.0] * 3)
    assert "clamp_rotation.left+clamp_rotation.right" not in models
    assert "edge_slip+clamp_rotation.right" in models


def test_the_library_of_a_target_on_several_sets_holds_the_effects_of_each() -> None:
    case = load_case("flat_plate_002", {"effects.edge_slip.cell_2": "0.1 mm^2/kN"})
    known, refused = library(case, case)
    names = [one.name for one in known]
    assert {"clamp_rotation.cell_8", "edge_slip.cell_1", "edge_slip"} <= set(names)
    assert "states it already" in refused["edge_slip.cell_2"]
    assert names.index("clamp_rotation") < names.index("clamp_rotation.cell_1") < names.index("edge_slip")


def test_the_library_has_the_new_effects() -> None:
    assert {"plate_modulus", "plate_density", "impact_offset_across", "bird_yaw"} <= set(effects())


def test_a_candidate_sensor_beside_one_of_its_kind_is_none() -> None:
    """131 mm from the centre was proposed beside a sensor at 130 mm."""
    case = load_case("audit_strike")
    assert "displacement_quarter" in case.sensors
    found = candidates(case)
    assert "probe_displacement_fore" not in found
    assert {"probe_displacement_aft", "probe_displacement_side", "probe_strain_fore"} <= set(found)
    assert "probe_strain_centre" not in found


def test_candidate_sensors_lie_on_a_mesh_from_a_file_wherever_its_origin_is(tmp_path: Path) -> None:
    """Places counted from the origin were off a mesh that begins there, and ended the diagnosis with an error."""
    case = load_case(sheet_from_a_file(tmp_path, corner=0.0))
    found = candidates(case)
    assert found["probe_strain_centre"]["at"] == ["100 mm", "100 mm"]
    assert found["probe_displacement_corner"]["at"] == ["150 mm", "150 mm"]
    mesh = rest_mesh(case)
    assert not [line for name, sensor in with_probes(case).sensors.items() for line in sensor.misplaced(name, mesh)]


def test_a_candidate_sensor_off_the_outline_of_a_mesh_is_none(tmp_path: Path) -> None:
    """Of 3 x 3 shells an angle is left, along two sides."""
    table = sheet_from_a_file(tmp_path)
    mesh, gone = tmp_path / "plate.inp", ("5, 6,", "6, 7,", "8, 10,", "9, 11,")
    mesh.write_text("".join(line for line in mesh.read_text().splitlines(True) if not line.startswith(gone)))
    found = candidates(load_case(table))
    assert "probe_displacement_aft" in found
    assert "probe_displacement_corner" not in found


def test_candidate_sensors_on_a_turned_plate_lie_where_those_on_a_level_one_do(tmp_path: Path) -> None:
    """Places in plan were off the shells of an upright plate: it had no candidate but the reaction force."""
    found = {turn: with_probes(strike(tmp_path, turn)) for turn in (0.0, 30.0, 90.0)}
    for turn in (30.0, 90.0):
        assert list(found[turn].sensors) == list(found[0.0].sensors)
        for name, level in found[0.0].sensors.items():
            sensor = found[turn].sensors[name]
            if name.startswith(PREFIX) and isinstance(level, Placed) and isinstance(sensor, Placed):
                assert sensor.point == pytest.approx(about_y(turn) @ [*level.at, 0.0], abs=1e-7)
                assert not list(sensor.misplaced(name, rest_mesh(found[turn])))
            if isinstance(sensor, Strain):
                assert sensor.along == pytest.approx(about_y(turn) @ [1.0, 0.0, 0.0])
    assert "probe_strain_side" in found[90.0].sensors
    assert "probe_displacement_centre" not in found[90.0].sensors
    words = described("probe_strain_fore", found[90.0].sensors["probe_strain_fore"], found[90.0])
    assert words.endswith(" at (0, 0, -50) mm from target.origin"), words


@pytest.mark.parametrize("size", [-0.02, 0.0, float("nan")])
def test_a_size_of_an_effect_of_ones_own_that_is_none_is_named(size: float) -> None:
    case = load_case("reference_strike")
    register(Effect("own", "something of one's own", "m", lambda *_: {}, lambda _: size))
    try:
        with pytest.raises(
            UserError, match=r'effect "own": its `size` is \S+ m for the case .* must be above 0; let it'
        ):
            library(case, case)
    finally:
        unregister("own")
