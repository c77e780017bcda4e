"""What a wrong case is answered with, further: gauges beyond the plate, choices, rows of a table, sizes given twice."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.case import load_case
from birdstrike.solver.case.nuisances import case_nuisances
from birdstrike.solver.coupling import bird_and_step
from birdstrike.solver.sensors.strain import Strain
from tests.solver.case.wrong_cases import errors_with, raised, written


@pytest.mark.parametrize(
    ("settings", "beyond"),
    [
        ({"direction": "90 deg", "length": "500 mm"}, "35 mm beyond the plate (plate.width = 430 mm)"),
        ({"at": '["-250 mm", "0 mm"]', "length": "50 mm"}, "12.5 mm beyond the plate (plate.length = 525 mm)"),
    ],
)
def test_both_ends_of_a_strain_gauge_lie_on_the_plate(settings: dict[str, str], beyond: str) -> None:
    gauge = {"sensors.s.kind": "strain"} | {f"sensors.s.{key}": text for key, text in settings.items()}
    (line,) = errors_with(gauge)
    assert line.startswith(f"sensors.s.length = {settings['length']}: an end of the gauge is {beyond}")
    fitting = gauge | {"sensors.s.length": "25 mm"}
    sensor = load_case("reference_strike", fitting).sensors["s"]
    assert isinstance(sensor, Strain)
    assert sensor.length == 0.025


LAWLESS = '{kind="porous", z=0.1}'
FALLING = '{kind="table", mu=[0, 0.1, 0.3, 0.2, 1], p=["0 Pa", "1 Pa", "2 Pa", "3 Pa", "4 Pa"]}'
MESSAGES = [
    (LAWLESS, "bird.material.eos.mixing is missing; available: wood, linear"),
    (
        FALLING,
        "bird.material.eos.mu does not rise at point 4 of 5: a pressure that falls in compression is unstable; "
        "correct it or leave it out",
    ),
]


WORDS = [
    ("time.end", "1,5 ms", '~ = 1,5 ms is not understood: "1,5 ms" has a decimal comma; write "1.5 ms"; accepted'),
    ("plate.length", "1,525 mm", 'write "1.525 mm" or, if the comma marks thousands, "1525 mm"'),
    ("bird.material.eos.S1", "2,48", "~ = 2,48 has a decimal comma; write 2.48"),
    (
        "bird.material.model",
        "gelatine",
        "~ = gelatine is unknown; available: null, elastic, plastic_kinematic, hydrodynamic; one of your own: an "
        "installed package's entry point of the group birdstrike.bird_materials",
    ),
    ("impact.offset", '["0 mm", "1 mm", "2 mm"]', "has 3 entries; write 2"),
    ("impact.point", '["0 mm"]', "~ = ['0 mm'] lacks entries: 1 given; write all of them"),
    ("plate.mesh", "plate.msh", "~ is not a key of a case; plate.elements = [50, 40] divides a rectangle into"),
    ("bird.mesh", "bird.k", "~ is not a key of a case; no mesh file is read: bird.method, lattice"),
]


@pytest.mark.parametrize(("key", "text", "expected"), WORDS)
def test_a_message_says_what_to_write_instead(key: str, text: str, expected: str) -> None:
    lines = [line for line in errors_with({key: text}) if key in line]
    assert expected.replace("~", key) in lines[0]


@pytest.mark.parametrize(("law", "expected"), MESSAGES)
def test_a_message_names_the_choices_and_the_row(law: str, expected: str) -> None:
    assert errors_with({"bird.material.eos": law}) == [expected]


def test_a_missing_kind_lists_the_laws(tmp_path: Path) -> None:
    text = 'extends = "reference_strike_elastic"\n[bird.material]\nmodel = "null"\npressure_cutoff = "0 MPa"\n'
    path = written(tmp_path, "lawless", text + 'viscosity = "0 Pa s"\neos = {z = 0.1}\n')
    with pytest.raises(CaseError, match=r"eos\.kind is missing; available: grueneisen, .*porous, table"):
        load_case(path)


def test_a_size_given_twice_is_not_called_missing(tmp_path: Path) -> None:
    """length and slenderness: the contradiction comes first, and no diameter is asked for."""
    text = """[plate]
rigid = true
length = "0.3 m"
width = "0.3 m"
elements = [10, 10]
[bird]
shape = "cylinder"
length = "262 mm"
mass = "1 kg"
density = "900 kg/m^3"
slenderness = 2.0
material = {model = "elastic", young = "68.9 MPa", poisson = 0.49}
[impact]
speed = "91 m/s"
angle = "90 deg"
[time]
end = "1 ms"
"""
    with pytest.raises(CaseError) as caught:
        load_case(written(tmp_path, "twice", text))
    assert caught.value.errors == ["bird.length and bird.slenderness are both given; keep one, the other follows"]


DEEP = 5000
NESTED = [
    "a = " + "[" * DEEP + "]" * DEEP,
    "a = " + "{a = " * DEEP + "1" + "}" * DEEP,
    "[" + ".".join("a" * DEEP) + "]\n",
    "[plate]\nedges = " + "[" * 30 + "]" * 30,
]


@pytest.mark.parametrize("text", NESTED)
def test_a_case_nested_without_end_is_refused(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, "deep", text)
    error = raised(lambda: load_case(path))
    assert isinstance(error, CaseError)
    assert "tables or lists are nested more than 20 deep" in str(error)


@pytest.mark.parametrize(("key", "text"), [(".".join("a" * DEEP), "1"), ("plate.edges", "[" * DEEP + "]" * DEEP)])
def test_a_setting_nested_without_end_is_refused(key: str, text: str) -> None:
    error = raised(lambda: load_case("reference_strike", {key: text}))
    assert isinstance(error, CaseError)
    assert "nested more than 20 deep" in str(error) or "is not a dotted case key" in str(error)


def test_a_file_too_large_for_a_case_is_refused_unread(tmp_path: Path) -> None:
    """It is not even TOML: what is said of it comes before the reading."""
    path = written(tmp_path, "huge", "x" * 10_000_000)
    with pytest.raises(CaseError, match="has 10 MB, more than the 1 MB of any case: the wrong file"):
        load_case(path)


def test_a_mass_that_makes_no_birds_density_is_told_with_it() -> None:
    """It takes the place of a density that the case states."""
    (line,) = errors_with({"bird.mass": "10 kg"})
    assert line.startswith("bird.mass = 10 kg in a volume of 2 l makes a density of 4999 kg/m^3, beyond 50 kg/m^3 ..")


def bird_of(**keys: str) -> Bird:
    """The reference strike's bird with these keys for its shape, size and mass."""
    table = load_case("reference_strike").table
    table["bird"] = {"material": table["bird"]["material"], **keys}
    return load_case(table).bird


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"shape": "sphere", "diameter": "50 mm", "mass": "0.3 kg"}, "density of 4584 kg/m^3"),
        ({"shape": "ellipsoid", "diameter": "50 mm", "length": "40 mm", "mass": "0.2 kg"}, "density of 3820 kg/m^3"),
        ({"shape": "sphere", "diameter": "50 mm", "mass": "0.3 kg", "density": "938 kg/m^3"}, "both given; keep one"),
    ],
)
def test_a_mass_of_any_shape_that_makes_no_bird_s_density_is_refused(keys: dict[str, str], said: str) -> None:
    with pytest.raises(CaseError, match=re.escape(said)):
        bird_of(**keys)


def test_a_sphere_s_mass_and_density_give_its_size() -> None:
    own = bird_of(shape="sphere", mass="0.3 kg", density="950 kg/m^3")
    assert own.diameter == own.length == pytest.approx((6.0 * 0.3 / 950.0 / math.pi) ** (1.0 / 3.0))
    settings = {"bird.shape": "sphere", "bird.mass": "0.3 kg", "bird.density": "950 kg/m^3"}
    laid_over = load_case("reference_strike", settings)
    assert laid_over.bird.diameter == pytest.approx(own.diameter)
    denser = laid_over.overlaid({"bird": {"density": "1000 kg/m^3"}}).bird
    assert (denser.actual_mass, denser.actual_density) == (0.3, 1000.0)


KNOWN = "known: bird.material.pressure_cutoff, "


@pytest.mark.parametrize(
    ("model", "key", "said"),
    [
        ("murnagham", "eos.B", 'inversion.models.murnagham is no bird model; did you mean "murnaghan"?'),
        (
            "murnaghan",
            "eos.C",
            f'murnaghan."bird.material.eos.C" belongs to no quantity of the model murnaghan; {KNOWN}',
        ),
        ("murnaghan", "viscosty", "of the model murnaghan; did you mean bird.material.viscosity?"),
    ],
)
def test_a_model_s_name_and_keys_are_known_ones(model: str, key: str, said: str) -> None:
    (line,) = errors_with({f'inversion.models.{model}."bird.material.{key}".range': "[1.0, 2.0]"})
    assert said in line
    assert "eos.C0" not in line


def test_what_is_no_constant_of_a_model_is_not_sought_of_it_alone() -> None:
    """The impact's speed took the place of all constants of the model."""
    (line,) = errors_with({'inversion.models.murnaghan."impact.speed".range': '["100 m/s", "120 m/s"]'})
    assert line.startswith('inversion.models.murnaghan."impact.speed" is no constant of the bird model murnaghan; ')
    assert line.endswith("stands in inversion.parameters")
    dense = {'inversion.models.murnaghan."bird.density".range': '["900 kg/m^3", "1000 kg/m^3"]'}
    assert load_case("demo_rig", dense).inversion.models["murnaghan"]["bird.density"].range == (900.0, 1000.0)


@pytest.mark.parametrize(
    ("effect", "key"),
    [
        ("sensor_gain", "gain"),
        ("time_offset", "time_offset"),
        ("sensor_bandwidth", "bandwidth"),
        ("sensor_drift", "drift"),
    ],
)
def test_an_effect_of_one_sensor_is_its_instrument_s(effect: str, key: str) -> None:
    (line,) = errors_with({f"effects.{effect}.displacement_centre": "0.05"})
    assert f"of one sensor alone write instrument.displacement_centre.{key} (such as " in line


@pytest.mark.parametrize(
    ("name", "sigma", "settings", "said"),
    [
        ("angle", "1 deg", {"impact.angle": "90 deg"}, "impact.angle = 90 deg .* no angle is beyond that of a normal"),
        ("angle", "1 deg", {"impact.direction": "[0.0, 0.0, -1.0]"}, "impact.angle = 90 deg .* no angle is beyond"),
        ("angle", "20 deg", {"impact.angle": "15 deg"}, "leave 1 deg .. 90 deg; state a smaller one"),
        ("speed", "95 m/s", {"impact.speed": "90 m/s"}, "impact.speed = 90 m/s .* leave 0.1 m/s .. 1000 m/s"),
    ],
)
def test_an_uncertain_quantity_is_a_case_at_a_deviation_on_either_side(
    name: str, sigma: str, settings: dict[str, str], said: str
) -> None:
    """What `train-and-invert` would fail at after its campaign."""
    (line,) = errors_with({f"inversion.nuisance.{name}": sigma, **settings})
    assert re.search(rf"^inversion\.nuisance\.{name} = {sigma}: .*{said}", line)


@pytest.mark.parametrize(
    ("case", "stated"),
    [
        ("reference_strike", {"impact.angle": "89 deg", "inversion.nuisance.angle": "1 deg"}),
        ("reference_strike", {"inversion.nuisance.mass": "100 g", "inversion.nuisance.speed": "2 m/s"}),
        ("sidewall_004", {"inversion.nuisance.thickness": "0.3 mm"}),
    ],
)
def test_what_is_uncertain_in_a_case_that_loads_can_be_simulated(case: str, stated: dict[str, str]) -> None:
    """The case at a deviation on either side carries its uncertainty still."""
    loaded = load_case(case, stated)
    found = case_nuisances(loaded)
    assert found
    for one in found:
        for sigma in (one.sigma, -one.sigma):
            loaded.with_values({one.key: one.value + sigma})


@pytest.mark.parametrize(
    ("case", "name", "sigma", "key"),
    [
        ("reference_strike", "mass", "5000 g", "bird.density"),
        ("sidewall_004", "thickness", "1 mm", "target.parts.skin.thickness"),
    ],
)
def test_an_uncertain_quantity_is_that_of_its_own_key(case: str, name: str, sigma: str, key: str) -> None:
    with pytest.raises(CaseError, match=rf"inversion\.nuisance\.{name} = .*: {re.escape(key)} = "):
        load_case(case, {f"inversion.nuisance.{name}": sigma})


def test_the_uncertainty_of_what_is_sought_is_its_range() -> None:
    sought = {'inversion.parameters."impact.angle".range': '["60 deg", "90 deg"]', "impact.angle": "90 deg"}
    assert load_case("reference_strike", {**sought, "inversion.nuisance.angle": "1 deg"})


@pytest.mark.parametrize(
    ("gauge", "beyond"),
    [
        ('{kind="pressure", radius="300 mm"}', "reaches 37.5 mm beyond the plate (plate.length = 525 mm)"),
        ('{kind="pressure", at=["262 mm", "0 mm"]}', "radius = 10 mm: the gauge reaches 9.5 mm beyond the plate"),
    ],
)
def test_a_pressure_gauge_lies_on_the_plate_whole(gauge: str, beyond: str) -> None:
    """Its force is divided by the whole area."""
    assert beyond in errors_with({"sensors.p": gauge})[0]
    assert load_case("reference_strike", {"sensors.p": '{kind="pressure", at=["252 mm", "0 mm"]}'})


def test_particles_with_strength_are_not_shifted_until_they_repel() -> None:
    """Such a bird expanded in free flight."""
    with pytest.raises(CaseError, match=r"bird.jitter = 0.2 shifts .* hydrodynamic bird .*; at most 0.15"):
        load_case("reference_strike_hydrodynamic", {"bird.jitter": "0.2"})
    assert load_case("reference_strike_hydrodynamic", {"bird.jitter": "0.15"})
    assert load_case("reference_strike", {"bird.jitter": "0.3"})


def test_a_law_without_a_sound_speed_at_rest_is_refused_by_name() -> None:
    """It ended in a division by zero, after the whole run."""
    law = '{kind="linear_polynomial", C0="-1 MPa", C1="2 MPa", C4=4.0}'
    with pytest.raises(CaseError, match=r"bird.material.eos has no sound speed at rest"):
        bird_and_step(load_case("reference_strike", {"bird.material.eos": law}))


VISCOSITY = "bird.material.viscosity"
LACKING = (
    f'inversion.parameters.{VISCOSITY} lacks quotes: a key with dots is written inversion.parameters."{VISCOSITY}"'
)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (f'[inversion.parameters.{VISCOSITY}]\nrange = ["1 Pa s", "9 Pa s"]', LACKING),
        (f'[inversion.parameters]\n{VISCOSITY} = ["1 Pa s", "9 Pa s"]', LACKING),
        (
            f'[inversion.parameters."{VISCOSITY}"]\nrnge = ["1 Pa s", "9 Pa s"]',
            "is not a key of a case; did you mean range?",
        ),
    ],
)
def test_a_sought_parameter_without_quotes_is_named(tmp_path: Path, lines: str, said: str) -> None:
    path = tmp_path / "shot.toml"
    path.write_text(f'extends = "reference_strike"\n{lines}\n')
    with pytest.raises(CaseError) as caught:
        load_case(path)
    (line,) = caught.value.errors
    assert line.endswith(said)
