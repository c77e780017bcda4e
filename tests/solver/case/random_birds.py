"""Random valid birds: shapes, sizes, materials, equations of state, discretisations; one entry each.

To teach the search a new model, add its table to the list below.
"""

from __future__ import annotations

from hypothesis import strategies as st

from birdstrike.solver.bird.shape import volume
from tests.solver.case.random_fields import Strategy, Table, number, off_or, quantity

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
            "C0": quantity(-0.1, 0.1, "MPa"),
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
def sizes(draw: st.DrawFn) -> Table:
    """Diameter, length and density or mass of a bird of 20 to 150 mm, never shorter than wide where that is no bird."""
    shape = draw(st.sampled_from(["hemispherical_cylinder", "cylinder", "ellipsoid", "sphere"]))
    diameter = draw(st.integers(20, 150))
    size: Table = {"shape": shape, "diameter": f"{diameter} mm"}
    if shape != "sphere":
        size["length"] = f"{draw(number(1.0 if shape == 'hemispherical_cylinder' else 0.5, 3.0)) * diameter:.6g} mm"
    if draw(st.booleans()):
        size["density"] = draw(quantity(300.0, 1500.0, "kg/m^3"))
    else:
        long = 1e-3 * float(size.get("length", size["diameter"]).split()[0])
        size["mass"] = f"{1000.0 * volume(shape, 1e-3 * diameter, long) * draw(number(300.0, 1500.0)):.4g} g"
    return size


BY_MASS: Strategy[Table] = st.fixed_dictionaries(
    {
        "shape": st.sampled_from(["hemispherical_cylinder", "cylinder", "ellipsoid"]),
        "mass": quantity(20.0, 4000.0, "g"),
        "slenderness": number(1.0, 4.0),
        "density": quantity(300.0, 1500.0, "kg/m^3"),
    }
)
STATISTICAL: Strategy[Table] = st.fixed_dictionaries(
    {
        "shape": st.sampled_from(["hemispherical_cylinder", "cylinder", "ellipsoid", "sphere"]),
        "mass": quantity(50.0, 3600.0, "g"),
        "statistics": st.just(True),
    }
)
SIZES: list[Strategy[Table]] = [sizes(), sizes(), BY_MASS, STATISTICAL]
"""How a case says how large and how heavy the bird is, one entry each; the plainest twice as often."""


@st.composite
def birds(draw: st.DrawFn) -> Table:
    """A whole bird."""
    parts = [draw(st.one_of(SIZES)), draw(st.one_of(DISCRETISATIONS))]
    return parts[0] | parts[1] | {"material": draw(st.one_of(BIRD_MATERIALS))}
