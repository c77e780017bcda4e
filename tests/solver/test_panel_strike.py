"""Birds on stiffened panels: no particle gets through a sound skin, and energy and momentum balance."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.histories import Histories, Snapshot
from birdstrike.reports.verification.problems.joined import Crossed, crossings
from birdstrike.reports.verification.problems.joined import random_panel as random_spec
from birdstrike.reports.verification.runs import compute
from birdstrike.solver.build import rest_mesh
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.checks import shells_of
from birdstrike.solver.simulate import simulate

SMALL = {"bird.particles": 250, "time.end": "0.8 ms", "time.snapshots": ["0.8 ms"], "impact.standoff": "1 mm"}


def random_panel(seed: int) -> Case:
    """A panel, angle and speed by chance, coarse enough for a test."""
    rng = np.random.default_rng(seed)
    flange = {"section": "L", "flange": f"{rng.uniform(15.0, 30.0):.1f} mm"} if rng.random() < 0.5 else {}
    generator = {
        "length": f"{rng.uniform(350.0, 500.0):.1f} mm",
        "width": f"{rng.uniform(300.0, 450.0):.1f} mm",
        "element_size": f"{rng.uniform(16.0, 24.0):.1f} mm",
        "stiffeners": int(rng.integers(1, 4)),
        "pitch": f"{rng.uniform(90.0, 110.0):.1f} mm",
        "height": f"{rng.uniform(25.0, 50.0):.1f} mm",
        **flange,
    }
    changes = {f"target.generator.{key}": value for key, value in generator.items()}
    changes |= {f"target.parts.{part}.thickness": f"{rng.uniform(2.0, 4.0):.2f} mm" for part in ("skin", "stiffeners")}
    changes |= {
        "impact.speed": f"{rng.uniform(60.0, 140.0):.1f} m/s",
        "impact.angle": f"{rng.uniform(20.0, 90.0):.1f} deg",
    }
    changes |= {"impact.offset": [f"{rng.uniform(-50.0, 50.0):.1f} mm", f"{rng.uniform(-50.0, 50.0):.1f} mm"]}
    table = load_case("openradioss_panel", {**SMALL, **changes}).table
    cells = {"skin_cells": "skin_edges", "web_cells": "stiffener_ends"}
    table["target"]["supports"] = dict.fromkeys(cells.values(), "clamped")
    table["sensors"] = {name: {"kind": name} for name in ("contact_force", "reaction_force")}
    table["sensors"] |= {name: {"kind": "reaction_force", "support": support} for name, support in cells.items()}
    return load_case(table)


def below_the_skin(case: Case, last: Snapshot) -> int:
    """Particles under the skin's deformed mid-surface, of those whose place is over it."""
    mesh = rest_mesh(case)
    skin = mesh.quads[mesh.parts["skin"]]
    middles = last.nodes[skin].mean(axis=1)
    half = 0.45 * np.ptp(mesh.nodes[:, :2], axis=0)
    inside = (np.abs(last.particles[:, :2]) < half).all(axis=1)
    apart = ((last.particles[inside, None, :2] - middles[None, :, :2]) ** 2).sum(axis=2)
    return int((last.particles[inside, 2] < middles[apart.argmin(axis=1), 2] - 0.004).sum())


def balanced(run: Histories) -> bool:
    return run.summary["worst_energy_error"] < 0.01 and run.summary["momentum_error"] < 1e-10


@pytest.mark.parametrize("seed", range(3))
def test_no_particle_crosses_a_sound_panel(seed):
    case = random_panel(seed)
    run = simulate(case)
    assert run.summary["squeezed_through"] == 0
    assert run.summary["eroded_shells"] == 0
    assert run.channels["contact_force"].max() > 0.0
    assert below_the_skin(case, run.snapshots[-1]) == 0
    assert balanced(run)
    cells = run.channels["skin_cells"] + run.channels["web_cells"]
    assert cells == pytest.approx(run.channels["reaction_force"], abs=1e-9 * np.abs(cells).max())
    assert np.abs(run.channels["web_cells"]).max() > 0.0


def test_a_panel_that_tears_keeps_its_balance():
    changes = {
        **SMALL,
        "target.generator.element_size": "20 mm",
        "target.parts.skin.thickness": "1.2 mm",
        "target.materials.aluminium.failure_strain": 0.07,
        "impact.speed": "180 m/s",
        "time.end": "0.5 ms",
        "time.snapshots": [],
    }
    run = simulate(load_case("openradioss_panel", changes))
    assert run.summary["eroded_shells"] > 5
    assert run.summary["worst_energy_error"] < 0.02
    assert run.summary["momentum_error"] < 1e-9


def test_what_refines_the_shells_is_named_as_the_case_has_it():
    """No plate.elements where the case has none: an error or a warning names the generator's key, or the mesh file."""
    panel = load_case("openradioss_panel")
    assert panel.target is not None
    file = panel.target.model_copy(update={"generator": None, "mesh": "panel.inp"})
    cases = (load_case("reference_strike"), panel, panel.model_copy(update={"target": file}))
    named = ["plate.elements", "target.generator.element_size", "the file of target.mesh"]
    assert [shells_of(case) for case in cases] == named


@pytest.mark.parametrize("seed", [1, 8, 11])
def test_no_particle_crosses_live_skin_of_a_random_panel(seed):
    """As `birdstrike verify --only random_panels` counts it for 300 of them: riveted or torn ones are among these."""
    spec = random_spec(seed)
    run = compute(spec)
    assert crossings(spec, run).sound == 0
    assert run.channels["contact_force"].max() > 0.0
    assert run.summary["worst_energy_error"] < 0.02
    assert run.summary["momentum_error"] < 1e-9


def test_a_particle_behind_the_skin_is_counted_as_crossed():
    """The count itself: a particle moved through sound skin is found, one moved where the skin is torn counts apart."""
    spec = random_spec(0)
    mesh = rest_mesh(spec.load())
    skin = mesh.quads[mesh.parts["skin"]]
    middle = mesh.nodes[skin].mean(axis=1)
    at = int(np.argmin(np.abs(middle[:, :2]).sum(axis=1)))

    def instant(height: float, quads: np.ndarray) -> Snapshot:
        empty = np.zeros(1)
        place = middle[at] + [0.0, 0.0, height]
        still = (place[None], empty, place[None], empty > 1.0, empty, np.empty((0, 8), np.int64))
        return Snapshot(0.0, *still, mesh.nodes, quads, np.zeros(len(quads)))

    without = np.delete(mesh.quads, mesh.parts["skin"][at + 1], axis=0)
    for quads, expected in ((mesh.quads, Crossed(1, 0)), (without, Crossed(0, 1))):
        passed = Histories(np.zeros(2), {}, {}, {}, (instant(0.01, mesh.quads), instant(-0.01, quads)))
        assert crossings(spec, passed) == expected
        kept = Histories(np.zeros(2), {}, {}, {}, (instant(0.01, mesh.quads), instant(0.005, quads)))
        assert crossings(spec, kept) == Crossed(0, 0)
