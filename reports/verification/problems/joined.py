"""Joined targets: ties and rivets against their truths, random panels that nothing may cross, the riveted sidewall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from birdstrike.data.histories import Array, Histories, Snapshot
from birdstrike.reports.verification.problem import Computed, Problem, Row, Solution, below, matches, near, shown
from birdstrike.reports.verification.runs import RunSpec
from birdstrike.solver.build import rest_mesh
from birdstrike.solver.target.assembled import LinkData, PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.links.rivets import RivetData
from birdstrike.solver.target.links.ties import TieData
from birdstrike.solver.target.mesh import vector_areas
from birdstrike.solver.target.part_mesh import PartMesh, Patch, merged
from birdstrike.solver.target.part_mesh import Row as RivetRow

ELASTIC = {"law": "bilinear", "young": "70 GPa", "poisson": 0.3, "density": "2700 kg/m^3", "yield_stress": "10000 MPa"}
RIVET = RivetData(2e7, 3e7, 100.0, tension=3500.0, shear=4500.0)
FAMILY = "Targets of several parts"


def strips(parts: dict[str, tuple[tuple[float, float], tuple[float, float], tuple[int, int], float]]) -> PartMesh:
    """Rectangles that share no node, each a part: stretch along x and y [m], shells, height [m]."""
    nodes, quads, part, at = [], [], [], 0
    for number, (x, y, cells, z) in enumerate(parts.values()):
        places = np.meshgrid(np.linspace(*x, cells[0] + 1), np.linspace(*y, cells[1] + 1), indexing="ij")
        points, own, _ = merged([Patch("", np.stack([*places, np.full_like(places[0], z)], axis=-1))])
        nodes.append(points)
        quads.append(own + at)
        part.append(np.full(len(own), number))
        at += len(points)
    ends = np.cumsum([0, *(len(points) for points in nodes)])
    sets = {name: np.arange(ends[i], ends[i + 1]) for i, name in enumerate(parts)}
    return PartMesh(np.concatenate(nodes), np.concatenate(quads), np.concatenate(part), tuple(parts), sets)


def joined(parts: PartMesh, links: LinkData, thickness: float = 2e-3) -> Target:
    """Elastic parts with their links, free in space."""
    metal = TARGET_LAWS.validate(ELASTIC)
    return assembled(parts, dict.fromkeys(parts.parts, PartData(thickness, metal)), {}, 0.0, links)


def solve_ties(_: Computed) -> Solution:
    """A field of constant strain across a tie of meshes that do not match: strains, and forces of the inner nodes."""
    rows: list[Row] = []
    for left, right in ((2, 3), (4, 7)):
        y = (-0.06, 0.06)
        halves = strips({"left": ((-0.06, 0.0), y, (2, left), 0.0), "right": ((0.0, 0.06), y, (3, right), 0.0)})
        target = joined(halves, LinkData({"seam": TieData("right", "left", 1e-4)}))
        assert target.ties is not None
        gradient = np.array([[1e-3, 4e-4, 0.0], [4e-4, -5e-4, 0.0], [0.0, 0.0, 0.0]])
        target.v[:] = target.x @ gradient.T
        target.ties.follow(target.nodes, 0.0)
        target.update_forces(1.0)
        strain = target.shells.strain[:, :3]
        uneven = float(np.abs(strain - strain[0]).max()) / 1e-3
        target.share_forces(np.zeros_like(target.x))
        inner = (np.abs(target.x[:, :2]) < 0.0599).all(axis=1)
        left_over = float(np.abs(target.nodal[inner]).max() / np.abs(target.nodal).max())
        name, source = f"tie of {right} shells onto {left}", "constant strain"
        rows.append(below(f"{name}: strains, largest difference", uneven, 1e-8, "", source, "of the largest"))
        rows.append(below(f"{name}: forces of inner nodes", left_over, 1e-8, "", source, "of the border's"))
    return Solution(tuple(rows))


def solve_rivets(_: Computed) -> Solution:
    """A lap joint drawn off its rivet along the sheets, at 30 degrees, and straight off them."""
    rows: list[Row] = []
    for degrees in (0.0, 30.0, 90.0):
        most, energy = drawn_off(degrees)
        a = np.deg2rad(degrees)
        tension, shear = RIVET.along * np.sin(a), RIVET.across * np.cos(a)
        give = 1.0 / np.hypot(tension / RIVET.tension, shear / RIVET.shear)
        stored = 0.5 * (RIVET.along * np.sin(a) ** 2 + RIVET.across * np.cos(a) ** 2) * give**2
        name = f"lap joint at {degrees:g} degrees"
        load = np.hypot(tension, shear) * give
        rows.append(matches(f"{name}: load at failure", 1e-3 * most, 1e-3 * load, "kN", 1e-6, "strength as stated"))
        rows.append(matches(f"{name}: energy", energy, stored, "J", 0.5, "half of force times give"))
    return Solution(tuple(rows))


def drawn_off(degrees: float, dt: float = 1e-7) -> tuple[float, float]:
    """Largest force [N] of a lap joint's rivet whose strips part steadily, and the energy [J] that it took."""
    y = (-0.01, 0.01)
    parts = strips({"front": ((-0.05, 0.01), y, (6, 2), 0.0), "back": ((-0.01, 0.05), y, (6, 2), -2e-3)})
    row = RivetRow(np.array([[0.0, 0.0, -1e-3]]), ("front", "back"))
    target = joined(parts, LinkData({}, (("row", row, RIVET),)))
    rivets, a = target.rivets, np.deg2rad(degrees)
    assert rivets is not None
    target.v[target.x[:, 2] < -1e-3] = [np.cos(a), 0.0, -np.sin(a)]
    most = energy = 0.0
    while not rivets.lost:
        target.x[:] += dt * target.v
        energy += rivets.update_forces(target.nodes, dt)
        most = max(most, float(np.linalg.norm(rivets.force[0, :3])))
    return most, energy


PANELS = 300
TEARS = 0.5
"""Share of the panels whose metal can tear."""
SHOTS = ", ".join(f'"{0.1 * k:.1f} ms"' for k in range(1, 9))


def random_panel(seed: int) -> RunSpec:
    """A stiffened panel, integral or riveted, struck at 20 to 90 degrees; the size is that of a test."""
    rng = np.random.default_rng(seed)
    generator = {
        "length": f"{rng.uniform(350.0, 500.0):.1f} mm",
        "width": f"{rng.uniform(300.0, 450.0):.1f} mm",
        "element_size": f"{rng.uniform(16.0, 24.0):.1f} mm",
        "stiffeners": str(int(rng.integers(1, 4))),
        "pitch": f"{rng.uniform(90.0, 110.0):.1f} mm",
        "height": f"{rng.uniform(25.0, 50.0):.1f} mm",
    }
    section = rng.choice(["blade", "L", "Z"])
    if section != "blade":
        generator |= {"section": str(section), "flange": f"{rng.uniform(15.0, 30.0):.1f} mm"}
    changes = {}
    if section == "Z":
        generator |= {"foot": "20 mm", "lap": "3 mm", "rivet_pitch": "25 mm"}
        changes = {f"target.rivets.stiffeners.{key}_strength": "4 kN" for key in ("tension", "shear")}
    changes |= {f"target.generator.{key}": value for key, value in generator.items()}
    tears = rng.random() < TEARS
    low, high = (0.8, 1.6) if tears else (2.0, 4.0)
    for part in ("skin", "stiffeners"):
        changes[f"target.parts.{part}.thickness"] = f"{rng.uniform(low, high):.2f} mm"
    if tears:
        changes["target.materials.aluminium.failure_strain"] = f"{rng.uniform(0.05, 0.2):.3f}"
    changes |= {
        "impact.speed": f"{rng.uniform(60.0, 160.0 if tears else 120.0):.1f} m/s",
        "impact.angle": f"{rng.uniform(20.0, 90.0):.1f} deg",
        "impact.offset": f'["{rng.uniform(-50.0, 50.0):.1f} mm", "{rng.uniform(-50.0, 50.0):.1f} mm"]',
        "impact.standoff": "1 mm",
        "bird.particles": "250",
        "time.end": "0.8 ms",
        "time.snapshots": f"[{SHOTS}]",
    }
    for sensor in ("u_blade", "w_blade"):  # whose places are on the blades of the shipped panel
        changes |= {f"sensors.{sensor}.part": "skin", f"sensors.{sensor}.point": '["0 mm", "0 mm", "0 mm"]'}
    return RunSpec("openradioss_panel", tuple(changes.items()))


@dataclass(frozen=True)
class Crossed:
    """Particles that changed sides of a skin: where it is sound, and beside a tear."""

    sound: int
    torn: int


def crossings(spec: RunSpec, run: Histories) -> Crossed:
    """Particles that changed sides of the skin's live facets between two snapshots; those near a tear apart.

    A particle is on the side of the live facet whose centre is nearest, where it lies over it and within two facets of
    it; near a tear is within two facets of one that has gone.
    """
    mesh = rest_mesh(spec.load())
    skin = mesh.quads[mesh.parts["skin"]]
    size = float(np.sqrt(2.0 * np.linalg.norm(vector_areas(mesh.nodes, skin), axis=1).mean()))
    before: Array | None = None
    sound, torn = np.zeros(0, np.bool_), np.zeros(0, np.bool_)
    for snapshot in run.snapshots:
        side, near_tear = sides(skin, snapshot, size)
        if before is None:
            before = np.zeros(len(side))
            sound, torn = np.zeros(len(side), np.bool_), np.zeros(len(side), np.bool_)
        crossed = before * side < 0.0
        sound |= crossed & ~near_tear
        torn |= crossed & near_tear
        before = np.where(side == 0.0, before, side)
    return Crossed(int(sound.sum()), int(torn.sum()))


def sides(skin: NDArray[np.int64], snapshot: Snapshot, size: float) -> tuple[Array, NDArray[np.bool_]]:
    """Side of every particle (n,): 1 towards the impact, -1 behind, 0 where it is over no live facet; near a tear."""
    rows = np.dtype([("", skin.dtype)] * 4)
    alive = np.isin(np.ascontiguousarray(skin).view(rows), np.ascontiguousarray(snapshot.quads).view(rows)).ravel()
    middles = snapshot.nodes[skin].mean(axis=1)
    x = snapshot.particles
    if not alive.any():
        return np.zeros(len(x)), np.ones(len(x), np.bool_)
    away, nearest = KDTree(middles[alive]).query(x)
    facet = np.flatnonzero(alive)[nearest]
    normal = vector_areas(snapshot.nodes, skin[facet])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = ((x - middles[facet]) * normal).sum(axis=1)
    beside = np.sqrt(np.maximum(away**2 - height**2, 0.0))
    over = (beside < 0.7 * size) & (np.abs(height) < 2.0 * size)
    near_tear = np.zeros(len(x), np.bool_)
    if not alive.all():
        near_tear = KDTree(middles[~alive]).query(x)[0] < 3.0 * size
    return np.where(over, np.sign(height), 0.0), near_tear


RANDOM = tuple(random_panel(seed) for seed in range(PANELS))


def solve_random(computed: Computed) -> Solution:
    """No particle crosses live skin on any of the panels, and all balance."""
    sound = torn = squeezed = struck = tore = rivets = 0
    energy = [0.0, 0.0]
    momentum = 0.0
    for spec in RANDOM:
        run = computed[spec]
        crossed, s = crossings(spec, run), run.summary
        sound, torn, squeezed = sound + crossed.sound, torn + crossed.torn, squeezed + s["squeezed_through"]
        opened = s["eroded_shells"] > 0
        tore, struck = tore + opened, struck + (run.channels["contact_force"].max() > 0.0)
        rivets += s.get("broken_rivets", 0)
        linked = opened or "rivets" in s
        energy[linked] = max(energy[linked], 100.0 * s["worst_energy_error"])
        momentum = max(momentum, s["momentum_error"])
    name, none = f"{PANELS} random panels", "none may be"
    return Solution(
        (
            matches(f"{name}: struck", struck, PANELS, "", 0.0, "all of them"),
            shown(f"{name}: of which tore", tore, "", "our runs"),
            shown(f"{name}: rivets that broke", rivets, "", "our runs"),
            below(f"{name}: particles that crossed sound skin", sound, 0.0, "", none),
            shown(f"{name}: particles that passed beside or through a tear", torn, "", "our runs"),
            shown(f"{name}: particles squeezed through a tear's edge", squeezed, "", "our runs", "see run warnings"),
            below(f"{name}: energy, worst, whole and integral", energy[0], 1.0, "%", "energy balance"),
            below(f"{name}: energy, worst, torn or riveted", energy[1], 2.0, "%", "energy balance"),
            below(f"{name}: linear momentum", momentum, 1e-9, "", "conservation"),
        )
    )


AT_3_MS = (("bird.particles", "1500"), ("time.end", "3 ms"), ("time.snapshots", '["3 ms"]'))
SIDEWALL = {
    (constants, speed): RunSpec(f"sidewall_004_{constants}", (("impact.speed", f"{speed} m/s"), *AT_3_MS))
    for constants, speed in (("water", 152), ("water", 120), ("mpa", 152))
}
BEHIND, PERFORATED = 0.15, 1.0
"""How far behind the undeformed skin [m] mass has gone through it, and % of the bird from which on it is perforated."""


def share_behind(spec: RunSpec, run: Histories) -> float:
    """Mass that is far behind the undeformed, curved skin at the last snapshot, % of the bird's."""
    radius = spec.load().plate.radius
    assert radius is not None
    x = run.snapshots[-1].particles
    return 100.0 * float(np.mean(radius - np.hypot(x[:, 0], x[:, 2] + radius) > BEHIND))


def solve_sidewall(computed: Computed) -> Solution:
    """Whether the sidewall is perforated, with its balances; what broke and tore is shown."""
    rows: list[Row] = []
    for (constants, speed), spec in SIDEWALL.items():
        run = computed[spec]
        name, s = f"{constants} constants, {speed} m/s", run.summary
        behind = share_behind(spec, run)
        if constants == "water":
            fitted, wanted = "skin and pad were fitted to this (docs/sidewall.md)", float(speed == 152)
            perforated = float(behind > PERFORATED)
            rows.append(near(f"{name}: perforated (1) or not (0)", perforated, wanted, "", 0.0, fitted))
        rows.append(shown(f"{name}: mass 150 mm behind the skin at 3 ms", behind, "%", "no published figure"))
        rows.append(shown(f"{name}: torn shells", s["eroded_shells"], "", "no published figure"))
        rows.append(shown(f"{name}: rivets that broke, of 174", s["broken_rivets"], "", "no published figure"))
        energy = 100.0 * s["worst_energy_error"]
        rows.append(below(f"{name}: energy, worst instant", energy, 2.0, "%", "energy balance"))
        rows.append(below(f"{name}: linear momentum", s["momentum_error"], 1e-9, "", "conservation"))
    return Solution(tuple(rows))


ABOUT_SIDEWALL = (
    "After seed 004, which prints no dimension and no response. Thickness of skin and pad is fitted to perforation at "
    "152 m/s and none at 120 m/s; that is a fit, not a verification. With the constants as printed (9.3 GPa) the run "
    "is refused by its own energy balance (docs/sidewall.md)."
)
PROBLEMS = (
    Problem("sidewall_004", FAMILY, ABOUT_SIDEWALL, solve_sidewall, tuple(SIDEWALL.values())),
    Problem("ties", FAMILY, "Two halves of a square, meshed apart and tied.", solve_ties),
    Problem("rivets", FAMILY, "", solve_rivets),
    Problem(
        "random_panels",
        FAMILY,
        "Blades, angles and riveted Z stiffeners struck at 20 to 90 degrees, half of them of a metal that can tear.",
        solve_random,
        RANDOM,
    ),
)
