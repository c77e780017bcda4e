"""docs/cases.md: every key of a case with unit, range, default and meaning, from the models that read a case.

`python docs/case_keys.py` writes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic.fields import FieldInfo

from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.case import load_case
from birdstrike.solver.case.effects import SHOWN, shown
from birdstrike.solver.case.external import FORMATS, External, Text, UnitText
from birdstrike.solver.case.plate import EDGE_WORDS, EdgeSprings, Plate, PlateMaterial
from birdstrike.solver.case.sections import Impact, Time, is_list, sections_of
from birdstrike.solver.case.settings import NUISANCE, SolverSettings
from birdstrike.solver.case.target import Part, Rivets, Target, Tie
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.fields import Between, Count, OneOf, Section, Switch, WordOr
from birdstrike.solver.sensors.instrument import Instrument
from birdstrike.solver.sensors.registry import SENSORS as SENSOR_KINDS
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.registry import TARGET_LAWS

PLATE = {
    "plate.length": "Size along the plane of the velocity; of a curved panel, along its arc.",
    "plate.width": "Size across it.",
    "plate.thickness": "Of the shell; of a rigid plate only the height of its surface.",
    "plate.elements": "Shells along length and width.",
    "plate.edges": "How the frame holds the rim: a word, or a table of springs.",
    "plate.edges.rotational": "Spring against rotation, per length of edge; absent: held rigidly, 0: free.",
    "plate.edges.in_plane": "Spring along the surface, per length of edge; absent: held rigidly, 0: free.",
    "plate.edges.transverse": "Spring across the surface, per length of edge; absent: held rigidly, 0: free.",
    "plate.damping": "Rate at which a free vibration's amplitude decays.",
    "plate.preload": "Initial tension along length and width.",
    "plate.radius": "Of a panel curved about the width's direction, convex to the bird; absent: flat.",
    "plate.rigid": "The plate neither moves nor strains; its material may then be left out.",
    "plate.material.young": "Young's modulus.",
    "plate.material.poisson": "Poisson's ratio.",
    "plate.material.density": "Density.",
    "plate.material.yield_stress": "Initial yield stress.",
    "plate.material.tangent_modulus": "Slope of the stress-strain curve beyond yield; below Young's modulus.",
    "plate.material.beta": "Hardening: 0 kinematic .. 1 isotropic.",
    "plate.material.rate_c": "Cowper-Symonds C of 1 + (rate/C)^(1/P); 0 is off.",
    "plate.material.rate_p": "Cowper-Symonds P.",
    "plate.material.failure_strain": "Plastic strain at which a layer fails; a shell goes with its last layer.",
}
TARGET = {
    "target.damping": "Rate at which a free vibration's amplitude decays.",
    "target.parts.<name>.thickness": "Of the part's shells; every part of the mesh must be named.",
    "target.parts.<name>.material": "Name of its material, a table under `target.materials`.",
    "target.supports.<set>": "How a set of nodes of the mesh is held: a word, or springs as of a plate's edges.",
    "target.mesh": "Mesh file, not a generator: Abaqus, Gmsh, Nastran, LS-DYNA, VTK; relative to the case file.",
    "target.mesh_unit": "Unit of length of that file; required with it.",
    "target.origin": "Point of the file's axes on which the bird is aimed, which becomes the origin.",
    "target.struck": "Part that the bird is aimed at; absent: the file's first.",
    "target.generator.kind": "Which mesh is made.",
    "target.generator.length": "Size along the plane of the velocity.",
    "target.generator.width": "Size across it, along which stiffeners run.",
    "target.generator.element_size": "Wanted side of a shell; the nearest that divides each length is taken.",
    "target.generator.cells": "Equal stretches of the rim, the sets cell_1, cell_2, ...; 0: none.",
    "target.generator.stiffeners": "How many; 0 is a bare skin.",
    "target.generator.pitch": "Between two stiffeners, which stand symmetric about the centre.",
    "target.generator.height": "Of a stiffener's web, from the skin's mid-surface.",
    "target.generator.section": 'Of a stiffener: a web alone, an angle ("L"), or foot, web and inner flange ("Z").',
    "target.generator.flange": "Width of the inner flange, along the length.",
    "target.generator.foot": "Width of a riveted stiffener's flange on the skin; absent: it shares the skin's nodes.",
    "target.generator.lap": "Between the mid-surfaces of sheets that lie on each other.",
    "target.generator.rivet_pitch": "Of all rows of rivets.",
    "target.generator.overlap": "Width of the lap joint of two skins; absent: one skin.",
    "target.generator.joint": "Middle of that joint along the length, from the centre.",
    "target.generator.pad": "Length and width of a sheet riveted behind the skin; absent: none.",
    "target.generator.pad_at": "Its middle.",
    "target.generator.radius": "Of a skin curved about the width's direction, convex to the bird; absent: flat.",
    "target.ties.<name>.nodes": "Set of nodes that follow another part.",
    "target.ties.<name>.onto": "The part that they follow.",
    "target.ties.<name>.distance": "Up to which a node of the set is tied, from the part's mid-surface.",
    "target.rivets.<row>.tension_strength": "Force along a rivet at which it breaks alone.",
    "target.rivets.<row>.shear_strength": "Force across it at which it breaks alone.",
    "target.rivets.<row>.exponents": "a and b of (N/tension)^a + (S/shear)^b = 1.",
    "target.rivets.<row>.tension_stiffness": "Spring along a rivet.",
    "target.rivets.<row>.shear_stiffness": "Spring across it.",
    "target.rivets.<row>.rotational_stiffness": "Spring against relative rotation, alike about all axes.",
    "target.rivets.<row>.parts": "The two parts that a row of your own joins; rows of the generator have theirs.",
    "target.rivets.<row>.start": "First rivet of a row of your own.",
    "target.rivets.<row>.end": "Last rivet of it.",
    "target.rivets.<row>.pitch": "Between its rivets; the nearest that divides the row is taken.",
    "target.materials.<name>.law": "Which law; the tables below have its constants.",
    "target.materials.<name>.density": "Density.",
    "target.materials.<name>.young": "Young's modulus.",
    "target.materials.<name>.poisson": "Poisson's ratio.",
    "target.materials.<name>.failure_strain": "Plastic strain at which a layer fails; absent: never.",
    "target.materials.<name>.fracture_energy": "Energy per area of crack that a failing layer still takes, "
    "whatever the size of the shells; 0: it carries nothing at once.",
    "target.materials.<name>.return_mapping": "How a stress beyond yield returns to the yield surface: closest_point "
    "under plane stress, or radial, all components alike, as OpenRadioss's shells do by default (softer).",
    "target.materials.<name>.rate_c": "Cowper-Symonds C of 1 + (rate/C)^(1/P); 0 is off.",
    "target.materials.<name>.rate_p": "Cowper-Symonds P.",
    "target.materials.<name>.yield_stress": "Initial yield stress.",
    "target.materials.<name>.tangent_modulus": "Slope of the stress-strain curve beyond yield; below Young's modulus.",
    "target.materials.<name>.beta": "Hardening: 0 kinematic .. 1 isotropic.",
    "target.materials.<name>.a": "Of the flow stress a + b eps_p^n.",
    "target.materials.<name>.b": "Of the flow stress a + b eps_p^n.",
    "target.materials.<name>.n": "Of the flow stress a + b eps_p^n.",
    "target.materials.<name>.plastic_strain": "Of the table's points, from 0 and rising; at most 32.",
    "target.materials.<name>.flow_stress": "At those points, never falling; straight between, constant beyond.",
    "target.materials.<name>.c": "Of the rate factor 1 + c ln(rate/rate0).",
    "target.materials.<name>.rate0": "Plastic strain rate below which the rate does not act.",
    "target.materials.<name>.m": "Of the heat factor 1 - T*^m, T* = (T - reference)/(melt - reference).",
    "target.materials.<name>.start": "Temperature before the impact; needs melt and specific_heat.",
    "target.materials.<name>.reference": "Temperature at which a, b, n were found.",
    "target.materials.<name>.melt": "Melting temperature; absent: heat does not soften.",
    "target.materials.<name>.specific_heat": "Heat per mass and kelvin; with melt.",
    "target.materials.<name>.heat_share": "Share of the plastic work that becomes heat.",
    "target.materials.<name>.D": "D1 .. D5 of Johnson and Cook's strain at fracture, D3 below 0 for a metal that "
    "breaks sooner in tension; in place of failure_strain.",
}
BIRD = {
    "bird.shape": "Ideal shape, its axis along the velocity.",
    "bird.diameter": "Largest diameter; follows from the mass where slenderness or statistics stand instead.",
    "bird.length": "Overall length from nose to tail, hemispheres included; a sphere's is its diameter.",
    "bird.mass": "Mass; with diameter and length it gives the density, so that density must be left out.",
    "bird.density": "Reference density of the material; a porous law gives it where none stands.",
    "bird.slenderness": "Length over diameter; with mass and density it gives the size, which "
    "a sphere's mass and density give alone.",
    "bird.statistics": "Density and diameter of real birds of this mass.",
    "bird.method": "Particles (SPH), or Lagrangian one-point hexahedra.",
    "bird.particles": "Number of particles or elements wanted; the nearest that fits is taken.",
    "bird.lattice": "Arrangement of the particles (SPH only).",
    "bird.jitter": "Random shift of each particle, share of the spacing (SPH only).",
    "bird.seed": "Of the jitter (SPH only).",
}
NULL = {
    "pressure_cutoff": "Lowest pressure that the material carries.",
    "viscosity": "Dynamic viscosity MU.",
    "tension_erosion": "V/V0 above which a particle erodes; acts above 1, else inactive.",
    "compression_erosion": "V/V0 below which a particle erodes; acts between 0 and 1, else inactive.",
}
STRENGTH = {
    "young": "Young's modulus.",
    "poisson": "Poisson's ratio.",
    "shear_modulus": "Shear modulus.",
    "yield_stress": "Initial yield stress.",
    "tangent_modulus": "Slope of the stress-strain curve beyond yield; below Young's modulus.",
    "hardening_modulus": "Plastic hardening modulus EH, stress over plastic strain.",
    "beta": "Hardening: 0 kinematic .. 1 isotropic.",
    "rate_c": "Cowper-Symonds C of 1 + (rate/C)^(1/P); 0 is off.",
    "rate_p": "Cowper-Symonds P.",
    "failure_strain": "Equivalent plastic strain, summed along its path, at which a particle erodes.",
}
LAW = {
    "grueneisen.C": "Shock velocity u_s = C + S1 u + ...: sound speed at rest.",
    "grueneisen.S1": "Linear slope of the shock line.",
    "grueneisen.S2": "Second coefficient.",
    "grueneisen.S3": "Third coefficient.",
    "grueneisen.g0": "Grueneisen gamma.",
    "grueneisen.a": "First-order volume correction to it.",
    "C0": "Pressure at rest; other than 0 it bursts or shrinks the bird in flight.",
    "C1": "Bulk modulus, of mu = rho/rho0 - 1.",
    "C2": "Of mu^2, in compression alone.",
    "C3": "Of mu^3.",
    "C4": "Of the energy per volume E.",
    "C5": "Of mu E.",
    "C6": "Of mu^2 E, in compression alone.",
    "E0": "Energy per reference volume at rest; where it gives a pressure, the bird bursts in flight.",
    "p0": "Pressure at rest; other than 0 it bursts or shrinks the bird in flight.",
    "B": "p = p0 + B[(rho/rho0)^g - 1].",
    "g": "Its exponent.",
    "c0": "Sound speed of the shock line u_s = c0 + k u; of the water in a porous law.",
    "k": "Slope of that line.",
    "z": "Share of air in the volume.",
    "mixing": "wood: one pressure in both; linear: a mean sound speed, as published but not physical.",
    "water_density": "Of the water without air.",
    "rho": "Densities of the table, rising; or mu.",
    "mu": "rho/rho0 - 1 of the table, rising; or rho.",
    "p": "Pressures of the table, rising; `file` may name a CSV of rho or mu and p instead, relative to the case file.",
}
STRIKE = {
    "impact.speed": "Of the bird.",
    "impact.angle": "Between its velocity and the plate's surface; 90 deg is normal.",
    "impact.aim": "What meets the plate's centre: the bird's axis, or its first touch.",
    "impact.standoff": "Way flown before the bird's ideal surface touches: it sets t = 0.",
    "impact.offset": "From the plate's centre to the point of aim, along length and width.",
    "impact.point": "In space, through which the bird's axis flies; `offset` then counts from it.",
    "impact.direction": "Of the velocity, a vector of any length with a negative third component; gives `angle`, in "
    "place of an inherited one.",
    "impact.pitch": "Of the bird's axis out of its velocity, nose up from the surface; not of a sphere.",
    "impact.yaw": "Of the bird's axis out of its velocity, towards the plate's width; not of a sphere.",
    "impact.friction": "Coulomb coefficient between bird and plate.",
    "time.end": "End of the run.",
    "time.output_interval": "Between two outputs of the sensors.",
    "time.snapshots": "Instants at which the fields are kept, for the report's animation and for `simulate --fields`.",
}
SENSORS = {
    "sensors.<name>.kind": "What it reads; displacement and forces are positive in the push.",
    "sensors.<name>.at": "Place from the plate's centre along length and width (displacement, strain, pressure).",
    "sensors.<name>.point": "Place in space instead of `at`; the nearest place of the target at rest is taken, "
    "at most half a shell away.",
    "sensors.<name>.part": "Part of the target on which that place lies; absent: any.",
    "sensors.<name>.along": "Direction in space: of a displacement or a reaction force, absent: the push; "
    "of a gauge, laid on the shell.",
    "sensors.<name>.support": "Of a reaction force: the set of the target's supports under which the load cell is; "
    "absent: the whole frame.",
    "sensors.<name>.noise": "One standard deviation, in the unit of its kind; absent or 0: none is known.",
    "sensors.<name>.measure": "Of a strain: of a rosette at the place instead of one gauge.",
    "sensors.<name>.direction": "Of a strain gauge, on the shell, from the length axis towards the width's.",
    "sensors.<name>.side": "Of a strain gauge; impact: towards z > 0, of an upright shell towards x > 0.",
    "sensors.<name>.length": "Of a strain gauge, both ends on the plate; absent: a point.",
    "sensors.<name>.radius": "Of a pressure gauge; below three particle spacings it is coarse.",
    "instrument.<sensor>.time_offset": "By how much the record is late.",
    "instrument.<sensor>.gain": "Factor on the signal.",
    "instrument.<sensor>.bandwidth": "Of a first-order low-pass (-3 dB); absent: none.",
    "instrument.<sensor>.drift": "Per second from the record's time 0, in the unit of the sensor's kind.",
}
SETTINGS = {
    "solver.name": 'Ours, or a command of yours: `solver = "external"` with a section `[external]`.',
    "solver.courant": "Share of the stable step.",
    "solver.shock_linear": "Linear part of the artificial viscosity, on shocks only; 1 stands for the usual.",
    "solver.shock_quadratic": "Quadratic part of it; 2 stands for the usual.",
    "solver.smoothing": "Smoothing length over particle spacing (SPH only).",
    "solver.threads": "Absent: all cores. They change no bit of a history.",
    "solver.hourglass": "Control of hexahedra; absent: stiffness for an elastic bird, viscous for others.",
    "solver.hourglass_coefficient": "Of that control; absent: 0.02 viscous, 0.05 stiffness.",
    "solver.smallest_step": "An element whose stable step falls below this share of the first is eroded.",
    'inversion.parameters."<key>".range': "Lower and upper limit of a parameter to be sought, in its own unit.",
    'inversion.parameters."<key>".scale': "In which its designs spread, and its prior is normal.",
    'inversion.parameters."<key>".prior': "What is known of it beside the range, normal in its `scale` "
    "(log-normal over a logarithmic one) and cut off there: "
    '`{ mean = "300 Pa s", sd = "80 Pa s" }`.',
    'inversion.models.<model>."<key>".range': "Limits of a constant in `birdstrike calibrate-models`, for the model of "
    "that name (such as `murnaghan`), in place of the model's own list; a key of `bird.material`, or "
    "`bird.density`; `scale` and `prior` as above.",
    "diagnosis.baselines": "Records of shots at the same rig in which nothing is suspected, as `diagnose --baseline` "
    "takes them; a path is relative to the case's file.",
    "diagnosis.baseline_bird": "Bird of those beside the shot's, as `diagnose --baseline-bird` takes it: of one batch, "
    "of one recipe, unlike; by default the records decide.",
    "inversion.nuisance.time_offset": "Known uncertainty of the time origin, one standard deviation.",
    "inversion.nuisance.speed": "Of the measured speed, one standard deviation.",
    "inversion.nuisance.mass": "Of the bird's mass, one standard deviation.",
    "inversion.nuisance.thickness": "Of the plate's thickness, one standard deviation.",
    "inversion.nuisance.angle": "Of the impact's angle, one standard deviation.",
    "inversion.discrepancy.<sensor>": "Slow error of the model, one standard deviation, as a share of the largest "
    "value that the sensor recorded; `train-and-invert --discrepancy` replaces it for every sensor. A diagnosis takes "
    "one for each kind of sensor, the largest.",
}
EXTERNAL = {
    "external.command": "Words of the command; `{input}` stands for the deck's name.",
    "external.template": "The deck with `{{ placeholders }}`, relative to the case file.",
    "external.version": "Solver and release; part of every run's name in the store.",
    "external.sensors": "For every sensor of the case a table, below, that says where the solver writes it.",
    "external.files": "Other files that the deck needs beside it.",
    "external.success": "Text without which the output does not count as a normal end.",
    "external.time_limit": "After which the command is stopped and the run failed.",
    "external.keep": "Which runs' folders stay.",
    "external.scratch": "Where the folders are made; absent: the system's temporary folder.",
    "external.sensors.<name>.format": "Of the file in which the sensor stands.",
    "external.sensors.<name>.file": "Its name in the run's folder.",
    "external.sensors.<name>.unit": "Of its values there.",
    "external.sensors.<name>.time_unit": "Of its times there.",
    "external.sensors.<name>.factor": "On its values, such as -1 for the sign; not 0.",
    "external.sensors.<name>.column": "Its column: a name of a CSV's header, or a number, the time's being 1.",
    "external.sensors.<name>.time": "Name of the time's column; absent: the first.",
    "external.sensors.<name>.node": "Number of the node.",
    "external.sensors.<name>.component": "As the header of nodout names it, such as z-disp.",
}


PAGE = Path(__file__).resolve().with_name("cases.md")
INTRODUCTION = """# The keys of a case

Made by `python docs/case_keys.py` from the models that read a case; do not edit it by hand. A case is a
TOML file. A quantity is text with its unit (`"10 mm"`), a dimensionless one a bare number; any unit of the same
dimension will do. Keys that are not listed here are errors. `extends = "reference_strike"` starts from a shipped case,
or from a file beside this one, and `without = ["sensors.strain_back"]` takes keys of that case away. A key that would
do nothing in a case (`bird.lattice` with hexahedra, `plate.damping` of a rigid plate) is refused where the case itself
gives it, and void where it is inherited.
"""
HEAD = "| key | unit | range | default | meaning |\n|---|---|---|---|---|"

Row = tuple[str, str, str, str, str]


def page() -> str:
    """The whole page."""
    parts = [INTRODUCTION]
    for title, rows in chapters():
        body = "\n".join("| " + " | ".join(row) + " |" for row in rows)
        parts.append(f"## {title}\n\n{HEAD}\n{body}\n")
    return "\n".join(parts)


def chapters() -> Iterator[tuple[str, list[Row]]]:
    """Title and rows of each table."""
    yield "Plate", list(rows(Plate, "plate", PLATE))
    yield "Plate: springs at its edges", list(rows(EdgeSprings, "plate.edges", PLATE))
    yield "Plate: material", list(rows(PlateMaterial, "plate.material", PLATE))
    yield "Target", list(of_target())
    yield "Target: `parts.<name>`", list(rows(Part, "target.parts.<name>", TARGET))
    yield "Target: `ties.<name>`", list(rows(Tie, "target.ties.<name>", TARGET))
    yield "Target: `rivets.<row>`", list(rows(Rivets, "target.rivets.<row>", TARGET))
    for kind, generator in GENERATORS.items():
        yield f'Target: `generator.kind = "{kind}"`', list(rows(generator, "target.generator", TARGET))
    for law, material in TARGET_LAWS.items():
        yield f'Target: `materials.<name>.law = "{law}"`', list(rows(material, "target.materials.<name>", TARGET))
    yield "Bird", list(rows(Bird, "bird", BIRD))
    for model, section in BIRD_MATERIALS.items():
        yield f'Bird: `material.model = "{model}"`', list(rows(section, "bird.material", NULL | STRENGTH))
    for kind, law in EQUATIONS_OF_STATE.items():
        own = {key.removeprefix(f"{kind}."): text for key, text in LAW.items()}
        yield f'Bird: `material.eos.kind = "{kind}"`', list(rows(law, "bird.material.eos", own))
    yield "Impact", list(rows(Impact, "impact", STRIKE))
    yield "Time", list(rows(Time, "time", STRIKE))
    yield "Sensors", list(of_sensors())
    yield "Instruments", list(rows(Instrument, "instrument.<sensor>", SENSORS))
    yield "Solver", list(rows(SolverSettings, "solver", SETTINGS))
    yield "External solver", list(rows(External, "external", EXTERNAL))
    for kind, reading in FORMATS.items():
        yield f'External solver: `format = "{kind}"`', list(rows(reading, "external.sensors.<name>", EXTERNAL))
    yield "Effects", list(of_effects())
    yield "Inversion", list(inversion())


def rows(section: type[Section], prefix: str, meanings: dict[str, str]) -> Iterator[Row]:
    """A section's own keys; those of nested tables have tables of their own."""
    for name, field in section.model_fields.items():
        nested = list(sections_of(field)) and not any(isinstance(mark, WordOr) for mark in field.metadata)
        if nested or (name in ("model", "kind", "law") and not field.metadata):
            continue
        key = f"{prefix}.{name}"
        unit, span = of_kind(key) or described(field)
        meaning = meanings.get(key) or meanings.get(name, "")
        yield f"`{key}`", unit, span, default(field), meaning


def of_sensors() -> Iterator[Row]:
    """The kinds of sensors, then the keys of all of them: those that every kind has first."""
    kind = "sensors.<name>.kind"
    yield f"`{kind}`", "word", ", ".join(f'"{name}"' for name in SENSOR_KINDS), "required", SENSORS[kind]
    found = {row: None for section in SENSOR_KINDS.values() for row in rows(section, "sensors.<name>", SENSORS)}
    shared = ("`sensors.<name>.at`", "`sensors.<name>.noise`")
    yield from sorted(found, key=lambda row: shared.index(row[0]) if row[0] in shared else len(shared))


def of_target() -> Iterator[Row]:
    """What a target of several parts says once."""
    for key, kinds in (("target.generator.kind", GENERATORS), ("target.materials.<name>.law", TARGET_LAWS)):
        yield f"`{key}`", "word", ", ".join(f'"{name}"' for name in kinds), "required", TARGET[key]
    words = ", ".join(f'"{word}"' for word in EDGE_WORDS)
    yield "`target.supports.<set>`", "word or table", words, "free", TARGET["target.supports.<set>"]
    own = {f"`target.{key}`" for key in ("mesh", "mesh_unit", "origin", "struck", "damping")}
    yield from (row for row in rows(Target, "target", TARGET) if row[0] in own)


def of_effects() -> Iterator[Row]:
    """What a case may lack, by the registry; 0 is absent, sizes are those of the reference strike."""
    case = load_case("reference_strike")
    for name, effect in effects().items():
        signs = "above 0" if effect.one_sided(case) else "both signs"
        size = f"{signs}; a plausible size is {shown(effect.size(case), effect.unit).lstrip('+')}"
        meaning = effect.meaning[0].upper() + effect.meaning[1:] + "."
        unit = SHOWN.get(effect.unit, effect.unit) or "number"
        yield f"`effects.{name}`", unit, size, "0", meaning
        if effect.alone is not None:
            alone = f"The same of one set of nodes alone, beside `effects.{name}`; of a target with several supports."
            yield f"`effects.{name}.<set>`", unit, size, "0", alone


def inversion() -> Iterator[Row]:
    """Keys whose names are the user's."""
    sought = 'inversion.parameters."<key>".range'
    yield f"`{sought}`", "of the key", "within the key's own", "none", SETTINGS[sought]
    scale = sought.replace(".range", ".scale")
    yield f"`{scale}`", "word", '"linear", "logarithmic"', '"linear"', SETTINGS[scale]
    prior = sought.replace(".range", ".prior")
    yield f"`{prior}`", "of the key", "mean within the range, sd above 0", "the range alone", SETTINGS[prior]
    own = 'inversion.models.<model>."<key>".range'
    yield f"`{own}`", "of the key", "within the key's own", "the model's", SETTINGS[own]
    for name, mark in NUISANCE.items():
        key = f"inversion.nuisance.{name}"
        yield f"`{key}`", mark.shown, f"{mark.low} .. {mark.high}", "none", SETTINGS.get(key, "")
    key = "inversion.discrepancy.<sensor>"
    yield f"`{key}`", "%", "0 % .. 100 %", "none", SETTINGS[key]
    key = "diagnosis.baselines"
    yield f"`{key}`", "list: text", 'such as "clean.csv"', "none", SETTINGS[key]
    key = "diagnosis.baseline_bird"
    yield f"`{key}`", "word", '"auto", "same", "recipe", "other"', '"auto"', SETTINGS[key]


def of_kind(key: str) -> tuple[str, str] | None:
    """Unit and range of what depends on the sensor's kind."""
    name = key.rpartition(".")[2]
    if name not in ("noise", "drift"):
        return None
    marks = (getattr(kind, f"{name}_range") for kind in SENSOR_KINDS.values())
    return ", ".join(dict.fromkeys(mark.shown or "number" for mark in marks)), "by the sensor's kind"


def marks_of(field: FieldInfo) -> list[Any]:
    """Annotations of a field, of a list's entries too."""
    return [*field.metadata, *within(field.annotation)]


def within(annotation: Any) -> Iterator[Any]:
    """Annotations inside a type, however deep."""
    for part in get_args(annotation):
        yield from getattr(part, "__metadata__", ())
        yield from within(part)


def described(field: FieldInfo) -> tuple[str, str]:
    """Unit and range."""
    several = is_list(field) or any(get_origin(part) is tuple for part in get_args(field.annotation))
    many = "list: " if several else ""
    for mark in marks_of(field):
        if isinstance(mark, Between):
            return many + (mark.shown or "number"), f"{mark.low} .. {mark.high}"
        if isinstance(mark, Count):
            return many + "whole number", f"{mark.low} .. {mark.high}"
        if isinstance(mark, Text | UnitText):
            return f"{many}text", f"such as {mark.hint}" if isinstance(mark, Text) else "a unit"
        if isinstance(mark, OneOf):
            return "word", ", ".join(f'"{word}"' for word in mark.available)
        if isinstance(mark, WordOr):
            return "word or table", ", ".join(f'"{word}"' for word in mark.words)
        if isinstance(mark, Switch):
            return "switch", "true, false"
    kinds = get_args(field.annotation) if get_origin(field.annotation) is not dict else ()
    return ("text", "a name") if str in (field.annotation, *kinds) else ("", "")


def default(field: FieldInfo) -> str:
    """The default as a case would write it."""
    if field.is_required():
        return "required"
    value, mark = (
        field.get_default(call_default_factory=True),
        next((mark for mark in marks_of(field) if isinstance(mark, Between)), None),
    )
    if value is None or value in ((), {}):
        return "none"
    return written(value, mark)


def written(value: Any, mark: Between | None) -> str:
    """A value in the unit of its range."""
    if isinstance(value, tuple):
        return f"[{', '.join(written(one, mark) for one in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    shown = f"{value:g}" if mark is None else mark.display(value)
    return f'"{shown}"' if mark is not None and mark.unit else shown


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
