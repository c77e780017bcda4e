"""Decks of Radioss: the starter's file with the whole model, the engine's with the run (format of 2022)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.storage.files import write_atomically
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.reports.export.exported import Export
from birdstrike.reports.export.fixed_columns import card, columns, comments, ten_a_line
from birdstrike.reports.export.model import ShellPart, StrikeModel
from birdstrike.reports.export.numbering import Numbering
from birdstrike.reports.export.radioss_materials import WIDE, bird_lines, metal_lines, remarks_on, shell_lines
from birdstrike.solver.case.plate import PlateMaterial

VERSION = 2022
NAMES = {"t": "Mg", "us": "mus"}
"""Units that Radioss calls otherwise."""
ROOT = re.compile(r"(.+?)(?:_0000)?\.rad")
NONE = 1e-20
"""Written where 0 would mean Radioss's own default."""
PICTURES, TIME_STEP = 20, 0.67
"""Animation files of a run; share of the stable step."""
NEVER_TORN = float(PlateMaterial.model_fields["failure_strain"].default)
"""Failure strain of a plate that never tears: what a case has that states none."""
FLUID_SOLID, HEX_SOLID = 1, 24
"""Isolid: one point with viscous hourglass control, and with physical stabilisation."""
QUADRATIC, LINEAR = 0.75, 0.06
"""Bulk viscosity of hexahedra for a case's shock_quadratic and shock_linear of 1."""


def write_radioss_deck(path: Path, model: StrikeModel, system: UnitSystem, head: Iterable[str]) -> tuple[Path, Path]:
    """NAME_0000.rad and NAME_0001.rad of a path NAME_0000.rad or NAME.rad; their paths. Raises UserError."""
    match = ROOT.fullmatch(path.name)
    if match is None or " " in path.name:
        raise UserError(f"--out {path}: a deck of Radioss is called NAME_0000.rad, without blanks")
    name = match[1]
    starter, engine = path.with_name(f"{name}_0000.rad"), path.with_name(f"{name}_0001.rad")
    write_atomically(starter, starter_deck(model, system, name, head))
    write_atomically(engine, engine_deck(model, system, name))
    return starter, engine


def bird_file(export: Export, system: UnitSystem, effects: Iterable[str] = ()) -> str:
    """/MAT and /EOS of each bird, numbered from 1, to be included in a starter's file of the same units."""
    head = [
        "Bird materials for Radioss (format of 2018 and later), written by birdstrike",
        f"Units {system.name}: {system.sentence}.",
        *export.source,
        "Parts, properties, meshes and contact are yours; refer to these numbers from /PART.",
    ]
    lines = comments("#", head)
    for number, bird in enumerate(export.birds, start=1):
        about = [
            f"Material {number}, {bird.name.replace('_', ' ')}",
            *bird.remarks,
            *remarks_on(bird.material, bird.sph),
        ]
        lines += comments("#", about) + bird_lines(bird.material, bird.density, number, system, bird.sph)
    return "\n".join([*lines, *effects]) + "\n"


def starter_deck(model: StrikeModel, system: UnitSystem, name: str, head: Iterable[str]) -> str:
    """The text of NAME_0000.rad."""
    numbering = Numbering(model)
    sections = (
        _begin(system, name),
        comments("#", [*head, *_remarks(model)]),
        ("/TITLE", f"birdstrike case {model.case.name}"),
        _materials(model, system, numbering),
        _properties(model, system, numbering),
        _parts(model, numbering),
        _nodes(model, system, numbering),
        _elements(model, numbering),
        _supports(model, system, numbering),
        _motion(model, system, numbering),
        _contact(model, system, numbering),
        _histories(model, numbering),
        ("/END",),
    )
    return "\n".join(line for section in sections for line in section) + "\n"


def _remarks(model: StrikeModel) -> Iterator[str]:
    yield from remarks_on(model.case.bird.material, sph=not len(model.bird.cells))
    yield from model.missing
    if model.springs:
        yield (
            "Springs of the supports carry a mass and an inertia of their own, stiffness times step squared, so that "
            "they do not rule the step; a spring far stiffer than the shells makes its nodes heavier by as much."
        )
    if len(model.bird.cells):
        yield "Hexahedra are deleted below the time step that the engine's file names."
    if tearing := [part.name for part in model.parts if part.moves and _failure_strain(part) < NEVER_TORN]:
        yield (
            f"Radioss deletes a shell of {' and '.join(tearing)} with the first of its layers that reaches the failure "
            "strain, birdstrike with the last: where shells bend, they tear earlier here. A /FAIL card of your own can "
            "wait for all layers."
        )
    yield (
        "Contact: penalty springs of the stiffness that birdstrike uses; Radioss stiffens them with the overlap. "
        "Its forces in the time history are impulses: th_to_csv and birdstrike import take their rates."
    )


def _failure_strain(part: ShellPart) -> float:
    found = getattr(part.material, "failure_strain", None)
    return NEVER_TORN if found is None else float(found)


def _begin(system: UnitSystem, name: str) -> Iterator[str]:
    base = system.base
    units = [NAMES.get(base[kind], base[kind]) for kind in ("mass", "length", "time")]
    yield from ("#RADIOSS STARTER", "/BEGIN", name, card(VERSION, 0))
    yield from (card(*units, width=WIDE), card(*units, width=WIDE))


def _materials(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, part in enumerate(model.parts, start=1):
        yield from metal_lines(part.name, part.material if part.moves else None, number, system)
    sph = not len(model.bird.cells)
    yield from bird_lines(model.case.bird.material, model.bird.density, numbering.bird_part, system, sph)


def _properties(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, part in enumerate(model.parts, start=1):
        title = f"{part.name}: QEPH shells, five points"
        yield from shell_lines(title, part.material, part.thickness, number, system)
    yield from _bird_property(model, system, numbering.bird_part)
    for number, springs in zip(numbering.spring_parts, model.springs, strict=True):
        yield from (f"/PROP/SPR_GENE/{number}", "support: springs to the ground")
        yield "#               Mass             Inertia   skew_ID   sens_ID    Isflag     Ifail    Ifail2    Iequil"
        inertia = (system.value(springs.mass, "kg"), system.value(springs.inertia, "kg m^2"))
        yield columns(*((value, WIDE) for value in inertia), *((0, 10) for _ in range(6)))
        translation = [system.value(stiffness, "N/m") for stiffness in springs.translation]
        rotation = [system.value(springs.rotation, "N m/rad")] * 3
        for freedom, stiffness in enumerate([*translation, *rotation], start=1):
            yield f"#                 K{freedom}                  C{freedom}                   A                   B"
            yield card(stiffness, 0.0, 0.0, 0.0, 0.0, width=WIDE)
            yield "#   fct_ID         H   fct_ID2   fct_ID3   fct_ID4                      DeltaMin            DeltaMax"
            yield columns(*((0, 10) for _ in range(5)), (None, 10), (0.0, WIDE), (0.0, WIDE))
            yield "#                  F                   E              Ascale              Hscale"
            yield card(0.0, 0.0, 0.0, 0.0, width=WIDE)
        yield from ("#  Fsmooth                Fcut", columns((0, 10), (0.0, WIDE)))


def _bird_property(model: StrikeModel, system: UnitSystem, number: int) -> Iterator[str]:
    shock = model.case.solver
    if not len(model.bird.cells):
        yield from (f"/PROP/SPH/{number}", "bird: particles of one mass")
        yield "#                 Mp                  qa                  qb            Alpha_cs   skew_ID      h_1D"
        mass = system.value(float(model.bird.masses.mean()), "kg")
        viscosity = (shock.shock_quadratic or NONE, shock.shock_linear or NONE)
        yield columns((mass, WIDE), *((value, WIDE) for value in viscosity), (0.0, WIDE), (0, 10), (0, 10))
        yield "#    Order                   h             Xi_Stab"
        yield columns((0, 10), (system.value(model.bird.smoothing, "m"), WIDE), (0.0, WIDE))
        return
    solid = FLUID_SOLID if model.case.bird.material.build(model.bird.density).strength is None else HEX_SOLID
    yield from (f"/PROP/SOLID/{number}", "bird: hexahedra of one point")
    yield "#   Isolid    Ismstr               Icpre  Itetra10     Inpts   Itetra4    Iframe                  Dn"
    yield columns((solid, 10), (4, 10), (None, 10), *((0, 10) for _ in range(5)), (0.0, WIDE))
    yield "#                 qa                  qb                   h              Lambda                  Mu"
    bulk = (QUADRATIC * shock.shock_quadratic or NONE, LINEAR * shock.shock_linear or NONE)
    yield card(*bulk, 0.0, 0.0, 0.0, width=WIDE)
    yield "#         deltaT_min   Istrain      Ihkt"
    yield columns((0.0, WIDE), (0, 10), (0, 10))


def _parts(model: StrikeModel, numbering: Numbering) -> Iterator[str]:
    names = [*((part.name, i, i) for i, part in enumerate(model.parts, start=1))]
    names.append(("bird", numbering.bird_part, numbering.bird_part))
    for name, prop, material in names:
        yield from (f"/PART/{prop}", name, "#  prop_ID    mat_ID subset_ID               Thick")
        yield card(prop, material, 0)
    for number in numbering.spring_parts:
        yield from (f"/PART/{number}", "support", "#  prop_ID    mat_ID subset_ID               Thick")
        yield card(number, 0, 0)


def _nodes(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    yield from ("/NODE", "#  node_ID                  Xc                  Yc                  Zc")
    metre = system.value(1.0, "m")
    for numbers, points in numbering.blocks_of_nodes(model):
        yield from _points(numbers, points * metre)


def _points(numbers: Iterable[int], points: Array) -> Iterator[str]:
    for number, point in zip(numbers, points, strict=True):
        yield columns((int(number), 10), *((float(c), WIDE) for c in point))


def _elements(model: StrikeModel, numbering: Numbering) -> Iterator[str]:
    for number, part in enumerate(model.parts, start=1):
        triangle = part.quads[:, 2] == part.quads[:, 3]
        for keyword, chosen, corners in (("SHELL", ~triangle, 4), ("SH3N", triangle, 3)):
            if not chosen.any():
                continue
            yield from (f"/{keyword}/{number}", "#  elem_ID  node_ID1  node_ID2  node_ID3  node_ID4")
            for element in np.flatnonzero(chosen):
                yield card(part.first + int(element) + 1, *(int(n) + 1 for n in part.quads[element, :corners]))
    if len(model.bird.cells):
        yield from (f"/BRICK/{numbering.bird_part}", "#  elem_ID  node_ID1 ... node_ID8")
        for number, cell in zip(numbering.cells, model.bird.cells, strict=True):
            yield card(int(number), *(int(numbering.bird[n]) for n in cell))
    else:
        yield from (f"/SPHCEL/{numbering.bird_part}", "#  node_ID")
        yield from (card(int(number)) for number in numbering.bird)
    for part, springs, ground, numbers in zip(
        numbering.spring_parts, model.springs, numbering.ground, numbering.spring_elements, strict=True
    ):
        yield from (f"/SPRING/{part}", "#  elem_ID  node_ID1  node_ID2")
        for number, node, at in zip(numbers, springs.nodes, ground, strict=True):
            yield card(int(number), int(node) + 1, int(at))


def _supports(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, (freedoms, nodes) in enumerate(numbering.held(model), start=1):
        yield from (f"/GRNOD/NODE/{number}", "held nodes", *ten_a_line(nodes))
        digits = ["1" if held else "0" for held in freedoms]
        yield from (f"/BCS/{number}", "support", "#  Tra rot   skew_ID  grnod_ID")
        yield f"   {''.join(digits[:3])} {''.join(digits[3:])}" + card(0, number)
    if model.damping > 0.0:
        group = numbering.target_group
        yield from (f"/GRNOD/PART/{group}", "target", *ten_a_line(range(1, len(model.parts) + 1)))
        yield from ("/DAMP/1", "damping of the target, proportional to mass")
        yield "#              Alpha                Beta  grnod_id   skew_id              Tstart               Tstop"
        alpha = system.value(model.damping, "1/s")
        yield columns((alpha, WIDE), (0.0, WIDE), (group, 10), (0, 10), (0.0, WIDE), (0.0, WIDE))


def _motion(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    group = numbering.bird_group
    yield from (f"/GRNOD/PART/{group}", "bird", card(numbering.bird_part))
    yield from ("/INIVEL/TRA/1", "bird in flight")
    yield "#                 Vx                  Vy                  Vz   Gnod_id   Skew_id"
    velocity = [system.value(float(v), "m/s") for v in model.bird.velocity]
    yield columns(*((v, WIDE) for v in velocity), (group, 10), (0, 10))


def _contact(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, pair in enumerate(model.contacts, start=1):
        yield from (f"/SURF/PART/{number}", "struck surface", *ten_a_line(part + 1 for part in pair.parts))
        yield from (f"/INTER/TYPE7/{number}", "bird on target: penalty, constant gap")
        yield "# grnod_id   surf_id      Istf      Ithe      Igap                Ibag      Idel     Icurv      Iadm"
        flags = (numbering.bird_group, number, 1, 0, 1000)
        yield columns(*((flag, 10) for flag in flags), (None, 10), (0, 10), (2, 10), (0, 10), (0, 10))
        yield "#          Fscalegap             Gap_max             Fpenmax                         Itied"
        yield columns((0.0, WIDE), (0.0, WIDE), (0.0, WIDE), (None, WIDE), (0, 10))
        yield "#              Stmin               Stmax   Percent_mesh_size               dtmin  Irem_gap   Irem_i2"
        yield columns(*((0.0, WIDE) for _ in range(4)), (0, 10), (0, 10))
        yield "#              Stfac                Fric              GAPmin              Tstart               Tstop"
        stiffness, gap = system.value(model.contact_stiffness, "N/m"), system.value(pair.gap, "m")
        yield card(stiffness, model.friction, gap, 0.0, 0.0, width=WIDE)
        yield "#      IBC                        Inacti               VIS_S               VIS_F              Bumult"
        yield columns(("000", 10), (None, WIDE), (6, 10), (0.0, WIDE), (0.0, WIDE), (0.0, WIDE))
        yield "#    Ifric    Ifiltr               Xfreq     Iform   sens_ID   fct_IDF             AscaleF   fric_ID"
        form = ((0, 10), (0, 10), (0.0, WIDE), (2, 10), (0, 10), (0, 10), (0.0, WIDE), (0, 10))
        yield columns(*form)


def _variables(*names: str) -> Iterator[str]:
    yield "#      var       var       var       var       var       var"
    yield "".join(f"{name:<10}" for name in names).rstrip()


def _histories(model: StrikeModel, numbering: Numbering) -> Iterator[str]:
    """Displacements of the sensors' nodes, contact forces, reactions, strains of gauges, momentum of the bird."""
    yield from ("/TH/INTER/1", "contact of the bird", *_variables("FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ"))
    yield from ten_a_line(range(1, len(model.contacts) + 1))
    yield from ("/TH/PART/2", "bird", *_variables("IE", "KE", "XMOM", "YMOM", "ZMOM"))
    yield card(numbering.bird_part)
    nodes = numbering.recorded_nodes(model)
    if nodes:
        yield from ("/TH/NODE/3", "displacement sensors", *_variables("DX", "DY", "DZ"))
        yield from (card(number, 0) + name[:80] for number, name in nodes.items())
    held = numbering.reaction_nodes(model)
    if held:
        yield from ("/TH/NODE/4", "reactions", *_variables("REACX", "REACY", "REACZ"))
        yield from (card(number, 0) + f"held_{number}" for number in held)
    gauges = [sensor for sensor in model.sensors if sensor.element is not None]
    for keyword, chosen in _gauges_by_shape(model, gauges):
        yield from (f"/TH/{keyword}/{5 if keyword == 'SHEL' else 6}", "strain gauges")
        yield from _variables("E1", "E2", "E12", "K1", "K2", "K12")
        yield from (card((sensor.element or 0) + 1) + " " * 10 + sensor.name for sensor in chosen)


def _gauges_by_shape(model: StrikeModel, gauges: list) -> Iterator[tuple[str, list]]:
    triangles = {
        part.first + int(i) for part in model.parts for i in np.flatnonzero(part.quads[:, 2] == part.quads[:, 3])
    }
    for keyword, wanted in (("SHEL", False), ("SH3N", True)):
        chosen = [gauge for gauge in gauges if (gauge.element in triangles) == wanted]
        if chosen:
            yield keyword, chosen


def engine_deck(model: StrikeModel, system: UnitSystem, name: str) -> str:
    """The text of NAME_0001.rad: the run to the case's end, histories at its output interval."""
    end, interval = system.value(model.end, "s"), system.value(model.output_interval, "s")
    lines = [
        *comments("#", ["RADIOSS ENGINE", f"Units {system.name}. Run: starter -i {name}_0000.rad, then the engine."]),
        *(f"/RUN/{name}/1", card(end, width=WIDE)),
        f"/VERS/{VERSION}",
        *("/TFILE/4", card(interval, width=WIDE)),
        "/TH/TITLE",
        *("/DT", f" {TIME_STEP:g} 0."),
        *_deletion(model, system),
        "/PARITH/ON",
        "/PRINT/-100",
        *("/ANIM/DT", card(0.0, end / PICTURES, width=WIDE)),
        *("/ANIM/VECT/VEL", "/ANIM/VECT/CONT", "/ANIM/ELEM/EPSP", "/ANIM/ELEM/VONM"),
    ]
    return "\n".join(lines) + "\n"


def _deletion(model: StrikeModel, system: UnitSystem) -> list[str]:
    """Hexahedra go where their stable step falls below the case's share of the undistorted mesh's smallest."""
    if not len(model.bird.cells):
        return []
    corners = model.bird.points[model.bird.cells]
    edge = np.linalg.norm(corners[:, [1, 3, 4]] - corners[:, [0, 0, 0]], axis=2).min()
    wave = model.case.bird.material.build(model.bird.density).fastest_wave(1e-3)
    least = system.value(model.case.solver.smallest_step * float(edge) / wave, "s")
    return ["/DT/BRICK/DEL", f" {TIME_STEP:g} {least:.6g}"]
