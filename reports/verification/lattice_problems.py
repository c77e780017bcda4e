"""SPH on its lattices: kernel moments, and convergence of a sound wave."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import quad

from birdstrike.reports.verification.columns import SEED, SMOOTHING, advance, periodic_bird
from birdstrike.reports.verification.draw import Curve, Panel, draw, slope_line
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import Row, below, matches, near
from birdstrike.solver.bird.shape import lattice, slope_gain
from birdstrike.solver.kernels.smoothing import slope, slope_constant, wendland

DEFINITION = "definition of a smoothing kernel"
SPACING = 5e-3
CELLS = (8, 16, 32)
ORDER = 0.3  # how far an observed order may be from 2


def kernel_moments(_: Strikes) -> Outcome:
    """Integral of W in the continuum; sums of V W and of -V r grad W on the lattices at h = 1.2 spacings."""
    volume, _error = quad(lambda q: 4.0 * np.pi * q**2 * wendland(q, 1.0), 0.0, 2.0)
    rows = [near("integral of W", float(volume), 1.0, "", 1e-10, DEFINITION)]
    for kind in ("fcc", "cubic"):
        points = lattice(1.0, kind, np.full(3, 4.0))
        r = np.linalg.norm(points, axis=1)
        weights = np.array([wendland(d / SMOOTHING, SMOOTHING) for d in r])
        slopes = np.array([slope(d / SMOOTHING, slope_constant(SMOOTHING)) for d in r])
        second = -slope_gain(kind, SMOOTHING) * np.einsum("a,ai,aj->ij", slopes, points, points)
        sources = (DEFINITION, "sum over the lattice, h = 1.2 spacings")
        rows.append(matches(f"sum of V W, {kind}", float(weights.sum()), 1.0, "", 2.5, *sources))
        rows.append(below(f"sum of V W r, {kind}", float(np.abs(weights @ points).max()), 1e-12, "", *sources))
        off = float(np.abs(second - np.eye(3)).max())
        rows.append(below(f"-sum of V r grad W - 1, {kind}", off, 1e-12, "", DEFINITION, "gradient with its gain"))
    return Outcome(tuple(rows))


def sound_speed(cells: int) -> float:
    """Of a standing wave of one box length [m/s], from its quarter period."""
    unbroken = replace(SEED, pressure_cutoff=-1e9)
    bird, box = periodic_bird((cells, 3, 3), SPACING, (0, 1, 2), unbroken, (0.0, 0.0))
    k = 2.0 * np.pi / box[0]
    shape = np.sin(k * bird.x[: bird.n, 0])
    bird.v[: bird.n, 0] = 0.05 * shape
    bird.refresh_images()
    dt = 0.4 * bird.stable_step(SEED.eos.sound_speed)
    amplitude: list[float] = []
    while not amplitude or amplitude[-1] > 0.0:
        advance(bird, dt, first=not amplitude)
        amplitude.append(float(shape @ bird.v[: bird.n, 0]))
    a, b = amplitude[-2:]
    return 0.5 * np.pi / (k * (len(amplitude) - 1.5 + a / (a - b)) * dt)


def convergence(
    name: str, measure: Callable[[int], float], truth: float, unit: str, ceiling: float, source: str
) -> Outcome:
    """Value at the finest lattice and order of convergence between the last two, per cells along the wave."""
    values = [measure(cells) for cells in CELLS]
    errors = [abs(value / truth - 1.0) for value in values]
    order = float(np.log2(errors[-2] / errors[-1]))
    figure = name.replace(" ", "_")
    rows: tuple[Row, ...] = (
        matches(f"{name}, {CELLS[-1]} cells a wave", values[-1], truth, unit, ceiling, source, "", figure),
        near(f"order of convergence of the {name}", order, 2.0, "", ORDER, "second-order scheme", "", figure),
    )
    panel = Panel(
        "lattice cells a wavelength",
        f"error of the {name} [%]",
        (
            slope_line(CELLS, 100.0 * errors[0], -2.0),
            Curve("birdstrike", CELLS, [100.0 * error for error in errors]),
        ),
        log=True,
    )
    misses = ", ".join(f"{100.0 * error:.2g} %" for error in errors)
    caption = (
        f"The {name} against {truth:g} {unit} with {CELLS} FCC cells a wavelength: off by {misses}; order {order:.2f}."
    )
    return Outcome(rows, (Picture(figure, draw(panel), caption),))


def solve_sound(_: Strikes) -> Outcome:
    """Quarter period of a standing wave."""
    return convergence("sound speed", sound_speed, SEED.eos.sound_speed, "m/s", 0.5, "c = C of the equation of state")


ABOUT = (
    "Moments of the kernel, and waves on a periodic lattice (no edges, so that only the scheme's own error is seen)."
)
PROBLEMS = (
    Problem("kernel_moments", "SPH", ABOUT, kernel_moments),
    Problem("sound_wave", "SPH", "", solve_sound),
)
