"""A mesh-convergence study: its meshes, its runs through the store, and the answer for a solver of known order."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.inversion.mesh_convergence.convergence import MeshConvergence, judge_meshes, run_meshes
from birdstrike.inversion.mesh_convergence.files import as_json, curves_of, warnings_of
from birdstrike.inversion.mesh_convergence.grid_convergence import grid_convergence
from birdstrike.inversion.mesh_convergence.meshes import Mesh, choose_meshes
from birdstrike.inversion.mesh_convergence.scalars import Scalar, impulse, peak_time, peak_value
from birdstrike.solver.case.case import Case, load_case
from tests.solver.target.test_mesh_file import table_with, written

SMALL = {"bird.particles": "1200", "plate.elements": "[20, 15]", "time.end": "1 ms", "time.snapshots": "[]"}
CLOCK = np.linspace(0.0, 1e-3, 201)


def small(**changes: str) -> Case:
    return load_case("reference_strike", SMALL | {key.replace("__", "."): text for key, text in changes.items()})


@dataclass
class SecondOrder:
    """A strike whose curves are off by an error of second order in the spacing [m] of the bird."""

    spacing: dict[int, float]
    struck: list[tuple[int, float]] = field(default_factory=list)
    fails: Callable[[int, float], bool] = lambda *_: False
    finest: Callable[[Histories], Histories] = lambda run: run

    def __call__(self, case: Case, *, step_factor: float = 1.0, threads: int | None = None) -> Histories:
        assert threads == 1
        particles = case.bird.particles
        self.struck.append((particles, step_factor))
        if self.fails(particles, step_factor):
            raise RunFailed("exploded", "lower solver.courant")
        error = 1.0 + 1e4 * self.spacing[particles] ** 2
        pulse = np.sin(np.pi * CLOCK / 0.9e-3)
        channels = {"displacement_centre": 5e-3 * error * pulse, "contact_force": 1e5 * error * pulse}
        units = {"displacement_centre": "m", "contact_force": "N", "reaction_force": "N"}
        run = Histories(CLOCK, channels | {"reaction_force": 0.0 * CLOCK}, units, {"eroded_particles": 0})
        return self.finest(run) if particles == max(self.spacing) else run


def stand_in(meshes: list[Mesh], **options) -> SecondOrder:
    return SecondOrder({mesh.case.bird.particles: mesh.bird_spacing for mesh in meshes}, **options)


def study(meshes: list[Mesh], folder: Path, solver: SecondOrder) -> MeshConvergence:
    with ThreadPoolExecutor(1) as pool:
        return judge_meshes(meshes, run_meshes(meshes, RunStore(folder), 1, simulate=solver, executor=pool))


@pytest.fixture(scope="module")
def meshes() -> list[Mesh]:
    return choose_meshes(small(), 1.3, 3, "middle")


def test_bird_and_plate_are_refined_together(meshes):
    """Neighbouring spacings differ by 1.3 within what whole even and odd numbers of shells allow, both alike to 2 %."""
    bird = np.array([mesh.bird_spacing for mesh in meshes])
    plate = np.array([mesh.plate_spacing for mesh in meshes])
    np.testing.assert_allclose(bird[1:] / bird[:-1], 1.3, rtol=0.06)
    np.testing.assert_allclose(bird[1:] / bird[:-1], plate[1:] / plate[:-1], rtol=0.02)


def test_spacings_are_those_of_the_particles_that_there_are(meshes):
    for mesh in meshes:
        assert mesh.particles * mesh.bird_spacing**3 == pytest.approx(mesh.case.bird.volume)


def test_even_and_odd_numbers_of_shells_stay_so(meshes):
    assert [mesh.elements for mesh in meshes] == [(26, 19), (20, 15), (16, 11)]


@pytest.mark.parametrize(
    ("place", "levels"), [("middle", [1, 0, -1]), ("finest", [0, -1, -2]), ("coarsest", [2, 1, 0])]
)
def test_the_users_own_mesh_is_where_it_was_asked_for(place, levels):
    found = choose_meshes(small(bird__particles="2500"), 1.3, 3, place)
    assert [mesh.level for mesh in found] == levels
    assert found[levels.index(0)].case.bird.particles == 2500


def test_a_dear_case_is_coarsened_only():
    assert [mesh.level for mesh in choose_meshes(small(), 1.3, 3)] == [1, 0, -1]
    assert [mesh.level for mesh in choose_meshes(small(time__end="100 ms", bird__particles="9000"), 1.3, 3)] == [
        0,
        -1,
        -2,
    ]


@pytest.mark.parametrize(
    ("ratio", "count", "place", "changes", "message"),
    [
        (1.05, 3, "auto", {}, "--ratio = 1.05 is outside 1.1 .. 2"),
        (1.3, 2, "auto", {}, "--meshes = 2 is outside 3 .. 6"),
        (1.3, 3, "top", {}, "--place = top is unknown; known: auto, middle"),
        (1.3, 3, "middle", {"bird__particles": "110"}, "--place = coarsest"),
        (1.1, 3, "middle", {"plate__elements": "[3, 2]"}, "a larger ratio"),
    ],
)
def test_a_study_that_cannot_be_made_says_what_to_change(ratio, count, place, changes, message):
    with pytest.raises(UserError, match=message.replace(".", r"\.")):
        choose_meshes(small(**changes), ratio, count, place)


def test_a_mesh_from_a_file_is_refused_with_what_can_be_done(tmp_path):
    case = load_case(table_with(written(tmp_path / "panel.inp")))
    with pytest.raises(UserError, match=r"target\.mesh = panel\.inp: .* two finer files.*simulate --set"):
        choose_meshes(case, 1.3, 3)


def test_a_second_order_solver_is_found_out(meshes, tmp_path):
    """Its exact peak 5 mm is extrapolated, and the uncertainty of the user's mesh is 1.25 times its true error."""
    found = study(meshes, tmp_path, stand_in(meshes))
    peak, time = (found.scalars[f"displacement_centre_{name}"][1] for name in ("peak", "peak_time"))
    assert peak.order == pytest.approx(2.0, rel=1e-3)
    assert peak.extrapolated == pytest.approx(5e-3, rel=1e-4)
    true = 5e-3 * 1e4 * meshes[1].bird_spacing ** 2
    assert peak.uncertainties[found.own] == pytest.approx(1.25 * true, rel=1e-3)
    assert time.behaviour == "unchanged"
    assert found.scalars["reaction_force_peak"][1].behaviour == "unchanged"
    assert found.curves["displacement_centre"].bands[found.own].max() == pytest.approx(1.25 * true, rel=1e-3)


def test_a_finished_run_is_not_paid_twice(meshes, tmp_path):
    first, again = stand_in(meshes), stand_in(meshes)
    one = study(meshes, tmp_path, first)
    two = study(meshes, tmp_path, again)
    assert len(first.struck) == 3
    assert again.struck == []
    assert as_json(one) == as_json(two)


def test_dearest_first(meshes, tmp_path):
    solver = stand_in(meshes)
    study(meshes, tmp_path, solver)
    assert [particles for particles, _ in solver.struck] == [mesh.case.bird.particles for mesh in meshes]


def test_a_failed_mesh_is_tried_at_half_the_step_and_said(meshes, tmp_path):
    finest = meshes[0].case.bird.particles
    solver = stand_in(meshes, fails=lambda particles, factor: particles == finest and factor == 1.0)
    found = study(meshes, tmp_path, solver)
    assert found.runs[0].step_factor == 0.5
    assert any("half the time step" in line for line in warnings_of(found))


def test_a_mesh_that_fails_for_good_is_named_and_the_others_are_kept(meshes, tmp_path):
    finest = meshes[0].case.bird.particles
    solver = stand_in(meshes, fails=lambda particles, _: particles == finest)
    with pytest.raises(RunFailed, match=f"1 of 3 meshes failed.*{meshes[0].particles} particles.*exploded"):
        study(meshes, tmp_path, solver)
    assert len(RunStore(tmp_path).keys()) == 2


def test_four_meshes_judge_by_the_users_own_and_its_neighbours(tmp_path):
    four = choose_meshes(small(bird__particles="2500"), 1.3, 4, "finest")
    found = study(four, tmp_path, stand_in(four))
    assert found.used == (0, 1, 2)
    assert len(found.scalars["displacement_centre_peak"][2]) == 4


def test_a_plate_that_tears_on_one_mesh_only_is_another_event(meshes, tmp_path):
    solver = stand_in(meshes, finest=lambda run: replace(run, summary={**run.summary, "eroded_shells": 3}))
    torn = study(meshes, tmp_path, solver)
    assert warnings_of(torn)[0].startswith("the plate tears on some meshes only")
    assert [mesh["eroded_shells"] for mesh in as_json(torn)["meshes"]] == [3, None, None]


@pytest.mark.parametrize(
    ("size", "said"), [(25.0, "the shells of stiffeners are refined by 1.14 and 1.58"), (10.0, "")]
)
def test_a_part_that_a_generator_does_not_refine_with_the_bird_is_named(size, said, meshes, tmp_path):
    """Webs of 40 mm with shells of 19, 25 and 31 mm: two, two and one across; of 8, 10 and 13 mm all is in step."""
    found = study(meshes, tmp_path, stand_in(meshes))
    panel = load_case("openradioss_panel", {"target.generator.element_size": f"{size} mm"})
    across = (26, 20, 16) if said else (64, 50, 38)
    refined = tuple(
        replace(mesh, case=panel.with_mesh(400, (shells, shells)), bird_spacing=1.0 / shells)
        for mesh, shells in zip(meshes, across, strict=True)
    )
    lines = [line for line in warnings_of(replace(found, meshes=refined)) if line.startswith("the shells of")]
    assert [line[: len(said)] for line in lines] == ([said] if said else [])


def test_a_peak_that_another_mesh_cuts_off_is_named_with_that_mesh(meshes, tmp_path):
    rise = {"displacement_centre": 5.0 * CLOCK}
    solver = stand_in(meshes, finest=lambda run: replace(run, channels={**run.channels, **rise}))
    rising = study(meshes, tmp_path, solver)
    expected = f"displacement_centre_peak lies at time.end on the mesh of {meshes[0].particles} particles: lengthen"
    assert any(line.startswith(expected) for line in warnings_of(rising))


def test_an_order_far_above_the_scheme_s_is_warned_of_before_what_oscillates(meshes, tmp_path):
    found = study(meshes, tmp_path, stand_in(meshes))
    spacings = [mesh.bird_spacing for mesh in meshes]
    scalars = {
        name: (found.scalars["displacement_centre_peak"][0], grid_convergence(spacings, values), values)
        for name, values in (("wavy", (1.0, 1.1, 1.05)), ("lucky", (1.479, 1.478, 1.302)))
    }
    lines = warnings_of(replace(found, scalars=scalars))
    assert lines[0].startswith("lucky: the observed order")
    assert lines[1].startswith("wavy is oscillating")


def test_curves_of_all_meshes_stand_beside_the_band(meshes, tmp_path):
    table = curves_of(study(meshes, tmp_path, stand_in(meshes)))
    columns = [f"displacement_centre_{end}" for end in ("mesh1", "mesh2", "mesh3", "uncertainty")]
    assert list(table.channels)[:4] == columns
    assert table.units["contact_force_uncertainty"] == "N"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_meshes_whose_curves_swing_as_far_either_way_are_read_on_the_side_of_one(side):
    """Peaks of -501, 501 and 503 were a peak that diverges."""
    time = np.linspace(0.0, 1.0, 201)
    swings = (np.array([503.0, 501.0]), np.array([501.0, 502.0]), np.array([500.0, 501.0]))
    runs = [
        Histories(
            time, {"strain": side * np.where(time < 0.5, up, -down) * np.sin(2.0 * np.pi * time) ** 2}, {"strain": ""}
        )
        for up, down in swings
    ]
    peak = Scalar("strain_peak", "strain", "", peak_value)
    assert [peak.at(run, runs[0]) for run in runs] == pytest.approx(
        [side * 503.0, side * 501.0, side * 500.0], rel=1e-4
    )
    assert Scalar("strain_peak_time", "strain", "s", peak_time).at(runs[1], runs[0]) == pytest.approx(0.25)
    assert Scalar("strain_impulse", "strain", "N s", impulse).at(runs[0], runs[0]) == pytest.approx(
        side * 0.5, rel=1e-6
    )


def test_a_parabolas_peak_is_found_between_its_samples():
    time = np.linspace(0.0, 1.0, 11)
    values = 2.0 - (time - 0.43) ** 2
    assert peak_value(time, values) == pytest.approx(2.0)
    assert peak_time(time, values) == pytest.approx(0.43)
    assert peak_time(time, time) == 1.0
    assert impulse(time, 2.0 + 0.0 * time) == pytest.approx(2.0)
