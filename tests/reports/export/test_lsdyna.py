"""Cards for LS-DYNA: read back, they are the case's constants in the unit system of the head."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

import pytest
from typer.testing import CliRunner

import birdstrike.inversion.forward
from birdstrike import export
from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.data.unit_systems import SYSTEMS, unit_system
from birdstrike.inversion.extras import Extras
from birdstrike.inversion.train_and_invert import train_and_invert
from birdstrike.reports.export import lsdyna
from birdstrike.reports.export.cards import cards_of
from birdstrike.reports.export.exported import read_export
from birdstrike.reports.export.lsdyna import lsdyna_deck
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.case.case import load_case
from tests.inversion import small_campaign

COLUMN = 5e-4
"""Half of the last of the four digits that the column of a negative number keeps."""


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished campaign and its inversion by the emulator, a formula in the solver's place."""
    folder = tmp_path_factory.mktemp("export")
    small_campaign.build(folder / "doe")
    small_campaign.write_record(folder / "record.csv")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)
        train_and_invert(
            folder / "doe",
            folder / "record.csv",
            folder / "inversion",
            method="emulator",
            extras=Extras(refine=0, posterior=False),
        )
    return folder


def read_back(text: str) -> dict[str, list]:
    """Keywords of a deck by their name, as ansys-dyna-core reads them."""
    from ansys.dyna.core import Deck

    deck = Deck()
    deck.loads(text)
    assert not list(deck.string_keywords), "ansys-dyna-core does not know every keyword that was written"
    found: dict[str, list] = {}
    for keyword in deck.keywords:
        found.setdefault(keyword.get_title(), []).append(keyword)
    return found


@pytest.mark.parametrize("name", SYSTEMS)
def test_null_material_and_grueneisen_read_back_in_every_unit_system(name: str) -> None:
    system, case = unit_system(name), load_case("reference_strike")
    text = lsdyna_deck(read_export("reference_strike"), system)
    (null,), (law,) = (read_back(text)[key] for key in ("*MAT_NULL", "*EOS_GRUNEISEN"))
    material, eos = case.bird.material, case.bird.material.eos
    assert null.ro == pytest.approx(system.value(900.0, "kg/m^3"), rel=COLUMN)
    assert null.pc == pytest.approx(system.value(material.pressure_cutoff, "Pa"), rel=COLUMN)
    assert null.mu == pytest.approx(system.value(material.viscosity, "Pa s"), rel=COLUMN)
    assert (null.cerod, law.s1, law.v0) == (0.9295, 2.48, 1.0)
    assert law.c == pytest.approx(system.value(eos.C, "m/s"), rel=COLUMN)
    assert f"Units {name}: {', '.join(name.split('-')[:3])}; hence stress {name.split('-')[3]}" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("name", SYSTEMS)
def test_unit_systems_are_consistent(name: str) -> None:
    """Newton's second law holds without a factor, and the stress has the name that stands in the system's."""
    system = unit_system(name)
    mass, length, time = (system.value(1.0, si) for si in ("kg", "m", "s"))
    assert system.value(1.0, "N") == pytest.approx(mass * length / time**2, rel=1e-14)
    assert system.value(1.0, "Pa") == pytest.approx(mass / (length * time**2), rel=1e-14)
    assert system.value(1.0, "Pa s") == pytest.approx(mass / (length * time), rel=1e-14)
    named = {"GPa": 1e9, "MPa": 1e6, "Pa": 1.0, "Mbar": 1e11}[system.stress]
    assert system.value(named, "Pa") == pytest.approx(1.0, rel=1e-14)


def test_the_papers_constants_stand_in_the_unit_of_the_paper() -> None:
    text = lsdyna_deck(read_export("reference_strike"), unit_system("mm-ms-g-MPa"))
    (null,) = read_back(text)["*MAT_NULL"]
    assert (null.mu, null.pc) == (0.641, -0.3705)


def test_the_other_three_models_read_back(loop: Path) -> None:
    system = unit_system("mm-ms-kg-GPa")
    deck = read_back(lsdyna_deck(read_export(loop), system))
    (elastic,), (plastic,), (hydro,) = (
        deck[f"*MAT_{name}"] for name in ("ELASTIC", "PLASTIC_KINEMATIC", "ELASTIC_PLASTIC_HYDRO")
    )
    (cubic,) = deck["*EOS_LINEAR_POLYNOMIAL"]
    assert (elastic.mid, plastic.mid, hydro.mid, cubic.eosid) == (2, 3, 4, 4)
    assert (elastic.e, elastic.pr) == (0.0689, 0.49)
    assert (plastic.sigy, plastic.fs, plastic.beta) == (6.894e-6, 1.25, 1.0)
    assert (hydro.g, hydro.sigy, hydro.eh, hydro.pc, hydro.fs) == (0.0102, 3e-5, 1.3e-4, -9e-4, 0.95)
    assert (cubic.c1, cubic.c2, cubic.c3) == (2.072, 6.217, 10.362)
    for material in (elastic, plastic, hydro):
        assert material.ro == deck["*MAT_NULL"][0].ro == 9e-7


def test_inverted_values_are_the_verified_ones_and_what_is_not_identified_says_so(loop: Path) -> None:
    system = unit_system("m-s-kg-Pa")
    text = lsdyna_deck(read_export(loop), system)
    found = json.loads((loop / "inversion" / "inversion.json").read_text())["methods"]["emulator"]["parameters"]
    (null,) = read_back(text)["*MAT_NULL"]
    assert null.mu == pytest.approx(found["bird.material.viscosity"]["value"], rel=COLUMN)
    comments = " ".join(line.lstrip("$ ") for line in text.splitlines() if line.startswith("$"))
    for key, estimate in found.items():
        word = "identified, " if estimate["identified"] else "NOT IDENTIFIED in "
        assert f"{key.removeprefix('bird.material.')}: {word}" in comments
    assert "SIMULATED, NOT MEASURED" in comments
    assert "Inverted by the emulator" in comments


def test_a_limit_that_erodes_nothing_is_written_as_off() -> None:
    text = lsdyna_deck(read_export("reference_strike"), unit_system("mm-ms-kg-GPa"))
    (null,) = read_back(text)["*MAT_NULL"]
    assert null.terod == 0.0
    assert "tension_erosion = 0.34 erodes nothing in birdstrike and is written as 0, off" in " ".join(text.split("$ "))


def test_what_erodes_in_birdstrike_needs_a_setting_of_lsdyna() -> None:
    for limit, said in (("0", False), ("1.1", True)):
        limits = {"bird.material.tension_erosion": limit, "bird.material.compression_erosion": "0"}
        export_of = read_export("reference_strike", settings=limits)
        text = lsdyna_deck(export_of, unit_system("mm-ms-kg-GPa"))
        assert ("IEROD = 2 and ICONT = 1" in " ".join(text.split())) == said


def test_no_tension_is_not_written_as_no_cutoff() -> None:
    """0 in *MAT_ELASTIC_PLASTIC_HYDRO means an unlimited tension; in *MAT_NULL it means none."""
    hydrodynamic = load_case("reference_strike_hydrodynamic", {"bird.material.pressure_cutoff": "0 MPa"})
    null = load_case("reference_strike", {"bird.material.pressure_cutoff": "0 MPa"})
    cards = [cards_of(case.bird.material, 900.0)[0] for case in (hydrodynamic, null)]
    assert [card.fields["pc"] for card in cards] == [(-1.0, "Pa"), (0.0, "Pa")]


def test_polynomial_from_k_is_written_as_its_cubic() -> None:
    """C1 = rho0 c0^2, C2 = (2k - 1) C1, C3 = (k - 1)(3k - 1) C1; water: k = 2."""
    eos = '{ kind = "polynomial_k", c0 = "1482.9 m/s", k = 2.0 }'
    case = load_case("reference_strike", {"bird.material.eos": eos})
    _, law = cards_of(case.bird.material, 900.0)
    stiffness = 900.0 * 1482.9**2
    expected = [stiffness, 3.0 * stiffness, 5.0 * stiffness]
    assert [law.fields[name][0] for name in ("c1", "c2", "c3")] == pytest.approx(expected, rel=1e-14)


def test_murnaghan_has_its_card_where_its_pressure_at_rest_is_0() -> None:
    eos = '{ kind = "murnaghan", B = "128 MPa", g = 7.98, p0 = "%s MPa" }'
    gauge, absolute = (load_case("reference_strike", {"bird.material.eos": eos % p0}).bird.material for p0 in (0, 1))
    _, law = cards_of(gauge, 900.0)
    assert (law.keyword, law.fields["k0"], law.fields["gamma"]) == ("EosMurnaghan", (1.28e8, "Pa"), (7.98, ""))
    with pytest.raises(UserError, match=r'"murnaghan" has no card of its own in LS-DYNA while p0 is not 0; export'):
        cards_of(absolute, 900.0)


def test_a_material_without_a_card_is_refused_by_name() -> None:
    class Gel(BirdMaterial):
        model: Literal["gel"] = "gel"

    with pytest.raises(UserError, match=r'bird\.material\.model = "gel" has no card in LS-DYNA; export .* null'):
        cards_of(Gel(), 900.0)


def test_cards_do_not_replace_a_file_of_results(tmp_path: Path) -> None:
    held = tmp_path / "inversion.json"
    held.write_text("{}")
    for deck in (True, False):
        with pytest.raises(UserError, match="exists, and its name is not that of a deck"):
            export("demo_rig", held, deck=deck)
    assert held.read_text() == "{}"


def test_a_law_without_a_card_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "porous.toml"
    path.write_text(
        'extends = "reference_strike"\n[bird.material]\nmodel = "null"\n'
        '[bird.material.eos]\nkind = "porous"\nmixing = "wood"\nz = 0.1\n'
    )
    with pytest.raises(UserError, match=r'bird\.material\.eos\.kind = "porous" has no card of its own'):
        lsdyna_deck(read_export(path), unit_system("mm-ms-kg-GPa"))


def test_without_the_extra_the_error_names_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(lsdyna, "import_module", missing)
    found = CliRunner().invoke(app, ["export", "demo", "--out", str(tmp_path / "bird.k")])
    assert found.exit_code == 1
    assert "birdstrike[lsdyna]" in " ".join(found.output.split())
    assert not (tmp_path / "bird.k").exists()


def test_command_says_where_the_file_is(loop: Path) -> None:
    found = CliRunner().invoke(app, ["export", str(loop), "--units", "mm-s-t-MPa", "--json"])
    assert found.exit_code == 0, found.output
    assert f"Written to {loop / 'bird.k'}, units mm-s-t-MPa. Next: " in found.stdout
    assert json.loads(found.stdout.splitlines()[-1])["out"] == str(loop / "bird.k")
    assert "*MAT_NULL" in (loop / "bird.k").read_text()


def test_wrong_units_another_case_and_an_absent_method_are_the_users_errors(loop: Path, tmp_path: Path) -> None:
    out = tmp_path / "bird.k"
    with pytest.raises(UserError, match="no unit system on offer; available: mm-ms-kg-GPa"):
        export(loop, out, units="furlong-fortnight")
    with pytest.raises(UserError, match="was inverted with"):
        export(loop, out, case="demo")
    with pytest.raises(UserError, match='"network" was not run; available: --method emulator'):
        export(loop, out, method="network")
    with pytest.raises(UserError, match=r"holds no inversion.json"):
        export(tmp_path, out)
    (tmp_path / "models.json").write_text("{}")
    with pytest.raises(
        UserError, match=r"models.json is damaged or of another version; repeat birdstrike calibrate-models"
    ):
        export(tmp_path, out)
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "inversion.json").write_bytes((loop / "inversion" / "inversion.json").read_bytes())
    with pytest.raises(UserError, match="does not hold the case; name it: --case"):
        export(alone, out)
    export(alone, out, case=loop / "doe" / "case.toml")
    assert out.is_file()
