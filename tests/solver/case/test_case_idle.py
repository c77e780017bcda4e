"""What a case says that would do nothing, or something seldom meant: refused, made void or warned of."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.remarks import example_parameter, remarks
from tests.solver.case.wrong_cases import errors_with, written

OF_HEXAHEDRA = {"bird.method": "hexahedra"}
RIGID = {"plate.rigid": "true"}
LIGHT = ["bird.material.eos", '{kind="porous", z=0.1, mixing="wood"}']
POROUS = {LIGHT[0]: LIGHT[1]}


@pytest.mark.parametrize(
    ("choice", "key", "text", "whom"),
    [
        (OF_HEXAHEDRA, "bird.jitter", "0.1", "a bird of hexahedra"),
        (OF_HEXAHEDRA, "bird.lattice", "cubic", "a bird of hexahedra"),
        (OF_HEXAHEDRA, "bird.seed", "3", "a bird of hexahedra"),
        (OF_HEXAHEDRA, "solver.smoothing", "1.4", "a bird of hexahedra"),
        ({}, "solver.hourglass", "viscous", "a bird of particles"),
        ({}, "solver.hourglass_coefficient", "0.1", "a bird of particles"),
        ({}, "solver.smallest_step", "0.1", "a bird of particles"),
        (RIGID, "plate.edges", "pinned", "a rigid plate"),
        (RIGID, "plate.damping", "10 1/s", "a rigid plate"),
        (RIGID, "plate.preload", "['1 MPa', '0 MPa']", "a rigid plate"),
        (RIGID, "plate.material.failure_strain", "0.2", "a rigid plate"),
        ({"bird.shape": "sphere", "bird.length": "106 mm"}, "impact.yaw", "3 deg", "a sphere"),
    ],
)
def test_a_key_that_would_do_nothing_is_refused(choice: dict[str, str], key: str, text: str, whom: str) -> None:
    (line,) = errors_with({key: text} | choice)
    assert line.startswith(f"{key} = ")
    assert f"does nothing to {whom}; leave it out, or " in line


@pytest.mark.parametrize("method", ['["sph"]', "{a = 1}", "3"])
def test_a_method_that_is_no_word_is_an_error_of_its_own(method: str) -> None:
    assert any(line.startswith("bird.method") for line in errors_with({"bird.method": method, "bird.jitter": "0.1"}))


def test_a_parameter_that_would_do_nothing_is_refused() -> None:
    sought = {'inversion.parameters."plate.damping".range': '["0 1/s", "9 1/s"]'}
    assert errors_with(RIGID | sought) == [
        'inversion.parameters."plate.damping" does nothing to a rigid plate; leave it out, or leave plate.rigid out'
    ]


def test_what_is_inherited_is_void_with_its_parameters(tmp_path: Path) -> None:
    written(
        tmp_path,
        "base",
        'extends = "reference_strike"\n[plate]\ndamping = "9 1/s"\n[bird]\njitter = 0.1\n'
        '[inversion.parameters."plate.damping"]\nrange = ["0 1/s", "9 1/s"]\n',
    )
    case = load_case(written(tmp_path, "on_it", 'extends = "base.toml"\nplate.rigid = true\nbird.method = "hexahedra"'))
    assert (case.plate.damping, case.bird.jitter, case.bird.lattice) == (0.0, 0.0, "fcc")
    assert "plate.damping" not in {parameter.name for parameter in case.parameters()}
    assert "bird.material.viscosity" in {parameter.name for parameter in case.parameters()}


def test_an_inherited_yaw_is_void_for_a_sphere(tmp_path: Path) -> None:
    written(tmp_path, "yawed", 'extends = "reference_strike"\nimpact.yaw = "4 deg"\n')
    sphere = 'extends = "yawed.toml"\n[bird]\nshape = "sphere"\nlength = "106 mm"\n'
    assert load_case(written(tmp_path, "sphere", sphere)).impact.yaw == 0.0


def test_a_porous_law_replaces_an_inherited_density_by_its_own() -> None:
    assert load_case("reference_strike", POROUS).bird.actual_density == pytest.approx(900.1225)
    assert load_case("reference_strike_elastic", {"bird.material.model": "null"} | SEVERAL).bird.density == 900.1225


SEVERAL = {
    "bird.material.pressure_cutoff": "0 MPa",
    "bird.material.viscosity": "0 Pa s",
    "bird.material.eos.kind": "porous",
    "bird.material.eos.z": "0.1",
    "bird.material.eos.mixing": "wood",
}


@pytest.mark.parametrize("given", [{"bird.density": "950 kg/m^3"}, {"bird.mass": "1.9 kg"}])
def test_another_density_than_the_porous_laws_own_is_kept_and_told(given: dict[str, str]) -> None:
    case = load_case("reference_strike", given | POROUS)
    assert case.bird.actual_density == pytest.approx(950.0, rel=1e-3)
    (line,) = remarks(case)
    assert "that of its porous mixture 900.1 kg/m^3" in line
    assert not remarks(load_case("reference_strike", POROUS))


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (
            '{kind="murnaghan", B="9.3 MPa", g=7.14, p0="0.1 MPa"}',
            ("0.1 MPa", "bursts", "set bird.material.eos.p0 to 0"),
        ),
        ('{kind="linear_polynomial", C1="2 GPa", C0="-2 MPa"}', ("-2 MPa", "shrinks", "bird.material.eos.C0 to 0")),
        ('{kind="grueneisen", C="1670 m/s", S1=2.48, g0=1.0, E0="1 MPa"}', ("1 MPa", "bursts", "eos.E0 to 0")),
        ('{kind="table", mu=[-0.1, 0, 1], p=["0 MPa", "1 MPa", "9 GPa"]}', ("1 MPa", "let the table's pressure be 0")),
    ],
)
def test_a_bird_under_pressure_in_flight_is_told_with_its_remedy(law: str, expected: tuple[str, ...]) -> None:
    (line,) = remarks(load_case("reference_strike", {"bird.material.eos": law}))
    assert all(part in line for part in expected), line


@pytest.mark.parametrize("name", ["reference_strike", "reference_strike_elastic", "demo", "openradioss_touch"])
def test_a_plain_case_needs_no_remark(name: str) -> None:
    assert remarks(load_case(name)) == []


@pytest.mark.parametrize("model", ["elastic", "plastic_kinematic", "hydrodynamic"])
def test_the_example_of_a_parameter_is_one_of_the_cases_own_model(model: str, tmp_path: Path) -> None:
    """As it stands it can be put into the case, and the present value lies between its limits."""
    example = example_parameter(load_case(f"reference_strike_{model}"))
    case = load_case(written(tmp_path, "sought", f'extends = "reference_strike_{model}"\n{as_toml(example)}'))
    (parameter,) = (one for one in case.parameters() if f'"{one.name}"' in example)
    assert parameter.low < value_of(case, parameter.name) < parameter.high


def as_toml(example: str) -> str:
    return example.replace("] range", "]\nrange")


def value_of(case: Case, key: str) -> float:
    return getattr(case.bird.material, key.rpartition(".")[2])
