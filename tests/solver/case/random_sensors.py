"""Random valid sensors, and the instruments behind them, on a plate of a given size."""

from __future__ import annotations

from hypothesis import strategies as st

from tests.solver.case.random_fields import Strategy, Table, number, quantity

INSTRUMENT: Strategy[Table] = st.fixed_dictionaries(
    {},
    optional={
        "time_offset": quantity(-0.1, 0.1, "ms"),
        "gain": number(0.5, 2.0),
        "bandwidth": quantity(0.5, 200.0, "kHz"),
    },
)
DRIFTS = {
    "displacement": "mm/s",
    "strain": "1/s",
    "contact_force": "kN/s",
    "reaction_force": "kN/s",
    "pressure": "MPa/s",
}
"""Kind of sensor -> unit of its instrument's drift."""


@st.composite
def placed(draw: st.DrawFn, plate: Table, kind: str) -> Table:
    """One sensor anywhere on the plate; a strain gauge shorter than what is left on both its sides."""
    sensor: Table = {"kind": kind}
    if not kind.endswith("_force"):
        sizes = [float(plate[key].split()[0]) for key in ("length", "width")]
        at = [draw(number(-0.45, 0.45)) * size for size in sizes]
        sensor["at"] = [f"{place:.6g} mm" for place in at]
        room = min(0.5 * size - abs(place) for size, place in zip(sizes, at, strict=True))
    if kind == "pressure":
        sensor |= draw(st.fixed_dictionaries({}, optional={"radius": quantity(1.0, 60.0, "mm")}))
    if kind == "strain":
        own = {"direction": quantity(-180.0, 180.0, "deg"), "side": st.sampled_from(["impact", "back"])}
        sensor |= draw(st.fixed_dictionaries({}, optional=own | {"length": quantity(0.5, 1.9 * room, "mm")}))
    return sensor


@st.composite
def instrumented(draw: st.DrawFn, plate: Table) -> Table:
    """`sensors` of up to five kinds, and an `instrument` behind some of them; without any, the default three."""
    kinds = [kind for kind in DRIFTS if kind != "strain" or "rigid" not in plate]
    chosen = draw(st.lists(st.sampled_from(kinds), max_size=5, unique=True))
    sensors = {f"{kind}_here": draw(placed(plate, kind)) for kind in chosen}
    instruments = {f"{kind}_here": draw(INSTRUMENT) for kind in chosen if draw(st.booleans())}
    for name, own in instruments.items():
        if draw(st.booleans()):
            own["drift"] = draw(quantity(-5.0, 5.0, DRIFTS[name.removesuffix("_here")]))
    return ({"sensors": sensors} if sensors else {}) | ({"instrument": instruments} if instruments else {})
