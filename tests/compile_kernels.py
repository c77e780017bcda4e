"""Compile the solver's kernels into their cache: `python -m tests.compile_kernels`.

On a new checkout the tests compile each kernel when they first need it, and a kernel that two workers need at the same
time twice. This program compiles them once, while `.ci/run` checks style and types. A kernel that no case here needs is
compiled by the test that uses it.
"""

from __future__ import annotations

from birdstrike import load_case, simulate
from tests.bit_comparison import CASES, LARGE

SHORT = {"time.end": "0.02 ms", "time.output_interval": "2 us", "time.snapshots": "[]"}
COARSE = {"target.generator.element_size": "50 mm", "bird.particles": "200"}
ASSEMBLIES = ("flat_plate_002", "sidewall_004", "openradioss_panel")


def main() -> None:
    """A few steps of the small cases of the bit comparison, and of one case a kind of target."""
    for name, (case, changes) in CASES.items():
        if name not in LARGE:
            simulate(load_case(case, changes | SHORT))
    for name in ASSEMBLIES:
        simulate(load_case(name, COARSE | SHORT))


if __name__ == "__main__":
    main()
