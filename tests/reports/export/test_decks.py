"""Whole decks, read back by an independent reader: geometry, masses, momentum, constants and units, by number."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike import export
from birdstrike.cli.app import app
from birdstrike.data.decks.sensors import read_deck_sensors
from birdstrike.data.errors import UserError
from birdstrike.data.unit_systems import unit_system
from birdstrike.inversion.results.diagnosis import ShotStates
from birdstrike.reports.export import radioss_materials
from birdstrike.reports.export.effects import effect_lines, read_effects
from birdstrike.reports.export.fixed_columns import number
from birdstrike.reports.export.lsdyna_materials import metal_lines
from birdstrike.reports.export.model import strike_model
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.build import build_bird, build_plate
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.kernels.target.metal import hardened
from birdstrike.solver.target.laws.power import Power
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.laws.tabulated import Tabulated
from tests.diagnoses import effect, state, written_diagnosis
from tests.reports.export.radioss_reader import Block, elements_of, nodes_of, read_deck
from tests.solver.test_struck_plane import strike as aslant_strike

UNITS = ("mm-ms-kg-GPa", "mm-s-t-MPa", "m-s-kg-Pa")
SCALES = {"mm-ms-kg-GPa": (1e3, 1e3, 1.0), "mm-s-t-MPa": (1e3, 1.0, 1e-3), "m-s-kg-Pa": (1.0, 1.0, 1.0)}
"""Length, time and mass of a system's units in one of SI, written down here apart from the program's table."""
SMALL = {"bird.particles": "200", "plate.elements": "[6, 4]", "impact.friction": "0.3", "plate.damping": "40 1/s"}
SPRINGS = '{ rotational = "100 kN*m/rad/m", in_plane = "500 N/mm^2" }'


def written(case: str, code: str, units: str, folder: Path, **settings: str) -> str:
    name = "strike_0000.rad" if code == "radioss" else "strike_dyna.k"
    export(case, folder / name, to=code, units=units, deck=True, settings=settings)
    return (folder / name).read_text()


def radioss(case: str, units: str, folder: Path, **settings: str) -> dict[str, list[Block]]:
    return read_deck(written(case, "radioss", units, folder, **settings))


def lsdyna(case: str, units: str, folder: Path, **settings: str) -> dict[str, list[Any]]:
    from ansys.dyna.core import Deck

    deck = Deck()
    deck.loads(written(case, "lsdyna", units, folder, **settings))
    assert not list(deck.string_keywords), "ansys-dyna-core does not know every keyword that was written"
    cards: dict[str, list[Any]] = {}
    for keyword in deck.keywords:
        cards.setdefault(keyword.get_title(), []).append(keyword)
    return cards


def particles_of(text: str) -> np.ndarray:
    """Node, part and mass of every row of *ELEMENT_SPH, by its columns: ansys-dyna-core reads the first row alone."""
    after = text.split("*ELEMENT_SPH\n")[1].split("*")[0].splitlines()
    rows = [(line[:8], line[8:16], line[16:32]) for line in after if not line.startswith("$")]
    return np.array([[float(cell) for cell in row] for row in rows])


def truth(case: str, **settings: str) -> tuple[Case, Any, Any]:
    loaded = load_case(case, settings).resolved()
    return loaded, build_plate(loaded), build_bird(loaded)[0]


@pytest.mark.parametrize("units", UNITS)
def test_radioss_deck_reads_back_to_the_case_in_three_unit_systems(units: str, tmp_path: Path) -> None:
    (length, time, mass), (case, plate, bird) = SCALES[units], truth("demo_rig", **SMALL)
    deck = radioss("demo_rig", units, tmp_path, **SMALL)
    names = {"mm": "mm", "m": "m", "ms": "ms", "s": "s", "kg": "kg", "t": "Mg"}
    begin = deck["BEGIN"][0]
    own = units.split("-")
    assert begin.cells(2, 20, 20, 20) == [names[own[2]], names[own[0]], names[own[1]]] == begin.cells(3, 20, 20, 20)
    numbers, places = nodes_of(deck)
    assert len(set(numbers)) == len(numbers) == len(plate.x) + bird.n
    assert places[: len(plate.x)] == pytest.approx(length * plate.x, rel=1e-14, abs=1e-14)
    assert places[len(plate.x) :] == pytest.approx(length * bird.x[: bird.n], rel=1e-14, abs=1e-12)
    shells = elements_of(deck, "SHELL")[1]
    assert np.array_equal(shells[:, 1:], plate.quads + 1)
    particles = elements_of(deck, "SPHCEL")[2].ravel()
    assert np.array_equal(particles, numbers[len(plate.x) :])
    per_particle = deck["PROP/SPH"][0].floats(1, 4)[0]
    assert per_particle * len(particles) == pytest.approx(mass * 1.8757, rel=1e-3)
    assert per_particle * len(particles) == pytest.approx(mass * bird.masses.sum(), rel=1e-13)
    velocity = np.array([float(cell) for cell in deck["INIVEL/TRA"][0].cells(1, 20, 20, 20)])
    momentum = per_particle * len(particles) * velocity
    expected = bird.masses.sum() * np.array([91.1 * np.cos(np.pi / 6), 0.0, -91.1 / 2.0])
    assert momentum == pytest.approx(mass * length / time * expected, rel=1e-13, abs=1e-9)
    pressure, density = mass / (length * time**2), mass / length**3
    metal = deck["MAT/COWPER"][0]
    assert metal.floats(1, 1) == pytest.approx([2780.0 * density])
    assert metal.floats(2, 2) == pytest.approx([71e9 * pressure, 0.3])
    assert metal.floats(3) == pytest.approx([690e6 * pressure, 0.0, 1.0, 0.0, 0.0])
    assert deck["MAT/HYD_VISC"][0].floats(2, 2) == pytest.approx([600.0 / 938.0 * length**2 / time, -0.6e6 * pressure])
    assert deck["EOS/GRUNEISEN"][0].floats(1, 4) == pytest.approx([1670.0 * length / time, 2.48, 0.0, 0.0])
    assert deck["EOS/GRUNEISEN"][0].floats(2, 4) == pytest.approx([0.0, 0.0, 0.0, 938.0 * density])
    shell = deck["PROP/SHELL"][0]
    assert float(shell.cells(3, 10, 10, 20)[2]) == pytest.approx(0.01 * length)
    assert shell.cells(3, 10)[0] == "5"
    contact = deck["INTER/TYPE7"][0]
    stiffness, friction, gap = contact.floats(4, 3)
    assert friction == 0.3
    assert gap == pytest.approx(length * (0.005 + bird.skin))
    assert stiffness == pytest.approx(bird.bulk_modulus * bird.spacing * mass / time**2)
    assert float(deck["DAMP"][0].cells(1, 20)[0]) == pytest.approx(80.0 / time)
    held = set(deck["GRNOD/NODE"][0].integers(1))
    assert held == {int(n) + 1 for n in plate.mesh.rim}
    assert deck["BCS"][0].lines[1][:10] == "   111 111"
    engine = (tmp_path / "strike_0001.rad").read_text().splitlines()
    assert float(engine[engine.index("/RUN/strike/1") + 1]) == pytest.approx(case.time.end * time)
    assert float(engine[engine.index("/TFILE/4") + 1]) == pytest.approx(5e-6 * time)


@pytest.mark.parametrize("units", UNITS)
def test_lsdyna_deck_reads_back_to_the_case_in_three_unit_systems(units: str, tmp_path: Path) -> None:
    (length, time, mass), (case, plate, bird) = SCALES[units], truth("demo_rig", **SMALL)
    deck = lsdyna("demo_rig", units, tmp_path, **SMALL)
    nodes = deck["*NODE"][0].nodes
    places = nodes[["x", "y", "z"]].to_numpy(float)
    assert nodes["nid"].is_unique
    assert places[: len(plate.x)] == pytest.approx(length * plate.x, rel=1e-11, abs=1e-12)
    assert places[len(plate.x) :] == pytest.approx(length * bird.x[: bird.n], rel=1e-9, abs=1e-9)
    corners = deck["*ELEMENT_SHELL"][0].elements[["n1", "n2", "n3", "n4"]].to_numpy(int)
    assert np.array_equal(corners, plate.quads + 1)
    particles = particles_of((tmp_path / "strike_dyna.k").read_text())
    assert np.array_equal(particles[:, 0], nodes["nid"].to_numpy(int)[len(plate.x) :])
    assert set(particles[:, 1]) == {2.0}
    total = particles[:, 2].sum()
    assert total == pytest.approx(mass * bird.masses.sum(), rel=1e-9)
    start = deck["*INITIAL_VELOCITY_GENERATION"][0]
    expected = np.array([91.1 * np.cos(np.pi / 6), 0.0, -91.1 / 2.0]) * length / time
    assert (start.id, start.styp) == (2, 2)
    assert [start.vx, start.vy, start.vz] == pytest.approx(expected, rel=1e-7, abs=1e-12)
    assert total * start.vz == pytest.approx(mass * length / time * -bird.masses.sum() * 45.55, rel=1e-7)
    pressure, density = mass / (length * time**2), mass / length**3
    metal, null, law = (deck[name][0] for name in ("*MAT_PLASTIC_KINEMATIC", "*MAT_NULL", "*EOS_GRUNEISEN"))
    metal_truth = [2780.0 * density, 71e9 * pressure, 0.3, 690e6 * pressure]
    assert [metal.ro, metal.e, metal.pr, metal.sigy] == pytest.approx(metal_truth)
    assert [null.ro, null.pc, null.mu] == pytest.approx([938.0 * density, -6e5 * pressure, 600.0 * pressure * time])
    assert [law.c, law.s1, law.v0] == pytest.approx([1670.0 * length / time, 2.48, 1.0])
    said = deck["*CONTROL_UNITS"][0]
    names = {"s": "sec", "t": "mtrc_ton"}
    assert [said.length, said.time, said.mass] == [names.get(unit, unit) for unit in unit_system(units).base.values()]
    assert deck["*CONTROL_TERMINATION"][0].endtim == pytest.approx(case.time.end * time)
    contact = deck["*CONTACT_AUTOMATIC_NODES_TO_SURFACE"][0]
    assert (contact.fs, contact.fd) == (0.3, 0.3)
    assert 0.5 * (contact.sast + contact.sbst) == pytest.approx(length * (0.005 + bird.skin), rel=1e-6)
    particle = deck["*CONTROL_SPH"][0]
    assert (particle.ierod, particle.icont) == (2, 1), "one that erodes leaves; by default it would stay active"
    curve = deck["*DEFINE_CURVE"][0].curves.to_numpy(float)
    assert curve[:, 1] == pytest.approx(80.0 / time)
    parts = {int(one.parts["pid"][0]): one.parts for one in deck["*PART"]}
    assert list(parts) == [1, 2]
    support = deck["*BOUNDARY_SPC_SET"][0]
    assert [support.dofx, support.dofy, support.dofz, support.dofrx, support.dofry, support.dofrz] == [1] * 6


def test_edge_springs_carry_the_frames_stiffness(tmp_path: Path) -> None:
    """The sum over all nodes is the stiffness per length times the length of the edge, in both codes."""
    settings = SMALL | {"plate.edges": SPRINGS}
    around = 2.0 * (0.525 + 0.43)
    deck = radioss("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    counts = {part: len(rows) for part, rows in elements_of(deck, "SPRING").items()}
    rotation = sum(counts[block.number] * block.floats(11)[0] for block in deck["PROP/SPR_GENE"])
    in_plane = sum(counts[block.number] * block.floats(2)[0] for block in deck["PROP/SPR_GENE"])
    assert rotation == pytest.approx(1e5 * around, rel=1e-10)
    assert in_plane == pytest.approx(5e8 * around, rel=1e-10)
    assert all(block.floats(8)[0] == 0.0 for block in deck["PROP/SPR_GENE"])
    assert {block.lines[1][:10] for block in deck["BCS"]} == {"   001 000", "   111 111"}
    cards = lsdyna("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    stiffness = {one.mid: one.k for one in cards["*MAT_SPRING_ELASTIC"]}
    springs = cards["*ELEMENT_DISCRETE"][0].elements
    turning = {int(p.parts["pid"][0]) for p in cards["*PART"] if int(p.parts["secid"][0]) == 9002}
    about_x = springs[springs["vid"] == 1]
    sums = {True: 0.0, False: 0.0}
    for part in about_x["pid"]:
        sums[int(part) in turning] += stiffness[int(part)]
    assert sums[True] == pytest.approx(1e5 * around, rel=1e-6)
    assert sums[False] == pytest.approx(5e8 * around, rel=1e-6)


def test_an_assembly_has_its_parts_and_a_contact_for_each_thickness(tmp_path: Path) -> None:
    settings = {
        "bird.particles": "150",
        "target.generator.element_size": "50 mm",
        "target.parts.stiffeners.thickness": "2 mm",
    }
    _, plate, bird = truth("openradioss_panel", **settings)
    deck = radioss("openradioss_panel", "mm-s-t-MPa", tmp_path, **settings)
    shells = elements_of(deck, "SHELL")
    assert {part: len(rows) for part, rows in shells.items()} == {
        i: len(facets) for i, facets in enumerate(plate.mesh.parts.values(), start=1)
    }
    assert np.array_equal(shells[2][:, 1:], plate.quads[plate.mesh.parts["stiffeners"]] + 1)
    metal = deck["MAT/PLAS_JOHNS"]
    assert metal[0].floats(3) == pytest.approx([350.0, 426.0, 0.34, 0.0, 0.0])
    gaps = [contact.floats(4, 3)[2] for contact in deck["INTER/TYPE7"]]
    assert gaps == pytest.approx([1.5 + 1e3 * bird.skin, 1.0 + 1e3 * bird.skin])
    cards = lsdyna("openradioss_panel", "mm-s-t-MPa", tmp_path, **settings)
    law = cards["*MAT_SIMPLIFIED_JOHNSON_COOK"][0]
    assert [law.a, law.b, law.n, law.c] == pytest.approx([350.0, 426.0, 0.34, 0.0])
    sensors = read_deck_sensors(tmp_path / "strike.radioss.sensors.json").sensors
    at = {int(n): x for n, x in zip(*nodes_of(deck), strict=True)}
    x60 = sensors["w_x60"]
    place = sum(w * at[n] for n, w in zip(x60.numbers, x60.weights, strict=True))
    assert place == pytest.approx([60.0, 0.0, 0.0], abs=1e-9)
    assert sensors["u_blade"].direction == (1.0, 0.0, 0.0)
    assert set(sensors["reaction_force"].numbers) == set(deck["GRNOD/NODE"][0].integers(1))


def test_a_bird_of_hexahedra_has_the_volume_of_the_case(tmp_path: Path) -> None:
    settings = SMALL | {"bird.method": "hexahedra", "solver.shock_linear": "1", "solver.shock_quadratic": "2"}
    case, _, bird = truth("demo_rig", **settings)
    deck = radioss("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    numbers, places = nodes_of(deck)
    at = dict(zip(numbers, places, strict=True))
    cells = np.array([[at[n] for n in row[1:]] for row in elements_of(deck, "BRICK")[2]])
    assert len(cells) == len(bird.cells)
    from birdstrike.solver.bird.hex_mesh import HexMesh

    volume = HexMesh(cells.reshape(-1, 3), np.arange(8 * len(cells)).reshape(-1, 8)).volumes.sum()
    assert 938.0 * volume == pytest.approx(case.bird.actual_mass, rel=1e-9)
    assert "DT/BRICK/DEL" in (tmp_path / "strike_0001.rad").read_text()
    cards = lsdyna("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    shock = cards["*CONTROL_BULK_VISCOSITY"][0]
    usual = [1.5, 0.06]  # for the case's 2 and 1
    assert [shock.q1, shock.q2] == pytest.approx(usual) == deck["PROP/SOLID"][0].floats(2, 2)
    solid = cards["*ELEMENT_SOLID"][0].elements
    assert np.array_equal(solid[[f"n{k}" for k in range(1, 9)]].to_numpy(int), elements_of(deck, "BRICK")[2][:, 1:])


@pytest.mark.parametrize("model", ["elastic", "plastic_kinematic", "hydrodynamic"])
def test_other_bird_models_are_radioss_laws_with_the_same_constants(model: str, tmp_path: Path) -> None:
    settings = {"bird.particles": "150", "plate.elements": "[6, 4]"}
    deck = radioss(f"reference_strike_{model}", "m-s-kg-Pa", tmp_path, **settings)
    if model == "elastic":
        assert deck["MAT/ELAST"][0].floats(2, 2) == pytest.approx([68.9e6, 0.49])
    elif model == "plastic_kinematic":
        assert deck["MAT/PLAS_JOHNS"][0].floats(3)[:4] == pytest.approx([6894.0, 0.0, 1.0, 1.25])
    else:
        young, poisson = deck["MAT/HYDPLA"][0].floats(2, 2)
        assert young / (2.0 * (1.0 + poisson)) == pytest.approx(10.2e6)
        assert young / (3.0 * (1.0 - 2.0 * poisson)) == pytest.approx(2072e6)
        assert deck["MAT/HYDPLA"][0].floats(4, 1) == pytest.approx([-0.9e6])
        assert deck["EOS/POLYNOMIAL"][0].floats(1, 4) == pytest.approx([0.0, 2072e6, 6217e6, 10362e6])


ALUMINIUM = {"density": "2780 kg/m^3", "young": "71 GPa", "poisson": 0.33, "failure_strain": 0.2}
COOK = {"law": "johnson_cook", "a": "350 MPa", "b": "426 MPa", "n": 0.34, "c": 0.015, "rate0": "2 1/s"}
HEAT = {"m": 1.2, "melt": "775 K", "specific_heat": "900 J/kg/K", "heat_share": 0.8}
MIXED = {"law": "bilinear", "yield_stress": "300 MPa", "tangent_modulus": "710 MPa", "beta": 0.25}
RATE = {"rate_c": "6500 1/s", "rate_p": 4.0}
WARM = {"C0": "1 MPa", "C1": "2000 MPa", "C2": "3 MPa", "C3": "4 MPa", "C4": 0.5, "C5": 0.6, "E0": "7 MPa"}


def law_block(lines: list[str], name: str) -> Block:
    """A keyword of these lines of Radioss."""
    return read_deck("\n".join(lines))[name][0]


def test_every_constant_of_a_metal_stands_in_its_column_of_both_codes() -> None:
    """In mm, ms, kg, GPa: rates in 1/ms, heat per volume and kelvin in GPa/K, with the share of work that is heat."""
    system = unit_system("mm-ms-kg-GPa")
    hot, cold, mixed = (TARGET_LAWS.validate(ALUMINIUM | law) for law in (COOK | HEAT, COOK, MIXED | RATE))
    block = law_block(radioss_materials.metal_lines("skin", hot, 1, system), "MAT/PLAS_JOHNS")
    assert block.floats(3) == pytest.approx([0.35, 0.426, 0.34, 0.2, 0.0])
    assert block.floats(4, 2) == pytest.approx([0.015, 2e-3])
    assert block.floats(5, 4) == pytest.approx([1.2, 775.0, 1e-9 * 2780.0 * 900.0 / 0.8, 298.15])
    block = law_block(radioss_materials.metal_lines("skin", mixed, 1, system), "MAT/COWPER")
    assert block.floats(3, 4) == pytest.approx([0.3, 71.0 * 0.71 / (71.0 - 0.71), 1.0, 0.75])
    assert block.floats(4, 2) == pytest.approx([6.5, 4.0])
    assert block.floats(5, 1) == pytest.approx([0.2])
    of_bird = {"model": "plastic_kinematic", "young": "71 GPa", "poisson": 0.33, "failure_strain": 0.2} | MIXED | RATE
    bird = BIRD_MATERIALS.validate({key: value for key, value in of_bird.items() if key != "law"})
    again = law_block(radioss_materials.bird_lines(bird, 2780.0, 1, system, sph=False), "MAT/COWPER")
    assert again.lines[1:] == block.lines[1:]
    plain = metal_lines("skin", cold, 1, system)
    assert [float(plain[4][at : at + 10]) for at in range(0, 80, 10)] == pytest.approx(
        [0.35, 0.426, 0.34, 0.015, 0.2, 1e28, 1e28, 2e-3]
    )
    kinematic = metal_lines("skin", mixed, 1, system)
    assert [float(kinematic[2][at : at + 10]) for at in range(40, 70, 10)] == pytest.approx([0.3, 0.71, 0.25])
    assert [float(kinematic[4][at : at + 10]) for at in range(0, 40, 10)] == pytest.approx([6.5, 4.0, 0.2, 1.0])


def test_every_constant_of_a_bird_s_law_stands_in_its_column_of_radioss() -> None:
    def eos_of(law: dict[str, Any], name: str) -> Block:
        null = {"model": "null", "pressure_cutoff": "0 MPa", "viscosity": "600 Pa s", "eos": law}
        lines = radioss_materials.bird_lines(
            BIRD_MATERIALS.validate(null), 938.0, 1, unit_system("m-s-kg-Pa"), sph=True
        )
        assert law_block(lines, "MAT/HYD_VISC").floats(2, 2) == pytest.approx([600.0 / 938.0, -1.0])
        return law_block(lines, f"EOS/{name}")

    shock = {
        "kind": "grueneisen",
        "C": "1670 m/s",
        "S1": 2.48,
        "S2": 0.1,
        "S3": 0.2,
        "g0": 0.3,
        "a": 0.4,
        "E0": "5 MPa",
    }
    block = eos_of(shock, "GRUNEISEN")
    assert block.floats(1, 4) == pytest.approx([1670.0, 2.48, 0.1, 0.2])
    assert block.floats(2, 4) == pytest.approx([0.3, 0.4, 5e6, 938.0])
    block = eos_of({"kind": "murnaghan", "B": "128 MPa", "g": 7.98, "p0": "2 MPa"}, "MURNAGHAN")
    assert block.floats(1) == pytest.approx([128e6 * 7.98, 7.98, 2e6, 0.0, 938.0])
    block = eos_of({"kind": "linear_polynomial"} | WARM, "POLYNOMIAL")
    assert block.floats(1, 4) == pytest.approx([1e6, 2e9, 3e6, 4e6])
    assert block.floats(2) == pytest.approx([0.5, 0.6, 7e6, 0.0, 938.0])


def test_an_effect_of_the_case_is_in_its_deck(tmp_path: Path) -> None:
    deck = radioss("demo_rig", "mm-ms-kg-GPa", tmp_path, **SMALL | {"effects.plate_thickness": "-0.5 mm"})
    assert float(deck["PROP/SHELL"][0].cells(3, 10, 10, 20)[2]) == pytest.approx(9.5)
    assert "effects.plate_thickness = -0.5 mm" in " ".join((tmp_path / "strike_0000.rad").read_text().split("\n#   "))


@pytest.mark.parametrize("code", ["radioss", "lsdyna"])
def test_rivets_and_ties_are_refused_by_name(code: str, tmp_path: Path) -> None:
    """Without them the parts would fall apart, and the deck would say nothing."""
    with pytest.raises(UserError, match=r"target\.rivets \(target\.rivets\.\w+.*\) have no card .*without --deck"):
        written("sidewall_004_water", code, "m-s-kg-Pa", tmp_path, **{"bird.particles": "150"})
    tie = {"target.ties.seam.nodes": '"edges"', "target.ties.seam.onto": '"stiffeners"'}
    tie |= {"target.ties.seam.distance": '"1 mm"', "target.generator.element_size": "50 mm"}
    with pytest.raises(UserError, match=r"target\.ties \(target\.ties\.seam\) have no card"):
        written("openradioss_panel", code, "m-s-kg-Pa", tmp_path, **tie)
    assert not list(tmp_path.iterdir())


FLIGHTS = {
    "impact.direction": {"impact.direction": "[0.3, 0.5, -0.7]"},
    "an angle beyond the normal": {"impact.angle": "89 deg", "effects.impact_angle": "2 deg"},
}


@pytest.mark.parametrize("flight", FLIGHTS)
def test_the_decks_bird_flies_as_the_solvers_does(flight: str, tmp_path: Path) -> None:
    settings = SMALL | FLIGHTS[flight]
    _, _, bird = truth("demo_rig", **settings)
    deck = radioss("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    assert deck["INIVEL/TRA"][0].floats(1, 3) == pytest.approx(bird.v[0].tolist(), rel=1e-9)
    assert "heading" in (tmp_path / "strike_0000.rad").read_text()
    cards = lsdyna("demo_rig", "m-s-kg-Pa", tmp_path, **settings)
    velocity = cards["*INITIAL_VELOCITY_GENERATION"][0]
    assert [velocity.vx, velocity.vy, velocity.vz] == pytest.approx(bird.v[0].tolist(), rel=1e-6)


def test_what_no_common_card_says_is_refused_with_a_remedy(tmp_path: Path) -> None:
    preload = SMALL | {"plate.preload": '["1 MPa", "1 MPa"]'}
    with pytest.raises(UserError, match=r"plate\.preload has no card in a whole deck: .*--set"):
        written("demo_rig", "radioss", "m-s-kg-Pa", tmp_path, **preload)
    curved = SMALL | {"plate.radius": "600 mm", "plate.edges": "pinned", "bird.particles": "200"}
    radioss("demo_rig", "m-s-kg-Pa", tmp_path, **curved)
    with pytest.raises(UserError, match=r"plate\.edges: supports that hold some freedoms of a curved"):
        written("demo_rig", "lsdyna", "m-s-kg-Pa", tmp_path, **curved | {"plate.edges": '{ in_plane = "500 N/mm^2" }'})
    rated = {"bird.material.rate_c": "100 1/s", "bird.particles": "150", "plate.elements": "[6, 4]"}
    with pytest.raises(UserError, match=r'export with bird\.method = "hexahedra"'):
        written("reference_strike_plastic_kinematic", "radioss", "m-s-kg-Pa", tmp_path, **rated)
    with pytest.raises(UserError, match=r"is called NAME_0000\.rad, without blanks"):
        export("demo_rig", tmp_path / "my deck.rad", to="radioss", deck=True, settings=SMALL)
    with pytest.raises(UserError, match="--deck writes the deck of a case"):
        export(tmp_path, tmp_path / "x.k", deck=True)
    with pytest.raises(UserError, match='"abaqus" is not on offer; available: lsdyna, radioss'):
        export("demo_rig", tmp_path / "x.k", to="abaqus")
    assert not (tmp_path / "x.k").exists()


@pytest.mark.parametrize("deck", [True, False])
def test_a_loaded_case_is_exported_as_its_file_is(deck: bool, tmp_path: Path) -> None:
    loaded = load_case("demo_rig", SMALL)
    of_file = export("demo_rig", tmp_path / "file.rad", to="radioss", deck=deck, settings=SMALL)
    of_case = export(loaded, tmp_path / "case.rad", to="radioss", deck=deck)
    of_table = export(loaded.table, tmp_path / "table.rad", to="radioss", deck=deck)
    assert numbers(of_case) == numbers(of_file) == numbers(of_table)
    with pytest.raises(UserError, match="the case is loaded already"):
        export(loaded, tmp_path / "other.rad", to="radioss", deck=deck, settings=SMALL)


@pytest.mark.parametrize("deck", [True, False])
@pytest.mark.parametrize("choice", [{"case": "demo"}, {"method": "emulator"}, {"model": "elastic"}])
def test_a_case_leaves_nothing_to_choose(choice: dict[str, Any], deck: bool, tmp_path: Path) -> None:
    for source in ("demo_rig", load_case("demo_rig", SMALL)):
        with pytest.raises(UserError, match=rf"--{next(iter(choice))} .*folder of"):
            export(source, tmp_path / "x.rad", to="radioss", deck=deck, **choice)
    assert not [*tmp_path.iterdir()]


def numbers(file: Path) -> list[str]:
    """Lines of a deck that hold constants and coordinates, no names."""
    found = [line for line in file.read_text(encoding="utf-8").splitlines() if line[:1] == " "]
    assert found
    return found


def test_command_names_the_files_and_what_comes_next(tmp_path: Path) -> None:
    out = tmp_path / "shot.rad"
    settings = [word for key, value in SMALL.items() for word in ("--set", f"{key}={value}")]
    found = CliRunner().invoke(
        app, ["export", "demo_rig", "--deck", "--to", "radioss", "--out", str(out), *settings, "--json"]
    )
    assert found.exit_code == 0, found.output
    answer = json.loads(found.stdout.splitlines()[-1])
    assert [Path(file).name for file in answer["files"]] == ["shot_0000.rad", "shot_0001.rad"]
    assert all(Path(file).is_file() for file in (*answer["files"], answer["sensors"]))
    assert "birdstrike compare demo_rig" in " ".join(found.stdout.split())


def test_decks_of_one_case_for_both_codes_lie_in_one_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By their default names, each with the sensors' file of its own code and units."""
    monkeypatch.chdir(tmp_path)
    settings = [word for key, value in SMALL.items() for word in ("--set", f"{key}={value}")]
    for to, units in (("lsdyna", "mm-s-t-MPa"), ("radioss", "mm-ms-kg-GPa")):
        found = CliRunner().invoke(app, ["export", "demo_rig", "--deck", "--to", to, "--units", units, *settings])
        assert found.exit_code == 0, found.output
        sensors = read_deck_sensors(tmp_path / f"demo_rig.{to}.sensors.json")
        assert (sensors.code, sensors.units) == (to, units)
    decks = {"demo_rig.k", "demo_rig_0000.rad", "demo_rig_0001.rad"}
    assert {path.name for path in tmp_path.iterdir() if not path.name.endswith(".sensors.json")} == decks


@pytest.mark.parametrize("value", [1.0 / 3.0, -1.0 / 3e7, 71e9, 0.1, -45.55, 123456.789, 1e-20, 0.0])
def test_numbers_in_columns_keep_all_digits_that_fit(value: float) -> None:
    for width, digits in ((10, 2), (16, 8), (20, 11)):
        text = number(value, width)
        assert len(text) == width
        assert text[0] == " "
        assert "." in text
        assert float(text) == pytest.approx(value, rel=0.5 * 10.0**-digits, abs=0.0)
    for small, text in ((-3.705e-4, "-3.705e-4"), (-1.0449e-4, "-1.045e-4"), (1.5e-3, "0.0015")):
        assert number(small, 10).strip() == text
    assert float(number(0.30000000000000004, 20)) == pytest.approx(0.3, rel=1e-15)


def test_effects_of_a_diagnosis_are_cards_with_what_is_known_of_them(tmp_path: Path) -> None:
    names = {"plate_thickness": 2e-4, "bird_friction": 0.12, "impact_speed": 1.5, "clamp_rotation": 1e-6}
    names |= {"plate_density": 50.0, "plate_damping": 60.0, "sensor_gain.displacement_centre": 0.03}
    found = [effect(name, size, interval_95=(0.5 * size, 2.0 * size), probability=0.12) for name, size in names.items()]
    found.append(effect("bird_yaw", 0.01, interval_95=(0.0, 0.1), probability=0.001))
    parameters = {
        "bird.material.viscosity": {"value": 420.0, "interval_95": [400.0, 440.0], "unit": "Pa s", "identified": True}
    }
    chosen = ("plate_thickness", "bird_friction+impact_speed", "none")
    written_diagnosis(tmp_path, *found, verdict="ambiguous", confidence_set=chosen, before=state(parameters=parameters))
    (tmp_path / "case.toml").write_text('extends = "demo_rig"\n')
    from ansys.dyna.core import Deck

    system = unit_system("mm-ms-kg-GPa")
    export(tmp_path, tmp_path / "bird.k", units=system.name)
    text = (tmp_path / "bird.k").read_text()
    plain = " ".join(line.lstrip("$ ") for line in text.splitlines() if line.startswith("$"))
    assert "Record: shot. The record is measured." in plain
    assert "magnitude +0.2 mm, 95 % interval +0.1 mm .. +0.4 mm, probability 0.12" in plain
    assert "bird_yaw" not in text
    assert "nothing changes in the deck; correct the record" in plain
    deck = Deck()
    deck.loads(text)
    assert not list(deck.string_keywords)
    cards: dict[str, list[Any]] = {}
    for keyword in deck.keywords:
        cards.setdefault(keyword.get_title(), []).append(keyword)
    assert cards["*MAT_NULL"][0].mu == pytest.approx(system.value(420.0, "Pa s"))
    assert cards["*SECTION_SHELL"][0].t1 == pytest.approx(10.2)
    assert cards["*MAT_SPRING_ELASTIC"][0].k == pytest.approx(system.value(1e6, "N/rad"))
    assert cards["*MAT_PLASTIC_KINEMATIC"][0].ro == pytest.approx(system.value(2830.0, "kg/m^3"))
    alpha = cards["*DEFINE_CURVE"][0].curves.to_numpy(float)[:, 1]
    assert alpha == pytest.approx(0.12), "the force is alpha m v, and 60 1/s the amplitude's rate of decay"
    named = {line.split()[1]: float(line.split()[2]) for line in text.splitlines() if line.startswith("R ")}
    assert named["fric1002"] == 0.12
    assert named["vz1003"] == pytest.approx(-0.5 * 92.6)
    export(tmp_path, tmp_path / "bird.rad", to="radioss", units=system.name)
    blocks = read_deck((tmp_path / "bird.rad").read_text())
    assert float(blocks["PROP/SHELL"][0].cells(3, 10, 10, 20)[2]) == pytest.approx(10.2)
    assert blocks["MAT/COWPER"][0].floats(1, 1) == pytest.approx([2.83e-6])
    assert blocks["MAT/HYD_VISC"][0].floats(2, 1) == pytest.approx([420.0 / 938.0 * 1e3])
    with pytest.raises(UserError, match=r"--method emulator: .* has one answer"):
        export(tmp_path, tmp_path / "bird.k", method="emulator")


def test_the_card_of_another_mass_has_the_fitted_constants_of_the_bird(tmp_path: Path) -> None:
    """Those of the shot that alone has the effect, not the declared ones."""
    fits = {
        name: state(parameters={"bird.material.viscosity": {"value": value}})
        for name, value in (("slow", 420.0), ("fast", 350.0))
    }
    shots = tuple(ShotStates(name, "demo_rig", fit, None) for name, fit in fits.items())
    for file in ("case.toml", "diagnosis_fast.toml"):
        (tmp_path / file).write_text('extends = "demo_rig"\n')
    for label, value in (("bird_mass", 420.0), ("bird_mass@fast", 350.0)):
        written_diagnosis(tmp_path, effect(label, 0.05), before=fits["slow"], shots=shots)
        found = read_effects(tmp_path)
        assert found is not None
        (one,) = found.effects
        assert one.changed is not None
        assert one.changed.bird.material.viscosity == pytest.approx(value)
        lines = effect_lines(found, unit_system("m-s-kg-Pa"), "radioss")
        assert any("other constants of the bird are those that the diagnosis fitted" in line for line in lines)


@pytest.mark.parametrize(("method", "law"), [("sph", "PLAS_JOHNS"), ("hexahedra", "COWPER")])
def test_cards_of_a_bird_are_those_of_its_method(method: str, law: str, tmp_path: Path) -> None:
    """LAW2 leaves its pressure to a particle that has failed, which its comments say."""
    for strain, said in (("1.25", method == "sph"), ("100", False)):
        settings = {"bird.method": method, "bird.material.failure_strain": strain}
        export("reference_strike_plastic_kinematic", tmp_path / "bird.rad", to="radioss", settings=settings)
        text = (tmp_path / "bird.rad").read_text()
        assert f"/MAT/{law}/" in text
        assert ("in birdstrike it erodes and pushes nothing" in " ".join(text.split("\n#   "))) == said


def test_velocity_of_an_effect_is_along_the_impacts_direction(tmp_path: Path) -> None:
    written_diagnosis(tmp_path, effect("impact_speed", 2.0, interval_95=(1.0, 3.0)))
    (tmp_path / "case.toml").write_text('extends = "demo_rig"\n[impact]\ndirection = [0.3, 0.5, -0.7]\n')
    _, _, bird = truth(str(tmp_path / "case.toml"), **{"effects.impact_speed": "2 m/s"})
    found = read_effects(tmp_path)
    assert found is not None
    lines = effect_lines(found, unit_system("m-s-kg-Pa"), "lsdyna")
    written_down = [float(line.split()[-1]) for line in lines if line.startswith("R v")]
    assert written_down == pytest.approx(bird.v[0].tolist(), rel=1e-3)


def test_what_an_effect_changes_beside_its_card_is_said(tmp_path: Path) -> None:
    """The card of a heavier bird changes the density; the particles of a deck have their mass elsewhere."""
    sizes = {"bird_mass": 0.05, "impact_angle": 0.02}
    written_diagnosis(tmp_path, *(effect(*one, probability=0.5) for one in sizes.items()))
    ball = '[bird]\nshape = "sphere"\nlength = "106 mm"\nmethod = "hexahedra"\n'
    said = []
    for bird in ("", ball):
        (tmp_path / "case.toml").write_text(f'extends = "demo_rig"\n{bird}')
        found = read_effects(tmp_path)
        assert found is not None
        said.append(" ".join(line.lstrip("$ ") for line in effect_lines(found, unit_system("m-s-kg-Pa"), "lsdyna")))
    declared = load_case("demo_rig").bird.actual_mass
    assert f"(*ELEMENT_SPH, /PROP/SPH): multiply it by {(declared + 0.05) / declared:.6g} too" in said[0]
    assert "turn its nodes by the magnitude too" in said[0]
    assert "/PROP/SPH" not in said[1]
    assert "turn its nodes" not in said[1]


def test_an_effect_of_one_shot_is_added_to_the_case_of_that_shot(tmp_path: Path) -> None:
    """A bird 4 m/s faster in a shot at 110 m/s had cards of 95.1 m/s: of the first shot's 91.1 m/s."""
    shots = tuple(ShotStates(name, "demo_rig", state(), None) for name in ("slow", "fast"))
    written_diagnosis(tmp_path, effect("impact_speed@fast", 4.0, interval_95=(3.0, 5.0)), shots=shots)
    (tmp_path / "case.toml").write_text('extends = "demo_rig"\n')
    with pytest.raises(UserError, match=r"diagnosis_fast\.toml.*repeat the diagnose command"):
        read_effects(tmp_path)
    (tmp_path / "diagnosis_fast.toml").write_text('extends = "demo_rig"\n[impact]\nspeed = "110 m/s"\n')
    for label, speed in (("impact_speed@fast", 114.0), ("impact_speed@slow", 95.1), ("impact_speed", 95.1)):
        written_diagnosis(tmp_path, effect(label, 4.0, interval_95=(3.0, 5.0)), shots=shots)
        found = read_effects(tmp_path)
        assert found is not None
        lines = effect_lines(found, unit_system("m-s-kg-Pa"), "lsdyna")
        velocity = [float(line.split()[-1]) for line in lines if line.startswith("R v")]
        assert np.linalg.norm(velocity) == pytest.approx(speed, rel=1e-6)


def test_a_soft_support_of_one_set_says_of_which(tmp_path: Path) -> None:
    written_diagnosis(tmp_path, effect("edge_slip.cell_3", 1e-9))
    (tmp_path / "case.toml").write_text('extends = "flat_plate_002"\n')
    found = read_effects(tmp_path)
    assert found is not None
    assert any("at cell_3 alone" in line for line in effect_lines(found, unit_system("m-s-kg-Pa"), "lsdyna"))


@pytest.mark.parametrize(("rate", "first", "vp"), [("0 1/s", 0.35, 0.0), ("6500 1/s", 0.0, 1.0)])
def test_a_curve_with_rates_has_no_yield_stress_of_its_own(rate: str, first: float, vp: float) -> None:
    """With VP = 1 LS-DYNA would scale SIGY, where it is given, and add that to the curve."""
    curve = {"plastic_strain": [0.0, 0.5], "flow_stress": ["350 MPa", "600 MPa"], "rate_c": rate, "rate_p": 4.0}
    metal = {"law": "tabulated", "density": "2780 kg/m^3", "young": "71 GPa", "poisson": 0.33}
    lines = metal_lines("skin", Tabulated.model_validate(metal | curve), 1, unit_system("mm-ms-kg-GPa"))
    at = lines.index("*MAT_PIECEWISE_LINEAR_PLASTICITY")
    assert float(lines[at + 2][40:50]) == pytest.approx(first)
    assert float(lines[at + 4][40:50]) == vp


def test_curves_of_metals_give_lsdyna_the_laws_flow_stress() -> None:
    """LS-DYNA takes a curve at LCINT equal intervals, 100 unless told, and goes on with its last slope.

    A power law was 10 % too soft at 0.5 % of plastic strain, a table rose beyond its last point.
    """
    shared = {"density": "2780 kg/m^3", "young": "71 GPa", "poisson": 0.33, "rate_c": "6500 1/s", "rate_p": 4.0}
    points = {"plastic_strain": [0.0, 0.003, 0.2], "flow_stress": ["350 MPa", "400 MPa", "600 MPa"]}
    power = Power.model_validate(shared | {"law": "power", "a": "350 MPa", "b": "426 MPa", "n": 0.34})
    for law in (power, Tabulated.model_validate(shared | points | {"law": "tabulated"})):
        lines = metal_lines("skin", law, 1, unit_system("m-s-kg-Pa"))
        head = lines.index("*DEFINE_CURVE") + 2
        strain, stress = np.array([[float(row[:20]), float(row[20:40])] for row in lines[head + 1 :]]).T
        taken = np.linspace(strain[0], strain[-1], int(lines[head][70:80] or 100) + 1)
        value = np.interp(taken, strain, stress)
        for asked in (0.001, 0.005, 0.05, 0.5):
            beyond = max(asked - taken[-1], 0.0) * (value[-1] - value[-2]) / (taken[-1] - taken[-2])
            assert np.interp(asked, taken, value) + beyond == pytest.approx(hardened(law.row(), asked)[0], rel=5e-3)


def comments_of(file: Path) -> str:
    """The comments of a deck of LS-DYNA as one text."""
    return " ".join(line.lstrip("$ ") for line in file.read_text().splitlines() if line.startswith("$ "))


def test_choices_that_lsdyna_has_no_card_for_are_said(tmp_path: Path) -> None:
    coarse = {"bird.particles": "150", "target.generator.element_size": "50 mm"}
    text = comments_of(export("openradioss_panel", tmp_path / "p.k", deck=True, settings=coarse))
    assert "radially to the yield surface (return_mapping); these shells return it to the closest point" in text
    bricks = SMALL | {"bird.method": "hexahedra", "solver.hourglass": "viscous"}
    assert "not the case's solver.hourglass" in comments_of(
        export("demo_rig", tmp_path / "h.k", deck=True, settings=bricks)
    )
    assert "solver.hourglass" not in comments_of(export("demo_rig", tmp_path / "s.k", deck=True, settings=SMALL))


@pytest.mark.parametrize(("strain", "said"), [("0.2", True), ("10", False)])
def test_a_deck_for_radioss_says_that_shells_tear_with_their_first_layer(
    strain: str, said: bool, tmp_path: Path
) -> None:
    text = written("demo_rig", "radioss", "m-s-kg-Pa", tmp_path, **SMALL | {"plate.material.failure_strain": strain})
    assert ("a shell of plate with the first of its layers" in " ".join(text.split("\n#   "))) == said


def test_an_effect_without_a_card_does_not_take_the_others_with_it(tmp_path: Path) -> None:
    """A metal that softens by an energy has no card: the bird's cards were not written either."""
    sizes = {"plate_yield": 1e7, "bird_porosity": 0.02}
    found = [effect(name, size, interval_95=(0.5 * size, 2.0 * size), probability=0.5) for name, size in sizes.items()]
    written_diagnosis(tmp_path, *found, verdict="ambiguous", confidence_set=tuple(sizes), before=state(parameters={}))
    (tmp_path / "case.toml").write_text(
        'extends = "openradioss_panel"\n[target.materials.aluminium]\nfailure_strain = 0.2\n'
        'fracture_energy = "20 kN/m"\n'
    )
    file = export(tmp_path, tmp_path / "bird.k")
    assert re.search(r"It has no card here: .*fracture_energy", comments_of(file))
    assert "it changes the bird's equation of state; read its constants from the case" in comments_of(file)
    assert "*MAT_NULL" in file.read_text()


def test_sensors_of_a_mesh_that_lies_aslant_count_against_its_normal(tmp_path: Path) -> None:
    """A reaction along a direction of its own is left out: codes differ in its sign."""
    model = strike_model(aslant_strike(tmp_path, 30.0))
    found = {sensor.name: sensor.direction for sensor in model.sensors}
    for name in ("push", "frame", "force"):
        assert found[name] == pytest.approx([-0.5, 0.0, -np.sqrt(0.75)])
    assert "rim" not in found
    assert any(told.startswith("rim (reaction_force), along a direction of its own,") for told in model.missing)
