"""The clamped plate: frequencies against Ritz, step response against Ritz and CalculiX, on refined meshes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.data.paths import REFERENCE
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import (
    Computed,
    Picture,
    Problem,
    Row,
    Solution,
    below,
    matches,
    near,
    rms_of_peak,
)
from birdstrike.reports.verification.problems.plate import central_load, respond, shells
from birdstrike.solver.target.modes import natural_frequencies

MESHES = ((25, 20), (50, 40), (100, 80))
FORCE = 30e3  # N on the central 100 x 100 mm
END = 3.1e-3  # s, of the reference's 3 ms


def reference(column: str) -> tuple[Array, Array]:
    """Time [s] and displacement [m] of one independent solution."""
    table = pd.read_csv(REFERENCE / "plate_step_response.csv", comment="#")
    return table["t_ms"].to_numpy() * 1e-3, table[column].to_numpy() * 1e-3


def off_reference(time: Array, w: Array, column: str) -> float:
    """RMS difference from an independent solution, in % of its peak."""
    t, expected = reference(column)
    return rms_of_peak(np.interp(t, time, w), expected)


def step_response(elements: tuple[int, int], scale: float) -> tuple[Array, Array]:
    """Time [s] and centre displacement [m] under the load over `scale`, times `scale`: linear where that is large."""
    plate = shells(elements)
    time, w = respond(plate, central_load(plate, FORCE / scale), END)
    return time, scale * w


MINDLIN, KIRCHHOFF = (397.7, 708.2, 897.6), (399.9, 714.3, 907.0)  # Hz
RITZ = "Mindlin plate, Ritz series (computed): data/reference/plate_step_response.csv"
THIN = "Kirchhoff plate, Ritz series (computed)"
OTHERS = {
    "linear": {"mindlin_ritz_lin_mm": ("Mindlin Ritz", 1.0), "kirchhoff_ritz_lin_mm": ("Kirchhoff Ritz", None)},
    "large": {"ccx_S4_n16_nl_mm": ("CalculiX S4 6.25 mm", 2.0), "kratos_MITC_n8_nl_mm": ("Kratos MITC4 12.5 mm", None)},
}
LINEAR = 1000.0
"""What the load is divided by for a linear response."""
STEP_SOURCE = "data/reference/plate_step_response.csv (simulated or computed by others)"


def solve_frequencies(_: Computed) -> Solution:
    """First three frequencies on three meshes; order from their differences, free of any reference."""
    found = np.array([natural_frequencies(shells(mesh))[0] for mesh in MESHES])
    steps = np.abs(np.diff(found, axis=0))
    orders = np.log2(steps[0] / steps[1])
    figure = "plate_frequencies"
    rows: list[Row] = []
    for mode, (thick, thin) in enumerate(zip(MINDLIN, KIRCHHOFF, strict=True)):
        for mesh, values in zip(MESHES[1:], found[1:], strict=True):
            name = f"frequency {mode + 1}, {mesh[0]} x {mesh[1]}"
            rows.append(matches(name, float(values[mode]), thick, "Hz", 1.0, RITZ, "", figure))
        name = f"frequency {mode + 1}, {mesh[0]} x {mesh[1]}, thin plate"
        rows.append(matches(name, float(found[-1, mode]), thin, "Hz", None, THIN, "", figure))
    for mode in (0, 2):
        name = f"order of convergence of frequency {mode + 1}"
        rows.append(
            near(name, float(orders[mode]), 2.0, "", 0.3, "second-order element; from three meshes", "", figure)
        )
    curves = [
        Curve(f"mode {mode + 1}", [m[0] for m in MESHES], 100.0 * (found[:, mode] / MINDLIN[mode] - 1.0))
        for mode in range(3)
    ]
    panel = Panel("elements along the length", "frequency / Mindlin Ritz - 1 [%]", curves, band=(-1.0, 1.0))
    last = ", ".join(f"{value:.2f}" for value in found[-1])
    caption = (
        f"First three frequencies of the clamped plate from the assembled shell operator: {last} Hz on 100 x 80. "
        f"Orders of "
        f"convergence {', '.join(f'{order:.2f}' for order in orders)}; grey ±1 % of Mindlin Ritz."
    )
    return Solution(tuple(rows), (Picture(figure, draw(panel), caption),))


def solve_step(kind: str, _: Computed) -> Solution:
    """Centre displacement under a held load; linear: under a thousandth of it, scaled up."""
    runs = {mesh: step_response(mesh, LINEAR if kind == "linear" else 1.0) for mesh in MESHES[1:]}
    figure = f"plate_step_{kind}"
    rows = [
        below(
            f"{kind} step response, {m[0]} x {m[1]}, {label}: RMS of peak",
            off_reference(*run, column),
            gate,
            "%",
            STEP_SOURCE,
            "",
            figure,
        )
        for m, run in runs.items()
        for column, (label, gate) in OTHERS[kind].items()
    ]
    gated = [row for row in rows if row.tolerance is not None]
    off = ", ".join(f"{row.ours:.2f} %" for row in gated)
    caption = (
        f"{FORCE / 1e3:g} kN held on the central 100 x 100 mm, {kind}: RMS {off} of the peak on 50 x 40 and 100 x 80."
    )
    return Solution(tuple(rows), (Picture(figure, _step_picture(kind, runs), caption),))


def _step_picture(kind: str, runs: Mapping[tuple[int, int], tuple[Array, Array]]) -> Figure:
    """All solutions on the finest mesh, and every mesh's distance from the first of them."""
    curves = []
    for number, (column, (label, _)) in enumerate(OTHERS[kind].items()):
        t, expected = reference(column)
        curves.append(Curve(label, 1e3 * t, 1e3 * expected, truth=number == 0))
    time, w = runs[MESHES[-1]]
    curves.append(Curve("birdstrike 100 x 80", 1e3 * time, 1e3 * w))
    first, (truth, _) = next(iter(OTHERS[kind].items()))
    t, expected = reference(first)
    residuals = [
        Curve(f"{m[0]} x {m[1]}", 1e3 * t, 100.0 * (np.interp(t, *run) - expected) / expected.max())
        for m, run in runs.items()
    ]
    band = (-1.0, 1.0) if kind == "linear" else (-2.0, 2.0)
    return draw(
        Panel("time [ms]", "centre displacement [mm]", curves),
        Panel("time [ms]", f"off {truth.split()[0]} [% of peak]", residuals, band=band),
    )


ABOUT = "525 x 430 x 10 mm, E 71 GPa, nu 0.3, 2780 kg/m³, all edges clamped, elastic and undamped."
PROBLEMS = (
    Problem("plate_frequencies", "Clamped plate", ABOUT, solve_frequencies),
    Problem("plate_step_linear", "Clamped plate", "", partial(solve_step, "linear")),
    Problem("plate_step_large", "Clamped plate", "", partial(solve_step, "large")),
)
