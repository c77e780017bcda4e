"""Energy balance of the reference strike, and the same bits whatever the threads."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys

from birdstrike.data.errors import RunFailed
from birdstrike.reports.verification.made import ROOT
from birdstrike.reports.verification.problem import Computed, Problem, Row, Solution, below, shown
from birdstrike.reports.verification.runs import RunSpec

REFERENCE_STRIKE = RunSpec("reference_strike", (("time.snapshots", "[]"),))
INVISCID = REFERENCE_STRIKE.with_(bird__material__viscosity="0 Pa s")
CONSERVED, BALANCE = "conservation", "energies, each from its own rate"
SMALL = {
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "time.end": "0.5 ms",
    "time.snapshots": "[]",
    "impact.standoff": "2 mm",
}
RUN = """
import json, sys
from birdstrike.solver.case.case import load_case
from birdstrike.solver.simulate import simulate
run = simulate(load_case("reference_strike_156mm", json.loads(sys.argv[1])), threads=int(sys.argv[2]))
sys.stdout.buffer.write(b"".join(values.tobytes() for values in run.channels.values()))
"""


def solve_balance(computed: Computed) -> Solution:
    """Momenta, energy, hourglass share and shock viscosity, with MU of the case and without any."""
    rows: list[Row] = []
    for name, spec in (("viscous", REFERENCE_STRIKE), ("inviscid", INVISCID)):
        s = computed[spec].summary
        energies = s["energies_J"]
        hourglass = 100.0 * energies["plate_hourglass"] / energies["plate_internal"]
        viscosity = s["shock_equivalent_viscosity_Pa_s"]
        worst = 100.0 * s["worst_energy_error"]
        rows += [
            below(f"{name}: linear momentum", s["momentum_error"], 1e-10, "", CONSERVED, "of the bird's"),
            below(f"{name}: angular momentum", 100.0 * s["angular_momentum_error"], 1.0, "%", CONSERVED),
            below(f"{name}: energy, worst instant", worst, 1.0, "%", BALANCE, "of the normal kinetic energy"),
            below(f"{name}: hourglass of the plate's internal energy", hourglass, 5.0, "%", BALANCE),
            below(f"{name}: shock viscosity as a shear viscosity", viscosity, 75.0, "Pa s", "5 % of the range of MU"),
            shown(f"{name}: time of the run", s["wall_s"], "s", "this machine, one thread, while others run"),
        ]
    return Solution(tuple(rows))


def bits(threads: int) -> str:
    """Digest of a small simulation's channels, run in a process of its own with that many threads. Raises RunFailed."""
    environment = os.environ | dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"), str(threads))
    command = [sys.executable, "-c", RUN, json.dumps(SMALL), str(threads)]
    ended = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=False)
    if ended.returncode != 0:
        raise RunFailed(f"the simulation on {threads} threads failed: {ended.stderr.decode(errors='replace')[-300:]}")
    return hashlib.sha256(ended.stdout).hexdigest()


def solve_threads(_: Computed) -> Solution:
    """Byte for byte the same histories on 1, 2 and 3 threads."""
    digests = [bits(threads) for threads in (1, 2, 3)]
    different = float(sum(digest != digests[0] for digest in digests))
    name = "runs on 2 and 3 threads that differ from 1 thread in any bit"
    note = f"500 particles, 0.5 ms; all channels, SHA-256 {digests[0][:12]}"
    return Solution((below(name, different, 0.0, "", "determinism", note),))


FAMILY = "Energy balance of the reference strike"
ABOUT = "`reference_strike` as shipped: 4501 particles, 2000 shells, 3 ms; and the same with MU = 0."
PROBLEMS = (
    Problem("energy_balance", FAMILY, ABOUT, solve_balance, (REFERENCE_STRIKE, INVISCID)),
    Problem("threads", FAMILY, "", solve_threads),
)
