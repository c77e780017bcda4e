"""Random valid cases, as the tables that a case file gives: one strategy a section, so that a new model is one entry.

Birds, plates and sensors have files of their own; `tables` is what the fuzz test draws from.
"""

from __future__ import annotations

from hypothesis import strategies as st

from tests.solver.case.random_birds import birds
from tests.solver.case.random_fields import Strategy, Table, number, quantity
from tests.solver.case.random_plates import PLATES
from tests.solver.case.random_sensors import instrumented

IMPACTS: Strategy[Table] = st.fixed_dictionaries(
    {
        "speed": st.one_of(quantity(1.0, 400.0, "m/s"), quantity(50.0, 400.0, "m/s")),
        "angle": st.one_of(quantity(5.0, 90.0, "deg"), quantity(25.0, 90.0, "deg")),
        "aim": st.sampled_from(["first_touch", "axis"]),
    },
    optional={"friction": number(0.0, 1.0), "yaw": quantity(-45.0, 45.0, "deg")},
)

SHOCK = {"courant": number(0.3, 1.0), "shock_linear": number(0.1, 2.0), "shock_quadratic": number(0.5, 4.0)}
SETTINGS: dict[str, Strategy[Table]] = {
    "sph": st.fixed_dictionaries({}, optional=SHOCK | {"smoothing": number(1.1, 1.8)}),
    "hexahedra": st.fixed_dictionaries(
        {},
        optional=SHOCK
        | {
            "hourglass": st.sampled_from(["viscous", "stiffness"]),
            "hourglass_coefficient": number(0.01, 0.1),
            "smallest_step": number(0.1, 0.5),
        },
    ),
}
"""Numerical settings by the bird's method."""

EXTRA_SECTIONS: list[Strategy[Table]] = [st.just({})]
"""Further sections of a case, one entry a feature."""


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """A whole case, as TOML would give it: 0.1 to 0.6 ms of contact, after a flight of at most 0.1 ms."""
    impact: Table = draw(IMPACTS)
    flight, contact = draw(number(0.0, 0.1)), draw(number(0.1, 0.6))
    impact["standoff"] = f"{flight * float(impact['speed'].split()[0]):.4g} mm"
    bird, plate = draw(birds()), draw(st.one_of(PLATES))
    if bird["shape"] == "sphere":
        impact.pop("yaw", None)
    solver = draw(SETTINGS[bird["method"]]) if draw(st.booleans()) else {}
    return {
        "plate": plate,
        "bird": bird,
        "impact": impact,
        "time": {"end": f"{flight + contact:.4g} ms", "output_interval": "5 us"},
        **({"solver": solver} if solver else {}),
        **draw(instrumented(plate)),
        **draw(st.one_of(EXTRA_SECTIONS)),
    }
