"""Rows of the plate's frame: frequencies on edge springs and under preload, membrane stiffening, damping."""

from __future__ import annotations

import numpy as np

from reports.verification.draw import Curve, Panel, draw
from reports.verification.plate_membrane import THICKNESS, membrane_stiffening
from reports.verification.plate_problems import damping_decrement, preloaded_frequencies, spring_frequencies
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import matches

MESH = (25, 20)
RITZ = "Mindlin plate on the same springs or under the same tension, Ritz series (computed here, without a mesh)"
VON_KARMAN = "von Karman plate on in-plane springs, Ritz minimisation of its energy (computed here)"
ROTATIONAL = (1e4, 5e4, 2e5, 1e6)  # N m/rad per m: from nearly pinned to nearly clamped
TENSIONS = {"100 MPa along": (100e6, 0.0), "100 MPa across": (0.0, 100e6), "-50 and 20 MPa": (-50e6, 20e6)}
IN_PLANE = (np.inf, 2e9, 1e7)  # N/m per m
PRESSURE = 0.1e6  # Pa
DAMPINGS = (50.0, 100.0, 400.0)  # 1/s


def solve_springs(_: Strikes) -> Outcome:
    """First three frequencies from nearly pinned to nearly clamped; the first is judged."""
    figure = "edge_springs"
    found = [spring_frequencies(stiffness, MESH) for stiffness in ROTATIONAL]
    rows = [
        matches(
            f"frequency {mode + 1}, edge springs {1e-3 * stiffness:g} kN m/rad/m",
            float(pair.computed[mode]),
            float(pair.reference[mode]),
            "Hz",
            None if mode else 1.0,
            RITZ,
            "",
            figure,
        )
        for stiffness, pair in zip(ROTATIONAL, found, strict=True)
        for mode in range(3)
    ]
    stiffness = [1e-3 * value for value in ROTATIONAL]
    curves = []
    for mode in range(3):
        curves.append(Curve("Ritz" if mode == 0 else "", stiffness, [p.reference[mode] for p in found], truth=True))
        curves.append(Curve(f"mode {mode + 1}", stiffness, [p.computed[mode] for p in found], dots=True))
    worst = 100.0 * max(pair.error for pair in found)
    caption = f"Three frequencies against the stiffness of rotational edge springs: at most {worst:.2f} % off Ritz."
    panel = Panel("rotational stiffness of the edge [kN m/rad/m]", "frequency [Hz]", curves, log=True)
    return Outcome(tuple(rows), (Picture(figure, draw(panel), caption),))


def solve_preload(_: Strikes) -> Outcome:
    """First three frequencies of the clamped plate under three states of initial stress; the first is judged."""
    rows = []
    for name, tension in TENSIONS.items():
        pair = preloaded_frequencies(tension, MESH)
        for mode, (ours, truth) in enumerate(zip(pair.computed, pair.reference, strict=True)):
            gate = None if mode else 1.0
            rows.append(matches(f"frequency {mode + 1}, preload {name}", float(ours), float(truth), "Hz", gate, RITZ))
    return Outcome(tuple(rows))


def solve_in_plane(_: Strikes) -> Outcome:
    """Centre deflection under a pressure, the edge held, sprung and nearly free in its plane."""
    pair = membrane_stiffening(PRESSURE, IN_PLANE)
    note = f"{1e3 * THICKNESS:g} mm thick, {1e-6 * PRESSURE:g} MPa; the time loop relaxed to rest, 20 x 16 shells"
    words = ("rigid", "springs of 2 GN/m per m", "springs of 10 MN/m per m")
    rows = [
        matches(
            f"large deflection, edge in its plane: {w}", 1e3 * float(a), 1e3 * float(b), "mm", 2.0, VON_KARMAN, note
        )
        for w, a, b in zip(words, pair.computed, pair.reference, strict=True)
    ]
    return Outcome(tuple(rows))


def solve_damping(_: Strikes) -> Outcome:
    """Decay of the first mode's free vibration over six periods."""
    source = "exp(-d t): plate.damping is the rate at which the amplitude decays"
    rows = []
    for damping in DAMPINGS:
        pair = damping_decrement(damping)
        name = f"decay rate of the first mode, damping {damping:g} 1/s"
        rows.append(matches(name, float(pair.computed[0]), float(pair.reference[0]), "1/s", 1.0, source))
    return Outcome(tuple(rows))


ABOUT = (
    "The plate of 525 x 430 x 10 mm on 25 x 20 shells, its frame giving way by springs, or under an initial stress; "
    "in-plane springs on a plate of 4 mm, where the deflection is 1.5 to 2.2 thicknesses."
)
FAMILY = "Edges, preload and damping of the plate"
PROBLEMS = (
    Problem("edge_springs", FAMILY, ABOUT, solve_springs),
    Problem("in_plane_springs", FAMILY, "", solve_in_plane),
    Problem("preload", FAMILY, "", solve_preload),
    Problem("damping", FAMILY, "", solve_damping),
)
