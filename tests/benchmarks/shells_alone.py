"""Worker of `test_shells.py`: shells without a bird, elastic or yielding, in the tree that the environment names.

Runs in this tree and in that of the commit to compare with, hence the two names of one module. Reads "elastic" or
"yielding" line by line; answers with CPU seconds a shell-step, the share of layers that yielded, and a digest.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from importlib import import_module

import numpy as np

from birdstrike import load_case

try:
    build_plate = import_module("birdstrike.solver.build").build_plate
except ModuleNotFoundError:
    build_plate = import_module("solver.build_plate").build_plate

STEPS = 300
SPEED = {"elastic": 0.2, "yielding": 30.0}  # [m/s], of the plate's middle
YIELD = {"elastic": "10 GPa", "yielding": "20 MPa"}


def run(kind: str, steps: int) -> tuple[float, float, str]:
    """CPU seconds a shell-step, the share of layers that yielded in a step, digest of the last positions."""
    case = load_case("reference_strike", {"plate.elements": "[50, 40]", "plate.material.yield_stress": YIELD[kind]})
    plate = build_plate(case)
    dt = 0.9 * plate.stable_step()
    half = np.abs(plate.x).max(axis=0)
    plate.v[:, 2] = -SPEED[kind] * np.cos(0.5 * np.pi * plate.x[:, 0] / half[0]) ** 2
    plate.v[:, 2] *= np.cos(0.5 * np.pi * plate.x[:, 1] / half[1]) ** 2
    plate.v[plate.fixed] = 0.0
    still, frame = np.zeros_like(plate.x), np.zeros(3)
    block = plate.blocks[0] if hasattr(plate, "blocks") else plate
    energies = plate.update_energies if hasattr(plate, "update_energies") else plate.keep_books
    seconds, yielded, counted = 0.0, 0.0, 0
    for step in range(steps):
        before = block.eps_p.copy() if step % 10 == 9 else None
        start = time.process_time()
        plate.update_forces(dt)
        plate.reaction(still, frame)
        energies()
        plate.kick_and_drift(dt, dt, still)
        seconds += time.process_time() - start
        if before is not None:
            yielded, counted = yielded + float(np.mean(block.eps_p > before)), counted + 1
    digest = hashlib.sha256(plate.x.tobytes() + block.stress.tobytes()).hexdigest()
    return seconds / (steps * len(plate.quads)), yielded / max(counted, 1), digest


if __name__ == "__main__":
    for kind in SPEED:
        run(kind, 2)
    print("ready", flush=True)  # noqa: T201
    for line in sys.stdin:
        print(json.dumps(run(line.strip(), STEPS)), flush=True)  # noqa: T201
