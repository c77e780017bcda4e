"""What a truth is: parameters, effects, sizes and signs drawn from a seed, on a finer mesh or by another model.

A truth stands on at least eight times the declared particles and twice the declared shells a side, on the other
lattice with a jitter of its own: the diagnosis knows that lattice only from four fine simulations of other birds, for
its intervals. In the model-form variant the bird is of hexahedra, or follows another equation of state with another
artificial viscosity, on three times the shells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.random import Generator

from birdstrike.data.errors import UserError
from birdstrike.data.units import quantity_text
from birdstrike.inversion.diagnosis.inference.hypotheses import family_of
from birdstrike.inversion.diagnosis.preparation.plan import OTHER_LATTICE, library
from birdstrike.inversion.diagnosis.preparation.shots import beside_declared, with_faults
from birdstrike.inversion.labels import label_parts
from birdstrike.solver.case.case import Case, case_from_table
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.effects.instrument import able
from birdstrike.solver.effects.registry import effect_named, effects, kind_of

CLEAN, SINGLE, PAIR, OUTSIDE = "clean", "single", "pair", "outside"
SHARES = {CLEAN: 0.30, SINGLE: 0.54, PAIR: 0.08, OUTSIDE: 0.08}
"""Of the truths. More single effects than the diagnosis' prior has, because most criteria are about them; the
reliability of the probabilities is weighted back to the prior."""
SMALLEST, LARGEST = 0.8, 3.0  # plausible sizes of an effect in a truth
PARTICLES, SHELLS, SHELLS_OF_FORM = 8, 2, 3  # times those declared
JITTER = 0.05  # of the particle spacing
INSIDE = 0.05  # of a parameter's range: distance of a truth from its ends
SPARE = 1e-4  # s beyond the declared end, for a record that starts early
STEP = 0.05  # of a parameter's range: of the differences that give its sensitivities
TRIES = 50
SHOTS = ("shot1", "shot2", "shot3")
BASELINE, OWN_BASELINE, HELDOUT = "baseline", "own_baseline", "heldout"
WITHOUT, SLOPE = "without", "slope"
CLEAN_ROLES = (BASELINE, OWN_BASELINE, WITHOUT)
"""Simulations of the rig and the bird as they are declared."""
OWN, HEXAHEDRA, OTHER_LAW = "own model", "hexahedral bird", "other equation of state"


@dataclass(frozen=True)
class Drawn:
    """One truth.

    number: of the draw, which all records of it share; parameters, clean: SI values of the shots and of the baseline;
    effects: label as in the answer -> SI magnitude; what, outside: something that no effect describes, in words and as
    a table of the case; form: the model that makes the truth; seed: of the lattices.
    """

    number: int
    kind: str
    parameters: Mapping[str, float]
    clean: Mapping[str, float]
    effects: Mapping[str, float]
    form: str
    seed: int
    what: str = ""
    outside: Raw = field(default_factory=dict)


def draw(case: Case, seed: int, number: int, forms: bool, attempt: int = 0) -> Drawn:
    """The truth of a number, the same for the same seed; attempt: counts truths whose simulation failed.

    forms: of the model-form variant.
    """
    rng = np.random.default_rng([seed, number, attempt, int(forms)])
    kind = str(np.random.default_rng([seed, number]).choice(list(SHARES), p=list(SHARES.values())))
    form = str(rng.choice([HEXAHEDRA, OTHER_LAW])) if forms else OWN
    what, outside = _outside(case, rng) if kind == OUTSIDE else ("", {})
    acting = _bearable(case, {SINGLE: 1, PAIR: 2}.get(kind, 0), rng)
    theta, clean = _parameters(case, rng), _parameters(case, rng)
    return Drawn(
        number=number,
        kind=kind,
        parameters=theta,
        clean=clean,
        effects=acting,
        form=form,
        seed=int(rng.integers(1_000_000)),
        what=what,
        outside=outside,
    )


def _parameters(case: Case, rng: Generator) -> dict[str, float]:
    return {p.name: float(p.low + rng.uniform(INSIDE, 1.0 - INSIDE) * (p.high - p.low)) for p in case.parameters()}


def _bearable(case: Case, count: int, rng: Generator) -> dict[str, float]:
    """Labels, sizes and signs of effects of different names, drawn again where the case cannot bear them together."""
    if not count:
        return {}
    for _ in range(TRIES):
        labels = [label_of(case, rng) for _ in range(count)]
        if len({name_of(label) for label in labels}) < count:
            continue
        acting = {label: _magnitude(case, label, rng) for label in labels}
        try:
            with_effects_of(case, acting, SHOTS[0]).resolved()
        except UserError:
            continue
        return acting
    raise UserError(f"{case.name} cannot carry {count} effects of {SMALLEST:g} to {LARGEST:g} plausible sizes")


def label_of(case: Case, rng: Generator) -> str:
    """One effect: a family, an effect of it, then a sensor, a set of nodes or a shot, as likely as in the diagnosis."""
    families, solver = dict[str, list[str]](), [one.name for one in library(case, case)[0]]
    for name, effect in effects().items():
        if not effect.refuses(case) if effect.fault is not None else name in map(kind_of, solver):
            families.setdefault(family_of(name), []).append(name)
    name = str(rng.choice(families[str(rng.choice(list(families)))]))
    if effects()[name].places(case):
        return str(rng.choice([one for one in solver if kind_of(one) == name]))
    if (fault := effects()[name].fault) is not None:
        return str(rng.choice([name, *(f"{name}.{sensor}" for sensor in able(case, fault, case.sensors))]))
    return f"{name}@{SHOTS[0]}" if effects()[name].scope == "shot" and rng.uniform() < 0.5 else name


def name_of(label: str) -> str:
    """The effect's name in a label such as `sensor_gain.displacement_centre` or `impact_speed@shot1`."""
    return label_parts(label)[0]


def sensor_of(label: str) -> str:
    """The sensor in a label such as `sensor_gain.displacement_centre`; empty of other effects, of one set or of all."""
    name, place, _ = label_parts(label)
    effect = effects().get(name)
    return "" if effect is None or effect.fault is None else place


def _magnitude(case: Case, label: str, rng: Generator) -> float:
    effect = effect_named(name_of(label) if sensor_of(label) else label.split("@")[0])
    sign = 1.0 if effect.one_sided(case) else float(rng.choice([-1.0, 1.0]))
    return sign * float(rng.uniform(SMALLEST, LARGEST)) * effect.size(case)


def _outside(case: Case, rng: Generator) -> tuple[str, Raw]:
    """Something that no effect of the library is, as a table of the case."""
    radius = float(rng.uniform(4.0, 10.0)) * case.plate.length
    stiffness = float(10 ** rng.uniform(7.0, 8.0))
    found = [
        (f"the panel is curved with a radius of {radius:.3g} m", {"plate": {"radius": quantity_text(radius, "m")}}),
        (
            f"the supports yield across the surface with {stiffness:.3g} N/m^2",
            {"plate": {"edges": {"transverse": quantity_text(stiffness, "N/m^2")}}},
        ),
        ("the bird is an ellipsoid of the same mass", _ellipsoid(case)),
    ]
    return found[int(rng.integers(len(found)))]


def _ellipsoid(case: Case) -> Raw:
    """Of the declared mass, length and diameter."""
    shape = "ellipsoid" if case.bird.shape != "ellipsoid" else "hemispherical_cylinder"
    return {"bird": {"shape": shape, "density": None, "mass": quantity_text(case.bird.actual_mass, "kg")}}


def roles(drawn: Drawn, case: Case, shots: int = len(SHOTS), *, own_baseline: bool = False) -> dict[str, Case]:
    """The simulations of a truth: shots, a repeat held out, a baseline, the first shot without effects, sensitivities.

    own_baseline: also one of the shots' bird, on a lattice of its own. `without` stands on the first shot's
    own lattice, so that their difference is the effect's and nothing else; sensitivities, on the declared mesh, are
    needed only to remove from it what the parameters imitate.
    """
    found = {shot: truth_case(case, drawn, i, shot) for i, shot in enumerate(SHOTS[:shots])}
    found[HELDOUT] = truth_case(case, drawn, len(SHOTS), SHOTS[0])
    found[BASELINE] = truth_case(case, drawn, len(SHOTS) + 1, BASELINE)
    if own_baseline:
        found[OWN_BASELINE] = truth_case(case, drawn, len(SHOTS) + 2, OWN_BASELINE)
    if drawn.effects:
        found[WITHOUT] = truth_case(case, drawn, 0, WITHOUT)
        for p in case.parameters():
            for sign in (-1.0, 1.0):
                value = drawn.parameters[p.name] + sign * STEP * (p.high - p.low)
                at = {**drawn.parameters, p.name: float(np.clip(value, p.low, p.high))}
                found[f"{SLOPE} {p.name} {sign:+.0f}"] = case.with_values(at)
    return found


def truth_case(case: Case, drawn: Drawn, lattice: int, role: str) -> Case:
    """One simulation of a truth."""
    formed = drawn.form != OWN
    times = SHELLS_OF_FORM if formed else SHELLS
    shells = (times * case.plate.elements[0], times * case.plate.elements[1])
    found = case.with_mesh(PARTICLES * case.bird.particles, shells)
    found = found.with_values(drawn.clean if role == BASELINE else drawn.parameters)
    if drawn.outside and role not in CLEAN_ROLES:
        found = replaced(found, drawn.outside)
    bird = {
        "lattice": OTHER_LATTICE[case.bird.lattice],
        "jitter": JITTER,
        "seed": drawn.seed + lattice,
    }
    found = found.overlaid({"bird": bird, "time": {"end": quantity_text(case.time.end + SPARE, "s")}})
    if formed:
        found = replaced(found, form_table(found, drawn.form))
    return found if role in CLEAN_ROLES else with_effects_of(found, drawn.effects, role)


def form_table(case: Case, form: str) -> Raw:
    """What another model of the same bird changes in a case.

    Murnaghan's law with the bulk modulus rho C^2 and its slope 4 S1 - 1 agrees with the shock line to second order in
    compression (Ruoff, J. Appl. Phys. 38 (1967) 4976).
    """
    if form == HEXAHEDRA:
        return {"bird": {"method": "hexahedra", "lattice": None, "jitter": None, "seed": None}}
    eos = case.table["bird"]["material"].get("eos", {})
    changed: Raw = {"solver": {"shock_linear": 2.0, "shock_quadratic": 4.0}}
    law: Any = case.bird.material.law
    if eos.get("kind") == "grueneisen":
        slope = max(4.0 * law.S1 - 1.0, 1.0)
        bulk = case.bird.actual_density * law.C**2
        murnaghan = {"kind": "murnaghan", "B": quantity_text(bulk / slope, "Pa"), "g": slope}
        changed["bird"] = {"material": {"eos": {**dict.fromkeys(eos), **murnaghan}}}
    return changed


def replaced(case: Case, table: Raw) -> Case:
    """The case with a table laid over its own; None takes a key away. What is calibrated is left out."""
    raw = {key: value for key, value in case.table.items() if key not in ("inversion", "diagnosis")}
    return case_from_table(_merged(raw, table), case.name)


def _merged(raw: Any, table: Mapping[str, Any]) -> Raw:
    found = dict(raw) if isinstance(raw, Mapping) else {}
    for key, value in table.items():
        if value is None:
            found.pop(key, None)
        else:
            found[key] = _merged(found.get(key), value) if isinstance(value, Mapping) else value
    return found


def with_effects_of(case: Case, effects: Mapping[str, float], shot: str) -> Case:
    """The case with effects by their labels (SI) beside those that it declares, those of another shot left out."""
    acting = {label: value for label, value in effects.items() if value and label.partition("@")[2] in ("", shot)}
    together = {label.split("@")[0]: value for label, value in acting.items() if not sensor_of(label)}
    common = {name: beside_declared(case, name, value) for name, value in together.items()}
    found = case.with_effects({**case.effects, **common}) if common else case
    faults = [(sensor, name_of(label), value) for label, value in acting.items() if (sensor := sensor_of(label))]
    return with_faults(found, faults)
