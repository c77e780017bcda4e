from __future__ import annotations

import json

import pytest

from birdstrike.doe.solvers import content_of
from birdstrike.solver.case.case import case_from_table, load_case


def _digest(case) -> str:
    return json.dumps(content_of(case), sort_keys=True, default=str)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("plate.thickness", "9.5 mm"),
        ("inversion.nuisance.speed", "0.5 m/s"),
        ('inversion.parameters."bird.material.viscosity".range', ["10 Pa s", "20 Pa s"]),
        ("solver.courant", 0.5),
    ],
)
def test_what_a_result_takes_from_a_case_is_in_its_content(key, value) -> None:
    case = load_case("demo_rig")
    assert _digest(load_case("demo_rig", {key: value})) != _digest(case)


def test_the_orders_of_parameters_and_channels_are_in_the_content_and_threads_are_not() -> None:
    case = load_case("demo_rig")
    for part in ("inversion.parameters", "sensors"):
        table = case.table
        inner = table
        *path, last = part.split(".")
        for name in path:
            inner = inner[name]
        inner[last] = dict(reversed(inner[last].items()))
        assert _digest(case_from_table(table)) != _digest(case_from_table(case.table)), part
    assert _digest(load_case("demo_rig", {"solver.threads": 2})) == _digest(case)
