"""Targets of several parts: a stiffened panel against OpenRadioss, a plate set in motion, the laws of metals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd

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
    rms_of_peak,
    shown,
)
from birdstrike.reports.verification.runs import RunSpec, momentum_given
from birdstrike.solver.kernels.target.metal import WEAR
from birdstrike.solver.target.assembled import LinkData, PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.links.ties import TieData
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.part_mesh import PartMesh
from birdstrike.solver.target.point import Layer
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial
from birdstrike.solver.target.supports import NAMED

RATES = "energies, each from its own rate"
SOURCE = "OpenRadioss, 5 mm shells (simulated): data/reference/openradioss_panel_finer.csv"
MESH = "OpenRadioss's own 10 mm mesh against its 5 mm one"
PANEL = RunSpec("openradioss_panel")
FINER = PANEL.with_(target__generator__element_size="5 mm", bird__particles="6076")
SENSORS = ("w_centre", "w_x60", "w_x100", "w_y120", "u_blade", "w_blade")
W_TOLERANCE, J_TOLERANCE = 5.0, 2.0  # %


def panel_reference(name: str) -> pd.DataFrame:
    """OpenRadioss's curves: time in ms, displacements in mm, momentum in N s."""
    return pd.read_csv(REFERENCE / f"{name}.csv", comment="#")


def solve_panel(computed: Computed) -> Solution:
    """Displacements' RMS in % of the finer reference's peak, momentum's largest difference, both on two meshes."""
    truth, coarse = panel_reference("openradioss_panel_finer"), panel_reference("openradioss_panel")
    time = truth["time [ms]"].to_numpy()
    rows: list[Row] = []
    for size, spec in (("5 mm", FINER), ("10 mm", PANEL)):
        run, judged = computed[spec], size == "5 mm"
        for name in SENSORS:
            expected = truth[f"{name} [mm]"].to_numpy()
            error = rms_of_peak(1e3 * run.at(name, 1e-3 * time), expected)
            theirs = rms_of_peak(np.interp(time, coarse["time [ms]"], coarse[f"{name} [mm]"]), expected)
            note = f"{MESH}: {theirs:.1f} %"
            tolerance = W_TOLERANCE if judged else None
            rows.append(below(f"{size} shells: {name}, RMS of peak", error, tolerance, "%", SOURCE, note, "panel"))
        given = np.interp(1e-3 * time, run.time, momentum_given(run))
        expected = truth["impulse_z [N s]"].to_numpy()
        apart = 100.0 * float(np.abs(given - expected).max()) / float(expected[-1])
        tolerance = J_TOLERANCE if judged else None
        rows.append(below(f"{size} shells: momentum given, largest difference", apart, tolerance, "%", SOURCE))
        summary = run.summary
        energy = 100.0 * summary["worst_energy_error"]
        rows.append(below(f"{size} shells: energy, worst instant", energy, 1.0, "%", RATES))
        rows.append(below(f"{size} shells: linear momentum", summary["momentum_error"], 1e-10, "", "conservation"))
        rows.append(shown(f"{size} shells: particles squeezed through", summary["squeezed_through"], "", "none may be"))
    panels = [
        Panel(
            "time [ms]",
            f"{name} [mm]",
            (
                Curve("OpenRadioss, 5 mm", time, truth[f"{name} [mm]"].to_numpy(), truth=True),
                Curve("birdstrike, 5 mm", time, 1e3 * computed[FINER].at(name, 1e-3 * time)),
                Curve("birdstrike, 10 mm", time, 1e3 * computed[PANEL].at(name, 1e-3 * time)),
            ),
        )
        for name in ("w_centre", "u_blade")
    ]
    caption = "A skin with two blades struck between them at 100 m/s: centre, and a blade's free edge sideways."
    return Solution(tuple(rows), (Picture("panel", draw(*panels), caption),))


IMPULSE_SOURCE = "OpenRadioss, QEPH shells on the same mesh (simulated): data/reference/openradioss_plate_impulse.csv"
PREDICTABLE = 1.25  # ms, until which the codes' meshes agree


FLAT = {"kind": "stiffened_panel", "length": "420 mm", "width": "420 mm", "stiffeners": 0}
PERFECT = {"law": "bilinear", "young": "73 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "345 MPa"}


FREE_OF_LINKS = LinkData()


def impulse_mesh(size: str = "10 mm") -> PartMesh:
    """The clamped plate's mesh, 42 x 42 shells or others."""
    return GENERATORS.validate(FLAT | {"element_size": size}).mesh()


def impulse_target(mesh: PartMesh | None = None, links: LinkData = FREE_OF_LINKS) -> Target:
    """The clamped plate as a target of one part or several of one metal."""
    mesh = impulse_mesh() if mesh is None else mesh
    data = dict.fromkeys(mesh.parts, PartData(0.006, TARGET_LAWS.validate(PERFECT)))
    return assembled(mesh, data, {"edges": NAMED["clamped"]}, links=links)


def in_triangles(mesh: PartMesh) -> PartMesh:
    """Every quadrilateral cut along the same diagonal."""
    quads = mesh.quads
    halves = np.stack([quads[:, [0, 1, 2, 2]], quads[:, [0, 2, 3, 3]]], axis=1).reshape(-1, 4)
    return replace(mesh, quads=halves, part=np.repeat(mesh.part, 2))


def in_two(mesh: PartMesh, tied: bool) -> PartMesh:
    """Halves of two parts, x < 0 and x > 0, on common nodes, or each with its own along the joint, the set `joint`."""
    right = mesh.nodes[mesh.quads, 0].mean(axis=1) > 0.0
    halves = replace(mesh, part=right.astype(np.int64), parts=("left", "right"))
    if not tied:
        return halves
    joint = np.flatnonzero(np.abs(mesh.nodes[:, 0]) < 1e-9)
    twin = np.arange(len(mesh.nodes))
    twin[joint] = len(mesh.nodes) + np.arange(len(joint))
    quads = mesh.quads.copy()
    quads[right] = twin[quads[right]]
    own = twin[joint]
    sets = {"edges": np.concatenate([mesh.sets["edges"], own[np.isin(joint, mesh.sets["edges"])]]), "joint": own}
    return replace(halves, nodes=np.vstack([mesh.nodes, mesh.nodes[joint]]), quads=quads, sets=sets)


def impulse_plate() -> Target:
    """The same as a plate of one block, whose rotary inertia is the physical one."""
    return plate_of(plate_mesh(0.42, 0.42, (42, 42)), 0.006, ShellMaterial(73e9, 0.3, 2780.0, 345e6))


def set_in_motion(plate: Target, end: float = 2e-3) -> tuple[Array, dict[str, Array]]:
    """Time [s] and deflections [m] of the centre and of a point 100 mm beside it, from a start at 40 m/s."""
    plate.v[~plate.fixed, 2] = -40.0
    places = {"centre": 0.0, "x100": 0.1}
    read = [int(np.argmin(np.hypot(plate.x[:, 0] - x, plate.x[:, 1]))) for x in places.values()]
    still, steps = np.zeros_like(plate.x), math.ceil(end / (0.9 * plate.stable_step()))
    dt, moved = end / steps, np.zeros((steps + 1, 2))
    for k in range(steps + 1):
        moved[k] = -plate.x[read, 2]
        plate.update_forces(dt if k else 0.0)
        plate.kick_and_drift(dt, dt, still)  # the given velocity is that of the first half step
    return np.arange(steps + 1) * dt, dict(zip(places, moved.T, strict=True))


def solve_impulse(_: Computed) -> Solution:
    """RMS of the peak until 1.25 ms, judged; what follows depends on the mesh in both codes, and is shown."""
    table = panel_reference("openradioss_plate_impulse")
    clock = table["time [ms]"].to_numpy()
    rows: list[Row] = []
    curves: list[Curve] = []
    where, late = "plate_impulse", "after 1.25 ms the curve depends on the mesh in both codes: not predictable"
    physical = "physical rotary inertia, as a [plate] has it"
    for plate, kind in ((impulse_target(), ""), (impulse_plate(), ", as a plate")):
        time, deflections = set_in_motion(plate)
        for name, ours in deflections.items():
            truth = table[f"qeph42_{name} [mm]"].to_numpy()
            found = np.interp(1e-3 * clock, time, 1e3 * ours)
            early = clock <= PREDICTABLE
            error, after = (
                100.0 * float(np.sqrt(np.mean((found - truth)[seen] ** 2)) / truth.max())
                for seen in (early, ~early & (clock <= 1e3 * time[-1]))
            )
            place = ("centre" if name == "centre" else "100 mm beside it") + kind
            limit, note = (None, physical) if kind else (1.0, "")
            rows.append(below(f"{place}: RMS of peak until 1.25 ms", error, limit, "%", IMPULSE_SOURCE, note, where))
            if not kind:
                rows.append(below(f"{place}: RMS of peak afterwards", after, None, "%", IMPULSE_SOURCE, late, where))
                curves.append(Curve(f"OpenRadioss, {place}", clock, truth, truth=True))
                curves.append(Curve(f"birdstrike, {place}", clock, found))
    rows += _triangles(table)
    finer = table["qeph84_centre [mm]"].to_numpy()
    curves.append(Curve("OpenRadioss, 84 x 84, centre", clock, finer, truth=True))
    figure = draw(Panel("time [ms]", "deflection [mm]", tuple(curves)))
    caption = (
        "A clamped plate without hardening set in motion at 40 m/s (no bird). From 1.25 ms on, dished and near "
        "snapping through, it follows its mesh: Symonds & Yu, J. Appl. Mech. 52 (1985) 517."
    )
    return Solution(tuple(rows), (Picture("plate_impulse", figure, caption),))


def _triangles(table: pd.DataFrame) -> list[Row]:
    """The same plate in triangles, on the mesh of each of OpenRadioss's two."""
    clock = table["time [ms]"].to_numpy()
    early = clock <= PREDICTABLE
    theirs = {
        size: table[f"qeph{cells}_centre [mm]"].to_numpy()[early] for size, cells in (("10 mm", 42), ("5 mm", 84))
    }
    apart = rms_of_peak(theirs["10 mm"], theirs["5 mm"])
    note = f"OpenRadioss's own two meshes of quadrilaterals differ by {apart:.1f} %"
    source = "OpenRadioss, QEPH shells (simulated): data/reference/openradioss_plate_impulse.csv"
    rows: list[Row] = []
    for size, truth in theirs.items():
        time, deflections = set_in_motion(impulse_target(in_triangles(impulse_mesh(size))), 1e-3 * PREDICTABLE)
        found = {name: np.interp(1e-3 * clock[early], time, 1e3 * w) for name, w in deflections.items()}
        limit = 1.0 if size == "5 mm" else None
        name = f"triangles in {size} squares"
        error, peak = rms_of_peak(found["centre"], truth), float(found["centre"].max())
        rows.append(below(f"{name}, centre: RMS of peak until 1.25 ms", error, limit, "%", source, note))
        rows.append(matches(f"{name}, centre: peak", peak, float(truth.max()), "mm", 1.0, source))
        if size == "10 mm":
            beside = rms_of_peak(found["x100"], table["qeph42_x100 [mm]"].to_numpy()[early])
            rows.append(below(f"{name}, 100 mm beside it: RMS of peak until 1.25 ms", beside, 1.0, "%", source))
    return rows


def solve_split(_: Computed) -> Solution:
    """The plate of the impulse problem in two parts against one: on common nodes, and tied along the joint."""
    whole = set_in_motion(impulse_target(), 1e-3 * PREDICTABLE)[1]
    rows: list[Row] = []
    tie = LinkData({"seam": TieData("joint", "left", 1e-4)})
    for tied, name, limit in ((False, "two parts on common nodes", 1e-12), (True, "two parts, tied", 1e-2)):
        plate = impulse_target(in_two(impulse_mesh(), tied), tie if tied else LinkData())
        split = set_in_motion(plate, 1e-3 * PREDICTABLE)[1]
        for place, truth in whole.items():
            apart = float("inf")
            if len(split[place]) == len(truth):
                apart = float(np.abs(split[place] - truth).max() / truth.max())
            where = "centre" if place == "centre" else "100 mm beside it"
            rows.append(below(f"{name}, {where}: largest difference", apart, limit, "of peak", "the plate of one part"))
    return Solution(tuple(rows))


ALUMINIUM = {"young": "73 GPa", "poisson": 0.3, "density": "2780 kg/m^3"}
POWER = ALUMINIUM | {"law": "power", "a": "350 MPa", "b": "426 MPa", "n": 0.34}
TITANIUM = {"law": "johnson_cook", "young": "112.2 GPa", "poisson": 0.339, "density": "4428 kg/m^3"}
TITANIUM |= {"a": "1098 MPa", "b": "1092 MPa", "n": 0.93, "D": [-0.09, 0.25, -0.5, 0.014, 3.87]}
SOFTENING = ALUMINIUM | {"law": "bilinear", "yield_stress": "345 MPa", "failure_strain": 0.05}
SOFTENING |= {"fracture_energy": "20 kN/m"}
HOT = {"c": 0.0, "m": 1.1, "melt": "1878.15 K", "specific_heat": "560 J/kg/K", "start": "500 K"}
CLOSED = "closed form"


def solve_laws(_: Computed) -> Solution:
    """Power hardening in shear, Johnson and Cook's rate factor, heat and damage, the fracture energy of all."""
    layer = Layer(TARGET_LAWS.validate(POWER).row())
    for _step in range(40):
        layer.strain(np.array([0.0, 0.0, 0.002]))
    truth = (350e6 + 426e6 * layer.eps_p**0.34) / math.sqrt(3.0)
    rows = [matches("power law, shear stress", 1e-6 * layer.stress[2], 1e-6 * truth, "MPa", 1e-4, CLOSED)]
    total = layer.stress[2] / (73e9 / 2.6) + math.sqrt(3.0) * layer.eps_p
    rows.append(matches("power law, elastic and plastic shear together", total, 0.08, "", 1e-4, CLOSED))
    for name, path, mean in (("shear", [0.0, 0.0, 1.0], 0.0), ("equal biaxial tension", [1.0, 1.0, 0.0], 2.0 / 3.0)):
        layer = Layer(TARGET_LAWS.validate(TITANIUM | {"c": 0.0}).row())
        while layer.memory[WEAR] < 0.9:
            layer.strain(2e-4 * np.array(path))
        truth = -0.09 + 0.25 * math.exp(-0.5 * mean)
        ours = float(layer.eps_p / layer.memory[WEAR])
        rows.append(matches(f"Johnson-Cook strain at fracture, {name}", ours, truth, "", 1e-4, CLOSED))
    layer, dt = Layer(TARGET_LAWS.validate(TITANIUM | {"c": 0.014}).row()), 5e-7
    before = 0.0
    for _step in range(120):
        before = layer.eps_p
        layer.strain(np.array([0.0, 0.0, 1e3 * dt]), dt)
    rate = (layer.eps_p - before) / dt
    truth = (1098e6 + 1092e6 * layer.eps_p**0.93) * (1.0 + 0.014 * math.log(rate)) / math.sqrt(3.0)
    rows.append(matches("Johnson-Cook shear at 1000 1/s", 1e-6 * layer.stress[2], 1e-6 * truth, "MPa", 1e-4, CLOSED))
    for size in (4e-3, 2e-3, 1e-3):
        ours = 1e-3 * spent_in_softening(size)
        name = f"fracture energy with {1e3 * size:g} mm shells"
        rows.append(matches(name, ours, 20.0, "kN/m", 2.0, "fracture energy of the case"))
    for kind, beta in (("isotropic", 1.0), ("kinematic", 0.0)):
        ours = 1e-3 * spent_in_softening(2e-3, {"tangent_modulus": "5 GPa", "beta": beta})
        name = f"fracture energy, {kind} hardening of 5 GPa"
        rows.append(matches(name, ours, 20.0, "kN/m", 2.0, "fracture energy of the case"))
    layer = Layer(TARGET_LAWS.validate(TITANIUM | HOT).row())
    while layer.eps_p == 0.0:
        layer.strain(np.array([0.0, 0.0, 1e-6]))
    truth = 1098.0 * (1.0 - ((500.0 - 298.15) / (1878.15 - 298.15)) ** 1.1) / math.sqrt(3.0)
    rows.append(
        matches("Johnson-Cook first yield in shear at 500 K", 1e-6 * layer.stress[2], truth, "MPa", 0.1, CLOSED)
    )
    return Solution(tuple(rows))


def spent_in_softening(size: float, hardening: dict[str, object] | None = None) -> float:
    """Plastic work per area of crack after failure has begun [J/m^2], of a shell of this size [m]."""
    layer, energy, step = Layer(TARGET_LAWS.validate(SOFTENING | (hardening or {})).row(), size), 0.0, 2e-7 / size
    while not layer.failed:
        before, eps_p = layer.stress[2], layer.eps_p
        layer.strain(np.array([0.0, 0.0, step]))
        growth = (layer.eps_p - eps_p) * (layer.eps_p > 0.05)
        energy += math.sqrt(3.0) * 0.5 * (before + layer.stress[2]) * growth * size
    return float(energy)


SPEEDS = {70: "flat_plate_002_70", 120: "flat_plate_002", 170: "flat_plate_002_170"}
FLAT_PLATE = {speed: RunSpec(case) for speed, case in SPEEDS.items()}
TREND = "peaks linear in speed: abstracts of seed 002's companion papers, steel plates"


def solve_flat_plate(computed: Computed) -> Solution:
    """Peak deflection over speed, judged by its straightness alone; forces shown; load cells against the frame."""
    rows: list[Row] = []
    runs = {speed: computed[spec] for speed, spec in FLAT_PLATE.items()}
    peaks = [float(run.channels["displacement_centre"].max()) for run in runs.values()]
    straight = float(np.corrcoef(list(runs), peaks)[0, 1] ** 2)
    rows.append(Row("r2 of peak deflection over speed", 1.0, straight, "", 1.0 - straight, "", 0.01, TREND))
    for speed, run in runs.items():
        cells = np.sum([run.channels[f"cell_{i}"] for i in range(1, 9)], axis=0)
        frame = run.channels["reaction_force"]
        apart = float(np.abs(cells - frame).max() / np.abs(frame).max())
        rows.append(below(f"{speed} m/s: load cells less the frame's force", apart, 1e-9, "", "sum of the cells"))
        peak = 1e3 * float(run.channels["displacement_centre"].max())
        rows.append(shown(f"{speed} m/s: peak deflection", peak, "mm", "no published figure"))
        rows.append(shown(f"{speed} m/s: peak reaction", 1e-3 * float(frame.max()), "kN", "no published figure"))
        energy = 100.0 * run.summary["worst_energy_error"]
        rows.append(below(f"{speed} m/s: energy, worst instant", energy, 1.0, "%", RATES))
    return Solution(tuple(rows))


ABOUT_FLAT_PLATE = (
    "After seed 002, which prints no dimension, constant or response: all of them are chosen, and only a trend that "
    "its companion papers state is judged."
)
ABOUT_PANEL = (
    "A skin of 500 x 500 x 3 mm with two blades at T-joints, struck by 0.5 kg at 100 m/s, in two codes. "
    "The reference's contact and particle kernel are another code's; its own mesh error stands in the notes."
)
ABOUT_LAWS = "A single layer under plane stress, driven along paths whose stress is known."
PROBLEMS = (
    Problem("panel", "Targets of several parts", ABOUT_PANEL, solve_panel, (PANEL, FINER)),
    Problem("impulse", "Targets of several parts", "", solve_impulse),
    Problem("split", "Targets of several parts", "", solve_split),
    Problem("laws", "Targets of several parts", ABOUT_LAWS, solve_laws),
    Problem(
        "flat_plate_002", "Targets of several parts", ABOUT_FLAT_PLATE, solve_flat_plate, tuple(FLAT_PLATE.values())
    ),
)
