"""The bird's materials, laws and sizes in a case: what is read, what follows, and what a wrong one is answered with."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import CaseError, UserError
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.bird.shape import volume
from birdstrike.solver.build import bird_lattice
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.case.sections import entry_at, quantities, quantity_at, quantity_in
from birdstrike.solver.coupling import Coupling

PLASTIC = "reference_strike_plastic_kinematic"
HYDRO = "reference_strike_hydrodynamic"


def errors_of(name: str, changes: dict[str, str]) -> list[str]:
    with pytest.raises(CaseError) as caught:
        load_case(name, changes)
    return caught.value.errors


@pytest.mark.parametrize("model", ["elastic", "plastic_kinematic", "hydrodynamic"])
def test_shipped_models_weigh_what_their_density_says(model):
    case = load_case(f"reference_strike_{model}")
    assert case.bird.material.model == model
    assert case.bird.actual_mass == pytest.approx(1.876, abs=1e-3)
    assert case.parameters() == ()  # those of the NULL bird have gone with it


@pytest.mark.parametrize(
    ("variant", "viscosity", "aim"),
    [("viscous", 641.0, "axis"), ("inviscid", 0.0, "axis"), ("touch", 641.0, "first_touch")],
)
def test_openradioss_cases_are_those_of_their_header(variant, viscosity, aim):
    """1.876 kg, pressure floor -0.37 MPa, no erosion, 0.05 mm above first contact, 3.02 ms."""
    case = load_case(f"openradioss_{variant}")
    material = case.bird.material
    assert case.bird.actual_mass == pytest.approx(1.876, abs=1e-3)
    assert (material.viscosity, material.pressure_cutoff, case.impact.aim) == (viscosity, -0.37e6, aim)
    assert material.inactive == ("tension_erosion", "compression_erosion")
    run = Coupling(case)
    height = run.bird.x[: run.bird.n, 2].min() - run.contact.gap
    assert height == pytest.approx(0.05e-3, abs=5e-6)
    assert run.begin == 0.0
    assert (case.time.end, case.bird.particles) == (3.02e-3, 4488)


def test_plastic_kinematic_constants_reach_the_material():
    """Ep = E Et/(E - Et) split by BETA; G and K from E and nu."""
    changes = {"bird.material.tangent_modulus": "8.9 MPa", "bird.material.beta": "0.25"}
    material = load_case(PLASTIC, changes).bird.material.build(938.0)
    assert isinstance(material, Solid)
    modulus = 68.9 * 8.9 / 60.0 * 1e6
    assert (material.isotropic, material.kinematic) == pytest.approx((0.25 * modulus, 0.75 * modulus))
    assert material.shear_modulus == pytest.approx(68.9e6 / 2.98)
    assert material.bulk_modulus == pytest.approx(68.9e6 / 0.06)
    assert material.young == pytest.approx(68.9e6)


def test_hydrodynamic_hardening_is_a_plastic_modulus():
    material = load_case(HYDRO).bird.material.build(938.0)
    assert isinstance(material, Solid)
    assert (material.isotropic, material.yield_stress, material.pressure_cutoff) == (0.13e6, 0.03e6, -0.9e6)
    assert material.eos.pressure(0.1) == pytest.approx(207.2e6 + 62.17e6 + 10.362e6)


def test_a_model_of_its_own_may_be_sought():
    key = "bird.material.yield_stress"
    case = load_case(PLASTIC, {f'inversion.parameters."{key}".range': '["1 kPa", "100 kPa"]'})
    assert [(p.name, p.low, p.high, p.unit) for p in case.parameters()] == [(key, 1e3, 1e5, "Pa")]
    assert case.with_values({key: 5e4}).bird.material.model_dump()["yield_stress"] == 5e4


def test_every_quantity_of_every_model_is_found_once():
    names = [name for name, _ in quantities()]
    assert len(names) == len(set(names))
    wanted = ("young", "viscosity", "hardening_modulus", "eos.C", "eos.C6", "eos.z", "eos.g")
    assert {f"bird.material.{name}" for name in wanted} <= set(names)
    assert quantity_at("bird.material.eos.p") is None


@pytest.mark.parametrize("name", ["reference_strike", PLASTIC, HYDRO])
def test_one_quantity_is_looked_up_as_all_of_them_are_listed(name):
    raw = load_case(name).table
    listed = dict(quantities(raw))
    assert {key: mark for key, _ in quantities() if (mark := quantity_in(raw, key))} == listed
    assert quantity_in(raw, "bird.material.yeld_stress") is None
    offset = entry_at("impact.offset")
    assert offset is not None
    assert offset.unit == "m"
    assert entry_at("impact.speed") is None


WRONG = [
    (PLASTIC, "bird.material.yeld_stress", "1 MPa", "~ is not a key of a case; did you mean yield_stress?"),
    (PLASTIC, "bird.material.viscosity", "1 Pa s", "~ is not a key of a case; known here: model, young, poisson"),
    (PLASTIC, "bird.material.young", "68.9", '~ = 68.9 has no unit; write "68.9 MPa"'),
    (PLASTIC, "bird.material.tangent_modulus", "70 MPa", "~ = 70 MPa is not below young; megapascals?"),
    (HYDRO, "bird.material.eos.C7", "1 MPa", "~ is not a key of a case; known here: kind, C0, C1"),
    (HYDRO, "bird.material.eos.kind", "murnagan", '~ = murnagan is unknown; did you mean "murnaghan"?'),
    (HYDRO, "bird.material.eos", "water", "~ = water must be a table of keys"),
    (
        PLASTIC,
        'inversion.parameters."bird.material.viscosity".range',
        '["1 Pa s", "2 Pa s"]',
        "is no key of the plastic",
    ),
    (
        "openradioss_panel",
        'inversion.parameters."target.materials.aluminium.yield_stress".range',
        '["1 MPa", "2 MPa"]',
        'is no key of target.materials.aluminium.law = "power"; leave it out',
    ),
    ("reference_strike", "bird.jitter", "0.5", "~ = 0.5 is outside 0.0 .. 0.3"),
    ("reference_strike", "bird.slenderness", "2", "bird.slenderness needs bird.mass"),
]


@pytest.mark.parametrize(("name", "key", "text", "expected"), WRONG, ids=[w[1] for w in WRONG])
def test_wrong_entries_are_answered_by_the_chosen_model(name, key, text, expected):
    lines = errors_of(name, {key: text})
    assert any(expected.replace("~", key) in line for line in lines), lines


def test_a_new_law_takes_nothing_from_the_old_one():
    law = {"bird.material.eos.kind": "murnaghan", "bird.material.eos.B": "128 MPa", "bird.material.eos.g": "7.98"}
    eos = load_case("reference_strike", law).bird.material.model_dump()["eos"]
    assert eos == {"kind": "murnaghan", "p0": 0.0, "B": 128e6, "g": 7.98}


def test_every_law_builds_about_the_birds_density():
    given = {
        "grueneisen": {"C": "1670 m/s", "S1": 2.48, "E0": "0.5 MPa"},
        "linear_polynomial": {"C1": "2072 MPa"},
        "murnaghan": {"B": "128 MPa", "g": 7.98},
        "polynomial_k": {"c0": "1482.9 m/s", "k": 2.0},
        "porous": {"z": 0.1, "mixing": "linear"},
        "table": {"rho": ["900 kg/m^3", "938 kg/m^3", "1000 kg/m^3"], "p": ["-80 MPa", "0 MPa", "150 MPa"]},
    }
    assert set(given) == set(EQUATIONS_OF_STATE)
    for kind, keys in given.items():
        law = EQUATIONS_OF_STATE[kind].model_validate({"kind": kind} | keys).build(938.0)
        assert law.rho0 == 938.0
        assert law.pressure(0.01) > 1e6


def test_tabulated_law_from_a_file_beside_the_case(tmp_path: Path):
    """Its points are the case: another file of the same content is the same hash, another content another one."""
    rows = "\n".join(f"{rho},{p}" for rho, p in ((800, -300), (938, 0), (1000, 150), (1300, 2000)))
    head = "# made up\nrho [kg/m^3],p [MPa]\n"
    case = tmp_path / "mine.toml"
    text = 'extends = "reference_strike"\n[bird]\ndensity = "938 kg/m^3"\n[bird.material.eos]\nkind = "table"\n'
    hashes = []
    for name, content in (("a.csv", rows), ("b.csv", rows), ("c.csv", rows.replace("150", "151"))):
        (tmp_path / name).write_text(head + content)
        case.write_text(f'{text}file = "{name}"\n')
        hashes.append(case_hash(load_case(case)))
    assert hashes[0] == hashes[1] != hashes[2]
    law = load_case(case).bird.material.model_dump()["eos"]
    assert (law["rho"][2], law["p"][2]) == (1000.0, 151e6)
    (tmp_path / "c.csv").write_text("rho [kg/m^3],p [mm]\n1,2\n")
    with pytest.raises(CaseError, match=r'its columns are "rho'):
        load_case(case)
    case.write_text(f'{text}file = "none.csv"\n')
    with pytest.raises(CaseError, match=f'no such file in "{tmp_path}"; a path is relative to the folder of the case'):
        load_case(case)


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ({"mu": "[0, 0.1, 0.2]", "p": "['0 MPa', '2 MPa', '1 MPa']"}, "does not rise at point 3 of 3"),
        (
            {"mu": "[0, 0.1, 0.1]", "p": "['0 MPa', '1 MPa', '2 MPa']"},
            "value of the point before; leave one of the two",
        ),
        ({"mu": "[0, 0.1]", "p": "['0 MPa', '2 MPa']"}, "as many, and at least three"),
        ({"p": "['0 MPa', '2 MPa', '3 MPa']"}, "over rho or over mu"),
    ],
)
def test_wrong_tables_are_told(keys, complaint):
    changes = {"bird.material.eos.kind": "table"} | {f"bird.material.eos.{k}": v for k, v in keys.items()}
    assert any(complaint in line for line in errors_of("reference_strike", changes))


def test_a_table_that_does_not_hold_the_birds_density_is_told():
    law = EQUATIONS_OF_STATE["table"].model_validate(
        {"kind": "table", "rho": ["950 kg/m^3", "980 kg/m^3", "1000 kg/m^3"], "p": ["0 MPa", "80 MPa", "150 MPa"]}
    )
    with pytest.raises(UserError, match=r"bird's own, 938 kg/m\^3"):
        law.build(938.0)


@pytest.mark.parametrize("shape", ["hemispherical_cylinder", "cylinder", "ellipsoid"])
def test_size_from_mass_density_and_slenderness(shape):
    keys = {"bird.mass": "1.8 kg", "bird.density": "900 kg/m^3", "bird.slenderness": "2", "bird.shape": shape}
    bird = load_case("reference_strike", keys).bird
    assert bird.length == pytest.approx(2.0 * bird.diameter, rel=1e-12)
    assert volume(shape, bird.diameter, bird.length) == pytest.approx(1.8 / 900.0, rel=1e-9)
    assert (bird.actual_mass, bird.actual_density) == (1.8, 900.0)


def test_bird_statistics_give_density_and_diameter():
    """1.8 kg: 943 kg/m^3 and 98 mm; the length follows from the mass."""
    bird = load_case("reference_strike", {"bird.mass": "1.8 kg", "bird.statistics": "true"}).bird
    assert bird.actual_density == pytest.approx(1148.0 - 63.0 * math.log10(1800.0), rel=1e-12)
    assert bird.diameter == pytest.approx(10.0 ** (-1.095 + 0.335 * math.log10(1.8)), rel=1e-12)
    assert bird.actual_density * bird.volume == pytest.approx(1.8, rel=1e-9)
    heavier = load_case("reference_strike", {"bird.mass": "1.8 kg", "bird.statistics": "true"})
    assert heavier.with_values({"bird.mass": 2.5}).bird.diameter > bird.diameter


def test_a_porous_law_gives_the_density_where_none_stands(tmp_path: Path):
    text = (Path(__file__).parents[3] / "data" / "cases" / "reference_strike.toml").read_text()
    law = 'kind = "porous"\nz = 0.1\nmixing = "wood"\n'
    text = text.replace('density = "900 kg/m^3"', "").replace('kind = "grueneisen"\nC = "1670 m/s"\nS1 = 2.48\n', law)
    (tmp_path / "porous.toml").write_text(text)
    bird = load_case(tmp_path / "porous.toml").bird
    assert bird.actual_density == pytest.approx(0.9 * 1000.0 + 0.1 * 1.225)


def test_jitter_is_seeded_and_bounded():
    still, one, same, other = (
        load_case("demo", {"bird.jitter": str(jitter), "bird.seed": str(seed)})
        for jitter, seed in ((0.0, 0), (0.1, 1), (0.1, 1), (0.1, 2))
    )
    points = [bird_lattice(case.bird)[0] for case in (still, one, same, other)]
    assert np.array_equal(points[1], points[2])
    assert not np.array_equal(points[1], points[3])
    spacing = bird_lattice(still.bird)[1]
    assert 0.09 * spacing < np.abs(points[1] - points[0]).max() <= 0.11 * spacing
    assert case_hash(one) == case_hash(same) != case_hash(other)
