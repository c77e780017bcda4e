"""The plan: points, two-level design, meshes, the library."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.effects import Effect, register, unregister
from birdstrike.inversion.diagnosis.diagnose import NamedRecord, predicted_shots
from birdstrike.inversion.diagnosis.preparation.plan import (
    Block,
    Known,
    levels,
    library,
    magnitude,
    make_plan,
    two_level,
)
from birdstrike.inversion.diagnosis.preparation.responses import learn_responses
from birdstrike.inversion.diagnosis.preparation.setup import unpredictable
from birdstrike.inversion.estimation.mesh_correction import spread
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.effects.registry import effects
from tests.inversion.diagnosis.rig import tiny


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
    assert "reaction force by 11 % of the peak" in lost
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


def test_the_library_of_a_target_on_several_sets_holds_the_effects_of_each() -> None:
    case = load_case("flat_plate_002", {"effects.edge_slip.cell_2": "0.1 mm^2/kN"})
    known, refused = library(case, case)
    names = [one.name for one in known]
    assert {"clamp_rotation.cell_8", "edge_slip.cell_1", "edge_slip"} <= set(names)
    assert "states it already" in refused["edge_slip.cell_2"]
    assert names.index("clamp_rotation") < names.index("clamp_rotation.cell_1") < names.index("edge_slip")


def test_the_library_has_the_new_effects() -> None:
    assert {"plate_modulus", "plate_density", "impact_offset_across", "bird_yaw"} <= set(effects())


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
