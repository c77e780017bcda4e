"""The page: one file that points nowhere else, with every section, and the numbers of inversion.json."""

from __future__ import annotations

import base64
import json
import re
from io import BytesIO
from pathlib import Path

import matplotlib.image as images
import numpy as np
import pytest

from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.storage.store import read_run
from birdstrike.inversion.misfit import rmse
from birdstrike.reports.page.page import report
from tests.reports.html import Page

MEGABYTE, CHANNEL = 1_000_000, "displacement_centre"
TITLES = (
    "Summary",
    "Test set-up",
    "The bird models side by side",
    "The impact in pictures",
    "The record as it was read",
    "The record (measured) and the simulated curves",
    "Inverted parameters",
    "Identifiability of the parameters",
    "The campaign's design",
    "Network and emulator",
    "Energy balance of every simulation",
    "To do it again",
)


@pytest.fixture(scope="module")
def parsed(page: Path) -> Page:
    return Page(page.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def parsed_simulated(simulated_page: Path) -> Page:
    return Page(simulated_page.read_text(encoding="utf-8"))


def number(cell: str) -> float:
    """`−0.596 MPa` -> -0.596."""
    found = re.match(r"[+−]?[\d.]+(?:e-?\d+)?", cell)
    assert found, cell
    return float(found[0].replace("−", "-"))


def test_page_loads_nothing_from_outside(page: Path, parsed: Page) -> None:
    assert parsed.references
    assert all(reference.startswith(("#", "data:")) for reference in parsed.references)
    text = page.read_text(encoding="utf-8")
    assert not re.search(r"@import|url\((?!#)|<script[^>]*\bsrc|<link rel=\"stylesheet\"|<iframe", text)
    assert "default-src 'none'" in text, "the browser itself refuses what would be fetched"
    assert set(re.findall(r"https?://[^\s\"'<>]+", text)) <= {"http://www.w3.org/2000/svg"}


def test_page_stays_far_below_10_megabytes(page: Path) -> None:
    assert 0.5 * MEGABYTE < page.stat().st_size < 5 * MEGABYTE


def test_every_section_is_there_in_order(parsed: Page) -> None:
    assert [heading.split(" ", 1)[1] for heading in parsed.text["h2"]] == list(TITLES)


def test_ids_are_unique_so_that_no_figure_borrows_another_ones_marks(parsed: Page) -> None:
    repeated = {name for name in parsed.ids if parsed.ids.count(name) > 1}
    # within one figure matplotlib repeats the id of a clip box that two of its parts share
    assert {name for name in repeated if not re.match(r"[\w-]+?-p[0-9a-f]{10}$", name)} == set()


def test_every_drawing_is_named_by_its_caption(page: Path, parsed: Page) -> None:
    """A reader's program said "graphic" and nothing more."""
    drawings = re.findall(r'<svg [^>]*role="img"[^>]*>', page.read_text(encoding="utf-8"))
    named = [re.search(r'aria-labelledby="([^"]+)"', one) for one in drawings]
    assert drawings
    assert all(one and one[1] in parsed.ids for one in named)


def test_every_figure_is_drawn(parsed: Page) -> None:
    wanted = {"setup", "comparison-displacement_centre", "prior-predictive-displacement_centre", "parameters", "design"}
    wanted |= {f"models-{sensor}" for sensor in ("displacement_centre", "contact_force", "reaction_force")}
    wanted |= {"training", "animation", "stress", "shapes", "posterior", "sobol-displacement_centre"}
    wanted |= {"record-displacement_centre"}
    assert set(parsed.figures) == {f"figure-{name}" for name in wanted}
    for name, drawn in parsed.figures.items():
        if name not in parsed.pictures and name != "figure-animation":
            assert drawn > 20, f"{name} has {drawn} elements"


def test_every_picture_holds_more_than_paper(parsed: Page) -> None:
    assert len(parsed.pictures) == 3
    for name, address in parsed.pictures.items():
        assert address.startswith("data:image/png;base64,")
        pixels = images.imread(BytesIO(base64.b64decode(address.split(",", 1)[1])))[..., :3]
        assert np.mean(np.any(pixels < 0.95, axis=-1)) > 0.05, name


def test_verified_errors_are_those_of_inversion_json(finished: Path, parsed: Page) -> None:
    content = json.loads((finished / "inversion" / "inversion.json").read_text())
    rows = {row[0].split()[0]: row for row in parsed.table("verification runs")[1:]}
    assert set(rows) == {"network", "emulator"}
    assert rows[content["best"]][0].endswith("(best)")
    for method, answer in content["methods"].items():
        rmse, relative, unshifted, predicted = (number(cell) for cell in rows[method][1:5])
        assert rmse == pytest.approx(1e3 * answer["verified_rmse"], rel=5e-3)
        assert relative == pytest.approx(1e2 * answer["verified_relative"], rel=5e-2)
        channel = answer["channels"]["displacement_centre"]
        assert unshifted == pytest.approx(1e3 * channel["verified_rmse_at_zero_offset"], rel=5e-3)
        assert predicted == pytest.approx(1e3 * answer["predicted_rmse"], rel=5e-3)


def test_identified_parameters_are_those_of_inversion_json(finished: Path, parsed: Page) -> None:
    content = json.loads((finished / "inversion" / "inversion.json").read_text())
    symbols = {"PC": "pressure_cutoff", "MU": "viscosity", "TEROD": "tension_erosion", "CEROD": "compression_erosion"}
    scale = {"Pa": 1e-6, "Pa s": 1.0, "": 1.0}
    seen, name = set(), ""
    for label, _, method, value, interval, identified, reason in parsed.table("parameters by each method")[1:]:
        name = f"bird.material.{symbols[label.split()[-1]]}" if label else name
        told = content["methods"][method]["parameters"][name]
        assert identified == ("yes" if told["identified"] else "no")
        assert reason == told["reason"]
        seen.add((method, name))
        if not told["identified"]:
            assert (value, interval) == ("–", "whole range")
            continue
        factor = scale[told["unit"]]
        assert number(value) == pytest.approx(factor * told["value"], rel=5e-3)
        assert [number(end) for end in interval.split(" to ")] == pytest.approx(
            [factor * end for end in told["interval_95"]], rel=5e-3
        )
    assert len(seen) == 8
    assert any(p["identified"] for p in content["methods"][content["best"]]["parameters"].values())


def test_errors_of_the_models_are_those_of_their_stored_runs(finished: Path, parsed: Page) -> None:
    """The best method's row repeats its verified error; each standard bird's is recomputed from its stored run."""
    content = json.loads((finished / "inversion" / "inversion.json").read_text())
    rows = {row[0]: row for row in parsed.table("Errors of the simulated curves")[1:]}
    best = content["methods"][content["best"]]
    assert number(rows[f"inverted NULL ({content['best']})"][1]) == pytest.approx(1e3 * best["verified_rmse"], rel=5e-3)
    record = read_measured(finished / "shot7.csv")
    runs = {read_run(path).summary["case_hash"]: read_run(path) for path in (finished / "models" / "runs").glob("*.h5")}
    assert len(runs) == 4
    for row in list(rows.values())[:3]:
        offset = 1e-3 * number(row[-1])
        instants = np.maximum(record.time - offset, 0.0)
        curves = [run.at(CHANNEL, instants) for run in runs.values()]
        errors = [1e3 * rmse(curve, record.channels[CHANNEL]) for curve in curves]
        assert min(abs(error - number(row[1])) for error in errors) < 0.01, row


def test_the_end_state_says_impulse_deflection_and_penetration(parsed: Page) -> None:
    rows = parsed.table("State at the end of the simulations")[1:]
    assert len(rows) == 4
    for row in rows:
        assert number(row[2]) == pytest.approx(46.0, rel=1e-2), "the stand-in's impulse"
        assert row[4:6] == ["0 mm", "no"], "its plate never yields"


def test_constants_carry_units_and_are_the_shipped_ones(parsed: Page) -> None:
    rows = dict(parsed.table("The constants behind the models")[1:])
    assert rows["elastic"] == "elastic, young 68.9 MPa, poisson 0.49"
    assert "yield stress 0.03 MPa" in rows["hydrodynamic"]
    assert "C1 2072 MPa" in rows["hydrodynamic"]


def test_captions_are_made_of_the_numbers(parsed: Page) -> None:
    captions = " ".join(parsed.text["figcaption"])
    assert "elastic 8.00 mm at" in captions, "the stand-in's elastic peak"
    assert "plastic-kinematic 4.60 mm at" in captions
    assert len(parsed.text["figcaption"]) == len(parsed.figures)


def test_every_simulation_has_its_energy_balance(finished: Path, parsed: Page) -> None:
    rows = parsed.table("Energy error: of the initial")[1:]
    runs = json.loads((finished / "doe" / "summary.json").read_text())["runs"]
    assert [row[0] for row in rows] == [
        *(f"run {entry['run']}" for entry in runs),
        "verification, network",
        "verification, emulator",
        *(f"model, {title}" for title in ("elastic", "plastic-kinematic", "hydrodynamic", "inverted NULL (emulator)")),
    ]
    assert {number(row[1]) for row in rows} == {0.42}


def test_what_it_takes_to_do_it_again_is_there(finished: Path, parsed: Page) -> None:
    content = json.loads((finished / "inversion" / "inversion.json").read_text())
    made = dict(parsed.table("What made these numbers")[1:])
    assert made["campaign's case hash"] == content["case_hash"]
    assert all(answer["run"] in made["verification runs in the run store"] for answer in content["methods"].values())
    assert "numpy" in made["Python and libraries"]
    case = dict(parsed.table("all that changes a history")[1:])
    assert json.loads(case["plate.thickness"]) == 0.01


def test_a_simulated_record_is_never_called_measured(parsed_simulated: Page) -> None:
    said = [*(parsed_simulated.text[tag] for tag in ("title", "h1", "h2", "header", "figcaption", "caption"))]
    for text in (line for lines in said for line in lines):
        assert not re.search(r"(?<!not )\bmeasured\b", text, re.IGNORECASE), text
    assert any("simulated by LS-DYNA" in text for text in parsed_simulated.text["figcaption"])
    assert "The record (simulated by LS-DYNA) and the simulated curves" in parsed_simulated.text["h2"][5]


def test_a_record_outside_all_simulations_is_warned_of_at_the_top(parsed_simulated: Page) -> None:
    assert "the model cannot produce this curve" in parsed_simulated.text["aside"][0]
    rows = parsed_simulated.table("parameters by each method")[1:]
    assert {row[5] for row in rows} == {"no"}
    assert {row[3] for row in rows} == {"–"}


def test_a_folder_that_does_not_exist_names_the_command(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="birdstrike close-the-loop CASE --measured CSV --out"):
        report(tmp_path / "nothing")


def test_every_missing_part_is_named_with_its_command(tmp_path: Path) -> None:
    with pytest.raises(UserError) as caught:
        report(tmp_path)
    lines = caught.value.errors
    assert f"birdstrike run-doe CASE --out {tmp_path / 'doe'}" in lines[0]
    assert "birdstrike train-and-invert" in lines[1]
    assert f"birdstrike diagnose CASE --measured CSV --out {tmp_path / 'diagnosis'}" in lines[2]
    assert [name for name in ("inversion.json", "verification.csv") if any(name in line for line in lines)] == [
        "inversion.json",
        "verification.csv",
    ]


def test_an_inversion_of_another_campaign_is_refused(finished: Path, tmp_path: Path) -> None:
    for part in ("doe", "inversion"):
        (tmp_path / part).mkdir()
        for file in (finished / part).glob("*.*"):
            (tmp_path / part / file.name).write_bytes(file.read_bytes())
    path = tmp_path / "inversion" / "inversion.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "case_hash": "0" * 16}))
    with pytest.raises(UserError, match="another campaign"):
        report(tmp_path)
    path.write_text("{")
    with pytest.raises(UserError, match="damaged"):
        report(tmp_path)


def test_energy_balances_survive_without_the_run_store(finished: Path, tmp_path: Path) -> None:
    for part in ("doe", "inversion"):
        (tmp_path / part).mkdir()
        for file in (finished / part).glob("*.*"):
            (tmp_path / part / file.name).write_bytes(file.read_bytes())
    text = report(tmp_path, models=False).read_text(encoding="utf-8")
    rows = Page(text).table("Energy error: of the initial")[1:]
    assert len(rows) == 25
    assert {(row[1], row[5]) for row in rows} == {("+0.42 %", "–")}
    assert "There is no picture of the impact" in text
