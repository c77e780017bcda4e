"""Keys of a case and what a careless or hostile hand puts under them: one strategy of values for all kinds of keys."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from birdstrike.data.units import ACCEPTED
from birdstrike.solver.case.sections import PHYSICAL_SECTIONS, quantities, quantity_at
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.fields import Between
from tests.solver.case.random_fields import Strategy, Table

TINY: Table = {
    "plate": {
        "length": "200 mm",
        "width": "160 mm",
        "thickness": "4 mm",
        "elements": [5, 4],
        "material": {"young": "71 GPa", "poisson": 0.3, "density": "2780 kg/m^3", "yield_stress": "300 MPa"},
    },
    "bird": {
        "shape": "hemispherical_cylinder",
        "diameter": "60 mm",
        "length": "120 mm",
        "density": "938 kg/m^3",
        "particles": 100,
        "material": {
            "model": "null",
            "pressure_cutoff": "-0.4 MPa",
            "viscosity": "300 Pa s",
            "tension_erosion": 0.0,
            "compression_erosion": 0.0,
            "eos": {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48},
        },
    },
    "impact": {"speed": "90 m/s", "angle": "40 deg"},
    "time": {"end": "0.06 ms"},
    "sensors": {
        "w": {"kind": "displacement", "at": ["10 mm", "0 mm"], "noise": "0.1 mm"},
        "e": {"kind": "strain", "side": "back"},
        "f": {"kind": "reaction_force"},
        "p": {"kind": "pressure"},
    },
}
"""A case of some milliseconds, every kind of sensor but one in it; its output interval is the default."""

PLAIN = (
    *PHYSICAL_SECTIONS,
    *("plate.elements", "plate.edges", "plate.preload", "plate.rigid", "plate.material", "plate.mesh"),
    *("bird.shape", "bird.method", "bird.particles", "bird.lattice", "bird.seed", "bird.statistics"),
    *("bird.material", "bird.material.model", "bird.material.eos", "bird.material.eos.kind", "bird.material.eos.file"),
    *("bird.material.eos.mu", "bird.material.eos.rho", "bird.material.eos.p"),
    *("impact.aim", "impact.offset", "time.snapshots", "extends", "external", "external.command", "nonsense"),
    *("sensors", "sensors.w", "sensors.w.kind", "sensors.w.at", "sensors.w.noise", "sensors.e.direction"),
    *("sensors.e.length", "sensors.e.side", "sensors.p.radius", 'sensors."a b".kind', "sensors.time.kind"),
    *("instrument", "instrument.w", "instrument.w.time_offset", "instrument.w.gain", "instrument.w.bandwidth"),
    *("instrument.w.drift", "instrument.f.drift", "instrument.x.gain"),
    *("solver", "solver.name", "solver.courant", "solver.shock_linear", "solver.shock_quadratic", "solver.smoothing"),
    *("solver.threads", "solver.hourglass", "solver.hourglass_coefficient", "solver.smallest_step"),
    *("inversion", "inversion.parameters", "inversion.nuisance", "inversion.nuisance.speed", "inversion.discrepancy"),
    *('inversion.parameters."bird.material.viscosity".range', 'inversion.parameters."bird.density"', "effects"),
)
KEYS = (*dict(quantities()), *PLAIN, *(f"effects.{name}" for name in effects()))
"""Every key of a case that holds a quantity, the other ones, and some that are none."""

WORDS = (
    *(
        "",
        " ",
        "nan",
        "inf",
        "-inf",
        "1e999",
        "none",
        "null",
        "true",
        "clamped",
        "pinned",
        "free",
        "sphere",
        "cylinder",
    ),
    *("sph", "hexahedra", "elastic", "hydrodynamic", "plastic_kinematic", "gelatine", "porous", "table", "murnaghan"),
    *("cubic", "axis", "first_touch", "viscous", "external", "demo", "reference_strike", "../x", "strain", "pressure"),
    *("1,5 mm", "1 000 mm", "1.5mm", "mm", "5 furlongs", "10 mm mm", "1e400 m", "1e-400 m", "١ mm", "½ mm", "10 µm"),
    *("{{ x }}", "%s", "\x00", "\ud7ff", "a.b", "[1", "x" * 300),
)
NUMBERS: Strategy[Any] = st.one_of(
    st.sampled_from([0, 1, -1, 2, 3, 1e-300, 1e300, -0.0, math.nan, math.inf, -math.inf, 10**30, 10**400, -(10**400)]),
    st.integers(-10, 500),
    st.floats(-10.0, 10.0),
)
UNITS = [unit for units in ACCEPTED.values() for unit in units.split(", ")]
ANY: Strategy[Any] = st.one_of(
    NUMBERS,
    st.booleans(),
    st.none(),
    st.sampled_from(WORDS),
    st.text(max_size=12),
    st.builds(lambda number, unit: f"{number} {unit}", NUMBERS, st.sampled_from(UNITS)),
)
TREES: Strategy[Any] = st.recursive(
    ANY,
    lambda below: st.one_of(
        st.lists(below, max_size=4), st.dictionaries(st.sampled_from(["kind", "model", "at", "x", "range"]), below)
    ),
    max_leaves=6,
)


def fitting(mark: Between) -> Strategy[Any]:
    """A value within a quantity's range, at any scale, ends included."""
    low, high = mark.bounds
    span = st.floats(0.0, 1.0).map(lambda share: low + (high - low) * share)
    fine = st.floats(-12.0, 0.0).map(lambda power: low + (high - low) * 10.0**power)
    return st.one_of(st.sampled_from([low, high]), span, fine).map(
        lambda si: f"{si!r} {mark.unit}" if mark.unit else si
    )


@st.composite
def settings_of(draw: st.DrawFn, count: int) -> Table:
    """As many settings by dotted key: of a quantity mostly a value in its range, else anything."""
    keys = draw(st.lists(st.sampled_from(KEYS), min_size=count, max_size=count, unique=True))
    return {key: draw(_value(key)) for key in keys}


def _value(key: str) -> Strategy[Any]:
    mark = quantity_at(key) or (Between("-1 m", "1 m") if key.startswith("effects.") else None)
    return TREES if mark is None else st.one_of(fitting(mark), fitting(mark), ANY)
