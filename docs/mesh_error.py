"""The tables of docs/choosing.md: error of a strike's peak displacement by its mesh, against a fine mesh.

`python docs/mesh_error.py` prints them (about half an hour of one core); solver/setup_warnings.py has their means.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from typing import Any

from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.setup_warnings import shell_over_radius
from birdstrike.solver.simulate import simulate


def strike(plate: str, bird: str, flight: str, end: str, **more: Any) -> dict[str, Any]:
    """Settings of a strike from sizes in mm, m/s, degrees and ms; more: dotted keys, __ for the dot."""
    length, width, thickness = plate.split()
    diameter, long = bird.split()
    speed, angle = flight.split()
    return {
        "plate.length": f"{length} mm",
        "plate.width": f"{width} mm",
        "plate.thickness": f"{thickness} mm",
        "bird.diameter": f"{diameter} mm",
        "bird.length": f"{long} mm",
        "impact.speed": f"{speed} m/s",
        "impact.angle": f"{angle} deg",
        "impact.standoff": "5 mm",
        "time.end": f"{end} ms",
        **{key.replace("__", "."): value for key, value in more.items()},
    }


YIELDS = {"plate__material__yield_stress": "400 MPa"}
SOON = {"plate__material__yield_stress": "350 MPa"}
SPRINGS = {"plate__edges": {"rotational": "100 kN*m/rad/m"}, "plate__material__yield_stress": "250 MPa"}
STRIKES: dict[str, tuple[dict[str, Any], tuple[int, int]]] = {
    "A": (strike("525 430 10", "106 156", "91.1 30", "2"), (50, 40)),
    "B, pinned": (strike("525 430 10", "106 156", "91.1 30", "2.5", plate__edges="pinned"), (50, 40)),
    "C, on springs": (strike("525 430 10", "106 156", "120 30", "2.5", **SPRINGS), (40, 32)),
    "D": (strike("300 300 4", "50 100", "120 90", "1.5", **SOON), (50, 40)),
    "E": (strike("600 150 6", "60 120", "100 45", "2", **YIELDS), (80, 20)),
    "F": (strike("1500 200 6", "80 160", "100 60", "2.5", **YIELDS), (80, 12)),
    "G, curved": (strike("500 400 3", "80 160", "80 90", "2", plate__radius="400 mm", **YIELDS), (50, 40)),
    "H, pinned": (strike("1000 1000 5", "60 120", "80 60", "3", plate__edges="pinned"), (40, 40)),
    "I": (strike("600 600 3", "40 80", "100 90", "2.5"), (48, 48)),
}
"""Strikes on the material of synthetic_strike, and the finest mesh of each."""
SHELLS = [(2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (8, 8), (10, 10), (12, 12), (16, 16), (24, 24)]
ELONGATED = [(2, 20), (4, 20), (6, 20), (8, 40), (12, 48), (20, 4), (20, 6), (40, 8), (48, 12)]
LONG = strike("400 300 5", "50 250", "91.1 45", "2.5")
PARTICLES = (100, 150, 200, 300, 500, 1000)
OF_BIRD = {"A": (STRIKES["A"][0], 9000), "D": (STRIKES["D"][0], 9000), "J": (LONG, 2000)}
"""Strikes on 20 x 16 shells, and the largest number of particles of each."""


def peaks(settings: Mapping[str, Any]) -> tuple[Case, float, float]:
    """The case, its peak displacement [m] and its peak reaction force [N]."""
    case = load_case("synthetic_strike", settings).with_sensors({"reaction": {"kind": "reaction_force"}})
    channels = simulate(case).channels
    return case, float(abs(channels["displacement_centre"]).max()), float(abs(channels["reaction"]).max())


def rows() -> Iterator[str]:
    """Both tables, a line a mesh."""
    yield "strike | shells | shell over radius | error of peak displacement | of peak reaction"
    for name, (settings, finest) in STRIKES.items():
        _, displacement, force = peaks({**settings, "plate.elements": finest})
        for elements in (*SHELLS, *ELONGATED):
            case, d, f = peaks({**settings, "plate.elements": elements})
            errors = f"{d / displacement - 1.0:+.3f} | {f / force - 1.0:+.3f}"
            yield f"{name} | {elements[0]} x {elements[1]} | {shell_over_radius(case):.2f} | {errors}"
    yield "strike | particles | error of peak displacement | of peak reaction"
    for name, (sizes, most) in OF_BIRD.items():
        settings = {**sizes, "plate.elements": (20, 16)}
        _, displacement, force = peaks({**settings, "bird.particles": most})
        for particles in PARTICLES:
            _, d, f = peaks({**settings, "bird.particles": particles})
            yield f"{name} | {particles} | {d / displacement - 1.0:+.3f} | {f / force - 1.0:+.3f}"


if __name__ == "__main__":
    for row in rows():
        sys.stdout.write(f"{row}\n")
        sys.stdout.flush()
