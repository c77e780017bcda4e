"""Random valid plates: metals, edges, preload, curved panels, rigid ones; one entry each.

To teach the search a new feature of the plate, add its keys to the list below.
"""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from tests.solver.case.random_fields import Strategy, Table, number, off_or, quantity

METALS: list[Strategy[Table]] = [
    st.fixed_dictionaries(
        {
            "young": quantity(1.0, 250.0, "GPa"),
            "poisson": number(0.0, 0.45),
            "density": quantity(900.0, 9000.0, "kg/m^3"),
            "yield_stress": quantity(20.0, 2000.0, "MPa"),
            "tangent_modulus": off_or(quantity(0.0, 900.0, "MPa"), "0 MPa"),
            "beta": number(0.0, 1.0),
        },
        optional={
            "rate_c": quantity(1.0, 10000.0, "1/s"),
            "rate_p": number(1.0, 6.0),
            "failure_strain": number(0.02, 0.6),
        },
    ),
]
"""Plate materials, one entry each."""

SPRINGS: dict[str, Strategy[str]] = {
    "rotational": quantity(0.0, 1000.0, "kN*m/rad/m"),
    "in_plane": quantity(0.0, 1e5, "N/mm^2"),
    "transverse": quantity(0.0, 1e5, "N/mm^2"),
}
EDGES: list[Strategy[Any]] = [
    st.sampled_from(["clamped", "pinned", "free"]),
    st.fixed_dictionaries({}, optional=SPRINGS),
]
"""What holds the plate, one entry each."""

FLAT_PRELOAD = st.lists(quantity(-3.0, 15.0, "MPa"), min_size=2, max_size=2)
DAMPING = quantity(0.0, 3000.0, "1/s")


@st.composite
def deformable(draw: st.DrawFn) -> Table:
    """A plate of metal, flat or curved, its edges able to hold what preload it has."""
    plate = draw(outlines()) | {
        "thickness": draw(quantity(0.5, 20.0, "mm")),
        "edges": draw(st.one_of(EDGES)),
        "material": draw(st.one_of(METALS)),
    }
    if draw(st.booleans()):
        plate["damping"] = draw(DAMPING)
    holds = plate["edges"] != "free" and not (
        isinstance(plate["edges"], dict) and plate["edges"].get("in_plane", "1 N/mm^2").startswith("0 ")
    )
    if holds and draw(st.booleans()):
        along, across = draw(FLAT_PRELOAD)
        plate["preload"] = ["0 MPa" if "radius" in plate else along, across]
    return plate


@st.composite
def outlines(draw: st.DrawFn) -> Table:
    """A plate of 100 to 600 mm and 2 x 2 to 8 x 8 shells, or a panel of up to half a circle."""
    outline: Table = {
        "length": draw(quantity(100.0, 600.0, "mm")),
        "width": draw(quantity(100.0, 600.0, "mm")),
        "elements": [draw(st.integers(2, 8)), draw(st.integers(2, 8))],
    }
    if draw(st.integers(0, 3)) == 0:
        outline["radius"] = f"{float(outline['length'].split()[0]) * draw(number(0.32, 10.0)):.6g} mm"
    return outline


RIGID: Strategy[Table] = outlines().map(lambda outline: outline | {"rigid": True})

PLATES: list[Strategy[Table]] = [deformable(), deformable(), deformable(), RIGID]
"""Targets, one entry each; those that give way three times as often."""
