"""What a wrong case is answered with: field, value, allowed range and remedy, all errors at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.case.case import case_hash, load_case
from birdstrike.solver.case.sections import quantities
from birdstrike.solver.case.settings import Prior
from birdstrike.solver.fields import Between
from tests.solver.case.wrong_cases import errors_with

QUANTITIES = [
    ("plate.thickness", "2 m", "~ = 2 m is outside 0.1 mm .. 50 mm; millimetres?"),
    ("plate.thickness", "-10 mm", "~ = -10 mm is outside 0.1 mm .. 50 mm; without the minus sign?"),
    ("plate.thickness", "10", '~ = 10 has no unit; write "10 mm" (accepted units: m, cm, mm, um, in)'),
    ("plate.thickness", "0.002", '~ = 0.002 has no unit; write "0.002 m" (accepted units: m, cm, mm, um, in)'),
    (
        "plate.thickness",
        "nan",
        '~ = nan must be text with a unit such as "0.1 mm" (accepted units: m, cm, mm, um, in)',
    ),
    ("bird.mass", "3", '~ = 3 has no unit; write "3 kg" (accepted units: kg, g, t, lb)'),
    ("bird.material.pressure_cutoff", "0.3 MPa", "~ = 0.3 MPa is outside -1000 MPa .. 0 MPa; with a minus sign?"),
    ("bird.material.tension_erosion", '"0.3"', "~ = 0.3 is dimensionless: write a bare number"),
    ("bird.material.eos.S1", "nan", "~ = nan is not a finite number"),
    ("bird.particles", "50", "~ = 50 is outside 100 .. 200000"),
    ("bird.particles", "1e9", "~ = 1000000000.0 must be a whole number in 100 .. 200000"),
    ("bird.particles", "4500.0", "~ = 4500.0 must be a whole number in 100 .. 200000; write 4500"),
    ("plate.elements", "50", "~ = 50 must be a list in brackets"),
    ("plate.elements", "[50, 1]", "~.1 = 1 is outside 2 .. 400"),
    ("impact", "3", "~ = 3 must be a table of keys"),
]
NAMES = [
    ("plate.lenght", "1 m", "~ is not a key of a case; did you mean length?"),
    ("bird.material.presure_cutoff", "-1 MPa", "~ is not a key of a case; did you mean pressure_cutoff?"),
    ("solver.corant", "0.3", "~ is not a key of a case; did you mean courant?"),
    ("bird.shape", "elipsoid", '~ = elipsoid is unknown; did you mean "ellipsoid"?'),
    (
        'sensors."a b".kind',
        "displacement",
        'sensors."a b" cannot be a column\'s name; use letters, digits and _ (not time, run or ..._sigma)',
    ),
]
SHARE = 'a percentage of the largest value that contact_force recorded, such as "2 %"'
NOT_YET = [
    ("bird.material.model", "elastik", '~ = elastik is unknown; did you mean "elastic"?'),
    ("bird.material.eos.kind", "porus", '~ = porus is unknown; did you mean "porous"?'),
    (
        "effects.clamp_rotation",
        "1 mm",
        '~ = 1 mm is not understood: "1 mm" is not in a unit of this dimension; accepted units: rad/N, mrad/kN',
    ),
    ("effects.plate_thicknes", "1 mm", "~ = 1 mm is no effect; did you mean plate_thickness?"),
    ("inversion.nuisance.wind", "1 m/s", "~ = 1 m/s is unknown; available: time_offset, speed, mass, thickness, angle"),
    ("inversion.discrepancy.contact_force", "0.02", f"~ = 0.02 must be {SHARE}"),
    ("inversion.discrepancy.contact_force", "2 kN", f'~ = 2 kN is not understood: "2 kN" is not in "%"; write {SHARE}'),
    (
        "inversion.discrepancy.contact_force",
        "two %",
        f'~ = two % is not understood: "two %" is not a number with "%"; write {SHARE}',
    ),
    ("inversion.discrepancy.contact_force", "-2 %", f"~ = -2 % is outside 0 % .. 100 %; it is {SHARE}"),
    (
        "inversion.discrepancy.force",
        "2 %",
        "~ belongs to no sensor of the case; its sensors: displacement_centre, contact_force, reaction_force",
    ),
]
BETWEEN_FIELDS = [
    ("bird.length", "9 cm", "~ = 9 cm is less than the diameter; length is overall, hemispheres included"),
    ("plate.material.tangent_modulus", "71 GPa", "~ = 71 GPa is not below young; megapascals?"),
    (
        "time.snapshots",
        '["1 ms", "4 ms"]',
        """~: "4 ms" is after time.end = 3 ms; leave it out, such as --set time.snapshots='["1 ms"]'""",
    ),
    ("sensors.displacement_centre.at", '["3 m", "0 m"]', "~.0 = 3 m is outside -2500 mm .. 2500 mm; millimetres?"),
    (
        "sensors.contact_force.at",
        '["0 m", "0 m"]',
        "~ = ['0 m', '0 m']: only displacement, strain and pressure sensors have a place; leave it out",
    ),
    (
        "sensors.contact_force.radius",
        "5 mm",
        "~ = 5 mm: only a pressure sensor has a radius; leave it out",
    ),
    (
        "sensors.gauge_m.kind",
        "strain",
        'sensors.gauge_m: its column, which has no unit, would be read as that of "gauge" in the unit "m"; use another '
        "name",
    ),
    (
        "sensors.gauge_.kind",
        "strain",
        'sensors.gauge_: its column, which has no unit, would be read as that of "gauge"; use another name',
    ),
    ("plate.rigid", "yes", "~ = yes must be true or false, without quotes"),
]
INVERSION = [
    ("viscsity", "[1, 2]", "~ = [1, 2] belongs to no quantity of a case; did you mean bird.material.viscosity?"),
    ("viscosity", '["2 Pa s", "1 Pa s"]', "~ = ['2 Pa s', '1 Pa s'] must rise: the lower limit first"),
    (
        "viscosity",
        '["1 Pa s", "1.000000000000001 Pa s"]',
        "~ = ['1 Pa s', '1.000000000000001 Pa s'] must rise: the lower limit first",
    ),
    ("viscosity", '["1 Pa s"]', """~ = ['1 Pa s'] must be two limits such as ["0 Pa s", "10000 Pa s"]"""),
    ("viscosity", '[1, "2 Pa s"]', '~.0 = 1 has no unit; write "1 Pa s" (accepted units: Pa s, MPa ms, N*ms/mm^2)'),
]


@pytest.mark.parametrize(("key", "text", "expected"), [*QUANTITIES, *NAMES, *NOT_YET, *BETWEEN_FIELDS])
def test_each_mistake_is_one_line_of_field_value_and_remedy(key: str, text: str, expected: str) -> None:
    assert errors_with({key: text}) == [expected.replace("~", key)]


@pytest.mark.parametrize(("parameter", "text", "expected"), INVERSION)
def test_a_wrong_range_of_a_parameter_is_one_line(parameter: str, text: str, expected: str) -> None:
    key = f'inversion.parameters."bird.material.{parameter}".range'
    assert errors_with({key: text}) == [expected.replace("~", key)]


def test_a_sensor_off_the_plate_is_named_with_the_plates_size() -> None:
    (line,) = errors_with({"sensors.displacement_centre.at": '["300 mm", "0 mm"]'})
    assert line == (
        'sensors.displacement_centre.at: "300 mm" is off the plate; within half of plate.length = 525 mm of its centre'
    )


def test_a_sensors_noise_is_in_the_unit_of_its_kind() -> None:
    (line,) = errors_with({"sensors.contact_force.noise": "0.1 mm"})
    assert line.endswith('"0.1 mm" is not in a unit of this dimension; accepted units: N, kN')


def test_a_wrong_nuisance_is_named_with_its_value() -> None:
    (line,) = errors_with({"inversion.nuisance.time_offset": "5"})
    assert line == 'inversion.nuisance.time_offset = 5 has no unit; write "5 ms" (accepted units: s, ms, us)'


def test_a_parameters_entry_holds_nothing_but_its_range() -> None:
    (line,) = errors_with({'inversion.parameters."bird.material.viscosity".key': "plate.thickness"})
    assert line == 'inversion.parameters has an entry with a key named "key"; known here: range, scale, prior'


@pytest.mark.parametrize(
    ("prior", "complaint"),
    [
        ('"1 Pa s"', 'must be a mean and a standard deviation such as { mean = "600 Pa s", sd = "240 Pa s" }'),
        ('{ mean = "300 Pa s" }', 'must be a mean and a standard deviation such as { mean = "600 Pa s", sd = '),
        ('{ mean = "1300 Pa s", sd = "80 Pa s" }', "has its mean outside the range, 0 Pa s .. 1200 Pa s"),
        ('{ mean = "300 Pa s", sd = "0 Pa s" }', "has a standard deviation that is not above 0; to fix the value, "),
        (
            '{ mean = "300 Pa s", sd = "400 Pa s" }',
            "tells no more than the range does, whose own is 346.41 Pa s; leave",
        ),
        ('{ mean = "300 Pa s", sd = "80 mm" }', '.prior.sd = 80 mm is not understood: "80 mm" is not in a unit'),
        ('{ mean = 300, sd = "80 Pa s" }', '.prior.mean = 300 has no unit; write "300 Pa s"'),
    ],
)
def test_a_wrong_prior_is_named_with_a_remedy(prior: str, complaint: str) -> None:
    sought = 'inversion.parameters."bird.material.viscosity"'
    (line,) = errors_with({f"{sought}.range": '["0 Pa s", "1200 Pa s"]', f"{sought}.prior": prior})
    assert ".prior" in line
    assert complaint in line


def test_a_priors_standard_deviation_needs_not_lie_in_the_keys_own_range() -> None:
    """A density is at least 100 kg/m^3, its standard deviation is not; and a history does not hang on either."""
    stated = {"range": ["900 kg/m^3", "1000 kg/m^3"], "prior": {"mean": "950 kg/m^3", "sd": "10 kg/m^3"}}
    case = load_case("reference_strike_156mm", {'inversion.parameters."bird.density"': stated})
    assert case.priors["bird.density"] == Prior(mean=950.0, sd=10.0)
    assert case_hash(case) == case_hash(load_case("reference_strike_156mm"))


def test_every_wrong_nuisance_and_every_wrong_limit_is_named() -> None:
    wrong = {"inversion.nuisance.speed": "1 s", "inversion.nuisance.wind": "3", "inversion.nuisance.time_offset": "5"}
    assert {line.split(" = ")[0] for line in errors_with(wrong)} == set(wrong)
    key = 'inversion.parameters."bird.material.viscosity".range'
    assert [line.split(" = ")[0] for line in errors_with({key: '["abc", "def"]'})] == [f"{key}.0", f"{key}.1"]


@pytest.mark.parametrize("kind", [{}, {"sensors.gauge.kind": "force"}])
def test_a_sensor_without_a_valid_kind_does_not_hide_its_bad_noise(kind: dict[str, str]) -> None:
    found = errors_with({**kind, "sensors.gauge.noise": "loud"})
    assert [line.split(" ")[0] for line in found] == ["sensors.gauge.kind", "sensors.gauge.noise"]
    assert found[1] == (
        'sensors.gauge.noise = loud fits no kind of sensor; write a length or a force such as "0.1 mm" or "0.1 kN"'
    )


@pytest.mark.parametrize(
    ("parameter", "span", "reason"),
    [
        ("time.end", '["1 ms", "2 ms"]', "it says what is computed and recorded, not what is struck"),
        ("time.output_interval", '["1 us", "2 us"]', "it says what is computed and recorded, not what is struck"),
    ],
)
def test_what_no_inversion_can_vary_is_refused_as_a_parameter(parameter: str, span: str, reason: str) -> None:
    (line,) = errors_with({f'inversion.parameters."{parameter}".range': span})
    assert line.startswith(f'inversion.parameters."{parameter}".range = ')
    assert line.endswith(f" cannot be a parameter: {reason}")


def test_a_setting_that_another_undoes_is_an_error() -> None:
    assert errors_with({"plate": "3", "plate.thickness": "9 mm"}) == [
        "--set plate is undone by another --set; keep one of them"
    ]
    assert load_case("reference_strike", {"plate": '{thickness = "9 mm"}', "plate.width": "0.3 m"}).plate.width == 0.3


def test_a_missing_case_to_extend_is_named_with_the_file_that_asks_for_it(tmp_path: Path) -> None:
    case = tmp_path / "mine.toml"
    case.write_text('extends = "nowhere_at_all"\n')
    with pytest.raises(CaseError) as caught:
        load_case(case)
    assert caught.value.errors[0].startswith(f'{case}: extends: "nowhere_at_all" is no case here')


def test_too_few_outputs_are_named() -> None:
    (line,) = errors_with({"time.output_interval": "0.8 ms", "time.end": "1.5 ms", "time.snapshots": "[]"})
    assert line.startswith("time.output_interval = 0.8 ms leaves fewer than 3 outputs before time.end = 1.5 ms; write")


def test_a_default_is_judged_like_a_written_key() -> None:
    case = written_reference(without="output_interval")
    with pytest.raises(CaseError) as caught:
        load_case(case, {"time.end": "0.008 ms", "time.snapshots": "[]"})
    (line,) = caught.value.errors
    assert line.startswith("time.output_interval = 5 us (the default) leaves fewer than 3 outputs before time.end")
    assert load_case(case, {"time.end": "0.01 ms", "time.snapshots": "[]"}).time.instants == (0.0, 5e-6, 1e-5)


def written_reference(without: str) -> dict[str, object]:
    """The reference strike's table without a key of its section `time`."""
    table = load_case("reference_strike").table
    del table["time"][without]
    return table


def test_all_errors_come_at_once_also_those_between_fields() -> None:
    found = errors_with(
        {
            "plate.thickness": "-1 mm",
            "plate.lenght": "1 m",
            "impact.speed": "91",
            "bird.material.viscosity": "1 kg",
            "time.snapshots": '["4 ms"]',
            "effects.x": "1",
        }
    )
    fields = {line.split(" ")[0].rstrip(":") for line in found}
    sections = {
        "plate.thickness",
        "plate.lenght",
        "impact.speed",
        "bird.material.viscosity",
        "time.snapshots",
        "effects.x",
    }
    assert fields == sections
    assert len(found) == 6


def test_mass_and_density_both_or_neither_is_an_error(tmp_path: Path) -> None:
    start = 'extends = "reference_strike"\n'
    (tmp_path / "both.toml").write_text(start + '[bird]\nmass = "1.8 kg"\ndensity = "938 kg/m^3"\n')
    with pytest.raises(CaseError, match="are both given"):
        load_case(tmp_path / "both.toml")
    whole = (Path(__file__).parents[3] / "data/cases/reference_strike.toml").read_text()
    without = "\n".join(line for line in whole.splitlines() if not line.startswith('density = "900'))
    (tmp_path / "neither.toml").write_text(without)
    with pytest.raises(CaseError, match=r"bird\.mass or bird\.density is missing"):
        load_case(tmp_path / "neither.toml")


def test_an_empty_case_names_every_missing_section(tmp_path: Path) -> None:
    (tmp_path / "empty.toml").write_text("")
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "empty.toml")
    assert caught.value.errors == [f"{name} is missing" for name in ("plate", "bird", "impact", "time")]


def test_a_missing_quantity_is_named_with_its_range(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[impact]\n")
    with pytest.raises(CaseError, match=r"impact\.speed is missing; give a value in 0\.1 m/s \.\. 1000 m/s"):
        load_case(tmp_path / "c.toml")


@pytest.mark.parametrize("mark", [pytest.param(mark, id=key) for key, mark in quantities()])
def test_every_quantity_accepts_its_bounds_and_nothing_beyond(mark: Between) -> None:
    low, high = mark.bounds
    assert low < high
    assert mark.validate(mark.low) == low
    assert mark.validate(mark.high) == high
    beyond = f"{2.0 * high + 1.0!r} {mark.unit}" if mark.unit else 2.0 * high + 1.0
    with pytest.raises(ValueError, match="outside"):
        mark.validate(beyond)
