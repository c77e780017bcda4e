"""Curved shells against published benchmarks, a spinning stressed shell, and a strike on a curved panel."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.problems.shell import (
    pinched_hemisphere,
    scordelis_lo,
    scordelis_lo_plate,
    spinning_shell,
)
from birdstrike.solver.build import flight_to_panel
from birdstrike.solver.case.case import load_case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.simulate import simulate
from birdstrike.solver.target.mesh import cylindrical_panel, shell_mesh


def test_scordelis_lo_roof():
    assert scordelis_lo(32).error < 0.03


def test_scordelis_lo_roof_converges():
    errors = [scordelis_lo(n).error for n in (8, 16, 32)]
    assert errors[1] < 0.4 * errors[0]
    assert errors[2] < 0.4 * errors[1]


def test_pinched_hemisphere():
    assert pinched_hemisphere(16).error < 0.03


def test_the_loop_comes_to_rest_at_the_static_deflection():
    """Dynamic relaxation of the roof under a hundredth of its weight, by the time loop with mass damping."""
    plate, load, read = scordelis_lo_plate(4)
    plate.nodes.damping = 28.0  # nearly critical: the roof's first mode has 16.7 rad/s
    dt = 0.9 * plate.stable_step()
    for step in range(int(0.4 / dt)):
        plate.update_forces(dt if step else 0.0)
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, 0.01 * load)
    moved = plate.mesh.nodes[read, 2] - plate.x[read, 2]
    assert 100.0 * moved == pytest.approx(scordelis_lo(4).computed[0], rel=0.01)


def test_a_spinning_stressed_shell_keeps_its_stress():
    """A full turn in 5000 steps changes no resultant by 5e-4; what is left falls with the step squared."""
    coarse, fine = spinning_shell(1.0, 2_500)[0], spinning_shell(1.0, 5_000)[0]
    assert fine < 5e-4
    assert fine < 0.3 * coarse


def test_panel_has_its_radius_and_its_arc():
    mesh = cylindrical_panel(0.5, 0.4, 0.6, (40, 4))
    assert np.allclose(np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 2] + 0.6), 0.6)
    assert np.ptp(mesh.nodes[:, 0]) == pytest.approx(2.0 * 0.6 * np.sin(0.25 / 0.6))
    assert np.ptp(mesh.surface[:, 0]) == pytest.approx(0.5)
    assert (mesh.normals()[:, 2] > 0.0).all()


@pytest.mark.parametrize("every", [2, 3, 5])
def test_normals_do_not_hang_on_how_shells_are_wound(every):
    """But for their sign: springs along and across the surface act the same ways."""
    mesh = cylindrical_panel(0.4, 0.4, 0.3, (16, 16))
    quads = mesh.quads.copy()
    quads[::every] = quads[::every][:, [0, 3, 2, 1]]
    cosine = (mesh.normals() * shell_mesh(mesh.nodes, quads).normals()).sum(axis=1)
    assert np.abs(cosine) == pytest.approx(1.0)


PANEL = {
    "plate.radius": "500 mm",
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "time.end": "1.2 ms",
    "time.snapshots": "[]",
    "impact.standoff": "2 mm",
}


def test_a_strike_on_a_curved_panel_balances():
    run = simulate(load_case("reference_strike_156mm", PANEL))
    assert run.summary["momentum_error"] < 1e-10
    assert run.summary["worst_energy_error"] < 0.01
    flat = simulate(load_case("reference_strike_156mm", {k: v for k, v in PANEL.items() if k != "plate.radius"}))
    peaks = [r.summary["peak"]["displacement_centre"]["value"] for r in (run, flat)]
    assert 0.0 < peaks[0] < peaks[1]


@pytest.mark.parametrize("angle", ["30 deg", "90 deg"])
def test_a_panel_is_first_touched_after_the_standoff(angle):
    """Within half a spacing of flight, by the particle that lies nearest along the velocity."""
    case = load_case(
        "reference_strike_156mm", PANEL | {"impact.standoff": "10 mm"} | {"impact.angle": angle, "impact.aim": "axis"}
    )
    run = Coupling(case)
    direction = run.bird.v[0] / np.linalg.norm(run.bird.v[0])
    flight = flight_to_panel(run.bird.x, direction, case.plate, run.contact.gap)
    assert flight == pytest.approx(case.impact.standoff, abs=run.bird.skin)
    first = None
    while first is None:
        run.advance()
        first = run.time if run.push > 0.0 else None
        run.move()
    facets = 2.5e-6  # the mesh lies below the arc that `flight_to_panel` takes
    assert first == pytest.approx(flight / case.impact.speed, abs=2.0 * run.dt + facets)
