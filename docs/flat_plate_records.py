"""Records of flat_plate_002 at 70, 120 and 170 m/s in data/measured: SIMULATED, NOT MEASURED.

A laboratory whose bird no ranked model is: water with 5 % of air by seed 1's linear rule, a finer mesh, noise. Run:
python docs/flat_plate_records.py (15 minutes on two cores).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from birdstrike.data.curves import Measured, write_measured
from birdstrike.data.paths import MEASURED
from birdstrike.solver.case.case import load_case
from birdstrike.solver.simulate import simulate

CASES = {"70": "flat_plate_002_70", "120": "flat_plate_002", "170": "flat_plate_002_170"}
CHANNELS = (
    "displacement_centre",
    "displacement_along",
    "displacement_across",
    "strain_along_0",
    "strain_along_90",
    "strain_across_0",
    "strain_across_90",
    "reaction_force",
)
TRUTH = {
    "target.generator.element_size": "10 mm",
    "bird.particles": 8000,
    "bird.jitter": 0.05,
    "bird.material.eos": {"kind": "porous", "z": 0.05, "mixing": "linear"},
}
STEP = 10  # of the output: one sample in so many is written
SEED = 20


def record(speed: str, step: int = STEP, **changes: object) -> Measured:
    """One shot as an instrument would have seen it."""
    case = load_case(CASES[speed], {**TRUTH, **changes})
    run = simulate(case)
    time = run.time[::step]
    rng = np.random.default_rng([SEED, int(speed)])
    curves = {
        name: run.channels[name][::step] + (case.sensors[name].noise or 0.0) * rng.standard_normal(len(time))
        for name in CHANNELS
    }
    notes = (
        "SIMULATED by birdstrike, NOT MEASURED: no instrument took these curves. They stand in for a laboratory whose",
        f"bird is of no model that calibrate-models ranks. Set-up as declared: case {CASES[speed]}, {speed} m/s.",
        "Made by docs/flat_plate_records.py: shells of 10 mm and 8000 particles on a jittered lattice where the case",
        "has 12 mm and 3000. Truth of the bird: NULL, pressure cutoff -0.1 MPa, no viscosity, equation of state porous",
        "(linear mixing, 5 % of air). White noise was added (standard deviation): 0.05 mm, 3e-5 of strain, 1 kN.",
    )
    units = {name: run.units[name] for name in CHANNELS}
    return Measured(time, curves, {}, units, notes)


def main() -> None:
    """Write the three files."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--out", type=Path, default=MEASURED)
    folder = given.parse_args().out
    for speed in CASES:
        write_measured(folder / f"flat_plate_002_{speed}.csv", record(speed))


if __name__ == "__main__":
    main()
