"""Random valid cases, as the tables that a case file gives: one strategy a section, so that a new model is one entry.

To teach the search a new model, add its table to the section's list below; `CASES` is what the fuzz test draws from.
"""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from solver.bird_shape import volume

Table = dict[str, Any]
Strategy = st.SearchStrategy


def quantity(low: float, high: float, unit: str) -> Strategy[str]:
    """A quantity as a case writes it, three digits, ends included."""
    return st.floats(low, high, allow_nan=False).map(lambda value: f"{value:.3g} {unit}".strip())


def number(low: float, high: float) -> Strategy[float]:
    """A dimensionless number, three digits."""
    return st.floats(low, high, allow_nan=False).map(lambda value: float(f"{value:.3g}"))


def off_or(active: Strategy[Any], off: Any) -> Strategy[Any]:
    """A feature that is absent as often as present."""
    return st.one_of(st.just(off), active)


EOS: list[Strategy[Table]] = [
    st.fixed_dictionaries(
        {"kind": st.just("grueneisen"), "C": quantity(300.0, 2500.0, "m/s"), "S1": number(0.0, 3.0)},
        optional={"S2": number(-1.0, 1.0), "S3": number(-1.0, 1.0), "g0": number(0.0, 2.0), "a": number(0.0, 1.0)},
    ),
    st.fixed_dictionaries(
        {"kind": st.just("linear_polynomial"), "C1": quantity(200.0, 3000.0, "MPa")},
        optional={
            "C2": quantity(-500.0, 8000.0, "MPa"),
            "C3": quantity(0.0, 12000.0, "MPa"),
            "C5": number(0.0, 1.0),
            "C4": number(0.0, 1.0),
            "E0": quantity(0.0, 1.0, "MPa"),
        },
    ),
    st.fixed_dictionaries(
        {"kind": st.just("murnaghan"), "B": quantity(8.0, 1000.0, "MPa"), "g": number(1.0, 8.0)},
        optional={"p0": quantity(-0.1, 0.1, "MPa")},
    ),
    st.fixed_dictionaries(
        {"kind": st.just("polynomial_k"), "c0": quantity(300.0, 2000.0, "m/s"), "k": number(1.0, 3.0)}
    ),
    st.fixed_dictionaries(
        {"kind": st.just("porous"), "z": number(0.0, 0.4), "mixing": st.sampled_from(["wood", "linear"])}
    ),
    st.just(
        {"kind": "table", "mu": [-0.1, 0.0, 0.1, 0.3, 1.0], "p": ["-50 MPa", "0 MPa", "300 MPa", "2 GPa", "20 GPa"]}
    ),
]
"""Equations of state, one entry each."""

BIRD_MATERIALS: list[Strategy[Table]] = [
    st.fixed_dictionaries(
        {
            "model": st.just("null"),
            "pressure_cutoff": quantity(-5.0, 0.0, "MPa"),
            "viscosity": off_or(quantity(0.0, 3000.0, "Pa s"), "0 Pa s"),
            "tension_erosion": off_or(number(1.02, 1.5), 0.0),
            "compression_erosion": off_or(number(0.8, 0.99), 0.0),
            "eos": st.one_of(EOS),
        }
    ),
    st.fixed_dictionaries(
        {"model": st.just("elastic"), "young": quantity(5.0, 500.0, "MPa"), "poisson": number(0.2, 0.495)}
    ),
    st.fixed_dictionaries(
        {
            "model": st.just("plastic_kinematic"),
            "young": quantity(20.0, 500.0, "MPa"),
            "poisson": number(0.2, 0.495),
            "yield_stress": quantity(0.001, 5.0, "MPa"),
        },
        optional={
            "tangent_modulus": quantity(0.0, 15.0, "MPa"),
            "beta": number(0.0, 1.0),
            "rate_c": quantity(10.0, 10000.0, "1/s"),
            "rate_p": number(1.0, 6.0),
            "failure_strain": number(0.2, 3.0),
        },
    ),
    st.fixed_dictionaries(
        {
            "model": st.just("hydrodynamic"),
            "shear_modulus": quantity(1.0, 100.0, "MPa"),
            "yield_stress": quantity(0.001, 2.0, "MPa"),
            "pressure_cutoff": quantity(-5.0, 0.0, "MPa"),
            "eos": st.one_of(EOS),
        },
        optional={"hardening_modulus": quantity(0.0, 1.0, "MPa"), "failure_strain": number(0.2, 3.0)},
    ),
]
"""Bird materials, one entry each."""

DISCRETISATIONS: list[Strategy[Table]] = [
    st.fixed_dictionaries(
        {
            "method": st.just("sph"),
            "lattice": st.sampled_from(["fcc", "cubic"]),
            "particles": st.integers(100, 150),
        },
        optional={"jitter": number(0.0, 0.2), "seed": st.integers(0, 9)},
    ),
    st.fixed_dictionaries({"method": st.just("hexahedra"), "particles": st.integers(100, 150)}),
]
"""How the bird is divided, one entry each."""


@st.composite
def birds(draw: st.DrawFn) -> Table:
    """A bird of 20 to 150 mm; its length is never below its diameter where the shape forbids it."""
    shape = draw(st.sampled_from(["hemispherical_cylinder", "cylinder", "ellipsoid", "sphere"]))
    diameter = draw(st.integers(20, 150))
    bird: Table = {"shape": shape, "diameter": f"{diameter} mm"}
    if shape != "sphere":
        bird["length"] = f"{draw(number(1.0 if shape == 'hemispherical_cylinder' else 0.5, 3.0)) * diameter:.6g} mm"
    if draw(st.booleans()):
        bird["density"] = draw(quantity(300.0, 1500.0, "kg/m^3"))
    else:
        long = 1e-3 * float(bird.get("length", bird["diameter"]).split()[0])
        bird["mass"] = f"{1000.0 * volume(shape, 1e-3 * diameter, long) * draw(number(300.0, 1500.0)):.4g} g"
    return bird | draw(st.one_of(DISCRETISATIONS)) | {"material": draw(st.one_of(BIRD_MATERIALS))}


PLATE_MATERIALS: list[Strategy[Table]] = [
    st.fixed_dictionaries(
        {
            "young": quantity(1.0, 250.0, "GPa"),
            "poisson": number(0.0, 0.45),
            "density": quantity(900.0, 9000.0, "kg/m^3"),
            "yield_stress": quantity(20.0, 2000.0, "MPa"),
            "tangent_modulus": off_or(quantity(0.0, 900.0, "MPa"), "0 MPa"),
            "beta": number(0.0, 1.0),
        }
    ),
]
"""Plate materials, one entry each."""

EDGES: list[Strategy[Any]] = [st.sampled_from(["clamped", "pinned", "free"])]
"""What holds the plate, one entry each."""

EXTRA_PLATE: list[Strategy[Table]] = [st.just({})]
"""Further keys of the plate, one entry a feature; the first leaves all out."""

EXTRA_IMPACT: list[Strategy[Table]] = [st.just({})]
"""Further keys of the impact, one entry a feature."""

EXTRA_SECTIONS: list[Strategy[Table]] = [st.just({})]
"""Further sections of a case, one entry a feature."""


@st.composite
def plates(draw: st.DrawFn) -> Table:
    """A plate of 100 to 600 mm and 2 x 2 to 8 x 8 shells."""
    plate: Table = {
        "length": draw(quantity(100.0, 600.0, "mm")),
        "width": draw(quantity(100.0, 600.0, "mm")),
        "thickness": draw(quantity(0.5, 20.0, "mm")),
        "elements": [draw(st.integers(2, 8)), draw(st.integers(2, 8))],
        "edges": draw(st.one_of(EDGES)),
        "material": draw(st.one_of(PLATE_MATERIALS)),
    }
    return plate | draw(st.one_of(EXTRA_PLATE))


IMPACTS = st.fixed_dictionaries(
    {
        "speed": st.one_of(quantity(1.0, 400.0, "m/s"), quantity(50.0, 400.0, "m/s")),
        "angle": st.one_of(quantity(5.0, 90.0, "deg"), quantity(25.0, 90.0, "deg")),
        "aim": st.sampled_from(["first_touch", "axis"]),
    }
)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """A whole case, as TOML would give it: 0.1 to 0.6 ms of contact, after a flight of at most 0.1 ms."""
    impact: Table = draw(IMPACTS)
    flight, contact = draw(number(0.0, 0.1)), draw(number(0.1, 0.6))
    impact["standoff"] = f"{flight * float(impact['speed'].split()[0]):.4g} mm"
    return {
        "plate": draw(plates()),
        "bird": draw(birds()),
        "impact": impact | draw(st.one_of(EXTRA_IMPACT)),
        "time": {"end": f"{flight + contact:.4g} ms", "output_interval": "5 us"},
        **draw(st.one_of(EXTRA_SECTIONS)),
    }
