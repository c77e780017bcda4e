"""The whole case as a keyword file of LS-DYNA, in the standard format of columns of eight and ten.

The cards are written here and not by ansys-dyna-core, whose numbers have five digits where the columns hold eight;
ansys-dyna-core is what the tests read them back with.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from birdstrike.data.storage.files import write_atomically
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.reports.export.cards import cards_of, reworded
from birdstrike.reports.export.fixed_columns import card, columns, comments, ten_a_line
from birdstrike.reports.export.lsdyna_materials import keyword_lines, metal_lines
from birdstrike.reports.export.model import StrikeModel, SupportSprings
from birdstrike.reports.export.numbering import Numbering

NONE = 1e-20
"""Written where 0 would mean LS-DYNA's own default."""
QUADRATIC, LINEAR = 0.75, 0.06
"""Bulk viscosity for a case's shock_quadratic and shock_linear of 1: 1.5 and 0.06 for the usual 2 and 1."""
PICTURES, TIME_STEP = 20, 0.67
"""d3plot states of a run; share of the stable step."""
BELYTSCHKO_TSAY, ONE_POINT_SOLID = 2, 1
ERODED_LEAVE = (2, 1)
"""IEROD and ICONT: a particle that erodes acts on none and touches nothing; by 0, their default, it stays active."""
DISPLACED, TURNED = 9001, 9002
"""Sections of the supports' springs."""
DAMPING_CURVE = 9001
BIRD_NODES = 9002
UNIT_NAMES = {"s": "sec", "us": "micro_s", "t": "mtrc_ton"}
"""What *CONTROL_UNITS calls a unit, where that is not its symbol."""
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def write_lsdyna_deck(path: Path, model: StrikeModel, system: UnitSystem, head: Iterable[str]) -> Path:
    """The file, whole or not at all; its path."""
    write_atomically(path, lsdyna_deck_text(model, system, head))
    return path


def lsdyna_deck_text(model: StrikeModel, system: UnitSystem, head: Iterable[str]) -> str:
    """The text of the file."""
    numbering = Numbering(model)
    sections = (
        ("*KEYWORD",),
        comments("$", [*head, *_remarks(model)]),
        ("*TITLE", f"birdstrike case {model.case.name}"[:80]),
        _control(model, system),
        _output(model, system, numbering),
        _parts(model, system, numbering),
        _springs(model, system, numbering),
        _supports(model, system, numbering),
        _motion(model, system, numbering),
        _contact(model, system, numbering),
        _nodes(model, system, numbering),
        _elements(model, system, numbering),
        ("*END",),
    )
    return "\n".join(line for section in sections for line in section) + "\n"


def _remarks(model: StrikeModel) -> Iterator[str]:
    yield from (why for _, why in reworded(model.case.bird.material).values() if " = 0 erodes" not in why)
    yield from model.missing
    yield (
        "Formulations: Belytschko-Tsay shells (ELFORM 2) with five points, "
        + ("one-point solids." if len(model.bird.cells) else "particles by the default SPH (FORM 0).")
    )
    moving = [part for part in model.parts if part.moves]
    radial = [part.name for part in moving if getattr(part.material, "return_mapping", "") == "radial"]
    if radial:
        yield (
            f"The case returns the stress of {', '.join(radial)} radially to the yield surface (return_mapping); these "
            "shells return it to the closest point."
        )
    solver = model.case.solver
    if len(model.bird.cells) and (solver.hourglass is not None or solver.hourglass_coefficient is not None):
        yield "Hourglass control of the bird is this code's own (HGID 0), not the case's solver.hourglass."
    yield "Contact: AUTOMATIC_NODES_TO_SURFACE with SOFT = 1, because the bird is far softer than the target."


def _control(model: StrikeModel, system: UnitSystem) -> Iterator[str]:
    shock = model.case.solver
    names = (UNIT_NAMES.get(unit, unit) for unit in (*system.base.values(), "K"))
    yield from (
        "*CONTROL_UNITS",
        "$#  length      time      mass      temp",
        "".join(f"{n:10}" for n in names).rstrip(),
    )
    yield from ("*CONTROL_TERMINATION", "$#  endtim", card(system.value(model.end, "s")))
    yield from ("*CONTROL_TIMESTEP", "$#  dtinit    tssfac", card(0.0, TIME_STEP))
    yield from ("*CONTROL_ENERGY", "$#    hgen      rwen    slnten     rylen", card(2, 2, 2, 2))
    yield from ("*CONTROL_BULK_VISCOSITY", "$#      q1        q2      type")
    yield card(QUADRATIC * shock.shock_quadratic or NONE, LINEAR * shock.shock_linear or NONE, 1)
    if not len(model.bird.cells):
        yield from ("*CONTROL_SPH", "$#    ncbs     boxid        dt      idim   nmneigh      form")
        yield card(1, 0, 1e20, 3, 150, 0)
        yield "$#    cont     deriv       ini     ishow     ierod     icont     iavis     isymp"
        yield card(0, 0, 0, 0, *ERODED_LEAVE, 0, 100)


def _output(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    """Histories at the case's output interval: displacements, contact and reaction forces, strains; and pictures."""
    interval = system.value(model.output_interval, "s")
    kinds = {sensor.kind for sensor in model.sensors}
    wanted = ["GLSTAT", "MATSUM", "RCFORC"]
    nodes, gauges = numbering.recorded_nodes(model), [s for s in model.sensors if s.element is not None]
    wanted += ["NODOUT"] if nodes else []
    wanted += ["SPCFORC"] if "reaction_force" in kinds else []
    wanted += ["ELOUT"] if gauges else []
    for name in wanted:
        yield from (f"*DATABASE_{name}", "$#      dt    binary", card(interval, 3))
    yield from ("*DATABASE_BINARY_D3PLOT", "$#      dt", card(system.value(model.end, "s") / PICTURES))
    if nodes:
        yield from comments("$", (f"Node {number}: {name}" for number, name in nodes.items()))
        yield from ("*DATABASE_HISTORY_NODE", *ten_a_line(nodes, count=8))
    if gauges:
        yield from comments("$", (f"Shell {(gauge.element or 0) + 1}: {gauge.name}" for gauge in gauges))
        yield from ("*DATABASE_HISTORY_SHELL", *ten_a_line(((g.element or 0) + 1 for g in gauges), count=8))
        yield from ("*DATABASE_EXTENT_BINARY", card(0, 0, 5, 1, 1, 1, 1, 1), card(0, 0, 0, 1, 1, 1, 2))


def _parts(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, part in enumerate(model.parts, start=1):
        yield from _part(part.name, number, number, number, 0)
        yield from ("*SECTION_SHELL", "$#   secid    elform      shrf       nip")
        yield card(number, BELYTSCHKO_TSAY, 5.0 / 6.0, 5)
        yield from ("$#      t1        t2        t3        t4", card(*[system.value(part.thickness, "m")] * 4))
        yield from metal_lines(part.name, part.material if part.moves else None, number, system)
    bird = numbering.bird_part
    found = cards_of(model.case.bird.material, model.bird.density)
    yield from _part("bird", bird, bird, bird, bird if len(found) > 1 else 0)
    if len(model.bird.cells):
        yield from ("*SECTION_SOLID", "$#   secid    elform", card(bird, ONE_POINT_SOLID))
    else:
        yield from ("*SECTION_SPH", "$#   secid      cslh      hmin      hmax    sphini     death     start")
        yield card(bird, 1.2, 0.2, 2.0, 0.0, 1e20, 0.0)
    for one in found:
        yield from keyword_lines(one, bird, system)


def _part(title: str, number: int, section: int, material: int, law: int) -> Iterator[str]:
    yield from ("*PART", title, "$#     pid     secid       mid     eosid      hgid")
    yield card(number, section, material, law, 0)


def _spring_parts(model: StrikeModel, numbering: Numbering) -> Iterator[tuple[int, SupportSprings, int, float]]:
    """Part, springs, freedom (0 to 2 along x, y, z, 3 about all axes) and stiffness of every kind that is there."""
    number = numbering.bird_part
    for springs in model.springs:
        for freedom, stiffness in enumerate([*springs.translation, springs.rotation]):
            if stiffness > 0.0:
                number += 1
                yield number, springs, freedom, stiffness


def _springs(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    if not model.springs:
        return
    for axis, direction in enumerate(AXES, start=1):
        yield from ("*DEFINE_SD_ORIENTATION", "$#     vid       iop        xt        yt        zt      nid1      nid2")
        yield card(axis, 0, *direction, 0, 0)
    for section, turning in ((DISPLACED, 0), (TURNED, 1)):
        yield from ("*SECTION_DISCRETE", "$#   secid       dro        kd        v0        cl        fd")
        yield from (card(section, turning, 0.0, 0.0, 0.0, 0.0), card(0.0, 0.0))
    for number, _, freedom, stiffness in _spring_parts(model, numbering):
        turning = freedom == 3
        yield from _part("support", number, TURNED if turning else DISPLACED, number, 0)
        value = system.value(stiffness, "N m/rad" if turning else "N/m")
        yield from ("*MAT_SPRING_ELASTIC", "$#     mid         k", card(number, value))


def _supports(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    for number, (freedoms, nodes) in enumerate(numbering.held(model), start=1):
        yield from _node_set(number, nodes)
        yield from (
            "*BOUNDARY_SPC_SET",
            "$#    nsid       cid      dofx      dofy      dofz     dofrx     dofry     dofrz",
        )
        yield card(number, 0, *(int(held) for held in freedoms))
    if model.damping > 0.0:
        end, alpha = 2.0 * system.value(model.end, "s"), system.value(model.damping, "1/s")
        yield from ("*DEFINE_CURVE", card(DAMPING_CURVE, 0, 1.0, 1.0, 0.0, 0.0, 0))
        yield from (columns((0.0, 20), (alpha, 20)), columns((end, 20), (alpha, 20)))
        for number in range(1, len(model.parts) + 1):
            yield from ("*DAMPING_PART_MASS", "$#     pid      lcid        sf      flag")
            yield card(number, DAMPING_CURVE, 1.0, 0)


def _node_set(number: int, nodes: Iterable[int]) -> Iterator[str]:
    yield from (
        "*SET_NODE_LIST",
        "$#     sid       da1       da2       da3       da4",
        card(number, 0.0, 0.0, 0.0, 0.0),
    )
    yield from ten_a_line(nodes, count=8)


def _motion(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    velocity = [system.value(float(v), "m/s") for v in model.bird.velocity]
    yield from (
        "*INITIAL_VELOCITY_GENERATION",
        "$#      id      styp     omega        vx        vy        vz     ivatn",
    )
    yield card(numbering.bird_part, 2, 0.0, *velocity, 0)
    yield from ("$#      xc        yc        zc        nx        ny        nz     phase", card(*[0.0] * 6, 0))


def _contact(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    yield from _node_set(BIRD_NODES, (int(n) for n in numbering.bird))
    for number, pair in enumerate(model.contacts, start=1):
        yield from ("*SET_PART_LIST", "$#     sid", card(number, 0.0, 0.0, 0.0, 0.0))
        yield from ten_a_line((part + 1 for part in pair.parts), count=8)
        yield from ("*CONTACT_AUTOMATIC_NODES_TO_SURFACE", "$#    ssid      msid     sstyp     mstyp")
        yield card(BIRD_NODES, number, 4, 2, 0, 0, 1, 1)
        yield "$#      fs        fd        dc        vc       vdc    penchk        bt        dt"
        yield card(model.friction, model.friction, 0.0, 0.0, 0.0, 0, 0.0, 1e20)
        yield "$#     sfs       sfm       sst       mst      sfst      sfmt       fsf       vsf"
        width, thickness = 2.0 * system.value(model.bird.skin, "m"), system.value(pair.thickness, "m")
        yield card(1.0, 1.0, width, thickness, 1.0, 1.0, 1.0, 1.0)
        yield from ("$#    soft    sofscl    lcidab    maxpar", card(1, 0.1, 0, 1.025))


def _nodes(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    yield from ("*NODE", "$#   nid               x               y               z      tc      rc")
    metre = system.value(1.0, "m")
    for numbers, points in numbering.blocks_of_nodes(model):
        for number, point in zip(numbers, points * metre, strict=True):
            yield columns((int(number), 8), *((float(c), 16) for c in point))


def _elements(model: StrikeModel, system: UnitSystem, numbering: Numbering) -> Iterator[str]:
    yield from ("*ELEMENT_SHELL", "$#   eid     pid      n1      n2      n3      n4")
    for number, part in enumerate(model.parts, start=1):
        for element, corners in enumerate(part.quads + 1, start=part.first + 1):
            yield card(element, number, *(int(n) for n in corners), width=8)
    bird = numbering.bird_part
    if len(model.bird.cells):
        yield from (
            "*ELEMENT_SOLID",
            "$#   eid     pid      n1      n2      n3      n4      n5      n6      n7      n8",
        )
        for number, cell in zip(numbering.cells, model.bird.cells, strict=True):
            yield card(int(number), bird, *(int(numbering.bird[n]) for n in cell), width=8)
    else:
        yield from ("*ELEMENT_SPH", "$#   nid     pid            mass")
        for number, mass in zip(numbering.bird, model.bird.masses, strict=True):
            yield columns((int(number), 8), (bird, 8), (system.value(float(mass), "kg"), 16))
    if model.springs:
        yield from ("*ELEMENT_DISCRETE", "$#   eid     pid      n1      n2     vid")
        number = int(max(numbering.bird.max(), numbering.cells.max(initial=0)))
        ground = {id(s): at for s, at in zip(model.springs, numbering.ground, strict=True)}
        for part, springs, freedom, _ in _spring_parts(model, numbering):
            for node, at in zip(springs.nodes, ground[id(springs)], strict=True):
                for axis in (1, 2, 3) if freedom == 3 else (freedom + 1,):
                    number += 1
                    yield card(number, part, int(node) + 1, int(at), axis, width=8)
