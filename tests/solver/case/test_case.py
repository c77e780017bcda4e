"""Cases: the reference strike's numbers, what a hash follows, and cases made from cases."""

from __future__ import annotations

import math
import pickle
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from birdstrike.data.errors import CaseError
from birdstrike.solver.bird.shape import volume
from birdstrike.solver.case.case import Case, case_hash, load_case
from birdstrike.solver.case.write import copy_case
from tests.solver.case.wrong_cases import raised

REFERENCE = load_case("reference_strike")


def hash_with(**settings: str) -> str:
    return case_hash(load_case("reference_strike", {key.replace("__", "."): text for key, text in settings.items()}))


def test_reference_strike_keeps_the_stated_mass_and_dimensions() -> None:
    assert REFERENCE.bird.actual_mass == pytest.approx(1.800, abs=5e-4)
    assert (REFERENCE.bird.diameter, REFERENCE.bird.length) == (0.106, 0.262)
    assert (REFERENCE.plate.length, REFERENCE.plate.width, REFERENCE.plate.thickness) == (0.525, 0.43, 0.01)
    assert REFERENCE.plate.elements == (50, 40)
    assert REFERENCE.normal_speed == pytest.approx(45.55, abs=1e-9)


def test_the_156_mm_reading_weighs_one_kilogram() -> None:
    case = load_case("reference_strike_156mm")
    assert case.bird.actual_mass == pytest.approx(1.00, abs=5e-3)
    assert case.bird.length == 0.156
    assert case.plate == REFERENCE.plate


def test_radius_53_and_cylinder_156_weigh_1876_grams_at_the_papers_density() -> None:
    assert 938.0 * volume("hemispherical_cylinder", 0.106, 0.262) == pytest.approx(1.876, abs=1e-3)


def test_the_shapes_have_their_textbook_volumes() -> None:
    assert volume("sphere", 0.1, 0.1) == pytest.approx(math.pi * 1e-3 / 6)
    assert volume("cylinder", 0.1, 0.2) == pytest.approx(math.pi * 0.01 / 4 * 0.2)
    assert volume("ellipsoid", 0.1, 0.1) == pytest.approx(volume("sphere", 0.1, 0.1))
    assert volume("hemispherical_cylinder", 0.1, 0.1) == pytest.approx(volume("sphere", 0.1, 0.1))
    with pytest.raises(ValueError, match="cube"):
        volume("cube", 0.1, 0.1)


def test_mass_gives_the_density_of_the_ideal_shape() -> None:
    case = load_case("reference_strike", {"bird.mass": "1.8 kg"})
    assert case.bird.density is None
    assert case.bird.actual_density == 1.8 / volume("hemispherical_cylinder", 0.106, 0.262)


def test_a_sphere_needs_no_length() -> None:
    table = {"bird.shape": "sphere", "bird.length": "106 mm"}
    assert load_case("reference_strike", table).bird.length == 0.106


def test_the_four_parameters_come_in_the_papers_order_with_its_ranges() -> None:
    found = [(p.name.rsplit(".", 1)[1], p.low, p.high, p.unit) for p in REFERENCE.parameters()]
    assert found == [
        ("pressure_cutoff", -1.25e6, -0.05e6, "Pa"),
        ("viscosity", 0.0, 1500.0, "Pa s"),
        ("tension_erosion", 0.05, 1.25, ""),
        ("compression_erosion", 0.05, 1.25, ""),
    ]
    assert REFERENCE.inversion.nuisance == {"time_offset": 1e-4}


def test_erosion_limits_beyond_one_are_inactive() -> None:
    assert REFERENCE.bird.material.inactive == ("tension_erosion",)
    other = REFERENCE.with_values({"bird.material.tension_erosion": 1.1, "bird.material.compression_erosion": 1.0})
    assert other.bird.material.inactive == ("compression_erosion",)
    off = REFERENCE.with_values({"bird.material.tension_erosion": 0.0, "bird.material.compression_erosion": 0.0})
    assert off.bird.material.inactive == ("tension_erosion", "compression_erosion")


def test_with_values_sets_si_values_bit_for_bit_and_leaves_the_case_alone() -> None:
    value = 0.1 + 0.2
    other = REFERENCE.with_values({"bird.material.viscosity": value, "plate.thickness": 0.0123456789012345})
    assert other.bird.material.viscosity == value
    assert other.plate.thickness == 0.0123456789012345
    assert REFERENCE.bird.material.viscosity == 641.0
    back = other.with_values({"bird.material.viscosity": 641.0, "plate.thickness": 0.01})
    assert back.canonical() == REFERENCE.canonical()


def test_with_values_validates() -> None:
    with pytest.raises(CaseError, match=r"bird\.material\.viscosity = -1\.0 Pa s is outside"):
        REFERENCE.with_values({"bird.material.viscosity": -1.0})
    with pytest.raises(CaseError, match=r"bird\.material\.viscsity is no quantity"):
        REFERENCE.with_values({"bird.material.viscsity": 1.0})


def test_with_values_replaces_the_density_by_a_mass() -> None:
    other = REFERENCE.with_values({"bird.mass": 1.5})
    assert other.bird.actual_mass == 1.5


def test_the_hash_ignores_how_a_length_is_written() -> None:
    assert hash_with(plate__thickness="1 cm") == hash_with(plate__thickness="0.01 m") == case_hash(REFERENCE)
    assert hash_with(bird__material__viscosity="0.641 MPa ms") == case_hash(REFERENCE)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("plate.thickness", "9.999999999 mm"),
        ("plate.edges", "pinned"),
        ("bird.particles", "4501"),
        ("bird.lattice", "cubic"),
        ("impact.aim", "first_touch"),
        ("time.output_interval", "4 us"),
        ("solver.courant", "0.3"),
        ("sensors.second.kind", "displacement"),
    ],
)
def test_the_hash_follows_what_changes_a_history(key: str, text: str) -> None:
    assert case_hash(load_case("reference_strike", {key: text})) != case_hash(REFERENCE)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("sensors.displacement_centre.noise", "1 mm"),
        ("solver.threads", "2"),
        ("inversion.nuisance.time_offset", "0.2 ms"),
        ('inversion.parameters."bird.material.viscosity".range', '["1 Pa s", "2 Pa s"]'),
    ],
)
def test_the_hash_ignores_what_changes_no_history(key: str, text: str) -> None:
    changed = load_case("reference_strike", {key: text})
    assert case_hash(changed) == case_hash(REFERENCE)
    assert changed.model_dump() != REFERENCE.model_dump()


def test_a_case_crosses_a_process_border() -> None:
    again = pickle.loads(pickle.dumps(REFERENCE))
    assert again == REFERENCE
    assert again.name == "reference_strike"
    assert again.with_values({"plate.thickness": 0.008}).plate.thickness == 0.008


def test_a_case_is_immutable() -> None:
    with pytest.raises(ValueError, match="frozen"):
        REFERENCE.plate.thickness = 1.0  # pyright: ignore[reportAttributeAccessIssue]


def test_no_sensors_mean_the_default_three(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "data/cases/reference_strike.toml").read_text()
    bare = "\n\n".join(part for part in text.split("\n\n") if not part.startswith("[sensors"))
    (tmp_path / "bare.toml").write_text(bare)
    case = load_case(tmp_path / "bare.toml")
    assert list(case.sensors) == ["displacement_centre", "contact_force", "reaction_force"]
    assert case_hash(case) == case_hash(REFERENCE)
    assert [sensor.unit for sensor in case.sensors.values()] == ["m", "N", "N"]


def extending(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def test_extends_merges_table_by_table(tmp_path: Path) -> None:
    extending(tmp_path, "thin", 'extends = "reference_strike"\n[plate]\nthickness = "8 mm"\n')
    text = 'extends = "thin.toml"\n[impact]\nspeed = "120 m/s"\n[bird]\nmass = "1 kg"\n'
    child = extending(tmp_path, "thin_fast", text)
    case: Case = load_case(child)
    assert (case.plate.thickness, case.plate.length, case.impact.speed) == (0.008, 0.525, 120.0)
    assert case.bird.actual_mass == 1.0
    assert case.name == "thin_fast"


def test_a_case_takes_away_what_it_does_not_want_of_the_one_that_it_extends(tmp_path: Path) -> None:
    """A sensor, and a sought parameter, whose name holds dots; the rest stays."""
    first, second = (load_case(name) for name in ("reference_strike", "reference_strike"))
    sensor, sought = next(iter(first.sensors)), next(iter(first.inversion.parameters))
    own = tmp_path / "own.toml"
    keys = [f"sensors.{sensor}", f'inversion.parameters."{sought}"']
    own.write_text(f"""extends = "reference_strike"\nwithout = {keys!r}\n""")
    found = load_case(own)
    assert set(second.sensors) - set(found.sensors) == {sensor}
    assert set(second.inversion.parameters) - set(found.inversion.parameters) == {sought}
    assert found.bird == first.bird
    assert load_case({"extends": "reference_strike", "without": keys}).sensors == found.sensors


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            'without = ["sensors.nose"]',
            'without: the case that is extended has no "sensors.nose"; under sensors it has ',
        ),
        ('without = ["a = 1"]', 'has no "a = 1"'),
        ('without = "sensors"', "without = sensors must be a list of dotted keys, such as "),
        ("without = [1]", "without = [1] must be a list of dotted keys"),
    ],
)
def test_what_cannot_be_taken_away_is_named(tmp_path: Path, line: str, said: str) -> None:
    own = tmp_path / "own.toml"
    own.write_text(f'extends = "reference_strike"\n{line}\n')
    with pytest.raises(CaseError) as caught:
        load_case(own)
    assert said in str(caught.value)


def test_nothing_is_taken_away_of_a_case_that_extends_none(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('without = ["sensors.nose"]\n')
    with pytest.raises(CaseError, match="it extends none"):
        load_case(own)


def test_extends_in_a_circle_is_named(tmp_path: Path) -> None:
    extending(tmp_path, "a", 'extends = "b.toml"\n')
    extending(tmp_path, "b", 'extends = "c.toml"\n')
    extending(tmp_path, "c", 'extends = "a.toml"\n')
    with pytest.raises(CaseError, match=r"a\.toml -> b\.toml -> c\.toml -> a\.toml"):
        load_case(tmp_path / "a.toml")
    with pytest.raises(CaseError, match="circle"):
        load_case(extending(tmp_path, "self", 'extends = "self.toml"\n'))


def test_extending_what_is_not_there_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match='did you mean "reference_strike"'):
        load_case(extending(tmp_path, "a", 'extends = "reference_stirke"\n'))
    with pytest.raises(CaseError, match="name of one case"):
        load_case(extending(tmp_path, "a", "extends = 3\n"))


def test_broken_toml_is_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"broken\.toml: not TOML: .*line 3"):
        load_case(extending(tmp_path, "broken", '[plate]\nlength = "1 m"\nwidth 430 mm\n'))


def test_overrides_read_text_numbers_lists_and_quoted_keys() -> None:
    overrides = {
        "plate.thickness": "8 mm",
        "plate.elements": "[25, 20]",
        "bird.material.eos.S1": "2.0",
        "plate.edges": '"pinned"',
        'inversion.parameters."bird.material.viscosity".range': '["10 Pa s", "20 Pa s"]',
    }
    case = load_case("reference_strike", overrides)
    assert (case.plate.thickness, case.plate.elements, case.plate.edges) == (0.008, (25, 20), "pinned")
    assert case.bird.material.eos.S1 == 2.0
    assert case.parameters()[1].high == 20.0
    with pytest.raises(CaseError, match="dotted case key"):
        load_case("reference_strike", {"plate thickness": "8 mm"})


def test_a_shorter_simulation_drops_the_snapshots_that_lie_after_its_end(tmp_path: Path) -> None:
    """Of the case that is shortened; snapshots named beside the new end stay an error."""
    assert load_case("demo", {"time.end": "1.2 ms"}).time.snapshots == (0.5e-3, 1e-3)
    short = tmp_path / "short.toml"
    short.write_text('extends = "demo"\n[time]\nend = "0.4 ms"\n')
    assert load_case(short).time.snapshots == ()
    with pytest.raises(CaseError, match=r"is after time\.end"):
        load_case("demo", {"time.end": "1.2 ms", "time.snapshots": '["2 ms"]'})


def test_overrides_are_numbers_and_lists_too() -> None:
    given = {"bird.particles": np.int64(300), "plate.elements": (25, 20), "bird.material.eos.S1": 2, "effects": {}}
    assert raised(lambda: load_case("reference_strike", given)) is None
    case = load_case("reference_strike", given)
    assert (case.bird.particles, case.plate.elements, case.bird.material.eos.S1) == (300, (25, 20), 2.0)


WRONG_IN_A_SCRIPT: list[tuple[Any, Any, str]] = [
    ("reference_strike", {"plate.thickness": 0.008}, 'plate.thickness = 0.008 has no unit; write "0.008 m"'),
    ("reference_strike", {5: "8 mm"}, "5 is not a dotted case key"),
    ("reference_strike", ["plate.thickness=8 mm"], "overrides are a table"),
    ("reference_strike", {"plate.thickness": 10**5000}, "plate.thickness is a whole number of over 300 digits"),
    ("reference_strike", {"effects.bird_porosity": 10**400}, "effects.bird_porosity is a whole number of over 300"),
    ({"a": 1}, {}, "plate is missing"),
    ({3: 1}, {}, "3 is no key of a case"),
    (load_case("reference_strike"), {}, "reference_strike is loaded already; case.with_values("),
    (3, {}, "a case is a file, a shipped case's name, a table or a loaded case, not 3"),
]


@pytest.mark.parametrize(("case", "overrides", "said"), WRONG_IN_A_SCRIPT, ids=lambda given: str(type(given)))
def test_what_a_script_gives_wrongly_is_named(case: Any, overrides: Any, said: str) -> None:
    error = raised(lambda: load_case(case, overrides))
    assert isinstance(error, CaseError)
    assert said in str(error)


def test_a_table_is_a_case_as_a_file_is(tmp_path: Path) -> None:
    table = {"extends": "reference_strike", "plate": {"thickness": "8 mm", "elements": (25, 20)}}
    text = 'extends = "reference_strike"\n[plate]\nthickness = "8 mm"\nelements = [25, 20]\n'
    assert case_hash(load_case(table)) == case_hash(load_case(extending(tmp_path, "thin", text)))


def test_a_case_keeps_the_hash_under_which_its_campaigns_are_stored() -> None:
    """Of the commit before sensors had a class for each kind; another one would orphan every campaign's folder."""
    assert case_hash(REFERENCE) == "bb6fa9ac790971e1"
    gauge = {"plate.rigid": "true", "sensors.p": '{kind="pressure"}'}
    assert case_hash(load_case("reference_strike", gauge)) == "28cdefd3f48c3e9e"


def test_a_copied_case_takes_its_baselines_along(tmp_path: Path) -> None:
    """Two of one name, and a shipped one: the copy needs nothing of the folders that they were in."""
    home, copy = tmp_path / "home", tmp_path / "copy"
    for folder in (home, home / "later"):
        folder.mkdir()
        (folder / "clean.csv").write_text(folder.name)
    baselines = ["clean.csv", "later/clean.csv", "openradioss_clean1"]
    (home / "shot.toml").write_text(f'extends = "reference_strike"\n[diagnosis]\nbaselines = {baselines}\n')
    case = load_case(home / "shot.toml")
    copy_case(case, copy)
    shutil.rmtree(home)
    shutil.move(copy, tmp_path / "moved")
    moved = load_case(tmp_path / "moved" / "case.toml")
    assert case_hash(moved) == case_hash(case)
    first, second, shipped = moved.diagnosis.baselines
    assert [Path(path).read_text() for path in (first, second)] == ["home", "later"]
    assert shipped == "openradioss_clean1"
    assert str(tmp_path) not in (tmp_path / "moved" / "case.toml").read_text()


def test_a_saved_case_is_read_back_as_the_same_case(tmp_path: Path) -> None:
    """With its effects, overrides and files, which lie in a folder of its own beside it."""
    (tmp_path / "clean.csv").write_text("clean")
    (tmp_path / "shot.toml").write_text('extends = "reference_strike"\n[diagnosis]\nbaselines = ["clean.csv"]\n')
    case = load_case(tmp_path / "shot.toml").with_values({"impact.speed": 90.0}).with_effects({"plate_thickness": 1e-4})
    case.save(str(tmp_path / "out" / "thin.toml"))
    again = load_case(tmp_path / "out" / "thin.toml")
    assert case_hash(again) == case_hash(case)
    assert (again.table["effects"], again.name) == (case.table["effects"], "thin")
    assert again.inversion == case.inversion
    assert (tmp_path / "out" / "thin" / "baselines" / "clean.csv").read_text() == "clean"


def test_cases_of_several_shots_in_one_folder_keep_their_own_files(tmp_path: Path) -> None:
    """Two baselines of one name, one a case: neither case takes the other's."""
    names = {"case.toml": "", "diagnosis_fast.toml": "diagnosis_fast/"}
    for name, place in names.items():
        home = tmp_path / name
        home.mkdir()
        (home / "clean.csv").write_text(name)
        (home / "shot.toml").write_text('extends = "reference_strike"\n[diagnosis]\nbaselines = ["clean.csv"]\n')
        copy_case(load_case(home / "shot.toml"), tmp_path / "out", name, place)
        shutil.rmtree(home)
    for name in names:
        (baseline,) = load_case(tmp_path / "out" / name).diagnosis.baselines
        assert Path(baseline).read_text() == name
