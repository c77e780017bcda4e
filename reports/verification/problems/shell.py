"""Rows of curved shells: the Scordelis-Lo roof, the pinched hemisphere, and an impact on a curved panel."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Row, Solution, below, matches, shown
from birdstrike.reports.verification.problems.plate import Compared
from birdstrike.reports.verification.runs import RunSpec
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import cylindrical_panel, plate_mesh, shell_mesh
from birdstrike.solver.target.modes import static_deflection
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial

ROOF = 0.3024  # deflection of the free edge's middle
HEMISPHERE = 0.0940  # displacement under each load


def scordelis_lo_plate(elements: int) -> tuple[Target, Array, int]:
    """The roof of A. C. Scordelis & K. S. Lo, J. Am. Concrete Inst. 61 (1964) 539, with its load and its read node.

    Radius 25, length 50, thickness 0.25, half angle 40 degrees, E 4.32e8, nu 0, weight 90 per area; the curved ends
    rest on diaphragms that hold x and z. `elements` along each of arc and length of the whole roof.
    """
    arc = 25.0 * np.radians(80.0)
    mesh = cylindrical_panel(arc, 50.0, 25.0, (elements, elements))
    plate = plate_of(mesh, 0.25, ShellMaterial(4.32e8, 0.0, 1.0), "free")
    along = mesh.surface[:, 1]
    ends = np.flatnonzero(np.isclose(np.abs(along), 25.0))
    plate.supports.hold_globally(ends, 1 | 4)
    plate.supports.hold_globally(ends[:1], 2)
    load = np.zeros_like(plate.x)
    load[:, 2] = -90.0 * plate.mass / 0.25
    read = np.flatnonzero(np.isclose(along, 0.0) & np.isclose(mesh.surface[:, 0], 0.5 * arc))
    return plate, load, int(read[0])


def scordelis_lo(elements: int = 32) -> Compared:
    """Vertical deflection at the middle of the roof's free edge against R. H. MacNeal & R. L. Harder's 0.3024.

    Finite Elements in Analysis and Design 1 (1985) 3. The static solution of the loop's own stiffness.
    """
    plate, load, read = scordelis_lo_plate(elements)
    moved = plate.supports.axes[read].T @ static_deflection(plate, load)[read, :3]
    return Compared(np.array([-moved[2]]), np.array([ROOF]))


def pinched_hemisphere(elements: int = 16) -> Compared:
    """Displacement under the radial loads of a hemisphere with an 18 degree hole; MacNeal & Harder (1985): 0.0940.

    Radius 10, thickness 0.04, E 6.825e7, nu 0.3, four loads of 2 at the equator, in and out by turns. `elements` along
    each quarter of a meridian and of the equator.
    """
    n = elements
    polar, round_ = np.linspace(np.radians(18.0), 0.5 * np.pi, n + 1), 0.5 * np.pi * np.arange(4 * n) / n
    theta, phi = np.meshgrid(polar, round_, indexing="ij")
    nodes = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    number = np.arange(4 * n * (n + 1)).reshape(n + 1, 4 * n)
    above, below = number[:-1], number[1:]
    quads = np.stack([above, below, np.roll(below, -1, 1), np.roll(above, -1, 1)], axis=-1).reshape(-1, 4)
    mesh = shell_mesh(10.0 * nodes.reshape(-1, 3), quads)
    plate = plate_of(mesh, 0.04, ShellMaterial(6.825e7, 0.3, 1.0), "free")
    quarters = number[n, [0, n, 2 * n, 3 * n]]
    for node, bits in zip(quarters[:3], (2 | 4, 1, 2), strict=True):
        plate.supports.hold_globally(np.array([node]), bits)
    load = np.zeros_like(plate.x)
    load[quarters, [0, 1, 0, 1]] = 2.0, -2.0, -2.0, 2.0
    axes = plate.supports.axes[quarters]
    moved = np.einsum("nji,nj->ni", axes, static_deflection(plate, load)[quarters, :3])
    return Compared(np.abs(moved[[0, 1, 2, 3], [0, 1, 0, 1]]), np.full(4, HEMISPHERE))


def spinning_shell(turns: float = 1.0, steps: int = 20_000) -> tuple[float, float]:
    """Change of the stress resultants and of the energy of a stressed shell over `turns` about an oblique axis.

    Velocities and positions are the exact rigid motion's at every step, half steps between. Returns the largest change
    of any resultant over the largest resultant, and the work of the stresses over the energy that they hold.
    """
    metal = ShellMaterial(71e9, 0.3, 2780.0)
    mesh = plate_mesh(0.2, 0.15, (6, 5))
    plate = plate_of(mesh, 0.004, metal, "free")
    plate.x[:] += np.random.default_rng(3).normal(0.0, 1e-3, plate.x.shape)
    home, stress = plate.x.copy(), np.array([80e6, -30e6, 20e6])
    plate.shells.stress += stress
    plate.update_forces(0.0)
    start = plate.shells.resultant.copy()
    axis = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    dt = 1e-6
    angle = 2.0 * np.pi * turns / steps
    done = 0.0
    for step in range(1, steps + 1):
        half, whole = rotation(axis, (step - 0.5) * angle), rotation(axis, step * angle)
        plate.x[:], plate.omega[:] = home @ whole.T, angle / dt * axis
        plate.v[:] = np.cross(angle / dt * axis, home @ half.T)
        plate.update_forces(dt)
        done += float(plate.shells.work.sum())
    held = 0.5 * (stress[0] ** 2 + stress[1] ** 2 - 0.6 * stress[0] * stress[1] + 2.6 * stress[2] ** 2) / 71e9
    change = np.abs(plate.shells.resultant - start).max() / np.abs(start).max()
    return float(change), done / (held * 0.004 * float(plate.shells.shape[:, 4].sum()))


def rotation(axis: Array, angle: float) -> Array:
    """Matrix of a turn about a unit axis."""
    k = np.cross(axis, np.eye(3)).T
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


ROOFS, HEMISPHERES = (8, 16, 32), (4, 8, 16)
MACNEAL = "R. H. MacNeal & R. L. Harder, Finite Elements in Analysis and Design 1 (1985) 3"
FLAT = RunSpec(
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


def solve_shells(_: Computed) -> Solution:
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
    return Solution(tuple(rows), (Picture(figure, draw(panel), caption),))


def solve_panel(computed: Computed) -> Solution:
    """Energy balance of an impact on the panel and on the flat plate, and the change of deflection by curvature."""
    figure, rows = "curved_panel", []
    names = {f"panel of radius {RADIUS}": CURVED, "flat plate": FLAT}
    for name, spec in names.items():
        s = computed[spec].summary
        worst = 100.0 * s["worst_energy_error"]
        peak = 1e3 * s["peak"]["displacement_centre"]["value"]
        balance = "energies, each from its own rate"
        rows += [
            below(f"{name}: linear momentum", s["momentum_error"], 1e-10, "", "conservation", "of the bird's"),
            below(f"{name}: energy, worst instant", worst, 1.0, "%", balance, "of the normal kinetic energy"),
            shown(f"{name}: peak centre displacement", peak, "mm", "our run", "", figure),
        ]
    runs = {name: computed[spec] for name, spec in names.items()}
    panels = [
        Panel("time [ms]", label, [Curve(n, 1e3 * r.time, scale * r.channels[channel]) for n, r in runs.items()])
        for channel, label, scale in (
            ("displacement_centre", "centre displacement [mm]", 1e3),
            ("contact_force", "contact force [kN]", 1e-3),
        )
    ]
    peaks = [row.ours for row in rows if row.error_unit == "mm"]
    caption = (
        f"One impact, 500 particles, on a panel of radius {RADIUS} and on the flat plate: "
        f"peaks {peaks[0]:.2f} and {peaks[1]:.2f} mm."
    )
    return Solution(tuple(rows), (Picture(figure, draw(*panels), caption),))


ABOUT = (
    "Static solutions of the very stiffness that the time loop uses. Roof: radius 25, length 50, thickness 0.25, own "
    "weight, on diaphragms. Hemisphere: radius 10, thickness 0.04, 18° hole, four radial loads in and out by turns."
)
PROBLEMS = (
    Problem("curved_shells", "Curved shells", ABOUT, solve_shells),
    Problem("curved_panel", "Curved shells", "", solve_panel, (CURVED, FLAT)),
)
