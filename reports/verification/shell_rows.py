"""Rows of curved shells: the Scordelis-Lo roof, the pinched hemisphere, and a strike on a curved panel."""

from __future__ import annotations

from reports.verification.draw import Curve, Panel, draw
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, below, matches, shown
from reports.verification.shell_problems import pinched_hemisphere, scordelis_lo
from reports.verification.shots import Shot

ROOFS, HEMISPHERES = (8, 16, 32), (4, 8, 16)
MACNEAL = "R. H. MacNeal & R. L. Harder, Finite Elements in Analysis and Design 1 (1985) 3"
FLAT = Shot(
    "reference_strike_156mm",
    (
        ("bird.particles", "500"),
        ("plate.elements", "[20, 16]"),
        ("time.end", "1.2 ms"),
        ("time.snapshots", "[]"),
        ("impact.standoff", "2 mm"),
    ),
)
RADIUS = "500 mm"
CURVED = FLAT.with_(plate__radius=RADIUS)


def solve_shells(_: Strikes) -> Outcome:
    """Both benchmarks on three meshes, the finest judged."""
    figure = "curved_shells"
    rows: list[Row] = []
    curves = []
    for name, meshes, solve in (
        ("Scordelis-Lo roof", ROOFS, scordelis_lo),
        ("pinched hemisphere", HEMISPHERES, pinched_hemisphere),
    ):
        found = [solve(elements) for elements in meshes]
        for elements, pair in zip(meshes, found, strict=True):
            worst = int(abs(pair.computed / pair.reference - 1.0).argmax())
            ours, truth = float(pair.computed[worst]), float(pair.reference[worst])
            gate = 3.0 if elements == meshes[-1] else None
            size = f"{elements} x {elements}" + (" a quarter" if name.endswith("hemisphere") else "")
            rows.append(matches(f"{name}, {size}", ours, truth, "", gate, MACNEAL, "", figure))
        errors = [100.0 * (float(pair.computed[0] / pair.reference[0]) - 1.0) for pair in found]
        curves.append(Curve(name, meshes, errors))
    panel = Panel("elements along a side", "displacement / published - 1 [%]", curves, band=(-3.0, 3.0))
    ends = " and ".join(f"{row.error:+.2f} %" for row in rows if row.tolerance is not None)
    caption = f"Displacements of the two shells against the published ones: {ends} on the finest meshes; grey ±3 %."
    return Outcome(tuple(rows), (Picture(figure, draw(panel), caption),))


def solve_panel(strikes: Strikes) -> Outcome:
    """Books of the strike on the panel and on the flat plate, and what curvature does to the deflection."""
    figure, rows = "curved_panel", []
    names = {f"panel of radius {RADIUS}": CURVED, "flat plate": FLAT}
    for name, shot in names.items():
        s = strikes[shot].summary
        worst = 100.0 * s["worst_energy_error"]
        peak = 1e3 * s["peak"]["displacement_centre"]["value"]
        books = "energies, each from its own rate"
        rows += [
            below(f"{name}: linear momentum", s["momentum_error"], 1e-10, "", "conservation", "of the bird's"),
            below(f"{name}: energy, worst instant", worst, 1.0, "%", books, "of the normal kinetic energy"),
            shown(f"{name}: peak centre displacement", peak, "mm", "our run", "", figure),
        ]
    runs = {name: strikes[shot] for name, shot in names.items()}
    panels = [
        Panel("time [ms]", label, [Curve(n, 1e3 * r.time, scale * r.channels[channel]) for n, r in runs.items()])
        for channel, label, scale in (
            ("displacement_centre", "centre displacement [mm]", 1e3),
            ("contact_force", "contact force [kN]", 1e-3),
        )
    ]
    peaks = [row.ours for row in rows if row.error_unit == "mm"]
    caption = (
        f"One strike, 500 particles, on a panel of radius {RADIUS} and on the flat plate: "
        f"peaks {peaks[0]:.2f} and {peaks[1]:.2f} mm."
    )
    return Outcome(tuple(rows), (Picture(figure, draw(*panels), caption),))


ABOUT = (
    "Static solutions of the very stiffness that the time loop uses. Roof: radius 25, length 50, thickness 0.25, own "
    "weight, on diaphragms. Hemisphere: radius 10, thickness 0.04, 18° hole, four radial loads in and out by turns."
)
PROBLEMS = (
    Problem("curved_shells", "Curved shells", ABOUT, solve_shells),
    Problem("curved_panel", "Curved shells", "", solve_panel, (CURVED, FLAT)),
)
