"""Simulations in which the plate tears or is missed: the bird flies on, energy and momentum are conserved."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.checks import untouched
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.simulate import simulate

SMALL = {
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "time.end": "1.2 ms",
    "time.snapshots": "[]",
    "impact.standoff": "2 mm",
    "impact.angle": "90 deg",
}


def small(**changes: str) -> Case:
    return load_case("reference_strike_156mm", SMALL | {key.replace("__", "."): text for key, text in changes.items()})


@pytest.mark.parametrize("friction", ["0.0", "0.3"])
def test_the_bird_flies_through_a_torn_plate(friction):
    """A hole opens under the bird, pressed on after 0.25 ms: it flies through, and momentum and energy stay.

    (MU = 0: its stress is not central.)
    """
    run = Coupling(small(impact__friction=friction, bird__material__viscosity="0 Pa s"))
    centres = run.plate.x[run.plate.quads].mean(axis=1)
    hole = np.abs(centres[:, :2]).max(axis=1) < 0.06
    for step in range(run.steps):
        if run.plate.alive.all() and run.time > 0.25e-3 and run.push > 0.0:
            run.plate.alive[hole] = False
        run.advance()
        if step % 20 == 0:
            run.audit()
        else:
            run.move()
    below = run.bird.x[: run.bird.n, 2] < -run.contact.gap
    assert 0.1 < below.mean() < 1.0
    assert run.contact.energies["eroded"] > 0.0
    assert run.balance.momentum_error(run.bird, run.plate) < 1e-10
    assert run.balance.angular_momentum_error(run.bird, run.half_length) < 1e-6
    assert run.balance.worst < 0.01


def test_a_bird_that_never_meets_the_plate_is_told_what_to_change():
    short = simulate(small(time__end="0.01 ms", impact__standoff="10 mm"), threads=1).summary["warnings"]
    assert any("did not touch the plate before time.end: shorten impact.standoff" in line for line in short)
    run = Coupling(small())
    run.bird.x[: run.bird.n, 2] -= 1.0
    assert untouched(run).startswith("the bird flew past the plate: enlarge it, or aim elsewhere (impact.offset")
